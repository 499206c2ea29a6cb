//! The error of this crate.

use std::io;

use nemoral_scene::excerpt;

/// An error of the view.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The port cannot be used.
    #[error("cannot listen on 127.0.0.1:{port}: {source}")]
    Listen {
        /// The port; 0 for any.
        port: u16,
        /// The system's reason.
        source: io::Error,
    },
    /// A request has a value that is not allowed.
    #[error("{name} = {value}: must be {allowed}")]
    Value {
        /// What was to be set or asked for.
        name: String,
        /// The value.
        value: String,
        /// What is allowed.
        allowed: String,
    },
    /// The forest cannot be grown or seen so.
    #[error(transparent)]
    Pipeline(#[from] nemoral_pipeline::Error),
}

impl From<nemoral_pipeline::config::Error> for Error {
    fn from(error: nemoral_pipeline::config::Error) -> Self {
        Self::Pipeline(error.into())
    }
}

impl Error {
    pub(crate) fn value(name: &str, value: impl ToString, allowed: impl Into<String>) -> Self {
        // What a stranger wrote is not repeated at length.
        const SHOWN: usize = 40;
        Self::Value {
            name: excerpt(name, SHOWN),
            value: excerpt(&value.to_string(), SHOWN),
            allowed: allowed.into(),
        }
    }

    /// Whether the request was wrong, rather than its execution.
    #[must_use]
    pub fn is_request(&self) -> bool {
        match self {
            Self::Listen { .. } | Self::Value { .. } => true,
            Self::Pipeline(e) => e.is_request(),
        }
    }
}
