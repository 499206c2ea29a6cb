//! What a folder says of the conversion in it: `conversion.json` if it is finished, and the state
//! folder with a record for each step while it is not.

use std::collections::{BTreeMap, BTreeSet};

use nemoral_dataset::FileRecord;
use nemoral_files::{EntryKind, Folder, InnerPath, Lock, is_temporary_name};
use serde::{Deserialize, Serialize};

use super::Request;
use super::compare::{FileState, changed, compare};
use crate::{Error, digest};

const MANIFEST: &str = "conversion.json";
const STATE: &str = ".nemoral-convert";
const STATE_HEADER: &str = ".nemoral-convert/request.json";
const STATE_LOCK: &str = ".nemoral-convert/lock";
const STATE_STEPS: &str = ".nemoral-convert/steps";
/// The step that stands for the files of a finished conversion that is made again or replaced.
const FINISHED: &str = "finished";
/// The most bytes of a file of our own that is read.
const RECORD_BYTES: u64 = 2 << 30;

/// `conversion.json`. It is read in two parts: what `flatten` does not know it would keep as values
/// that take many times the memory of their text.
#[derive(Serialize)]
pub(super) struct Manifest {
    #[serde(flatten)]
    pub(super) request: Request,
    /// All files, by path.
    pub(super) files: Vec<FileRecord>,
}

/// What a [`Manifest`] has beside its request, to be read.
#[derive(Deserialize)]
struct Files {
    files: Vec<FileRecord>,
}

impl Manifest {
    fn parse(json: &str) -> Option<Self> {
        let Files { files } = serde_json::from_str(json).ok()?;
        let request = serde_json::from_str(json).ok()?;
        Some(Self { request, files })
    }

    pub(super) fn put(&self, folder: &Folder) -> Result<(), Error> {
        let json = serde_json::to_string(self).expect("a manifest has string keys");
        Ok(folder.put_synced(&inner(MANIFEST)?, seal(&json).as_bytes())?)
    }
}

/// The record of a step.
#[derive(Serialize, Deserialize)]
pub(super) struct Record {
    /// The digest of the request that it was made for.
    pub(super) request: String,
    /// An empty checksum stands for a file that has no name yet, as it is being streamed.
    pub(super) files: Vec<FileRecord>,
    /// What later steps need of this one.
    pub(super) note: String,
}

impl Record {
    pub(super) fn put(&self, folder: &Folder, key: &str) -> Result<(), Error> {
        let json = serde_json::to_string(self).expect("a record has string keys");
        Ok(folder.put(&record_path(key)?, seal(&json).as_bytes())?)
    }

    /// A step's record; `None` if there is none, or none that is whole.
    pub(super) fn read(folder: &Folder, key: &str) -> Result<Option<Self>, Error> {
        let text = match folder.read_text(&record_path(key)?, RECORD_BYTES) {
            Err(nemoral_files::Error::NotText { .. }) => return Ok(None),
            Err(e) if e.is_not_found() => return Ok(None),
            text => text?,
        };
        Ok(unseal(&text).and_then(|json| serde_json::from_str(json).ok()))
    }
}

/// A conversion that a folder holds.
pub(super) struct Found {
    pub(super) request: Request,
    /// Its files if it is finished.
    pub(super) finished: Option<Vec<FileRecord>>,
}

/// Looks into a folder without changing it; `None` if it holds nothing.
pub(super) fn look(folder: &Folder) -> Result<Option<Found>, Error> {
    let damaged = |cause| Error::Damaged {
        path: folder.root().to_owned(),
        cause,
    };
    let entries = folder.entries()?;
    let has = |name: &str| entries.iter().any(|e| e.name == name);
    if has(MANIFEST) {
        let text = folder.read_text(&inner(MANIFEST)?, RECORD_BYTES)?;
        let manifest = unseal(&text).and_then(Manifest::parse);
        // A file that is listed once is compared once.
        let manifest = manifest.filter(|m| m.files.is_sorted_by(|a, b| a.path < b.path));
        let Some(Manifest { request, files }) = manifest else {
            let cause = format!("'{MANIFEST}' was changed, or is another program's");
            return Err(damaged(cause));
        };
        let finished = Some(files);
        return Ok(Some(Found { request, finished }));
    }
    if has(STATE) {
        let text = match folder.read_text(&inner(STATE_HEADER)?, RECORD_BYTES) {
            Err(e) if e.is_not_found() => String::new(),
            text => text?,
        };
        if let Some(request) = unseal(&text).and_then(|json| serde_json::from_str(json).ok()) {
            let finished = None;
            return Ok(Some(Found { request, finished }));
        }
        // A process may have been killed before its first record.
        let has_begun = !folder.entries_of(&inner(STATE_STEPS)?)?.is_empty();
        if entries.len() == 1 && !has_begun {
            return Ok(None);
        }
        return Err(damaged(format!("'{STATE_HEADER}' is not whole")));
    }
    match entries.first() {
        None => Ok(None),
        Some(found) => Err(Error::Foreign {
            path: folder.root().to_owned(),
            found: found.name.clone(),
        }),
    }
}

