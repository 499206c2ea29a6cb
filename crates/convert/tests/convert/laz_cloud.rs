//! Clouds as LAZ: what is kept, tiles, and what is refused.

use std::path::Path;

use nemoral_convert::{ClassMapping, Error, FormatName, LazCloudParams, laz_cloud};
use nemoral_dataset::{Cloud, CloudParams, Crop};
use nemoral_scene::glam::DVec3;

use crate::common::{Drive, Made, header, made, pose, tree, write_drives};
use crate::las::LasFile;

/// Positions, classifications and `point_source_id`s of a file.
fn points(path: &Path) -> Vec<(DVec3, u8, u16)> {
    let file = LasFile::read(path);
    let points = file.points();
    points
        .map(|p| (p.position_m(), p.class(), p.source()))
        .collect()
}

/// The number of the scan of each point, from 1.
fn scans(made: &Made) -> impl Iterator<Item = u16> {
    let frames = [1_u16, 2, 4].into_iter().enumerate();
    frames.flat_map(|(i, frame)| {
        let scan = &made.dataset.read_frame(i).expect("a frame").lidars[0].ply;
        std::iter::repeat_n(frame + 1, scan.len())
    })
}

/// All points of the data set in the world, with their classes.
fn expected(made: &Made) -> Vec<(DVec3, u8)> {
    let lidar = &crate::common::header().sequences[0].lidars[0];
    let mut all = Vec::new();
    for (i, frame) in [1_u64, 2, 4].into_iter().enumerate() {
        let world_from_lidar = pose(frame).1 * lidar.body_from_lidar;
        for p in &made.dataset.read_frame(i).expect("a frame").lidars[0].ply {
            let at = p.point.position_m.as_dvec3();
            all.push((world_from_lidar.transform_point(at), p.class));
        }
    }
    all
}

fn near(a: DVec3, b: DVec3) -> bool {
    (a - b).abs().max_element() <= 0.51e-4
}

#[test]
fn a_flights_lines_are_sources() {
    let folder = tempfile::tempdir().expect("a folder");
    let (set, out) = (folder.path().join("set"), folder.path().join("survey.laz"));
    let flight = Drive {
        lines: vec![0, 2],
        ..Drive::of(0, &[1, 2, 4])
    };
    let dataset = write_drives(&set, &header(), &[flight]);
    let points_of = |frame: usize| {
        dataset.read_frame(frame).expect("a frame").lidars[0]
            .ply
            .len()
    };
    let cloud = Cloud::open(&set, CloudParams::default()).expect("a cloud");
    laz_cloud(&cloud, &out, &LazCloudParams::default()).expect("written");
    let sources: Vec<u16> = points(&out)
        .into_iter()
        .map(|(.., source)| source)
        .collect();
    let (first, second) = sources.split_at(points_of(0));
    assert!(!first.is_empty() && first.iter().all(|line| *line == 1));
    assert_eq!(second.len(), points_of(1) + points_of(2));
    assert!(second.iter().all(|line| *line == 2));
}

#[test]
fn one_file_has_all_scans_and_tiles_share_them() {
    let made = made(FormatName::Laz);
    let dir = made.dataset.root();
    let folder = tempfile::tempdir().expect("a folder");
    let cloud = Cloud::open(dir, CloudParams::default()).expect("a cloud");
    let out = folder.path().join("plot.laz");
    let written = laz_cloud(&cloud, &out, &LazCloudParams::default()).expect("written");
    let (all, expected) = (points(&out), expected(&made));
    assert_eq!((written.len(), written[0].points), (1, all.len() as u64));
    assert_eq!(all.len(), expected.len());
    let with_scan = expected.iter().zip(scans(&made));
    for ((at, asprs, source), ((exact, class), scan)) in all.iter().zip(with_scan) {
        assert!(near(*at, *exact), "{at} {exact}");
        let table = [7, 2, 2, 5, 5, 4, 3, 1];
        assert_eq!((*asprs, *source), (table[usize::from(*class)], scan));
    }

    let tiled = LazCloudParams {
        tile_m: Some(2.0),
        ontology: Some(ClassMapping::load("rellis").expect("a table")),
        ..LazCloudParams::default()
    };
    let tiles = laz_cloud(&cloud, &folder.path().join("tile.laz"), &tiled);
    let tiles = tiles.expect("written");
    assert!(tiles.len() > 1, "{tiles:?}");
    let mut count = 0;
    for tile in &tiles {
        let name = tile.path.file_stem().expect("a name").to_string_lossy();
        let corner: Vec<f64> = name
            .split('_')
            .skip(1)
            .map(|n| 2.0 * n.parse::<f64>().expect("a number"))
            .collect();
        for (at, _, _) in points(&tile.path) {
            let inside = |x: f64, low: f64| (low - 1e-4..low + 2.0 + 1e-4).contains(&x);
            assert!(
                inside(at.x, corner[0]) && inside(at.y, corner[1]),
                "{at} {name}"
            );
            assert!(expected.iter().any(|(exact, _)| near(at, *exact)));
            count += 1;
        }
    }
    assert_eq!(count, expected.len());
    // Nothing else was left behind.
    assert_eq!(tree(folder.path()).len(), 1 + tiles.len());
}

