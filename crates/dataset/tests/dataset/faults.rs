//! Failing disks and power cuts, at every operation in turn.
//!
//! The module behind all writes announces its operations, so that tests can make each of them fail
//! as if the system had reported an error, or rebuild from a log what a disk can hold after a power
//! cut.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use nemoral_dataset::{
    CloudParams, Dataset, DatasetHeader, Error, FrameData, MergeParams, OpenMode, Writer, cloud,
    merge,
};
use nemoral_files::is_temporary_name;
use nemoral_files::observe::{Operation, observe};
use nemoral_scene::Intrinsics;

use crate::common::{Seen, see, small, tree, try_finish};

/// A folder in memory if the system has one, because syncing thousands of data sets to a disk is
/// slow.
fn in_memory() -> tempfile::TempDir {
    let memory = tempfile::tempdir_in("/dev/shm");
    memory.or_else(|_| tempfile::tempdir()).expect("a folder")
}

/// The smallest data set with a camera and a LiDAR, because thousands are made.
fn tiny() -> DatasetHeader {
    let mut header = small();
    header.sequences[0].cameras[0].intrinsics = Intrinsics::from_fov(4, 3, 1.3).expect("valid");
    header
}

/// Frames 0 to 2 of the drive, with few points.
struct Drive(DatasetHeader, Vec<Seen>);

impl Drive {
    fn new() -> Self {
        let header = tiny();
        let few = |k| {
            let mut seen = see(&header, k);
            seen.points[0].truncate(5);
            seen
        };
        let frames = (0..3).map(few).collect();
        Self(header, frames)
    }

    fn frame(&self, k: usize) -> FrameData<'_> {
        self.1[k].data(&self.0)
    }

    /// Does what `generate` does: keeps the frames that exist and makes the missing ones.
    fn generate(&self, out: &Path, mode: OpenMode, frames: &[usize]) -> Result<(), Error> {
        let writer = Writer::create(out, mode, self.0.clone())?;
        for &k in frames {
            let seen = &self.1[k];
            if !writer.has_frame(0, seen.index, &seen.key) {
                writer.write_frame(&self.frame(k))?;
            }
        }
        try_finish(writer, 3).map(drop)
    }
}

/// Runs `action` with a failure of the `n`-th operation at or below `root`; returns whether there
/// was such an operation.
fn failing<T>(root: &Path, n: usize, action: impl FnOnce() -> T) -> (T, bool) {
    let count = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&count);
    let observation = observe(root, move |_| {
        if counted.fetch_add(1, Ordering::SeqCst) == n {
            Err(io::ErrorKind::StorageFull.into())
        } else {
            Ok(())
        }
    });
    let done = action();
    drop(observation);
    (done, count.load(Ordering::SeqCst) > n)
}

/// Asserts that no file under a final name differs from that of a whole run, and that no temporary
/// file is left.
fn nothing_wrong(out: &Path, whole: &BTreeMap<PathBuf, Vec<u8>>) {
    if !out.exists() {
        return;
    }
    for (path, bytes) in tree(out) {
        let name = path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        assert!(!is_temporary_name(&name), "{}", path.display());
        if !path.starts_with(".nemoral") {
            assert!(whole[&path] == bytes, "{} is wrong", path.display());
        }
    }
}

#[test]
fn whatever_fails_while_generating_nothing_wrong_has_a_final_name_and_resume_ends_the_same() {
    let dir = in_memory();
    let drive = Drive::new();
    let whole = dir.path().join("whole");
    drive
        .generate(&whole, OpenMode::Fresh, &[0, 1, 2])
        .expect("written");
    let whole = tree(&whole);
    let mut failures = 0;
    for n in 0.. {
        let out = dir.path().join("out");
        let run = || drive.generate(&out, OpenMode::Fresh, &[0, 1, 2]);
        let (result, reached) = failing(&out, n, run);
        if !reached {
            result.expect("nothing failed");
            break;
        }
        nothing_wrong(&out, &whole);
        // A failure after everything is written (while the state folder is removed) may leave a
        // whole data set.
        let ended = Dataset::open(&out).is_ok();
        if result.is_err() {
            failures += 1;
        } else {
            assert!(ended, "operation {n} failed and nobody said so");
        }
        drive
            .generate(&out, OpenMode::Resume, &[0, 1, 2])
            .expect("resumed");
        assert!(tree(&out) == whole, "operation {n}");
        fs::remove_dir_all(&out).expect("removed");
    }
    println!("{failures} operations failed in turn");
    assert!(failures > 100);
}

