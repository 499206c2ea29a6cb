//! Failing disks under a whole `generate` with its cache.
//!
//! Every change of the file system, in the data set and in the cache, fails in turn. No final name
//! may then hold wrong bytes, and a repetition with the cache as it was left ends byte-identical.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use nemoral_dataset::{Dataset, OpenMode};
use nemoral_files::is_temporary_name;
use nemoral_files::observe::{Operation, observe};
use nemoral_pipeline::config::{Config, ConfigLayers, Sequences};
use nemoral_pipeline::plan::Cache;
use nemoral_pipeline::{
    Backend, Error, FrameSelection, FrameWritten, GenerateParams, Observer, SequenceFrames,
    generate,
};

/// The smallest forest with a camera, a LiDAR and plants to keep, because dozens are recorded.
fn tiny() -> Config {
    let settings = [
        "frames=2",
        "placement.trees=4",
        "placement.shrubs=4",
        "trails.grass_max=4",
        "undergrowth.cover=0.1",
        "chunks.visible_radius_m=10",
        "chunks.undergrowth_radius_m=2",
        "assets.eucalyptus=0",
        "assets.english_oak=0",
        "assets.snags=0",
        "camera.width_px=24",
        "camera.height_px=16",
        "lidar.pulses=50",
    ];
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        file: None,
        settings: settings.map(str::to_owned).to_vec(),
    };
    layers.load().unwrap_or_else(|e| panic!("{e}"))
}

struct Silent;

impl Observer for Silent {
    fn note(&self, _: &str) {}

    fn frame(&self, _: FrameWritten) {}
}

/// The folders of a run, in memory if the system has that, because the runs sync all they write.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let memory = tempfile::tempdir_in("/dev/shm");
        Self(memory.or_else(|_| tempfile::tempdir()).expect("a folder"))
    }

    fn root(&self) -> &Path {
        self.0.path()
    }

    fn out(&self) -> PathBuf {
        self.root().join("out")
    }

    fn cache(&self) -> PathBuf {
        self.root().join("cache")
    }

    /// Does what a process of the program does: opens the cache, then makes the data set.
    fn generate(&self, mode: OpenMode) -> Result<(), Error> {
        let cache = Cache::open(self.cache()).expect("a folder");
        let params = GenerateParams {
            sequences: Sequences::of(&tiny()).expect("valid"),
            frames: SequenceFrames::new(FrameSelection::first(2), 1),
            out: self.out(),
            mode,
            is_shard: false,
            threads: 1,
            backend: Backend::Cpu,
            cache: Some(Arc::new(cache)),
        };
        generate(&params, &Silent, &AtomicBool::new(false)).map(drop)
    }

    /// The files of the data set, and those of the cache.
    fn files(&self) -> [Files; 2] {
        [files(&self.out()), files(&self.cache())]
    }
}

fn remove(folder: &Path) {
    if folder.exists() {
        fs::remove_dir_all(folder).expect("removed");
    }
}

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// All files below a folder, which need not exist.
fn files(root: &Path) -> Files {
    let mut found = Files::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop().filter(|folder| folder.exists()) {
        for entry in fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let bytes = fs::read(&path).expect("a file");
                found.insert(path.strip_prefix(root).expect("below").to_owned(), bytes);
            }
        }
    }
    found
}

