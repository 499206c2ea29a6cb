//! Names of files in a config.

use nemoral_plan::{Encode, Encoder};
use serde::{Deserialize, Serialize};

/// The path of a file that a config names; empty for none. Only keys of this type lead to files:
/// [`InputFiles`](crate::InputFiles) finds each of them by itself and reads the file, and keys of
/// plans depend on its content.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(transparent)]
pub struct InputPath(String);

impl InputPath {
    /// The path, as it was written.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether no file is named.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl From<&str> for InputPath {
    fn from(path: &str) -> Self {
        Self(path.to_owned())
    }
}

impl std::fmt::Display for InputPath {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl Encode for InputPath {
    fn encode(&self, encoder: &mut dyn Encoder) {
        encoder.file(&self.0);
    }
}
