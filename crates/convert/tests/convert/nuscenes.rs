//! nuScenes' tables, read as `schema_nuscenes.md` describes them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use nemoral_convert::{ClassMapping, ConvertParams, Error, FormatName, OutputMode, convert};
use nemoral_dataset::{DatasetHeader, Split};
use nemoral_scene::glam::{DQuat, DVec3};
use nemoral_scene::{Distortion, ObjectId, RigidTransform};
use serde_json::Value;

use crate::common::{
    Drive, Made, annotated, boxes_in_world, made_of, made_of_drives, objects, png, pose, run, text,
    visible_percent, write,
};

const VERSION: &str = "v1.0-trainval";

/// The tables by name, each by token.
struct Tables(BTreeMap<&'static str, BTreeMap<String, Value>>);

impl Tables {
    fn read(out: &Path) -> Self {
        let names = [
            "attribute",
            "calibrated_sensor",
            "category",
            "ego_pose",
            "instance",
            "log",
            "map",
            "sample",
            "sample_annotation",
            "sample_data",
            "scene",
            "sensor",
            "visibility",
        ];
        let table = |name: &'static str| {
            let json = text(out.join(VERSION).join(format!("{name}.json")));
            let rows: Vec<Value> = serde_json::from_str(&json).expect("a list");
            let (all, token) = (rows.len(), |r: &Value| word(r, "token").to_owned());
            let by_token: BTreeMap<_, _> = rows.into_iter().map(|r| (token(&r), r)).collect();
            assert_eq!(by_token.len(), all, "{name}: tokens are unique");
            let is_token = |t: &String| t.len() == 32 && t.chars().all(|c| c.is_ascii_hexdigit());
            assert!(
                name == "visibility" || by_token.keys().all(is_token),
                "{name}"
            );
            (name, by_token)
        };
        Self(names.into_iter().map(table).collect())
    }

    fn all(&self, table: &str) -> impl Iterator<Item = &Value> {
        self.0[table].values()
    }

    /// The record that a field of another one leads to.
    fn of(&self, table: &str, record: &Value, field: &str) -> &Value {
        &self.0[table][word(record, field)]
    }

    /// A chain of records from its first one, by `next`, whose `prev` are checked.
    fn chain(&self, table: &str, first: &str) -> Vec<&Value> {
        let (mut chain, mut before, mut token) = (Vec::new(), "", first);
        while !token.is_empty() {
            let record = &self.0[table][token];
            assert_eq!(word(record, "prev"), before);
            (before, token) = (token, word(record, "next"));
            chain.push(record);
        }
        chain
    }

    /// The pose of a record in what it is placed in.
    fn pose(record: &Value) -> RigidTransform {
        let [w, x, y, z] = numbers(&record["rotation"])[..] else {
            panic!("four numbers")
        };
        RigidTransform {
            rotation: DQuat::from_xyzw(x, y, z, w),
            translation_m: DVec3::from_slice(&numbers(&record["translation"])),
        }
    }

    /// The pose of a sensor in the world when it measured.
    fn sensor_pose(&self, data: &Value) -> RigidTransform {
        let ego = Self::pose(self.of("ego_pose", data, "ego_pose_token"));
        ego * Self::pose(self.of("calibrated_sensor", data, "calibrated_sensor_token"))
    }

    fn channel(&self, data: &Value) -> &str {
        let mount = self.of("calibrated_sensor", data, "calibrated_sensor_token");
        word(self.of("sensor", mount, "sensor_token"), "channel")
    }
}

fn word<'a>(record: &'a Value, field: &str) -> &'a str {
    let word = record[field].as_str();
    word.unwrap_or_else(|| panic!("{field} of {record}"))
}

fn numbers(list: &Value) -> Vec<f64> {
    let list = list.as_array().expect("a list");
    list.iter().map(|n| n.as_f64().expect("a number")).collect()
}

fn close(a: RigidTransform, b: RigidTransform) -> bool {
    a.translation_m.distance(b.translation_m) < 1e-3
        && a.rotation.dot(b.rotation).abs() > 1.0 - 1e-9
}

fn made(header: &DatasetHeader) -> Made {
    made_of(FormatName::NuScenes, header)
}

