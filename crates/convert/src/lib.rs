//! This crate converts finished data sets to other people's formats.
//!
//! A [`Format`] reads a [`Source`] (sequences, their sensors, their frames) and writes through a
//! [`Sink`]. [`FormatName`] lists the formats that there are.
//!
//! # Promises
//! - One frame is in memory at a time (two where a format is about pairs of frames), and what a
//!   format has to collect over all frames waits on disk.
//! - Equal data sets give equal bytes.
//! - Every file of the data set that is read is compared with its checksum. A damaged one is an
//!   error, and no file of its frame is written.
//! - A file appears under its final name only when it is whole. A conversion that was killed goes
//!   on with [`OutputMode::Resume`] and ends with the same bytes. `conversion.json`, which is
//!   written last, says what was converted and lists all files with their checksums.
//! - A folder with other people's files is refused; [`OutputMode::Overwrite`] removes what a
//!   conversion has written, and nothing else: a file that was changed since is an error.
//!
//! # Example
//! ```
//! use nemoral_convert::{ConvertParams, FormatName, convert};
//! # use nemoral_dataset::*;
//! # use nemoral_scene::{ChunkCoord, Ontology, RigidTransform, Twist};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let dataset = &folder.path().join("dataset");
//! # let out = &folder.path().join("out");
//! # let mount = RigidTransform::IDENTITY;
//! # let mut header = DatasetHeader::new("nemoral", "0.1.0", 7, Ontology::paper());
//! # header.sequences[0].lidars = vec![LidarSpec {
//! #     name: "top".into(),
//! #     body_from_lidar: mount,
//! #     deskewed: true,
//! #     pointing_errors: false,
//! #     ply: true,
//! # }];
//! # let writer = Writer::create(dataset, OpenMode::Fresh, header)?;
//! # writer.write_frame(&FrameData {
//! #     sequence: 0,
//! #     index: 0,
//! #     time_s: 0.0,
//! #     world_from_body: mount,
//! #     body_motion: Twist::STILL,
//! #     balance: None,
//! #     cameras: vec![],
//! #     lidars: vec![LidarData { name: "top", points: &[], sensor_chunk: ChunkCoord::new(0, 0) }],
//! #     frame_key: [0; 32],
//! # })?;
//! # let (poses, estimated, lines) = (vec![(0.0, mount)], vec![], vec![]);
//! # let (balance, imu, stands) = (None, None, false);
//! # let track = Track { sequence: 0, poses, estimated, balance, stands, lines, imu };
//! # writer.write_sequence(&track, &WorldTables::default())?;
//! # writer.finish()?;
//! let done = convert(dataset, out, &ConvertParams::new(FormatName::Kitti))?;
//! assert_eq!(done.frames, 1);
//! assert!(out.join("poses/00.txt").exists());
//! # Ok(())
//! # }
//! ```

mod cloud;
mod crs;
mod error;
mod formats;
mod geometry;
mod labels;
mod png_encoding;
mod rle;
mod sink;
mod source;
mod table;

use std::path::Path;

use nemoral_dataset::{DatasetHeader, FORMAT_VERSION, Manifest, ProgressMonitor};
use nemoral_files::Folder;

pub use cloud::{LazCloudParams, LazTile, laz_cloud, laz_note};
pub use crs::Crs;
pub use error::Error;
pub use formats::FormatName;
pub use sink::{FileStream, OutputMode, Sink, StepFiles, StepNotes};
pub use source::{FrameRef, Sequence, Source};
pub use table::{ClassMapping, MappedClass};

/// Raise it when the files of any format change, so that an older conversion is not resumed.
const LAYOUT: u32 = 7;

/// A format that data sets can be written in.
pub trait Format {
    /// Writes all files. Everything that it writes must be a function of the source and of the
    /// format's own options.
    ///
    /// # Errors
    /// Of reading and of writing.
    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error>;

    /// Refuses a data set that lacks what the format needs, before anything is written. One that
    /// is still to be made has no frames yet.
    ///
    /// # Errors
    /// [`Error::Unsuitable`] and [`Error::Ontology`], saying what is needed.
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        let _ = manifest;
        Ok(())
    }

    /// What the user should know of a data set in this format: what its readers may take otherwise
    /// than they expect. Each note is a sentence without a full stop.
    fn notes(&self, manifest: &Manifest) -> Vec<String> {
        let _ = manifest;
        Vec::new()
    }
}

/// What is asked for.
#[derive(Clone, Debug)]
pub struct ConvertParams {
    /// The format.
    pub format: FormatName,
    /// The classes to write in place of the data set's own, or in place of the format's.
    pub ontology: Option<ClassMapping>,
    /// The fewest visible pixels of an object that is listed in a picture; 0 lists all. Only
    /// formats that list objects by their pixels take another ([`FormatName::takes_min_px`]).
    pub min_px: u32,
    /// What to do with a folder that holds a conversion.
    pub mode: OutputMode,
}

impl ConvertParams {
    /// A conversion into a new folder, with the format's own classes and all objects.
    #[must_use]
    pub fn new(format: FormatName) -> Self {
        Self {
            format,
            ontology: None,
            min_px: 0,
            mode: OutputMode::Fresh,
        }
    }
}

