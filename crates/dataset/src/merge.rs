//! Shards into one data set.

use std::collections::BTreeMap;
use std::path::Path;

use crate::writer::Drive;
use crate::{Dataset, Error, Manifest, OpenMode, Writer, csv, folder, layout};

/// Unites data sets with equal headers and tracks (the shards of one plan) in a new folder, whose
/// bytes are those of one run that made all frames, if the shards' tables hold what their frames
/// show. Checksums are verified on the way.
///
/// # Errors
/// [`Error::Mismatch`] if headers, tracks, or two copies of a frame differ; [`Error::Malformed`]
/// for a damaged file; as [`Writer::create`] for the output folder; [`Error::Io`].
pub fn merge(parts: &[&Path], out: &Path, mode: OpenMode) -> Result<Manifest, Error> {
    let parts = parts
        .iter()
        .map(|p| Dataset::open(p))
        .collect::<Result<Vec<_>, _>>()?;
    let Some(first) = parts.first() else {
        return Err(Error::invalid("parts", "[]", "at least one data set"));
    };
    let same = |part: &Dataset| {
        let real = std::fs::canonicalize;
        matches!((real(part.root()), real(out)), (Ok(a), Ok(b)) if a == b)
    };
    if parts.iter().any(same) {
        return Err(Error::invalid("out", out.display(), "none of the parts"));
    }
    let header = first.manifest().header.clone();
    let (mut trees, mut objects) = (csv::Rows::new(), csv::Rows::new());
    let mut drives: BTreeMap<u32, Drive> = BTreeMap::new();
    for part in &parts {
        folder::compare(part.root(), &part.manifest().header, &header)?;
        for row in part.tree_rows()?.into_values() {
            csv::insert(&mut trees, "trees", row)?;
        }
        for row in part.object_rows()?.into_values() {
            csv::insert(&mut objects, "instances", row)?;
        }
        for sequence in &part.manifest().sequences {
            let folder = layout::sequence(sequence.number);
            let drive = Drive {
                length: sequence.length,
                world_from_frame0: sequence.world_from_frame0,
                poses: part.read_text(&format!("{folder}/{}", layout::POSES))?,
                times: part.read_text(&format!("{folder}/{}", layout::TIMES))?,
            };
            let ours = drives
                .entry(sequence.number)
                .or_insert_with(|| drive.clone());
            if *ours != drive {
                return Err(Error::Mismatch {
                    path: part.root().to_owned(),
                    field: format!("track of sequence {}", sequence.number),
                    found: format!("{} frames", drive.length),
                    asked: format!("{} frames with other poses or times", ours.length),
                });
            }
        }
    }
    let writer = Writer::create(out, mode, header)?;
    for part in &parts {
        for record in part.frames() {
            writer.adopt(part.root(), record)?;
        }
    }
    writer.conclude(&trees, &objects, &drives)
}