#[test]
fn boxes_in_the_world_are_those_of_the_cameras_over_all_frames() {
    let made = made(&annotated());
    let tables = Tables::read(&made.out);
    let [scene] = tables.all("scene").collect::<Vec<_>>()[..] else {
        panic!("one scene")
    };
    assert_eq!(scene["name"], "nemoral-00");
    let samples = tables.chain("sample", word(scene, "first_sample_token"));
    assert_eq!(samples.len(), 3);
    assert_eq!(scene["nbr_samples"], 3);
    assert_eq!(scene["last_sample_token"], samples[2]["token"]);
    let mut seen = BTreeSet::new();
    assert_eq!(tables.all("instance").count(), 3);
    for instance in tables.all("instance") {
        let chain = tables.chain(
            "sample_annotation",
            word(instance, "first_annotation_token"),
        );
        let last = chain.last().expect("an annotation");
        assert_eq!(instance["last_annotation_token"], last["token"]);
        assert_eq!(instance["nbr_annotations"], chain.len());
        let object = ObjectId::from_u64(instance["object"].as_u64().expect("an id"));
        let object = object.expect("an id");
        let i = objects().iter().position(|o| o.object == object);
        let i = i.expect("an object");
        assert_eq!(instance["image_id"], object.to_image_id());
        let names = ["vegetation.tree", "ground.rock", "vegetation.shrub"];
        let category = tables.of("category", instance, "category_token");
        assert_eq!(category["name"], names[i]);
        // No camera sees the shrub in the second frame that exists.
        let places: &[usize] = if i == 2 { &[0, 2] } else { &[0, 1, 2] };
        assert_eq!(chain.len(), places.len());
        for (annotation, &at) in chain.iter().zip(places) {
            let (world_from_box, size_m) = boxes_in_world()[i];
            assert!(
                close(Tables::pose(annotation), world_from_box),
                "{annotation}"
            );
            // Upright to the last digit.
            assert_eq!(numbers(&annotation["rotation"])[1..3], [0.0, 0.0]);
            assert_eq!(numbers(&annotation["size"]), [size_m.y, size_m.x, size_m.z]);
            assert_eq!(annotation["sample_token"], samples[at]["token"]);
            assert_eq!(annotation["instance_token"], instance["token"]);
            let frame = [1, 2, 4][at];
            let cameras = if i == 2 {
                &["front"][..]
            } else {
                &["front", "right"]
            };
            let percents = cameras.iter().map(|c| visible_percent(c, i, frame));
            let level = match percents.max().expect("a camera") {
                0..=40 => "1",
                41..=60 => "2",
                61..=80 => "3",
                _ => "4",
            };
            assert_eq!(annotation["visibility_token"], level);
            seen.insert(level);
            let scan = &made.dataset.read_frame(at).expect("a frame").lidars[0];
            let mine = scan.ply.iter().filter(|p| p.point.object == object).count();
            assert_eq!(annotation["num_lidar_pts"], mine);
            assert!(mine > 0);
        }
    }
    assert_eq!(tables.all("sample_annotation").count(), 8);
    assert!(seen.len() > 2, "several levels of visibility: {seen:?}");
    let levels: Vec<_> = tables.all("visibility").map(|v| word(v, "level")).collect();
    assert_eq!(levels, ["v0-40", "v40-60", "v60-80", "v80-100"]);
}

#[test]
fn points_are_counted_by_labels_without_a_ply_file() {
    let with = made(&annotated());
    let mut header = annotated();
    header.sequences[0].lidars[0].ply = false;
    let without = made(&header);
    let counts = |made: &Made| -> Vec<(u64, u64)> {
        let tables = Tables::read(&made.out);
        let count = |a: &Value| {
            let instance = tables.of("instance", a, "instance_token");
            let numbers = [&instance["object"], &a["num_lidar_pts"]];
            let [object, points] = numbers.map(|n| n.as_u64().expect("a number"));
            (object, points)
        };
        let mut counts: Vec<_> = tables.all("sample_annotation").map(count).collect();
        counts.sort_unstable();
        counts
    };
    assert_eq!(counts(&with), counts(&without));
    let [covered] = &with.done.notes[..] else {
        panic!("one note")
    };
    assert!(
        covered.contains("boxes cover only what cameras"),
        "{covered}"
    );
    let [same, note] = &without.done.notes[..] else {
        panic!("two notes")
    };
    assert_eq!(same, covered);
    assert!(note.contains("LiDAR 'top' have no PLY file"), "{note}");
    // Objects so far away have no number in `.label`, as points of no object have none.
    let far = Drive {
        chunks_away: 3,
        ..Drive::of(0, &[1, 2, 4])
    };
    let far = made_of_drives(FormatName::NuScenes, &header, &[far]);
    assert!(counts(&far).iter().all(|&(_, points)| points == 0));
    assert!(counts(&far).len() == 8 && counts(&with).iter().all(|&(_, points)| points > 0));
}

