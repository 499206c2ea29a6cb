//! The error of this crate.

use nemoral_scene::excerpt;

/// Why a file is not what it should be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A row of a table is wrong.
    #[error("line {line}: {reason}")]
    Line {
        /// Its line, from 1.
        line: u64,
        /// What is wrong, and what is allowed.
        reason: String,
    },
    /// The file as a whole is wrong.
    #[error("{0}")]
    File(String),
}

impl ImportError {
    pub(crate) fn file(reason: impl Into<String>) -> Self {
        Self::File(reason.into())
    }

    pub(crate) fn line(line: u64, reason: impl Into<String>) -> Self {
        let reason = reason.into();
        Self::Line { line, reason }
    }
}

/// A text of a file as messages show it.
pub(crate) fn shown(text: &str) -> String {
    excerpt(text, 40)
}
