//! Wrong requests end with exit code 2 and a message that says what is wrong and where, and touch
//! nothing. Folders that are not what a command needs end it with exit code 1.

use std::fs;

use crate::common::{Outcome, base, files, folder, outcome, run, small};

/// Writes a config, generates with it into a new folder, and expects that none was made.
#[track_caller]
fn refused(name: &str, config: &[u8]) -> Outcome {
    let folder = folder(name);
    let (path, out) = (folder.join("forest.toml"), folder.join("out"));
    fs::write(&path, config).expect("a writable folder");
    let done = run(&[
        "generate",
        &path.to_string_lossy(),
        "--out",
        &out.to_string_lossy(),
    ]);
    assert_eq!(done.code, Some(2), "{}", done.stderr);
    assert!(done.stderr.starts_with("error: "), "{}", done.stderr);
    assert!(done.stdout.is_empty(), "{}", done.stdout);
    assert!(!out.exists(), "nothing is written");
    done
}

#[track_caller]
fn assert_says(done: &Outcome, words: &[&str]) {
    for word in words {
        assert!(done.stderr.contains(word), "{word:?}: {}", done.stderr);
    }
}

#[test]
fn a_config_that_cannot_be_read() {
    let folder = folder("unreadable");
    let out = folder.join("out");
    for path in [folder.join("none.toml"), folder.clone()] {
        let path = path.to_string_lossy();
        let done = run(&["generate", &path, "--out", &out.to_string_lossy()]);
        assert_eq!(done.code, Some(2), "{}", done.stderr);
        assert_says(&done, &["cannot read", &path]);
        assert!(!out.exists());
    }
    let done = refused("not_text", &[0xFF, 0xFE, 0x00]);
    assert_says(&done, &["forest.toml", "UTF-8"]);
}

#[test]
fn malformed_toml() {
    let done = refused("malformed", b"frames = 3\n[terrain\noctaves = 3\n");
    assert_says(&done, &["forest.toml:2:9", "[terrain"]);
    let done = refused("twice", b"frames = 3\nframes = 4\n");
    assert_says(&done, &["forest.toml:2:1", "frames"]);
}

#[test]
fn an_impossible_value() {
    let done = refused("value", b"# a forest\n[terrain]\noctaves = 99\n");
    // The message has the file, the line, the key, the value, and what is allowed.
    assert_says(
        &done,
        &[
            "forest.toml:3:1",
            "terrain.octaves = 99",
            "from 1 to 16",
            "3 | octaves = 99",
        ],
    );
    let done = refused("type", b"[terrain]\n  octaves = \"many\"\n");
    assert_says(
        &done,
        &["forest.toml:2:3", "terrain.octaves", "many", "from 1 to 16"],
    );
    let done = refused("nan", b"[lidar]\nmax_range_m = nan\n");
    assert_says(&done, &["forest.toml:2:1", "lidar.max_range_m", "nan"]);
    let done = refused("word", b"[output]\nontology = \"animals\"\n");
    assert_says(
        &done,
        &[
            "forest.toml:2:1",
            "output.ontology",
            "animals",
            "paper",
            "fuel",
        ],
    );
}

#[test]
fn everything_wrong_is_said_at_once() {
    let done = refused(
        "several",
        b"frames = -1\n[chunks]\nsize = 50\n[trails]\nwidth_m = -1\n",
    );
    assert_says(&done, &["forest.toml:1:1", "frames = -1"]);
    assert_says(&done, &["forest.toml:3:1", "chunks.size", "size_m"]);
    assert_says(&done, &["forest.toml:5:1", "trails.width_m = -1"]);
}

#[test]
fn an_unknown_key() {
    let done = refused("key", b"frames = 3\n\n[terrain]\noctave = 3\n");
    assert_says(&done, &["forest.toml:4:1", "terrain.octave", "`octaves`"]);
    let done = refused("section", b"[ocean]\ndepth_m = 3\n");
    assert_says(
        &done,
        &["forest.toml:1:2", "ocean", "no such key", "terrain"],
    );
    let done = refused("preset", b"preset = \"jungle\"\n");
    assert_says(&done, &["forest.toml:1:1", "jungle", "medium", "demo"]);
}

