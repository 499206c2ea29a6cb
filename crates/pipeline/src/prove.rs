//! What is refused before the first frame.

use std::sync::Arc;

use crate::config::Config;
use crate::header::header;
use crate::plan::{Cache, Runner, Store};
use crate::{Backend, Error, ForestPlan, InputFiles};

/// Refuses all that [`generate`](crate::generate) refuses before its first frame, short of what
/// depends on the output folder and the GPU: it does the same. What the user should know is the
/// result.
///
/// What stands how densely can be said only of grown plants, so they are grown; `cache` keeps them.
///
/// # Errors
/// The first thing that is wrong.
pub fn check(
    config: &Config,
    inputs: &InputFiles,
    threads: usize,
    cache: Option<Arc<Cache>>,
) -> Result<Option<String>, Error> {
    let forest = ForestPlan::with_inputs(config, inputs, Backend::Cpu)?;
    header(config, &forest)?;
    let store = Store::unlimited().with_cache(cache);
    prove(
        config,
        &forest,
        &Runner::new(forest.plan(), &store, threads),
    )
}

/// Computes all that a world's frames have in common. What the user should know is the result.
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
