//! Data sets that are split by their sequences, or by the kinds of their lenses, in formats with a
//! place for it.

use std::path::Path;

use nemoral_convert::{FormatName, OutputMode};
use nemoral_dataset::{DatasetHeader, Split};
use nemoral_scene::Distortion;
use serde_json::Value;

use crate::common::{Drive, Made, annotated, header, made_of, run, text, tree, write_drives};

/// A data set for tests, of one sequence.
fn split() -> DatasetHeader {
    let mut header = header();
    header.sequences[0].split = Some(Split::Val);
    header
}

fn json(path: impl AsRef<Path>) -> Value {
    serde_json::from_str(&text(path)).expect("JSON")
}

fn made(format: FormatName) -> Made {
    made_of(format, &split())
}

#[test]
fn hugging_face_has_a_folder_for_each() {
    let made = made(FormatName::HuggingFace);
    let rows = text(made.out.join("data/validation/metadata.jsonl"));
    assert_eq!(rows.lines().count(), 6);
    for row in rows.lines() {
        let row: Value = serde_json::from_str(row).expect("JSON");
        let picture = row["file_name"].as_str().expect("a path");
        assert!(made.out.join("data/validation").join(picture).is_file());
        assert_eq!(
            (&row["lens"], row["distortion"].as_array().map(Vec::len)),
            (&Value::from("pinhole"), Some(5))
        );
    }
    assert!(!made.out.join("data/metadata.jsonl").exists());
    let card = text(made.out.join("README.md"));
    assert!(
        card.contains("  - split: validation\n    path: data/validation/**\n"),
        "{card}"
    );
    let croissant = json(made.out.join("croissant.json"));
    assert_eq!(croissant["recordSet"][0]["name"], "pictures-validation");
    let rows = &croissant["distribution"][0];
    assert_eq!(rows["contentUrl"], "data/validation/metadata.jsonl");
    assert_eq!(
        croissant["recordSet"][0]["field"][0]["source"]["fileObject"]["@id"],
        rows["@id"]
    );
}

#[test]
fn coco_has_lists_for_each() {
    let made = made(FormatName::Coco);
    for list in ["instances", "panoptic"] {
        let found = json(made.out.join(format!("{list}_val.json")));
        assert_eq!(found["images"].as_array().map(Vec::len), Some(6));
        assert!(!made.out.join(format!("{list}.json")).exists());
    }
}

#[test]
fn shards_of_webdataset_are_called_by_it() {
    let made = made(FormatName::WebDataset);
    let shard = made.out.join("val-00-000000.tar");
    let bytes = std::fs::read(shard).expect("a shard");
    let text = String::from_utf8_lossy(&bytes[512..4096]);
    assert!(text.contains("\"split\":\"val\""), "{text}");
}

#[test]
fn nerfstudio_has_a_file_for_each_kind_of_lens() {
    let mut header = header();
    let [k1, k2, k3, k4] = [0.02, 0.003, -0.001, 0.0005];
    header.sequences[0].cameras[1].intrinsics.distortion = Distortion::Fisheye { k1, k2, k3, k4 };
    let made = made_of(FormatName::Nerfstudio, &header);
    for (file, model, camera) in [
        ("transforms", "OPENCV", "front"),
        ("transforms_fisheye", "OPENCV_FISHEYE", "right"),
    ] {
        let found = json(made.out.join(format!("00/{file}.json")));
        assert_eq!(found["camera_model"], model);
        let frames = found["frames"].as_array().expect("frames");
        assert_eq!(frames.len(), 3);
        for frame in frames {
            assert_eq!(frame["camera_model"], model);
            let path = frame["file_path"].as_str().expect("a path");
            assert!(path.starts_with(&format!("images/{camera}/")), "{path}");
        }
    }
    header.sequences[0].cameras.swap(0, 1);
    let made = made_of(FormatName::Nerfstudio, &header);
    let first = json(made.out.join("00/transforms.json"));
    assert_eq!(first["camera_model"], "OPENCV_FISHEYE");
    assert!(made.out.join("00/transforms_lens.json").is_file());
}

#[test]
fn sequences_without_frames_are_not_listed_nor_kept_for_validation() {
    let dir = tempfile::tempdir().expect("a folder");
    let source = dir.path().join("dataset");
    let mut header = annotated();
    for number in 1..4 {
        let mut next = header.sequences[0].clone();
        next.number = number;
        header.sequences.push(next);
    }
    // As in a part of a data set: of the last sequence nothing was made, of the third its tables.
    let drives = [
        Drive::of(0, &[0, 1]),
        Drive::of(1, &[0, 1]),
        Drive::of(2, &[]),
    ];
    write_drives(&source, &header, &drives);
    for format in FormatName::ALL {
        let out = dir.path().join(format.name());
        run(&source, &out, format, OutputMode::Fresh).unwrap_or_else(|e| panic!("{e}"));
        for absent in ["02", "03"] {
            let named = tree(&out).into_keys().find(|path| {
                let mut parts = path.iter().filter_map(|part| part.to_str());
                parts.any(|part| part.split(['.', '-', '_']).any(|word| word == absent))
            });
            assert_eq!(named, None, "{format}");
        }
    }
    let yaml = text(dir.path().join("yolo/data.yaml"));
    let lists = "train:\n  - images/00\nval:\n  - images/01\nnames:\n";
    assert!(yaml.starts_with(lists), "{yaml}");
    let yaml = text(dir.path().join("kitti/ontology.yaml"));
    let lists = "split:\n  train: [0]\n  valid: [1]\n  test: []\n";
    assert!(yaml.ends_with(lists), "{yaml}");
    assert!(dir.path().join("goose/images/val/nemoral_01").is_dir());
}

#[test]
fn yolo_lists_no_sequence_without_pictures() {
    let mut header = header();
    let mut blind = header.sequences[0].clone();
    (blind.number, blind.cameras) = (1, Vec::new());
    header.sequences.push(blind);
    let dir = tempfile::tempdir().expect("a folder");
    let (source, out) = (dir.path().join("dataset"), dir.path().join("out"));
    write_drives(&source, &header, &[Drive::of(0, &[0]), Drive::of(1, &[0])]);
    run(&source, &out, FormatName::Yolo, OutputMode::Fresh).expect("converted");
    let yaml = text(out.join("data.yaml"));
    let lists = "train:\n  - images/00\nval:\n  - images/00\nnames:\n";
    assert!(yaml.contains(lists), "{yaml}");
}