#[test]
fn an_impossible_combination() {
    let done = refused(
        "combination",
        b"[chunks]\nvisible_radius_m = 60\nundergrowth_radius_m = 80\n",
    );
    assert_says(
        &done,
        &[
            "forest.toml:3:1",
            "chunks.undergrowth_radius_m = 80",
            "at most chunks.visible_radius_m = 60",
        ],
    );
    // Too far for the ids of instance images.
    let done = refused("ids", b"[chunks]\nsize_m = 20\nvisible_radius_m = 300\n");
    assert_says(&done, &["chunks.visible_radius_m = 300", "instance images"]);
    // Two tables of which there can be only one.
    let done = refused("two_patterns", b"[lidar.mid40]\n[lidar.horizon]\n");
    assert_says(&done, &["lidar", "scan pattern"]);
    // No room for so many trees.
    let done = refused(
        "dense",
        b"preset = \"demo\"\n[placement]\ntrees = 400\nspacing_factor = 10.0\n",
    );
    assert_says(&done, &["placement.trees = 400", "at most about"]);
}

#[test]
fn wrong_arguments() {
    let out = folder("arguments").join("out");
    let path = out.to_string_lossy();
    let cases: [(&[&str], &[&str]); 13] = [
        (
            &["--set", "terrain.octaves=99"],
            &["terrain.octaves = 99", "from 1 to 16"],
        ),
        (
            &["--set", "terrain.octave=9"],
            &["terrain.octave", "octaves"],
        ),
        (&["--set", "octaves"], &["KEY=VALUE"]),
        (&["--preset", "jungle"], &["jungle", "medium", "demo"]),
        (&["--frames", "5..2"], &["5..2"]),
        (
            &["--preset", "demo", "--frames", "1..3"],
            &["frame 2", "the config's `frames`"],
        ),
        (&["--shard", "3/3"], &["3/3", "0 to N - 1"]),
        (&["--resume", "--overwrite"], &["--resume", "--overwrite"]),
        (&["--threads", "0"], &["--threads"]),
        (&["--seed", "-1"], &["--seed", "-1"]),
        (
            &["--seed", "9223372036854775808"],
            &["--seed", "9223372036854775808", "9223372036854775807"],
        ),
        (&["--frames", "0"], &["--frames", "at least 1"]),
        (&["--swim"], &["--swim"]),
    ];
    for (arguments, words) in cases {
        let arguments = [&["generate", "--out", &*path], arguments].concat();
        let done = run(&arguments);
        assert_eq!(done.code, Some(2), "{arguments:?}: {}", done.stderr);
        assert_says(&done, words);
        assert!(!out.exists(), "{arguments:?}");
    }
}

#[test]
fn an_output_folder_that_holds_something_else() {
    let out = folder("foreign").join("thesis");
    fs::create_dir_all(out.join("chapters")).expect("a folder");
    fs::write(out.join("thesis.tex"), "\\documentclass{book}").expect("a file");
    let before = files(&out);
    for mode in [&[][..], &["--resume"], &["--overwrite"]] {
        let done = outcome(&mut small(&out, mode));
        assert_eq!(done.code, Some(2), "{mode:?}: {}", done.stderr);
        assert_says(&done, &[&out.to_string_lossy(), "holds no data set"]);
        assert_eq!(files(&out), before, "{mode:?}: untouched");
    }
    assert!(out.join("chapters").is_dir());
}

#[test]
fn a_data_set_that_is_there_already() {
    let before = files(base());
    let done = outcome(&mut small(base(), &[]));
    assert_eq!(done.code, Some(2), "{}", done.stderr);
    assert_says(&done, &["--resume", "--overwrite"]);
    // Data that were made differently are not mixed.
    let done = outcome(&mut small(base(), &["--resume", "--seed", "8"]));
    assert_eq!(done.code, Some(2), "{}", done.stderr);
    assert_says(&done, &["seed = 7", "asked for 8"]);
    let done = outcome(&mut small(
        base(),
        &["--resume", "--set", "lidar.pulses=301"],
    ));
    assert_eq!(done.code, Some(2), "{}", done.stderr);
    assert_says(&done, &["lidar.pulses", "300", "301"]);
    assert!(files(base()) == before, "untouched");
}

#[test]
fn folders_without_a_data_set() {
    let empty = folder("empty");
    for command in ["check", "stats"] {
        for (path, word) in [
            (empty.clone(), "holds no data set"),
            (empty.join("none"), "there is no such folder"),
        ] {
            let done = run(&[command, &path.to_string_lossy()]);
            assert_eq!(done.code, Some(1), "{}", done.stderr);
            assert_says(&done, &[&path.to_string_lossy(), word]);
        }
    }
    assert!(files(&empty).is_empty());
}