/// What a conversion holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConversionSummary {
    /// Frames of the data set.
    pub frames: usize,
    /// Files that were written, except `conversion.json`.
    pub files: usize,
    /// Their size.
    pub bytes: u64,
    /// What the user should know of it, each a sentence without a full stop ([`Format::notes`]).
    pub notes: Vec<String>,
}

/// Converts the data set in a folder.
///
/// # Errors
/// [`Error::Unsuitable`] and [`Error::Ontology`] if the format cannot hold the data set;
/// [`Error::Inside`], [`Error::Foreign`], [`Error::Exists`], [`Error::Mismatch`],
/// [`Error::Changed`] and [`Error::Damaged`] for a folder that cannot be used; [`Error::Name`];
/// [`Error::Dataset`] and [`Error::Files`], naming the file.
pub fn convert(
    dataset: &Path,
    out: &Path,
    params: &ConvertParams,
) -> Result<ConversionSummary, Error> {
    convert_with_progress(dataset, out, params, &ProgressMonitor::default())
}

/// As [`convert()`], with news of each frame whose files are read (those that were written before
/// are not), and of the last one.
///
/// # Errors
/// As [`convert()`], and [`nemoral_dataset::Error::Stopped`], after which [`OutputMode::Resume`]
/// goes on.
pub fn convert_with_progress(
    dataset: &Path,
    out: &Path,
    params: &ConvertParams,
    monitor: &ProgressMonitor,
) -> Result<ConversionSummary, Error> {
    let source = Source::open(dataset)?.with_progress(monitor.clone());
    apart(dataset, out)?;
    let format = suitable(source.manifest(), params)?;
    let request = request(&source.manifest().header, source.digest(), params);
    let frames = source.frame_count();
    let notes = format.notes(source.manifest());
    let converted = |files: usize, bytes| ConversionSummary {
        frames,
        files,
        bytes,
        notes,
    };
    match Sink::open(out, params.mode, request)? {
        sink::OpenOutcome::Finished { files, bytes } => {
            source.finish()?;
            Ok(converted(files, bytes))
        }
        sink::OpenOutcome::Ready(mut sink) => {
            format.write(&source, &mut sink)?;
            source.finish()?;
            let (files, bytes) = sink.finish()?;
            Ok(converted(files, bytes))
        }
    }
}

/// Refuses a data set that is still to be made if the format cannot hold it.
///
/// # Errors
/// [`Error::Unsuitable`] and [`Error::Ontology`].
pub fn check_header(header: &DatasetHeader, params: &ConvertParams) -> Result<(), Error> {
    let manifest = Manifest {
        format_version: FORMAT_VERSION,
        header: header.clone(),
        tracks: vec![],
        files: vec![],
        frames: vec![],
    };
    suitable(&manifest, params).map(drop)
}

/// Refuses an output folder that [`convert()`] will refuse for a data set with this header, which
/// need not exist yet.
///
/// # Errors
/// Those of [`convert()`] about the folder.
pub fn check_folder(
    dataset: &Path,
    out: &Path,
    header: &DatasetHeader,
    params: &ConvertParams,
) -> Result<(), Error> {
    apart(dataset, out)?;
    Sink::probe(out, params.mode, &request(header, "", params))
}

/// What decides the bytes of a conversion; `source` is the digest of `dataset.json`.
fn request(header: &DatasetHeader, source: &str, params: &ConvertParams) -> sink::Request {
    let table = params.ontology.as_ref();
    sink::Request {
        converter: format!(
            "nemoral-convert {} layout {LAYOUT}",
            env!("CARGO_PKG_VERSION")
        ),
        format: params.format.name().to_owned(),
        data_set: Some(identity(header)),
        source: source.to_owned(),
        ontology: table.map(|t| digest(t.text().as_bytes())),
        min_px: params.min_px,
    }
}

/// The digest of what a data set keeps when it gets further frames and sequences.
fn identity(header: &DatasetHeader) -> String {
    let mut header = header.clone();
    header.sequences.truncate(1);
    let json = serde_json::to_vec(&header);
    digest(&json.expect("a header has string keys"))
}

/// Refuses an output folder in the data set's own.
fn apart(dataset: &Path, out: &Path) -> Result<(), Error> {
    if Folder::new(dataset).contains(out) {
        return Err(Error::Inside {
            path: out.to_owned(),
        });
    }
    Ok(())
}

/// The format, if it can hold the data set.
fn suitable(manifest: &Manifest, params: &ConvertParams) -> Result<Box<dyn Format>, Error> {
    if params.ontology.is_some() && !params.format.takes_ontology() {
        return Err(Error::Unsuitable {
            format: params.format.name(),
            reason: "it has no place for the classes of a table; leave the table out".to_owned(),
        });
    }
    if params.min_px > 0 && !params.format.takes_min_px() {
        let takers = FormatName::ALL.into_iter().filter(|f| f.takes_min_px());
        let takers: Vec<_> = takers.map(FormatName::name).collect();
        return Err(Error::Unsuitable {
            format: params.format.name(),
            reason: format!(
                "min_px = {}: must be 0, as it lists no objects by their pixels; {} do",
                params.min_px,
                takers.join(" and ")
            ),
        });
    }
    let format = params.format.with(params.ontology.clone(), params.min_px);
    format.check(manifest)?;
    Ok(format)
}

/// BLAKE3, hexadecimal.
fn digest(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
