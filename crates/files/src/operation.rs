//! Every kind of change of a file system is made in one place each, where tests can observe it and
//! make it fail.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

#[cfg(feature = "observe")]
use crate::observe::{self, Operation};

/// Announces an operation to observers, which may make it fail.
macro_rules! announce {
    ($operation:expr) => {
        #[cfg(feature = "observe")]
        observe::announce(&$operation)?;
    };
}

pub(crate) fn create_folder(path: &Path) -> io::Result<()> {
    announce!(Operation::CreateFolder(path));
    match fs::create_dir(path) {
        // Another thread may have made it meanwhile.
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists && path.is_dir() => Ok(()),
        made => made,
    }
}

/// Writes to a file that is open under the name `path`.
pub(crate) fn write(file: &mut File, path: &Path, bytes: &[u8]) -> io::Result<()> {
    let _ = path;
    announce!(Operation::Write { path, bytes });
    file.write_all(bytes)
}

pub(crate) fn rename(file: tempfile::TempPath, to: &Path) -> io::Result<()> {
    announce!(Operation::Rename { from: &file, to });
    file.persist(to).map_err(|e| e.error)
}

pub(crate) fn remove_file(path: &Path) -> io::Result<()> {
    announce!(Operation::RemoveFile(path));
    fs::remove_file(path)
}

/// Removes a folder if it is empty.
pub(crate) fn remove_folder(path: &Path) -> io::Result<()> {
    announce!(Operation::RemoveFolder(path));
    fs::remove_dir(path)
}

/// Waits until a file's content is on the medium.
pub(crate) fn sync_file(path: &Path) -> io::Result<()> {
    announce!(Operation::SyncFile(path));
    let mut options = File::options();
    // Windows flushes only files that are open for writing; elsewhere a file without write
    // permission can be synced too.
    if cfg!(windows) {
        options.write(true);
    } else {
        options.read(true);
    }
    options.open(path)?.sync_all()
}

/// Waits until a folder's names are on the medium.
pub(crate) fn sync_folder(path: &Path) -> io::Result<()> {
    announce!(Operation::SyncFolder(path));
    // Windows stores names by itself, and does not open folders as files.
    if cfg!(windows) {
        return Ok(());
    }
    match File::open(path)?.sync_all() {
        // Some network file systems cannot sync folders.
        Err(e)
            if matches!(
                e.kind(),
                io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported
            ) =>
        {
            Ok(())
        }
        synced => synced,
    }
}
