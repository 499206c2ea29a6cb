//! Bringing files to the medium while others are being made.

use std::collections::BTreeSet;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use crate::{Error, Folder, InnerPath};

/// Syncs files of a folder on a thread of its own while others are being made. A sync waits for the
/// disk, not for the processor.
#[derive(Debug)]
pub struct Syncer {
    /// `None` once it is finished.
    queue: Option<Sender<InnerPath>>,
    thread: Option<JoinHandle<Result<BTreeSet<InnerPath>, Error>>>,
    folder: Folder,
}

impl Syncer {
    /// Starts the thread.
    ///
    /// # Errors
    /// [`Error::Io`] if no thread can be started.
    pub fn start(folder: Folder) -> Result<Self, Error> {
        let (queue, files) = channel();
        let of_thread = folder.clone();
        let thread = std::thread::Builder::new()
            .name("sync".to_owned())
            .spawn(move || sync_all(&of_thread, &files))
            .map_err(Error::io(folder.root()))?;
        Ok(Self {
            queue: Some(queue),
            thread: Some(thread),
            folder,
        })
    }

    /// Puts a written file into the queue.
    pub fn push(&self, file: InnerPath) {
        if let Some(queue) = &self.queue {
            // If the thread has failed, the reason is reported when it is waited for.
            let _ = queue.send(file);
        }
    }

    /// Waits until every file of the queue, and every folder on the way to one, is on the medium.
    ///
    /// # Errors
    /// [`Error::Io`] of the first file that cannot be synced, for example because it no longer
    /// exists.
    pub fn finish(mut self) -> Result<(), Error> {
        drop(self.queue.take());
        let Some(thread) = self.thread.take() else {
            return Ok(());
        };
        let folders = match thread.join() {
            Ok(folders) => folders?,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        // The innermost folders come first, because the name of a folder is part of the content of
        // its parent.
        for folder in folders.iter().rev() {
            self.folder.sync_folder(Some(folder))?;
        }
        self.folder.sync_folder(None)
    }
}

impl Drop for Syncer {
    fn drop(&mut self) {
        drop(self.queue.take());
        if let Some(thread) = self.thread.take() {
            // An owner that drops it is not interested in errors.
            let _ = thread.join();
        }
    }
}

/// Syncs files until the queue is closed; returns the folders of all of them.
fn sync_all(folder: &Folder, files: &Receiver<InnerPath>) -> Result<BTreeSet<InnerPath>, Error> {
    let mut folders = BTreeSet::new();
    for file in files {
        folder.sync_file(&file)?;
        let mut above = file.parent();
        while let Some(parent) = above {
            above = parent.parent();
            if !folders.insert(parent) {
                break;
            }
        }
    }
    Ok(folders)
}
