//! Running the program and looking at what it wrote.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::LazyLock;

/// A quick request: most of its time goes into growing the plants.
pub(crate) const SMALL: [&str; 8] = [
    "chunks.visible_radius_m=15",
    "chunks.undergrowth_radius_m=10",
    "chunks.delete_radius_m=30",
    "camera.width_px=32",
    "camera.height_px=18",
    "lidar.pulses=300",
    "robot.spacing_m=0.5",
    "frames=40",
];

/// The outcome of a run.
pub(crate) struct Outcome {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

pub(crate) fn nemoral() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_nemoral"));
    command.stdin(Stdio::null());
    // A cache for the tests alone, which all of them share.
    command.env(
        "NEMORAL_CACHE",
        concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"),
    );
    command
}

/// Runs a command to its end.
pub(crate) fn outcome(command: &mut Command) -> Outcome {
    let output = command.output().expect("the program starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Outcome {
        code: output.status.code(),
        stdout: text(&output.stdout),
        stderr: text(&output.stderr),
    }
}

/// `nemoral` with these arguments.
pub(crate) fn run(arguments: &[&str]) -> Outcome {
    outcome(nemoral().args(arguments))
}

/// `nemoral generate` of the small request.
pub(crate) fn small(out: &Path, arguments: &[&str]) -> Command {
    let mut command = nemoral();
    command
        .args(["generate", "--preset", "demo", "--out"])
        .arg(out);
    for setting in SMALL {
        command.args(["--set", setting]);
    }
    command.args(arguments);
    command
}

/// Runs `nemoral generate` of the small request and expects it to be done.
#[track_caller]
pub(crate) fn record(out: &Path, arguments: &[&str]) {
    let done = outcome(&mut small(out, arguments));
    assert_eq!(done.code, Some(0), "{}", done.stderr);
}

/// A folder of a test's own, without what an earlier run left there.
pub(crate) fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("cli")
        .join(name);
    if path.exists() {
        fs::remove_dir_all(&path).expect("an old folder goes");
    }
    fs::create_dir_all(&path).expect("a new folder");
    path
}

/// The small request, recorded in one run by two threads. Every other way must give the same files.
pub(crate) fn base() -> &'static Path {
    static BASE: LazyLock<PathBuf> = LazyLock::new(|| {
        let out = folder("base").join("out");
        record(&out, &["--threads", "2"]);
        out
    });
    &BASE
}

/// Copies the base data set, for a test that changes it.
pub(crate) fn copy_base(to: &Path) {
    for (name, bytes) in files(base()) {
        let path = to.join(name);
        fs::create_dir_all(path.parent().expect("it has one")).expect("a writable folder");
        fs::write(path, bytes).expect("a writable folder");
    }
}

/// Every file below a folder.
pub(crate) fn files(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a readable folder") {
            let path = entry.expect("a readable folder").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(root).expect("below the root");
                let bytes = fs::read(&path).expect("a readable file");
                found.insert(name.to_string_lossy().replace('\\', "/"), bytes);
            }
        }
    }
    found
}

/// Asserts that both folders hold the same files with the same bytes.
#[track_caller]
pub(crate) fn assert_same_files(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    let names = |f: &BTreeMap<String, Vec<u8>>| f.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&a), names(&b));
    for (name, bytes) in &a {
        assert!(*bytes == b[name], "{name} differs");
    }
    // There are eight files for each of 40 frames, and those of the whole data set.
    assert!(a.len() >= 40 * 8 + 6, "{} files", a.len());
}

/// Asserts that every file that an interrupted run left under a final name is equal to that of an
/// uninterrupted run.
#[track_caller]
pub(crate) fn assert_only_whole_files(root: &Path) -> usize {
    let expected = files(base());
    let mut whole = 0;
    for (name, bytes) in files(root) {
        // The state of an unfinished data set.
        if name.starts_with(".nemoral/") {
            continue;
        }
        let is_temporary = name.rsplit('/').next().is_some_and(|n| n.ends_with(".tmp"));
        if !is_temporary {
            assert!(expected.get(&name) == Some(&bytes), "{name} is not whole");
            whole += 1;
        }
    }
    whole
}
