//! The robot's trajectory, on the ground and between the objects of the forest.

use std::sync::Arc;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, FlatSurface, ObjectKind, RigidTransform};
use nemoral_stand::{SceneObject, SceneObjects};
use nemoral_trails::TrailPath;
use nemoral_trajectory::{Obstacle, Obstacles, PathPose, Polyline, Trajectory};
use nemoral_water::ChunkWater;

use super::chunk_ground::ChunkGround;
pub use super::windthrow::LOG_REACH_M;
use crate::Error;
use crate::plan::Demand;

/// The robot's trajectory, a pure function of the frame's number.
#[derive(Debug)]
pub struct RobotTrajectory {
    /// The path, and how it is driven.
    pub trajectory: Trajectory,
    /// A note for the user: that there is no trail to follow.
    pub note: Option<String>,
    /// Side of a chunk.
    pub chunk_size_m: f64,
    /// Whether there may be streams or ponds in the way.
    pub has_water: bool,
}

/// The ground around the robot, and the objects on it.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// The ground of any chunk.
    pub ground: Demand<'a, ChunkGround>,
    /// The objects of any chunk.
    pub objects: Demand<'a, SceneObjects>,
}

impl RobotTrajectory {
    /// A note for the user about the path that was found.
    #[must_use]
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// The number of frames of the path, if it ends.
    #[must_use]
    pub fn frames(&self) -> Option<u64> {
        self.trajectory.frames()
    }

    /// A frame's time, seconds.
    #[must_use]
    pub fn time_s(&self, frame: u64) -> f64 {
        self.trajectory.time_s(frame)
    }

    /// The body's world pose `offset_s` after a frame's time.
    ///
    /// # Errors
    /// If the ground or the objects around cannot be made.
    pub fn pose(
        &self,
        frame: u64,
        offset_s: f64,
        surroundings: Surroundings<'_>,
    ) -> Result<RigidTransform, Error> {
        let chunk_size_m = self.chunk_size_m;
        let path_pose = self.path_pose(frame, offset_s, surroundings)?;
        let body = &self.trajectory.body;
        match path_pose.ground_m() {
            Some(position_m) => {
                let chunk = ChunkCoord::containing(position_m, chunk_size_m);
                Ok(path_pose.pose(body, &*surroundings.ground.at(chunk)?))
            }
            // The pose does not depend on the ground, so any will do.
            None => Ok(path_pose.pose(body, &FlatSurface::default())),
        }
    }

    /// What the path says of the body's pose `offset_s` after a frame's time.
    pub(crate) fn path_pose(
        &self,
        frame: u64,
        offset_s: f64,
        surroundings: Surroundings<'_>,
    ) -> Result<PathPose, Error> {
        let obstacles = ChunkObstacles::new(self, surroundings);
        self.trajectory.path_pose(frame, offset_s, &obstacles)
    }

    /// What is in a body's way near a place.
    pub(crate) fn obstacles(
        &self,
        place_m: DVec2,
        reach_m: f64,
        surroundings: Surroundings<'_>,
    ) -> Result<Vec<Obstacle>, Error> {
        ChunkObstacles::new(self, surroundings).near(place_m, reach_m)
    }
}

/// The objects of chunks that are in a robot's way.
struct ChunkObstacles<'a> {
    objects: Demand<'a, SceneObjects>,
    /// The ground, if there is water in it.
    ground: Option<Demand<'a, ChunkGround>>,
    chunk_size_m: f64,
}

impl<'a> ChunkObstacles<'a> {
    fn new(trajectory: &RobotTrajectory, surroundings: Surroundings<'a>) -> Self {
        Self {
            objects: surroundings.objects,
            ground: trajectory.has_water.then_some(surroundings.ground),
            chunk_size_m: trajectory.chunk_size_m,
        }
    }
}

impl Obstacles for ChunkObstacles<'_> {
    type Error = Error;

    fn near(&self, place_m: DVec2, reach_m: f64) -> Result<Vec<Obstacle>, Error> {
        let mut out = Vec::new();
        // A log may reach in from a neighbouring chunk.
        let reach_of_logs_m = reach_m + LOG_REACH_M;
        for chunk in ChunkCoord::within(place_m, reach_of_logs_m, self.chunk_size_m) {
            for object in &self.objects.at(chunk)?.0 {
                let near = object.position_m.truncate().distance(place_m) - object.radius_m;
                if near < reach_m + object.half_width_m + DISKS_M {
                    out.extend(obstacles(object).filter(|disk| {
                        disk.position_m.distance(place_m) - disk.radius_m < reach_m
                    }));
                }
            }
        }
        if let Some(ground) = &self.ground {
            for chunk in ChunkCoord::within(place_m, reach_m + WATER_REACH_M, self.chunk_size_m) {
                let ground = ground.at(chunk)?;
                out.extend(
                    waters(&ground, 0.0)
                        .filter(|disk| disk.position_m.distance(place_m) - disk.radius_m < reach_m),
                );
            }
        }
        Ok(out)
    }
}

