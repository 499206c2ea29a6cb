//! What holds for every format: equal bytes, resume after any failure, damaged sources, and folders
//! of others.

use std::fs;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nemoral_convert::{ConvertParams, Error, FormatName, Mode, Table, convert};
use nemoral_files::is_temporary_name;
use nemoral_files::observe::observe;

use crate::common::{annotated, header, run, tree, write};

/// A folder in memory if the system has one, because syncing thousands of files is slow.
fn in_memory() -> tempfile::TempDir {
    let memory = tempfile::tempdir_in("/dev/shm");
    memory.or_else(|_| tempfile::tempdir()).expect("a folder")
}

/// Runs `action` with a failure of the `n`-th change at or below `root`; returns whether there was
/// such a change.
fn failing<T>(root: &Path, n: usize, action: impl FnOnce() -> T) -> (T, bool) {
    let count = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&count);
    let observation = observe(root, move |_| {
        // A process that is killed does nothing more either.
        if counted.fetch_add(1, Ordering::SeqCst) >= n {
            Err(io::ErrorKind::StorageFull.into())
        } else {
            Ok(())
        }
    });
    let done = action();
    drop(observation);
    (done, count.load(Ordering::SeqCst) > n)
}

#[test]
fn wherever_a_conversion_stops_nothing_wrong_has_a_name_and_resume_ends_the_same() {
    let dir = in_memory();
    let source = dir.path().join("dataset");
    write(&source, &annotated(), &[0, 1]);
    for format in FormatName::ALL {
        let whole = dir.path().join(format!("whole-{format}"));
        run(&source, &whole, format, Mode::Fresh).expect("converted");
        let whole = tree(&whole);
        let mut stops = 0;
        for n in 0.. {
            let out = dir.path().join("out");
            let (result, reached) = failing(&out, n, || run(&source, &out, format, Mode::Fresh));
            if !reached {
                result.expect("nothing failed");
                fs::remove_dir_all(&out).expect("removed");
                break;
            }
            stops += 1;
            result.expect_err("it stopped");
            let there = if out.exists() {
                tree(&out)
            } else {
                Default::default()
            };
            for (path, bytes) in there {
                let name = path
                    .file_name()
                    .expect("a name")
                    .to_string_lossy()
                    .into_owned();
                assert!(!is_temporary_name(&name), "{}", path.display());
                if !path.starts_with(".nemoral-convert") {
                    assert!(
                        whole[&path] == bytes,
                        "{format}: {} is wrong",
                        path.display()
                    );
                }
            }
            // As a kill does, leave what is not whole behind.
            if out.exists() && n % 7 == 0 {
                fs::write(out.join(".nemoral-x.tmp"), b"half").expect("written");
            }
            let mode = if n % 2 == 0 {
                Mode::Resume
            } else {
                Mode::Overwrite
            };
            run(&source, &out, format, mode).unwrap_or_else(|e| panic!("{format}, stop {n}: {e}"));
            assert!(tree(&out) == whole, "{format}: stop {n}, {mode:?}");
            fs::remove_dir_all(&out).expect("removed");
        }
        println!("{format}: stopped at {stops} places");
        assert!(stops > 20);
    }
}

#[test]
fn a_damaged_source_is_an_error_and_no_file_of_its_frame_is_written() {
    let dir = in_memory();
    for format in FormatName::ALL {
        let source = dir.path().join(format!("dataset-{format}"));
        write(&source, &annotated(), &[0, 1]);
        let whole = dir.path().join(format!("whole-{format}"));
        run(&source, &whole, format, Mode::Fresh).expect("converted");
        let whole = tree(&whole);
        // Every file of the second frame that the format reads is compared with its checksum.
        let mut refused = 0;
        for path in tree(&source)
            .keys()
            .filter(|p| p.to_string_lossy().contains("000001"))
        {
            let path = source.join(path);
            let sound = fs::read(&path).expect("read");
            let mut bytes = sound.clone();
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            fs::write(&path, &bytes).expect("written");
            let out = dir.path().join("out");
            match run(&source, &out, format, Mode::Fresh) {
                Err(e) => {
                    refused += 1;
                    assert!(e.to_string().contains("000001"), "{e}");
                    assert!(!out.join("conversion.json").exists());
                    for (path, bytes) in tree(&out) {
                        let ours = path.starts_with(".nemoral-convert");
                        assert!(ours || whole[&path] == bytes, "{}", path.display());
                    }
                    fs::write(&path, &sound).expect("written");
                    run(&source, &out, format, Mode::Resume).expect("mended");
                }
                // The format does not need the file.
                Ok(_) => fs::write(&path, &sound).expect("written"),
            }
            assert!(tree(&out) == whole, "{format}");
            fs::remove_dir_all(&out).expect("removed");
        }
        assert!(refused > 0, "{format} reads nothing");
    }
}

