//! Commands that print an answer: config, plan, preview, help.

use std::fs;
use std::process::Stdio;
use std::time::SystemTime;

use crate::common::{Outcome, SMALL, files, folder, nemoral, outcome, run, small};

/// Runs a command that must print an answer and nothing else.
#[track_caller]
fn answer(arguments: &[&str]) -> String {
    let done = run(arguments);
    assert_eq!(done.code, Some(0), "{arguments:?}: {}", done.stderr);
    assert_eq!(done.stderr, "", "{arguments:?}");
    assert!(done.stdout.ends_with('\n'), "{arguments:?}");
    done.stdout
}

const PRESETS: [&str; 16] = [
    "default",
    "low",
    "medium",
    "high",
    "maritime-pine",
    "eucalyptus-plantation",
    "oak-mixed",
    "beech",
    "spruce",
    "boreal-birch-pine",
    "montado",
    "glade",
    "meadow-edge",
    "rank-clearing",
    "stream-valley",
    "demo",
];

#[test]
fn help() {
    let commands = [
        "generate", "preview", "config", "plan", "check", "stats", "merge",
    ];
    let help = answer(&["--help"]);
    for command in commands {
        assert!(help.contains(command), "{command}: {help}");
        let more = answer(&[command, "--help"]);
        assert!(more.contains(&format!("nemoral {command}")), "{more}");
    }
    assert_eq!(
        answer(&["--version"]),
        format!("nemoral {}\n", env!("CARGO_PKG_VERSION"))
    );
    // A request without a command, or with an unknown one, is wrong.
    for arguments in [&[][..], &["grow"], &["config"], &["check"], &["merge"]] {
        let Outcome {
            code,
            stdout,
            stderr,
        } = run(arguments);
        assert_eq!(code, Some(2), "{arguments:?}");
        assert!(stdout.is_empty(), "{arguments:?}: {stdout}");
        assert!(stderr.contains("Usage: nemoral"), "{arguments:?}: {stderr}");
    }
}

#[test]
fn presets_are_listed() {
    let list = answer(&["config", "presets"]);
    let names: Vec<_> = list.lines().filter_map(|l| l.split(' ').next()).collect();
    assert_eq!(names, PRESETS);
}

#[test]
#[ignore = "grows the plants of every preset: .ci/full runs it"]
fn presets_are_fine() {
    for name in PRESETS {
        // One tree of each kind is enough for what is checked.
        let few = ["--set", "assets.individuals=1"];
        let check = ["config", "check", "--preset", name];
        assert_eq!(answer(&[&check[..], &few].concat()), "fine\n");
    }
}

#[test]
fn a_config_survives_writing_and_reading() {
    let folder = folder("config");
    let asked = [
        "--preset",
        "low",
        "--seed",
        "9",
        "--set",
        "terrain.octaves=3",
    ];
    let shown = answer(&[&["config", "show"], &asked[..]].concat());
    for line in ["seed = 9", "octaves = 3", "trees = 31.0"] {
        assert!(shown.lines().any(|l| l == line), "{line}: {shown}");
    }
    // With comments to start from, or as it is.
    let started = answer(&[&["config", "init"], &asked[..]].concat());
    assert!(started.lines().filter(|l| l.starts_with('#')).count() > 50);
    for (name, text) in [("init.toml", &started), ("show.toml", &shown)] {
        let path = folder.join(name);
        fs::write(&path, text).expect("a writable folder");
        let path = path.to_string_lossy();
        assert_eq!(answer(&["config", "check", &path]), "fine\n");
        assert_eq!(answer(&["config", "show", &path]), shown, "{name}");
    }

    // The file is over the preset, `--set` over the file, the later over the earlier.
    let path = folder.join("over.toml");
    let path = path.to_string_lossy();
    fs::write(&*path, "frames = 5\n[terrain]\noctaves = 4\n").expect("a writable folder");
    let layers = [
        "--preset",
        "demo",
        "--set",
        "terrain.octaves=7",
        "--set",
        "terrain.octaves=8",
    ];
    let shown = answer(&[&["config", "show", &path], &layers[..]].concat());
    for line in ["frames = 5", "octaves = 8", "visible_radius_m = 40.0"] {
        assert!(shown.lines().any(|l| l == line), "{line}: {shown}");
    }

    fs::write(&*path, "[terrain]\noctaves = 0\n").expect("a writable folder");
    for command in ["check", "show", "init"] {
        let done = run(&["config", command, &path]);
        assert_eq!(done.code, Some(2), "{command}: {}", done.stderr);
        assert!(done.stdout.is_empty(), "{command}");
        assert!(done.stderr.contains("over.toml:2:1"), "{}", done.stderr);
    }
}