#[test]
fn pictures_scans_and_mounts_are_those_of_the_data_set() {
    let header = annotated();
    let made = made(&header);
    let tables = Tables::read(&made.out);
    let spec = &header.sequences[0];
    let frames = [1, 2, 4];
    let mut files = 0;
    for (place, &frame) in frames.iter().enumerate() {
        let (time_s, world_from_body) = pose(frame);
        let time_us = 1_000_000 + (1e6 * time_s).round() as u64;
        let sample = tables.all("sample").find(|s| s["timestamp"] == time_us);
        let sample = sample.expect("a sample at the time");
        let read = made.dataset.read_frame(place).expect("a frame");
        let data = tables.all("sample_data");
        for data in data.filter(|d| d["sample_token"] == sample["token"]) {
            files += 1;
            assert_eq!(
                (&data["timestamp"], &data["is_key_frame"]),
                (&time_us.into(), &true.into())
            );
            let path = made.out.join(word(data, "filename"));
            let (mount, camera) = match tables.channel(data) {
                "CAM_FRONT" => (spec.cameras[0].body_from_camera, Some(0)),
                "CAM_RIGHT" => (spec.cameras[1].body_from_camera, Some(1)),
                "LIDAR_TOP" => (spec.lidars[0].body_from_lidar, None),
                other => panic!("{other}"),
            };
            assert!(close(tables.sensor_pose(data), world_from_body * mount));
            if let Some(camera) = camera {
                let (w, h, pixels) = png(&path);
                assert_eq!((&data["width"], &data["height"]), (&w.into(), &h.into()));
                let rgb = &read.cameras[camera].rgb;
                assert_eq!(pixels, rgb.pixels().as_flattened());
                let mount = tables.of("calibrated_sensor", data, "calibrated_sensor_token");
                let rows: Vec<_> = mount["camera_intrinsic"].as_array().expect("rows").clone();
                let k = spec.cameras[camera].intrinsics;
                assert_eq!(numbers(&rows[0]), [k.fx, 0.0, k.cx - 0.5]);
                assert_eq!(numbers(&rows[1]), [0.0, k.fy, k.cy - 0.5]);
                assert_eq!(numbers(&rows[2]), [0.0, 0.0, 1.0]);
                continue;
            }
            let bytes = std::fs::read(&path).expect("a scan");
            let floats = bytes
                .as_chunks::<4>()
                .0
                .iter()
                .map(|b| f32::from_le_bytes(*b));
            let floats: Vec<f32> = floats.collect();
            let scan = &read.lidars[0];
            assert_eq!(floats.len(), 5 * scan.points.len());
            for (found, (point, fine)) in floats.chunks(5).zip(scan.points.iter().zip(&scan.ply)) {
                assert_eq!(found[..3], point[..3]);
                assert!((found[3] - 100.0 * point[3]).abs() < 1e-4);
                assert_eq!(found[4], f32::from(fine.point.ring));
            }
        }
    }
    assert_eq!(files, 9);
    let chains = tables
        .all("sample_data")
        .filter(|d| word(d, "prev").is_empty());
    let chains: Vec<_> = chains
        .map(|d| tables.chain("sample_data", word(d, "token")))
        .collect();
    assert_eq!(chains.iter().map(Vec::len).collect::<Vec<_>>(), [3, 3, 3]);
    for chain in chains {
        assert!(
            chain
                .iter()
                .all(|d| tables.channel(d) == tables.channel(chain[0]))
        );
        assert!(chain.is_sorted_by_key(|d| d["timestamp"].as_u64()));
    }
    // The development kit asks for a picture of the map, and finds the map by the log.
    let [map] = tables.all("map").collect::<Vec<_>>()[..] else {
        panic!("one map")
    };
    assert_eq!(png(made.out.join(word(map, "filename"))), (1, 1, vec![0]));
    let logs: Vec<_> = tables.all("log").map(|l| l["token"].clone()).collect();
    assert_eq!(map["log_tokens"], Value::from(logs));
}

