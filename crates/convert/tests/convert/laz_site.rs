//! LAZ of a site: where its points lie, and which coordinates it says they have. Headers, records
//! and points are read by the specification's offsets.

use std::path::Path;

use nemoral_convert::{Crs, FormatName, LazCloudParams, OutputMode, laz_cloud, laz_note};
use nemoral_dataset::{
    Cloud, CloudParams, DatasetHeader, FrameData, LidarData, OpenMode, SiteSpec, Track,
    WorldTables, Writer,
};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{ChunkCoord, Twist};

use crate::common::{START, header, made_of, pose};
use crate::las::{LasFile, u16_at};

const ORIGIN_M: DVec3 = DVec3::new(553_220.0, 4_450_330.5, 73.25);

fn site(epsg: Option<u16>) -> DatasetHeader {
    let mut header = header();
    header.sequences[0].site = Some(SiteSpec {
        epsg,
        origin_m: ORIGIN_M.to_array(),
    });
    header
}

/// What a file says: flags, the offset of coordinates, the text of its system, and its points.
struct Read {
    flags: u16,
    offset_m: DVec3,
    low_m: DVec3,
    high_m: DVec3,
    wkt: Option<String>,
    points_m: Vec<DVec3>,
}

fn read(path: &Path) -> Read {
    let file = LasFile::read(path);
    Read {
        flags: u16_at(&file.bytes, 6),
        offset_m: file.vector(155, 8),
        low_m: file.vector(187, 16),
        high_m: file.vector(179, 16),
        points_m: file.points().map(|point| point.position_m()).collect(),
        wkt: file.wkt,
    }
}

fn near(a: DVec3, b: DVec3) -> bool {
    // Half a step, and what a double is exact to at 5,000 km.
    (a - b).abs().max_element() <= 0.5e-4 + 2e-9
}

#[test]
fn scans_of_a_site_lie_there_and_say_so() {
    let made = made_of(FormatName::Laz, &site(Some(25_829)));
    assert_eq!(made.done.notes, [""; 0]);
    let lidar = &header().sequences[0].lidars[0];
    for (i, frame) in [1_u64, 2, 4].into_iter().enumerate() {
        let file = read(&made.out.join(format!("00/top/{frame:06}.laz")));
        assert_eq!(file.flags, 1 << 4);
        let wkt = file.wkt.expect("a system");
        assert!(
            wkt.starts_with("PROJCS[\"ETRS89 / UTM zone 29N\","),
            "{wkt}"
        );
        assert!(wkt.ends_with("AUTHORITY[\"EPSG\",\"25829\"]]"), "{wkt}");
        assert_eq!(Some(wkt), Crs::of_epsg(25_829).and_then(|crs| crs.wkt));
        assert_eq!(file.offset_m, file.offset_m.round());
        assert!(
            (file.offset_m - START - ORIGIN_M).length() < 20.0,
            "{}",
            file.offset_m
        );
        let world_from_lidar = pose(frame).1 * lidar.body_from_lidar;
        let scan = &made.dataset.read_frame(i).expect("a frame").lidars[0].ply;
        assert_eq!(scan.len(), file.points_m.len());
        for (at_m, p) in file.points_m.iter().zip(scan) {
            let world_m = world_from_lidar.transform_point(p.point.position_m.as_dvec3());
            assert!(near(*at_m, world_m + ORIGIN_M), "{at_m} {world_m}");
            assert!(at_m.cmpge(file.low_m - 1e-8).all() && at_m.cmple(file.high_m + 1e-8).all());
        }
    }
}

#[test]
fn a_system_that_is_not_known_is_noted() {
    for (code, part) in [
        (None, "site.epsg says it"),
        // That of no system, and one in degrees.
        (Some(1024), "EPSG:1024 is not known"),
        (
            Some(4326),
            "EPSG:4326 is not known here as a projected system in metres",
        ),
    ] {
        let made = made_of(FormatName::Laz, &site(code));
        let [note] = &made.done.notes[..] else {
            panic!("{:?}", made.done.notes);
        };
        assert!(note.contains(part), "{note}");
        let file = read(&made.out.join("00/top/000001.laz"));
        assert_eq!((file.flags, file.wkt), (1 << 4, None));
        assert!(
            (file.offset_m - START - ORIGIN_M).length() < 20.0,
            "{}",
            file.offset_m
        );
        let cloud = Cloud::open(made.dataset.root(), CloudParams::default()).expect("a cloud");
        assert_eq!(laz_note(&cloud).as_ref(), Some(note));
    }
    // An invented world lies nowhere.
    let made = made_of(FormatName::Laz, &header());
    assert_eq!(made.done.notes, [""; 0]);
    let cloud = Cloud::open(made.dataset.root(), CloudParams::default()).expect("a cloud");
    assert_eq!((cloud.site(), laz_note(&cloud)), (None, None));
    assert_eq!(read(&made.out.join("00/top/000001.laz")).wkt, None);
}

