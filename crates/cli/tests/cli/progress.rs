//! How `convert` and `merge` tell how far they are: as `generate` does.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Outcome, base, copy_base, files, folder, nemoral, outcome, run};

/// A command that reads the data set of 40 frames, and its output folder.
fn command(name: &str, out: &Path, more: &[&str]) -> Outcome {
    let mut command = nemoral();
    command.arg(name).arg(base()).arg("--out").arg(out);
    if name == "convert" {
        command.args(["--to", "npy"]);
    }
    outcome(command.args(more))
}

#[test]
fn programs_read_each_frame_and_the_end_as_json() {
    let folder = folder("progress-json");
    for name in ["convert", "merge"] {
        let out = folder.join(name);
        let done = command(name, &out, &["--progress", "json"]);
        assert_eq!(done.code, Some(0), "{name}: {}", done.stderr);
        assert_eq!(done.stderr, "", "{name}");
        let events: Vec<Value> = (done.stdout.lines())
            .map(|line| serde_json::from_str(line).expect("an object a line"))
            .collect();
        let (last, frames) = events.split_last().expect("events");
        assert_eq!(frames.len(), 40, "{name}");
        for (i, event) in frames.iter().enumerate() {
            assert_eq!(event["event"], "frame", "{name}");
            let numbers = ["sequence", "frame", "done", "total"].map(|key| event[key].as_u64());
            let i = i as u64;
            let expected = [0, i, i + 1, 40].map(Some);
            assert_eq!(numbers, expected, "{name}");
            assert!(event["elapsed_s"].as_f64() >= Some(0.0), "{event}");
        }
        assert_eq!(last["event"], "done", "{name}");
        assert_eq!(last["frames"], 40, "{name}");
        assert_eq!(last["out"], *out.to_string_lossy(), "{name}");
        assert!(last["elapsed_s"] != Value::Null, "{last}");
        if name == "convert" {
            let written = files(&out);
            // `conversion.json` is not counted.
            let is_counted = |(path, _): &(&String, &Vec<u8>)| *path != "conversion.json";
            let counted: Vec<_> = written.iter().filter(is_counted).collect();
            let bytes: usize = counted.iter().map(|(_, bytes)| bytes.len()).sum();
            assert_eq!(last["files"], counted.len());
            assert_eq!(last["bytes"], bytes);
        }
    }
}

#[test]
fn quiet_commands_print_nothing_but_errors() {
    let folder = folder("progress-quiet");
    for name in ["convert", "merge"] {
        let out = folder.join(name);
        for quiet in ["--quiet", "-q"] {
            let done = command(name, &out, &[quiet]);
            if quiet == "--quiet" {
                assert_eq!(done.code, Some(0), "{name}: {}", done.stderr);
                assert_eq!((&*done.stdout, &*done.stderr), ("", ""), "{name}");
                assert!(files(&out).len() > 40, "{name}");
            } else {
                // The folder is full now.
                assert_eq!(done.code, Some(2), "{name}: {}", done.stderr);
                assert_eq!(done.stdout, "", "{name}");
                assert!(done.stderr.starts_with("error: "), "{}", done.stderr);
                for way_out in ["--resume", "--overwrite"] {
                    assert!(done.stderr.contains(way_out), "{}", done.stderr);
                }
                assert_eq!(done.stderr.lines().count(), 1, "{}", done.stderr);
            }
        }
        let both = command(name, &out, &["--quiet", "--progress", "json"]);
        assert_eq!(both.code, Some(2), "{name}");
        assert!(both.stderr.contains("cannot be used with"), "{name}");
    }
}

#[test]
fn people_read_lines_and_the_answer() {
    let folder = folder("progress-lines");
    for name in ["convert", "merge"] {
        let out = folder.join(name);
        let done = command(name, &out, &[]);
        assert_eq!(done.code, Some(0), "{name}: {}", done.stderr);
        let last = done.stderr.lines().last().unwrap_or_default();
        assert!(last.starts_with("sequence 0, frame 39: 40 of 40"), "{last}");
        let answer = format!("40 frames in {}", out.display());
        assert!(done.stdout.starts_with(&answer), "{}", done.stdout);
        assert_eq!(done.stdout.lines().count(), 1, "{}", done.stdout);
    }
}

#[test]
fn a_command_that_fails_midway_ends_its_events_without_an_end() {
    let folder = folder("progress-failed");
    let source = folder.join("source");
    copy_base(&source);
    let depth = source.join("sequences/00/depth/000003.png");
    fs::write(depth, "damaged").expect("a writable file");
    for name in ["convert", "merge"] {
        let out = folder.join(name);
        let [from, out] = [&source, &out].map(|p| p.to_string_lossy());
        let mut words = vec![name, &*from, "--out", &*out, "--progress", "json"];
        if name == "convert" {
            words.extend(["--to", "npy"]);
        }
        let done = run(&words);
        assert_eq!(done.code, Some(1), "{name}: {}", done.stderr);
        assert!(done.stderr.contains("000003.png"), "{}", done.stderr);
        // Frames 0 to 2 are told, and no end.
        assert_eq!(done.stdout.lines().count(), 3, "{}", done.stdout);
        let is_frame = |line: &str| line.contains(r#""event":"frame""#);
        assert!(done.stdout.lines().all(is_frame), "{}", done.stdout);
    }
}
