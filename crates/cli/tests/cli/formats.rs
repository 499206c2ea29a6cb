//! Data sets that are written in other people's formats, too.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{files, folder, outcome, record, run, small};

const TWO: [&str; 4] = ["--frames", "2", "--formats", "kitti,yolo"];

/// The folder of a format beside a data set's.
fn beside(out: &Path, format: &str) -> PathBuf {
    let name = out.file_name().expect("a name").to_string_lossy();
    out.with_file_name(format!("{name}-{format}"))
}

#[track_caller]
fn assert_equal(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    assert!(
        !a.is_empty() && a.keys().eq(b.keys()),
        "{:?} and {:?}",
        a.keys(),
        b.keys()
    );
    for (name, bytes) in &a {
        assert!(*bytes == b[name], "{name} differs");
    }
}

/// Asserts that both formats have the bytes of `nemoral convert`.
#[track_caller]
fn assert_converted(out: &Path) {
    for format in ["kitti", "yolo"] {
        let apart = beside(out, &format!("apart-{format}"));
        let _ = fs::remove_dir_all(&apart);
        let (from, to) = (out.to_string_lossy(), apart.to_string_lossy());
        let done = run(&["convert", &from, "--to", format, "--out", &to]);
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        assert_equal(&beside(out, format), &apart);
    }
}

#[test]
fn a_data_set_is_written_in_the_formats_it_asks_for() {
    let out = folder("formats").join("out");
    let done = outcome(&mut small(&out, &TWO));
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let line = format!("as yolo in {}", beside(&out, "yolo").display());
    assert!(done.stderr.contains(&line), "{}", done.stderr);
    assert_converted(&out);

    // What a conversion lacks is written again, and one of other frames is replaced.
    let poses = beside(&out, "kitti").join("poses/00.txt");
    fs::remove_file(&poses).expect("poses");
    record(&out, &[&TWO[..], &["--resume"]].concat());
    assert!(poses.exists());
    let one = ["--frames", "0..1", "--formats", "kitti,yolo", "--overwrite"];
    record(&out, &one);
    let second = beside(&out, "kitti").join("sequences/00/velodyne/000001.bin");
    assert!(!second.exists());
    assert_converted(&out);
}

#[test]
fn more_frames_replace_what_was_converted() {
    let out = folder("formats-more").join("out");
    let formats = ["--formats", "kitti,yolo", "--frames"];
    record(&out, &[&formats[..], &["0..1"]].concat());
    record(&out, &[&formats[..], &["0..2", "--resume"]].concat());
    assert!(
        beside(&out, "kitti")
            .join("sequences/00/velodyne/000001.bin")
            .exists()
    );
    assert_converted(&out);
}

#[test]
fn merging_shards_writes_the_formats() {
    let folder = folder("formats-shards");
    let whole = folder.join("whole");
    record(&whole, &TWO);
    let mut merge = vec!["merge".to_owned()];
    for shard in ["0/2", "1/2"] {
        let part = folder.join(&shard[..1]);
        record(&part, &[&TWO[..], &["--shard", shard]].concat());
        assert!(!beside(&part, "kitti").exists());
        merge.push(part.to_string_lossy().into_owned());
    }
    let merged = folder.join("merged");
    merge.extend(["--out".to_owned(), merged.to_string_lossy().into_owned()]);
    let merge: Vec<_> = merge.iter().map(String::as_str).collect();
    let done = run(&merge);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    for format in ["kitti", "yolo"] {
        assert_equal(&beside(&merged, format), &beside(&whole, format));
    }
    // A folder that is taken is known before anything is merged.
    fs::remove_dir_all(&merged).expect("the data set");
    let refused = run(&merge);
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
    assert!(
        refused.stderr.contains("merged-kitti"),
        "{}",
        refused.stderr
    );
    assert!(refused.stderr.contains("--overwrite"), "{}", refused.stderr);
    assert!(!merged.exists());
}

#[test]
fn formats_are_refused_before_anything_is_written() {
    let folder = folder("formats-refused");
    let out = folder.join("out");
    let refused = |arguments: &[&str], expected: &[&str]| {
        let done = outcome(&mut small(&out, arguments));
        assert_eq!(done.code, Some(2), "{arguments:?}: {}", done.stderr);
        for text in expected {
            assert!(done.stderr.contains(text), "{arguments:?}: {}", done.stderr);
        }
        assert!(!out.exists(), "{arguments:?}");
    };
    refused(&["--formats", "coca"], &["coca", "coco"]);
    let unknown = "output.formats=[\"coca\"]";
    refused(&["--set", unknown], &["output.formats", "coca", "\"coco\""]);
    let twice = "output.formats=[\"coco\", \"coco\"]";
    refused(&["--set", twice], &["output.formats", "each at most once"]);
    let blind = ["--set", "camera.enabled=false", "--formats", "kitti,coco"];
    refused(&blind, &["coco", "camera.enabled = true"]);
    let shard = ["--shard", "0/2"];
    refused(
        &[&blind[..], &shard].concat(),
        &["coco", "camera.enabled = true"],
    );
    let set = [
        "--set",
        "output.formats=[\"coco\"]",
        "--set",
        "camera.enabled=false",
    ];
    let check = run(&[&["config", "check", "--preset", "demo"], &set[..]].concat());
    assert_eq!(check.code, Some(2), "{}", check.stderr);
    assert!(
        check.stderr.contains("camera.enabled = true"),
        "{}",
        check.stderr
    );
    let no_ply = ["--set", "output.ply=false", "--formats", "mcap"];
    refused(&no_ply, &["mcap", "output.ply = true"]);
    let taken = beside(&out, "coco");
    fs::create_dir(&taken).expect("a folder");
    fs::write(taken.join("notes.txt"), "mine").expect("a file");
    refused(&["--formats", "coco"], &["out-coco", "notes.txt"]);
}
