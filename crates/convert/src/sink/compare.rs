//! Whether files are as their records say. However large a file is, little of it is in memory.

use std::io::{self, Write};

use nemoral_dataset::FileRecord;
use nemoral_files::{EntryKind, Folder, InnerPath};

use crate::Error;

/// What is there in the place of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileState {
    /// No file, or one that holds nothing: it is empty or has zeros alone, as a power cut leaves
    /// files that were not on the medium.
    Nothing,
    /// The file of the record.
    Recorded,
    /// Something else, which may be what somebody has nowhere else.
    Other,
}

/// Compares what is there with a file's record. No conversion has hidden files: their content is
/// often the same everywhere, so that a checksum would not tell whose they are.
pub(super) fn compare(folder: &Folder, record: &FileRecord) -> Result<FileState, Error> {
    match folder.kind(&record.path)? {
        None => return Ok(FileState::Nothing),
        Some(EntryKind::File) if !is_hidden(&record.path) => {}
        Some(_) => return Ok(FileState::Other),
    }
    let mut file = match folder.open(&record.path, record.bytes) {
        Err(nemoral_files::Error::TooLarge { .. }) => return Ok(FileState::Other),
        file => file?,
    };
    let mut digester = Digester {
        hasher: blake3::Hasher::new(),
        bytes: 0,
        is_blank: true,
    };
    let path = record.path.below(folder.root());
    io::copy(&mut file, &mut digester).map_err(nemoral_files::Error::io(&path))?;
    let digest = digester.hasher.finalize().to_hex();
    if digester.bytes == record.bytes && *digest == *record.blake3 {
        Ok(FileState::Recorded)
    } else if digester.is_blank {
        Ok(FileState::Nothing)
    } else {
        Ok(FileState::Other)
    }
}

/// Whether a file agrees with its record.
pub(super) fn is_whole(folder: &Folder, record: &FileRecord) -> bool {
    compare(folder, record).is_ok_and(|there| there == FileState::Recorded)
}

/// The error about a file that is neither removed nor replaced.
pub(super) fn changed(folder: &Folder, file: &InnerPath) -> Error {
    Error::Changed {
        path: file.below(folder.root()),
    }
}

fn is_hidden(file: &InnerPath) -> bool {
    file.components().any(|name| name.starts_with('.'))
}

/// Takes bytes for their checksum, and keeps none.
struct Digester {
    hasher: blake3::Hasher,
    bytes: u64,
    /// Whether all of them are zeros.
    is_blank: bool,
}

impl Write for Digester {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.hasher.update(bytes);
        self.bytes += bytes.len() as u64;
        self.is_blank = self.is_blank && bytes.iter().all(|byte| *byte == 0);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_recorded_is_recorded() {
        let dir = tempfile::tempdir().expect("a folder");
        let folder = Folder::new(dir.path());
        // More than is in memory at a time.
        let content: Vec<u8> = (0..300_000_u32).map(|i| (i % 251) as u8).collect();
        let mut changed = content.clone();
        changed[299_999] += 1;
        let zeros = vec![0; content.len()];
        let longer = [&content[..], b"1"].concat();
        let shorter = &content[..content.len() - 1];
        let cases: [(&[u8], FileState); 6] = [
            (&content, FileState::Recorded),
            (&changed, FileState::Other),
            (&longer, FileState::Other),
            (shorter, FileState::Other),
            (&zeros, FileState::Nothing),
            (b"", FileState::Nothing),
        ];
        for name in ["a/b.bin", ".git/config"] {
            let path = InnerPath::new(name).expect("an inner path");
            let record = FileRecord::of(path.clone(), &content);
            let there = || compare(&folder, &record).expect("compared");
            assert_eq!(there(), FileState::Nothing, "{name}");
            for (bytes, expected) in cases {
                folder.put(&path, bytes).expect("written");
                let is_hidden = name.starts_with('.');
                let expected = if is_hidden {
                    FileState::Other
                } else {
                    expected
                };
                assert_eq!(there(), expected, "{name}: {} bytes", bytes.len());
            }
        }
        let path = InnerPath::new("a").expect("an inner path");
        let record = FileRecord::of(path, b"");
        assert_eq!(
            compare(&folder, &record).expect("compared"),
            FileState::Other
        );
    }
}
