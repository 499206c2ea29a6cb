//! Requests that ask for too much, and files that are not what they should be, are refused at once
//! and in few words.

use std::fs;

use std::time::{Duration, Instant};

use crate::common::{Outcome, SMALL, copy_base, folder, outcome, run, small};

/// Runs a command that must be refused: quickly, in few words, without a panic.
#[track_caller]
fn refused(arguments: &[&str], words: &[&str]) -> Outcome {
    let started = Instant::now();
    let done = run(arguments);
    assert_eq!(
        done.code,
        Some(2),
        "{arguments:?}: {}{}",
        done.stdout,
        done.stderr
    );
    assert!(started.elapsed() < Duration::from_secs(60), "{arguments:?}");
    assert!(done.stderr.starts_with("error: "), "{}", done.stderr);
    for word in words {
        assert!(done.stderr.contains(word), "{word:?}: {}", done.stderr);
    }
    let longest = done.stderr.lines().map(|l| l.chars().count()).max();
    assert!(
        done.stderr.len() < 5000 && longest < Some(1000),
        "{}",
        done.stderr
    );
    done
}

#[test]
fn frames_are_ranges_and_never_lists() {
    let out = folder("ranges").join("out");
    for (frames, last) in [
        ("0..18446744073709551615", "frame 18446744073709551614"),
        ("0..1000000000", "frame 999999999"),
        ("3,5..1000000000", "frame 999999999"),
    ] {
        let out = out.to_string_lossy();
        let arguments = [
            "generate", "--preset", "demo", "--out", &out, "--frames", frames,
        ];
        refused(&arguments, &[last, "the sequence has 2 frames"]);
    }
    assert!(!out.exists());
    // Such a small part has no frames, so the run is done at once.
    let shard = "6148914691236517205/9223372036854775808";
    let done = outcome(&mut small(&out, &["--shard", shard]));
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(done.stderr.contains("0 frames"), "{}", done.stderr);
}

/// Runs `config check` on a file's text, and on the same keys given by `--set`.
#[track_caller]
fn check_refuses(name: &str, config: &str, words: &[&str]) {
    let path = folder(name).join("wood.toml");
    fs::write(&path, config).expect("a writable folder");
    let path = path.to_string_lossy();
    let out = folder(name).join("out");
    fs::write(&*path, config).expect("a writable folder");
    let done = refused(&["config", "check", &path], words);
    let generated = refused(&["generate", &path, "--out", &out.to_string_lossy()], words);
    assert_eq!(done.stderr, generated.stderr);
    assert!(!out.exists());
}

