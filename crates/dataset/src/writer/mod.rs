//! Writing data sets: from several threads, and so that a run that was killed at any moment can be
//! resumed.

mod frame;
mod sequence;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use nemoral_files::{Folder, Lock, Syncer};
use nemoral_scene::Semantic;

pub(crate) use self::sequence::Drive;

use crate::formats::{data_card, images, ontology_yaml};
use crate::manifest::ranges;
use crate::output::{self, Content, compare, state};
use crate::{
    Dataset, DatasetHeader, Error, FORMAT_VERSION, FileRecord, FrameRecord, Manifest, SequenceSpec,
    TrackRecord, layout,
};

/// What to do with an output folder that is not empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OpenMode {
    /// The folder must be new or empty.
    #[default]
    Fresh,
    /// Continue the data set in the folder, finished or not, if its header is equal; like `Fresh`
    /// if the folder is new or empty.
    Resume,
    /// Remove the data set in the folder first, but no other files; like `Fresh` if the folder is
    /// new or empty.
    Overwrite,
}

/// Writes a data set into a folder.
///
/// While it is unfinished the folder holds `.nemoral/`: the header, a record for each whole frame,
/// and a lock against a second writer. [`Writer::finish`] moves all of it into `dataset.json`. A
/// writer that is dropped, or whose process is killed, leaves a folder that [`OpenMode::Resume`]
/// can continue.
///
/// That holds after a power cut, too. The header is on the medium before the first frame is begun.
/// The files of frames are synced in the background; those that a power cut damages are found by
/// their checksums and made again. All files that `dataset.json` names are on the medium before it
/// gets its name.
#[derive(Debug)]
pub struct Writer {
    folder: Folder,
    header: DatasetHeader,
    class_ids: [u8; Semantic::ALL.len()],
    records: Mutex<BTreeMap<(u32, u64), FrameRecord>>,
    /// The sequences whose own files are written, with these.
    drives: Mutex<BTreeMap<u32, (TrackRecord, Vec<FileRecord>)>>,
    syncer: Mutex<Syncer>,
    /// It is held and not used.
    _lock: Lock,
}

impl Writer {
    /// Tests whether [`Writer::create`] would accept this folder and header. It leaves nothing
    /// behind.
    ///
    /// # Errors
    /// Those of [`Writer::create`].
    pub fn probe(out: &Path, mode: OpenMode, header: &DatasetHeader) -> Result<(), Error> {
        header.validate()?;
        let folder = Folder::new(out);
        Self::admit(&folder, mode, header, &output::look(&folder)?)?;
        Ok(folder.probe()?)
    }

    /// Decides whether this folder may be written to.
    fn admit(
        folder: &Folder,
        mode: OpenMode,
        header: &DatasetHeader,
        content: &Content,
    ) -> Result<(), Error> {
        let out = folder.root();
        if let (Content::Dataset { header, .. }, OpenMode::Resume | OpenMode::Overwrite) =
            (content, mode)
        {
            // A link among the folders is refused here, before anything is changed.
            output::owned_files(folder, header)?;
        }
        match (content, mode) {
            (Content::Dataset { finished, .. }, OpenMode::Fresh) => Err(Error::Exists {
                path: out.to_owned(),
                finished: finished.is_some(),
            }),
            (Content::Dataset { header: found, .. }, OpenMode::Resume) => {
                // A data set may get further sequences.
                let mut known = header.clone();
                (known.sequences).retain(|s| found.sequence(s.number).is_some());
                compare::compare(out, found, &known)
            }
            _ => Ok(()),
        }
    }

    /// Opens an output folder, and makes it if necessary. Nothing is changed if there is an error.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a header with impossible names, sizes or mounts; [`Error::Foreign`],
    /// [`Error::Exists`], [`Error::Damaged`] and [`Error::Unowned`] for a folder that may not be
    /// written to; [`Error::Mismatch`] for a resume with another header; [`Error::Busy`];
    /// [`Error::Malformed`] for a link where a file or folder of the data set should be; and
    /// [`Error::Io`].
    pub fn create(out: &Path, mode: OpenMode, header: DatasetHeader) -> Result<Self, Error> {
        header.validate()?;
        let folder = Folder::new(out);
        Self::admit(&folder, mode, &header, &output::look(&folder)?)?;
        let lock = state::lock(&folder)?;
        // Another writer may have ended between the first look and the lock.
        let content = output::look(&folder)?;
        Self::admit(&folder, mode, &header, &content)?;
        let mut records = BTreeMap::new();
        if let Content::Dataset {
            finished,
            header: found,
        } = content
        {
            if mode == OpenMode::Overwrite {
                output::clear(&folder, &found)?;
            } else {
                output::remove_leftovers(&folder, &found)?;
                let of_manifest = finished.map(|m| m.frames).unwrap_or_default();
                records.extend(of_manifest.into_iter().map(|f| ((f.sequence, f.index), f)));
                for (at, record) in state::records(&folder, &found)? {
                    match record {
                        Some(record) => records.insert(at, record),
                        None => records.remove(&at),
                    };
                }
            }
        }
        // This includes the files of a writer that was killed before its header was whole.
        output::remove_leftovers(&folder, &header)?;
        state::put_header(&folder, &header)?;
        Ok(Self {
            class_ids: images::class_ids(&header.ontology),
            header,
            records: Mutex::new(records),
            drives: Mutex::default(),
            syncer: Mutex::new(Syncer::start(folder.clone())?),
            folder,
            _lock: lock,
        })
    }

