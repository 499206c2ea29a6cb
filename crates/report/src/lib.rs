//! This crate makes one self-contained HTML page that shows what a data set holds.
//!
//! The page has frames with a slider between two maps, scans to turn, shares of classes, the
//! inventory, a map of each drive and its trees, what differs between sequences, provenance, and
//! warnings. It opens from disk, needs no network and asks for nothing: a content security policy
//! forbids it.
//!
//! # Promises
//! - Equal data sets in folders of equal names give equal bytes.
//! - Every file that is read is compared with its checksum; a damaged one is an error, and no page
//!   is written.
//! - A page has at most [`MAX_PAGE_BYTES`], unless the table of sequences and the config alone are
//!   larger, which are there whatever their size. At most [`MAX_WHOLE_FRAMES`] frames have all
//!   their maps and a thinned scan, and at most [`MAX_THUMBNAILS`] others have a thumbnail; fewer,
//!   if they do not fit. At most [`MAX_TREES`] trees and [`MAX_PLACES`] frames are on the maps, and
//!   at most [`MAX_SPECIES`] species are named.
//! - Names and texts of a data set are data on the page, never markup.
//!
//! # Example
//! ```
//! # use nemoral_dataset::*;
//! # use nemoral_scene::{ChunkCoord, Ontology, RigidTransform, Twist};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let dataset = &folder.path().join("dataset");
//! # let page = &folder.path().join("report.html");
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
//! let made = nemoral_report::report(dataset, page)?;
//! assert_eq!(made.frames, 1);
//! # Ok(())
//! # }
//! ```

mod budget;
mod error;
mod maps;
mod page;
mod scans;
mod species;
mod summary;
mod warnings;

use std::path::Path;

use nemoral_dataset::Dataset;
use nemoral_files::Folder;

pub use error::Error;

/// The most bytes of a page, unless what has no bound of its own is larger.
pub const MAX_PAGE_BYTES: usize = 50_000_000;
/// The most frames that are on the page with all their maps.
pub const MAX_WHOLE_FRAMES: usize = 24;
/// The most frames that have a thumbnail besides those that have all their maps.
pub const MAX_THUMBNAILS: usize = 1000;
/// The most trees on the maps, over all sequences.
pub const MAX_TREES: usize = 60_000;
/// The most frames whose places are on the maps.
pub const MAX_PLACES: usize = 50_000;
/// The most species that are named: those with the most trees.
pub const MAX_SPECIES: usize = 200;

/// How much is on a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageStats {
    /// Frames of the data set.
    pub frames: usize,
    /// Frames that are on the page with all their maps.
    pub whole_frames: usize,
    /// Size of the page.
    pub bytes: usize,
}

/// Writes the page of a data set to the file `out`, which appears when it is whole. It has at most
/// [`MAX_PAGE_BYTES`], with the exception of [`report_within`].
///
/// # Errors
/// [`Error::Name`] and [`Error::Inside`] for a name that cannot be used; [`Error::Dataset`] and
/// [`Error::Files`], naming the file.
pub fn report(dataset: &Path, out: &Path) -> Result<PageStats, Error> {
    report_within(dataset, out, MAX_PAGE_BYTES)
}

/// Like [`report`], with another bound on the page's size: frames with all their maps are taken in
/// an order that spreads over the data set, until the next one would not fit. Thumbnails take at
/// most a quarter of `max_bytes`.
///
/// A page without frames is about 1 MB large, and more with many trees and sequences. It is written
/// even if `max_bytes` is less.
///
/// # Errors
/// Those of [`report`].
pub fn report_within(dataset: &Path, out: &Path, max_bytes: usize) -> Result<PageStats, Error> {
    let is_page = |e: &std::ffi::OsStr| e.eq_ignore_ascii_case("html");
    if !out.extension().is_some_and(is_page) {
        return Err(Error::Name {
            path: out.to_owned(),
        });
    }
    let source = Dataset::open(dataset)?;
    if Folder::new(dataset).contains(out) {
        return Err(Error::Inside {
            path: out.to_owned(),
        });
    }
    let (page, whole_frames) = page::page(&source, max_bytes)?;
    nemoral_files::write(out, page.as_bytes())?;
    Ok(PageStats {
        frames: source.frames().len(),
        whole_frames,
        bytes: page.len(),
    })
}

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
