//! Data sets of several sequences.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{files, folder, nemoral, outcome, run, small};

/// Sequences that differ in picture size, light and scanner, over the small request.
const VARIED: &str = r#"
sequences = 4
[splits]
train = 0.5
test = 0.5
by = "lidar.device"
[vary]
camera.width_px = [24, 80]
"sun.angles.elevation_deg" = [10, 60]
"lidar.device" = ["mid70", "vlp16"]
"#;

/// The small request with these sequences, each of three frames.
fn varied(out: &Path, arguments: &[&str]) -> Command {
    let config = out.with_extension("toml");
    fs::write(&config, VARIED).expect("a writable folder");
    let mut command = small(out, &["--frames", "3"]);
    command.arg(config).args(arguments);
    command
}

/// Runs it and expects it to be done.
#[track_caller]
fn record(out: &Path, arguments: &[&str]) {
    let done = outcome(&mut varied(out, arguments));
    assert_eq!(done.code, Some(0), "{}", done.stderr);
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn worlds_are_drawn_recorded_sharded_and_continued() {
    let folder = folder("sequences");
    let whole = folder.join("whole");
    record(&whole, &[]);
    let found = files(&whole);
    for number in 0..4 {
        for name in [
            "config.toml",
            "trees.csv",
            "image_2/000002.png",
            "points/000000.ply",
        ] {
            assert!(
                found.contains_key(&format!("sequences/{number:02}/{name}")),
                "{name}"
            );
        }
    }
    let path = whole.to_string_lossy();
    let checked = run(&["check", &path]);
    assert_eq!(checked.code, Some(0), "{}", checked.stdout);
    let counted = run(&["stats", &path]);
    assert!(
        counted.stdout.contains("12 frames in 4 sequences"),
        "{}",
        counted.stdout
    );
    let worlds: Vec<&Vec<u8>> = (0..4)
        .map(|k| &found[&format!("sequences/0{k}/trees.csv")])
        .collect();
    assert!((1..4).all(|k| worlds[k] != worlds[k - 1]), "worlds differ");

    // Shards cut sequences anywhere.
    let parts = ["0", "1", "2"].map(|i| folder.join(format!("part{i}")));
    for (i, part) in parts.iter().enumerate() {
        record(part, &["--shard", &format!("{i}/3")]);
    }
    let merged = folder.join("merged");
    let merge = outcome(
        nemoral()
            .arg("merge")
            .args(&parts)
            .arg("--out")
            .arg(&merged),
    );
    assert_eq!(merge.code, Some(0), "{}", merge.stderr);
    assert!(files(&merged) == found, "merged");

    // A finished data set gets further sequences.
    let fewer = folder.join("fewer");
    record(&fewer, &["--set", "sequences=2"]);
    record(&fewer, &["--resume"]);
    assert!(files(&fewer) == found, "continued");

    // The request in the data set makes all of it again; a sequence's config makes that one.
    let again = folder.join("again");
    let config = whole.join("config.toml");
    let done = outcome(
        nemoral()
            .arg("generate")
            .arg(config)
            .arg("--out")
            .arg(&again),
    );
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(files(&again) == found, "again");
    let alone = folder.join("alone");
    let config = whole.join("sequences/02/config.toml");
    let done = outcome(
        nemoral()
            .arg("generate")
            .arg(config)
            .arg("--out")
            .arg(&alone),
    );
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    for (name, bytes) in files(&alone) {
        if let Some(rest) = name.strip_prefix("sequences/00/") {
            assert!(bytes == found[&format!("sequences/02/{rest}")], "{name}");
        }
    }
}

#[test]
fn programs_read_progress_as_json() {
    let out = folder("progress").join("out");
    let json = ["--sequences", "2", "--frames", "2", "--progress", "json"];
    let done = outcome(&mut small(&out, &json));
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert_eq!(done.stderr, "");
    let events: Vec<serde_json::Value> = (done.stdout.lines())
        .map(|line| serde_json::from_str(line).expect("an object a line"))
        .collect();
    let frames = events.iter().filter(|e| e["event"] == "frame");
    let frames: Vec<(u64, u64, u64)> = frames
        .map(|e| {
            assert_eq!((&e["total"], &e["resumed"]), (&4.into(), &false.into()));
            let number = |key: &str| e[key].as_u64().expect("a number");
            (number("sequence"), number("frame"), number("done"))
        })
        .collect();
    assert_eq!(frames, [(0, 0, 1), (0, 1, 2), (1, 0, 3), (1, 1, 4)]);
    let last = events.last().expect("an end");
    assert_eq!(
        (&last["event"], &last["frames"]),
        (&"done".into(), &4.into())
    );
    assert!(last["bytes"].as_u64() > Some(1000), "{last}");
    let seconds = |key: &str| last[key].as_f64().expect("a number");
    let (growing, sensors) = (seconds("growing_s"), seconds("sensors_s"));
    assert!(growing > 0.0 && sensors > 0.0, "{last}");
    assert!(growing + sensors <= seconds("elapsed_s"), "{last}");
}

#[test]
fn sequences_are_listed_and_the_last_one_is_checked_before_the_first_frame() {
    let folder = folder("listed");
    let config = folder.join("varied.toml");
    fs::write(&config, VARIED).expect("a writable folder");
    let config = config.to_string_lossy();
    let listed = run(&["plan", &config, "--list", "--sequences", "8"]);
    assert_eq!(listed.code, Some(0), "{}", listed.stderr);
    let lines: Vec<&str> = listed.stdout.lines().collect();
    assert_eq!(lines.len(), 8);
    let with = |word: &str| lines.iter().filter(|l| l.contains(word)).count();
    assert_eq!(
        (with("mid70"), with("vlp16"), with("train"), with("test")),
        (4, 4, 4, 4)
    );
    let shown = run(&["config", "show", &config, "--sequence", "3"]);
    assert_eq!(shown.code, Some(0), "{}", shown.stderr);
    let none = run(&["config", "show", &config, "--sequence", "4"]);
    assert_eq!(none.code, Some(2));
    assert!(none.stderr.contains("must be 0 to 3"), "{}", none.stderr);

    // A later sequence is impossible: nothing is written.
    let wide = folder.join("wide.toml");
    // The first sequence of this seed is fine.
    let text = "seed = 1\nsequences = 8\n[vary]\nchunks.visible_radius_m = [100, 600]\n";
    fs::write(&wide, text).expect("a writable folder");
    let out = folder.join("out");
    let refused = outcome(nemoral().arg("generate").arg(&wide).arg("--out").arg(&out));
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
    assert!(refused.stderr.contains("sequence "), "{}", refused.stderr);
    assert!(!out.exists());
}
