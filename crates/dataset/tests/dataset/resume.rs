//! Which folders may be written to, resumed and replaced.

use std::fs;
use std::path::Path;

use nemoral_dataset::{Dataset, DatasetHeader, Error, MergeParams, OpenMode, Writer, check, merge};
use nemoral_scene::Ontology;

use crate::common::{finish, see, small, tree, write};

/// A new folder, whether or not all frames are there.
const PARTIAL: MergeParams = MergeParams {
    mode: OpenMode::Fresh,
    partial: true,
};

fn create(out: &Path, mode: OpenMode) -> Result<Writer, Error> {
    Writer::create(out, mode, small())
}

/// An unfinished data set with these frames.
fn killed(out: &Path, frames: &[usize]) {
    let writer = create(out, OpenMode::Fresh).expect("create");
    for &k in frames {
        writer
            .write_frame(&see(&small(), k).data(&small()))
            .expect("frame");
    }
}

#[test]
fn a_folder_that_holds_something_else_is_refused_and_untouched() {
    let dir = tempfile::tempdir().expect("a folder");
    for (name, bytes) in [("thesis.tex", "mine"), ("dataset.json", "{\"a\": 1}")] {
        let out = dir.path().join(name.replace('.', "_"));
        fs::create_dir(&out).expect("mkdir");
        fs::write(out.join(name), bytes).expect("write");
        for mode in [OpenMode::Fresh, OpenMode::Resume, OpenMode::Overwrite] {
            let before = tree(&out);
            let e = create(&out, mode).expect_err("refused").to_string();
            assert!(e.contains(name), "{e}");
            let probed = Writer::probe(&out, mode, &small()).expect_err("refused");
            assert_eq!(probed.to_string(), e);
            assert_eq!(tree(&out), before);
        }
        assert!(Dataset::open(&out).is_err());
    }
    let file = dir.path().join("file");
    fs::write(&file, "x").expect("write");
    let e = create(&file, OpenMode::Fresh)
        .expect_err("a file")
        .to_string();
    assert!(e.contains("file"), "{e}");
    let e = create(&file.join("below"), OpenMode::Fresh).expect_err("below a file");
    assert!(matches!(e, Error::Io { .. }), "{e}");
}

#[test]
fn an_existing_data_set_needs_a_word() {
    let dir = tempfile::tempdir().expect("a folder");
    killed(dir.path(), &[0]);
    let e = create(dir.path(), OpenMode::Fresh)
        .expect_err("exists")
        .to_string();
    assert!(e.contains("holds an unfinished data set"), "{e}");
    let e = Dataset::open(dir.path())
        .expect_err("unfinished")
        .to_string();
    assert!(e.contains("resume what was writing it"), "{e}");
    finish(create(dir.path(), OpenMode::Resume).expect("resume"), 4);
    let e = create(dir.path(), OpenMode::Fresh)
        .expect_err("exists")
        .to_string();
    assert!(e.contains("holds a data set"), "{e}");
}

#[test]
fn a_killed_run_goes_on_and_ends_with_the_same_bytes() {
    let dir = tempfile::tempdir().expect("a folder");
    let (one, two) = (dir.path().join("one"), dir.path().join("two"));
    write(&one, &small(), &[0, 1, 2]);

    killed(&two, &[0, 1]);
    // The leftovers of a kill: half a frame without a record, a temporary file, a damaged file.
    fs::write(two.join("sequences/00/depth/000002.png"), "half").expect("write");
    fs::write(two.join("sequences/00/depth/.nemoral-Ab12.tmp"), "half").expect("write");
    fs::write(two.join("sequences/00/labels/000001.label"), "damaged").expect("write");
    let writer = create(&two, OpenMode::Resume).expect("resume");
    assert_eq!(writer.frames(), [(0, 0), (0, 1)]);
    let mut made = Vec::new();
    for k in 0..3 {
        let seen = see(&small(), k);
        if !writer.has_frame(0, seen.index, &seen.key) {
            writer.write_frame(&seen.data(&small())).expect("frame");
            made.push(k);
        }
    }
    assert_eq!(made, [1, 2]);
    assert!(
        !writer.has_frame(0, 0, &[9; 32]),
        "another key is another frame"
    );
    finish(writer, 4);
    assert!(tree(&one) == tree(&two));

    // A finished data set can be made longer.
    let writer = create(&two, OpenMode::Resume).expect("resume");
    assert_eq!(writer.frames().len(), 3);
    writer
        .write_frame(&see(&small(), 3).data(&small()))
        .expect("frame");
    finish(writer, 4);
    let three = dir.path().join("three");
    write(&three, &small(), &[3, 1, 0, 2]);
    assert!(tree(&two) == tree(&three));
}

#[test]
fn a_frame_that_is_being_rewritten_does_not_count() {
    let dir = tempfile::tempdir().expect("a folder");
    write(dir.path(), &small(), &[0, 1]);
    let writer = create(dir.path(), OpenMode::Resume).expect("resume");
    // The depth image cannot be replaced, so frame 1 ends half new, half old.
    let blocked = dir.path().join("sequences/00/depth/000001.png");
    fs::remove_file(&blocked).expect("remove");
    fs::create_dir(&blocked).expect("mkdir");
    let seen = see(&small(), 1);
    writer
        .write_frame(&seen.data(&small()))
        .expect_err("blocked");
    assert_eq!(writer.frames(), [(0, 0)]);
    drop(writer);
    let writer = create(dir.path(), OpenMode::Resume).expect("resume");
    assert_eq!(
        writer.frames(),
        [(0, 0)],
        "dataset.json lists it, but it is gone"
    );
}

