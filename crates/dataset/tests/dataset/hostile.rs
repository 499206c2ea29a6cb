//! Data sets from strangers: nothing outside the folder is touched, no files of others are lost,
//! and nothing is trusted before it is checked. `SECURITY.md` lists the threats.

use std::fs;
use std::path::{Path, PathBuf};

use nemoral_dataset::{
    CloudParams, Dataset, Error, MergeParams, OpenMode, Writer, check, cloud, merge,
};
use serde_json::{Value, json};

use crate::common::{finish, reseal, see, small, stamp, tree, write};

/// All files below the folder of a test's data sets, so that a change anywhere is found.
fn everything(dir: &tempfile::TempDir) -> std::collections::BTreeMap<PathBuf, Vec<u8>> {
    tree(dir.path())
}

fn manifest(root: &Path) -> Value {
    serde_json::from_slice(&fs::read(root.join("dataset.json")).expect("read")).expect("JSON")
}

/// Changes `dataset.json` and stamps it, as a stranger can.
fn tamper(root: &Path, change: impl Fn(&mut Value)) {
    let mut json = manifest(root);
    change(&mut json);
    stamp(root, &mut json);
}

fn merged(parts: &[&Path], out: &Path) -> Result<(), Error> {
    let params = MergeParams {
        partial: true,
        ..MergeParams::default()
    };
    merge(parts, out, params).map(drop)
}

/// An unfinished data set with frame 0.
fn killed(out: &Path) {
    let writer = Writer::create(out, OpenMode::Fresh, small()).expect("create");
    (writer.write_frame(&see(&small(), 0).data(&small()))).expect("frame");
}

const MODES: [OpenMode; 3] = [OpenMode::Fresh, OpenMode::Resume, OpenMode::Overwrite];

#[test]
fn a_sensors_name_that_leads_outside_deletes_nothing() {
    let dir = tempfile::tempdir().expect("a folder");
    let victim = dir.path().join("vict/velodyne/000000.bin");
    fs::create_dir_all(victim.parent().expect("below")).expect("mkdir");
    fs::write(&victim, "theirs").expect("write");
    for name in [
        "../../../vict",
        "../..",
        "/tmp",
        "a/b",
        "A",
        "velodyne",
        "con\u{0}",
        "aux",
        "con",
        "com1",
    ] {
        for finished in [true, false] {
            let out = dir.path().join("out");
            let _ = fs::remove_dir_all(&out);
            let further = |lidars: &mut Value| {
                let mut second = lidars[0].clone();
                second["name"] = name.into();
                lidars.as_array_mut().expect("a list").push(second);
            };
            if finished {
                write(&out, &small(), &[0]);
                tamper(&out, |json| further(&mut json["sequences"][0]["lidars"]));
            } else {
                killed(&out);
                let path = out.join(".nemoral/header.json");
                let text = fs::read_to_string(&path).expect("read");
                let mut sealed: Value = serde_json::from_str(&text).expect("JSON");
                further(&mut sealed["content"]["header"]["sequences"][0]["lidars"]);
                let content = sealed["content"].to_string();
                let digest = blake3::hash(content.as_bytes()).to_hex();
                let text = format!("{{\"blake3\":\"{digest}\",\"content\":{content}}}\n");
                fs::write(&path, text).expect("write");
            }
            let before = everything(&dir);
            for mode in MODES {
                let e = Writer::create(&out, mode, small()).expect_err("a stranger's name");
                assert!(e.to_string().contains("sensor name"), "{name:?}: {e}");
            }
            assert!(Dataset::open(&out).is_err());
            assert!(check(&out).is_err());
            assert!(everything(&dir) == before, "{name:?}");
        }
    }
}

#[test]
fn a_files_path_that_is_not_the_layouts_writes_and_reads_nothing() {
    let dir = tempfile::tempdir().expect("a folder");
    let (part, out) = (dir.path().join("part"), dir.path().join("out"));
    fs::write(dir.path().join("victim.txt"), "theirs").expect("write");
    write(&part, &small(), &[0]);
    let whole = fs::read(part.join("dataset.json")).expect("read");
    let paths = [
        "../victim.txt",
        "/etc/hostname",
        "sequences/00/../../../victim.txt",
        "dataset.json",
        "README.md",
        ".nemoral/header.json",
        "sequences/00/image_2/000001.png",
        "",
    ];
    for path in paths {
        for list in ["frames", "files"] {
            fs::write(part.join("dataset.json"), &whole).expect("write");
            tamper(&part, |json| {
                let files = match list {
                    "frames" => &mut json["frames"][0]["files"],
                    _ => &mut json["files"],
                };
                files[1]["path"] = path.into();
            });
            let before = everything(&dir);
            merged(&[&part], &out).expect_err(path);
            check(&part).expect_err(path);
            assert!(cloud(&part, &dir.path().join("c.ply"), CloudParams::default()).is_err());
            assert!(everything(&dir) == before, "{path}");
        }
    }
}

