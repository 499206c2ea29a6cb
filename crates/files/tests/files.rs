//! What the crate promises of reads, writes and names.

#![allow(
    clippy::disallowed_methods,
    reason = "tests look behind the crate's back"
)]

use std::fs;
use std::io::{self, Read, Write};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use nemoral_files::observe::{Operation, observe};
use nemoral_files::*;
use proptest::prelude::*;

fn name(text: &str) -> InnerPath {
    InnerPath::new(text).expect("an inner path")
}

fn names(folder: &Folder) -> Vec<String> {
    let entries = folder.entries().expect("a folder");
    entries.into_iter().map(|e| e.name).collect()
}

#[test]
fn names_that_leave_the_folder_are_none() {
    let refused = [
        "",
        "/",
        "/etc/passwd",
        "..",
        "../x",
        "a/../b",
        "a/..",
        ".",
        "./a",
        "a//b",
        "a/",
        "C:/x",
        "C:x",
        "\\\\host\\share",
        "a\\..\\b",
        "a\0b",
        "a\nb",
        "nul",
        "NUL.png",
        "com1",
        "lpt9.txt",
        "a.",
        "a ",
        "a/con/b",
        "a*b",
        "a?b",
    ];
    for text in refused {
        let e = InnerPath::new(text).expect_err(text);
        assert!(!e.to_string().is_empty());
    }
    for long in ["x".repeat(256), "x/".repeat(600) + "x"] {
        let e = InnerPath::new(long).expect_err("too long").to_string();
        assert!(e.len() < 300, "{e}");
    }
    for text in [
        "a",
        "sequences/00/image_2/000000.png",
        ".nemoral/lock",
        "com10",
        "wäldchen/ö.csv",
    ] {
        let path = name(text);
        assert_eq!(path.as_str(), text);
        assert_eq!(serde_json::to_value(&path).expect("JSON"), text);
    }
    assert!(serde_json::from_str::<InnerPath>("\"../x\"").is_err());
    assert_eq!(name("a/b/c").parent(), Some(name("a/b")));
    assert_eq!(name("a/b/c").file_name(), "c");
    assert!(name("a").join("../b").is_err());
}

proptest! {
    #[test]
    fn whatever_is_taken_lies_below(text in "[a-c./\\\\: ]{0,12}|\\PC{0,20}") {
        if let Ok(path) = InnerPath::new(text) {
            let below = path.below(Path::new("/root/of"));
            prop_assert!(below.starts_with("/root/of"));
            prop_assert!(below.components().all(|c| c != std::path::Component::ParentDir));
            prop_assert_eq!(below.components().count(), 3 + path.components().count());
        }
    }
}

proptest! {
    #[test]
    fn without_links_a_path_lies_where_its_names_say(
        names in prop::collection::vec(
            prop::sample::select(vec!["there", "new", "a*b", ".", ".."]),
            0..6,
        ),
    ) {
        let dir = tempfile::tempdir().expect("a folder");
        let root = fs::canonicalize(dir.path()).expect("a folder").join("root");
        fs::create_dir_all(root.join("there")).expect("made");
        let (mut path, mut expected) = (root.clone(), root.clone());
        for name in names {
            path.push(name);
            match name {
                "." => {}
                ".." => {
                    expected.pop();
                }
                name => expected.push(name),
            }
        }
        let folder = Folder::new(&root);
        prop_assert_eq!(folder.contains(&path), expected.starts_with(&root), "{:?}", path);
        if let Some(inner) = folder.inner_path_of(&path) {
            prop_assert_eq!(inner.below(&root), expected);
        }
    }
}

#[test]
fn a_path_lies_in_a_folder_whatever_exists_of_it() {
    let dir = tempfile::tempdir().expect("a folder");
    let root = dir.path().join("root");
    let folder = Folder::new(&root);
    let lies = || {
        let inside = ["", "new", "new/er/x", "a*b", "new/../x", "../root/x"];
        assert!(inside.iter().all(|path| folder.contains(&root.join(path))));
        let outside = ["..", "../roots", "../root-coco", "../x/root", "new/../../x"];
        assert!(!outside.iter().any(|path| folder.contains(&root.join(path))));
        assert!(folder.contains(Path::new(&format!("{}/", root.display()))));
        // No name stands for the working folder.
        assert!(!folder.contains(Path::new("")));
        let inner = |path: &str| folder.inner_path_of(&root.join(path));
        assert_eq!(inner("new/er/../x"), Some(name("new/x")));
        assert_eq!(inner("../x"), None);
        assert_eq!(inner("a*b"), None);
    };
    lies();
    fs::create_dir(&root).expect("made");
    lies();
    assert!(Folder::new(Path::new(".")).contains(Path::new("new/x")));
}