#[test]
fn folders_of_others_are_refused_and_ours_are_replaced_only_if_asked() {
    let dir = tempfile::tempdir().expect("a folder");
    let source = dir.path().join("dataset");
    write(&source, &header(), &[0]);
    let out = dir.path().join("out");
    fs::create_dir(&out).expect("made");
    fs::write(out.join("thesis.txt"), "mine").expect("written");
    let kitti = |mode| run(&source, &out, FormatName::Kitti, mode);
    for mode in [Mode::Fresh, Mode::Resume, Mode::Overwrite] {
        let e = kitti(mode).expect_err("foreign");
        assert!(
            matches!(&e, Error::Foreign { found, .. } if found == "thesis.txt"),
            "{e}"
        );
        assert!(e.is_request());
    }
    fs::remove_file(out.join("thesis.txt")).expect("removed");
    kitti(Mode::Resume).expect("nothing to go on with is a start");
    let whole = tree(&out);
    let e = kitti(Mode::Fresh).expect_err("there is one");
    assert!(matches!(e, Error::Exists { finished: true, .. }), "{e}");
    let done = kitti(Mode::Resume).expect("done already");
    assert_eq!(done.files + 1, whole.len());
    let e = run(&source, &out, FormatName::Tum, Mode::Resume).expect_err("another format");
    assert!(
        matches!(
            e,
            Error::Mismatch {
                field: "format",
                ..
            }
        ),
        "{e}"
    );
    assert!(tree(&out) == whole, "nothing was touched");
    // What was damaged is made again.
    fs::write(out.join("poses/00.txt"), "1 2 3").expect("written");
    kitti(Mode::Resume).expect("mended");
    assert!(tree(&out) == whole);
    // Another format takes its place; files of others stay.
    fs::write(out.join("sequences/00/notes.txt"), "mine").expect("written");
    run(&source, &out, FormatName::Tum, Mode::Overwrite).expect("replaced");
    let mut left = tree(&out);
    assert_eq!(
        left.remove(Path::new("sequences/00/notes.txt")),
        Some(b"mine".to_vec())
    );
    let fresh = dir.path().join("fresh");
    run(&source, &fresh, FormatName::Tum, Mode::Fresh).expect("converted");
    assert!(left == tree(&fresh));
    // Another data set is not mixed in.
    let other = dir.path().join("other");
    write(&other, &header(), &[0, 1]);
    let e = run(&other, &out, FormatName::Tum, Mode::Resume).expect_err("another source");
    assert!(
        matches!(
            e,
            Error::Mismatch {
                field: "source",
                ..
            }
        ),
        "{e}"
    );
    for inside in [source.clone(), source.join("tum")] {
        let e = run(&source, &inside, FormatName::Tum, Mode::Overwrite).expect_err("inside");
        assert!(matches!(e, Error::Inside { .. }), "{e}");
    }
}

#[test]
fn a_table_that_does_not_fit_is_refused_before_anything_is_written() {
    let dir = tempfile::tempdir().expect("a folder");
    let source = dir.path().join("dataset");
    write(&source, &header(), &[0]);
    let text = "name = \"x\"\nsource = \"s\"\n[[class]]\nid = 1\nname = \"tree\"\n\
                colour = [0, 0, 0]\nfrom = [\"Trunks\", \"Canopy\"]\n";
    let params = ConvertParams {
        ontology: Some(Table::parse("x", text).expect("valid")),
        ..ConvertParams::new(FormatName::Kitti)
    };
    let out = dir.path().join("out");
    let e = convert(&source, &out, &params).expect_err("lacks classes");
    assert!(e.to_string().contains("Terrain, Traversable"), "{e}");
    assert!(e.is_request() && !out.exists());
    // Nor is one taken that the format would not use.
    for format in FormatName::ALL.into_iter().filter(|f| !f.takes_ontology()) {
        let params = ConvertParams {
            ontology: Some(Table::load("rellis").expect("built in")),
            ..ConvertParams::new(format)
        };
        let e = convert(&source, &out, &params).expect_err("no place for classes");
        assert!(
            matches!(e, Error::Unsuitable { .. }) && !out.exists(),
            "{e}"
        );
    }
}

#[test]
fn a_data_set_that_lacks_what_a_format_needs_is_refused_before_anything_is_written() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("out");
    let blind = dir.path().join("blind");
    let mut without = annotated();
    without.sequences[0].cameras.clear();
    write(&blind, &without, &[0]);
    let deaf = dir.path().join("deaf");
    let mut without = annotated();
    without.sequences[0].lidars.clear();
    write(&deaf, &without, &[0]);
    let mut refused = Vec::new();
    for format in FormatName::ALL {
        for source in [&blind, &deaf] {
            match run(source, &out, format, Mode::Fresh) {
                Ok(_) => fs::remove_dir_all(&out).expect("removed"),
                Err(e) => {
                    assert!(
                        matches!(e, Error::Unsuitable { .. }) && !out.exists(),
                        "{e}"
                    );
                    refused.push(format.name());
                }
            }
        }
    }
    assert_eq!(
        refused,
        [
            "kitti2015",
            "kitti2015",
            "euroc",
            "coco",
            "laz",
            "colmap",
            "nerfstudio",
            "yolo",
            "hf",
            "nuscenes",
            "exr",
            "npy"
        ]
    );
}
