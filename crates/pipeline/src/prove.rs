//! The checks before the first frame.

use std::sync::Arc;

use crate::config::{Config, Sequences};
use crate::header::header;
use crate::plan::{Cache, Runner, Store};
use crate::worlds::Worlds;
use crate::{Backend, Error, ForestPlan};

/// Refuses everything that [`generate`](crate::generate) refuses before its first frame, except
/// what depends on the output folder and the GPU. The result is a list of notes for the user.
///
/// The density of a stand can only be checked with grown plants, so these are grown; `cache` may
/// store them.
///
/// # Errors
/// The first error.
pub fn check(
    sequences: &Sequences,
    threads: usize,
    cache: Option<Arc<Cache>>,
) -> Result<Vec<String>, Error> {
    header(sequences, &Backend::Cpu)?;
    let store = Store::unlimited().with_cache(cache);
    let mut worlds = Worlds::new(sequences, &Backend::Cpu, &store, threads);
    let mut notes = Vec::new();
    for number in 0..sequences.len() {
        let world = worlds.enter(number)?;
        notes.extend(worlds.prove(&world)?);
    }
    Ok(notes)
}

/// Computes everything that a world's frames have in common. The result is a list of notes for the
/// user.
pub(crate) fn prove(
    config: &Config,
    forest: &ForestPlan,
    runner: &Runner<'_>,
) -> Result<Option<String>, Error> {
    let trajectory = runner.get(forest.trajectory, ())?;
    if let Some(frames) = trajectory.frames().filter(|&f| f < config.frames) {
        return Err(Error::request(format!(
            "frames = {}: the robot's path has {frames}",
            config.frames
        )));
    }
    runner.get(forest.cameras, ())?;
    runner.get(forest.lidars, ())?;
    runner.get(forest.placement, ())?;
    Ok(trajectory.note().map(str::to_owned))
}

/// Refuses a frame beyond the sequence.
pub(crate) fn within_sequence(config: &Config, frame: u64) -> Result<(), Error> {
    let frames = config.frames;
    if frame < frames {
        return Ok(());
    }
    Err(Error::request(format!(
        "frame {frame}: the sequence has {frames} frames, 0..{frames}; --frames N or --set \
         frames=N makes it longer"
    )))
}
