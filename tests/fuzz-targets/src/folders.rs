//! Whole folders: two shards of a data set are changed, then opened, checked, counted, merged,
//! resumed and overwritten. Whatever happens, no file outside of them may change.

use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use nemoral_dataset::{
    CloudParams, CloudPoses, Dataset, MergeParams, OpenMode, Writer, check, cloud, stats,
};

use crate::base::{Files, files, shards};
use crate::edits::{Instructions, Part, Thing};
use crate::scratch::Scratch;

static SHARDS: LazyLock<[Files; 2]> = LazyLock::new(shards);

/// Files beside the data sets.
const OUTSIDE: [(&str, &str); 3] = [
    ("canary.txt", "alive"),
    ("outside/kept.txt", "kept"),
    ("outside/velodyne/000000.bin", "not a scan of ours"),
];

/// The operations on the folders, as bits.
#[derive(Clone, Copy)]
struct Tasks(u8);

impl Tasks {
    fn has(self, bit: u8) -> bool {
        self.0 >> bit & 1 == 1
    }
}

/// Operates on two data sets changed by instructions; the first byte selects the operations.
///
/// # Panics
/// If anything beside the data sets changes, or if what was merged cannot be opened.
pub fn merge(input: &[u8]) {
    let mut from = Instructions(input);
    let tasks = Tasks(from.byte());
    let mut parts = SHARDS.each_ref().map(Part::new);
    let mut edits = 0;
    while from.has_more() && edits < 32 {
        let part = usize::from(from.byte()) % parts.len();
        parts[part].edit(&mut from);
        edits += 1;
    }
    let scratch = Scratch::new();
    for (name, text) in OUTSIDE {
        scratch.put(name, text.as_bytes());
    }
    let [a, b, out] = ["a", "b", "out"].map(|name| scratch.path().join(name));
    for (part, root) in parts.iter_mut().zip([&a, &b]) {
        part.seal();
        write(part, root);
    }
    look(&a, &scratch, tasks);
    unite(&[&a, &b], &out, tasks);
    if tasks.has(6) {
        let mode = mode(tasks);
        let partial = tasks.has(4);
        let _ = nemoral_dataset::merge(&[&a], &b, MergeParams { mode, partial });
    }
    go_on(&a, tasks);
    assert_untouched(scratch.path());
}

/// Writes a folder. Of entries that exclude each other, the first is written.
fn write(part: &Part, root: &Path) {
    fs::create_dir_all(root).expect("a folder can be made");
    for (name, thing) in &part.things {
        let path = root.join(name);
        let above = path.parent().unwrap_or(root);
        // Files are never written through a link, so that this function itself changes nothing
        // outside.
        let is_inside = above
            .ancestors()
            .take_while(|folder| *folder != root)
            .all(|folder| !folder.is_symlink());
        if !is_inside || fs::create_dir_all(above).is_err() || path.is_symlink() {
            continue;
        }
        let _ = match thing {
            Thing::File(bytes) => fs::write(&path, bytes),
            Thing::Folder => fs::create_dir(&path),
            Thing::Link(lead) => link(lead, &path),
        };
    }
}

#[cfg(unix)]
fn link(lead: &str, path: &Path) -> std::io::Result<()> {
    std::os::unix::fs::symlink(lead, path)
}

#[cfg(not(unix))]
fn link(_: &str, _: &Path) -> std::io::Result<()> {
    Ok(())
}

/// Opens a data set and reads all of it.
fn look(root: &Path, scratch: &Scratch, tasks: Tasks) {
    if let (true, Ok(dataset)) = (tasks.has(0), Dataset::open(root)) {
        for i in 0..dataset.frames().len() {
            let _ = dataset.read_frame(i);
        }
        for t in &dataset.manifest().tracks {
            let _ = (dataset.poses(t.sequence), dataset.times(t.sequence));
            let _ = dataset.calibration(t.sequence);
            let _ = dataset.estimated_world_from_body(t.sequence);
        }
    }
    let report = check(root).map(|report| report.to_string());
    std::hint::black_box(report.is_ok());
    if tasks.has(0) {
        let _ = stats(root).map(|stats| stats.to_string());
    }
    if tasks.has(1) {
        let params = CloudParams {
            voxel_m: tasks.has(2).then_some(0.05),
            pure: tasks.has(3),
            poses: if tasks.has(4) {
                CloudPoses::Estimated
            } else {
                CloudPoses::True
            },
            ..CloudParams::default()
        };
        let _ = cloud(root, &scratch.path().join("cloud.ply"), params);
    }
}

/// Merges the data sets and resumes the result.
fn unite(parts: &[&Path], out: &Path, tasks: Tasks) {
    let params = |mode| MergeParams {
        mode,
        partial: tasks.has(4),
    };
    if nemoral_dataset::merge(parts, out, params(OpenMode::Fresh)).is_ok() {
        let merged = Dataset::open(out).expect("what was merged can be opened");
        assert!(merged.is_untouched());
        if tasks.has(7) {
            let whole = files(out);
            let again = nemoral_dataset::merge(parts, out, params(OpenMode::Resume));
            again.expect("a merge can be repeated");
            assert!(files(out) == whole, "a repeated merge gives the same bytes");
        }
    }
}

/// Resumes a part or replaces it, with its own header.
fn go_on(root: &Path, tasks: Tasks) {
    let of_manifest = Dataset::open(root)
        .map(|d| d.manifest().header.clone())
        .ok();
    let of_state = nemoral_dataset::fuzz::state(root);
    let of_state = of_state.ok().flatten().map(|(header, _)| header);
    let ours = Dataset::open(root).is_err().then(base_header).flatten();
    let Some(header) = of_state.or(of_manifest).or(ours) else {
        return;
    };
    if let Ok(writer) = Writer::create(root, mode(tasks), header) {
        for (sequence, index) in writer.frames() {
            std::hint::black_box(writer.has_frame(sequence, index, &[0; 32]));
        }
        let _ = writer.finish();
    }
}

fn mode(tasks: Tasks) -> OpenMode {
    if tasks.has(5) {
        OpenMode::Overwrite
    } else {
        OpenMode::Resume
    }
}

/// The header of an unchanged part.
fn base_header() -> Option<nemoral_dataset::DatasetHeader> {
    let json = &SHARDS[0]["dataset.json"];
    serde_json::from_slice(json).ok()
}

fn assert_untouched(root: &Path) {
    let entries = fs::read_dir(root).expect("the folder is there");
    for entry in entries {
        let name = entry.expect("an entry").file_name();
        let known = ["a", "b", "out", "cloud.ply", "canary.txt", "outside"];
        assert!(known.iter().any(|k| name == *k), "{name:?} has appeared");
    }
    for (name, text) in OUTSIDE {
        let found = fs::read_to_string(root.join(name)).unwrap_or_default();
        assert_eq!(found, text, "{name} has changed");
    }
    let outside = files(&root.join("outside"));
    assert_eq!(outside.len(), 2, "{:?}", outside.keys());
}
