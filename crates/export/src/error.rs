use std::path::PathBuf;

/// Why nothing was exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be written.
    #[error(transparent)]
    Files(#[from] nemoral_files::Error),
    /// The file's name does not say what is in it.
    #[error("{}: the name must end in .{allowed}", path.display())]
    Name {
        /// The name.
        path: PathBuf,
        /// The ending that is allowed.
        allowed: &'static str,
    },
    /// The folder has something in it already.
    #[error("{}: the folder is not empty; choose another", path.display())]
    NotEmpty {
        /// The folder.
        path: PathBuf,
    },
    /// A file that is no height map's, or from which the map is made, would be replaced by what a
    /// map's levels stand for.
    #[error(
        "{}: the height map's levels would replace it, but it is no text of a map or is read for \
         this one; choose another name for the map", path.display()
    )]
    NotOfMap {
        /// The file.
        path: PathBuf,
    },
    /// A file that the scene is made from would be replaced.
    #[error("{}: the scene is made from this file; choose another name", path.display())]
    Input {
        /// The file.
        path: PathBuf,
    },
    /// The scene has no shapes.
    #[error("there is nothing to export: the scene has no shapes")]
    Empty,
    /// The format cannot hold so much.
    #[error("{what} would be {bytes} bytes; the format allows {most}: export a smaller part")]
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// Its size.
        bytes: u64,
        /// The most that is allowed.
        most: u64,
    },
    /// An instance cannot be written, as its map is flat or not finite.
    #[error("instance {number} of shape `{shape}`: its map is flat or not finite")]
    Singular {
        /// The instance's number.
        number: usize,
        /// The shape's name.
        shape: String,
    },
    /// A height map's parameter is out of its range.
    #[error(transparent)]
    Param(#[from] nemoral_scene::ParamError),
}

impl Error {
    /// Whether the request was wrong, rather than its execution.
    #[must_use]
    pub fn is_request(&self) -> bool {
        !matches!(self, Self::Files(_) | Self::Singular { .. })
    }
}