    /// Whether this frame is here, whole, and made from this key. It reads the files and compares
    /// sizes and checksums.
    #[must_use]
    pub fn has_frame(&self, sequence: u32, index: u64, frame_key: &[u8; 32]) -> bool {
        let record = self.lock().get(&(sequence, index)).cloned();
        record.is_some_and(|r| r.key == hex(frame_key) && self.is_whole(&r))
    }

    /// Whether a frame's files agree with their records.
    fn is_whole(&self, record: &FrameRecord) -> bool {
        record.files.iter().all(|f| f.read(&self.folder).is_ok())
    }

    /// What decides the bytes.
    #[must_use]
    pub fn header(&self) -> &DatasetHeader {
        &self.header
    }

    /// The frames recorded so far by (sequence, index), those of earlier runs included: each of
    /// their sequences must be [written](Self::write_sequence) before the end.
    #[must_use]
    pub fn frames(&self) -> Vec<(u32, u64)> {
        self.lock().keys().copied().collect()
    }

    /// Records a whole frame and queues its files to be synced.
    fn enter(&self, record: FrameRecord) -> Result<(), Error> {
        state::put_record(&self.folder, record.sequence, record.index, Some(&record))?;
        let syncer = self.syncer.lock().unwrap_or_else(PoisonError::into_inner);
        for file in &record.files {
            syncer.push(file.path.clone());
        }
        drop(syncer);
        self.lock().insert((record.sequence, record.index), record);
        Ok(())
    }

    /// Writes the files of the whole data set, `dataset.json` last, and removes `.nemoral/`.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a sequence with frames was not [written](Self::write_sequence);
    /// [`Error::Io`].
    pub fn finish(self) -> Result<Manifest, Error> {
        let frames: Vec<FrameRecord> = self.lock().values().cloned().collect();
        let mut manifest = Manifest {
            format_version: FORMAT_VERSION,
            header: self.header.clone(),
            tracks: Vec::new(),
            files: Vec::new(),
            frames,
        };
        for (mut track, files) in std::mem::take(&mut *self.drives()).into_values() {
            let first = (manifest.frames).partition_point(|f| f.sequence < track.sequence);
            let of_track = manifest.frames[first..].iter();
            let of_track = of_track.take_while(|f| f.sequence == track.sequence);
            track.frames = ranges(of_track.map(|f| f.index));
            manifest.tracks.push(track);
            manifest.files.extend(files);
        }
        for (path, asked) in self.header.inputs() {
            let content = self.header.input_files.get(path).filter(|bytes| {
                // A file that differs from its record would make the data set unreadable.
                FileRecord::of(path.clone(), bytes) == *asked
            });
            let content = content.ok_or_else(|| {
                let allowed = "the content that the sequences' inputs record";
                Error::invalid(format!("input_files.{path}"), "none, or another", allowed)
            })?;
            let record = FileRecord::put(&self.folder, path.clone(), content)?;
            manifest.files.push(record);
        }
        let ontology = ontology_yaml::encode(&self.header, &manifest.point_classes());
        for (name, text) in [
            (layout::README, data_card::encode(&manifest)),
            (layout::CONFIG, self.header.config_toml.clone()),
            (layout::ONTOLOGY, ontology),
        ] {
            let record = FileRecord::put(&self.folder, layout::inner(name), text.as_bytes())?;
            manifest.files.push(record);
        }
        manifest.files.sort_by(|a, b| a.path.cmp(&b.path));
        // A resumed folder may hold frames that no track knows.
        manifest.validate()?;
        let syncer = self
            .syncer
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        // Files of earlier runs are synced too, as nothing says how those runs ended. Syncing a
        // file twice costs little.
        for file in manifest
            .files
            .iter()
            .chain(manifest.frames.iter().flat_map(|f| &f.files))
        {
            syncer.push(file.path.clone());
        }
        syncer.finish()?;
        let path = layout::inner(layout::MANIFEST);
        self.folder
            .put_synced(&path, manifest.to_json().as_bytes())?;
        state::remove(&self.folder)?;
        Ok(manifest)
    }

    /// Takes over a frame of another data set with an equal header, if it is whole there and not
    /// yet here.
    pub(crate) fn adopt(&self, from: &Dataset, record: &FrameRecord) -> Result<(), Error> {
        let ours = self.lock().get(&(record.sequence, record.index)).cloned();
        if let Some(ours) = ours {
            if ours != *record {
                return Err(Error::Mismatch {
                    path: from.root().to_owned(),
                    field: format!("frame {} of sequence {}", record.index, record.sequence),
                    found: record.key.clone(),
                    asked: ours.key.clone(),
                });
            }
            if self.is_whole(&ours) {
                return Ok(());
            }
        }
        for file in &record.files {
            let bytes = file.read(from.folder())?;
            self.folder.put(&file.path, &bytes)?;
        }
        self.enter(record.clone())
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<(u32, u64), FrameRecord>> {
        // Every insertion and removal is one step, so a panic of another thread leaves the map
        // consistent.
        self.records.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What decides the bytes of a sequence.
    fn sequence(&self, number: u32) -> Result<&SequenceSpec, Error> {
        let known = self.header.sequence(number);
        known.ok_or_else(|| Error::invalid("sequence", number, "one of the header's"))
    }

    fn drives(&self) -> MutexGuard<'_, BTreeMap<u32, (TrackRecord, Vec<FileRecord>)>> {
        self.drives.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn hex(key: &[u8; 32]) -> String {
    key.iter().map(|b| format!("{b:02x}")).collect()
}
