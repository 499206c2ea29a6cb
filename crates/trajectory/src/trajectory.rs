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
mod tests {
    use std::convert::Infallible;

    use super::*;
    use crate::Obstacle;
    use nemoral_scene::FlatSurface;

    const PACE: SpeedProfile = SpeedProfile {
        spacing_m: 3.0,
        spacing_s: 0.0,
        speed_m_s: 1.5,
        rest_s: 0.0,
    };
    const BODY: Body = Body {
        wheelbase_m: 0.8,
        track_m: 0.6,
    };
    const SLOPE: FlatSurface = FlatSurface {
        height_m: 1.0,
        gradient: DVec2::new(0.1, 0.0),
    };

    fn nothing(_: DVec2, _: f64) -> Result<Vec<Obstacle>, Infallible> {
        Ok(Vec::new())
    }

    fn of(path: Path) -> Trajectory {
        Trajectory {
            path,
            pace: PACE,
            body: BODY,
            gait: None,
        }
    }

    #[test]
    fn a_walker_sways_and_keeps_to_the_path() {
        let gait = Gait {
            step_m: 0.6,
            bob_m: 0.03,
            sway_m: 0.02,
            pitch_rad: 0.0,
            roll_rad: 0.0,
            hip_m: 1.0,
        };
        let straight = || Path::Straight {
            start_m: DVec2::ZERO,
            forward: DVec2::X,
        };
        let walked = Trajectory {
            gait: Some(gait),
            ..of(straight())
        };
        let flat = FlatSurface::default();
        let pose = |offset_s| walked.pose(0, offset_s, &nothing, &flat).expect("never");
        // A quarter of a step is 0.1 s.
        assert!(
            pose(0.1)
                .translation_m
                .distance(DVec3::new(0.15, 0.02 * 0.5_f64.sqrt(), 0.03))
                < 1e-12
        );
        assert!(pose(0.8).translation_m.distance(DVec3::new(1.2, 0.0, 0.0)) < 1e-12);
        // On a slope a walker is upright at the start of each stride.
        let uphill = walked.pose(0, 0.8, &nothing, &SLOPE).expect("never");
        assert!(uphill.translation_m.distance(DVec3::new(1.2, 0.0, 1.12)) < 1e-12);
        assert!(uphill.transform_vector(DVec3::Z).distance(DVec3::Z) < 1e-12);
        let wrong = Trajectory {
            gait: Some(Gait {
                step_m: 0.0,
                ..gait
            }),
            ..of(straight())
        };
        assert_eq!(wrong.check().expect_err("no step").field, "gait.step_m");
    }

    #[test]
    fn a_straight_line_is_driven_at_its_pace() {
        let straight = of(Path::Straight {
            start_m: DVec2::new(2.0, 0.0),
            forward: DVec2::Y,
        });
        assert_eq!((straight.frames(), straight.time_s(4)), (None, 8.0));
        assert!(straight.goes_on_after(4));
        let pose = straight.pose(4, -2.0, &nothing, &SLOPE).expect("never");
        // 4 frames of 3 m, less 2 s at 1.5 m/s.
        assert!(pose.translation_m.distance(DVec3::new(2.0, 9.0, 1.2)) < 1e-12);
        let by_time = SpeedProfile {
            spacing_s: 0.25,
            ..PACE
        };
        assert_eq!((by_time.step_s(), by_time.time_s(8)), (0.25, 2.0));
        assert_eq!(PACE.step_s(), 2.0);
        assert_eq!(straight.check(), Ok(()));
        let flat = Trajectory {
            body: Body {
                track_m: 0.0,
                ..BODY
            },
            ..straight
        };
        assert_eq!(flat.check().expect_err("no track").field, "body.track_m");
    }

    #[test]
    fn wrong_values_are_named() {
        let straight = |start_m, forward| of(Path::Straight { start_m, forward });
        let field = |wrong: Trajectory| wrong.check().expect_err("is refused").field;
        assert_eq!(field(straight(DVec2::ZERO, DVec2::ONE)), "path.forward");
        assert_eq!(field(straight(DVec2::ZERO, DVec2::NAN)), "path.forward");
        assert_eq!(field(straight(DVec2::NAN, DVec2::X)), "path.start_m");
        let key = nemoral_seed::Key::world(1);
        let wander = Wander::new(DVec2::INFINITY, DVec2::X, 1.0, 1.0, key);
        assert_eq!(field(of(Path::Wander(wander))), "wander.start_m");
        let nowhere = Stations {
            middle_m: DVec2::ZERO,
            forward: DVec2::Y,
            columns: 0,
            rows: 1,
            distance_m: 10.0,
            clearance_m: 1.0,
        };
        assert_eq!(field(of(Path::Stations(nowhere))), "stations.columns");
        // All frames would be at once; a recording has times of its own.
        let no_step = SpeedProfile {
            spacing_m: 0.0,
            ..PACE
        };
        let standing = Trajectory {
            pace: no_step,
            ..straight(DVec2::ZERO, DVec2::X)
        };
        assert_eq!(field(standing), "pace.spacing_m");
        let pose = RigidTransform::from_xyz_rpy(DVec3::ZERO, 0.0, 0.0, 0.0);
        let recording = RecordedTrajectory::new(vec![(Some(0.0), pose)], 1.0, false, "poses");
        let recorded = Trajectory {
            pace: no_step,
            ..of(Path::Recording(recording.expect("a pose")))
        };
        assert_eq!(recorded.check(), Ok(()));
    }

    #[test]
    fn stations_are_level_and_still() {
        let stations = of(Path::Stations(Stations {
            middle_m: DVec2::ZERO,
            forward: DVec2::Y,
            columns: 2,
            rows: 1,
            distance_m: 10.0,
            clearance_m: 1.0,
        }));
        assert_eq!(stations.frames(), Some(2));
        // It is carried from the first one to the second.
        assert!(!stations.goes_on_after(0) && !stations.goes_on_after(1));
        let pose = |offset_s| stations.pose(1, offset_s, &nothing, &SLOPE);
        let pose_of = |offset_s| pose(offset_s).expect("never");
        assert_eq!(pose_of(0.0), pose_of(5.0));
        let up = pose_of(0.0).transform_vector(DVec3::Z);
        assert!(up.distance(DVec3::Z) < 1e-15);
        let ahead = pose_of(0.0).transform_vector(DVec3::X);
        assert!(ahead.distance(DVec3::Y) < 1e-12);
        assert_eq!(pose_of(0.0).translation_m, DVec3::new(5.0, 0.0, 1.5));
    }

    #[test]
    fn a_recording_lies_on_the_ground_or_not() {
        let recorded = |on_ground| {
            let pose = RigidTransform::from_xyz_rpy(DVec3::new(1.0, 2.0, 30.0), 0.3, 0.2, 0.0);
            let recording =
                RecordedTrajectory::new(vec![(Some(0.0), pose)], 1.0, on_ground, "poses");
            let path = of(Path::Recording(recording.expect("a pose")));
            let path_pose = path.path_pose(0, 0.0, &nothing).expect("never");
            assert_eq!(path_pose.ground_m().is_some(), on_ground);
            (pose, path_pose.pose(&BODY, &SLOPE))
        };
        let (pose, free) = recorded(false);
        assert_eq!(free, pose);
        let (_, on_ground) = recorded(true);
        assert!(on_ground.translation_m.distance(DVec3::new(1.0, 2.0, 1.1)) < 1e-12);
    }
}
