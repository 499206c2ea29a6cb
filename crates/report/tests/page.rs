//! Pages of small data sets: what is on them, and what is refused.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::fs;
use std::path::Path;

use nemoral_dataset::{
    CameraData, CameraSpec, DatasetHeader, FrameData, LidarData, LidarSpec, OpenMode, Track,
    WorldTables, Writer,
};
use nemoral_report::{Error, MAX_SPECIES, MAX_WHOLE_FRAMES, report, report_within};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    AnnotationKinds, Annotations, ChunkCoord, Image, Intrinsics, ObjectId, Ontology,
    RigidTransform, Semantic, Shutter, TreeRecord, TruthImages, Twist,
};
use serde_json::Value;

const HOSTILE: &str = "# </script><script>alert(1)</script> <!-- \u{2028} \"'";

fn write(out: &Path, frames: u64, of: u64) {
    write_with(out, frames, of, &[]);
}

fn write_with(out: &Path, frames: u64, of: u64, trees: &[TreeRecord]) {
    let mut header = DatasetHeader::new("somebody", "1.0", u64::MAX, Ontology::paper());
    header.licence = HOSTILE.into();
    header.config_toml = HOSTILE.into();
    header.sequences[0].cameras = vec![CameraSpec {
        name: "eye".into(),
        intrinsics: Intrinsics::from_fov(32, 24, 1.0).expect("a camera"),
        body_from_camera: RigidTransform::body_from_optical(),
        annotations: AnnotationKinds::default(),
        shutter: Shutter::INSTANT,
        noisy: false,
        processed: false,
    }];
    header.sequences[0].lidars = vec![LidarSpec {
        name: "top".into(),
        body_from_lidar: RigidTransform::IDENTITY,
        deskewed: true,
        pointing_errors: false,
        ply: true,
    }];
    let whole = |value: f32| Image::new(32, 24, vec![value; 32 * 24]);
    let truth = TruthImages {
        semantic: whole(0.0).map(|_| Semantic::Rock),
        object: whole(0.0).map(|_| ObjectId::NONE),
        depth_m: whole(8.0),
        normal: whole(0.0).map(|_| Vec3::NEG_Z),
    };
    let pose = |index: u64| RigidTransform::from_xyz_rpy(DVec3::X * index as f64, 0.0, 0.0, 0.0);
    let writer = Writer::create(out, OpenMode::Fresh, header).expect("a new folder");
    let (rgb, annotations) = (whole(0.0).map(|_| [90, 80, 70]), Annotations::default());
    for index in 0..frames {
        let frame = FrameData {
            sequence: 0,
            index,
            time_s: index as f64,
            world_from_body: pose(index),
            body_motion: Twist::STILL,
            balance: None,
            cameras: vec![CameraData {
                name: "eye",
                rgb: &rgb,
                radiance: None,
                truth: &truth,
                annotations: &annotations,
            }],
            lidars: vec![LidarData {
                name: "top",
                points: &[],
                sensor_chunk: ChunkCoord::new(0, 0),
            }],
            frame_key: [0; 32],
        };
        writer.write_frame(&frame).expect("it fits its header");
    }
    let poses = (0..of).map(|i| (i as f64, pose(i))).collect();
    let track = Track {
        sequence: 0,
        poses,
        balance: None,
        stands: false,
        estimated: Vec::new(),
        lines: Vec::new(),
        imu: None,
    };
    let tables = WorldTables {
        trees,
        ..WorldTables::default()
    };
    writer.write_sequence(&track, &tables).expect("a track");
    writer.finish().expect("all is there");
}

/// The blocks of JSON of a page, by id.
fn blocks(page: &str) -> Vec<(String, Value)> {
    let blocks = page
        .split("<script type=\"application/json\" id=\"")
        .skip(1);
    blocks
        .map(|block| {
            let (id, rest) = block.split_once("\">").expect("an id");
            let (json, _) = rest.split_once("</script>").expect("an end");
            (id.to_owned(), serde_json::from_str(json).expect("JSON"))
        })
        .collect()
}

