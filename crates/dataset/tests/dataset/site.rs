//! Where worlds lie on the earth.

use std::fs;

use nemoral_dataset::{
    Cloud, CloudParams, Dataset, DatasetHeader, Error, MergeParams, OpenMode, SiteSpec, Writer,
    check, merge,
};
use nemoral_scene::glam::DVec3;
use serde_json::{Value, json};

use crate::common::{small, tree, write};

const SITE: SiteSpec = SiteSpec {
    epsg: Some(25_829),
    origin_m: [553_220.0, 4_450_330.125, 73.5],
};

fn header(site: Option<SiteSpec>) -> DatasetHeader {
    let mut header = small();
    header.sequences[0].site = site;
    header
}

#[test]
fn the_place_of_a_world_is_kept() {
    let dir = tempfile::tempdir().expect("a folder");
    let [a, b, both, whole] = ["a", "b", "both", "whole"].map(|name| dir.path().join(name));
    write(&a, &header(Some(SITE)), &[0, 1]);
    write(&b, &header(Some(SITE)), &[2, 3]);
    write(&whole, &header(Some(SITE)), &[0, 1, 2, 3]);
    merge(&[&a, &b], &both, MergeParams::default()).expect("parts of one");
    assert_eq!(tree(&both), tree(&whole));
    let text = fs::read_to_string(both.join("dataset.json")).expect("a manifest");
    let json: Value = serde_json::from_str(&text).expect("JSON");
    let site = json!({ "epsg": 25_829, "origin_m": [553_220.0, 4_450_330.125, 73.5] });
    assert_eq!(json["sequences"][0]["site"], site);
    assert_eq!(
        Dataset::open(&both)
            .expect("whole")
            .manifest()
            .header
            .sequences[0]
            .site,
        Some(SITE)
    );
    let cloud = Cloud::open(&both, CloudParams::default()).expect("a cloud");
    let at = cloud
        .site()
        .expect("a place")
        .from_world(DVec3::new(1.5, -2.0, 0.25));
    assert_eq!(at, DVec3::new(553_221.5, 4_450_328.125, 73.75));
    assert!(check(&both).expect("readable").passed());
    let card = fs::read_to_string(both.join("README.md")).expect("a card");
    assert!(card.contains("coordinates there (EPSG:25829)"), "{card}");
}

#[test]
fn another_place_is_another_data_set() {
    let dir = tempfile::tempdir().expect("a folder");
    let [here, there, nowhere] = ["here", "there", "nowhere"].map(|name| dir.path().join(name));
    let elsewhere = SiteSpec { epsg: None, ..SITE };
    write(&here, &header(Some(SITE)), &[0, 1]);
    write(&there, &header(Some(elsewhere)), &[2, 3]);
    write(&nowhere, &header(None), &[2, 3]);
    for other in [&there, &nowhere] {
        let out = dir.path().join("never");
        let merged = merge(&[&here, other], &out, MergeParams::default());
        let resumed = Writer::create(other, OpenMode::Resume, header(Some(SITE)));
        for error in [merged.map(drop), resumed.map(drop)] {
            let error = error.expect_err("another data set");
            assert!(matches!(error, Error::Mismatch { .. }), "{error}");
            assert!(error.to_string().contains("site"), "{error}");
        }
    }
    // What is not known is not there.
    let text = |dir: &std::path::Path| fs::read_to_string(dir.join("dataset.json")).expect("text");
    assert!(!text(&there).contains("epsg") && text(&there).contains("origin_m"));
    assert!(!text(&nowhere).contains("\"site\""));
    let card = fs::read_to_string(nowhere.join("README.md")).expect("a card");
    assert!(!card.contains("site"), "{card}");
}
