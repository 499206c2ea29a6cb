use std::path::PathBuf;

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The data set cannot be read, or a file of it is damaged.
    #[error(transparent)]
    Dataset(#[from] nemoral_dataset::Error),
    /// The page cannot be written.
    #[error(transparent)]
    Files(#[from] nemoral_files::Error),
    /// The page's name is not that of a page.
    #[error("{}: the page is HTML: the name must end in .html", path.display())]
    Name {
        /// The name.
        path: PathBuf,
    },
    /// The page would lie in the data set's folder, where only its own files may be.
    #[error("{}: lies in the data set's own folder; choose another", path.display())]
    Inside {
        /// The name.
        path: PathBuf,
    },
}

impl Error {
    /// Whether the request was wrong, rather than its execution.
    #[must_use]
    pub fn is_request(&self) -> bool {
        matches!(self, Self::Name { .. } | Self::Inside { .. })
    }
}
