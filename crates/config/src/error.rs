//! The error of this crate.

use std::sync::Arc;

use crate::ConfigErrors;

/// Why a request is refused. Cheap to clone.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Keys have values that are not allowed, or not together.
    #[error("{0}")]
    Config(Arc<ConfigErrors>),
    /// The request is wrong in what is no key's value.
    #[error("{0}")]
    Request(Arc<str>),
    /// A file that the request names could not be read.
    #[error("cannot read {0}")]
    Read(Arc<nemoral_files::Error>),
}

impl Error {
    pub(crate) fn request(message: impl Into<String>) -> Self {
        Self::Request(message.into().into())
    }

    /// Says in which of several sequences a request is wrong.
    pub(crate) fn in_sequence(self, number: u32, of: u32) -> Self {
        if of > 1 {
            Self::request(format!("sequence {number}: {self}"))
        } else {
            self
        }
    }
}

impl From<nemoral_files::Error> for Error {
    fn from(error: nemoral_files::Error) -> Self {
        Self::Read(Arc::new(error))
    }
}

impl From<ConfigErrors> for Error {
    fn from(errors: ConfigErrors) -> Self {
        Self::Config(Arc::new(errors))
    }
}
