//! Reading files that may come from a stranger.

use std::fs::{self, File, FileType, Metadata};
use std::io::{Read, Take};
use std::path::Path;

use crate::Error;

/// The bytes of a regular file of at most `limit` bytes. The path is the user's own, so links are
/// followed.
///
/// # Errors
/// [`Error::NotRegular`] for a folder, device or pipe, [`Error::TooLarge`], and [`Error::Io`].
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, Error> {
    let meta = fs::metadata(path).map_err(Error::io(path))?;
    read_checked(path, &meta, limit)
}

/// The same for UTF-8 text.
///
/// # Errors
/// As [`read`], and [`Error::NotText`].
pub fn read_text(path: &Path, limit: u64) -> Result<String, Error> {
    into_text(path, read(path, limit)?)
}

/// Whether two paths lead to the same file or folder; `false` if one does not exist.
#[must_use]
pub fn is_same(a: &Path, b: &Path) -> bool {
    matches!((fs::canonicalize(a), fs::canonicalize(b)), (Ok(a), Ok(b)) if a == b)
}

pub(crate) fn into_text(path: &Path, bytes: Vec<u8>) -> Result<String, Error> {
    String::from_utf8(bytes).map_err(|e| Error::NotText {
        path: path.to_owned(),
        position: e.utf8_error().valid_up_to(),
    })
}

/// Reads a file after its metadata have been checked.
pub(crate) fn read_checked(path: &Path, meta: &Metadata, limit: u64) -> Result<Vec<u8>, Error> {
    let mut file = open_checked(path, meta, limit)?;
    // It may have grown, and files of some file systems do not say how long they are.
    file.set_limit(limit.saturating_add(1));
    let mut bytes = Vec::with_capacity(usize::try_from(meta.len()).unwrap_or(0));
    file.read_to_end(&mut bytes).map_err(Error::io(path))?;
    if bytes.len() as u64 > limit {
        return Err(too_large(path, limit));
    }
    Ok(bytes)
}

/// Opens a file after its metadata have been checked, because opening a pipe would block for ever.
/// At most `limit` bytes are read from it.
pub(crate) fn open_checked(path: &Path, meta: &Metadata, limit: u64) -> Result<Take<File>, Error> {
    if !meta.is_file() {
        return Err(Error::NotRegular {
            path: path.to_owned(),
            found: kind(meta.file_type()),
        });
    }
    if meta.len() > limit {
        return Err(too_large(path, limit));
    }
    let file = File::open(path).map_err(Error::io(path))?;
    Ok(file.take(limit))
}

fn too_large(path: &Path, limit: u64) -> Error {
    Error::TooLarge {
        path: path.to_owned(),
        limit,
    }
}

/// What is there, with its article.
pub(crate) fn kind(of: FileType) -> &'static str {
    if of.is_dir() {
        return "a folder";
    }
    if of.is_symlink() {
        return "a link";
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if of.is_fifo() {
            return "a pipe";
        }
        if of.is_socket() {
            return "a socket";
        }
        if of.is_char_device() || of.is_block_device() {
            return "a device";
        }
    }
    "something else"
}
