//! A path that a body follows in time.

use nemoral_scene::glam::{DQuat, DVec2, DVec3};
use nemoral_scene::{ParamError, RigidTransform, Surface};

use crate::{
    Body, FlightLines, Gait, Obstacles, RecordedTrajectory, SpeedProfile, Stations, ThereAndBack,
    Wander,
};

/// The path of a body on the map.
#[derive(Debug)]
#[non_exhaustive]
pub enum Path {
    /// Along a line, there and back.
    ThereAndBack(ThereAndBack),
    /// A smooth wander between obstacles.
    Wander(Wander),
    /// A straight line.
    Straight {
        /// The start of the line.
        start_m: DVec2,
        /// Its direction, of length 1: with another one the body would drive at another pace.
        forward: DVec2,
    },
    /// Parallel lines above an area, in the air.
    FlightLines(FlightLines),
    /// A grid of stations, one for each frame.
    Stations(Stations),
    /// Poses of a file, one for each frame.
    Recording(RecordedTrajectory),
}

/// The pose of a body as a pure function of a frame's number and of a time relative to that
/// frame's.
#[derive(Debug)]
pub struct Trajectory {
    /// The path on the map.
    pub path: Path,
    /// The speed and the interval of frames. A recording and flight lines have their own.
    pub pace: SpeedProfile,
    /// The footprint of the body.
    pub body: Body,
    /// How it walks along a line, a wander or a straight line; `None` if it rolls.
    pub gait: Option<Gait>,
}

/// The part of a pose that follows from the path alone, without the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathPose {
    /// The body stands with its wheels on the ground.
    OnWheels {
        /// Position on the map, metres.
        position_m: DVec2,
        /// Direction on the map, of any length.
        forward: DVec2,
    },
    /// The body walks: upright on any slope, with its origin on the ground, but for its sway.
    OnFoot {
        /// Position on the map, metres.
        position_m: DVec2,
        /// Direction on the map, of any length.
        forward: DVec2,
        /// How the body sways there, in its own axes ([`Gait::after`]).
        sway: RigidTransform,
    },
    /// The body is level and still, with its origin on the ground, as on a tripod.
    Level {
        /// Position on the map, metres.
        position_m: DVec2,
        /// Direction on the map, of any length.
        forward: DVec2,
    },
    /// A pose that does not depend on the ground.
    Free(RigidTransform),
}

impl PathPose {
    /// The place where ground is needed, within the size of a body; `None` if it is not needed.
    #[must_use]
    pub fn ground_m(&self) -> Option<DVec2> {
        match *self {
            Self::OnWheels { position_m, .. }
            | Self::OnFoot { position_m, .. }
            | Self::Level { position_m, .. } => Some(position_m),
            Self::Free(_) => None,
        }
    }

    /// The pose of a body on the ground.
    #[must_use]
    pub fn pose(&self, body: &Body, ground: &dyn Surface) -> RigidTransform {
        match *self {
            Self::OnWheels {
                position_m,
                forward,
            } => body.pose_on_ground(position_m, forward, ground),
            Self::OnFoot {
                position_m,
                forward,
                sway,
            } => {
                // Two feet follow the ground no finer than four wheels do.
                let place_m = body
                    .pose_on_ground(position_m, forward, ground)
                    .translation_m;
                upright(place_m, forward) * sway
            }
            Self::Level {
                position_m,
                forward,
            } => upright(position_m.extend(ground.height_m(position_m)), forward),
            Self::Free(pose) => pose,
        }
    }
}

/// The pose of a level body.
fn upright(translation_m: DVec3, forward: DVec2) -> RigidTransform {
    RigidTransform {
        rotation: DQuat::from_rotation_z(forward.to_angle()),
        translation_m,
    }
}

impl Trajectory {
    /// Checks the values. Poses of a trajectory that does not pass may not be finite.
    ///
    /// # Errors
    /// If a value of pace, body, gait, a straight line, a wander or stations is out of range, or if
    /// the pace of a path without times of its own has no interval between frames.
    pub fn check(&self) -> Result<(), ParamError> {
        self.pace.check()?;
        self.body.check()?;
        if let Some(gait) = &self.gait {
            gait.check()?;
        }
        match &self.path {
            Path::Wander(wander) => wander.check()?,
            Path::Straight { start_m, forward } => {
                let is_unit = (forward.length() - 1.0).abs() <= 1e-9;
                ParamError::check(is_unit, "path.forward", forward, "of length 1")?;
                ParamError::check(start_m.is_finite(), "path.start_m", start_m, "finite")?;
            }
            Path::Stations(stations) => stations.check()?,
            // They have times of their own, and were checked as they were made.
            Path::FlightLines(_) | Path::Recording(_) => return Ok(()),
            Path::ThereAndBack(_) => {}
        }
        ParamError::check(
            self.pace.step_s() > 0.0,
            "pace.spacing_m",
            self.pace.spacing_m,
            "greater than 0 where pace.spacing_s is 0",
        )
    }

