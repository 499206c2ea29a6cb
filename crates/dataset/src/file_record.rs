//! The record of a file of a data set.

use nemoral_files::{Folder, InnerPath};
use serde::{Deserialize, Serialize};

use crate::Error;

/// A file and its checksum.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Below the data set's folder, with forward slashes.
    pub path: InnerPath,
    /// Size.
    pub bytes: u64,
    /// BLAKE3, hexadecimal.
    pub blake3: String,
}

impl FileRecord {
    /// The record of a file with this content.
    #[must_use]
    pub fn of(path: InnerPath, bytes: &[u8]) -> Self {
        Self {
            path,
            bytes: bytes.len() as u64,
            blake3: blake3::hash(bytes).to_hex().to_string(),
        }
    }

    /// Writes a file, whole or not at all.
    pub(crate) fn put(folder: &Folder, path: InnerPath, bytes: &[u8]) -> Result<Self, Error> {
        folder.put(&path, bytes)?;
        Ok(Self::of(path, bytes))
    }

    /// The file's bytes, if they agree with the record.
    pub(crate) fn read(&self, folder: &Folder) -> Result<Vec<u8>, Error> {
        let wrong = |message| Error::malformed(self.path.below(folder.root()), message);
        let bytes = match folder.read(&self.path, self.bytes) {
            Err(nemoral_files::Error::TooLarge { .. }) => {
                let message = format!("has more than the {} bytes of its record", self.bytes);
                return Err(wrong(message));
            }
            read => read?,
        };
        if bytes.len() as u64 != self.bytes {
            let (found, asked) = (bytes.len(), self.bytes);
            return Err(wrong(format!("has {found} bytes, its record says {asked}")));
        }
        if *blake3::hash(&bytes).to_hex() != *self.blake3 {
            return Err(wrong("its checksum differs from its record's".to_owned()));
        }
        Ok(bytes)
    }

    /// The same for text.
    pub(crate) fn read_text(&self, folder: &Folder) -> Result<String, Error> {
        let bytes = self.read(folder)?;
        let path = || self.path.below(folder.root());
        String::from_utf8(bytes).map_err(|e| Error::malformed(path(), e.utf8_error()))
    }
}