#[test]
fn check_refuses_what_generate_refuses() {
    let folder = folder("inputs");
    let file = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::write(&path, text).expect("a writable folder");
        path.to_string_lossy().into_owned()
    };
    let none = folder.join("none").to_string_lossy().into_owned();
    let demo = "preset = \"demo\"\n";
    let says = |name: &str, config: &str, words: &[&str]| {
        check_refuses(name, &format!("{demo}{config}"), words);
    };
    says(
        "date",
        "[sun.date]\nutc = \"2022-13-41T99:00\"",
        &["sun.date.utc", "YYYY-MM-DD", ":3:1"],
    );
    says(
        "far",
        "[sun.date]\nutc = \"2500-01-01T12:00:00\"",
        &["sun.date.utc"],
    );
    says(
        "no_poses",
        &format!("[robot.file]\npath = '{none}'"),
        &["robot.file.path", "No such file"],
    );
    let short = file("short.txt", "0 0 0 0 0 0 0 1\n");
    says(
        "short",
        &format!("[robot.file]\npath = '{short}'"),
        &["frames = 2", "path has 1"],
    );
    let bad = file("bad.txt", "0 0 0 zero\n");
    says(
        "bad_poses",
        &format!("[robot.file]\npath = '{bad}'"),
        &["bad.txt:1", "zero"],
    );
    says(
        "no_table",
        &format!("[lidar.table]\npath = '{none}'"),
        &["lidar.table.path", "No such file"],
    );
    let table = file("bad.csv", "t,a,e\n0,1,x\n");
    says(
        "bad_table",
        &format!("[lidar.table]\npath = '{table}'"),
        &["bad.csv", "line 2"],
    );
    says(
        "no_species",
        &format!("[assets]\nown_species = '{none}'"),
        &["assets.own_species", "No such file"],
    );
    let species = file("bad.toml", "name = \"x\"\n");
    says(
        "bad_species",
        &format!("[assets]\nown_species = '{species}'\nown_share = 1"),
        &["bad.toml", "missing field"],
    );
    says(
        "no_sky",
        &format!("[sky]\nimage = '{none}'"),
        &["sky.image", "No such file"],
    );
    says("no_lens", "[camera.fisheye]\nk1 = -90", &["camera."]);
    says(
        "dense",
        "[placement]\ntrees = 400\nspacing_factor = 10.0",
        &["placement.trees = 400"],
    );
    check_refuses(
        "jungle",
        "preset = \"mediun\"",
        &["mediun", "demo", "did you mean `medium`?", ":1:1"],
    );
    let jungle = file("jungle.toml", "preset = \"nope\"\n");
    refused(
        &["config", "check", &jungle, "--preset", "demo"],
        &["nope", "medium"],
    );
}

#[cfg(unix)]
#[test]
fn devices_are_not_read() {
    for (key, file) in [
        ("assets.own_species", "/dev/zero"),
        ("lidar.table.path", "/dev/zero"),
        ("robot.file.path", "/dev/zero"),
        ("sky.image", "/dev/zero"),
        ("sky.image", "/"),
    ] {
        let setting = format!("{key}={file}");
        let arguments = ["config", "check", "--preset", "demo", "--set", &setting];
        refused(&arguments, &[key, file, "not a regular file"]);
    }
    refused(
        &["config", "check", "/dev/zero"],
        &["cannot read /dev/zero", "not a regular file"],
    );
}

/// Sparse files are as large as one likes and take no room on the disk.
#[test]
fn large_files_are_not_read() {
    let folder = folder("large");
    let large = |name: &str| {
        let path = folder.join(name);
        let file = fs::File::create(&path).expect("a writable folder");
        file.set_len(40 << 30).expect("a hole");
        path.to_string_lossy().into_owned()
    };
    let path = large("large");
    for (key, limit) in [
        ("assets.own_species", "1048576"),
        ("robot.file.path", "268435456"),
    ] {
        let setting = format!("{key}={path}");
        refused(
            &["config", "check", "--set", &setting],
            &[key, limit, "bytes"],
        );
    }
    refused(&["config", "check", &path], &["4194304 bytes"]);
}

#[test]
fn what_is_wrong_a_thousand_times_is_said_in_short() {
    let folder = folder("long");
    let check = |name: &str, text: &str, words: &[&str]| {
        let path = folder.join(name);
        fs::write(&path, text).expect("a writable folder");
        refused(&["config", "check", &path.to_string_lossy()], words);
    };
    let keys: String = (0..30_000).map(|i| format!("key_{i} = 1\n")).collect();
    check(
        "keys.toml",
        &keys,
        &[
            "keys.toml:1:1",
            "key_0: no such key",
            "… and 29990 more errors",
        ],
    );
    let ranges: String = (0..30_000)
        .map(|i| format!("\"key_{i}\" = [1, 2]\n"))
        .collect();
    check(
        "ranges.toml",
        &format!("[ranges]\n{ranges}"),
        &["29990 more"],
    );
    let sensors: String = (0..3_000).map(|i| format!("[cameras.LEFT{i}]\n")).collect();
    check("sensors.toml", &sensors, &["cameras.LEFT", "2990 more"]);
    let long = "x".repeat(200_000);
    check(
        "value.toml",
        &format!("[terrain]\noctaves = \"{long}\"\n"),
        &["value.toml:2:1", "terrain.octaves", "…"],
    );
    check(
        "key.toml",
        &format!("[terrain]\n{long} = 1\n"),
        &["key.toml:2:1", "…", "no such key"],
    );
    check(
        "syntax.toml",
        &format!("seed = \"{long}\n"),
        &["syntax.toml:1:", "…"],
    );
    check(
        "number.toml",
        &format!("frames = {}\n", "9".repeat(300)),
        &["number.toml:1:"],
    );
    check(
        "real.toml",
        "[terrain]\nscale_m = 1e300\n",
        &["terrain.scale_m = 1e300: must be"],
    );
    // An argument may have at most 128 KiB.
    let long = &long[..100_000];
    let setting = format!("seed={long}");
    refused(
        &["config", "check", "--set", &setting],
        &["--set seed=", "…"],
    );
    refused(&["config", "check", "--set", long], &["KEY=VALUE", "…"]);
    refused(
        &["config", "check", "--preset", long],
        &["must be one of", "…"],
    );
}

