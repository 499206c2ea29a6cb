//! The checks of a world before its first frame.

use crate::config::Config;
use crate::plan::Runner;
use crate::{Error, ForestPlan};

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
