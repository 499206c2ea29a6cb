//! Output folders: what is in them, whose it is, and who may write.

use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::{DatasetHeader, Error, FORMAT_VERSION, FrameRecord, Manifest, atomic, layout};

/// `.nemoral/header.json`.
#[derive(Serialize, Deserialize)]
struct State {
    format_version: u32,
    header: DatasetHeader,
}

/// What an output folder holds.
pub(crate) enum Content {
    /// Nothing, or it does not exist.
    Nothing,
    /// A data set; with its header unless its writer died at once.
    Dataset {
        finished: Option<Box<Manifest>>,
        header: Option<Box<DatasetHeader>>,
    },
}

/// Looks into a folder without changing it.
pub(crate) fn look(root: &Path) -> Result<Content, Error> {
    let names = match names(root) {
        Ok(names) => names,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Content::Nothing),
        Err(e) => return Err(Error::io(root)(e)),
    };
    let has = |name: &str| names.iter().any(|n| n == name);
    if !has(layout::MANIFEST) && !has(layout::STATE) {
        return match names.first() {
            None => Ok(Content::Nothing),
            Some(found) => Err(Error::Foreign {
                path: root.to_owned(),
                found: found.clone(),
            }),
        };
    }
    let finished = has(layout::MANIFEST)
        .then(|| Manifest::read(&root.join(layout::MANIFEST)))
        .transpose()?;
    let state = root.join(layout::STATE).join("header.json");
    let header = match fs::read_to_string(&state) {
        Ok(text) => {
            let state_of = serde_json::from_str::<State>(&text);
            let found = state_of.map_err(|e| Error::malformed(&state, e))?;
            if found.format_version != FORMAT_VERSION {
                let message = format!("format_version is {}", found.format_version);
                return Err(Error::malformed(&state, message));
            }
            Some(found.header)
        }
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            finished.as_ref().map(|m| m.header.clone())
        }
        Err(e) => return Err(Error::io(state)(e)),
    };
    Ok(Content::Dataset {
        finished: finished.map(Box::new),
        header: header.map(Box::new),
    })
}

/// Everything in a folder, sorted.
pub(crate) fn names(folder: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        names.push(entry?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    Ok(names)
}

/// Makes the state folder and locks it for this process.
pub(crate) fn lock(root: &Path) -> Result<File, Error> {
    let state = root.join(layout::STATE);
    let frames = state.join("frames");
    fs::create_dir_all(&frames).map_err(Error::io(frames))?;
    let path = state.join("lock");
    let file = File::create(&path).map_err(Error::io(&path))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(Error::Busy {
            path: root.to_owned(),
        }),
        // Some network file systems have no locks: then the user has to take care.
        Err(TryLockError::Error(_)) => Ok(file),
    }
}

/// Writes `.nemoral/header.json`.
pub(crate) fn put_header(root: &Path, header: &DatasetHeader) -> Result<(), Error> {
    let state = State {
        format_version: FORMAT_VERSION,
        header: header.clone(),
    };
    let json = serde_json::to_vec_pretty(&state).expect("a header has string keys");
    atomic::put(root, &format!("{}/header.json", layout::STATE), &json).map(|_| ())
}

/// Writes a frame's record, or `None` over one that no longer holds.
pub(crate) fn put_record(
    root: &Path,
    sequence: u32,
    index: u64,
    record: Option<&FrameRecord>,
) -> Result<(), Error> {
    let json = serde_json::to_vec(&record).expect("a record has string keys");
    atomic::put(root, &layout::frame_record(sequence, index), &json).map(|_| ())
}

/// The records in the state folder; `None` for a frame whose record no longer holds.
pub(crate) fn records(root: &Path) -> Result<BTreeMap<(u32, u64), Option<FrameRecord>>, Error> {
    let folder = root.join(layout::STATE).join("frames");
    let mut records = BTreeMap::new();
    for name in names(&folder).map_err(Error::io(&folder))? {
        let path = folder.join(&name);
        let number = name.strip_suffix(".json").and_then(|n| n.split_once('-'));
        let Some((Ok(sequence), Ok(index))) = number.map(|(s, i)| (s.parse(), i.parse())) else {
            continue;
        };
        let text = fs::read_to_string(&path).map_err(Error::io(&path))?;
        // A record that a power cut has damaged is no record.
        let record = serde_json::from_str::<Option<FrameRecord>>(&text).unwrap_or_default();
        records.insert((sequence, index), record);
    }
    Ok(records)
}

/// Removes the state folder: the data set is finished.
pub(crate) fn remove_state(root: &Path) -> Result<(), Error> {
    let state = root.join(layout::STATE);
    fs::remove_dir_all(&state).map_err(Error::io(state))
}

/// Refuses a header that differs from the one in the folder, and says where.
pub(crate) fn compare(
    root: &Path,
    found: &DatasetHeader,
    asked: &DatasetHeader,
) -> Result<(), Error> {
    let value = |h| serde_json::to_value(h).expect("a header has string keys");
    let (found, asked) = (value(found), value(asked));
    // The telling fields first.
    for field in ["generator", "version", "seed", "backend", "config"] {
        differs(root, field, &found[field], &asked[field])?;
    }
    differs(root, "", &found, &asked)
}

