//! Output folders: what they contain, and which files belong to a data set.
//!
//! A file belongs to a data set if a whole `dataset.json` or a sealed header says so, by the layout
//! of the sensors that it names. In a folder with neither, no file belongs to a data set, whatever
//! its name is.

pub(crate) mod compare;
pub(crate) mod state;

use std::collections::BTreeSet;

use nemoral_files::{EntryKind, Folder, InnerPath, is_temporary_name};

use crate::{DatasetHeader, Error, Manifest, SequenceSpec, layout};

/// What an output folder holds.
pub(crate) enum Content {
    /// Nothing: the folder is empty or missing, or contains what a writer leaves that was killed at
    /// its start.
    Nothing,
    /// A data set, finished or not.
    Dataset {
        /// `dataset.json`, if it is finished.
        finished: Option<Box<Manifest>>,
        /// The header that it is made with.
        header: Box<DatasetHeader>,
    },
}

/// Looks into a folder without changing it.
pub(crate) fn look(folder: &Folder) -> Result<Content, Error> {
    let entries = folder.entries()?;
    let has = |name: &str| entries.iter().any(|e| e.name == name);
    let (is_finished, has_state) = (has(layout::MANIFEST), has(layout::STATE));
    if !is_finished && !has_state {
        return match entries.first() {
            None => Ok(Content::Nothing),
            Some(found) => Err(Error::Foreign {
                path: folder.root().to_owned(),
                found: found.name.clone(),
            }),
        };
    }
    let header = if has_state {
        state::header(folder)?
    } else {
        None
    };
    let finished = is_finished.then(|| Manifest::read(folder)).transpose();
    match (finished, header) {
        (Ok(Some(file)), header) => Ok(Content::Dataset {
            header: Box::new(header.unwrap_or_else(|| file.manifest.header.clone())),
            finished: Some(Box::new(file.manifest)),
        }),
        // The run continues from the records of frames and makes a new `dataset.json`.
        (Ok(None) | Err(_), Some(header)) => Ok(Content::Dataset {
            finished: None,
            header: Box::new(header),
        }),
        (Err(cause), None) => Err(Error::Damaged {
            path: folder.root().to_owned(),
            cause: cause.to_string(),
        }),
        (Ok(None), None) if entries.len() == 1 && state::has_just_begun(folder)? => {
            Ok(Content::Nothing)
        }
        (Ok(None), None) => Err(Error::Unowned {
            path: folder.root().to_owned(),
        }),
    }
}

/// The files below `sequences`, `poses` and `inputs` that a data set with this header owns by the
/// layout, whether or not they are recorded, including temporary files of killed processes. Links
/// and folders with such names do not count.
pub(crate) fn owned_files(
    folder: &Folder,
    header: &DatasetHeader,
) -> Result<Vec<InnerPath>, Error> {
    let mut owned = Vec::new();
    for (sequence, spec) in sequences(folder, header)? {
        for (of_sensor, extension) in layout::sensor_folders(spec) {
            let of_sensor = layout::inner(&format!("{sequence}/{of_sensor}"));
            owned.extend(files(folder, &of_sensor, |name| {
                layout::is_frame_file(name, extension)
            })?);
        }
        let is_of_sequence = |name: &str| layout::SEQUENCE_FILES.contains(&name);
        owned.extend(files(folder, &sequence, is_of_sequence)?);
        for of_imu in imu_folders(&sequence) {
            owned.extend(files(folder, &of_imu, |name| {
                let path = of_imu.join(name);
                path.is_ok_and(|path| layout::IMU_FILES.iter().any(|f| path.as_str().ends_with(f)))
            })?);
        }
    }
    let inputs = header.inputs();
    let is_input = |name: &str| inputs.keys().any(|path| path.file_name() == name);
    owned.extend(files(folder, &layout::inner(layout::INPUTS), is_input)?);
    let all_poses = layout::inner(layout::ALL_POSES);
    owned.extend(files(folder, &all_poses, layout::is_kitti_poses)?);
    Ok(owned)
}

