//! Where a format writes: an output folder that knows which of its files are whole.
//!
//! While a conversion is unfinished, `.nemoral-convert` in the output folder has the request and a
//! record for each step. A record lists the step's files with their checksums and is written
//! *before* them. So every file of the folder is in some record, and a step is done if its record
//! was made for the same request and all files agree with it.
//!
//! A file is removed or replaced only if it is as a record of it says, holds nothing (it is empty,
//! or zeros alone), or is a step's own that is written again: anybody can make records, and with
//! them name files of others.

mod compare;
mod records;
mod request;
mod step;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use nemoral_dataset::FileRecord;
use nemoral_files::{Folder, InnerPath, Lock, Syncer};

use crate::{Error, digest};
use compare::{FileState, changed, compare, is_whole};
use records::{Found, Manifest, Record, Records, inner, look, remove_state, remove_temporaries};
pub(crate) use request::Request;
pub use step::{FileStream, StepFiles, StepNotes};

/// What to do with a folder that holds a conversion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OutputMode {
    /// Refuses it.
    #[default]
    Fresh,
    /// Goes on with it, if it was asked for in the same way.
    Resume,
    /// The same, and replaces one that was asked for in the same way of an earlier state of the
    /// same data set, which had fewer frames or sequences.
    Renew,
    /// Replaces it.
    Overwrite,
}

/// An output folder, open.
#[derive(Debug)]
pub struct Sink {
    folder: Folder,
    request: Request,
    /// The steps of this request that an earlier run has done.
    recorded: BTreeMap<String, Vec<FileRecord>>,
    /// The files of these steps, which may be replaced.
    ours: BTreeSet<InnerPath>,
    /// All files of this request.
    done: BTreeMap<InnerPath, FileRecord>,
    syncer: Syncer,
    _lock: Lock,
}

/// What an output folder turned out to be.
pub(crate) enum OpenOutcome {
    /// To be written.
    Ready(Box<Sink>),
    /// Finished for the same request, and whole.
    Finished {
        /// How many files it holds.
        files: usize,
        /// Their size.
        bytes: u64,
    },
}

impl Sink {
    /// Refuses a folder that may not be written to, and one that cannot be. The request is of a
    /// data set that may be still to be made: its source does not count.
    pub(crate) fn probe(root: &Path, mode: OutputMode, request: &Request) -> Result<(), Error> {
        let folder = Folder::new(root);
        match (Self::admit(&folder, mode)?, mode) {
            (Some(found), OutputMode::Overwrite) => {
                let records = Records::read(&folder, None, found.finished.as_deref())?;
                records.refuse_changed(&folder)?;
            }
            (Some(found), _) => request.compare_data_set(root, &found.request)?,
            (None, _) => {}
        }
        Ok(folder.probe()?)
    }

    /// What a folder holds, unless it may not be written to.
    fn admit(folder: &Folder, mode: OutputMode) -> Result<Option<Found>, Error> {
        let found = look(folder)?;
        match (mode, found) {
            (OutputMode::Fresh, Some(found)) => Err(Error::Exists {
                path: folder.root().to_owned(),
                finished: found.finished.is_some(),
            }),
            (_, found) => Ok(found),
        }
    }

    /// Looks into a folder and takes hold of it.
    pub(crate) fn open(
        root: &Path,
        mode: OutputMode,
        request: Request,
    ) -> Result<OpenOutcome, Error> {
        let folder = Folder::new(root);
        let found = Self::admit(&folder, mode)?;
        let goes_on = match &found {
            Some(found) => request.goes_on(root, &found.request, mode)?,
            None => false,
        };
        let finished = found.and_then(|found| found.finished);
        if goes_on
            && let Some(files) = &finished
            && files.iter().all(|f| is_whole(&folder, f))
        {
            let _lock = records::lock_if_begun(&folder)?;
            remove_temporaries(&folder, None)?;
            remove_state(&folder)?;
            let bytes = files.iter().map(|f| f.bytes).sum();
            let files = files.len();
            return Ok(OpenOutcome::Finished { files, bytes });
        }
        let (lock, records) = records::take_over(&folder, &request, goes_on, finished)?;
        let kept = records.kept;
        let sink = Self {
            syncer: Syncer::start(folder.clone())?,
            folder,
            request,
            ours: kept.values().flatten().map(|f| f.path.clone()).collect(),
            recorded: kept,
            done: BTreeMap::new(),
            _lock: lock,
        };
        Ok(OpenOutcome::Ready(Box::new(sink)))
    }

