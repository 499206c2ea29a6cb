//! The state folder `.nemoral/`, which exists while a data set is unfinished.

use std::collections::BTreeMap;

use nemoral_files::{EntryKind, Folder, Lock, is_temporary_name};
use nemoral_scene::excerpt;
use serde::{Deserialize, Serialize};

use crate::{DatasetHeader, Error, FORMAT_VERSION, FrameRecord, layout, limits, seal};

/// `.nemoral/header.json`, sealed.
#[derive(Serialize, Deserialize)]
struct State {
    format_version: u32,
    header: DatasetHeader,
}

/// Makes the folders and takes the lock.
pub(crate) fn lock(folder: &Folder) -> Result<Lock, Error> {
    folder.create_folders(&layout::inner(layout::STATE_FRAMES))?;
    Ok(folder.lock(&layout::inner(layout::STATE_LOCK))?)
}

/// Writes the header and waits until it is on the medium, so that there is never a frame's file
/// without the header that it belongs to.
pub(crate) fn put_header(folder: &Folder, header: &DatasetHeader) -> Result<(), Error> {
    let state = State {
        format_version: FORMAT_VERSION,
        header: header.clone(),
    };
    let json = serde_json::to_string(&state).expect("a header has string keys");
    let path = layout::inner(layout::STATE_HEADER);
    folder.put_synced(&path, seal::seal(&json).as_bytes())?;
    Ok(folder.sync_folder(None)?)
}

/// The header, if there is one that is whole and valid.
pub(crate) fn header(folder: &Folder) -> Result<Option<DatasetHeader>, Error> {
    let path = layout::inner(layout::STATE_HEADER);
    let text = match folder.read_text(&path, limits::HEADER_BYTES) {
        Err(e) if e.is_not_found() => return Ok(None),
        Err(nemoral_files::Error::NotText { .. }) => return Ok(None),
        text => text?,
    };
    let Some(json) = seal::unseal(&text) else {
        return Ok(None);
    };
    let malformed = |message: String| Error::malformed(path.below(folder.root()), message);
    let unread = |e: serde_json::Error| malformed(excerpt(&e.to_string(), 300));
    let state: State = serde_json::from_str(json).map_err(unread)?;
    if state.format_version != FORMAT_VERSION {
        return Err(malformed(format!(
            "format_version is {}, this program reads {FORMAT_VERSION}",
            state.format_version
        )));
    }
    (state.header.validate()).map_err(|e| malformed(e.to_string()))?;
    Ok(Some(state.header))
}

/// Whether the state folder has only files that a writer makes before its header is whole.
pub(crate) fn has_just_begun(folder: &Folder) -> Result<bool, Error> {
    let known =
        |name: &str| is_temporary_name(name) || ["frames", "header.json", "lock"].contains(&name);
    let state = folder.entries_of(&layout::inner(layout::STATE))?;
    let frames = folder.entries_of(&layout::inner(layout::STATE_FRAMES))?;
    Ok(frames.is_empty()
        && state
            .iter()
            .all(|entry| known(&entry.name) && entry.kind != EntryKind::Other))
}

/// Writes a frame's record, or replaces one that is no longer valid by `None`.
pub(crate) fn put_record(
    folder: &Folder,
    sequence: u32,
    index: u64,
    record: Option<&FrameRecord>,
) -> Result<(), Error> {
    let json = serde_json::to_string(&record).expect("a record has string keys");
    let path = layout::inner(&layout::frame_record(sequence, index));
    Ok(folder.put(&path, seal::seal(&json).as_bytes())?)
}

/// The records of frames; `None` for a frame whose record is no longer valid, was damaged by a
/// power cut, or does not fit this header.
pub(crate) fn records(
    folder: &Folder,
    header: &DatasetHeader,
) -> Result<BTreeMap<(u32, u64), Option<FrameRecord>>, Error> {
    let mut records = BTreeMap::new();
    for entry in folder.entries_of(&layout::inner(layout::STATE_FRAMES))? {
        let Some(at) = layout::frame_of_record(&entry.name) else {
            continue;
        };
        let path = layout::inner(&layout::frame_record(at.0, at.1));
        let record = match folder.read_text(&path, limits::RECORD_BYTES) {
            Ok(text) => seal::unseal(&text)
                .and_then(|json| serde_json::from_str::<Option<FrameRecord>>(json).ok())
                .flatten(),
            Err(nemoral_files::Error::NotText { .. } | nemoral_files::Error::TooLarge { .. }) => {
                None
            }
            Err(e) => return Err(e.into()),
        };
        let record = record.filter(|r| {
            (r.sequence, r.index) == at
                && header.sequence(at.0).is_some_and(|s| r.validate(s).is_ok())
        });
        records.insert(at, record);
    }
    Ok(records)
}

/// Removes the state folder when the data set is finished. If it contains files of others, these
/// and the folder stay.
pub(crate) fn remove(folder: &Folder) -> Result<(), Error> {
    let frames = layout::inner(layout::STATE_FRAMES);
    for entry in folder.entries_of(&frames)? {
        let is_ours =
            layout::frame_of_record(&entry.name).is_some() || is_temporary_name(&entry.name);
        let path = frames.join(&entry.name).ok();
        if let Some(path) = path.filter(|_| is_ours && entry.kind == EntryKind::File) {
            folder.remove_file(&path)?;
        }
    }
    folder.remove_empty_folder(&frames)?;
    // The header is removed last: without it nothing says what the rest is, and with it `check`
    // says that a writer is at work.
    for name in [layout::STATE_LOCK, layout::STATE_HEADER] {
        folder.remove_file(&layout::inner(name))?;
    }
    folder.remove_empty_folder(&layout::inner(layout::STATE))?;
    Ok(())
}
