//! Reading data sets.

mod frame;
mod sequence;

use std::path::Path;

use nemoral_files::{Folder, InnerPath};

pub use self::frame::{CameraFrame, Frame, LidarFrame};

use crate::{Error, FileRecord, FrameRecord, Manifest, SequenceSpec, TrackRecord, layout};

/// A finished data set on disk. Every file that is read is compared with its size and checksum in
/// `dataset.json`, and pictures with the sizes of their cameras before they are unpacked.
#[derive(Clone, Debug)]
pub struct Dataset {
    folder: Folder,
    manifest: Manifest,
    /// Whether `dataset.json` is unchanged since it was written.
    is_untouched: bool,
    digest: String,
}

/// The message about a `dataset.json` that was changed.
pub(crate) const CHANGED: &str = "was changed after it was written: its checksum differs";

impl Dataset {
    /// Opens a finished data set.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder cannot be read, [`Error::Malformed`] if it holds no data set, an
    /// unfinished one, one of another format version, or one whose `dataset.json` is not valid.
    pub fn open(dir: &Path) -> Result<Self, Error> {
        let folder = Folder::new(dir);
        if folder.kind(&layout::inner(layout::MANIFEST))?.is_none() {
            let entries = folder.entries()?;
            let message = if entries.iter().any(|e| e.name == layout::STATE) {
                "holds an unfinished data set: resume what was writing it"
            } else if !dir.is_dir() {
                "there is no such folder"
            } else {
                "holds no data set: there is no dataset.json"
            };
            return Err(Error::malformed(dir, message));
        }
        let file = Manifest::read(&folder)?;
        let mut dataset = Self {
            folder,
            manifest: file.manifest,
            is_untouched: file.is_untouched,
            digest: file.digest,
        };
        // It is for human readers only; `check` reports what is wrong with it. Those of sequences
        // may be too many for memory.
        let config = dataset.read_text(layout::CONFIG);
        dataset.manifest.header.config_toml = config.unwrap_or_default();
        Ok(dataset)
    }

    /// The folder.
    #[must_use]
    pub fn root(&self) -> &Path {
        self.folder.root()
    }

    /// Whether `dataset.json` is unchanged since it was written. A data set whose `dataset.json`
    /// was changed on purpose can still be read, but not merged.
    #[must_use]
    pub fn is_untouched(&self) -> bool {
        self.is_untouched
    }

    /// BLAKE3 of `dataset.json` as it was opened, hexadecimal. It has the checksums of all files.
    #[must_use]
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// Whether this path leads to a file of the data set, or to a place where only its files may
    /// be.
    pub(crate) fn owns(&self, path: &Path) -> bool {
        let Some(inner) = self.folder.inner_path_of(path) else {
            // A name that no data set has may still lie in one of its folders.
            return self.folder.contains(path);
        };
        let own = [
            layout::SEQUENCES,
            layout::ALL_POSES,
            layout::INPUTS,
            layout::STATE,
            layout::MANIFEST,
        ];
        own.contains(&inner.components().next().unwrap_or_default())
            || self.manifest.files.iter().any(|f| f.path == inner)
    }

    pub(crate) fn folder(&self) -> &Folder {
        &self.folder
    }

    /// Compares `dataset.json`, and all files that belong to no frame, with their checksums.
    pub(crate) fn verify_common_files(&self) -> Result<(), Error> {
        if !self.is_untouched {
            let path = self.root().join(layout::MANIFEST);
            return Err(Error::malformed(path, CHANGED));
        }
        for file in &self.manifest.files {
            file.read(&self.folder)?;
        }
        Ok(())
    }

    /// `dataset.json`.
    #[must_use]
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The frames that exist here, by sequence and index.
    #[must_use]
    pub fn frames(&self) -> &[FrameRecord] {
        &self.manifest.frames
    }

    fn load_text<T>(
        &self,
        path: &str,
        decode: impl Fn(&Path, &str) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let record = recorded(&self.manifest.files, layout::inner(path))?;
        decode(
            &record.path.below(self.root()),
            &record.read_text(&self.folder)?,
        )
    }

    /// The sequence of a frame of this data set.
    ///
    /// # Panics
    /// If the frame is another data set's, whose sequence this one does not have.
    #[must_use]
    pub fn sequence_of(&self, frame: &FrameRecord) -> &SequenceSpec {
        let sequence = self.manifest.header.sequence(frame.sequence);
        sequence.expect("a manifest's frames are of its sequences")
    }

    /// The record of a sequence's drive.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is no such sequence here.
    pub fn track(&self, sequence: u32) -> Result<&TrackRecord, Error> {
        let tracks = &self.manifest.tracks;
        let at = tracks.binary_search_by_key(&sequence, |t| t.sequence);
        at.map(|i| &tracks[i])
            .map_err(|_| Error::invalid("sequence", sequence, "one with frames here"))
    }

    pub(crate) fn read_text(&self, relative: &str) -> Result<String, Error> {
        self.load_text(relative, |_, text| Ok(text.to_owned()))
    }
}

/// The record of a file; a manifest lists all files of the layout, by path.
fn recorded(files: &[FileRecord], path: InnerPath) -> Result<&FileRecord, Error> {
    files
        .binary_search_by(|f| f.path.cmp(&path))
        .map(|i| &files[i])
        .map_err(|_| Error::invalid("file", path, "one that dataset.json lists"))
}