#[test]
fn merge_verifies_every_byte_that_it_reads() {
    let dir = tempfile::tempdir().expect("a folder");
    let (part, out) = (dir.path().join("part"), dir.path().join("out"));
    write(&part, &small(), &[0, 1, 2, 3]);
    let files = tree(&part);
    let common = |p: &Path| !p.to_string_lossy().contains("/0000");
    for (name, bytes) in &files {
        let path = part.join(name);
        for damage in ["changed", "cut", "gone"] {
            match damage {
                "changed" => {
                    let mut changed = bytes.clone();
                    let middle = changed.len() / 2;
                    changed[middle] ^= 1;
                    fs::write(&path, changed).expect("write");
                }
                "cut" => fs::write(&path, &bytes[..bytes.len() - 1]).expect("write"),
                _ => fs::remove_file(&path).expect("remove"),
            }
            let e = merged(&[&part], &out).expect_err("damaged").to_string();
            // Damage to a manifest can be an error of syntax or of content.
            let is_manifest = name.ends_with("dataset.json");
            let last = name
                .file_name()
                .expect("a name")
                .to_string_lossy()
                .into_owned();
            assert!(is_manifest || e.contains(&last), "{damage}: {e}");
            assert!(
                !common(name) || !out.exists(),
                "{damage}: nothing was written"
            );
            let passed = check(&part).is_ok_and(|report| report.passed());
            assert!(!passed, "{} {damage}: check passes", name.display());
            let _ = fs::remove_dir_all(&out);
        }
        fs::write(&path, bytes).expect("write");
    }
    merged(&[&part], &out).expect("whole again");
    assert!(tree(&out) == files);
}

#[test]
fn a_folder_that_no_whole_header_claims_is_nobodys() {
    let dir = tempfile::tempdir().expect("a folder");
    let sealed = {
        killed(&dir.path().join("made"));
        fs::read(dir.path().join("made/.nemoral/header.json")).expect("read")
    };
    let headers: [Option<&[u8]>; 4] = [None, Some(b""), Some(b"{}"), Some(&sealed[..700])];
    for (i, header) in headers.into_iter().enumerate() {
        let out = dir.path().join(i.to_string());
        let mine = [
            "README.md",
            "config.toml",
            "sequences/00/image_2/000000.png",
        ];
        for name in mine {
            let path = out.join(name);
            fs::create_dir_all(path.parent().expect("below")).expect("mkdir");
            fs::write(path, "mine").expect("write");
        }
        fs::create_dir_all(out.join(".nemoral/frames")).expect("mkdir");
        if let Some(header) = header {
            fs::write(out.join(".nemoral/header.json"), header).expect("write");
        }
        let before = tree(&out);
        for mode in MODES {
            let e = Writer::create(&out, mode, small()).expect_err("nobody's");
            assert!(matches!(e, Error::Unowned { .. }), "{e}");
            assert!(e.to_string().contains("remove this folder"), "{e}");
        }
        assert!(tree(&out) == before);
        // A folder with nothing else is that of a writer that had just begun, and can be used.
        for name in mine {
            fs::remove_file(out.join(name)).expect("remove");
        }
        fs::remove_dir_all(out.join("sequences")).expect("remove");
        finish(
            Writer::create(&out, OpenMode::Fresh, small()).expect("create"),
            4,
        );
        assert!(!out.join(".nemoral").exists());
    }
}