fn differs(root: &Path, field: &str, found: &Value, asked: &Value) -> Result<(), Error> {
    if found == asked {
        return Ok(());
    }
    if let (Value::Object(a), Value::Object(b)) = (found, asked) {
        for name in a.keys().chain(b.keys()) {
            let dotted = if field.is_empty() {
                name.clone()
            } else {
                format!("{field}.{name}")
            };
            let at = |map: &serde_json::Map<String, Value>| map.get(name).cloned();
            match (at(a), at(b)) {
                (Some(a), Some(b)) => differs(root, &dotted, &a, &b)?,
                (a, b) => return Err(mismatch(root, &dotted, a.as_ref(), b.as_ref())),
            }
        }
    }
    Err(mismatch(root, field, Some(found), Some(asked)))
}

fn mismatch(root: &Path, field: &str, found: Option<&Value>, asked: Option<&Value>) -> Error {
    let short = |value: Option<&Value>| {
        let text = value.map_or_else(|| "nothing".to_owned(), Value::to_string);
        if text.chars().count() > 120 {
            text.chars().take(120).chain("…".chars()).collect()
        } else {
            text
        }
    };
    Error::Mismatch {
        path: root.to_owned(),
        field: field.to_owned(),
        found: short(found),
        asked: short(asked),
    }
}

/// The files below `sequences` that a data set with this header owns, by the layout: recorded or
/// not, and what killed processes left.
pub(crate) fn owned_files(root: &Path, header: &DatasetHeader) -> Vec<PathBuf> {
    let mut owned = Vec::new();
    let list = |folder: &Path| names(folder).unwrap_or_default();
    let digits = |s: &str, least| s.len() >= least && s.bytes().all(|b| b.is_ascii_digit());
    let sequences = root.join(layout::SEQUENCES);
    for number in list(&sequences).iter().filter(|n| digits(n, 2)) {
        let sequence = sequences.join(number);
        for (folder, extension) in layout::sensor_folders(header) {
            let folder = sequence.join(folder);
            for name in list(&folder) {
                let frame = name.split_once('.');
                if frame.is_some_and(|(stem, e)| digits(stem, 6) && e == extension)
                    || atomic::is_leftover(&name)
                {
                    owned.push(folder.join(name));
                }
            }
        }
        for name in list(&sequence) {
            if [layout::POSES, layout::CALIB, layout::TIMES].contains(&&*name)
                || atomic::is_leftover(&name)
            {
                owned.push(sequence.join(name));
            }
        }
    }
    owned
}

/// Removes a data set and nothing else; folders go when they are empty. The state folder stays, so
/// that the folder is a data set's at every moment.
pub(crate) fn clear(root: &Path, header: &DatasetHeader) -> Result<(), Error> {
    put_header(root, header)?;
    for path in owned_files(root, header) {
        fs::remove_file(&path).map_err(Error::io(&path))?;
    }
    let sequences = root.join(layout::SEQUENCES);
    for number in names(&sequences).unwrap_or_default() {
        let sequence = sequences.join(number);
        let mut folders: Vec<_> = layout::sensor_folders(header)
            .into_iter()
            .map(|(folder, _)| sequence.join(folder))
            .collect();
        let parents: Vec<_> = folders.iter().filter_map(|f| f.parent()).collect();
        let parents: Vec<_> = parents.into_iter().map(Path::to_owned).collect();
        folders.extend(parents);
        // A folder that is not empty holds something of somebody else's: it stays.
        for folder in folders.iter().chain([&sequence]) {
            let _ = fs::remove_dir(folder);
        }
    }
    let _ = fs::remove_dir(&sequences);
    let tops = [
        layout::README,
        layout::CONFIG,
        layout::ONTOLOGY,
        layout::TREES,
        layout::INSTANCES,
        layout::MANIFEST,
    ];
    let frames = root.join(layout::STATE).join("frames");
    let records = names(&frames).unwrap_or_default();
    let tops = tops.iter().map(|name| root.join(name));
    for path in tops.chain(records.iter().map(|name| frames.join(name))) {
        match fs::remove_file(&path) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(Error::io(path)(e)),
            _ => {}
        }
    }
    remove_leftovers(root, header)
}

/// Removes the temporary files of processes that were killed.
pub(crate) fn remove_leftovers(root: &Path, header: &DatasetHeader) -> Result<(), Error> {
    let state = root.join(layout::STATE);
    let mut paths = owned_files(root, header);
    for folder in [root.to_owned(), state.join("frames"), state] {
        let names = names(&folder).map_err(Error::io(&folder))?;
        paths.extend(names.into_iter().map(|name| folder.join(name)));
    }
    for path in paths {
        let name = path.file_name().map(|n| n.to_string_lossy());
        if name.is_some_and(|n| atomic::is_leftover(&n)) {
            fs::remove_file(&path).map_err(Error::io(&path))?;
        }
    }
    Ok(())
}