/// Files of a conversion, by the steps that have recorded them.
#[derive(Default)]
pub(super) struct Records {
    /// Those of the request that is gone on with.
    pub(super) kept: BTreeMap<String, Vec<FileRecord>>,
    /// Those of others, whose files are removed.
    stale: Vec<(String, Vec<FileRecord>)>,
}

impl Records {
    /// The records of a folder. Those of the request with the digest `goes_on_with` are gone on
    /// with; `finished` are the files of a finished conversion, which are gone on with if there is
    /// such a digest.
    pub(super) fn read(
        folder: &Folder,
        goes_on_with: Option<&str>,
        finished: Option<&[FileRecord]>,
    ) -> Result<Self, Error> {
        let mut records = Self::default();
        for entry in folder.entries_of(&inner(STATE_STEPS)?)? {
            let key = entry.name.strip_suffix(".json");
            // No step has a name that cannot be that of a file on every system.
            let key = key.filter(|key| entry.kind == EntryKind::File && record_path(key).is_ok());
            let Some(key) = key else {
                continue;
            };
            if let Some(record) = Record::read(folder, key)? {
                let is_kept = goes_on_with == Some(record.request.as_str());
                records.add(key, record.files, is_kept);
            }
        }
        if let Some(files) = finished {
            records.add(FINISHED, files.to_vec(), goes_on_with.is_some());
        }
        Ok(records)
    }

    fn add(&mut self, key: &str, files: Vec<FileRecord>, is_kept: bool) {
        if is_kept {
            self.kept.insert(key.to_owned(), files);
        } else {
            self.stale.push((key.to_owned(), files));
        }
    }

    /// Refuses to replace a conversion that would lose a file which is not as it was written.
    /// Anybody can make such records, and with them name files of others; and people change files.
    pub(super) fn refuse_changed(&self, folder: &Folder) -> Result<(), Error> {
        for (path, records) in self.lost() {
            let mut is_other = true;
            for record in records {
                is_other = is_other && compare(folder, record)? == FileState::Other;
            }
            if is_other {
                return Err(changed(folder, path));
            }
        }
        Ok(())
    }

    /// Removes what is not gone on with, and what a process that was killed has left.
    pub(super) fn clear(&self, folder: &Folder) -> Result<(), Error> {
        for path in self.lost().into_keys() {
            folder.remove_file(path)?;
        }
        let folders = self.folders();
        for below in &folders {
            remove_temporaries(folder, Some(below))?;
        }
        for below in [STATE, STATE_STEPS] {
            remove_temporaries(folder, Some(&inner(below)?))?;
        }
        remove_temporaries(folder, None)?;
        // The innermost folders come first. A folder that is not empty contains files of others.
        for below in folders.iter().rev() {
            folder.remove_empty_folder(below)?;
        }
        for (key, _) in &self.stale {
            folder.remove_file(&record_path(key)?)?;
        }
        Ok(())
    }

    /// The files that nothing has recorded which is gone on with, each with its records.
    fn lost(&self) -> BTreeMap<&InnerPath, Vec<&FileRecord>> {
        let kept: BTreeSet<&InnerPath> = self.kept.values().flatten().map(|f| &f.path).collect();
        let mut lost: BTreeMap<&InnerPath, Vec<&FileRecord>> = BTreeMap::new();
        for file in self.stale.iter().flat_map(|(_, files)| files) {
            if !kept.contains(&file.path) {
                lost.entry(&file.path).or_default().push(file);
            }
        }
        lost
    }

    /// The folders of all files.
    fn folders(&self) -> BTreeSet<InnerPath> {
        let mut folders = BTreeSet::new();
        let stale = self.stale.iter().map(|(_, files)| files);
        for file in self.kept.values().chain(stale).flatten() {
            let mut above = file.path.parent();
            while let Some(parent) = above {
                above = parent.parent();
                folders.insert(parent);
            }
        }
        folders
    }
}

