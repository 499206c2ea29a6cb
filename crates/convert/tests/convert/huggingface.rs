//! Hugging Face's folder of pictures, read as its page describes rows and columns.

use std::path::Path;

use nemoral_convert::{ConvertParams, FormatName, Table, convert};
use serde_json::Value;

use crate::common::{header, made, png, text};

fn rows(out: &Path) -> Vec<Value> {
    let text = text(out.join("data/metadata.jsonl"));
    text.lines()
        .map(|l| serde_json::from_str(l).expect("JSON"))
        .collect()
}

#[test]
fn each_row_is_a_picture_with_its_truth() {
    let made = made(FormatName::HuggingFace);
    let rows = rows(&made.out);
    assert_eq!(rows.len(), 6);
    for (i, row) in rows.iter().enumerate() {
        let seen = &made.dataset.read_frame(i / 2).expect("a frame").cameras[i % 2];
        assert_eq!(row["camera"], *header().sequences[0].cameras[i % 2].name);
        let map = |column: &str| {
            let path = row[column].as_str().expect("a path");
            png(made.out.join("data").join(path)).2
        };
        assert_eq!(map("file_name"), seen.rgb.pixels().as_flattened());
        assert_eq!(map("semantic_file_name"), seen.semantic.pixels());
        let ids = map("instance_file_name");
        let ids = ids
            .chunks(3)
            .map(|c| u32::from_le_bytes([c[0], c[1], c[2], 0]));
        assert_eq!(ids.collect::<Vec<_>>(), seen.instance.pixels());
        let depth = map("depth_file_name");
        let depth = depth
            .as_chunks::<2>()
            .0
            .iter()
            .map(|b| f32::from(u16::from_be_bytes(*b)) / 256.0);
        assert_eq!(depth.collect::<Vec<_>>(), seen.depth_m.pixels());
        assert_eq!(map("normals_file_name").len(), 3 * 31 * 22);
    }
    let card = text(made.out.join("README.md"));
    assert!(
        card.starts_with("---\nlicense: other\n") && card.contains("| 3 | Trunks |"),
        "{card}"
    );
    let croissant: Value =
        serde_json::from_str(&text(made.out.join("croissant.json"))).expect("JSON");
    let sum = croissant["distribution"][0]["sha256"]
        .as_str()
        .expect("a digest");
    assert_eq!(sum.len(), 64);
}

#[test]
fn classes_follow_a_table() {
    let made = made(FormatName::HuggingFace);
    let out = made.out.with_file_name("rellis");
    let params = ConvertParams {
        ontology: Some(Table::load("rellis").expect("built in")),
        ..ConvertParams::new(FormatName::HuggingFace)
    };
    convert(made.dataset.root(), &out, &params).expect("converted");
    let ids = [7, 1, 1, 4, 4, 19, 3, 34];
    let seen = &made.dataset.read_frame(0).expect("a frame").cameras[0].semantic;
    let path = rows(&out)[0]["semantic_file_name"]
        .as_str()
        .expect("a path")
        .to_owned();
    let (_, _, found) = png(out.join("data").join(path));
    let expected: Vec<u8> = seen.pixels().iter().map(|&c| ids[usize::from(c)]).collect();
    assert_eq!(found, expected);
}