#[test]
fn tiles_replace_those_of_an_earlier_cloud_if_asked_and_no_others() {
    let made = made(FormatName::Laz);
    let root = made.dataset.root();
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("plot.laz");
    let cloud_of = |crop: Option<Crop>| {
        let params = CloudParams {
            crop,
            ..CloudParams::default()
        };
        Cloud::open(root, params).expect("a cloud")
    };
    let tiled = |cloud: &Cloud, overwrite| {
        let params = LazCloudParams {
            tile_m: Some(2.0),
            overwrite,
            ..LazCloudParams::default()
        };
        laz_cloud(cloud, &out, &params)
    };
    let all = cloud_of(None);
    // Names that are none of its tiles', whoever they are of.
    let others = [
        "plot_1.laz",
        "plot_01_2.laz",
        "plot_a_b.laz",
        "plots_1_2.laz",
    ];
    for other in others {
        std::fs::write(folder.path().join(other), "mine").expect("written");
    }
    let whole = tiled(&all, false).expect("nothing is there");
    let before = tree(folder.path());
    assert_eq!(before.len(), whole.len() + others.len());
    let error = tiled(&all, false).expect_err("there are tiles");
    assert!(matches!(error, Error::TileExists { .. }), "{error}");
    assert!(error.is_request() && tree(folder.path()) == before);
    tiled(&all, true).expect("replaced");
    assert!(tree(folder.path()) == before);

    // Tiles of another crop do not stay.
    let centre_m = expected(&made)[0].0.truncate();
    let part = cloud_of(Some(Crop::Circle {
        centre_m,
        radius_m: 0.5,
    }));
    let fewer = tiled(&part, true).expect("replaced");
    assert!(fewer.len() < whole.len());
    let mut left = tree(folder.path());
    assert_eq!(left.len(), fewer.len() + others.len());
    for other in others {
        assert_eq!(left.remove(Path::new(other)), Some(b"mine".to_vec()));
    }

    // The file of another program is not replaced, even if it has a tile's name.
    let theirs = folder.path().join("plot_553220_-4450330.laz");
    std::fs::write(&theirs, b"LASF of somebody else's flight").expect("written");
    let before = tree(folder.path());
    for overwrite in [false, true] {
        let error = tiled(&all, overwrite).expect_err("somebody else's");
        assert!(
            error.is_request() && tree(folder.path()) == before,
            "{error}"
        );
        let is_theirs = matches!(&error, Error::ForeignTile { path } if *path == theirs);
        assert_eq!(is_theirs, overwrite, "{error}");
    }
    // One file is that which was named.
    laz_cloud(&part, &out, &LazCloudParams::default()).expect("written");
    laz_cloud(&part, &out, &LazCloudParams::default()).expect("replaced");
}

#[test]
fn crops_and_classes_are_kept() {
    let made = made(FormatName::Laz);
    let expected = expected(&made);
    let trunk = expected.iter().find(|(_, class)| *class == 3);
    let centre_m = trunk.expect("a trunk").0.truncate();
    let params = CloudParams {
        crop: Some(Crop::Circle {
            centre_m,
            radius_m: 1.0,
        }),
        only: vec!["trunks".to_owned(), "rock".to_owned()],
        ..CloudParams::default()
    };
    let cloud = Cloud::open(made.dataset.root(), params).expect("a cloud");
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("part.laz");
    laz_cloud(&cloud, &out, &LazCloudParams::default()).expect("written");
    let kept: Vec<_> = expected
        .iter()
        .filter(|(at, class)| {
            // Trunks, and Rocks, of which all points here are rock.
            at.truncate().distance(centre_m) <= 1.0 && [3, 7].contains(class)
        })
        .collect();
    let got = points(&out);
    assert!(!got.is_empty() && got.len() < expected.len());
    assert_eq!(got.len(), kept.len());
    assert!(got.iter().zip(kept).all(|(a, b)| near(a.0, b.0)));
}

#[test]
fn what_cannot_be_is_refused() {
    let made = made(FormatName::Laz);
    let folder = tempfile::tempdir().expect("a folder");
    let cloud = Cloud::open(made.dataset.root(), CloudParams::default()).expect("a cloud");
    let refused = |name: &str, tile_m| {
        let params = LazCloudParams {
            tile_m,
            ..LazCloudParams::default()
        };
        let error = laz_cloud(&cloud, &folder.path().join(name), &params);
        error.expect_err("refused").to_string()
    };
    assert!(refused("plot.las", None).contains(".laz"));
    assert!(refused("plot.laz", Some(f64::NAN)).contains("tile_m"));
    assert!(refused("plot.laz", Some(0.5)).contains("1 to 100000"));
    // A plot in site coordinates, where nothing is.
    let elsewhere = CloudParams {
        crop: Some("553220,4450330,15".parse().expect("a circle")),
        ..CloudParams::default()
    };
    let nowhere = Cloud::open(made.dataset.root(), elsewhere).expect("a cloud");
    let out = folder.path().join("plot.laz");
    let error = laz_cloud(&nowhere, &out, &LazCloudParams::default()).expect_err("refused");
    assert!(
        error.to_string().contains("the scanners were within"),
        "{error}"
    );
    // A plot without points of a class is no mistake.
    let trunk = expected(&made).into_iter().find(|(_, class)| *class == 3);
    let centre_m = trunk.expect("a trunk").0.truncate();
    let params = CloudParams {
        crop: Some(Crop::Circle {
            centre_m,
            radius_m: 0.01,
        }),
        only: vec!["snow".to_owned()],
        ..CloudParams::default()
    };
    let empty = Cloud::open(made.dataset.root(), params).expect("a cloud");
    let none = folder.path().join("none.laz");
    let written = laz_cloud(&empty, &none, &LazCloudParams::default()).expect("written");
    assert_eq!(written[0].points, 0);
    std::fs::remove_file(none).expect("it was written");
    let params = CloudParams {
        only: vec!["Trunk".to_owned()],
        ..CloudParams::default()
    };
    let error = Cloud::open(made.dataset.root(), params).expect_err("refused");
    assert!(error.to_string().contains("Trunks, Canopy"), "{error}");
    assert!(tree(folder.path()).is_empty());
}
