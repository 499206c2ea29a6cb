//! Merging shards into one data set.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::formats::tables::{self, Tables};
use crate::manifest::ranges;
use crate::writer::Drive;
use crate::{
    Dataset, DatasetHeader, Error, FileRecord, Manifest, OpenMode, ProgressMonitor, Writer, layout,
    output::compare,
};

/// How [`merge`] treats its output folder and missing frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MergeParams {
    /// What to do with an output folder that is not empty; [`OpenMode::Resume`] continues a merge
    /// that was killed.
    pub mode: OpenMode,
    /// Whether frames of the sequences may be missing.
    pub partial: bool,
}

/// Unites data sets with equal headers and tracks (the shards of one plan) in a new folder. Its
/// bytes are those of one run that made all frames, if the tables of the shards contain the objects
/// that their frames show. Every byte that is read is verified by its checksum, including those of
/// `dataset.json`; all files except those of frames are verified before anything is written.
///
/// # Errors
/// [`Error::Mismatch`] if headers, tracks, or two copies of a frame differ; [`Error::Incomplete`]
/// if frames are missing and may not be; [`Error::Malformed`] for a damaged or missing file; as
/// [`Writer::create`] for the output folder; [`Error::Io`].
pub fn merge(parts: &[&Path], out: &Path, params: MergeParams) -> Result<Manifest, Error> {
    merge_with_progress(parts, out, params, &ProgressMonitor::default())
}

/// As [`merge`], with news of each frame of each part.
///
/// # Errors
/// As [`merge`], and [`Error::Stopped`], after which [`OpenMode::Resume`] goes on.
pub fn merge_with_progress(
    parts: &[&Path],
    out: &Path,
    params: MergeParams,
    monitor: &ProgressMonitor,
) -> Result<Manifest, Error> {
    let parts = parts
        .iter()
        .map(|p| Dataset::open(p))
        .collect::<Result<Vec<_>, _>>()?;
    let Some(first) = parts.first() else {
        return Err(Error::invalid("parts", "[]", "at least one data set"));
    };
    if parts
        .iter()
        .any(|part| nemoral_files::is_same(part.root(), out))
    {
        return Err(Error::invalid("out", out.display(), "none of the parts"));
    }
    let mut header = first.manifest().header.clone();
    let mut drives: BTreeMap<u32, Drive> = BTreeMap::new();
    // Inertial measurements are compared by their checksums, and read when they are written.
    let mut measured: BTreeMap<u32, (&Dataset, Vec<&FileRecord>)> = BTreeMap::new();
    for part in &parts {
        compare::compare(part.root(), &part.manifest().header, &header)?;
        part.verify_common_files()?;
        for track in &part.manifest().tracks {
            let path = |name| layout::sequence_file(track.sequence, name);
            let drive = Drive {
                length: track.length,
                world_from_frame0: track.world_from_frame0,
                poses: part.read_text(&path(layout::POSES))?,
                estimated: (part.has_estimated_poses(track.sequence))
                    .then(|| part.read_text(&path(layout::ESTIMATED_POSES)))
                    .transpose()?,
                times: part.read_text(&path(layout::TIMES))?,
                balance: track.balance.clone(),
                stands: track.stands,
                lines: track.lines.clone(),
            };
            let imu = part.imu_records(track.sequence);
            let our_imu = measured.entry(track.sequence);
            let (_, our_imu) = our_imu.or_insert_with(|| (part, imu.clone()));
            let ours = drives
                .entry(track.sequence)
                .or_insert_with(|| drive.clone());
            if *ours != drive || *our_imu != imu {
                return Err(Error::Mismatch {
                    path: part.root().to_owned(),
                    field: format!("track of sequence {}", track.sequence),
                    found: format!("{} frames", drive.length),
                    asked: format!(
                        "{} frames with other poses, estimates, times or inertial measurements",
                        ours.length
                    ),
                });
            }
        }
    }
    // All headers are equal, so every part has all of them.
    let inputs: Vec<_> = header.inputs().into_values().cloned().collect();
    for file in inputs {
        let bytes = file.read(first.folder())?;
        header.input_files.insert(file.path, bytes.into());
    }
    if !params.partial {
        refuse_gaps(&parts, &header, &drives)?;
    }
    // Tables are read twice, so that those that contradict each other are refused before anything
    // is written, and that those of one sequence are in memory at a time.
    for &sequence in drives.keys() {
        tables_of(&parts, sequence)?;
    }
    let writer = Writer::create(out, params.mode, header)?;
    let total = parts.iter().map(|part| part.frames().len()).sum();
    let frames = parts
        .iter()
        .flat_map(|part| part.frames().iter().map(move |f| (part, f)));
    for (i, (part, record)) in frames.enumerate() {
        writer.adopt(part, record)?;
        monitor.done(i + 1, total, record)?;
    }
    for (&sequence, drive) in &drives {
        let tables = tables_of(&parts, sequence)?;
        let spec = writer.header().sequence(sequence);
        let spec = spec.expect("a manifest's tracks are of sequences");
        let imu = measured[&sequence].0.imu_files(sequence)?;
        let config = config_of(&parts, sequence)?;
        writer.put_sequence(spec, &config, drive, &tables, imu.as_ref())?;
    }
    writer.finish()
}

/// The config of a sequence, which is for human readers and not compared: that of the first part
/// with frames of it.
fn config_of(parts: &[Dataset], sequence: u32) -> Result<String, Error> {
    let mut parts = parts.iter().filter(|p| p.track(sequence).is_ok());
    let first = parts.next();
    first.map_or(Ok(String::new()), |p| p.sequence_config(sequence))
}

/// The united tables of a sequence.
fn tables_of(parts: &[Dataset], sequence: u32) -> Result<Tables, Error> {
    let mut all = Tables::default();
    for part in parts.iter().filter(|p| p.track(sequence).is_ok()) {
        for row in part.tree_rows(sequence)?.into_values() {
            tables::insert(&mut all.trees, "trees", row)?;
        }
        for row in part.object_rows(sequence)?.into_values() {
            tables::insert(&mut all.objects, "instances", row)?;
        }
        for row in part.deadwood_rows(sequence)?.into_values() {
            tables::insert(&mut all.deadwood, "deadwood", row)?;
        }
    }
    Ok(all)
}

/// Refuses parts that do not have all frames of all sequences.
fn refuse_gaps(
    parts: &[Dataset],
    header: &DatasetHeader,
    drives: &BTreeMap<u32, Drive>,
) -> Result<(), Error> {
    if let Some(none) = (header.sequences.iter()).find(|s| !drives.contains_key(&s.number)) {
        return Err(Error::Incomplete {
            sequence: none.number,
            missing: "any of its frames".to_owned(),
        });
    }
    for (&sequence, drive) in drives {
        let frames = parts.iter().flat_map(Dataset::frames);
        let there: BTreeSet<u64> = frames
            .filter(|f| f.sequence == sequence)
            .map(|f| f.index)
            .collect();
        let mut missing = Vec::new();
        let mut next = 0;
        for [from, to] in ranges(there).into_iter().chain([[drive.length; 2]]) {
            if next < from {
                missing.push(format!("{next}..{from}"));
            }
            next = to;
        }
        if !missing.is_empty() {
            const SHOWN: usize = 8;
            let more = missing.len().saturating_sub(SHOWN);
            missing.truncate(SHOWN);
            let and = if more > 0 {
                format!(" and {more} more ranges")
            } else {
                String::new()
            };
            return Err(Error::Incomplete {
                sequence,
                missing: format!("frames {}{and} of its {}", missing.join(", "), drive.length),
            });
        }
    }
    Ok(())
}
