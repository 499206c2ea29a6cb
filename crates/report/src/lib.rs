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
//! - The size is bounded: at most [`MAX_WHOLE_FRAMES`] frames have all their maps and a thinned
//!   scan, at most [`MAX_THUMBNAILS`] frames have a thumbnail, and at most [`MAX_TREES`] trees are
//!   on the maps.
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
//! # let track = Track { sequence: 0, poses: vec![(0.0, mount)], balance: None };
//! # writer.write_sequence(&track, &WorldTables::default())?;
//! # writer.finish()?;
//! let made = nemoral_report::report(dataset, page)?;
//! assert_eq!(made.frames, 1);
//! # Ok(())
//! # }
//! ```

mod error;
mod maps;
mod page;
mod scans;
mod summary;
mod warnings;

use std::path::Path;

use nemoral_dataset::Dataset;
use nemoral_files::Folder;

pub use error::Error;

/// The most frames that are on the page with all their maps.
pub const MAX_WHOLE_FRAMES: usize = 24;
/// The most frames that have a thumbnail.
pub const MAX_THUMBNAILS: usize = 1000;
/// The most trees on the maps, over all sequences.
pub const MAX_TREES: usize = 60_000;

/// What was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Made {
    /// Frames of the data set.
    pub frames: usize,
    /// Size of the page.
    pub bytes: usize,
}

/// Writes the page of a data set to the file `out`, which appears when it is whole.
///
/// # Errors
/// [`Error::Name`] and [`Error::Inside`] for a name that cannot be used; [`Error::Dataset`] and
/// [`Error::Files`], naming the file.
pub fn report(dataset: &Path, out: &Path) -> Result<Made, Error> {
    let is_page = |e: &std::ffi::OsStr| e.eq_ignore_ascii_case("html");
    if !out.extension().is_some_and(is_page) {
        return Err(Error::Name {
            path: out.to_owned(),
        });
    }
    let source = Dataset::open(dataset)?;
    if Folder::new(dataset).inner_path_of(out).is_some() {
        return Err(Error::Inside {
            path: out.to_owned(),
        });
    }
    let page = page::page(&source)?;
    nemoral_files::write(out, page.as_bytes())?;
    Ok(Made {
        frames: source.frames().len(),
        bytes: page.len(),
    })
}

/// At most `most` of `count` things, evenly spread, the first and the last among them.
fn spread(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    (0..most).map(|i| i * (count - 1) / (most - 1)).collect()
}

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn what_is_shown_is_spread_evenly() {
        assert_eq!(spread(3, 24), [0, 1, 2]);
        assert_eq!(spread(101, 3), [0, 50, 100]);
        let some = spread(1000, 24);
        assert_eq!((some.len(), some[0], some[23]), (24, 0, 999));
        assert!(some.windows(2).all(|w| (43..=44).contains(&(w[1] - w[0]))));
    }
}