/// Takes hold of a folder. Afterwards it has an unfinished conversion of this request, with the
/// records that are returned. Nothing is removed before it is known that no file of others is lost.
pub(super) fn take_over(
    folder: &Folder,
    request: &Request,
    goes_on: bool,
    finished: Option<Vec<FileRecord>>,
) -> Result<(Lock, Records), Error> {
    let digest = request.digest();
    let early = lock_if_begun(folder)?;
    let goes_on_with = goes_on.then_some(digest.as_str());
    let records = Records::read(folder, goes_on_with, finished.as_deref())?;
    records.refuse_changed(folder)?;
    folder.create_folders(&inner(STATE_STEPS)?)?;
    let lock = match early {
        Some(lock) => lock,
        None => lock(folder)?,
    };
    // Another process may have ended between the first look and the lock.
    if look(folder)?.and_then(|found| found.finished) != finished {
        let path = folder.root().to_owned();
        return Err(nemoral_files::Error::Locked { path }.into());
    }
    // What a finished conversion owns stays owned while it is made again or replaced.
    if let Some(files) = finished {
        let record = Record {
            request: if goes_on { digest } else { String::new() },
            files,
            note: String::new(),
        };
        record.put(folder, FINISHED)?;
    }
    let json = serde_json::to_string(request).expect("a request has string keys");
    folder.put_synced(&inner(STATE_HEADER)?, seal(&json).as_bytes())?;
    folder.remove_file(&inner(MANIFEST)?)?;
    records.clear(folder)?;
    Ok((lock, records))
}

/// The lock where somebody may be converting, who holds it and whose files are theirs.
pub(super) fn lock_if_begun(folder: &Folder) -> Result<Option<Lock>, Error> {
    let has_state = folder.kind(&inner(STATE)?)?.is_some();
    has_state.then(|| lock(folder)).transpose()
}

fn lock(folder: &Folder) -> Result<Lock, Error> {
    Ok(folder.lock(&inner(STATE_LOCK)?)?)
}

/// Removes the temporary files that a process that was killed has left in a folder, or at the top.
pub(super) fn remove_temporaries(folder: &Folder, below: Option<&InnerPath>) -> Result<(), Error> {
    let entries = match below {
        Some(below) => folder.entries_of(below)?,
        None => folder.entries()?,
    };
    for entry in entries {
        if entry.kind == EntryKind::File && is_temporary_name(&entry.name) {
            let name = match below {
                Some(below) => format!("{below}/{}", entry.name),
                None => entry.name,
            };
            remove_named(folder, name)?;
        }
    }
    Ok(())
}

/// Removes a file that was found. One whose name is no inner path is somebody else's, and stays.
fn remove_named(folder: &Folder, name: String) -> Result<(), Error> {
    match InnerPath::new(name) {
        Ok(path) => Ok(folder.remove_file(&path)?),
        Err(_) => Ok(()),
    }
}

/// Removes the state folder, the request last, because without it nothing says what the rest is.
pub(super) fn remove_state(folder: &Folder) -> Result<(), Error> {
    for entry in folder.entries_of(&inner(STATE_STEPS)?)? {
        let is_ours = entry.name.ends_with(".json") || is_temporary_name(&entry.name);
        if is_ours && entry.kind == EntryKind::File {
            remove_named(folder, format!("{STATE_STEPS}/{}", entry.name))?;
        }
    }
    folder.remove_empty_folder(&inner(STATE_STEPS)?)?;
    for name in [STATE_LOCK, STATE_HEADER] {
        folder.remove_file(&inner(name)?)?;
    }
    folder.remove_empty_folder(&inner(STATE)?)?;
    Ok(())
}

fn record_path(key: &str) -> Result<InnerPath, Error> {
    inner(format!("{STATE_STEPS}/{key}.json"))
}

/// JSON with its checksum.
fn seal(json: &str) -> String {
    let digest = digest(json.as_bytes());
    format!("{{\"blake3\":\"{digest}\",\"content\":{json}}}\n")
}

/// The content of what [`seal`] made; `None` if a byte differs.
fn unseal(text: &str) -> Option<&str> {
    let (found, rest) = text.strip_prefix("{\"blake3\":\"")?.split_at_checked(64)?;
    let json = rest.strip_prefix("\",\"content\":")?.strip_suffix("}\n")?;
    (digest(json.as_bytes()) == found).then_some(json)
}

/// A name as a path.
pub(super) fn inner(path: impl Into<String>) -> Result<InnerPath, Error> {
    Ok(InnerPath::new(path)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_manifest_has_is_skipped_without_being_kept() {
        // Values in each other that deep are an error wherever they are kept.
        let deep = format!("{}{}", "[".repeat(1000), "]".repeat(1000));
        let json = format!(
            "{{\"converter\":\"c\",\"format\":\"f\",\"source\":\"s\",\"x\":{deep},\"files\":[]}}"
        );
        assert!(Manifest::parse(&json).is_some());
        assert!(Manifest::parse(&json.replace("\"files\"", "\"others\"")).is_none());
    }
}
