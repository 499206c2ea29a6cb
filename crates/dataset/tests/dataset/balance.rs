//! What data sets keep of a balance: it comes back, is counted, is the same in all parts, and is
//! refused where it contradicts itself.

use std::fs;
use std::path::Path;

use nemoral_dataset::{
    BalanceRecord, BalanceTarget, Dataset, FrameChoice, Manifest, MergeParams, OpenMode,
    WorldTables, Writer, check, merge, stats,
};
use serde_json::{Value, json};

use crate::common::{objects, see, small, stamp, track, trees};

fn balance() -> BalanceRecord {
    let target = |name: &str, goal, before, weight| BalanceTarget {
        name: name.to_owned(),
        goal,
        before,
        expected: goal,
        weight,
    };
    BalanceRecord {
        candidates: 16,
        pilot_poses: 250,
        cap: 4.0,
        targets: vec![
            target("logs", 0.02, 0.003, 2.5),
            target("rocks", 0.05, 0.1 / 3.0, 0.0),
        ],
    }
}

fn choice(frame: usize) -> FrameChoice {
    FrameChoice {
        candidate: (frame > 0).then_some(frame as u32),
        shares: vec![0.01 * frame as f64, 0.1],
    }
}

/// Writes frames of three that were chosen.
fn write(out: &Path, frames: &[usize], balance: &BalanceRecord) -> Manifest {
    let header = small();
    let writer = Writer::create(out, OpenMode::Fresh, header.clone()).expect("a folder");
    for &frame in frames {
        let seen = see(&header, frame);
        let mut data = seen.data(&header);
        data.balance = Some(choice(frame));
        writer.write_frame(&data).expect("written");
    }
    let mut track = track(3);
    track.balance = Some(balance.clone());
    let tables = WorldTables {
        trees: &trees(),
        objects: &objects(),
        ..WorldTables::default()
    };
    writer.write_sequence(&track, &tables).expect("a track");
    writer.finish().expect("a whole data set")
}

#[test]
fn a_balance_comes_back_and_is_counted() {
    let dir = tempfile::tempdir().expect("a folder");
    write(dir.path(), &[0, 2], &balance());
    let read = Dataset::open(dir.path()).expect("a data set");
    assert_eq!(read.manifest().tracks[0].balance, Some(balance()));
    let choices: Vec<_> = read
        .manifest()
        .frames
        .iter()
        .map(|f| f.balance.clone())
        .collect();
    assert_eq!(choices, [Some(choice(0)), Some(choice(2))]);
    assert!(check(dir.path()).expect("checked").passed());
    let counted = stats(dir.path()).expect("counted");
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
    let [logs, rocks] = &counted.balance[..] else {
        panic!("{counted}")
    };
    assert!(logs.name == "logs" && near(logs.goal, 0.02) && near(logs.before, 0.003));
    assert!(
        near(logs.after, 0.01) && near(rocks.after, 0.1),
        "{counted}"
    );
    let table = counted.to_string();
    let row = table
        .lines()
        .find(|line| line.starts_with("rocks"))
        .expect("a row");
    let words: Vec<&str> = row.split_whitespace().collect();
    assert_eq!(words, ["rocks", "5.00", "%", "3.33", "%", "10.00", "%"]);
    let card = fs::read_to_string(dir.path().join("README.md")).expect("a card");
    assert!(card.contains("more of them show logs, rocks"), "{card}");
    // A drive says nothing of it.
    let drive = tempfile::tempdir().expect("a folder");
    crate::common::write(drive.path(), &small(), &[0]);
    let manifest = fs::read_to_string(drive.path().join("dataset.json")).expect("a manifest");
    assert!(!manifest.contains("balance"));
    assert!(stats(drive.path()).expect("counted").balance.is_empty());
}

#[test]
fn parts_of_other_balances_are_not_merged() {
    let dir = tempfile::tempdir().expect("a folder");
    let [a, b, c] = ["a", "b", "c"].map(|name| dir.path().join(name));
    write(&a, &[0, 1], &balance());
    write(&b, &[2], &balance());
    let mut other = balance();
    other.targets[0].weight = 2.0;
    write(&c, &[2], &other);
    let merged = |parts: &[&Path], out: &str| {
        merge(parts, &dir.path().join(out), MergeParams::default()).map_err(|e| e.to_string())
    };
    let whole = merged(&[&a, &b], "ab").expect("merged");
    assert_eq!(whole.tracks[0].balance, Some(balance()));
    assert_eq!(whole.frames.len(), 3);
    let error = merged(&[&a, &c], "ac").expect_err("refused");
    assert!(error.contains("track of sequence 0"), "{error}");
}

#[test]
fn contradictions_are_refused() {
    let changed = |change: &dyn Fn(&mut Value)| {
        let dir = tempfile::tempdir().expect("a folder");
        write(dir.path(), &[1], &balance());
        let path = dir.path().join("dataset.json");
        let text = fs::read_to_string(&path).expect("a manifest");
        let mut json: Value = serde_json::from_str(&text).expect("JSON");
        change(&mut json);
        stamp(dir.path(), &mut json);
        Dataset::open(dir.path())
            .map(drop)
            .map_err(|e| e.to_string())
    };
    assert_eq!(changed(&|_| {}), Ok(()));
    type Change<'a> = (&'a dyn Fn(&mut Value), &'a str);
    let cases: [Change<'_>; 8] = [
        (
            &|m| m["frames"][0]["balance"]["shares"] = json!([0.1]),
            "balance.shares = 1: must be 2",
        ),
        (
            &|m| m["frames"][0]["balance"]["shares"][1] = json!(1.5),
            "balance.shares = 1.5",
        ),
        (
            &|m| m["frames"][0]["balance"]["candidate"] = json!(16),
            "balance.candidate = 16",
        ),
        (
            &|m| m["frames"][0]["balance"] = Value::Null,
            "balance = none: must be there",
        ),
        (
            &|m| m["tracks"][0]["balance"] = Value::Null,
            "balance = there: must be none",
        ),
        (
            &|m| m["tracks"][0]["balance"]["targets"] = json!([]),
            "balance.targets = 0",
        ),
        (
            &|m| m["tracks"][0]["balance"]["targets"][0]["name"] = json!("stones"),
            "in order of their names",
        ),
        (
            &|m| m["tracks"][0]["balance"]["targets"][0]["weight"] = json!(-1.0),
            "balance.targets.logs.weight = -1",
        ),
    ];
    for (change, expected) in cases {
        let error = changed(change).expect_err(expected);
        assert!(error.contains(expected), "{expected}: {error}");
    }
}
