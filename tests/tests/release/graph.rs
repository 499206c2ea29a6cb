//! The dependencies between crates (ARCHITECTURE.md), from cargo's metadata of the workspace.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// The stage crates, each of which has one task and depends only on the vocabulary and the keys.
const STAGES: [&str; 16] = [
    "nemoral-assets",
    "nemoral-dataset",
    "nemoral-export",
    "nemoral-import",
    "nemoral-imu",
    "nemoral-lidar",
    "nemoral-lidar-noise",
    "nemoral-mensuration",
    "nemoral-placement",
    "nemoral-raycast",
    "nemoral-render",
    "nemoral-stand",
    "nemoral-terrain",
    "nemoral-trails",
    "nemoral-trajectory",
    "nemoral-water",
];

/// The crates that read data sets and know how they are made no more than their readers do.
const READERS: [&str; 2] = ["nemoral-convert", "nemoral-report"];

/// The crate of requests, which knows what their tables mean to the stages, and grows nothing.
const CONFIG: &str = "nemoral-config";

/// The engine of plans, which depends on files alone.
const PLAN: &str = "nemoral-plan";

/// The module of the Python package, which shows the program and its parts.
const PYTHON: &str = "nemoral-python";

/// The crates that every crate may depend on, and that depend on no other of ours.
const LEAVES: [&str; 3] = ["nemoral-files", "nemoral-scene", "nemoral-seed"];

struct Package {
    name: String,
    folder: PathBuf,
    manifest: String,
    edition: String,
    licence: String,
    /// Name and kind: `normal`, `dev` or `build`.
    dependencies: Vec<(String, String)>,
}

impl Package {
    fn ours(&self, kinds: &[&str]) -> BTreeSet<&str> {
        let of_kind = self
            .dependencies
            .iter()
            .filter(|(_, kind)| kinds.contains(&&**kind));
        of_kind
            .map(|(name, _)| &**name)
            .filter(|name| name.starts_with("nemoral"))
            .collect()
    }

    /// The package's Rust files below a folder.
    fn sources(&self, below: &str) -> Vec<(PathBuf, String)> {
        let mut found = Vec::new();
        collect(&self.folder.join(below), &mut found);
        found
    }
}

fn collect(folder: &Path, found: &mut Vec<(PathBuf, String)>) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() {
            collect(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = fs::read_to_string(&path).expect("a readable file");
            found.push((path, text));
        }
    }
}

fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().expect("the workspace's root").to_owned()
}

fn packages() -> Vec<Package> {
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--offline",
            "--no-deps",
            "--format-version",
            "1",
        ])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let text = |v: &Value| v.as_str().unwrap_or("normal").to_owned();
    let package = |p: &Value| {
        let manifest = PathBuf::from(text(&p["manifest_path"]));
        let dependencies = p["dependencies"].as_array().expect("dependencies");
        Package {
            name: text(&p["name"]),
            folder: manifest.parent().expect("a folder").to_owned(),
            manifest: fs::read_to_string(&manifest).expect("a manifest"),
            edition: text(&p["edition"]),
            licence: text(&p["license"]),
            dependencies: dependencies
                .iter()
                .map(|d| (text(&d["name"]), text(&d["kind"])))
                .collect(),
        }
    };
    let packages = metadata["packages"].as_array().expect("packages");
    packages.iter().map(package).collect()
}

/// The published crates.
fn crates() -> Vec<Package> {
    let all = packages();
    let crates = root().join("crates");
    all.into_iter()
        .filter(|p| p.folder.starts_with(&crates))
        .collect()
}

fn find<'a>(packages: &'a [Package], name: &str) -> &'a Package {
    let found = packages.iter().find(|p| p.name == name);
    found.unwrap_or_else(|| panic!("no package {name}"))
}

