//! The stubs of the compiled module, which type checkers read, name what there is.
//!
//! (`python/tests` has the tests of the package. Because of this one, `cargo test` builds the
//! module that they need.)

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// The functions and methods of a Rust file that Python sees.
fn exported(source: &str) -> BTreeSet<String> {
    let (mut found, mut is_function, mut in_methods) = (BTreeSet::new(), false, false);
    for line in source.lines() {
        let code = line.trim_start();
        let name = code.split_once("fn ").map(|(_, rest)| {
            let end = rest.find(['(', '<']).unwrap_or(rest.len());
            rest[..end].to_owned()
        });
        match (line, name) {
            ("#[pyfunction]", _) => is_function = true,
            ("#[pymethods]", _) => in_methods = true,
            ("}", _) => in_methods = false,
            (_, Some(name)) if is_function && line.starts_with("pub(crate) fn") => {
                is_function = false;
                found.insert(name);
            }
            (_, Some(name)) if in_methods && line.starts_with("    fn ") => {
                found.insert(name);
            }
            _ => {}
        }
    }
    found
}

/// The functions and methods that the stubs declare.
fn declared(stubs: &str) -> BTreeSet<String> {
    let lines = stubs.lines().map(str::trim_start);
    let names = lines.filter_map(|line| {
        let (name, _) = line.strip_prefix("def ")?.split_once('(')?;
        Some(name.to_owned())
    });
    names.collect()
}

#[test]
fn stubs_name_what_there_is() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = BTreeSet::new();
    for entry in fs::read_dir(here.join("src")).expect("a folder") {
        let path = entry.expect("a file").path();
        found.extend(exported(&fs::read_to_string(path).expect("text")));
    }
    // These are the constructors.
    for constructor in ["new", "open"] {
        assert!(found.remove(constructor), "{constructor}");
    }
    let stubs = here.join("../../python/src/nemoral/_native.pyi");
    let mut stubs = declared(&fs::read_to_string(stubs).expect("text"));
    assert!(stubs.remove("__init__"));
    assert!(found.len() > 40, "{found:?}");
    assert_eq!(found, stubs);
}
