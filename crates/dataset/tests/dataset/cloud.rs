//! Registered clouds: where their points are, which are kept, and what is refused.

use std::path::Path;

use nemoral_dataset::{Cloud, CloudFormat, CloudParams, CloudPoses, Crop, Dataset, Error, cloud};
use nemoral_scene::glam::DVec3;

use crate::common::{START, header, spheres, write};

/// The fields of a vertex that the tests use.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    world: DVec3,
    time: f64,
    frame: u32,
    item: u16,
    class: u8,
    ring: u8,
}

/// Reads the fields that the header names, by their sizes.
fn read(path: &Path) -> Vec<Vertex> {
    let bytes = std::fs::read(path).expect("a cloud");
    let end = b"end_header\n";
    let body = bytes
        .windows(end.len())
        .position(|w| w == end)
        .expect("a header")
        + end.len();
    let header = std::str::from_utf8(&bytes[..body]).expect("text");
    let (mut offset, mut at) = (0, std::collections::BTreeMap::new());
    for line in header.lines().filter(|l| l.starts_with("property ")) {
        let mut words = line.split(' ').skip(1);
        let size = match words.next().expect("a type") {
            "double" => 8,
            "float" | "int" => 4,
            "uchar" => 1,
            other => panic!("{other}"),
        };
        at.insert(words.next().expect("a name").to_owned(), offset);
        offset += size;
    }
    let count: usize = header
        .lines()
        .find_map(|l| l.strip_prefix("element vertex "))
        .and_then(|n| n.parse().ok())
        .expect("a count");
    assert_eq!(bytes.len() - body, count * offset);
    let f64_at = |v: &[u8], key: &str| {
        f64::from_le_bytes(v[at[key]..at[key] + 8].try_into().expect("8 bytes"))
    };
    let vertex = |v: &[u8]| Vertex {
        world: DVec3::new(f64_at(v, "x"), f64_at(v, "y"), f64_at(v, "z")),
        time: f64_at(v, "time"),
        frame: i32::from_le_bytes(v[at["frame"]..][..4].try_into().expect("4 bytes")) as u32,
        item: i32::from_le_bytes(v[at["item"]..][..4].try_into().expect("4 bytes")) as u16,
        class: v[at["class"]],
        ring: v[at["ring"]],
    };
    bytes[body..].chunks_exact(offset).map(vertex).collect()
}

#[test]
fn points_lie_on_the_worlds_surfaces() {
    let folder = tempfile::tempdir().expect("a folder");
    let (data, out) = (folder.path().join("data"), folder.path().join("c.ply"));
    write(&data, &header(), &[0, 1, 2]);
    let count = cloud(&data, &out, CloudParams::default()).expect("a cloud");
    let points = read(&out);
    assert_eq!(points.len() as u64, count);
    let manifest = Dataset::open(&data).expect("a data set").manifest().clone();
    let recorded: u64 = manifest
        .frames
        .iter()
        .flat_map(|f| f.point_classes.values())
        .sum();
    assert_eq!(count, recorded);
    let world = spheres();
    for p in &points {
        // Ranges have errors of centimetres; see `common::see`.
        let off = match world.iter().find(|s| {
            s.object.item() == p.item && p.item > 0 && {
                (p.world.distance(s.centre) - s.radius).abs() < 0.3
            }
        }) {
            Some(s) => p.world.distance(s.centre) - s.radius,
            None if p.item == 0 => {
                let fern = &world[world.len() - 1];
                p.world
                    .z
                    .abs()
                    .min((p.world.distance(fern.centre) - fern.radius).abs())
            }
            None => panic!("{p:?}"),
        };
        assert!(off.abs() < 0.3, "{p:?} is {off} m off");
        assert!(p.world.distance(START) < 110.0 && p.class > 0);
    }
    let frames: Vec<u32> = points.iter().map(|p| p.frame).collect();
    assert!(frames.is_sorted() && frames.last() == Some(&2));
}

#[test]
fn points_have_the_times_and_rings_of_their_pulses() -> Result<(), Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let (data, out) = (folder.path().join("data"), folder.path().join("c.ply"));
    let dataset = write(&data, &header(), &[0, 1]);
    cloud(&data, &out, CloudParams::default())?;
    let mut recorded = Vec::new();
    for frame in dataset.frames() {
        let scan = dataset.scan(frame, 0)?;
        recorded.extend(scan.ply.iter().map(|p| (frame.time_s, p.point)));
    }
    let points = read(&out);
    assert_eq!(points.len(), recorded.len());
    for (p, (frame_s, point)) in points.iter().zip(&recorded) {
        // Times of this world are whole microseconds.
        let fired_us = frame_s * 1e6 + (point.time_ns / 1000) as f64;
        assert!((p.time * 1e6 - fired_us).abs() < 1e-3, "{p:?}");
        assert_eq!(p.ring, point.ring);
    }
    // The first scan begins before the sequence.
    assert!(points[0].time < 0.0 && points.iter().any(|p| p.ring != points[0].ring));
    Ok(())
}