#[test]
fn the_reference_has_the_help_of_every_command() {
    // The cache's environment variable differs from machine to machine.
    let plain = |text: &str| -> String {
        let of_cache = |line: &&str| !line.contains("NEMORAL_CACHE");
        text.lines()
            .map(str::trim_end)
            .filter(of_cache)
            .collect::<Vec<_>>()
            .join("\n")
    };
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reference/cli.md");
    let page = plain(&fs::read_to_string(page).expect("the handbook's page"));
    let program = answer(&["--help"]);
    let list = program.lines().skip_while(|l| *l != "Commands:").skip(1);
    let names = list.map_while(|l| l.split_whitespace().next());
    let commands: Vec<&str> = names.filter(|name| *name != "help").collect();
    assert!(commands.len() > 9, "{commands:?}");
    for command in [""].into_iter().chain(commands) {
        let words: Vec<&str> = command.split_whitespace().chain(["--help"]).collect();
        let help = plain(&answer(&words));
        let block = format!("```text\n{}\n```", help.trim());
        assert!(
            page.contains(&block),
            "docs/reference/cli.md lacks\n{block}"
        );
    }
}

#[test]
fn the_schema_and_the_reference_know_every_key() {
    let schema = answer(&["config", "schema"]);
    let schema: serde_json::Value = serde_json::from_str(&schema).expect("JSON");
    let reference = answer(&["config", "reference"]);
    assert!(reference.starts_with("# Config reference\n"));
    let mut section = &schema;
    let mut keys = 0;
    for line in answer(&["config", "show"]).lines() {
        if let Some(path) = line.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
            section = path.split('.').fold(&schema, |s, p| &s["properties"][p]);
            assert!(reference.contains(&format!("\n## [{path}]\n")), "{path}");
        } else if let Some((key, _)) = line.split_once(" = ") {
            assert!(section["properties"][key].is_object(), "{key}");
            assert!(reference.contains(&format!("| `{key}` |")), "{key}");
            keys += 1;
        }
    }
    assert!(keys > 60, "{keys} keys");
}

#[test]
fn the_plan_as_a_graph_and_as_keys() {
    let mermaid = answer(&["plan", "--preset", "demo"]);
    assert!(mermaid.starts_with("flowchart"), "{mermaid}");
    let dot = answer(&["plan", "--preset", "demo", "--format", "dot"]);
    assert!(dot.starts_with("digraph nemoral {"), "{dot}");
    assert!(dot.ends_with("}\n"), "{dot}");
    // The same stages and the same edges.
    let count = |text: &str, word: &str| text.matches(word).count();
    assert_eq!(count(&mermaid, "--"), count(&dot, "->"));
    assert!(count(&dot, "->") > 10);
    for stage in [
        "world.assets",
        "chunk.object_geometry",
        "frame.images",
        "frame.scans",
    ] {
        assert!(mermaid.contains(stage) && dot.contains(stage), "{stage}");
    }

    let explain = |set: &str| answer(&["plan", "--preset", "demo", "--explain", "--set", set]);
    let keys = explain("frames=2");
    assert_eq!(keys, explain("frames=2"));
    let differ = |other: &str, stage: &str| {
        let line = |text: &str| {
            let line = text.lines().find(|l| l.starts_with(&format!("{stage} ")));
            line.expect("a line of its own").to_owned()
        };
        line(&keys) != line(other)
    };
    // Another seed changes every key, another picture only those of pictures.
    let seed = explain("seed=8");
    assert!(differ(&seed, "chunk.object_geometry") && differ(&seed, "frame.scans"));
    let camera = explain("camera.width_px=200");
    assert!(differ(&camera, "frame.images"));
    assert!(!differ(&camera, "frame.scans") && !differ(&camera, "chunk.object_geometry"));
}

#[test]
fn a_gpu_that_is_not_there_is_refused_in_words() {
    let out = folder("no-gpu").join("data");
    // No GPU has this name, so the answer is the same on every machine.
    let asked = |backend: &str| {
        outcome(small(&out, &["--backend", backend]).env("WGPU_ADAPTER_NAME", "no such GPU"))
    };
    let refused = asked("gpu");
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
    for said in ["no GPU", "--backend cpu", "mesa-vulkan-drivers"] {
        assert!(refused.stderr.contains(said), "{}", refused.stderr);
    }
    let little = outcome(&mut small(&out, &["--gpu-memory", "5"]));
    assert_eq!(little.code, Some(2), "{}", little.stderr);
    for said in ["--gpu-memory", "'5'", "128..=1048576"] {
        assert!(little.stderr.contains(said), "{}", little.stderr);
    }
    assert!(!out.exists(), "nothing was written");
    let done = asked("auto");
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let note = "note: renderer: the CPU (no GPU: ";
    assert_eq!(done.stderr.matches(note).count(), 1, "{}", done.stderr);
}