    /// The number of frames of the path, if it ends.
    #[must_use]
    pub fn frames(&self) -> Option<u64> {
        match &self.path {
            Path::Recording(recording) => Some(recording.count()),
            Path::Stations(stations) => Some(stations.count()),
            Path::FlightLines(lines) => Some(lines.count()),
            Path::Wander(_) => Some(self.pace.frames_in_m(self.loop_m()?)),
            Path::ThereAndBack(_) | Path::Straight { .. } => None,
        }
    }

    /// The length of the loop that the path is, metres; `None` if it is none.
    #[must_use]
    pub fn loop_m(&self) -> Option<f64> {
        match &self.path {
            Path::Wander(wander) => wander.length_m(),
            _ => None,
        }
    }

    /// The first frames of flight lines, between which the body turns unseen; none on other paths.
    #[must_use]
    pub fn lines(&self) -> Vec<u64> {
        match &self.path {
            Path::FlightLines(lines) => lines.first_frames().collect(),
            _ => Vec::new(),
        }
    }

    /// Whether the body moves from a frame to the next one: not after the last one, nor from one
    /// flight line to the next, nor between stations, to which it is carried.
    #[must_use]
    pub fn goes_on_after(&self, frame: u64) -> bool {
        let next = frame.saturating_add(1);
        let is_there = self.frames().is_none_or(|frames| next < frames);
        let is_interrupted = match &self.path {
            Path::FlightLines(lines) => lines.starts_line(next),
            Path::Stations(_) => true,
            _ => false,
        };
        is_there && !is_interrupted
    }

    /// A frame's time, seconds.
    ///
    /// # Panics
    /// If a recording has no such frame.
    #[must_use]
    pub fn time_s(&self, frame: u64) -> f64 {
        match &self.path {
            Path::Recording(recording) => recording.time_s(frame),
            Path::FlightLines(lines) => lines.time_s(frame),
            _ => self.pace.time_s(frame),
        }
    }

    /// The way that the body has come at a time, metres; `None` if the path is one of places.
    #[must_use]
    pub fn travelled_m(&self, time_s: f64) -> Option<f64> {
        let at_full_speed_m = self.pace.travelled_m(time_s);
        match &self.path {
            Path::ThereAndBack(line) => Some(line.driven_m(at_full_speed_m)),
            Path::Wander(_) | Path::Straight { .. } => Some(at_full_speed_m),
            Path::FlightLines(_) | Path::Stations(_) | Path::Recording(_) => None,
        }
    }

    /// What the path says of the body's pose `offset_s` after a frame's time.
    ///
    /// # Errors
    /// The first error of `obstacles`.
    ///
    /// # Panics
    /// If a recording has no such frame.
    pub fn path_pose<O: Obstacles + ?Sized>(
        &self,
        frame: u64,
        offset_s: f64,
        obstacles: &O,
    ) -> Result<PathPose, O::Error> {
        let time_s = self.time_s(frame) + offset_s;
        let s = self.pace.travelled_m(time_s);
        let (position_m, forward) = match &self.path {
            Path::ThereAndBack(line) => line.at(s),
            Path::Wander(wander) => wander.at(s, obstacles)?,
            Path::FlightLines(lines) => return Ok(PathPose::Free(lines.pose(frame, offset_s))),
            Path::Straight { start_m, forward } => (*start_m + *forward * s, *forward),
            Path::Stations(stations) => {
                return Ok(PathPose::Level {
                    position_m: stations.place(frame, obstacles)?,
                    forward: stations.forward,
                });
            }
            Path::Recording(recording) => {
                let pose = recording.after(frame, offset_s);
                if !recording.is_on_ground() {
                    return Ok(PathPose::Free(pose));
                }
                return Ok(PathPose::OnWheels {
                    position_m: pose.translation_m.truncate(),
                    forward: pose.transform_vector(DVec3::X).truncate(),
                });
            }
        };
        Ok(match self.gait.zip(self.travelled_m(time_s)) {
            Some((gait, way_m)) => PathPose::OnFoot {
                position_m,
                forward,
                sway: gait.after(way_m),
            },
            None => PathPose::OnWheels {
                position_m,
                forward,
            },
        })
    }

    /// The body's world pose `offset_s` after a frame's time, on a ground that exists everywhere.
    ///
    /// # Errors
    /// The first error of `obstacles`.
    ///
    /// # Panics
    /// If a recording has no such frame.
    pub fn pose<O: Obstacles + ?Sized>(
        &self,
        frame: u64,
        offset_s: f64,
        obstacles: &O,
        ground: &dyn Surface,
    ) -> Result<RigidTransform, O::Error> {
        let path_pose = self.path_pose(frame, offset_s, obstacles)?;
        Ok(path_pose.pose(&self.body, ground))
    }
}

#[cfg(test)]
mod tests;
