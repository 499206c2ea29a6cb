//! Writing.
use crate::*;
use std::path::Path;

/// What to do with an output folder that holds something.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OpenMode {
    /// The folder must be new or empty.
    #[default]
    Fresh,
    /// Go on with the data set in it, if it was made with an equal header; like `Fresh` if the
    /// folder is new or empty.
    Resume,
    /// Remove the data set in it first, and nothing else; like `Fresh` if the folder is new or empty.
    Overwrite,
}

/// Writes a data set.
#[derive(Debug)]
pub struct Writer {}

impl Writer {
    /// Opens an output folder.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn create(_out: &Path, _mode: OpenMode, _header: DatasetHeader) -> Result<Self, Error> {
        todo!()
    }
    /// Is this frame here, whole, and made from the same key? Reads and checksums its files.
    #[must_use]
    pub fn has_frame(&self, _sequence: u32, _index: u64, _frame_key: &[u8; 32]) -> bool {
        todo!()
    }
    /// The frames that are recorded so far, by sequence and index, of earlier runs too: the world
    /// tables given to `finish` must cover all of them.
    #[must_use]
    pub fn frames(&self) -> Vec<(u32, u64)> {
        todo!()
    }
    /// Writes a frame; callable from several threads at once.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn write_frame(&self, _frame: &FrameData<'_>) -> Result<FrameRecord, Error> {
        todo!()
    }
    /// Writes what belongs to no frame, last of all `dataset.json`.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn finish(self, _world: &WorldTables<'_>, _tracks: &[Track]) -> Result<Manifest, Error> {
        todo!()
    }
}
