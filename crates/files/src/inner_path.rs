//! Names that cannot leave a folder.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::PathError;

/// The most bytes of a path.
const MAX_BYTES: usize = 1024;
/// The most bytes of one component, which is the limit of common file systems.
const MAX_COMPONENT_BYTES: usize = 255;

/// The name of a file or folder below some folder: components of printable characters, separated by
/// `/`. There is no root, drive, `.` or `..`, and nothing that Windows reads as one, so that
/// whatever it is joined to, the result lies below.
///
/// With the feature `serde` it is read from and written as a string; any other string is an error.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "String", into = "String"))]
pub struct InnerPath(String);

impl InnerPath {
    /// Checks a text.
    ///
    /// # Errors
    /// [`PathError`], which says why.
    pub fn new(text: impl Into<String>) -> Result<Self, PathError> {
        let text = text.into();
        match objection(&text) {
            None => Ok(Self(text)),
            Some(reason) => Err(PathError {
                text: shortened(&text),
                reason,
            }),
        }
    }

    /// The path with forward slashes.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The components from the outermost folder to the file.
    pub fn components(&self) -> impl Iterator<Item = &str> {
        self.0.split('/')
    }

    /// The last component.
    #[must_use]
    pub fn file_name(&self) -> &str {
        self.0.rsplit('/').next().unwrap_or(&self.0)
    }

    /// The folder it lies in; `None` for a name directly below the root.
    #[must_use]
    pub fn parent(&self) -> Option<Self> {
        self.0
            .rsplit_once('/')
            .map(|(folder, _)| Self(folder.to_owned()))
    }

    /// A name below this one.
    ///
    /// # Errors
    /// [`PathError`] if `name` is no inner path, or the whole is too long.
    pub fn join(&self, name: &str) -> Result<Self, PathError> {
        Self::new(format!("{}/{name}", self.0))
    }

    /// The path below a root, in the system's own form.
    #[must_use]
    pub fn below(&self, root: &Path) -> PathBuf {
        let mut path = root.to_owned();
        path.extend(self.components());
        path
    }
}

impl fmt::Display for InnerPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl AsRef<Path> for InnerPath {
    fn as_ref(&self) -> &Path {
        Path::new(&self.0)
    }
}

impl PartialEq<str> for InnerPath {
    fn eq(&self, other: &str) -> bool {
        self.0 == other
    }
}

impl PartialEq<&str> for InnerPath {
    fn eq(&self, other: &&str) -> bool {
        self.0 == *other
    }
}

impl TryFrom<String> for InnerPath {
    type Error = PathError;

    fn try_from(text: String) -> Result<Self, PathError> {
        Self::new(text)
    }
}

impl From<InnerPath> for String {
    fn from(path: InnerPath) -> Self {
        path.0
    }
}

/// Why a text is not valid.
fn objection(text: &str) -> Option<&'static str> {
    if text.is_empty() {
        return Some("it is empty");
    }
    if text.len() > MAX_BYTES {
        return Some("it is longer than 1024 bytes");
    }
    text.split('/').find_map(|component| {
        let forbidden = |c: char| c.is_control() || "\\:*?\"<>|".contains(c);
        if component.is_empty() {
            Some("a component is empty (it starts or ends with '/', or has '//')")
        } else if component == "." || component == ".." {
            Some("it has a component '.' or '..'")
        } else if component.len() > MAX_COMPONENT_BYTES {
            Some("a component is longer than 255 bytes")
        } else if component.contains(forbidden) {
            Some("it has a control character or one of \\ : * ? \" < > |")
        } else if component.ends_with(['.', ' ']) {
            Some("a component ends with a dot or a space")
        } else if is_device(component) {
            Some("a component is a device's name on Windows")
        } else {
            None
        }
    })
}

/// The names that Windows takes for devices, whatever follows the first dot, in words.
pub const DEVICE_NAMES: &str = "aux, con, nul, prn, com0 to com9, lpt0 to lpt9";

fn is_device(component: &str) -> bool {
    let stem = component.split('.').next().unwrap_or(component);
    let stem = stem.trim_end().to_ascii_uppercase();
    let numbered = |name: &str| {
        let rest = stem.strip_prefix(name);
        rest.is_some_and(|n| n.len() == 1 && n.bytes().all(|b| b.is_ascii_digit()))
    };
    ["CON", "PRN", "AUX", "NUL"].contains(&&*stem) || numbered("COM") || numbered("LPT")
}

fn shortened(text: &str) -> String {
    const SHOWN: usize = 80;
    match text.char_indices().nth(SHOWN) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text.to_owned(),
    }
}
