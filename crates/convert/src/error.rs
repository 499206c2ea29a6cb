//! What can go wrong with a conversion.

use std::path::PathBuf;

/// Why a data set could not be converted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The data set cannot be read, or a file of it is damaged.
    #[error(transparent)]
    Dataset(#[from] nemoral_dataset::Error),
    /// A file cannot be read or written.
    #[error(transparent)]
    Files(#[from] nemoral_files::Error),
    /// The output folder holds files that no conversion owns; nothing was touched.
    #[error(
        "{}: the folder is not empty and holds no conversion (found '{found}'); choose an empty or \
         a new folder",
        path.display()
    )]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// One of the names in it.
        found: String,
    },
    /// The output folder holds a conversion already; nothing was touched.
    #[error(
        "{}: the folder holds {} conversion",
        path.display(),
        if *finished { "a" } else { "an unfinished" }
    )]
    Exists {
        /// The folder.
        path: PathBuf,
        /// Whether it was finished.
        finished: bool,
    },
    /// The state of an unfinished conversion is damaged, so that nothing says which files are its.
    #[error(
        "{}: nothing says which of its files are a conversion's: {cause}; remove this folder \
         yourself if you need nothing in it, or choose another",
        path.display()
    )]
    Damaged {
        /// The folder.
        path: PathBuf,
        /// What is wrong with it.
        cause: String,
    },
    /// A file that is not as the conversion that lists it has written it, or that no conversion has
    /// written: it is neither removed nor replaced.
    #[error(
        "{}: is not what the conversion wrote: remove it or choose another folder",
        path.display()
    )]
    Changed {
        /// The file.
        path: PathBuf,
    },
    /// A file's name that not every system takes, such as one made of that of a sensor `aux`.
    #[error(transparent)]
    Name(#[from] nemoral_files::PathError),
    /// Resume of a conversion of something else; nothing was touched.
    #[error("{}: made with {field} = {found}, asked for {asked}", path.display())]
    Mismatch {
        /// The folder.
        path: PathBuf,
        /// The first field that differs.
        field: &'static str,
        /// Its value in the folder.
        found: String,
        /// Its value in the request.
        asked: String,
    },
    /// A file that bears the name of a tile of the cloud that is to be written; nothing was
    /// touched.
    #[error(
        "{}: is there already, and tiles of two clouds would be mixed; choose another name",
        path.display()
    )]
    TileExists {
        /// The file.
        path: PathBuf,
    },
    /// The same, but no file that this program wrote; it is not replaced.
    #[error(
        "{}: has the name of a tile, and nemoral did not write it; choose another name",
        path.display()
    )]
    ForeignTile {
        /// The file.
        path: PathBuf,
    },
    /// The output folder lies in the data set's.
    #[error("{}: lies in the data set's own folder; choose another", path.display())]
    Inside {
        /// The output folder.
        path: PathBuf,
    },
    /// The data set lacks what the format needs.
    #[error("{format}: {reason}")]
    Unsuitable {
        /// The format.
        format: &'static str,
        /// What is missing, and how to get it.
        reason: String,
    },
    /// A class table that is not valid, or does not fit the data set.
    #[error("ontology {table}: {reason}")]
    Ontology {
        /// The table's name or file.
        table: String,
        /// What is wrong with it.
        reason: String,
    },
}

impl Error {
    /// Whether the request was wrong, rather than its execution.
    #[must_use]
    pub fn is_request(&self) -> bool {
        !matches!(self, Self::Dataset(_) | Self::Files(_))
    }
}