#[test]
fn a_page_has_all_frames_and_loads_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let (dataset, out) = (folder.path().join("d"), folder.path().join("d.html"));
    write(&dataset, 30, 31);
    let made = report(&dataset, &out).expect("a page");
    let page = fs::read_to_string(&out).expect("a file");
    assert_eq!((made.frames, made.bytes), (30, page.len()));
    assert_eq!(made.whole_frames, MAX_WHOLE_FRAMES);
    let blocks = blocks(&page);
    assert_eq!(blocks.len(), 1 + MAX_WHOLE_FRAMES);
    let summary = &blocks[0].1;
    assert_eq!(summary["name"], "d");
    // A number of JavaScript would be rounded.
    assert_eq!(summary["seed"], "18446744073709551615");
    let frames = summary["frames"].as_array().expect("frames");
    assert_eq!(frames.len(), 30);
    let whole: Vec<u64> = frames.iter().filter_map(|f| f["whole"].as_u64()).collect();
    assert_eq!(whole, (0..MAX_WHOLE_FRAMES as u64).collect::<Vec<_>>());
    let pictured = frames.iter().filter(|f| f["thumbnail"].is_string());
    assert_eq!(pictured.count(), 30);
    for (id, block) in &blocks[1..] {
        let maps = block["views"][0]["maps"].as_array().expect("maps");
        let names: Vec<&str> = maps.iter().filter_map(|m| m["name"].as_str()).collect();
        let expected = ["Picture", "Classes", "Instances", "Depth", "Normals"];
        assert_eq!(names, expected, "{id}");
        let inside = |m: &Value| {
            m["src"]
                .as_str()
                .is_some_and(|s| s.starts_with("data:image/"))
        };
        assert!(maps.iter().all(inside));
        assert_eq!(block["scans"][0]["total"], 0);
    }
    let warnings = summary["warnings"].to_string();
    for expected in [
        "30 of the 31 frames",
        "100 % of all pixels are Rocks",
        "30 of 30 frames have no LiDAR point",
        "No pixel and no point is of Background",
    ] {
        assert!(warnings.contains(expected), "{expected}: {warnings}");
    }
    assert!(page.contains("default-src 'none'"));
    // The texts of the data set are there, and are no markup.
    assert_eq!(summary["config"], HOSTILE);
    assert!(!page.contains("<script>alert"));

    let again = folder.path().join("again.html");
    report(&dataset, &again).expect("a page");
    assert_eq!(fs::read_to_string(again).expect("a file"), page);
}

#[test]
fn a_page_keeps_to_its_budget_and_spreads_what_it_shows() {
    let folder = tempfile::tempdir().expect("a folder");
    let (dataset, out) = (folder.path().join("d"), folder.path().join("d.html"));
    write(&dataset, 60, 60);
    let page_within = |max_bytes: usize| {
        let made = report_within(&dataset, &out, max_bytes).expect("a page");
        let page = fs::read_to_string(&out).expect("a file");
        let blocks = blocks(&page);
        assert_eq!(
            (made.bytes, 1 + made.whole_frames),
            (page.len(), blocks.len())
        );
        let frames = blocks[0].1["frames"].as_array().expect("frames").clone();
        let at = |key: &str| -> Vec<usize> {
            let has = |f: &&Value| !f[key].is_null();
            let frames = frames.iter().filter(has);
            frames
                .map(|f| f["index"].as_u64().expect("a number") as usize)
                .collect()
        };
        assert_eq!(
            (frames.len(), &blocks[0].1["frames_total"]),
            (60, &60.into())
        );
        (made, at("whole"), at("thumbnail"))
    };
    let is_spread = |shown: &[usize]| {
        let even = 59 / (shown.len() - 1);
        let (first, last) = (shown.first(), shown.last());
        assert_eq!((first, last), (Some(&0), Some(&59)));
        assert!(
            shown.windows(2).all(|w| w[1] - w[0] <= 2 * even + 3),
            "{shown:?}"
        );
    };
    let (all, whole, thumbnails) = page_within(usize::MAX);
    assert_eq!((whole.len(), thumbnails.len()), (MAX_WHOLE_FRAMES, 60));
    let (bare, whole, thumbnails) = page_within(0);
    assert_eq!((whole.len(), thumbnails.len()), (0, 0));

    // Half of what pictures need.
    let max_bytes = (all.bytes + bare.bytes) / 2;
    let (made, whole, thumbnails) = page_within(max_bytes);
    assert!(made.bytes <= max_bytes, "{} of {max_bytes}", made.bytes);
    assert!((6..18).contains(&whole.len()), "{whole:?}");
    is_spread(&whole);
    assert_eq!(thumbnails.len(), 60, "they are small");
}