#[test]
fn points_have_classes_and_these_follow_a_table() {
    let made = made(&annotated());
    let by_table = made.out.with_file_name("by_table");
    let params = ConvertParams {
        ontology: Some(ClassMapping::load("goose").expect("built in")),
        ..ConvertParams::new(FormatName::NuScenes)
    };
    convert(made.dataset.root(), &by_table, &params).expect("converted");
    for (out, by_table) in [(&made.out, false), (&by_table, true)] {
        let tables = Tables::read(out);
        let json =
            |path: &str| -> Value { serde_json::from_str(&text(out.join(path))).expect("JSON") };
        let colours = json("lidarseg/colormap.json");
        let mut names = BTreeMap::new();
        for category in tables.all("category") {
            let index = category["index"].as_u64().expect("an index");
            names.insert(index, word(category, "name"));
            assert_eq!(
                colours[word(category, "name")].as_array().map(Vec::len),
                Some(3)
            );
        }
        // Indices have no gaps.
        let all = tables.all("category").count() as u64;
        assert_eq!(
            Vec::from_iter(names.keys().copied()),
            Vec::from_iter(0..all)
        );
        let list = json("lidarseg/lidarseg.json");
        let list = list.as_array().expect("a list");
        assert_eq!(list.len(), 3);
        for row in list {
            let data = tables.of("sample_data", row, "sample_data_token");
            assert_eq!(tables.channel(data), "LIDAR_TOP");
            let bytes = std::fs::read(out.join(word(row, "filename"))).expect("classes");
            let place = [1, 2, 4]
                .iter()
                .position(|f| word(data, "filename").contains(&format!("/00_{f:06}__")));
            let read = made
                .dataset
                .read_frame(place.expect("a frame"))
                .expect("a frame");
            let scan = &read.lidars[0];
            assert_eq!(bytes.len(), scan.labels.len());
            let ontology = &made.dataset.manifest().header.ontology;
            for (index, (class, _)) in bytes.iter().zip(&scan.labels) {
                let own = ontology
                    .classes()
                    .iter()
                    .find(|c| u16::from(c.id) == *class);
                let found = names[&u64::from(*index)];
                if by_table {
                    assert_eq!(
                        found == "tree_trunk",
                        own.expect("a class").name == "Trunks"
                    );
                } else {
                    assert_eq!(found, own.expect("a class").name);
                }
            }
        }
    }
}

#[test]
fn scenes_of_two_sequences_follow_one_another_and_share_nothing() {
    // Times as of a clock that began in 1970; the second sequence alone has a camera to the rear.
    let mut header = annotated();
    let mut second = header.sequences[0].clone();
    second.number = 3;
    let mut rear = second.cameras[1].clone();
    rear.name = "rear_low".to_owned();
    second.cameras.push(rear);
    header.sequences.push(second);
    let drives = [
        Drive {
            later_s: 1.7e9,
            ..Drive::of(0, &[1, 2, 4])
        },
        Drive {
            later_s: 40.5,
            ..Drive::of(3, &[0, 3])
        },
    ];
    let made = made_of_drives(FormatName::NuScenes, &header, &drives);
    let tables = Tables::read(&made.out);
    let scene_of = |record: &Value| {
        let sample = tables.of("sample", record, "sample_token");
        tables.of("scene", sample, "scene_token")["name"].clone()
    };
    let mut scenes: Vec<_> = tables.all("scene").collect();
    scenes.sort_by_key(|s| word(s, "name"));
    let names: Vec<_> = scenes.iter().map(|s| word(s, "name")).collect();
    assert_eq!(names, ["nemoral-00", "nemoral-03"]);
    // The first scene takes three whole seconds and a second more.
    let times_us = [
        &[1_750_000, 2_250_000, 3_250_000][..],
        &[5_750_000, 7_250_000],
    ];
    for (scene, times_us) in scenes.iter().zip(times_us) {
        let samples = tables.chain("sample", word(scene, "first_sample_token"));
        assert_eq!(
            scene["last_sample_token"],
            samples[samples.len() - 1]["token"]
        );
        assert!(samples.iter().all(|s| s["scene_token"] == scene["token"]));
        let found: Vec<_> = samples.iter().map(|s| s["timestamp"].clone()).collect();
        assert_eq!(Value::from(found), Value::from(times_us));
        let log = tables.of("log", scene, "log_token");
        assert_eq!(log["location"], scene["name"]);
    }
    for data in tables.all("sample_data") {
        let sample = tables.of("sample", data, "sample_token");
        let ego = tables.of("ego_pose", data, "ego_pose_token");
        assert_eq!(data["timestamp"], sample["timestamp"]);
        assert_eq!(ego["timestamp"], sample["timestamp"]);
    }
    // A chain for each channel of a scene, and none into another one.
    let chains = tables
        .all("sample_data")
        .filter(|d| word(d, "prev").is_empty());
    let mut found: Vec<_> = chains
        .map(|first| {
            let chain = tables.chain("sample_data", word(first, "token"));
            let channel = tables.channel(first);
            for data in &chain {
                assert_eq!(
                    (tables.channel(data), scene_of(data)),
                    (channel, scene_of(first))
                );
            }
            (scene_of(first).to_string(), channel, chain.len())
        })
        .collect();
    found.sort_unstable();
    let name = |i: usize| format!("\"{}\"", names[i]);
    let expected = [
        (name(0), "CAM_FRONT", 3),
        (name(0), "CAM_RIGHT", 3),
        (name(0), "LIDAR_TOP", 3),
        (name(1), "CAM_FRONT", 2),
        (name(1), "CAM_REAR_LOW", 2),
        (name(1), "CAM_RIGHT", 2),
        (name(1), "LIDAR_TOP", 2),
    ];
    assert_eq!(found, expected);
    assert_eq!(tables.all("sample_data").count(), 9 + 8);
    assert_eq!(tables.all("sensor").count(), 4);
    // Both have the same objects, which are other instances.
    assert_eq!(tables.all("instance").count(), 6);
    for instance in tables.all("instance") {
        let first = word(instance, "first_annotation_token");
        let chain = tables.chain("sample_annotation", first);
        assert!(chain.iter().all(|a| scene_of(a) == scene_of(chain[0])));
    }
    let [map] = tables.all("map").collect::<Vec<_>>()[..] else {
        panic!("one map")
    };
    let logs: Vec<_> = scenes.iter().map(|s| s["log_token"].clone()).collect();
    assert!(logs[0] != logs[1] && map["log_tokens"] == Value::from(logs));
    let json = text(made.out.join(VERSION).join("splits.json"));
    let splits: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(splits["nemoral_train"], Value::from(vec!["nemoral-00"]));
    assert_eq!(splits["nemoral_val"], Value::from(vec!["nemoral-03"]));
    assert_eq!(splits["nemoral_test"], Value::Array(vec![]));
}