#[cfg(unix)]
#[test]
fn links_are_followed_to_the_folder_and_nowhere_below() {
    use std::os::unix::fs::symlink;
    let dir = tempfile::tempdir().expect("a folder");
    let theirs = dir.path().join("theirs");
    fs::create_dir(&theirs).expect("mkdir");
    fs::write(theirs.join("000000.png"), "theirs").expect("write");
    fs::write(theirs.join("dataset.json"), "theirs").expect("write");
    let real = dir.path().join("real");
    fs::create_dir(&real).expect("mkdir");
    let out = dir.path().join("out");
    symlink(&real, &out).expect("link");
    write(&out, &small(), &[0]);
    assert!(
        check(&out).expect("a data set").problems.is_empty(),
        "OUT may be a link"
    );

    let linked = |name: &str, to: &Path| {
        let (path, aside) = (real.join(name), dir.path().join("aside"));
        fs::rename(&path, &aside).expect("moved");
        symlink(to, &path).expect("link");
        let before = everything(&dir);
        let overwritten = Writer::create(&out, OpenMode::Overwrite, small()).expect_err(name);
        assert!(
            overwritten.to_string().contains("link"),
            "{name}: {overwritten}"
        );
        let passed = check(&out).is_ok_and(|report| report.passed());
        assert!(!passed, "{name}");
        merged(&[&real], &dir.path().join("merged")).expect_err(name);
        let _ = fs::remove_dir_all(dir.path().join("merged"));
        let after = everything(&dir);
        let changed = after
            .iter()
            .filter(|(path, bytes)| before.get(*path) != Some(*bytes));
        let changed: Vec<_> = changed.map(|(path, _)| path).collect();
        // A writer that is refused may leave its lock and header.
        assert!(
            changed
                .iter()
                .all(|p| p.to_string_lossy().contains(".nemoral")),
            "{changed:?}"
        );
        assert!(
            before.keys().all(|path| after.contains_key(path)),
            "{name}: something is gone"
        );
        let _ = fs::remove_dir_all(real.join(".nemoral"));
        fs::remove_file(&path).expect("unlinked");
        fs::rename(&aside, &path).expect("moved back");
    };
    linked("sequences/00/image_2", &theirs);
    linked("sequences", &theirs);
    linked("dataset.json", &theirs.join("dataset.json"));
    let mode = OpenMode::Overwrite;
    drop(Writer::create(&out, mode, small()).expect("without links it is overwritten"));
    assert_eq!(
        fs::read(theirs.join("000000.png")).expect("there"),
        b"theirs"
    );
}