#[test]
fn thumbnails_of_many_frames_leave_room_for_whole_ones() {
    let folder = tempfile::tempdir().expect("a folder");
    let (dataset, out) = (folder.path().join("d"), folder.path().join("d.html"));
    write(&dataset, 160, 160);
    let thumbnails = |max_bytes: usize| {
        report_within(&dataset, &out, max_bytes).expect("a page");
        let page = fs::read_to_string(&out).expect("a file");
        let summary = blocks(&page).swap_remove(0).1;
        let frames = summary["frames"].as_array().expect("frames");
        let thumbnails = frames.iter().enumerate();
        let lengths = thumbnails.filter_map(|(i, f)| Some((i, f["thumbnail"].as_str()?.len())));
        let (frames, lengths): (Vec<usize>, Vec<usize>) = lengths.unzip();
        (frames, lengths.iter().sum::<usize>())
    };
    let (all, bytes) = thumbnails(usize::MAX);
    assert_eq!(all.len(), 160);
    let (some, fewer) = thumbnails(2 * bytes);
    assert!(fewer <= bytes / 2, "{fewer} of {bytes}");
    assert!((60..=80).contains(&some.len()), "{some:?}");
    assert_eq!((some.first(), some.last()), (Some(&0), Some(&159)));
    assert!(some.windows(2).all(|w| w[1] - w[0] <= 4), "{some:?}");
}

fn tree(item: u16, species: String) -> TreeRecord {
    TreeRecord {
        object: ObjectId::new(ChunkCoord::new(0, 0), item).expect("an object"),
        species,
        position_m: DVec3::new(1.0, 2.0, 0.0),
        dbh_m: 0.3,
        height_m: 20.0,
        crown_base_m: 8.0,
        crown_radius_m: 2.0,
        leaf_area_m2: 90.0,
        stem_volume_m3: 0.7,
        wood_volume_m3: None,
        merchantable_volume_m3: None,
        lean_rad: 0.0,
        age_class: "middle".to_owned(),
        alive: true,
        field_id: String::new(),
    }
}

#[test]
fn species_beyond_the_most_share_a_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let (dataset, out) = (folder.path().join("d"), folder.path().join("d.html"));
    let most = MAX_SPECIES as u16;
    let mut trees: Vec<TreeRecord> = (1..=most + 50).map(|i| tree(i, format!("s{i}"))).collect();
    trees.push(tree(most + 51, "oak".to_owned()));
    trees.push(tree(most + 52, "oak".to_owned()));
    write_with(&dataset, 1, 1, &trees);
    report(&dataset, &out).expect("a page");
    let page = fs::read_to_string(&out).expect("a file");
    let summary = blocks(&page).swap_remove(0).1;
    let species = summary["species"].as_array().expect("names");
    assert_eq!(species.len(), MAX_SPECIES + 1);
    assert_eq!(species[0], "s1");
    assert_eq!(species[MAX_SPECIES - 1], "oak");
    assert_eq!(species[MAX_SPECIES], "51 other species");
    let sequence = &summary["sequences"][0];
    let shown = sequence["trees"].as_array().expect("trees");
    assert_eq!(shown.len(), trees.len());
    assert_eq!(shown[0][0], 0);
    assert_eq!(shown[MAX_SPECIES][0], MAX_SPECIES);
    assert_eq!(shown[trees.len() - 1][0], MAX_SPECIES - 1);
    let counts = &sequence["counts"];
    assert_eq!(counts[MAX_SPECIES.to_string()], 51);
    assert_eq!(counts[(MAX_SPECIES - 1).to_string()], 2);
}

#[test]
fn a_page_neither_hides_damage_nor_lies_among_the_data() {
    let folder = tempfile::tempdir().expect("a folder");
    let (dataset, out) = (folder.path().join("d"), folder.path().join("d.html"));
    write(&dataset, 1, 1);
    let inside = report(&dataset, &dataset.join("report.html"));
    assert!(matches!(inside, Err(Error::Inside { .. })), "{inside:?}");
    let name = report(&dataset, &folder.path().join("report.png"));
    assert!(matches!(name, Err(Error::Name { .. })), "{name:?}");
    fs::write(dataset.join("sequences/00/depth/000000.png"), "none").expect("a file");
    let error = report(&dataset, &out).expect_err("a damaged file");
    assert!(error.to_string().contains("depth/000000.png"), "{error}");
    assert!(!out.exists());
}