/// Changes a file of a data set as one would who writes its checksums, too.
fn forge(root: &Path, path: &str, change: impl Fn(&mut Vec<u8>)) {
    let file = root.join(path);
    let mut bytes = std::fs::read(&file).expect("a file");
    let record = |bytes: &[u8]| {
        let digest = blake3::hash(bytes).to_hex();
        format!(
            "\"{path}\",\"bytes\":{},\"blake3\":\"{digest}\"",
            bytes.len()
        )
    };
    let old = record(&bytes);
    change(&mut bytes);
    std::fs::write(&file, &bytes).expect("written");
    let manifest = root.join("dataset.json");
    let json = text(&manifest);
    assert_eq!(json.matches(&old).count(), 1);
    let json = json.replace(&old, &record(&bytes));
    let at = json.find("\"checksum\": \"").expect("a checksum") + 13;
    let sealed = |digest: &str| format!("{}{digest}{}", &json[..at], &json[at + 64..]);
    let digest = blake3::hash(sealed(&"0".repeat(64)).as_bytes()).to_hex();
    std::fs::write(&manifest, sealed(&digest)).expect("written");
}

#[test]
fn scans_whose_files_disagree_are_refused_with_their_names() {
    type Change = fn(&mut Vec<u8>);
    let cases: [(&str, Change, &str); 3] = [
        (
            "labels/000002.label",
            |bytes| bytes.truncate(bytes.len() - 4),
            "340 labels for 341 points of .bin",
        ),
        (
            "velodyne/000002.bin",
            |bytes| bytes.truncate(bytes.len() - 16),
            "341 labels for 340 points of .bin",
        ),
        (
            // Its lowest byte is that of class 1.
            "labels/000002.label",
            |bytes| bytes[..2].copy_from_slice(&257_u16.to_le_bytes()),
            "class 257 is none of the data set's",
        ),
    ];
    for (path, change, said) in cases {
        let dir = tempfile::tempdir().expect("a folder");
        let (source, out) = (dir.path().join("dataset"), dir.path().join("out"));
        write(&source, &annotated(), &[1, 2]);
        forge(&source, &format!("sequences/00/{path}"), change);
        let e = run(&source, &out, FormatName::NuScenes, OutputMode::Fresh).expect_err("refused");
        assert!(matches!(e, Error::Dataset(_)), "{e}");
        let all = [said, "sequences/00/labels/000002.label"];
        assert!(all.iter().all(|s| e.to_string().contains(s)), "{e}");
        assert!(!out.join(VERSION).exists());
    }
}

