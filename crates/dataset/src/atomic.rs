//! Files that appear whole or not at all.

use std::fs;
use std::io::Write;
use std::path::Path;

use tempfile::NamedTempFile;

use crate::{Error, FileRecord};

const TEMP_PREFIX: &str = ".nemoral-";
const TEMP_SUFFIX: &str = ".tmp";

/// Writes `bytes` to `root/relative` under a temporary name in the same folder, then renames. On
/// any error the temporary file is gone and what was under the final name, if anything, is still
/// there.
///
/// Nothing is synced: after a power cut the file may be damaged, which its checksum shows, and
/// resume makes the frame again. Syncing eight files a frame would cost more than making them.
pub(crate) fn put(root: &Path, relative: &str, bytes: &[u8]) -> Result<FileRecord, Error> {
    let path = root.join(relative);
    let folder = path.parent().expect("a relative path below a folder");
    fs::create_dir_all(folder).map_err(Error::io(folder))?;
    let mut file = temporary(folder).map_err(Error::io(&path))?;
    file.as_file_mut()
        .write_all(bytes)
        .map_err(Error::io(&path))?;
    file.persist(&path).map_err(|e| Error::io(&path)(e.error))?;
    Ok(FileRecord {
        path: relative.to_owned(),
        bytes: bytes.len() as u64,
        blake3: blake3::hash(bytes).to_hex().to_string(),
    })
}

/// A file that goes by itself if it is not given its name.
pub(crate) fn temporary(folder: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMP_PREFIX).suffix(TEMP_SUFFIX);
    // A data set is for others to read too: the umask decides, as for any file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Is this a temporary file of a process that was killed?
pub(crate) fn is_leftover(name: &str) -> bool {
    name.starts_with(TEMP_PREFIX) && name.ends_with(TEMP_SUFFIX)
}

/// A recorded file's bytes, if it is what the record says; the message says what it is instead.
pub(crate) fn verified(root: &Path, record: &FileRecord) -> Result<Vec<u8>, String> {
    let bytes = fs::read(root.join(&record.path)).map_err(|e| e.to_string())?;
    if bytes.len() as u64 != record.bytes {
        return Err(format!(
            "has {} bytes, dataset.json says {}",
            bytes.len(),
            record.bytes
        ));
    }
    if *blake3::hash(&bytes).to_hex() != *record.blake3 {
        return Err("its checksum differs from dataset.json's".to_owned());
    }
    Ok(bytes)
}