#[test]
fn resume_refuses_what_differs_and_says_what() {
    let dir = tempfile::tempdir().expect("a folder");
    killed(dir.path(), &[0]);
    let before = tree(dir.path());
    let refused = |change: &dyn Fn(&mut DatasetHeader)| {
        let mut header = small();
        change(&mut header);
        let e = Writer::create(dir.path(), OpenMode::Resume, header).expect_err("refused");
        assert!(matches!(e, Error::Mismatch { .. }), "{e}");
        e.to_string()
    };
    assert!(refused(&|h| h.seed = 7).contains("seed = 18446744073709551609, asked for 7"));
    assert!(
        refused(&|h| h.backend = "gpu".to_owned()).contains("backend = \"cpu\", asked for \"gpu\"")
    );
    assert!(refused(&|h| h.version = "0.2.0".to_owned()).contains("version = \"0.1.0\""));
    let e = refused(&|h| h.sequences[0].config.to_mut()["placement"]["density"] = 0.2.into());
    assert!(
        e.contains("config.placement.density = 0.1, asked for 0.2"),
        "{e}"
    );
    let e = refused(&|h| h.sequences[0].config.to_mut()["trails"] = true.into());
    assert!(e.contains("config.trails = nothing, asked for true"), "{e}");
    assert!(refused(&|h| h.ontology = Ontology::fuel()).contains("ontology"));
    assert!(
        refused(&|h| h.sequences[0].lidars[0].body_from_lidar.translation_m.z += 1e-12)
            .contains("lidars")
    );
    assert!(refused(&|h| h.sequences[0].stage_keys.clear()).contains("stage_keys.terrain"));
    assert_eq!(tree(dir.path()), before);
    Writer::probe(dir.path(), OpenMode::Resume, &small()).expect("equal headers");
    assert_eq!(tree(dir.path()), before, "a probe changes nothing");
    create(dir.path(), OpenMode::Resume).expect("equal headers go on");
}

#[test]
fn overwrite_takes_only_what_is_its_own() {
    let dir = tempfile::tempdir().expect("a folder");
    for finished in [true, false] {
        let out = dir.path().join(finished.to_string());
        let mut header = small();
        let mut rear = header.sequences[0].cameras[0].clone();
        rear.name = "rear".to_owned();
        header.sequences[0].cameras.push(rear);
        let writer = Writer::create(&out, OpenMode::Fresh, header.clone()).expect("create");
        for k in [0, 1] {
            writer
                .write_frame(&see(&header, k).data(&header))
                .expect("frame");
        }
        if finished {
            finish(writer, 4);
        } else {
            drop(writer);
        }
        let foreign = [
            "notes.txt",
            "sequences/00/semantic/000000_mine.png",
            "sequences/00/notes.md",
            "sequences/mine/000000.png",
        ];
        for name in foreign {
            let path = out.join(name);
            fs::create_dir_all(path.parent().expect("below")).expect("mkdir");
            fs::write(path, "mine").expect("write");
        }
        // The new header has another class table and no second camera.
        drop(Writer::create(&out, OpenMode::Overwrite, small()).expect("overwrite"));
        let left: Vec<_> = tree(&out)
            .into_keys()
            .map(|p| p.to_string_lossy().into_owned())
            .collect();
        let mut expected: Vec<&str> = foreign.into();
        expected.extend([".nemoral/header.json", ".nemoral/lock"]);
        expected.sort_unstable();
        assert_eq!(left, expected);
        let writer = create(&out, OpenMode::Resume).expect("resume");
        assert_eq!(writer.frames(), []);
        writer
            .write_frame(&see(&small(), 2).data(&small()))
            .expect("frame");
        finish(writer, 4);
        assert_eq!(check(&out).expect("check").problems, []);
    }
}

#[test]
fn two_writers_do_not_meet() {
    let dir = tempfile::tempdir().expect("a folder");
    let first = create(dir.path(), OpenMode::Fresh).expect("create");
    for mode in [OpenMode::Resume, OpenMode::Overwrite] {
        let e = create(dir.path(), mode).expect_err("busy");
        assert!(matches!(e, Error::Busy { .. }), "{e}");
    }
    drop(first);
    create(dir.path(), OpenMode::Resume).expect("free again");
}

#[test]
fn shards_merge_into_the_whole() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = |name: &str| dir.path().join(name);
    write(&path("whole"), &small(), &[0, 1, 2, 3]);
    write(&path("a"), &small(), &[0, 2]);
    write(&path("b"), &small(), &[1, 3, 2]);
    let (a, b) = (path("a"), path("b"));
    merge(&[&b, &a], &path("merged"), MergeParams::default()).expect("merge");
    assert!(tree(&path("whole")) == tree(&path("merged")));

    let other = DatasetHeader { seed: 1, ..small() };
    write(&path("other"), &other, &[1]);
    let e = merge(&[&a, &path("other")], &path("no"), PARTIAL).expect_err("seed");
    assert!(e.to_string().contains("seed"), "{e}");
    assert!(
        merge(
            &[&a, &b],
            &a,
            MergeParams {
                mode: OpenMode::Overwrite,
                partial: false
            }
        )
        .is_err()
    );
    assert!(merge(&[], &path("no"), PARTIAL).is_err());
    assert!(!path("no").exists());
    fs::write(b.join("sequences/00/depth/000003.png"), "x").expect("write");
    let e = merge(&[&a, &b], &path("no"), PARTIAL).expect_err("damaged");
    assert!(e.to_string().contains("000003.png"), "{e}");
}