#[test]
fn clouds_of_a_site_and_their_tiles_lie_there() {
    let made = made_of(FormatName::Laz, &site(Some(32_629)));
    let cloud = Cloud::open(made.dataset.root(), CloudParams::default()).expect("a cloud");
    assert_eq!(laz_note(&cloud), None);
    let mut expected = Vec::new();
    let put = |point: &nemoral_dataset::CloudPoint| {
        expected.push(point.world_m + ORIGIN_M);
        Ok::<_, nemoral_dataset::Error>(())
    };
    cloud.for_each(put).expect("points");
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("plot.laz");
    laz_cloud(&cloud, &out, &LazCloudParams::default()).expect("written");
    let file = read(&out);
    assert!(
        file.wkt
            .expect("a system")
            .contains("\"WGS 84 / UTM zone 29N\"")
    );
    assert_eq!(file.points_m.len(), expected.len());
    assert!(
        file.points_m
            .iter()
            .zip(&expected)
            .all(|(a, b)| near(*a, *b))
    );

    // A tile has the name of its corner in the site's coordinates.
    let tiled = LazCloudParams {
        tile_m: Some(10.0),
        ..LazCloudParams::default()
    };
    let tiles = laz_cloud(&cloud, &folder.path().join("t.laz"), &tiled).expect("written");
    assert!(tiles.len() > 1, "{tiles:?}");
    let mut count = 0;
    for tile in &tiles {
        let name = tile.path.file_stem().expect("a name").to_string_lossy();
        let numbers = name.split('_').skip(1);
        let corner: Vec<f64> = numbers
            .map(|n| 10.0 * n.parse::<f64>().expect("a number"))
            .collect();
        let file = read(&tile.path);
        assert!(file.wkt.is_some());
        for at in &file.points_m {
            let inside = |x: f64, low: f64| (low - 1e-4..=low + 10.0 + 1e-4).contains(&x);
            assert!(
                inside(at.x, corner[0]) && inside(at.y, corner[1]),
                "{at} {name}"
            );
        }
        count += file.points_m.len();
    }
    assert_eq!(count, expected.len());
}

#[test]
fn a_point_that_no_file_can_hold_is_refused() {
    let mut header = site(Some(25_829));
    header.sequences[0].cameras.clear();
    let folder = tempfile::tempdir().expect("a folder");
    let [dataset, out] = ["dataset", "out"].map(|name| folder.path().join(name));
    let mut points = crate::common::scan(&crate::common::header(), 0);
    points[7].position_m.x = 3e5;
    let writer = Writer::create(&dataset, OpenMode::Fresh, header).expect("create");
    let (time_s, world_from_body) = pose(0);
    let sensor_chunk = ChunkCoord::containing(START.truncate(), 50.0);
    let frame = FrameData {
        sequence: 0,
        index: 0,
        time_s,
        world_from_body,
        body_motion: Twist::STILL,
        balance: None,
        cameras: vec![],
        lidars: vec![LidarData {
            name: "top",
            points: &points,
            sensor_chunk,
        }],
        frame_key: [0; 32],
    };
    writer.write_frame(&frame).expect("frame");
    let track = Track {
        sequence: 0,
        poses: vec![(time_s, world_from_body)],
        balance: None,
        stands: false,
        estimated: Vec::new(),
        lines: Vec::new(),
        imu: None,
    };
    let objects = crate::common::objects();
    let world = WorldTables {
        objects: &objects,
        ..WorldTables::default()
    };
    writer.write_sequence(&track, &world).expect("tables");
    writer.finish().expect("finish");
    let error = crate::common::run(&dataset, &out, FormatName::Laz, OutputMode::Fresh);
    let error = error.expect_err("refused").to_string();
    assert!(
        error.contains("00/top/000000.laz") && error.contains("beyond 214 km"),
        "{error}"
    );
}
