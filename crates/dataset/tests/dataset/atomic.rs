//! A file appears under its final name only when it is whole.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use nemoral_dataset::{Error, OpenMode, Writer, write_png};

use crate::common::{header, see, small, tree};

fn names(root: &Path) -> Vec<String> {
    let paths = tree(root).into_keys();
    paths.map(|p| p.to_string_lossy().into_owned()).collect()
}

#[test]
fn a_file_that_cannot_appear_leaves_nothing() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = small();
    let writer = Writer::create(dir.path(), OpenMode::Fresh, header.clone()).expect("create");
    // The final name of the scan is taken by a folder: the rename must fail.
    let blocked = dir.path().join("sequences/00/velodyne/000000.bin");
    fs::create_dir_all(&blocked).expect("mkdir");
    let e = writer
        .write_frame(&see(&header, 0).data(&header))
        .expect_err("blocked");
    assert!(e.to_string().contains("velodyne/000000.bin"), "{e}");
    assert!(names(dir.path()).iter().all(|n| !n.ends_with(".tmp")));
    assert_eq!(writer.frames(), []);
    assert!(!writer.has_frame(0, 0, &see(&header, 0).key));
    fs::remove_dir(&blocked).expect("rmdir");
    writer
        .write_frame(&see(&header, 0).data(&header))
        .expect("frame");
    assert!(writer.has_frame(0, 0, &see(&header, 0).key));
}

#[test]
fn a_picture_alone() {
    let dir = tempfile::tempdir().expect("a folder");
    let (path, rgb) = (dir.path().join("preview.png"), &see(&small(), 0).rgb[0]);
    write_png(&path, rgb).expect("written");
    let back = image::open(&path).expect("an image").into_rgb8();
    assert_eq!(back.into_raw(), rgb.pixels().as_flattened());
    assert!(
        write_png(dir.path(), rgb).is_err(),
        "a folder is in the way"
    );
}

#[cfg(unix)]
#[test]
fn files_are_for_others_to_read_as_the_umask_says() {
    use std::os::unix::fs::PermissionsExt;
    let dir = tempfile::tempdir().expect("a folder");
    crate::common::write(dir.path(), &small(), &[0]);
    let plain = dir.path().join("plain");
    fs::write(&plain, "").expect("write");
    let mode = |path: &Path| fs::metadata(path).expect("a file").permissions().mode();
    for name in ["dataset.json", "sequences/00/semantic/000000.png"] {
        assert_eq!(mode(&dir.path().join(name)), mode(&plain), "{name}");
    }
}

/// A tiny file system, unmounted when dropped.
struct Tmpfs(PathBuf);

impl Tmpfs {
    fn mount(at: &Path, bytes: usize) -> Result<Self, String> {
        let options = format!("size={bytes}");
        let run = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &options, "nemoral-test"])
            .arg(at)
            .output()
            .map_err(|e| e.to_string())?;
        if run.status.success() {
            Ok(Self(at.to_owned()))
        } else {
            Err(String::from_utf8_lossy(&run.stderr).trim().to_owned())
        }
    }
}

impl Drop for Tmpfs {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

#[test]
fn a_full_disk_is_an_error_with_a_name_and_nothing_half_written() {
    let dir = tempfile::tempdir().expect("a folder");
    let disk = match Tmpfs::mount(dir.path(), 4_000_000) {
        Ok(disk) => disk,
        Err(reason) => {
            println!("SKIPPED a_full_disk…: no small file system could be mounted: {reason}");
            return;
        }
    };
    let header = header();
    let writer = Writer::create(dir.path(), OpenMode::Fresh, header.clone()).expect("create");
    let mut whole = Vec::new();
    let error = (0..9).find_map(|k| {
        let written = writer.write_frame(&see(&header, k).data(&header));
        written.map(|record| whole.push(record)).err()
    });
    let error = error.expect("4 MB do not hold nine frames");
    println!("{} whole frames, then: {error}", whole.len());
    assert!(!whole.is_empty());
    match &error {
        Error::Io { path, source } => {
            assert_eq!(source.kind(), std::io::ErrorKind::StorageFull);
            assert!(path.starts_with(dir.path()) && !path.exists(), "{error}");
        }
        other => panic!("{other}"),
    }
    let files = tree(dir.path());
    assert!(files.keys().all(|p| !p.to_string_lossy().ends_with(".tmp")));
    // Every file is whole, those of the failed frame too, as a comparison with another disk shows.
    let other = tempfile::tempdir().expect("a folder");
    let twin = Writer::create(other.path(), OpenMode::Fresh, header.clone()).expect("create");
    for k in 0..=whole.len() {
        twin.write_frame(&see(&header, k).data(&header))
            .expect("frame");
    }
    let twin_files = tree(other.path());
    let of_frames = |p: &Path| p.starts_with("sequences");
    for (path, bytes) in files.iter().filter(|(p, _)| of_frames(p)) {
        assert!(twin_files[path] == *bytes, "{}", path.display());
    }
    // When there is room again, the run can be resumed.
    drop(writer);
    let scan = whole[0]
        .files
        .iter()
        .find(|f| f.path.file_name().ends_with(".ply"))
        .expect("a scan");
    fs::remove_file(dir.path().join(&scan.path)).expect("remove");
    let writer = Writer::create(dir.path(), OpenMode::Resume, header.clone()).expect("resume");
    assert_eq!(writer.frames().len(), whole.len());
    assert!(!writer.has_frame(0, 0, &see(&header, 0).key));
    drop(writer);
    drop(disk);
}