/// How far the disks of [`waters`] reach into neighbouring chunks, metres: their middles are in the
/// chunk, and the largest pond ends 16.4 m from its middle. Surfaces of water reach farther
/// ([`SURFACE_REACH_M`](nemoral_water::SURFACE_REACH_M)), as a stream's is that of the chunk in
/// which a reach begins.
pub const WATER_REACH_M: f64 = 17.0;
/// How far a robot keeps from the water, besides its clearance, metres.
const BANK_M: f64 = 0.3;

/// What the streams in a chunk that are deeper than this, and its ponds, take of the ground: disks
/// along streams, but in culverts, and a disk for each pond.
pub fn waters(ground: &ChunkGround, deeper_than_m: f64) -> impl Iterator<Item = Obstacle> {
    let water = ground.water();
    // What is farther from the chunk than some metres, its ground does not know.
    let streams = water.into_iter().flat_map(ChunkWater::sections_in_chunk);
    let streams = streams
        .filter(move |s| s.depth_m > deeper_than_m && ground.bank_m(s.middle_m) < 0.0)
        .map(|s| Obstacle {
            position_m: s.middle_m,
            radius_m: s.half_m + BANK_M,
        });
    let ponds = water.into_iter().flat_map(ChunkWater::ponds);
    let ponds = ponds.filter(|p| ground.owns(p.middle_m()));
    streams.chain(ponds.map(|p| Obstacle {
        position_m: p.middle_m(),
        radius_m: p.widest_m() + BANK_M,
    }))
}

/// Greatest distance of the disks that stand for a log, metres.
const DISKS_M: f64 = 0.4;

/// What an object takes of the ground: a disk, disks along a log, which cover it, or nothing if it
/// lies on a trail as stones do.
pub fn obstacles(object: &SceneObject) -> impl Iterator<Item = Obstacle> {
    let middle = object.position_m.truncate();
    let (half, count, radius_m) = if object.kind == ObjectKind::Log {
        let axis = object
            .linear
            .x_axis
            .as_dvec3()
            .truncate()
            .normalize_or_zero();
        let count = (2.0 * object.radius_m / DISKS_M).ceil().max(1.0);
        // The stem is covered up to halfway between two disks.
        let radius_m = DVec2::new(object.half_width_m, 0.5 * DISKS_M).length();
        (axis * object.radius_m, count, radius_m)
    } else {
        (DVec2::ZERO, 0.0, object.radius_m)
    };
    let disks = if object.on_trail { 0 } else { count as u32 + 1 };
    (0..disks).map(move |i| Obstacle {
        position_m: middle + half * (2.0 * f64::from(i) / count.max(1.0) - f64::from(count > 0.0)),
        radius_m,
    })
}

/// A trail as a line.
#[derive(Debug)]
pub struct TrailLine(pub Arc<TrailPath>);

impl Polyline for TrailLine {
    fn length_m(&self) -> f64 {
        self.0.length_m()
    }

    fn position_m(&self, s_m: f64) -> DVec2 {
        self.0.position_m(s_m)
    }

    fn tangent(&self, s_m: f64) -> DVec2 {
        self.0.tangent(s_m)
    }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::ObjectId;
    use nemoral_scene::glam::{DVec3, Mat3};

    use super::*;

    #[test]
    fn disks_cover_a_log_and_little_more() {
        for half_width_m in [0.065, 0.3, 0.58] {
            let log = SceneObject {
                object: ObjectId::new(ChunkCoord::new(0, 0), 1).expect("in range"),
                kind: ObjectKind::Log,
                position_m: DVec3::new(3.0, 4.0, 5.0),
                radius_m: 2.1,
                half_width_m,
                asset: 0,
                scale: 1.0,
                measured: None,
                linear: Mat3::from_rotation_z(0.5),
                variation: 0.0,
                on_trail: false,
            };
            let disks: Vec<Obstacle> = obstacles(&log).collect();
            let axis = DVec2::from_angle(0.5);
            let is_covered = |along_m: f64, across_m: f64| {
                let place = DVec2::new(3.0, 4.0) + axis * along_m + axis.perp() * across_m;
                let is_in = |d: &Obstacle| d.position_m.distance(place) < d.radius_m + 1e-6;
                disks.iter().any(is_in)
            };
            for i in -50..=50 {
                let along_m = 2.1 * f64::from(i) / 50.0;
                for side in [-1.0, 1.0] {
                    assert!(is_covered(along_m, side * half_width_m), "{along_m}");
                    assert!(!is_covered(along_m, side * (half_width_m + 0.2)));
                }
            }
        }
    }
}