#[test]
fn a_ply_file_of_another_length_is_refused_with_its_name() {
    let dir = tempfile::tempdir().expect("a folder");
    let (source, out) = (dir.path().join("dataset"), dir.path().join("out"));
    write(&source, &annotated(), &[1, 2]);
    for (path, bytes_per_point) in [("velodyne/000002.bin", 16), ("labels/000002.label", 4)] {
        let path = format!("sequences/00/{path}");
        forge(&source, &path, |bytes| {
            bytes.truncate(bytes.len() - bytes_per_point)
        });
    }
    let e = run(&source, &out, FormatName::NuScenes, OutputMode::Fresh).expect_err("refused");
    let said = "sequences/00/points/000002.ply: 341 points for 340 of .bin";
    assert!(e.to_string().ends_with(said), "{e}");
}

#[test]
fn scans_beside_their_boxes_are_told() {
    let mut header = annotated();
    let lidars = &mut header.sequences[0].lidars;
    lidars[0].deskewed = false;
    lidars.push(lidars[0].clone());
    lidars[1].name = "rear".to_owned();
    lidars[1].deskewed = true;
    lidars[1].pointing_errors = true;
    let made = made(&header);
    let [_, raw, askew] = &made.done.notes[..] else {
        panic!("three notes: {:?}", made.done.notes)
    };
    assert!(
        raw.contains("LiDAR 'top' are raw (lidar.deskew = false)"),
        "{raw}"
    );
    assert!(
        askew.contains("LiDAR 'rear' have errors of pointing"),
        "{askew}"
    );
}

#[test]
fn scenes_of_splits_are_listed() {
    let mut header = annotated();
    header.sequences[0].split = Some(Split::Val);
    let made = made(&header);
    let json = text(made.out.join(VERSION).join("splits.json"));
    let splits: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(splits["nemoral_val"], Value::from(vec!["nemoral-00"]));
    assert_eq!(splits["nemoral_train"], Value::Array(vec![]));
    assert_eq!(splits["nemoral_test"], Value::Array(vec![]));
}

#[test]
fn what_boxes_need_is_said() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut unboxed = annotated();
    for camera in &mut unboxed.sequences[0].cameras {
        camera.annotations.boxes = false;
    }
    let mut bent = annotated();
    let [k1, k2, k3, k4] = [0.02, 0.003, -0.001, 0.0005];
    bent.sequences[0].cameras[1].intrinsics.distortion = Distortion::Fisheye { k1, k2, k3, k4 };
    let mut twice = annotated();
    twice.sequences[0].cameras[0].name = "ahead".to_owned();
    twice.sequences[0].cameras[1].name = "front".to_owned();
    let cases = [
        (
            unboxed,
            "no camera of sequence 00 has boxes; make the data set with camera.boxes = true",
        ),
        (bent, "camera 'right' of sequence 00 has a lens"),
        (twice, "would be the channel CAM_FRONT"),
    ];
    for (i, (header, said)) in cases.into_iter().enumerate() {
        let source = dir.path().join(format!("dataset-{i}"));
        write(&source, &header, &[0]);
        let out = dir.path().join("out");
        let e = run(&source, &out, FormatName::NuScenes, OutputMode::Fresh).expect_err("refused");
        assert!(
            matches!(e, Error::Unsuitable { .. }) && !out.exists(),
            "{e}"
        );
        assert!(e.to_string().contains(said), "{e}");
    }
    // One camera with boxes is enough, and a data set without LiDAR is told what that means.
    let mut header = annotated();
    header.sequences[0].cameras[1].annotations.boxes = false;
    header.sequences[0].lidars.clear();
    let made = made(&header);
    let tables = Tables::read(&made.out);
    assert!(
        tables
            .all("sample_annotation")
            .all(|a| a["num_lidar_pts"] == 0)
    );
    assert_eq!(tables.all("sample_annotation").count(), 8);
    let [note] = &made.done.notes[..] else {
        panic!("one note")
    };
    assert!(note.contains("no LiDAR, so num_lidar_pts is 0"), "{note}");
    assert!(note.contains("stop where there is none"), "{note}");
    assert!(!made.out.join("lidarseg").exists());
}
