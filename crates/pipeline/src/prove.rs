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
    let ground = runner.get(forest.ground_model, ())?;
    let on_trails = ground.measured_trees_on_trails();
    let of_plot = (on_trails > 0).then(|| {
        format!(
            "{on_trails} trees of the stem map stand on trails; trails.enabled = false leaves \
             trails out"
        )
    });
    let notes: Vec<String> = trajectory
        .note()
        .map(str::to_owned)
        .into_iter()
        .chain(ground.note_of_plot())
        .chain(of_plot)
        .chain(runner.get(forest.assets, ())?.models.notes.iter().cloned())
        .collect();
    Ok((!notes.is_empty()).then(|| notes.join("; ")))
}

/// Refuses a frame beyond the sequence.
pub(crate) fn within_sequence(config: &Config, frame: u64) -> Result<(), Error> {
    let frames = config.frames;
    if frame < frames {
        return Ok(());
    }
    Err(Error::request(format!(
        "frame {frame}: the sequence has {frames} frames, counted from 0; the config's `frames` \
         makes it longer"
    )))
}