#[test]
fn whatever_fails_while_overwriting_the_folder_stays_one_that_can_be_overwritten() {
    let dir = in_memory();
    let drive = Drive::new();
    let whole = dir.path().join("whole");
    drive
        .generate(&whole, OpenMode::Fresh, &[0, 1])
        .expect("written");
    let whole = tree(&whole);
    for n in (0..).step_by(3) {
        let out = dir.path().join("out");
        drive
            .generate(&out, OpenMode::Fresh, &[0, 2])
            .expect("written");
        let run = || drive.generate(&out, OpenMode::Overwrite, &[0, 1]);
        let (_, reached) = failing(&out, n, run);
        drive
            .generate(&out, OpenMode::Overwrite, &[0, 1])
            .expect("overwritten");
        assert!(tree(&out) == whole, "operation {n}");
        fs::remove_dir_all(&out).expect("removed");
        if !reached {
            break;
        }
    }
}

#[test]
fn whatever_fails_while_merging_a_repetition_ends_the_same() {
    let dir = in_memory();
    let drive = Drive::new();
    let (a, b, out) = (
        dir.path().join("a"),
        dir.path().join("b"),
        dir.path().join("out"),
    );
    drive
        .generate(&a, OpenMode::Fresh, &[0, 1])
        .expect("written");
    drive
        .generate(&b, OpenMode::Fresh, &[1, 2])
        .expect("written");
    let run = |mode| {
        merge(
            &[&a, &b],
            &out,
            MergeParams {
                mode,
                partial: false,
            },
        )
    };
    run(OpenMode::Fresh).expect("merged");
    let whole = tree(&out);
    fs::remove_dir_all(&out).expect("removed");
    for n in (0..).step_by(2) {
        let (_, reached) = failing(&out, n, || run(OpenMode::Fresh));
        nothing_wrong(&out, &whole);
        let mode = if n % 4 == 0 {
            OpenMode::Resume
        } else {
            OpenMode::Overwrite
        };
        run(mode).expect("repeated");
        assert!(tree(&out) == whole, "operation {n}");
        fs::remove_dir_all(&out).expect("removed");
        if !reached {
            break;
        }
    }
}

#[test]
fn whatever_fails_while_a_cloud_is_made_the_old_one_stays() {
    let dir = in_memory();
    let set = dir.path().join("set");
    Drive::new()
        .generate(&set, OpenMode::Fresh, &[0, 1, 2])
        .expect("written");
    let clouds = dir.path().join("clouds");
    fs::create_dir(&clouds).expect("made");
    let out = clouds.join("cloud.ply");
    let run = || cloud(&set, &out, CloudParams::default());
    run().expect("made");
    let whole = fs::read(&out).expect("there");
    fs::write(&out, "old").expect("written");
    for n in 0.. {
        let (result, reached) = failing(&clouds, n, run);
        if !reached {
            result.expect("nothing failed");
            break;
        }
        result.expect_err("it failed");
        let there = fs::read(&out).expect("there");
        assert!(there == b"old" || there == whole, "operation {n}");
        assert_eq!(tree(&clouds).len(), 1, "operation {n}");
    }
    assert!(fs::read(&out).expect("there") == whole);
}

/// A change of the disk, as it is logged.
#[derive(Clone, Debug)]
enum Change {
    Folder(PathBuf),
    Write(PathBuf, Vec<u8>),
    Rename(PathBuf, PathBuf),
    Remove(PathBuf),
    RemoveFolder(PathBuf),
    SyncFile(PathBuf),
    SyncFolder(PathBuf),
}