#[cfg(unix)]
#[test]
fn a_link_lies_where_its_name_is_and_where_it_leads() {
    use std::os::unix::fs::symlink;
    let dir = tempfile::tempdir().expect("a folder");
    let (root, elsewhere) = (dir.path().join("root"), dir.path().join("elsewhere"));
    fs::create_dir(&root).expect("made");
    fs::create_dir(&elsewhere).expect("made");
    symlink(&root, dir.path().join("in")).expect("linked");
    symlink(&elsewhere, root.join("out")).expect("linked");
    let folder = Folder::new(&root);
    for path in ["in", "in/new/x", "new/../in/x", "root/out"] {
        assert!(folder.contains(&dir.path().join(path)), "{path}");
    }
    assert!(!folder.contains(&root.join("out/x")));
    // The name is that of a file, which replaces a link.
    assert_eq!(folder.inner_path_of(&root.join("out")), Some(name("out")));
    assert!(Folder::new(&dir.path().join("in")).contains(&root.join("x")));
}

#[test]
fn large_files_are_read_piece_by_piece() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = Folder::new(dir.path());
    folder.put(&name("a/ten"), b"0123456789").expect("written");
    let open = |path: &str, limit| folder.open(&name(path), limit);
    let mut file = open("a/ten", 10).expect("fits");
    let mut piece = [0; 4];
    file.read_exact(&mut piece).expect("read");
    assert_eq!(&piece, b"0123");
    // What is added after a file was opened is not read.
    let path = dir.path().join("a/ten");
    let grown = fs::File::options().append(true).open(path);
    let written = grown.expect("opened").write_all(b"abc");
    written.expect("written");
    let mut rest = Vec::new();
    file.read_to_end(&mut rest).expect("read");
    assert_eq!(rest, b"456789");
    let large = open("a/ten", 12);
    assert!(matches!(large, Err(Error::TooLarge { limit: 12, .. })));
    assert!(matches!(open("a", 12), Err(Error::NotRegular { .. })));
    assert!(open("b", 12).expect_err("none").is_not_found());
}

#[test]
fn reads_are_bounded_and_of_regular_files() {
    let dir = tempfile::tempdir().expect("a folder");
    let file = dir.path().join("ten");
    fs::write(&file, "0123456789").expect("written");
    assert_eq!(read(&file, 10).expect("fits"), b"0123456789");
    assert!(matches!(
        read(&file, 9),
        Err(Error::TooLarge { limit: 9, .. })
    ));
    assert!(matches!(
        read(dir.path(), 9),
        Err(Error::NotRegular {
            found: "a folder",
            ..
        })
    ));
    assert!(
        read(&dir.path().join("none"), 9)
            .expect_err("none")
            .is_not_found()
    );
    fs::write(&file, [b'a', 0xff]).expect("written");
    assert!(matches!(
        read_text(&file, 9),
        Err(Error::NotText { position: 1, .. })
    ));
    #[cfg(unix)]
    for (device, found) in [("/dev/zero", "a device"), ("/dev/null", "a device")] {
        let e = read(Path::new(device), 9)
            .expect_err("a device")
            .to_string();
        assert!(e.contains(found), "{e}");
    }
}

#[cfg(unix)]
#[test]
fn no_link_is_followed_below_the_root_and_any_on_the_way_to_it() {
    use std::os::unix::fs::symlink;
    let dir = tempfile::tempdir().expect("a folder");
    let outside = dir.path().join("outside");
    fs::create_dir(&outside).expect("made");
    fs::write(outside.join("file"), "theirs").expect("written");
    let real = dir.path().join("real");
    fs::create_dir(&real).expect("made");
    symlink(&real, dir.path().join("root")).expect("linked");
    let folder = Folder::new(&dir.path().join("root"));
    folder
        .put(&name("mine"), b"mine")
        .expect("the root may be a link");

    symlink(&outside, real.join("linked")).expect("linked");
    symlink(outside.join("file"), real.join("file")).expect("linked");
    for path in ["linked/file", "linked/new", "file"] {
        let path = name(path);
        let link = |e: Error| assert!(matches!(e, Error::Link { .. }), "{e}");
        link(folder.read(&path, 99).expect_err("a link"));
        link(folder.put(&path, b"ours").expect_err("a link"));
        link(folder.remove_file(&path).expect_err("a link"));
        link(folder.sync_file(&path).expect_err("a link"));
        link(folder.lock(&path).expect_err("a link"));
        link(folder.kind(&path).expect_err("a link"));
    }
    assert!(folder.create_folders(&name("linked/new/er")).is_err());
    assert!(folder.entries_of(&name("linked")).is_err());
    assert!(folder.remove_empty_folder(&name("linked")).is_err());
    assert_eq!(fs::read(outside.join("file")).expect("there"), b"theirs");
    assert_eq!(fs::read_dir(&outside).expect("a folder").count(), 1);
    let kinds: Vec<EntryKind> = (folder.entries().expect("a folder"))
        .iter()
        .map(|e| e.kind)
        .collect();
    assert_eq!(kinds, [EntryKind::Other, EntryKind::Other, EntryKind::File]);
}

