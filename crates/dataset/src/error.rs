//! What can go wrong with a data set on disk.

use std::io;
use std::path::PathBuf;

/// Why a data set could not be written, read, checked or merged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file system said no: disk full, permission denied, file missing.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The output folder holds files that no data set owns; nothing was touched.
    #[error(
        "{}: the folder is not empty and holds no data set (found '{found}'); choose an empty or a new folder",
        path.display()
    )]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// One of the things in it.
        found: String,
    },
    /// The output folder holds a data set already; nothing was touched.
    #[error(
        "{}: the folder holds {} data set; use --resume to go on with it or --overwrite to replace it",
        path.display(),
        if *finished { "a" } else { "an unfinished" }
    )]
    Exists {
        /// The folder.
        path: PathBuf,
        /// Was it finished?
        finished: bool,
    },
    /// Resume or merge of data sets that were made differently; nothing was touched.
    #[error(
        "{}: made with {field} = {found}, asked for {asked}: what differs cannot be mixed in one data set",
        path.display()
    )]
    Mismatch {
        /// The folder.
        path: PathBuf,
        /// The first field that differs, dotted.
        field: String,
        /// Its value in the folder.
        found: String,
        /// Its value in the request.
        asked: String,
    },
    /// Another process is writing to the folder.
    #[error("{}: another process is writing to this data set", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// A header or a frame that cannot be written.
    #[error("{field} = {value}: must be {allowed}")]
    Invalid {
        /// The offending field, dotted.
        field: String,
        /// Its value.
        value: String,
        /// What is allowed.
        allowed: String,
    },
    /// A file that is not what it should be.
    #[error("{}: {message}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        message: String,
    },
}

impl Error {
    pub(crate) fn io(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { path, source }
    }

    pub(crate) fn malformed(path: impl Into<PathBuf>, message: impl ToString) -> Self {
        Self::Malformed {
            path: path.into(),
            message: message.to_string(),
        }
    }

    pub(crate) fn invalid(
        field: impl ToString,
        value: impl ToString,
        allowed: impl ToString,
    ) -> Self {
        Self::Invalid {
            field: field.to_string(),
            value: value.to_string(),
            allowed: allowed.to_string(),
        }
    }
}
