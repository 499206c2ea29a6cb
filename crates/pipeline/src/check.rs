//! The checks of a request before its first frame.

use std::sync::Arc;

use crate::config::Sequences;
use crate::formats::check_formats;
use crate::header::header;
use crate::plan::{Cache, Store};
use crate::worlds::Worlds;
use crate::{Backend, Error};

/// Refuses everything that [`generate`](crate::generate) refuses before its first frame, except
/// what depends on output folders and the GPU. The result is a list of notes for the user.
///
/// The density of a stand can only be checked with grown plants, so these are grown; `cache` may
/// store them. As that takes a second a world, `begin` is told the number of each sequence before
/// it is looked at.
///
/// # Errors
/// The first error.
pub fn check(
    sequences: &Sequences,
    threads: usize,
    cache: Option<Arc<Cache>>,
    mut begin: impl FnMut(u32),
) -> Result<Vec<String>, Error> {
    check_formats(&header(sequences, &Backend::Cpu)?)?;
    let store = Store::unlimited().with_cache(cache);
    let worlds = Worlds::new(sequences, &Backend::Cpu, &store, threads);
    let mut notes = Vec::new();
    for number in 0..sequences.len() {
        begin(number);
        let world = worlds.enter(number)?;
        notes.extend(worlds.preflight(&world)?);
    }
    Ok(notes)
}