#[test]
fn files_appear_whole_or_not_at_all_whatever_fails() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = Folder::new(dir.path());
    let file = name("a/b");
    folder.put(&file, b"old").expect("written");
    for failing in ["write", "rename"] {
        let observation = observe(dir.path(), move |operation| match operation {
            Operation::Write { .. } if failing == "write" => Err(io::ErrorKind::StorageFull.into()),
            Operation::Rename { .. } if failing == "rename" => {
                Err(io::ErrorKind::StorageFull.into())
            }
            _ => Ok(()),
        });
        let e = folder
            .put(&file, b"new")
            .expect_err("it failed")
            .to_string();
        assert!(e.contains("b: ") && !e.contains(".nemoral-"), "{e}");
        drop(observation);
        assert_eq!(folder.read(&file, 9).expect("there"), b"old");
        assert_eq!(
            folder.entries_of(&name("a")).expect("a folder").len(),
            1,
            "{failing}"
        );
    }
    folder.put(&file, b"new").expect("written");
    assert_eq!(folder.read(&file, 9).expect("there"), b"new");
}

#[test]
fn a_user_named_file_replaces_only_a_regular_file() {
    let dir = tempfile::tempdir().expect("a folder");
    let target = dir.path().join("cloud.ply");
    let mut pending = PendingFile::create(&target).expect("begun");
    pending.write_all(b"half").expect("written");
    drop(pending);
    assert!(
        names(&Folder::new(dir.path())).is_empty(),
        "given up, and gone"
    );
    write(&target, b"whole").expect("written");
    assert_eq!(fs::read(&target).expect("there"), b"whole");
    assert!(matches!(
        write(dir.path(), b"x"),
        Err(Error::NotRegular {
            found: "a folder",
            ..
        })
    ));
    #[cfg(unix)]
    assert!(matches!(
        write(Path::new("/dev/null"), b"x"),
        Err(Error::NotRegular {
            found: "a device",
            ..
        })
    ));
    let e = write(&dir.path().join("none/x"), b"x")
        .expect_err("no folder")
        .to_string();
    assert!(e.contains("none/x: ") && !e.contains(".nemoral-"), "{e}");
}

#[test]
fn a_lock_is_one_process_s_and_folders_go_only_when_empty() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = Folder::new(&dir.path().join("new/er"));
    let lock = folder.lock(&name("state/lock")).expect("free");
    assert!(matches!(
        folder.lock(&name("state/lock")),
        Err(Error::Locked { .. })
    ));
    drop(lock);
    folder.lock(&name("state/lock")).expect("free again");
    assert!(!folder.remove_empty_folder(&name("state")).expect("asked"));
    folder.remove_file(&name("state/lock")).expect("removed");
    folder
        .remove_file(&name("state/lock"))
        .expect("removed already");
    assert!(folder.remove_empty_folder(&name("state")).expect("asked"));
    assert!(folder.remove_file(&name("none/at/all")).is_ok());
    folder.put(&name("file"), b"x").expect("written");
    assert!(folder.put(&name("file/below"), b"x").is_err());
    assert!(folder.remove_file(&name("file/below")).is_err());
}

#[test]
fn a_syncer_syncs_files_before_their_folders_and_says_what_failed() {
    let dir = tempfile::tempdir().expect("a folder");
    let folder = Folder::new(dir.path());
    let log = Arc::new(Mutex::new(Vec::new()));
    let synced = Arc::clone(&log);
    let root = dir.path().to_owned();
    let observation = observe(dir.path(), move |operation| {
        if let Operation::SyncFile(path) | Operation::SyncFolder(path) = operation {
            let inner = path.strip_prefix(&root).expect("below").to_owned();
            synced.lock().expect("whole").push(inner);
        }
        Ok(())
    });
    let syncer = Syncer::start(folder.clone()).expect("a thread");
    for file in ["a/b/1", "a/b/2", "c"] {
        folder.put(&name(file), b"x").expect("written");
        syncer.push(name(file));
    }
    syncer.finish().expect("synced");
    drop(observation);
    let log = log.lock().expect("whole");
    let log: Vec<_> = log.iter().map(|p| p.to_str().expect("ASCII")).collect();
    assert_eq!(log, ["a/b/1", "a/b/2", "c", "a/b", "a", ""]);

    let syncer = Syncer::start(folder).expect("a thread");
    syncer.push(name("gone"));
    assert!(syncer.finish().expect_err("gone").is_not_found());
}

#[test]
fn observers_hear_only_of_their_own_root() {
    let (one, other) = (
        tempfile::tempdir().expect("a folder"),
        tempfile::tempdir().expect("one"),
    );
    let count = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&count);
    let _observation = observe(one.path(), move |_| {
        counted.fetch_add(1, Ordering::Relaxed);
        Ok(())
    });
    Folder::new(other.path())
        .put(&name("x"), b"x")
        .expect("written");
    assert_eq!(count.load(Ordering::Relaxed), 0);
    Folder::new(one.path())
        .put(&name("x"), b"x")
        .expect("written");
    assert_eq!(count.load(Ordering::Relaxed), 2);
}