/// Runs `action` with a failure of the `n`-th operation at or below `root`; returns what failed and
/// where, if there was such an operation.
fn failing<T>(
    root: &Path,
    n: usize,
    action: impl FnOnce() -> T,
) -> (T, Option<(&'static str, PathBuf)>) {
    let count = AtomicUsize::new(0);
    let failed = Arc::new(Mutex::new(None));
    let noted = Arc::clone(&failed);
    let observation = observe(root, move |operation| {
        if count.fetch_add(1, Ordering::SeqCst) != n {
            return Ok(());
        }
        let kind = match operation {
            Operation::CreateFolder(_) => "create",
            Operation::Write { .. } => "write",
            Operation::Rename { .. } => "rename",
            Operation::RemoveFile(_) | Operation::RemoveFolder(_) => "remove",
            Operation::SyncFile(_) | Operation::SyncFolder(_) => "sync",
        };
        let mut noted = noted.lock().unwrap_or_else(PoisonError::into_inner);
        *noted = Some((kind, operation.path().to_owned()));
        Err(io::ErrorKind::StorageFull.into())
    });
    let done = action();
    drop(observation);
    let failed = failed.lock().unwrap_or_else(PoisonError::into_inner).take();
    (done, failed)
}

/// Asserts that no file under a final name differs from that of a whole run, and that no temporary
/// file is left. What is in `.nemoral` is our own state, which a resumed run judges.
fn nothing_wrong(found: &Files, whole: &Files, says: &str) {
    for (path, bytes) in found {
        let name = path.file_name().expect("a name").to_string_lossy();
        assert!(
            !is_temporary_name(&name),
            "{says}: {} is left",
            path.display()
        );
        if !path.starts_with(".nemoral") {
            assert!(
                whole.get(path) == Some(bytes),
                "{says}: {} is wrong",
                path.display()
            );
        }
    }
}

/// A data set, the cache that was filled for it, and where they are.
struct Whole {
    place: Place,
    data_set: Files,
    kept: Files,
}

impl Whole {
    fn new() -> Self {
        let place = Place::new();
        place.generate(OpenMode::Fresh).expect("made");
        let [data_set, kept] = place.files();
        assert!(!kept.is_empty(), "the cache is used");
        Self {
            place,
            data_set,
            kept,
        }
    }

    /// Makes the data set with a failure of the `n`-th operation in a folder, then again with what
    /// that has left. False if there are no more operations.
    fn fails(&self, folder: &Path, n: usize) -> bool {
        let place = &self.place;
        remove(&place.out());
        let run = || place.generate(OpenMode::Fresh);
        let (result, failed) = failing(folder, n, run);
        let Some((kind, path)) = failed else {
            result.expect("nothing failed");
            return false;
        };
        let says = format!("operation {n}, {kind} {}", path.display());
        let [found, left] = place.files();
        nothing_wrong(&found, &self.data_set, &says);
        nothing_wrong(&left, &self.kept, &says);
        if folder == place.cache() {
            // A cache that cannot be written costs time and nothing else.
            result.unwrap_or_else(|e| panic!("{says}: {e}"));
            assert!(found == self.data_set, "{says}");
        } else if result.is_ok() {
            let ended = Dataset::open(&place.out()).is_ok();
            assert!(ended, "{says}: nobody said so");
        }

        let mode = if n.is_multiple_of(2) {
            OpenMode::Resume
        } else {
            OpenMode::Overwrite
        };
        if folder == place.cache() {
            // Only a data set that is made anew asks the cache for what it has left.
            remove(&place.out());
        }
        let repeated = place.generate(mode);
        repeated.unwrap_or_else(|e| panic!("{says}: {mode:?}: {e}"));
        let [found, left] = place.files();
        assert!(found == self.data_set, "{says}: {mode:?}");
        assert!(left == self.kept, "{says}: {mode:?}");
        true
    }

    /// Fails every `step`-th operation in the data set; returns how many failed.
    fn fail_in_data_set(&self, step: usize) -> usize {
        let operations = (0..).step_by(step);
        let failed = operations.take_while(|n| self.fails(&self.place.out(), *n));
        failed.count()
    }

    /// Fails every operation in an empty cache in turn; returns how many failed.
    fn fail_in_cache(&self) -> usize {
        let failed = (0..).take_while(|n| {
            remove(&self.place.cache());
            self.fails(&self.place.cache(), *n)
        });
        failed.count()
    }
}

#[test]
fn whatever_fails_in_a_whole_run_nothing_wrong_has_a_final_name_and_it_can_be_repeated() {
    let whole = Whole::new();
    let failed = whole.fail_in_data_set(29);
    println!("{failed} operations failed in turn");
    assert!(failed > 3);
}

#[test]
#[ignore = "minutes: .ci/full runs it"]
fn whichever_operation_fails_in_a_whole_run_it_can_be_repeated() {
    let whole = Whole::new();
    let in_cache = whole.fail_in_cache();
    let in_data_set = whole.fail_in_data_set(1);
    println!("{in_data_set} operations in the data set and {in_cache} in the cache failed in turn");
    assert!(in_data_set > 100 && in_cache > 1);
}

/// A disk that fails without a word leaves damaged files in the cache. They are treated as missing,
/// and written again.
#[test]
#[ignore = "a minute: .ci/full runs it"]
fn a_damaged_cache_changes_no_data_set_and_is_mended() {
    let whole = Whole::new();
    let damages: [fn(&mut Vec<u8>); 3] = [
        Vec::clear,
        |bytes| bytes.truncate(bytes.len() / 2),
        |bytes| {
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
        },
    ];
    for damage in damages {
        for (name, bytes) in &whole.kept {
            let mut damaged = bytes.clone();
            damage(&mut damaged);
            fs::write(whole.place.cache().join(name), damaged).expect("written");
        }
        whole.place.generate(OpenMode::Overwrite).expect("made");
        let [found, left] = whole.place.files();
        assert!(found == whole.data_set && left == whole.kept);
    }
}
