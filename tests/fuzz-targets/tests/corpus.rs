//! Replays the fuzzers' seeds and findings without a fuzzer: no input may panic, hang, or allocate
//! a gigabyte.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use nemoral_fuzz_targets::{TARGETS, Target};
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// A single allocation that no input may reach, bytes.
const LIMIT: usize = 1 << 30;
/// The time that no input may reach: a thousand times that of the slowest one, for busy machines.
const PATIENCE: Duration = Duration::from_secs(60);

fn fuzz(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../fuzz")
        .join(folder)
}

/// The entries of a folder, sorted by name. The folder must exist.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let read = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<_> = read.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    paths
}

/// The fault of a target with an input, if there is one.
fn fault(target: &Target, input: &[u8]) -> Option<String> {
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    let start = Instant::now();
    if catch_unwind(AssertUnwindSafe(|| (target.run)(input))).is_err() {
        return Some("panics".to_owned());
    }
    let (peak, took) = (MEMORY.peak_usage().saturating_sub(before), start.elapsed());
    if peak >= LIMIT {
        return Some(format!("asks for {} MB", peak >> 20));
    }
    (took > PATIENCE).then(|| format!("takes {took:?}"))
}

#[test]
fn no_input_panics_hangs_or_asks_for_a_gigabyte() {
    let mut faults = Vec::new();
    for target in TARGETS {
        let mut inputs = entries(&fuzz("corpus").join(target.name));
        assert!(!inputs.is_empty(), "{}: the corpus is empty", target.name);
        // Inputs that take a fuzzer seconds are in another folder than its seeds.
        let heavy = fuzz("heavy").join(target.name);
        if heavy.exists() {
            inputs.extend(entries(&heavy));
        }
        for path in inputs {
            let input = fs::read(&path).expect("a readable file");
            if let Some(fault) = fault(target, &input) {
                faults.push(format!("{}: {fault}", path.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_corpus_has_a_target_and_every_target_a_fuzzer() {
    let names = |folder: &Path| -> Vec<String> {
        let stem = |p: &PathBuf| p.file_stem().map(|s| s.to_string_lossy().into_owned());
        entries(folder).iter().filter_map(stem).collect()
    };
    let targets: Vec<_> = TARGETS.iter().map(|t| t.name.to_owned()).collect();
    let sorted = |mut names: Vec<String>| {
        names.sort();
        names
    };
    assert_eq!(names(&fuzz("corpus")), sorted(targets.clone()));
    assert_eq!(names(&fuzz("fuzz_targets")), sorted(targets));
}