#[test]
fn stage_crates_know_only_scene_seed_and_files() {
    let all = crates();
    let shared = BTreeSet::from(LEAVES);
    for name in STAGES {
        // This includes their tests and examples.
        let known = find(&all, name).ours(&["normal", "build", "dev"]);
        assert!(known.is_subset(&shared), "{name}: {known:?}");
    }
    let trajectory = find(&all, "nemoral-trajectory").ours(&["normal", "build", "dev"]);
    assert_eq!(
        trajectory,
        BTreeSet::from(["nemoral-scene", "nemoral-seed"])
    );
    let noise = find(&all, "nemoral-lidar-noise").ours(&["normal", "build"]);
    assert_eq!(noise, BTreeSet::from(["nemoral-scene"]));
    for name in LEAVES {
        let known = find(&all, name).ours(&["normal", "build"]);
        assert!(known.is_empty(), "{name}: {known:?}");
    }
    for name in READERS {
        let known = find(&all, name).ours(&["normal", "build", "dev"]);
        assert_eq!(
            known,
            BTreeSet::from(["nemoral-dataset", "nemoral-files", "nemoral-scene"]),
            "{name}"
        );
    }
    // This includes its tests and examples.
    let plan = find(&all, PLAN).ours(&["normal", "build", "dev"]);
    assert_eq!(plan, BTreeSet::from(["nemoral-files"]));
}

#[test]
fn the_pipeline_wires_and_the_program_only_asks() {
    let all = crates();
    let pipeline = find(&all, "nemoral-pipeline").ours(&["normal", "build"]);
    assert!(
        pipeline.is_superset(&BTreeSet::from(STAGES)),
        "{pipeline:?}"
    );
    assert!(pipeline.contains(CONFIG), "{pipeline:?}");
    // This includes its tests and examples.
    let config = find(&all, CONFIG).ours(&["normal", "build", "dev"]);
    let mut allowed = BTreeSet::from(STAGES);
    allowed.extend(LEAVES);
    allowed.extend([PLAN, "nemoral-convert"]);
    assert!(config.is_subset(&allowed), "{config:?}");
    let cli = find(&all, "nemoral-cli").ours(&["normal", "build"]);
    let mut allowed = BTreeSet::from(READERS);
    allowed.extend([
        "nemoral-dataset",
        "nemoral-export",
        "nemoral-files",
        "nemoral-pipeline",
        "nemoral-view",
    ]);
    assert!(cli.is_subset(&allowed), "{cli:?}");
    for package in &all {
        let known = package.ours(&["normal", "build"]);
        let is_python = package.name == PYTHON;
        assert!(
            is_python || !known.contains("nemoral-cli"),
            "{}",
            package.name
        );
        assert!(!known.contains(PYTHON), "{}", package.name);
        let asks =
            ["nemoral-pipeline", "nemoral-view", "nemoral-cli", PYTHON].contains(&&*package.name);
        assert!(
            asks || !known.contains("nemoral-pipeline"),
            "{}",
            package.name
        );
        // Others get it from the pipeline.
        let wires = package.name == "nemoral-pipeline";
        assert!(wires || !known.contains(CONFIG), "{}", package.name);
    }
    let view = find(&all, "nemoral-view").ours(&["normal", "build"]);
    assert_eq!(view, BTreeSet::from(["nemoral-pipeline", "nemoral-scene"]));
    // A crate that is not listed here would not be checked.
    let known: BTreeSet<&str> = STAGES
        .into_iter()
        .chain(LEAVES)
        .chain(READERS)
        .chain([
            CONFIG,
            PLAN,
            PYTHON,
            "nemoral-pipeline",
            "nemoral-view",
            "nemoral-cli",
        ])
        .collect();
    let names: BTreeSet<&str> = all.iter().map(|p| &*p.name).collect();
    assert_eq!(names, known);
}

