//! What can go wrong with a data set on disk.

use std::io;
use std::path::PathBuf;

use nemoral_scene::excerpt;

/// Why a data set could not be written, read, checked or merged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file system reports an error, such as a full disk, denied permission or a missing file.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The output folder holds files that no data set owns; nothing was touched.
    #[error(
        "{}: the folder is not empty and holds no data set (found '{found}'); choose an empty or a \
         new folder",
        path.display()
    )]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// One of the names in it.
        found: String,
    },
    /// The output folder holds a data set already; nothing was touched.
    #[error(
        "{}: the folder holds {} data set",
        path.display(),
        if *finished { "a" } else { "an unfinished" }
    )]
    Exists {
        /// The folder.
        path: PathBuf,
        /// Was it finished?
        finished: bool,
    },
    /// `dataset.json` is there and cannot be relied on; nothing was touched.
    #[error(
        "{}: holds a damaged data set: {cause}; put a whole dataset.json back, or remove this \
         folder yourself and make it anew",
        path.display()
    )]
    Damaged {
        /// The folder.
        path: PathBuf,
        /// What is wrong with it.
        cause: String,
    },
    /// There is a `.nemoral` folder but no whole header in it: nothing says which files are a data
    /// set's, so nothing was touched.
    #[error(
        "{}: holds '.nemoral' without a whole header, so that nothing says which of its files are \
         a data set's; remove this folder yourself if you need nothing in it, or choose another",
        path.display()
    )]
    Unowned {
        /// The folder.
        path: PathBuf,
    },
    /// The parts of a merge do not have all frames of a sequence; nothing was written.
    #[error("sequence {sequence}: no part has {missing}")]
    Incomplete {
        /// The sequence.
        sequence: u32,
        /// What is missing, in words: `frames 3..5 of its 8`.
        missing: String,
    },
    /// Resume or merge of data sets that were made differently; nothing was touched.
    #[error(
        "{}: made with {field} = {found}, asked for {asked}: what differs cannot be mixed in one \
         data set",
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
    /// The progress monitor ended the work.
    #[error("stopped after {done} of {total} frames")]
    Stopped {
        /// How many frames are done.
        done: u64,
        /// How many there are.
        total: u64,
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

impl From<nemoral_files::Error> for Error {
    fn from(e: nemoral_files::Error) -> Self {
        use nemoral_files::Error as Files;
        match e {
            Files::Io { path, source } => Self::Io { path, source },
            Files::Locked { path } => Self::Busy { path },
            other => {
                let (path, text) = (other.path().to_owned(), other.to_string());
                // The path is named only once.
                let said = format!("{}: ", path.display());
                let message = text.strip_prefix(&said).unwrap_or(&text).to_owned();
                Self::Malformed { path, message }
            }
        }
    }
}

impl Error {
    pub(crate) fn io(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { path, source }
    }

    /// What is wrong with a file that has been named already.
    pub(crate) fn without_path(&self) -> String {
        match self {
            Self::Io { source, .. } => source.to_string(),
            Self::Malformed { message, .. } => message.clone(),
            other => other.to_string(),
        }
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

/// A text of a data set's files as most messages show it.
pub(crate) fn shown(text: &str) -> String {
    excerpt(text, 40)
}