#[test]
fn a_preview_is_a_picture() {
    let out = folder("preview").join("sheet.png");
    let path = out.to_string_lossy();
    let done = run(&[
        "preview", "--preset", "demo", "--frame", "1", "--out", &path,
    ]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert_eq!(done.stdout.trim_end(), path);
    // Only the renderer is named.
    assert!(
        done.stderr.starts_with("note: renderer: "),
        "{}",
        done.stderr
    );
    assert_eq!(done.stderr.lines().count(), 1, "{}", done.stderr);
    let png = fs::read(&out).expect("a picture");
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"));
    // The picture of 160 x 96 pixels, and four of half its size below.
    let size = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes"));
    assert!(size(16) > 160 && size(20) > 96 + 2 * 48);
    assert!(png.len() > 20_000, "{} bytes: it shows nothing", png.len());

    let done = run(&["preview", "--preset", "jungle", "--out", &path]);
    assert_eq!(done.code, Some(2), "{}", done.stderr);
    assert_eq!(fs::read(&out).expect("a picture"), png, "untouched");
}

/// A cache that cannot be used only costs time: there is a note, and the answer is printed all the
/// same.
#[test]
fn a_folder_that_is_no_cache_is_told_of() {
    let folder = folder("no-cache");
    fs::create_dir_all(&folder).expect("a folder");
    let (file, sheet) = (folder.join("a-file"), folder.join("sheet.png"));
    fs::write(&file, "no folder").expect("a file");
    let (file, sheet) = (file.to_string_lossy(), sheet.to_string_lossy());
    for question in [
        vec!["plan", "--explain"],
        vec!["preview", "--frame", "0", "--out", &sheet],
    ] {
        let done = run(&[&question[..], &["--preset", "demo", "--cache", &file]].concat());
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        assert!(!done.stdout.is_empty(), "{question:?}");
        let note = format!("note: cannot keep grown trees in {file}: ");
        assert!(done.stderr.contains(&note), "{question:?}: {}", done.stderr);
    }
}

/// Two runs that begin at once both find an empty cache, grow the same trees and write files of the
/// same names.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn two_previews_share_a_cache() {
    let folder = folder("shared-cache");
    let cache = folder.join("cache");
    let preview = |sheet: &str| {
        let mut command = nemoral();
        command.args(["preview", "--preset", "demo", "--backend", "cpu"]);
        for setting in SMALL {
            command.args(["--set", setting]);
        }
        let out = folder.join(sheet);
        command.arg("--cache").arg(&cache).arg("--out").arg(out);
        command
    };
    let both = ["a.png", "b.png"].map(|sheet| {
        let mut command = preview(sheet);
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        command.spawn().expect("the program starts")
    });
    for one in both {
        let output = one.wait_with_output().expect("it ends");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{stderr}");
    }

    // A file gets its final name when it is whole; until then its name contains the process as
    // well.
    let kept = files(&cache);
    assert!(!kept.is_empty(), "nothing is kept");
    for name in kept.keys() {
        assert_eq!(name.matches('.').count(), 1, "{name} is a part");
    }

    // A file that is read gets a new date. A hard link tells it from one that is grown again and
    // put in its place.
    let names = folder.join("names");
    fs::create_dir_all(&names).expect("a folder");
    for name in kept.keys() {
        fs::hard_link(cache.join(name), names.join(name)).expect("a second name");
        let file = fs::File::options().append(true).open(cache.join(name));
        let dated = file.and_then(|f| f.set_modified(SystemTime::UNIX_EPOCH));
        dated.expect("an old date");
    }
    let third = outcome(&mut preview("c.png"));
    assert_eq!(third.code, Some(0), "{}", third.stderr);
    for name in kept.keys() {
        let date = fs::metadata(names.join(name)).and_then(|m| m.modified());
        let date = date.expect("a date");
        assert!(date > SystemTime::UNIX_EPOCH, "{name} was not read");
    }
    assert!(files(&cache) == kept, "it keeps something else");

    let [a, b, c] =
        ["a.png", "b.png", "c.png"].map(|s| fs::read(folder.join(s)).expect("a picture"));
    assert!(a == b, "the two differ");
    assert!(a == c, "what was kept gives another picture");
    assert!(a.starts_with(b"\x89PNG"), "{} bytes", a.len());
}

/// Output that cannot be written is a failure; a closed pipe is none.
#[cfg(target_os = "linux")]
#[test]
fn standard_output_that_is_full_or_closed() {
    let full = fs::OpenOptions::new().write(true).open("/dev/full");
    let full = full.expect("Linux has it");
    let output = nemoral().args(["config", "show"]).stdout(full).output();
    let output = output.expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(
        stderr.contains("standard output: No space left"),
        "{stderr}"
    );

    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let output = nemoral().args(["config", "show"]).stdout(writer).output();
    let output = output.expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert!(stderr.is_empty(), "{stderr}");
}