/// Asserts that a terminal would take nothing in the program's output for a command.
#[track_caller]
fn is_plain(done: &Outcome) {
    for text in [&done.stdout, &done.stderr] {
        let is_command = |c: char| c.is_control() && c != '\n' && c != '\t';
        assert!(!text.contains(is_command), "{text:?}");
    }
}

#[test]
fn nothing_in_a_file_commands_the_terminal() {
    let folder = folder("commands");
    let config = folder.join("wood.toml");
    fs::write(&config, "seed = \"\u{1b}]0;x\u{7}\u{1b}[2J\"\n").expect("a writable folder");
    let config = config.to_string_lossy();
    is_plain(&refused(
        &["config", "check", &config],
        &["wood.toml:1:", "]0;x"],
    ));

    let set = folder.join("set");
    copy_base(&set);
    let manifest = set.join("dataset.json");
    let plain = fs::read_to_string(&manifest).expect("a readable file");
    let hostile = plain.replace("\"Terrain\"", r#""\u001b]0;x\u0007\u001b[2J""#);
    assert_ne!(hostile, plain);
    fs::write(&manifest, hostile).expect("a writable file");
    let done = run(&["stats", &set.to_string_lossy()]);
    is_plain(&done);
    // Whether it is counted or refused, people see what the name is.
    let shown = done.stdout + &done.stderr;
    assert!(shown.contains(r"\u{1b}]0;x\u{7}\u{1b}[2J"), "{shown}");
}

#[test]
fn unknown_keys() {
    let says =
        |setting: &str, words: &[&str]| refused(&["config", "check", "--set", setting], words);
    let done = says(
        "lidar.colours=3",
        &["lidar.colours", "no such key", "pulses"],
    );
    assert!(!done.stderr.contains("did you mean"), "{}", done.stderr);
    says(
        "lidar.mid40.speed=3",
        &["lidar.mid40.speed", "[lidar.mid40] has none"],
    );
    says("lidar.pulse=3", &["did you mean `pulses`?"]);
}

#[test]
fn previews() {
    let out = folder("previews");
    let name = |name: &str| out.join(name).to_string_lossy().into_owned();
    let settings: Vec<&str> = SMALL
        .iter()
        .flat_map(|setting| ["--set", setting])
        .collect();
    let refuse = |arguments: &[&str], words: &[&str]| {
        let start = ["preview", "--preset", "demo"];
        refused(&[&start, &*settings, arguments].concat(), words);
    };
    refuse(
        &["--frame", "40", "--out", &name("beyond.png")],
        &["frame 40", "the sequence has 40 frames"],
    );
    for picture in ["x.jpg", "x", ".png", "x.png.bmp"] {
        refuse(&["--out", &name(picture)], &[picture, ".png"]);
    }
    assert_eq!(fs::read_dir(&out).expect("a folder").count(), 0);
}
