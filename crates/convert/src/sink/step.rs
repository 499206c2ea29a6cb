//! What a step of a conversion writes, and the notes that it leaves for later ones.

use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

use nemoral_files::{Folder, InnerPath, PathError, PendingFile};
use serde::de::DeserializeOwned;

use super::records::Record;
use crate::Error;

/// The notes of steps, on disk.
#[derive(Clone, Debug)]
pub struct StepNotes {
    pub(super) folder: Folder,
}

impl StepNotes {
    /// What `make` returned at a step.
    ///
    /// # Errors
    /// [`Error::Files`], and [`Error::Damaged`] if someone has changed it meanwhile.
    pub fn of(&self, key: &str) -> Result<String, Error> {
        let record = Record::read(&self.folder, key)?;
        record.map(|r| r.note).ok_or_else(|| self.changed(key))
    }

    /// The same, read as JSON.
    ///
    /// # Errors
    /// As [`StepNotes::of`], and if it is not what the step returned.
    pub(crate) fn json<T: DeserializeOwned>(&self, key: &str) -> Result<T, Error> {
        serde_json::from_str(&self.of(key)?).map_err(|_| self.changed(key))
    }

    fn changed(&self, key: &str) -> Error {
        Error::Damaged {
            path: self.folder.root().to_owned(),
            cause: format!("the record of step {key} was changed"),
        }
    }
}

/// The files of one step, in memory.
#[derive(Debug, Default)]
pub struct StepFiles {
    files: Vec<(InnerPath, Vec<u8>)>,
    /// What is wrong with the first name that is none.
    refused: Option<PathError>,
}

impl StepFiles {
    /// Adds a file. If `path` is no inner path, the step fails.
    pub fn put(&mut self, path: impl Into<String>, bytes: impl Into<Vec<u8>>) {
        match InnerPath::new(path) {
            Ok(path) => self.files.push((path, bytes.into())),
            Err(e) if self.refused.is_none() => self.refused = Some(e),
            Err(_) => {}
        }
    }

    pub(super) fn all(self) -> Result<Vec<(InnerPath, Vec<u8>)>, Error> {
        match self.refused {
            None => Ok(self.files),
            Some(e) => Err(e.into()),
        }
    }
}

/// A file that is written piece by piece.
pub struct FileStream {
    inner: BufWriter<PendingFile>,
    hasher: blake3::Hasher,
    bytes: u64,
    path: PathBuf,
}

impl std::fmt::Debug for FileStream {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FileStream")
            .field("path", &self.path)
            .finish()
    }
}

impl FileStream {
    /// Begins a file of a folder.
    pub(super) fn begin(folder: &Folder, path: &InnerPath) -> Result<Self, Error> {
        Ok(Self {
            inner: BufWriter::new(folder.begin(path)?),
            hasher: blake3::Hasher::new(),
            bytes: 0,
            path: path.below(folder.root()),
        })
    }

    /// The whole file, which has no name yet, its size and its checksum.
    pub(super) fn end(self) -> Result<(PendingFile, u64, String), Error> {
        let pending = (self.inner.into_inner())
            .map_err(io::IntoInnerError::into_error)
            .map_err(nemoral_files::Error::io(&self.path))?;
        let digest = self.hasher.finalize().to_hex().to_string();
        Ok((pending, self.bytes, digest))
    }

    /// The number of bytes so far.
    #[must_use]
    pub fn position(&self) -> u64 {
        self.bytes
    }

    /// Appends bytes.
    ///
    /// # Errors
    /// [`Error::Files`].
    pub fn put(&mut self, bytes: impl AsRef<[u8]>) -> Result<(), Error> {
        let written = self.write_all(bytes.as_ref());
        Ok(written.map_err(nemoral_files::Error::io(&self.path))?)
    }
}

impl Write for FileStream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.inner.write(bytes)?;
        self.hasher.update(&bytes[..n]);
        self.bytes += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}
