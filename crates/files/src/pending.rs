//! Files that appear whole or not at all.

use std::fs::{self, File};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::{NamedTempFile, TempPath};

use crate::{Error, operation, read};

const PREFIX: &str = ".nemoral-";
const SUFFIX: &str = ".tmp";

/// Whether this is the name of a temporary file of this crate, which a killed process has left
/// behind.
#[must_use]
pub fn is_temporary_name(name: &str) -> bool {
    name.starts_with(PREFIX) && name.ends_with(SUFFIX)
}

/// A file that is being written under a temporary name, in the folder of its final name. If it is
/// dropped before [`PendingFile::commit`], the file is removed.
#[derive(Debug)]
pub struct PendingFile {
    file: File,
    temporary: TempPath,
    target: PathBuf,
}

impl PendingFile {
    /// Begins a file of the user's name; its folder must exist.
    ///
    /// # Errors
    /// [`Error::NotRegular`] if something that is no regular file bears the name (a folder, a
    /// device), and [`Error::Io`].
    pub fn create(target: &Path) -> Result<Self, Error> {
        match fs::metadata(target) {
            Ok(meta) if !meta.is_file() => {
                return Err(Error::NotRegular {
                    path: target.to_owned(),
                    found: read::kind(meta.file_type()),
                });
            }
            _ => {}
        }
        if target.file_name().is_none() {
            let source = io::Error::new(io::ErrorKind::InvalidInput, "is no file's name");
            return Err(Error::io(target)(source));
        }
        Self::beside(target).map_err(Error::io(target))
    }

    pub(crate) fn beside(target: &Path) -> io::Result<Self> {
        let folder = target.parent().filter(|p| !p.as_os_str().is_empty());
        let (file, temporary) = temporary(folder.unwrap_or(Path::new(".")))?.into_parts();
        Ok(Self {
            file,
            temporary,
            target: target.to_owned(),
        })
    }

    /// Gives the file its final name, replacing an older file.
    ///
    /// # Errors
    /// [`Error::Io`]; in that case the temporary file is removed, and the older file is still
    /// there.
    pub fn commit(self) -> Result<(), Error> {
        operation::rename(self.temporary, &self.target).map_err(Error::io(&self.target))
    }

    /// Does the same after the content is on the medium, so that after a power cut the name holds
    /// the old file or the new one.
    ///
    /// # Errors
    /// As [`PendingFile::commit`].
    pub fn commit_synced(self) -> Result<(), Error> {
        operation::sync_file(&self.temporary).map_err(Error::io(&self.target))?;
        let target = self.target.clone();
        self.commit()?;
        let folder = target.parent().filter(|p| !p.as_os_str().is_empty());
        operation::sync_folder(folder.unwrap_or(Path::new("."))).map_err(Error::io(&target))
    }
}

impl Write for PendingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        operation::write(&mut self.file, &self.temporary, bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for PendingFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// A nameless file in the folder of another, for data that are too large for memory. It is removed
/// by itself.
///
/// # Errors
/// [`Error::Io`], naming `target`.
pub fn scratch_beside(target: &Path) -> Result<File, Error> {
    let folder = target.parent().filter(|p| !p.as_os_str().is_empty());
    tempfile::tempfile_in(folder.unwrap_or(Path::new(".")))
        .map_err(|e| Error::io(target)(plain(&e)))
}

/// Writes a file that the user has named, whole or not at all.
///
/// # Errors
/// As [`PendingFile::create`] and [`PendingFile::commit`].
pub fn write(target: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut file = PendingFile::create(target)?;
    file.write_all(bytes).map_err(Error::io(target))?;
    file.commit()
}

/// A file under a temporary name, which is removed when it is dropped unless it is given its final
/// name. Error messages never contain the name of a temporary file, but that which the user asked
/// for.
fn temporary(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    // The umask decides who may read the file, as for any other file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder).map_err(|e| plain(&e))
}

/// The system's error, without the temporary name.
fn plain(e: &io::Error) -> io::Error {
    match e.raw_os_error() {
        Some(code) => io::Error::from_raw_os_error(code),
        None => io::Error::from(e.kind()),
    }
}