/// The folders of the header's sequences.
fn sequences<'a>(
    folder: &Folder,
    header: &'a DatasetHeader,
) -> Result<Vec<(InnerPath, &'a SequenceSpec)>, Error> {
    let entries = folder.entries_of(&layout::inner(layout::SEQUENCES))?;
    let number = |name: &str| layout::sequence_of_name(name);
    let known = (entries.iter()).filter_map(|e| header.sequence(number(&e.name)?));
    Ok(known
        .map(|s| (layout::inner(&layout::sequence_folder(s.number)), s))
        .collect())
}

/// The folders of a sequence's inertial measurement unit.
fn imu_folders(sequence: &InnerPath) -> BTreeSet<InnerPath> {
    let files = layout::IMU_FILES.map(|file| layout::inner(&format!("{sequence}/{file}")));
    files.iter().filter_map(InnerPath::parent).collect()
}

/// The regular files of a folder whose names are in the layout, temporary ones included.
fn files(
    folder: &Folder,
    below: &InnerPath,
    is_ours: impl Fn(&str) -> bool,
) -> Result<Vec<InnerPath>, Error> {
    let entries = folder.entries_of(below)?.into_iter();
    let ours = entries
        .filter(|e| e.kind == EntryKind::File && (is_ours(&e.name) || is_temporary_name(&e.name)));
    Ok(ours.filter_map(|e| below.join(&e.name).ok()).collect())
}

/// Removes a data set and nothing else, with the folders that are empty then. The state folder
/// stays, so that the folder counts as a data set at every moment.
pub(crate) fn clear(folder: &Folder, header: &DatasetHeader) -> Result<(), Error> {
    state::put_header(folder, header)?;
    // From now on the data set is unfinished.
    folder.remove_file(&layout::inner(layout::MANIFEST))?;
    for path in owned_files(folder, header)? {
        folder.remove_file(&path)?;
    }
    let mut folders = BTreeSet::new();
    for (sequence, spec) in sequences(folder, header)? {
        for (of_sensor, _) in layout::sensor_folders(spec) {
            let of_sensor = layout::inner(&format!("{sequence}/{of_sensor}"));
            folders.extend(of_sensor.parent());
            folders.insert(of_sensor);
        }
        folders.extend(imu_folders(&sequence));
        folders.insert(sequence);
    }
    folders.insert(layout::inner(layout::SEQUENCES));
    folders.insert(layout::inner(layout::ALL_POSES));
    folders.insert(layout::inner(layout::INPUTS));
    // The innermost folders come first. A folder that is not empty contains files of others and
    // stays.
    for path in folders.iter().rev() {
        folder.remove_empty_folder(path)?;
    }
    for name in layout::TOP_FILES {
        folder.remove_file(&layout::inner(name))?;
    }
    let records = files(folder, &layout::inner(layout::STATE_FRAMES), |name| {
        layout::frame_of_record(name).is_some()
    })?;
    for path in records {
        folder.remove_file(&path)?;
    }
    remove_leftovers(folder, header)
}

/// Removes the temporary files of processes that were killed.
pub(crate) fn remove_leftovers(folder: &Folder, header: &DatasetHeader) -> Result<(), Error> {
    let mut paths = owned_files(folder, header)?;
    for state in [layout::STATE_FRAMES, layout::STATE] {
        paths.extend(files(folder, &layout::inner(state), |_| false)?);
    }
    for entry in folder.entries()? {
        if entry.kind == EntryKind::File && is_temporary_name(&entry.name) {
            paths.extend(InnerPath::new(entry.name).ok());
        }
    }
    for path in paths.iter().filter(|p| is_temporary_name(p.file_name())) {
        folder.remove_file(path)?;
    }
    Ok(())
}