#[test]
fn only_render_names_wgpu() {
    for package in crates() {
        if package.name == "nemoral-render" {
            continue;
        }
        let named = package
            .dependencies
            .iter()
            .any(|(d, _)| d.starts_with("wgpu"));
        assert!(!named, "{} depends on wgpu", package.name);
        for (path, text) in package.sources("src") {
            assert!(!text.contains("wgpu"), "{}", path.display());
        }
    }
}

#[test]
fn no_result_comes_from_the_platforms_sine() {
    const NAMES: [&str; 16] = [
        "sin", "cos", "sin_cos", "tan", "asin", "acos", "atan", "atan2", "exp", "exp2", "ln",
        "log2", "log10", "powf", "cbrt", "hypot",
    ];
    let calls = NAMES.map(|name| {
        [
            format!(".{name}("),
            format!("f32::{name}("),
            format!("f64::{name}("),
        ]
    });
    let calls = calls.as_flattened();
    let mut own = 0;
    for package in crates() {
        for (path, text) in package.sources("src") {
            if path.ends_with("tests.rs") {
                continue;
            }
            let code = text.split("#[cfg(test)]").next().unwrap_or_default();
            for line in code.lines().map(|l| l.split("//").next().unwrap_or(l)) {
                own += usize::from(line.contains("libm::sin"));
                let found = calls.iter().find(|call| line.contains(*call));
                assert!(found.is_none(), "{}: {line}: use libm", path.display());
            }
        }
    }
    assert!(own > 20, "the search sees code: {own}");
    let manifest = fs::read_to_string(root().join("Cargo.toml")).expect("the workspace");
    let glam = manifest.lines().find(|l| l.starts_with("glam = "));
    assert!(glam.is_some_and(|l| l.contains("\"libm\"")), "{glam:?}");
}

#[test]
fn unsafe_is_where_it_is_known() {
    let mut found = BTreeSet::new();
    for package in packages() {
        for folder in ["src", "tests", "examples", "benches"] {
            for (path, text) in package.sources(folder) {
                let code = text.lines().map(|l| l.split("//").next().unwrap_or(l));
                let is_unsafe = |line: &str| {
                    let mut words = line.split(|c: char| !c.is_alphanumeric() && c != '_');
                    words.any(|w| w == "unsafe")
                };
                // This file names it in strings.
                if code.clone().any(is_unsafe) && !path.ends_with("release/graph.rs") {
                    let below = path.strip_prefix(root()).expect("below the root");
                    found.insert(below.to_string_lossy().replace('\\', "/"));
                }
            }
        }
    }
    // The second one binds a foreign library for a comparison.
    let allowed = [
        "crates/raycast/src/simd/avx2.rs",
        "benches/benches/casters/embree.rs",
    ];
    let allowed = BTreeSet::from(allowed.map(str::to_owned));
    assert!(found.is_subset(&allowed), "{found:?}");
    assert_eq!(found, allowed, "the search finds what is there");
}

#[test]
fn every_crate_can_be_published() {
    for package in crates() {
        let name = &package.name;
        let readme = fs::read_to_string(package.folder.join("README.md"));
        let readme = readme.unwrap_or_else(|e| panic!("{name}: README.md: {e}"));
        assert!(
            readme.starts_with(&format!("# {name}")),
            "{name}: README.md"
        );
        assert!(
            readme.lines().count() >= 5,
            "{name}: README.md says nothing"
        );
        assert_eq!(package.edition, "2024", "{name}");
        assert_eq!(package.licence, "MIT OR Apache-2.0", "{name}");
        for key in ["version", "edition", "license", "rust-version"] {
            let line = format!("\n{key}.workspace = true\n");
            assert!(package.manifest.contains(&line), "{name}: {key}");
        }
        assert!(package.manifest.contains("\ndescription = \""), "{name}");
        assert!(
            package.manifest.contains("[lints]\nworkspace = true"),
            "{name}: the workspace's lints"
        );
        let folder = package.folder.file_name().expect("a name");
        assert_eq!(name, &format!("nemoral-{}", folder.to_string_lossy()));
    }
}
