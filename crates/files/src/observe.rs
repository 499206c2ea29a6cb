//! Observers for tests: every operation is announced before it is carried out.
//!
//! An observer that answers with an error makes the operation fail as if the system had reported
//! it, so that each write, sync and rename of a run can fail in turn. One that keeps a log can
//! rebuild what a disk holds after a power cut.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};

/// A change of the file system that is about to be made.
#[derive(Clone, Copy, Debug)]
pub enum Operation<'a> {
    /// A folder is made.
    CreateFolder(&'a Path),
    /// Bytes are appended to a file that bears a temporary name, or none.
    Write {
        /// The file.
        path: &'a Path,
        /// What is appended.
        bytes: &'a [u8],
    },
    /// A file gets its final name, over an older file if there is one.
    Rename {
        /// The temporary name.
        from: &'a Path,
        /// The final name.
        to: &'a Path,
    },
    /// A file is removed.
    RemoveFile(&'a Path),
    /// An empty folder is removed.
    RemoveFolder(&'a Path),
    /// A file's content is brought to the medium.
    SyncFile(&'a Path),
    /// A folder's names are brought to the medium.
    SyncFolder(&'a Path),
}

impl Operation<'_> {
    /// Where it happens: for a rename, the final name.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::CreateFolder(path)
            | Self::Write { path, .. }
            | Self::Rename { to: path, .. }
            | Self::RemoveFile(path)
            | Self::RemoveFolder(path)
            | Self::SyncFile(path)
            | Self::SyncFolder(path) => path,
        }
    }
}

/// Is told of an operation before it is carried out; an error replaces the operation's outcome.
type Observer = Arc<dyn Fn(&Operation<'_>) -> io::Result<()> + Send + Sync>;

static OBSERVERS: RwLock<Vec<(PathBuf, Observer)>> = RwLock::new(Vec::new());

/// A guard that observes until it is dropped.
#[must_use]
#[derive(Debug)]
pub struct ObserverGuard {
    root: PathBuf,
}

/// Observes all operations at `root` and below it, by any thread. Guards that exist at the same
/// time must have different roots.
pub fn observe(
    root: &Path,
    observer: impl Fn(&Operation<'_>) -> io::Result<()> + Send + Sync + 'static,
) -> ObserverGuard {
    let root = root.to_owned();
    OBSERVERS
        .write()
        .unwrap_or_else(PoisonError::into_inner)
        .push((root.clone(), Arc::new(observer)));
    ObserverGuard { root }
}

impl Drop for ObserverGuard {
    fn drop(&mut self) {
        OBSERVERS
            .write()
            .unwrap_or_else(PoisonError::into_inner)
            .retain(|(root, _)| *root != self.root);
    }
}

pub(crate) fn announce(operation: &Operation<'_>) -> io::Result<()> {
    let observers = OBSERVERS.read().unwrap_or_else(PoisonError::into_inner);
    let listening: Vec<Observer> = (observers.iter())
        .filter(|(root, _)| operation.path().starts_with(root))
        .map(|(_, observer)| Arc::clone(observer))
        .collect();
    drop(observers);
    listening
        .iter()
        .try_for_each(|observer| observer(operation))
}
