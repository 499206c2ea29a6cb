//! What the files of a sequence hold that belong to no frame: the poses of its drive, and the
//! inventory of its world.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU64, Ordering};

use nemoral_dataset::Track;
use nemoral_scene::{ChunkCoord, DeadwoodRecord, ObjectRecord, RigidTransform, TreeRecord};
use nemoral_seed::Key;
use nemoral_trajectory::{Navigation, TrackPoint};

use crate::chunks::ChunkManager;
use crate::config::{Config, RobotPath};
use crate::plan::{ForestCoordinate, Runner};
use crate::recording::scene::visible_chunks;
use crate::world::trajectory::{RobotTrajectory, Surroundings};
use crate::{Error, ForestPlan};

/// The number of poses that a thread computes at a time. Frames that are chosen need the geometry
/// around them, so that chunks are freed after few of them.
const BLOCK: u64 = 256;
const CHOSEN_BLOCK: u64 = 8;
/// The number of blocks that each thread computes before chunks are freed.
const ROUND: u64 = 4;

/// The poses of the whole sequence, whichever frames are made here: only that in the middle of each
/// frame's track, computed by all threads.
pub(crate) fn track(
    (sequence, config): (u32, &Config),
    forest: &ForestPlan,
    runner: &Runner<'_>,
) -> Result<Track, Error> {
    let manager = ChunkManager::new(config.chunks.clone());
    let trajectory = runner.get(forest.trajectory, ())?;
    let pose = |frame: u64| {
        let surroundings = Surroundings {
            ground: runner.demand(forest.ground),
            objects: runner.demand(forest.objects),
        };
        let pose = match forest.balance_choice {
            Some(choice) => runner.get(choice, frame)?.world_from_body,
            None => trajectory.pose(frame, 0.0, surroundings)?,
        };
        Ok::<_, Error>((trajectory.time_s(frame), pose))
    };
    let pilot = forest.balance_pilot.map(|pilot| runner.get(pilot, ()));
    let balance = pilot.transpose()?.map(|pilot| pilot.record());
    let block_of = if balance.is_some() {
        CHOSEN_BLOCK
    } else {
        BLOCK
    };
    let round = ROUND * block_of;
    let mut poses = Vec::new();
    while (poses.len() as u64) < config.frames {
        let first = poses.len() as u64;
        let end = (first + round * runner.threads() as u64).min(config.frames);
        let next = AtomicU64::new(first);
        let blocks = std::thread::scope(|scope| {
            let work = || {
                let mut done = Vec::new();
                loop {
                    let from = next.fetch_add(block_of, Ordering::Relaxed);
                    if from >= end {
                        return Ok::<_, Error>(done);
                    }
                    let block = (from..end.min(from + block_of)).map(pose);
                    done.push((from, block.collect::<Result<Vec<_>, _>>()?));
                }
            };
            let workers: Vec<_> = (0..runner.threads()).map(|_| scope.spawn(work)).collect();
            let done = workers
                .into_iter()
                .map(|w| w.join().unwrap_or(Err(Error::StagePanicked)));
            done.collect::<Result<Vec<_>, Error>>()
        })?;
        let blocks: BTreeMap<u64, Vec<_>> = blocks.into_iter().flatten().collect();
        poses.extend(blocks.into_values().flatten());
        if let Some((_, body)) = poses.last() {
            manager.evict(runner.store(), body.translation_m.truncate(), &[]);
        }
    }
    let estimated = if config.navigation.enabled {
        estimated(config, &trajectory, &poses)?
    } else {
        Vec::new()
    };
    Ok(Track {
        sequence,
        poses,
        estimated,
        balance,
        stands: matches!(config.robot.path, RobotPath::Stations(_)),
        lines: (trajectory.trajectory.lines().into_iter())
            .filter(|first| *first < config.frames)
            .collect(),
        imu: None,
    })
}

/// What the navigation system makes of poses.
fn estimated(
    config: &Config,
    trajectory: &RobotTrajectory,
    poses: &[(f64, RigidTransform)],
) -> Result<Vec<RigidTransform>, Error> {
    let mut params = config.navigation_params();
    // Stations are put up and found one by one.
    if matches!(config.robot.path, RobotPath::Stations(_)) {
        params.correlation_s = 0.0;
    }
    if params.loop_m == 0.0 {
        params.loop_m = trajectory.trajectory.loop_m().unwrap_or(0.0);
    }
    let navigation = Navigation::new(params, Key::world(config.seed));
    let navigation = navigation.map_err(|e| Error::request(format!("navigation.{e}")))?;
    let mut truth = TrackPoint::along(poses);
    for place in &mut truth {
        if let Some(travelled_m) = trajectory.trajectory.travelled_m(place.time_s) {
            place.travelled_m = travelled_m;
        }
    }
    Ok(navigation.estimated(&truth))
}

/// The inventory of a world.
#[derive(Debug, Default)]
pub(crate) struct Inventory {
    pub(crate) trees: Vec<TreeRecord>,
    pub(crate) deadwood: Vec<DeadwoodRecord>,
    pub(crate) objects: Vec<ObjectRecord>,
}

/// Every object in a chunk that is visible from one of the frames, in order of id.
pub(crate) fn inventory(
    config: &Config,
    forest: &ForestPlan,
    runner: &Runner<'_>,
    frames: impl Iterator<Item = u64>,
) -> Result<Inventory, Error> {
    let chunks = &config.chunks;
    let mut visible: BTreeSet<ChunkCoord> = BTreeSet::new();
    for frame in frames {
        let position = runner
            .get(forest.pose, frame)?
            .world_from_body()
            .translation_m
            .truncate();
        visible.extend(visible_chunks(
            position,
            chunks.visible_radius_m,
            chunks.size_m,
        ));
    }
    let assets = runner.get(forest.assets, ())?;
    let objects = runner.demand(forest.objects);
    let mut all = Inventory::default();
    let visible: Vec<ChunkCoord> = visible.into_iter().collect();
    for column in visible.chunk_by(|a, b| a.x == b.x) {
        for object in objects.all(column)?.iter().flat_map(|chunk| &chunk.0) {
            all.objects.push(assets.object_record(object));
            all.trees.extend(assets.tree_record(object));
            all.deadwood.extend(assets.deadwood_record(object));
        }
        // What is more than two columns back is no longer needed.
        (runner.store())
            .retain(|_, at| !matches!(at, ForestCoordinate::Chunk(c) if c.x < column[0].x - 2));
    }
    Ok(all)
}