#[test]
fn what_cannot_be_is_not_accepted() {
    let dir = tempfile::tempdir().expect("a folder");
    let root = dir.path().join("set");
    write(&root, &small(), &[0, 1]);
    let whole = fs::read(root.join("dataset.json")).expect("read");
    type Lie<'a> = (&'a str, &'a dyn Fn(&mut Value));
    let place = |origin_m: Value, epsg: Value| {
        move |j: &mut Value| {
            j["sequences"][0]["site"] = json!({ "origin_m": origin_m, "epsg": epsg });
        }
    };
    let lies: [Lie<'_>; 34] = [
        ("world_from_body", &|j| {
            j["frames"][0]["world_from_body"][0][3] = json!(1e308)
        }),
        ("world_from_body", &|j| {
            j["frames"][0]["world_from_body"][0][0] = json!(2.0)
        }),
        ("world_from_frame0", &|j| {
            j["tracks"][0]["world_from_frame0"][1][3] = json!(-1e300)
        }),
        ("one of the sequence's", &|j| {
            j["frames"][1]["index"] = json!(77)
        }),
        ("of a sequence with a track", &|j| {
            j["frames"][1]["sequence"] = json!(3)
        }),
        ("order", &|j| j["frames"][1] = j["frames"][0].clone()),
        ("number of sequences", &|j| j["sequences"] = json!([])),
        ("order of their numbers", &|j| {
            j["sequences"] = json!([j["sequences"][0], j["sequences"][0]])
        }),
        ("that of a sequence", &|j| {
            j["sequences"][0]["number"] = json!(3)
        }),
        ("frames", &|j| j["tracks"][0]["frames"] = json!([[0, 4]])),
        ("length", &|j| j["tracks"][0]["length"] = json!(0)),
        ("length", &|j| j["tracks"][0]["length"] = json!(u64::MAX)),
        ("lines", &|j| j["tracks"][0]["lines"] = json!([1, 2])),
        ("lines", &|j| j["tracks"][0]["lines"] = json!([0, 2, 2])),
        ("lines", &|j| j["tracks"][0]["lines"] = json!([0, u64::MAX])),
        ("chunk_size_m", &|j| {
            j["sequences"][0]["chunk_size_m"] = json!(0.0)
        }),
        ("half_scan_s", &|j| {
            j["sequences"][0]["half_scan_s"] = json!(-0.5)
        }),
        ("half_scan_s", &|j| {
            j["sequences"][0]["half_scan_s"] = json!(1e9)
        }),
        ("sensor name", &|j| {
            j["sequences"][0]["cameras"][0]["name"] = json!("../..")
        }),
        ("sensor name", &|j| {
            j["sequences"][0]["lidars"][0]["name"] = json!("lpt9")
        }),
        ("control character", &|j| {
            j["ontology"]["classes"][0]["name"] = json!("sky\u{1b}[2J")
        }),
        ("time_s", &|j| j["frames"][0]["time_s"] = json!(1.7e18)),
        ("width", &|j| {
            j["sequences"][0]["cameras"][0]["intrinsics"]["width"] = json!(60_000)
        }),
        ("fx", &|j| {
            j["sequences"][0]["cameras"][0]["intrinsics"]["fx"] = json!(0.0)
        }),
        ("sensor_chunks", &|j| {
            j["frames"][0]["sensor_chunks"] = json!([])
        }),
        ("bytes", &|j| {
            j["frames"][0]["files"][0]["bytes"] = json!(u64::MAX)
        }),
        ("point_classes", &|j| {
            j["frames"][0]["point_classes"]["1"] = json!(u64::MAX)
        }),
        ("site.epsg", &place(json!([0, 0, 0]), json!(1023))),
        ("site.epsg", &place(json!([0, 0, 0]), json!(32_767))),
        ("65536", &place(json!([0, 0, 0]), json!(65_536))),
        ("site.origin_m", &place(json!([6e7, 0, 0]), json!(25_829))),
        ("site.origin_m", &place(json!([0, 0, -1e300]), Value::Null)),
        ("length 2", &place(json!([0, 0]), Value::Null)),
        ("number of sensors", &|j| {
            let camera = j["sequences"][0]["cameras"][0].clone();
            let named = |i: usize| {
                let mut camera = camera.clone();
                camera["name"] = json!(format!("c{i}"));
                camera
            };
            j["sequences"][0]["cameras"] = (0..300).map(named).collect();
        }),
    ];
    for (field, lie) in lies {
        fs::write(root.join("dataset.json"), &whole).expect("write");
        tamper(&root, lie);
        for e in [
            check(&root).expect_err(field),
            Dataset::open(&root).expect_err(field),
            merged(&[&root], &dir.path().join("out")).expect_err(field),
        ] {
            assert!(e.to_string().contains(field), "{field}: {e}");
        }
    }
    // A manifest that is valid but was changed is found by its checksum.
    fs::write(root.join("dataset.json"), &whole).expect("write");
    let mut json = manifest(&root);
    json["licence"] = "mine".into();
    fs::write(root.join("dataset.json"), json.to_string()).expect("write");
    let report = check(&root).expect("it can be read");
    assert!(
        report
            .problems
            .iter()
            .any(|p| p.message.contains("was changed")),
        "{report}"
    );
    assert!(merged(&[&root], &dir.path().join("out")).is_err());
}

#[test]
fn a_strangers_text_is_short_and_plain_in_messages() {
    let dir = tempfile::tempdir().expect("a folder");
    let root = dir.path().join("set");
    write(&root, &small(), &[0]);
    let whole = fs::read(root.join("dataset.json")).expect("read");
    let long = json!("\u{1b}[2J".repeat(100_000));
    let places = [
        "/seed",
        "/frames/0/key",
        "/frames/0/time_s",
        "/frames/0/files/0/path",
        "/frames/0/files/0/blake3",
        "/sequences/0/split",
        "/sequences/0/cameras/0/name",
        "/sequences/0/lidars/0/name",
        "/ontology/classes/0/name",
    ];
    for place in places {
        fs::write(root.join("dataset.json"), &whole).expect("write");
        tamper(&root, |json| match json.pointer_mut(place) {
            Some(value) => *value = long.clone(),
            // What is not split says nothing of it.
            None => json["sequences"][0]["split"] = long.clone(),
        });
        let e = Dataset::open(&root).expect_err(place).to_string();
        let shown = e.replace(&*root.to_string_lossy(), "");
        let is_plain = !shown.contains(char::is_control);
        assert!(shown.len() < 1000 && is_plain, "{place}: {shown}");
    }
}

