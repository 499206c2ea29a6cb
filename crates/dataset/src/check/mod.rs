//! Checks whether a data set is right, from its files alone.

mod agreement;
mod annotations;
mod drive;
mod frames;
mod imu;
mod splits;
mod tables;

use std::collections::BTreeSet;
use std::fmt;
use std::path::Path;

use nemoral_files::{EntryKind, InnerPath};

pub use self::agreement::{Agreement, ClassAgreement, JudgedAgreement, Residual};

use self::agreement::ClassGroups;
use self::splits::SplitTrees;
use crate::formats::ontology_yaml;
use crate::{Dataset, Error, FileRecord, ProgressMonitor, layout, output, reader};

/// Something wrong with a data set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The file, below the data set's folder.
    pub path: String,
    /// What is wrong.
    pub message: String,
}

/// What [`check`] found.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckReport {
    /// Everything wrong with files, ids and poses.
    pub problems: Vec<Problem>,
    /// Frames listed.
    pub frames: usize,
    /// Files listed.
    pub files: usize,
    /// Their size.
    pub bytes: u64,
    /// The agreement of LiDAR and camera.
    pub agreement: Agreement,
}

impl CheckReport {
    /// Whether the data set is right.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.problems.is_empty() && self.agreement.failures().is_empty()
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} frames, {} files, {} bytes",
            self.frames, self.files, self.bytes
        )?;
        write!(f, "{}", self.agreement)?;
        for p in &self.problems {
            writeln!(f, "problem: {}: {}", p.path, p.message)?;
        }
        for failure in self.agreement.failures() {
            writeln!(f, "problem: agreement: {failure}")?;
        }
        writeln!(f, "{}", if self.passed() { "passed" } else { "FAILED" })
    }
}

/// Checks a data set from its files alone: structure, sizes, checksums; ids against
/// `instances.csv` and the class table; poses, calibration and inertial measurements against
/// `dataset.json` and each other; that splits have no seed and no tree in common; and the agreement
/// of LiDAR and camera.
///
/// # Errors
/// If the folder holds no finished data set. Whatever is wrong with a finished one is in the
/// report.
pub fn check(dir: &Path) -> Result<CheckReport, Error> {
    check_with_progress(dir, &ProgressMonitor::default())
}

/// As [`check`], with news of each frame.
///
/// # Errors
/// As [`check`], and [`Error::Stopped`].
pub fn check_with_progress(dir: &Path, monitor: &ProgressMonitor) -> Result<CheckReport, Error> {
    let dataset = Dataset::open(dir)?;
    let manifest = dataset.manifest();
    let files = || {
        let of_frames = manifest.frames.iter().flat_map(|f| &f.files);
        manifest.files.iter().chain(of_frames)
    };
    let mut checker = Checker {
        dataset: &dataset,
        monitor,
        problems: Vec::new(),
        split_trees: SplitTrees::default(),
        class_groups: ClassGroups::of(&manifest.header.ontology),
        agreement: Agreement::new(
            &manifest.header.ontology,
            (manifest.header.sequences.iter())
                .flat_map(|s| &s.lidars)
                .all(crate::LidarSpec::well_placed),
        ),
    };
    if !dataset.is_untouched() {
        checker.problem(layout::MANIFEST, reader::CHANGED);
    }
    checker.strangers()?;
    for file in &manifest.files {
        checker.verified(std::slice::from_ref(file));
    }
    checker.ontology();
    for message in splits::common_sources(&manifest.header) {
        checker.problem(layout::MANIFEST, message);
    }
    for track in &manifest.tracks {
        let inventory = checker.inventory(track.sequence);
        if let Some(drive) = checker.drive(track) {
            checker.imu(track, &drive);
            checker.frames(track.sequence, &drive, &inventory)?;
        }
    }
    Ok(CheckReport {
        problems: checker.problems,
        frames: manifest.frames.len(),
        files: files().count(),
        bytes: files().map(|f| f.bytes).sum(),
        agreement: checker.agreement,
    })
}

struct Checker<'a> {
    dataset: &'a Dataset,
    monitor: &'a ProgressMonitor,
    problems: Vec<Problem>,
    split_trees: SplitTrees,
    class_groups: ClassGroups,
    agreement: Agreement,
}

impl Checker<'_> {
    fn problem(&mut self, path: impl ToString, message: impl ToString) {
        self.problems.push(Problem {
            path: path.to_string(),
            message: message.to_string(),
        });
    }

    /// Records a failed read as a problem, unless the checksum has shown it already.
    fn read<T>(&mut self, path: &str, result: Result<T, Error>) -> Option<T> {
        let has_told = self.problems.iter().any(|p| p.path == path);
        let mut problem = |e: Error| {
            if !has_told {
                self.problem(path, e.without_path());
            }
        };
        result.map_err(&mut problem).ok()
    }

    /// Looks for files that are not listed where only listed ones may be.
    fn strangers(&mut self) -> Result<(), Error> {
        let manifest = self.dataset.manifest();
        let listed: BTreeSet<&InnerPath> = manifest
            .files
            .iter()
            .chain(manifest.frames.iter().flat_map(|f| &f.files))
            .map(|f| &f.path)
            .collect();
        let folder = self.dataset.folder();
        for path in output::owned_files(folder, &manifest.header)? {
            if !listed.contains(&path) {
                self.problem(path, "belongs to no frame of dataset.json");
            }
        }
        // Other files may stay in the folder of a writer that has ended: NFS keeps a removed file
        // that is open, as the lock is, under another name.
        let state = folder.kind(&layout::inner(layout::STATE))?;
        let is_written = match state {
            Some(EntryKind::Folder) => {
                let header = layout::inner(layout::STATE_HEADER);
                folder.kind(&header)?.is_some()
            }
            state => state.is_some(),
        };
        if is_written {
            self.problem(
                layout::STATE,
                "the data set is being written, or its writer was killed",
            );
        }
        Ok(())
    }

    /// Compares files with their records and reports those that differ.
    fn verified(&mut self, files: &[FileRecord]) -> bool {
        let mut sound = true;
        for file in files {
            if let Err(e) = file.read(self.dataset.folder()) {
                sound = false;
                self.problem(&file.path, e.without_path());
            }
        }
        sound
    }

    /// Checks `ontology.yaml`.
    fn ontology(&mut self) {
        let manifest = self.dataset.manifest();
        let yaml = ontology_yaml::encode(&manifest.header, &manifest.point_classes());
        let found = self.dataset.read_text(layout::ONTOLOGY);
        if self
            .read(layout::ONTOLOGY, found)
            .is_some_and(|found| found != yaml)
        {
            self.problem(
                layout::ONTOLOGY,
                "differs from the class table in dataset.json",
            );
        }
    }
}