#[test]
fn a_voxel_keeps_its_first_point() {
    let folder = tempfile::tempdir().expect("a folder");
    let (data, out) = (folder.path().join("data"), folder.path().join("c.ply"));
    write(&data, &header(), &[0, 1]);
    let all = {
        cloud(&data, &out, CloudParams::default()).expect("a cloud");
        read(&out)
    };
    let params = CloudParams {
        voxel_m: Some(0.5),
        ..CloudParams::default()
    };
    cloud(&data, &out, params).expect("over the old one");
    let thin = read(&out);
    let cell = |p: &Vertex| (p.world / 0.5).floor().to_array().map(|c| c as i64);
    let mut seen = std::collections::BTreeSet::new();
    let firsts: Vec<DVec3> = all
        .iter()
        .filter(|p| seen.insert(cell(p)))
        .map(|p| p.world)
        .collect();
    assert_eq!(firsts, thin.iter().map(|p| p.world).collect::<Vec<_>>());
    assert!(thin.len() * 2 < all.len());
}

#[test]
fn clouds_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let (data, out) = (folder.path().join("data"), folder.path().join("c.ply"));
    let mut raw = header();
    raw.sequences[0].lidars[0].deskewed = false;
    write(&data, &raw, &[0]);
    let refused = |params| cloud(&data, &out, params).expect_err("refused").to_string();
    assert!(refused(CloudParams::default()).contains("deskewed"));
    let params = CloudParams {
        voxel_m: Some(-1.0),
        ..CloudParams::default()
    };
    assert!(refused(params).contains("voxel_m"));
    let mut bare = header();
    bare.sequences[0].lidars[0].ply = false;
    let second = folder.path().join("bare");
    write(&second, &bare, &[0]);
    let text = cloud(&second, &out, CloudParams::default())
        .expect_err("refused")
        .to_string();
    assert!(text.contains("output.ply"), "{text}");
    assert!(
        nemoral_dataset::check(&second)
            .expect("a data set")
            .problems
            .is_empty()
    );
    assert!(nemoral_dataset::stats(&second).is_ok());
    assert!(!out.exists());
}

#[test]
fn the_file_of_the_poses_is_not_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let data = folder.path().join("data");
    write(&data, &header(), &[0]);
    let poses = std::fs::read(data.join("sequences/00/poses.txt")).expect("poses");
    for name in ["my.ply", "my.csv"] {
        let mine = folder.path().join(name);
        std::fs::write(&mine, &poses).expect("written");
        let params = CloudParams {
            poses: CloudPoses::File(mine.clone()),
            ..CloudParams::default()
        };
        let opened = Cloud::open(&data, params).expect("a cloud");
        // The same file by another way.
        let out = data.join("..").join(name);
        let refused = if name.ends_with("ply") {
            opened.write_ply(&out).map(|_| ())
        } else {
            opened.write_trajectory(&out, CloudFormat::Ply).map(|_| ())
        };
        let refused = refused.expect_err("refused").to_string();
        assert!(
            refused.contains("another file than that of the poses"),
            "{refused}"
        );
        assert!(std::fs::read(&mine).expect("kept") == poses);
    }
}

#[test]
fn a_plot_has_its_points_and_its_inventory() {
    let folder = tempfile::tempdir().expect("a folder");
    let (data, out) = (folder.path().join("data"), folder.path().join("c.ply"));
    write(&data, &header(), &[0, 1]);
    let trees = Dataset::open(&data)
        .expect("a data set")
        .trees(0)
        .expect("trees");
    assert!(!trees.is_empty());
    let plot = trees[0].position_m.truncate();
    let within = |p: DVec3| p.truncate().distance(plot) <= 3.0;
    let cropped = |only: &[&str]| CloudParams {
        crop: Some(Crop::Circle {
            centre_m: plot,
            radius_m: 3.0,
        }),
        only: only.iter().map(|n| (*n).to_owned()).collect(),
        ..CloudParams::default()
    };
    cloud(&data, &out, CloudParams::default()).expect("a cloud");
    let all = read(&out);
    cloud(&data, &out, cropped(&[])).expect("a plot");
    let plot_points = read(&out);
    assert!(!plot_points.is_empty() && plot_points.len() < all.len());
    let expected = all.iter().filter(|p| within(p.world)).count();
    assert_eq!(plot_points.len(), expected);
    cloud(&data, &out, cropped(&["Trunks"])).expect("trunks");
    let trunks = read(&out);
    let expected = plot_points.iter().filter(|p| p.class == 3).count();
    assert_eq!(trunks.len(), expected);

    let csv = folder.path().join("plot.csv");
    let open = Cloud::open(&data, cropped(&[])).expect("a cloud");
    let count = open.write_trees(&csv, CloudFormat::Ply).expect("written");
    let expected = trees.iter().filter(|t| within(t.position_m)).count();
    assert!(count >= 1 && count == expected);
    let text = std::fs::read_to_string(&csv).expect("a table");
    let whole = std::fs::read_to_string(data.join("sequences/00/trees.csv")).expect("a table");
    let begins = |row: &str| whole.lines().any(|r| row.starts_with(&format!("{r},")));
    assert!(text.lines().all(begins), "{text}");
    assert_eq!(text.lines().count(), 1 + count);
    let refused = open.write_trees(&folder.path().join("plot.txt"), CloudFormat::Ply);
    assert!(refused.expect_err("refused").to_string().contains(".csv"));
}
