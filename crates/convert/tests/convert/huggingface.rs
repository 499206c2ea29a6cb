//! Hugging Face's folder of pictures, read as its page describes rows and columns.

use std::collections::BTreeSet;
use std::path::Path;

use nemoral_convert::{ClassMapping, ConvertParams, FormatName, convert};
use serde_json::Value;

use crate::common::{header, made, png, text, tree};

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

/// The items of a list with an id that matches.
fn with_id(list: &Value, matches: impl Fn(&str) -> bool) -> Vec<&Value> {
    let list = list.as_array().expect("a list");
    let has_id = |item: &&Value| matches(item["@id"].as_str().expect("an id"));
    list.iter().filter(has_id).collect()
}

#[test]
fn croissant_describes_each_column_and_leads_from_pictures_to_rows() {
    let made = made(FormatName::HuggingFace);
    let croissant = text(made.out.join("croissant.json"));
    let croissant: Value = serde_json::from_str(&croissant).expect("JSON");
    assert!(croissant.get("url").is_none());
    let sets = &croissant["recordSet"];
    let pictures = with_id(sets, |id| id == "pictures")[0];
    let row = &rows(&made.out)[0];
    let columns: Vec<&str> = (row.as_object().expect("columns").keys())
        .map(String::as_str)
        .collect();
    for column in &columns {
        let id = format!("pictures/{column}");
        let field = with_id(&pictures["field"], |found| found == id)[0];
        assert_eq!(field["source"]["extract"]["column"], *column);
        let is_list = row[*column].is_array();
        assert_eq!(
            field.get("repeated"),
            is_list.then_some(&Value::from(true)),
            "{column}"
        );
    }
    let fields = pictures["field"].as_array().expect("fields");
    assert_eq!(fields.len(), columns.len());
    assert!(columns.contains(&"distortion") && columns.contains(&"world_from_camera"));

    // Each kind of pictures is a set of files and of records, whose paths are those of the rows.
    let kinds = ["image", "semantic", "instance", "depth", "normals"];
    let all: BTreeSet<_> = (tree(&made.out).into_keys())
        .filter(|path| path.extension().is_some_and(|e| e == "png"))
        .collect();
    let mut listed = BTreeSet::new();
    for kind in kinds {
        let files = with_id(&croissant["distribution"], |id| {
            id == format!("{kind}-files")
        })[0];
        assert_eq!(files["includes"], format!("data/*/{kind}/*.png"));
        let set = with_id(sets, |id| id == kind)[0];
        let [path, content] = &set["field"].as_array().expect("fields")[..] else {
            panic!("{set}")
        };
        for field in [path, content] {
            assert_eq!(field["source"]["fileSet"]["@id"], files["@id"]);
        }
        assert_eq!(content["dataType"], "sc:ImageObject");
        assert_eq!(content["source"]["extract"]["fileProperty"], "content");
        assert_eq!(path["source"]["extract"]["fileProperty"], "fullpath");
        assert_eq!(path["source"]["transform"]["regex"], "^(?:data/)?(.+)$");
        let column = path["references"]["field"]["@id"].as_str().expect("an id");
        let column = column.strip_prefix("pictures/").expect("of rows");
        for row in rows(&made.out) {
            let path = Path::new("data").join(row[column].as_str().expect("a path"));
            let parent = path.parent().expect("a folder");
            assert!(parent.ends_with(kind) && parent.components().count() == 3);
            listed.insert(path);
        }
    }
    assert_eq!(listed, all);
    assert_eq!(
        croissant["distribution"].as_array().map(Vec::len),
        Some(1 + kinds.len())
    );
}

#[test]
fn classes_follow_a_table() {
    let made = made(FormatName::HuggingFace);
    let out = made.out.with_file_name("rellis");
    let params = ConvertParams {
        ontology: Some(ClassMapping::load("rellis").expect("built in")),
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
