//! This crate reads and writes files safely: reads are bounded, names cannot leave their folder,
//! and files appear whole or not at all.
//!
//! A data set, a config or a mesh may come from a stranger, so nothing that a file says is trusted
//! with a path or with an amount of memory:
//! - [`read`] and [`read_text`] read regular files only, up to a limit that the caller gives;
//!   [`Folder::open`] is for what is too large for memory.
//! - An [`InnerPath`] is a name below a folder: it has no `..`, no root, no drive, no separator
//!   but `/`, so it cannot leave the folder on any system.
//! - A [`Folder`] does everything below one root by inner paths, and follows no link there. The
//!   root itself may be reached through links.
//! - [`Folder::put`] and [`PendingFile`] write under a temporary name in the same folder, then
//!   rename: after an error, a kill or a full disk the final name holds what it held before.
//! - A [`Syncer`] brings written files to the medium on a thread of its own, so that a power cut
//!   after [`Syncer::finish`] damages none of them.
//!
//! A process that changes the folder at the same time is not guarded against, because whoever can
//! write there does not need to deceive us.
//!
//! ```
//! use nemoral_files::{Folder, InnerPath};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let dir = tempfile::tempdir()?;
//! let folder = Folder::new(dir.path());
//! let name = InnerPath::new("sequences/00/poses.txt")?;
//! folder.put(&name, b"1 0 0 0 0 1 0 0 0 0 1 0\n")?;
//! assert_eq!(folder.read(&name, 1_000)?.len(), 24);
//! assert!(folder.read(&name, 10).is_err(), "more than the caller has room for");
//! assert!(InnerPath::new("../poses.txt").is_err(), "outside");
//! # Ok(())
//! # }
//! ```
//!
//! With the feature `observe`, tests are told of every operation before it is carried out and can
//! make it fail (module `observe`). Without it nothing of that is compiled.

#![allow(
    clippy::disallowed_methods,
    reason = "this crate is what all others use in their place"
)]

mod error;
mod folder;
mod inner_path;
#[cfg(feature = "observe")]
pub mod observe;
mod operation;
mod pending;
mod read;
mod syncer;

pub use error::{Error, PathError};
pub use folder::{Entry, EntryKind, Folder, Lock};
pub use inner_path::{DEVICE_NAMES, InnerPath};
pub use pending::{PendingFile, is_temporary_name, scratch_beside, write};
pub use read::{is_same, read, read_text};
pub use syncer::Syncer;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