    /// Writes the files of one step, unless an earlier run has written all of them. What `make`
    /// returns is kept in the step's [`StepNotes`].
    ///
    /// `key` is unique among the format's steps: letters, digits, `_` and `-`.
    ///
    /// # Errors
    /// Those of `make`, after which no file of the step is written, [`Error::Files`],
    /// [`Error::Name`] for a name that is no inner path, and [`Error::Changed`] if somebody else's
    /// file bears the name of one.
    pub fn step(
        &mut self,
        key: &str,
        make: impl FnOnce(&mut StepFiles) -> Result<String, Error>,
    ) -> Result<(), Error> {
        if self.keep(key)? {
            return Ok(());
        }
        let mut files = StepFiles::default();
        let note = make(&mut files)?;
        let files = files.all()?;
        let record = |(path, bytes): &(InnerPath, Vec<u8>)| FileRecord {
            path: path.clone(),
            bytes: bytes.len() as u64,
            blake3: digest(bytes),
        };
        let records: Vec<_> = files.iter().map(record).collect();
        for record in &records {
            self.refuse_others(record)?;
        }
        let record = Record {
            request: self.request.digest(),
            files: records.clone(),
            note,
        };
        record.put(&self.folder, key)?;
        for (path, bytes) in &files {
            self.folder.put(path, bytes)?;
        }
        self.count(records);
        Ok(())
    }

    /// Writes one file piece by piece, unless an earlier run has written it.
    ///
    /// # Errors
    /// Those of `write`, after which there is no such file, and as [`Sink::step`].
    pub fn stream(
        &mut self,
        key: &str,
        path: &str,
        write: impl FnOnce(&mut FileStream) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if self.keep(key)? {
            return Ok(());
        }
        let path = inner(path)?;
        let begun = FileRecord {
            path: path.clone(),
            bytes: 0,
            blake3: String::new(),
        };
        self.refuse_others(&begun)?;
        // It says in which folder there may be a temporary file.
        self.put_record(key, &begun)?;
        let mut stream = FileStream::begin(&self.folder, &path)?;
        write(&mut stream)?;
        let (pending, bytes, blake3) = stream.end()?;
        let file = FileRecord {
            path,
            bytes,
            blake3,
        };
        // The file gets its name after its checksum is recorded, so that it always has one.
        self.put_record(key, &file)?;
        pending.commit()?;
        self.count(vec![file]);
        Ok(())
    }

    /// The record of a step with one file.
    fn put_record(&self, key: &str, file: &FileRecord) -> Result<(), Error> {
        let record = Record {
            request: self.request.digest(),
            files: vec![file.clone()],
            note: String::new(),
        };
        record.put(&self.folder, key)
    }

    /// Refuses to replace a file that this conversion has not written: it is somebody else's.
    fn refuse_others(&self, file: &FileRecord) -> Result<(), Error> {
        let is_ours = self.ours.contains(&file.path) || self.done.contains_key(&file.path);
        if !is_ours && compare(&self.folder, file)? == FileState::Other {
            return Err(changed(&self.folder, &file.path));
        }
        Ok(())
    }

    /// The notes of the steps.
    #[must_use]
    pub fn notes(&self) -> StepNotes {
        StepNotes {
            folder: self.folder.clone(),
        }
    }

    /// Whether an earlier run has done the step; its files then count.
    fn keep(&mut self, key: &str) -> Result<bool, Error> {
        let Some(files) = self.recorded.remove(key) else {
            return Ok(false);
        };
        let whole = files.iter().all(|f| is_whole(&self.folder, f));
        if whole {
            self.count(files);
        }
        Ok(whole)
    }

    fn count(&mut self, files: Vec<FileRecord>) {
        for file in files {
            self.syncer.push(file.path.clone());
            self.done.insert(file.path.clone(), file);
        }
    }

    /// Writes `conversion.json` once all files are on the medium; returns their number and size.
    pub(crate) fn finish(self) -> Result<(usize, u64), Error> {
        self.syncer.finish()?;
        let files: Vec<_> = self.done.into_values().collect();
        let total = (files.len(), files.iter().map(|f| f.bytes).sum());
        let manifest = Manifest {
            request: self.request,
            files,
        };
        manifest.put(&self.folder)?;
        remove_state(&self.folder)?;
        Ok(total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_fails_by_a_name_that_not_every_system_takes() {
        let dir = tempfile::tempdir().expect("a folder");
        let request = Request {
            converter: "x".to_owned(),
            format: "x".to_owned(),
            data_set: None,
            source: String::new(),
            ontology: None,
            min_px: 0,
        };
        let opened = Sink::open(dir.path(), OutputMode::Fresh, request).expect("opened");
        let OpenOutcome::Ready(mut sink) = opened else {
            panic!("there is nothing yet");
        };
        let made = sink.step("step", |files| {
            files.put("00/fine.txt", "fine");
            files.put("00/aux/000000.laz", "none");
            Ok(String::new())
        });
        let error = made.expect_err("a device's name");
        assert!(matches!(error, Error::Name(_)), "{error}");
        assert!(error.to_string().contains("00/aux/000000.laz"), "{error}");
        let made = sink.stream("stream", "con.mcap", |out| out.put("none"));
        assert!(matches!(made, Err(Error::Name(_))), "{made:?}");
        let made = sink.step("a:b", |_| Ok(String::new()));
        assert!(matches!(made, Err(Error::Name(_))), "{made:?}");
        assert!(!dir.path().join("00").exists());
    }
}