#[test]
fn the_configs_of_sequences_are_read_when_they_are_asked_for() {
    let dir = tempfile::tempdir().expect("a folder");
    let root = dir.path().join("set");
    let dataset = write(&root, &small(), &[0]);
    assert_eq!(dataset.manifest().header.sequences[0].config_toml, "");
    assert!(dataset.sequence_config(0).is_ok() && dataset.sequence_config(1).is_err());
    let name = "sequences/00/config.toml";
    fs::write(root.join(name), "seed = 1\n").expect("write");
    let dataset = Dataset::open(&root).expect("a config is for human readers");
    let e = dataset.sequence_config(0).expect_err("changed").to_string();
    assert!(e.contains("config.toml"), "{e}");
    merged(&[&root], &dir.path().join("out")).expect_err("changed");
    // No reader of configs takes so much.
    tamper(&root, |json| {
        let files = json["files"].as_array_mut().expect("a list");
        let of_sequence = files.iter_mut().find(|file| file["path"] == name);
        of_sequence.expect("listed")["bytes"] = json!((4 << 20) + 1);
    });
    let e = Dataset::open(&root).expect_err("too large").to_string();
    assert!(e.contains("config.toml: bytes = 4194305: must be"), "{e}");
}

#[test]
fn pictures_and_scans_that_lie_about_their_size_take_no_memory() {
    let dir = tempfile::tempdir().expect("a folder");
    let dataset = write(dir.path(), &small(), &[0]);
    let picture = "sequences/00/image_2/000000.png";
    let mut huge = Vec::new();
    {
        let mut encoder = png::Encoder::new(&mut huge, 60_000, 60_000);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header().expect("a header");
    }
    let vertex = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nend_header\n";
    let vertex = [&vertex[..], &[0; 30]].concat();
    for (name, lie, says) in [
        (
            picture,
            huge,
            "is 60000 × 60000 pixels, the camera has 32 × 24",
        ),
        ("sequences/00/points/000000.ply", vertex, "other fields"),
    ] {
        let whole = fs::read(dir.path().join(name)).expect("read");
        fs::write(dir.path().join(name), lie).expect("write");
        reseal(dir.path(), name);
        let report = check(dir.path()).expect("a data set");
        assert!(
            report.problems.iter().any(|p| p.message.contains(says)),
            "{report}"
        );
        // The data set that was opened before compares the file with its old checksum.
        assert!(dataset.read_frame(0).is_err());
        fs::write(dir.path().join(name), whole).expect("write");
        reseal(dir.path(), name);
    }
    assert!(check(dir.path()).expect("a data set").problems.is_empty());
}

#[test]
fn what_no_manifest_has_is_skipped_without_being_kept() {
    let dir = tempfile::tempdir().expect("a folder");
    write(dir.path(), &small(), &[0]);
    let path = dir.path().join("dataset.json");
    let text = fs::read_to_string(&path).expect("read");
    // Values in each other that deep are an error wherever they are kept.
    let deep = format!("{}{}", "[".repeat(1000), "]".repeat(1000));
    let with = text.replacen('{', &format!("{{\"x\": {deep},"), 1);
    fs::write(&path, with).expect("write");
    Dataset::open(dir.path()).expect("a data set");
    // A config is kept, and is no longer than those that are read.
    let long = format!("\"config\": {{\"x\": \"{}\",", "y".repeat(4 << 20));
    let with = text.replacen("\"config\": {", &long, 1);
    assert!(with.len() > text.len());
    fs::write(&path, with).expect("write");
    let refused = Dataset::open(dir.path()).expect_err("too long").to_string();
    assert!(refused.contains("at most 4194304 are read"), "{refused}");
}

