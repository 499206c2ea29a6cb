//! The error of this crate.

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

/// A text of a file as a message shows it: short, and in one line.
pub(crate) fn shown(text: &str) -> String {
    const SHOWN: usize = 40;
    let mut short: String = text
        .chars()
        .take(SHOWN)
        .flat_map(char::escape_debug)
        .collect();
    if text.chars().nth(SHOWN).is_some() {
        short.push('…');
    }
    short
}
