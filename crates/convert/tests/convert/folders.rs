//! What holds for every format: equal bytes, resume after any failure, damaged sources, and folders
//! of others.

use std::fs;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nemoral_convert::{
    ClassMapping, ConvertParams, Error, FormatName, OutputMode, check_folder, convert,
};
use nemoral_dataset::FileRecord;
use nemoral_files::observe::observe;
use nemoral_files::{InnerPath, is_temporary_name};

use crate::common::{Drive, annotated, header, run, tree, write, write_drives};

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
        run(&source, &whole, format, OutputMode::Fresh).expect("converted");
        let whole = tree(&whole);
        let mut stops = 0;
        for n in 0.. {
            let out = dir.path().join("out");
            let (result, reached) =
                failing(&out, n, || run(&source, &out, format, OutputMode::Fresh));
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
                OutputMode::Resume
            } else {
                OutputMode::Overwrite
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
        run(&source, &whole, format, OutputMode::Fresh).expect("converted");
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
            match run(&source, &out, format, OutputMode::Fresh) {
                Err(e) => {
                    refused += 1;
                    assert!(e.to_string().contains("000001"), "{e}");
                    assert!(!out.join("conversion.json").exists());
                    for (path, bytes) in tree(&out) {
                        let ours = path.starts_with(".nemoral-convert");
                        assert!(ours || whole[&path] == bytes, "{}", path.display());
                    }
                    fs::write(&path, &sound).expect("written");
                    run(&source, &out, format, OutputMode::Resume).expect("mended");
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
    for mode in [OutputMode::Fresh, OutputMode::Resume, OutputMode::Overwrite] {
        let e = kitti(mode).expect_err("foreign");
        assert!(
            matches!(&e, Error::Foreign { found, .. } if found == "thesis.txt"),
            "{e}"
        );
        assert!(e.is_request());
    }
    fs::remove_file(out.join("thesis.txt")).expect("removed");
    kitti(OutputMode::Resume).expect("nothing to go on with is a start");
    let whole = tree(&out);
    let e = kitti(OutputMode::Fresh).expect_err("there is one");
    assert!(matches!(e, Error::Exists { finished: true, .. }), "{e}");
    let done = kitti(OutputMode::Resume).expect("done already");
    assert_eq!(done.files + 1, whole.len());
    let e = run(&source, &out, FormatName::Tum, OutputMode::Resume).expect_err("another format");
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
    kitti(OutputMode::Resume).expect("mended");
    assert!(tree(&out) == whole);
    // Another format takes its place; files of others stay.
    fs::write(out.join("sequences/00/notes.txt"), "mine").expect("written");
    run(&source, &out, FormatName::Tum, OutputMode::Overwrite).expect("replaced");
    let mut left = tree(&out);
    assert_eq!(
        left.remove(Path::new("sequences/00/notes.txt")),
        Some(b"mine".to_vec())
    );
    let fresh = dir.path().join("fresh");
    run(&source, &fresh, FormatName::Tum, OutputMode::Fresh).expect("converted");
    assert!(left == tree(&fresh));
    // Another data set is not mixed in.
    let other = dir.path().join("other");
    write(&other, &header(), &[0, 1]);
    let e = run(&other, &out, FormatName::Tum, OutputMode::Resume).expect_err("another source");
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
    for inside in ["", "tum", "export/tum", "new/../tum", "a*b"] {
        let inside = source.join(inside);
        let e = run(&source, &inside, FormatName::Tum, OutputMode::Overwrite).expect_err("inside");
        assert!(matches!(e, Error::Inside { .. }), "{e}");
    }
    assert!(!source.join("export").exists());
}

/// Lists a further file in a finished conversion. Anybody can make the list's checksum.
fn list(out: &Path, file: FileRecord) {
    let path = out.join("conversion.json");
    let text = fs::read_to_string(&path).expect("read");
    let whole: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let mut content = whole["content"].clone();
    let files = content["files"].as_array_mut().expect("a list");
    files.push(serde_json::to_value(file).expect("plain"));
    files.sort_by(|a, b| a["path"].as_str().cmp(&b["path"].as_str()));
    let content = content.to_string();
    let digest = blake3::hash(content.as_bytes()).to_hex();
    let sealed = format!("{{\"blake3\":\"{digest}\",\"content\":{content}}}\n");
    fs::write(path, sealed).expect("written");
}

#[test]
fn a_file_that_was_changed_or_is_somebody_elses_is_neither_removed_nor_replaced() {
    let dir = tempfile::tempdir().expect("a folder");
    let source = dir.path().join("dataset");
    write(&source, &header(), &[0]);
    let out = dir.path().join("out");
    let refused = |file: &str, format, mode| {
        let before = tree(&out);
        let e = run(&source, &out, format, mode).expect_err("somebody else's");
        assert!(
            matches!(&e, Error::Changed { path } if *path == out.join(file)),
            "{e}"
        );
        assert!(e.is_request());
        let after = tree(&out);
        (before == after, after)
    };
    run(&source, &out, FormatName::Kitti, OutputMode::Fresh).expect("converted");
    let whole = tree(&out);
    fs::write(out.join("poses/00.txt"), "1 2 3").expect("written");
    for format in [FormatName::Kitti, FormatName::Tum] {
        let (untouched, _) = refused("poses/00.txt", format, OutputMode::Overwrite);
        assert!(untouched, "{format}");
    }
    // A file without content is nobody's loss: a power cut leaves such files.
    fs::write(out.join("poses/00.txt"), "").expect("written");
    run(&source, &out, FormatName::Kitti, OutputMode::Overwrite).expect("replaced");
    assert!(tree(&out) == whole);

    // Whoever made the list knows what is in files that are the same everywhere.
    let head = b"ref: refs/heads/main\n";
    fs::create_dir(out.join(".git")).expect("made");
    for (file, mine, theirs) in [
        (".git/HEAD", &head[..], &head[..]),
        ("notes.txt", &b"mine"[..], &b"?"[..]),
    ] {
        fs::write(out.join(file), mine).expect("written");
        let path = InnerPath::new(file).expect("an inner path");
        list(&out, FileRecord::of(path, theirs));
        let (untouched, _) = refused(file, FormatName::Tum, OutputMode::Overwrite);
        assert!(untouched, "{file}");
        // The conversion itself is made again, and the file stays.
        run(&source, &out, FormatName::Kitti, OutputMode::Resume).expect("made again");
        let mut left = tree(&out);
        assert_eq!(left.remove(Path::new(file)).as_deref(), Some(mine));
        assert!(left == whole, "{file}");
        fs::remove_file(out.join(file)).expect("removed");
    }

    // Nor is a file replaced that stands where another format would write.
    run(&source, &out, FormatName::Tum, OutputMode::Overwrite).expect("replaced");
    fs::create_dir(out.join("poses")).expect("made");
    fs::write(out.join("poses/00.txt"), "mine").expect("written");
    for mode in [OutputMode::Overwrite, OutputMode::Resume] {
        let (_, left) = refused("poses/00.txt", FormatName::Kitti, mode);
        assert_eq!(left[Path::new("poses/00.txt")], b"mine");
    }
    fs::remove_file(out.join("poses/00.txt")).expect("removed");
    run(&source, &out, FormatName::Kitti, OutputMode::Resume).expect("goes on");
    assert!(tree(&out) == whole);

    // A list that is another program's is not removed either.
    let half = dir.path().join("half");
    let convert = |mode| run(&source, &half, FormatName::Kitti, mode);
    let (result, _) = failing(&half, 20, || convert(OutputMode::Fresh));
    result.expect_err("it stopped");
    fs::write(half.join("conversion.json"), "{}").expect("written");
    for mode in [OutputMode::Fresh, OutputMode::Resume, OutputMode::Overwrite] {
        let e = convert(mode).expect_err("another program's");
        assert!(matches!(e, Error::Damaged { .. }), "{e}");
    }
    let left = fs::read_to_string(half.join("conversion.json"));
    assert_eq!(left.expect("read"), "{}");
}

#[test]
fn a_growing_data_set_renews_its_own_conversions_alone() {
    let dir = tempfile::tempdir().expect("a folder");
    let source = dir.path().join("dataset");
    let out = dir.path().join("out");
    let mut one_drive = header();
    let mut two_drives = header();
    let mut second = two_drives.sequences[0].clone();
    second.number = 1;
    two_drives.sequences.push(second);
    let renew = |source: &Path, out: &Path| run(source, out, FormatName::Kitti, OutputMode::Renew);
    write(&source, &one_drive, &[0]);
    renew(&source, &out).expect("nothing to go on with is a start");
    let first = tree(&out);
    // What was damaged is made again.
    fs::write(out.join("poses/00.txt"), "1 2 3").expect("written");
    renew(&source, &out).expect("mended");
    assert!(tree(&out) == first);
    // The same data set gets a frame, and a sequence.
    let grown = dir.path().join("grown");
    write(&grown, &one_drive, &[0, 1]);
    let larger = dir.path().join("larger");
    let drives = [Drive::of(0, &[0, 1]), Drive::of(1, &[2])];
    write_drives(&larger, &two_drives, &drives);
    for state in [&grown, &larger] {
        let kept = dir.path().join("kept");
        renew(&source, &kept).expect("converted");
        renew(state, &kept).expect("renewed");
        fs::remove_dir_all(&kept).expect("removed");
        renew(state, &out).expect("renewed");
        let fresh = dir.path().join("fresh");
        run(state, &fresh, FormatName::Kitti, OutputMode::Fresh).expect("converted");
        assert!(tree(&out) == tree(&fresh));
        fs::remove_dir_all(&fresh).expect("removed");
    }
    // Another data set, another format and other classes are none of its states.
    let renewed = tree(&out);
    one_drive.seed += 1;
    let other = dir.path().join("other");
    write(&other, &one_drive, &[0, 1, 2]);
    let table = ClassMapping::load("rellis").expect("built in");
    for (source, format, ontology, differs) in [
        (&other, FormatName::Kitti, None, "data set"),
        (&grown, FormatName::Tum, None, "format"),
        (&grown, FormatName::Kitti, Some(table), "ontology"),
    ] {
        let params = ConvertParams {
            ontology,
            mode: OutputMode::Renew,
            ..ConvertParams::new(format)
        };
        let e = convert(source, &out, &params).expect_err(differs);
        assert!(
            matches!(e, Error::Mismatch { field, .. } if field == differs),
            "{e}"
        );
        let is_other = *source == other;
        let of_state = if is_other { &one_drive } else { &two_drives };
        let e = check_folder(source, &out, of_state, &params).expect_err(differs);
        assert!(
            matches!(e, Error::Mismatch { field, .. } if field == differs),
            "{e}"
        );
        assert!(tree(&out) == renewed, "nothing was touched");
    }
    let params = ConvertParams {
        mode: OutputMode::Renew,
        ..ConvertParams::new(FormatName::Kitti)
    };
    check_folder(&larger, &out, &two_drives, &params).expect("it may be renewed");
    // Nothing of the user's is lost for it.
    fs::write(out.join("poses/00.txt"), "mine").expect("written");
    let e = renew(&grown, &out).expect_err("changed");
    assert!(matches!(e, Error::Changed { .. }), "{e}");
    let overwrite = ConvertParams {
        mode: OutputMode::Overwrite,
        ..params
    };
    let e = check_folder(&larger, &out, &two_drives, &overwrite).expect_err("changed");
    assert!(matches!(e, Error::Changed { .. }), "{e}");
}

#[cfg(unix)]
#[test]
fn names_that_are_none_are_left_where_they_are() {
    let dir = in_memory();
    let source = dir.path().join("dataset");
    write(&source, &header(), &[0, 1]);
    let whole = dir.path().join("whole");
    run(&source, &whole, FormatName::Kitti, OutputMode::Fresh).expect("converted");
    let whole = tree(&whole);
    let odd = [
        ".nemoral-a:b.tmp",
        ".nemoral-convert/.nemoral-a:b.tmp",
        ".nemoral-convert/steps/a:b.json",
        "sequences/00/.nemoral-a:b.tmp",
    ];
    for mode in [OutputMode::Resume, OutputMode::Overwrite] {
        let out = dir.path().join(format!("out-{mode:?}"));
        let kitti = |mode| run(&source, &out, FormatName::Kitti, mode);
        let (result, _) = failing(&out, 20, || kitti(OutputMode::Fresh));
        result.expect_err("it stopped");
        fs::create_dir_all(out.join("sequences/00")).expect("made");
        for file in odd {
            fs::write(out.join(file), "mine").expect("written");
        }
        // A folder with the name of a record is none, either.
        fs::create_dir(out.join(".nemoral-convert/steps/c.json")).expect("made");
        kitti(mode).expect("converted");
        // It is finished for all that.
        kitti(OutputMode::Resume).expect("finished");
        let mut left = tree(&out);
        for file in odd {
            let odd = left.remove(Path::new(file));
            assert_eq!(odd, Some(b"mine".to_vec()), "{file}");
        }
        assert!(left == whole, "{mode:?}");
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
        ontology: Some(ClassMapping::parse("x", text).expect("valid")),
        ..ConvertParams::new(FormatName::Kitti)
    };
    let out = dir.path().join("out");
    let e = convert(&source, &out, &params).expect_err("lacks classes");
    assert!(e.to_string().contains("Terrain, Traversable"), "{e}");
    assert!(e.is_request() && !out.exists());
    // Nor is one taken that the format would not use.
    for format in FormatName::ALL.into_iter().filter(|f| !f.takes_ontology()) {
        let params = ConvertParams {
            ontology: Some(ClassMapping::load("rellis").expect("built in")),
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
fn a_least_number_of_pixels_is_refused_where_no_objects_are_listed() {
    let dir = tempfile::tempdir().expect("a folder");
    let source = dir.path().join("dataset");
    write(&source, &annotated(), &[0, 1]);
    let out = dir.path().join("out");
    let mut refused = 0;
    for format in FormatName::ALL {
        let params = ConvertParams {
            min_px: 20,
            ..ConvertParams::new(format)
        };
        match convert(&source, &out, &params) {
            Ok(_) => {
                assert!(format.takes_min_px(), "{format}");
                fs::remove_dir_all(&out).expect("removed");
            }
            Err(e) => {
                let said = format!("{format}: min_px = 20: must be 0");
                assert!(e.to_string().starts_with(&said), "{e}");
                assert!(e.is_request() && !out.exists());
                refused += 1;
            }
        }
    }
    assert_eq!(refused, FormatName::ALL.len() - 2);
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
            match run(source, &out, format, OutputMode::Fresh) {
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