#[test]
fn a_broken_manifest_says_what_to_do() {
    let dir = tempfile::tempdir().expect("a folder");
    let root = dir.path().join("set");
    write(&root, &small(), &[0]);
    let whole = fs::read(root.join("dataset.json")).expect("read");
    for broken in [&b""[..], b"{", &whole[..whole.len() / 2]] {
        fs::write(root.join("dataset.json"), broken).expect("write");
        let before = tree(&root);
        for mode in [OpenMode::Resume, OpenMode::Overwrite] {
            let e = Writer::create(&root, mode, small()).expect_err("damaged");
            assert!(matches!(e, Error::Damaged { .. }), "{e}");
            assert!(e.to_string().contains("remove this folder"), "{e}");
        }
        let opened = Dataset::open(&root).expect_err("damaged").to_string();
        assert!(opened.contains("dataset.json: "), "{opened}");
        assert!(tree(&root) == before);
    }
    // While the data set is unfinished, the state folder identifies it, and a broken manifest is
    // made anew.
    let other = dir.path().join("other");
    killed(&other);
    fs::write(other.join("dataset.json"), "").expect("write");
    let writer = Writer::create(&other, OpenMode::Resume, small()).expect("resume");
    assert_eq!(writer.frames(), [(0, 0)]);
    finish(writer, 4);
    assert!(
        tree(&other) == {
            fs::write(root.join("dataset.json"), whole).expect("write");
            tree(&root)
        }
    );
}

#[test]
fn merge_says_which_frames_are_missing() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = |name: &str| dir.path().join(name);
    write(&path("0"), &small(), &[0]);
    write(&path("2"), &small(), &[2]);
    let (first, third, out) = (path("0"), path("2"), path("out"));
    let e = merge(&[&first, &third], &out, MergeParams::default()).expect_err("incomplete");
    assert!(
        e.to_string()
            .contains("no part has frames 1..2, 3..4 of its 4"),
        "{e}"
    );
    assert!(!out.exists());
    merged(&[&first, &third], &out).expect("as asked");
    assert_eq!(Dataset::open(&out).expect("open").frames().len(), 2);
}

#[test]
fn a_cloud_never_takes_the_place_of_a_file_of_the_data_set() {
    let dir = tempfile::tempdir().expect("a folder");
    let root = dir.path().join("set");
    write(&root, &small(), &[0]);
    let before = tree(&root);
    let at = |out: &Path, voxel_m| {
        cloud(
            &root,
            out,
            CloudParams {
                voxel_m,
                ..CloudParams::default()
            },
        )
    };
    for own in [
        "sequences/00/points/000000.ply",
        "sequences/00/new.ply",
        "sequences/00/../00/points/000000.ply",
        "dataset.json",
        "sequences/00/trees.csv",
        ".nemoral.txt",
    ] {
        at(&root.join(own), None).expect_err(own);
    }
    for voxel_m in [1e-300, 0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
        let e = at(&dir.path().join("c.ply"), Some(voxel_m)).expect_err("no side");
        assert!(e.to_string().contains("0.0001 to 1000 m"), "{e}");
    }
    assert!(tree(&root) == before);
    assert!(at(&root.join("cloud.ply"), Some(0.1)).expect("beside the data set's files") > 0);
    assert!(check(&root).expect("a data set").problems.is_empty());
}

#[test]
fn a_merge_makes_no_data_set_that_cannot_be_opened() {
    let dir = tempfile::tempdir().expect("a folder");
    let [whole, out] = ["whole", "out"].map(|name| dir.path().join(name));
    write(&whole, &small(), &[0, 1, 2, 3]);
    // An allegedly killed merge with a frame that the drive of four frames does not have.
    let writer = Writer::create(&out, OpenMode::Fresh, small()).expect("create");
    (writer.write_frame(&see(&small(), 6).data(&small()))).expect("frame");
    drop(writer);
    let params = MergeParams {
        mode: OpenMode::Resume,
        ..MergeParams::default()
    };
    let e = merge(&[&whole], &out, params).expect_err("a frame of nothing");
    assert!(e.to_string().contains("frame 6"), "{e}");
    assert!(!out.join("dataset.json").exists());
    // The same with a frame number that overflows.
    let record = |index: u64| out.join(format!(".nemoral/frames/00-{index:06}.json"));
    let text = fs::read_to_string(record(6)).expect("read");
    let sealed: Value = serde_json::from_str(&text).expect("JSON");
    let mut frame = sealed["content"].clone();
    frame["index"] = u64::MAX.into();
    let renamed = frame
        .to_string()
        .replace("/000006.", &format!("/{}.", u64::MAX));
    let digest = blake3::hash(renamed.as_bytes()).to_hex();
    let sealed = format!("{{\"blake3\":\"{digest}\",\"content\":{renamed}}}\n");
    fs::write(record(u64::MAX), sealed).expect("write");
    fs::remove_file(record(6)).expect("remove");
    merge(&[&whole], &out, params).expect("that is no frame");
    assert_eq!(Dataset::open(&out).expect("open").frames().len(), 4);
}