/// The changes that `action` makes at and below `root`.
fn logged(root: &Path, action: impl FnOnce()) -> Vec<Change> {
    let log = Arc::new(Mutex::new(Vec::new()));
    let kept = Arc::clone(&log);
    let below = root.to_owned();
    let observation = observe(root, move |operation| {
        let at = |path: &Path| path.strip_prefix(&below).expect("below").to_owned();
        let change = match operation {
            Operation::CreateFolder(path) => Change::Folder(at(path)),
            Operation::Write { path, bytes } => Change::Write(at(path), bytes.to_vec()),
            Operation::Rename { from, to } => Change::Rename(at(from), at(to)),
            Operation::RemoveFile(path) => Change::Remove(at(path)),
            Operation::RemoveFolder(path) => Change::RemoveFolder(at(path)),
            Operation::SyncFile(path) => Change::SyncFile(at(path)),
            Operation::SyncFolder(path) => Change::SyncFolder(at(path)),
        };
        kept.lock().expect("whole").push(change);
        Ok(())
    });
    action();
    drop(observation);
    std::mem::take(&mut *log.lock().expect("whole"))
}

/// A file that the log has made.
#[derive(Clone, Debug, Default)]
struct Logged {
    bytes: Vec<u8>,
    content_is_synced: bool,
    name_is_synced: bool,
}

/// The files as the system shows them after some changes, and how much of them is on the medium.
#[derive(Clone, Debug, Default)]
struct Disk {
    files: BTreeMap<PathBuf, Logged>,
    folders: BTreeSet<PathBuf>,
}

impl Disk {
    fn apply(&mut self, change: &Change) {
        match change {
            Change::Folder(path) => {
                self.folders.insert(path.clone());
            }
            Change::Write(path, bytes) => {
                let file = self.files.entry(path.clone()).or_default();
                file.bytes.extend_from_slice(bytes);
                file.content_is_synced = false;
            }
            Change::Rename(from, to) => {
                // There is no write to an empty file, so it may be missing from the log.
                let file = self.files.remove(from).unwrap_or_default();
                let file = Logged {
                    name_is_synced: false,
                    ..file
                };
                self.files.insert(to.clone(), file);
            }
            Change::Remove(path) => {
                self.files.remove(path);
            }
            Change::RemoveFolder(path) => {
                self.folders.remove(path);
            }
            Change::SyncFile(path) => {
                if let Some(file) = self.files.get_mut(path) {
                    file.content_is_synced = true;
                }
            }
            Change::SyncFolder(folder) => {
                for (path, file) in &mut self.files {
                    file.name_is_synced |= path.parent() == Some(folder);
                }
            }
        }
    }

    /// Damages one file in a way that a power cut can.
    fn damage(&mut self, path: &Path, damage: &str) {
        let Some(file) = self.files.get_mut(path) else {
            return;
        };
        match damage {
            "empty" if !file.content_is_synced => file.bytes.clear(),
            "short" if !file.content_is_synced => file.bytes.truncate(file.bytes.len() / 2),
            "absent" if !file.name_is_synced => {
                self.files.remove(path);
            }
            _ => {}
        }
    }

    fn at_risk(&self) -> Vec<PathBuf> {
        let risky = |f: &Logged| !(f.content_is_synced && f.name_is_synced);
        let files = self.files.iter().filter(|(_, file)| risky(file));
        files.map(|(path, _)| path.clone()).collect()
    }

    fn put(&self, root: &Path) {
        for folder in &self.folders {
            fs::create_dir_all(root.join(folder)).expect("made");
        }
        for (path, file) in &self.files {
            let path = root.join(path);
            fs::create_dir_all(path.parent().expect("below")).expect("made");
            fs::write(path, &file.bytes).expect("written");
        }
    }
}

