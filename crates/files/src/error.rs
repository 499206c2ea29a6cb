//! What can go wrong with a file.

use std::io;
use std::path::{Path, PathBuf};

/// Why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The system reports an error, such as a full disk, denied permission or a missing file.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// A folder, a device, a pipe or a socket where a regular file is needed.
    #[error("{}: is {found}, not a regular file", path.display())]
    NotRegular {
        /// The path.
        path: PathBuf,
        /// What is there, with its article.
        found: &'static str,
    },
    /// A symbolic link below a folder in which none is followed.
    #[error("{}: is a link; links inside a data set are not followed", path.display())]
    Link {
        /// The link.
        path: PathBuf,
    },
    /// More bytes than the reader has room for.
    #[error(
        "{}: is larger than {limit} bytes, the most that is read of such a file",
        path.display()
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The limit, bytes.
        limit: u64,
    },
    /// A text file that is not UTF-8.
    #[error("{}: is not UTF-8 text (byte {position})", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// The first byte that is wrong, counted from 0.
        position: usize,
    },
    /// Another process holds the lock.
    #[error("{}: another process is writing here", path.display())]
    Locked {
        /// The locked folder.
        path: PathBuf,
    },
}

impl Error {
    /// Turns the system's error into one that names the file.
    pub fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }

    /// Whether the error says that there is no such file.
    #[must_use]
    pub fn is_not_found(&self) -> bool {
        matches!(self, Self::Io { source, .. } if source.kind() == io::ErrorKind::NotFound)
    }

    /// The file or folder that the error is about.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Io { path, .. }
            | Self::NotRegular { path, .. }
            | Self::Link { path }
            | Self::TooLarge { path, .. }
            | Self::NotText { path, .. }
            | Self::Locked { path } => path,
        }
    }
}

/// A text that is not a valid [`InnerPath`](crate::InnerPath).
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is no name inside a folder: {reason}")]
pub struct PathError {
    /// The text, shortened if it is long.
    pub text: String,
    /// Why it is not valid.
    pub reason: &'static str,
}