/// Simulates a power cut after each prefix of a run's changes, with damage to all files at risk, or
/// to single ones, of which one in `every` is taken. Then the run is resumed. Returns the number of
/// power cuts.
fn cut(drive: &Drive, changes: &[Change], before: &Disk, every: usize) -> usize {
    let dir = in_memory();
    let whole = dir.path().join("whole");
    drive
        .generate(&whole, OpenMode::Fresh, &[0, 1])
        .expect("written");
    let whole = tree(&whole);
    let (mut disk, mut cuts) = (before.clone(), 0);
    for n in 0..=changes.len() {
        if n > 0 {
            disk.apply(&changes[n - 1]);
        }
        let risk = disk.at_risk();
        let mut cases: Vec<Vec<&PathBuf>> = vec![risk.iter().collect()];
        cases.extend(
            risk.iter()
                .skip(n % every)
                .step_by(every)
                .map(|path| vec![path]),
        );
        for damage in ["empty", "short", "absent"] {
            for case in &cases {
                let out = dir.path().join("out");
                let mut damaged = disk.clone();
                for path in case {
                    damaged.damage(path, damage);
                }
                damaged.put(&out);
                let says = || format!("after {n} changes, {damage}: {case:?}");
                // A data set that claims to be finished is finished.
                if let Ok(dataset) = Dataset::open(&out) {
                    for k in 0..dataset.frames().len() {
                        dataset
                            .read_frame(k)
                            .unwrap_or_else(|e| panic!("{}: {e}", says()));
                    }
                }
                drive
                    .generate(&out, OpenMode::Resume, &[0, 1])
                    .unwrap_or_else(|e| panic!("{}: {e}", says()));
                assert!(tree(&out) == whole, "{}", says());
                let _ = fs::remove_dir_all(&out);
                cuts += 1;
            }
        }
    }
    cuts
}

/// The changes of a fresh run, and of one that makes a finished data set longer, with the disk
/// before it.
fn runs(drive: &Drive) -> [(Vec<Change>, Disk); 2] {
    let dir = in_memory();
    let out = dir.path().join("out");
    let run = |mode, frames: &[usize]| {
        logged(&out, || {
            drive.generate(&out, mode, frames).expect("written")
        })
    };
    let first = run(OpenMode::Fresh, &[0]);
    let mut disk = Disk::default();
    for change in &first {
        disk.apply(change);
    }
    let longer = run(OpenMode::Resume, &[0, 1]);
    fs::remove_dir_all(&out).expect("removed");
    let fresh = run(OpenMode::Fresh, &[0, 1]);
    [(fresh, Disk::default()), (longer, disk)]
}

#[test]
fn whenever_the_power_is_cut_resume_ends_the_same() {
    let drive = Drive::new();
    for (changes, before) in runs(&drive) {
        let cuts = cut(&drive, &changes, &before, 12);
        println!("{} changes, {cuts} power cuts", changes.len());
    }
}

#[test]
#[ignore = "takes minutes: run by .ci/full"]
fn whenever_the_power_is_cut_and_whichever_file_it_damages_resume_ends_the_same() {
    let drive = Drive::new();
    for (changes, before) in runs(&drive) {
        let cuts = cut(&drive, &changes, &before, 1);
        println!("{} changes, {cuts} power cuts", changes.len());
    }
}

#[test]
fn the_power_cut_finds_a_writer_that_does_not_sync() {
    let drive = Drive::new();
    let [(changes, before), _] = runs(&drive);
    let careless = changes
        .into_iter()
        .filter(|c| !matches!(c, Change::SyncFile(_) | Change::SyncFolder(_)));
    let careless: Vec<_> = careless.collect();
    let cut = std::panic::catch_unwind(|| cut(&drive, &careless, &before, 50));
    assert!(cut.is_err(), "without syncs something is lost");
}

#[test]
fn what_is_finished_is_on_the_medium() {
    let drive = Drive::new();
    for (changes, mut disk) in runs(&drive) {
        for change in &changes {
            disk.apply(change);
        }
        assert_eq!(disk.at_risk(), Vec::<PathBuf>::new());
    }
}
