//! The trajectory that a config asks for.

use std::sync::Arc;

use nemoral_scene::glam::DVec2;
use nemoral_seed::Key;
use nemoral_trajectory::{
    Body, FlightLines, Gait, Path, RecordedTrajectory, Stations, ThereAndBack, Trajectory, Wander,
};

use super::ground::GroundModel;
use super::trajectory::{RobotTrajectory, TrailLine};
use crate::config::{self, Config, RobotPath};
use crate::plan::{Encode, Encoder, Hasher};
use crate::{Error, InputFiles};

/// How a config wants the robot to drive, and the files that it names.
#[derive(Clone, Debug)]
pub(crate) struct TrajectoryRecipe {
    robot: config::Robot,
    chunk_size_m: f64,
    inputs: InputFiles,
}

impl TrajectoryRecipe {
    pub(crate) fn new(config: &Config, inputs: &InputFiles) -> Self {
        Self {
            robot: config.robot.clone(),
            chunk_size_m: config.chunks.size_m,
            inputs: inputs.clone(),
        }
    }

    pub(crate) fn fingerprint(&self, hasher: &mut Hasher) {
        self.inputs.encode(hasher, self);
    }

    /// The trajectory on a ground.
    pub(crate) fn make(&self, ground: &GroundModel, world: Key) -> Result<RobotTrajectory, Error> {
        let r = &self.robot;
        let (start_m, forward) = (r.start_m(), r.forward());
        let wander = |amplitude_m: f64| {
            Path::Wander(Wander::new(
                start_m,
                forward,
                amplitude_m,
                r.clearance_m,
                world,
            ))
        };
        let mut note = None;
        let path = match &r.path {
            RobotPath::Trail(trail) => {
                let found = ground
                    .trails()
                    .and_then(|t| {
                        let way = trail.way_number();
                        t.nearest_where(start_m, trail.search_radius_m, |path| {
                            !path.id().is_branch() && way.is_none_or(|way| path.way_number() == way)
                        })
                    })
                    .and_then(|(path, nearest_m)| {
                        ThereAndBack::new(Arc::new(TrailLine(path)), nearest_m, r.speed_m_s)
                    });
                match found {
                    Some(line) => Path::ThereAndBack(line),
                    None => {
                        let kind = match trail.way_number() {
                            None => "trail".to_owned(),
                            Some(_) => trail.way.replace('_', " "),
                        };
                        note = Some(format!(
                            "no {kind} within {} m of ({}, {}): the robot wanders instead",
                            trail.search_radius_m, start_m.x, start_m.y
                        ));
                        wander(config::PathWander::default().amplitude_m)
                    }
                }
            }
            RobotPath::Wander(path) => wander(path.amplitude_m),
            RobotPath::Lanes(path) => Path::Wander(Wander::along_lanes(
                r.lanes(path)?,
                path.amplitude_m,
                r.clearance_m,
                world,
            )),
            RobotPath::Straight(_) => Path::Straight { start_m, forward },
            RobotPath::Stations(grid) => Path::Stations(Stations {
                middle_m: start_m,
                forward,
                columns: grid.columns,
                rows: grid.rows,
                distance_m: grid.distance_m,
                clearance_m: r.clearance_m,
            }),
            RobotPath::Flight(flight) => {
                let above = |place_m: DVec2| ground.natural_height_m(place_m);
                let lines = FlightLines::new(r.flight_lines(flight), above, world);
                let refused = |e| Error::request(format!("robot.flight: {e}"));
                Path::FlightLines(lines.map_err(refused)?)
            }
            RobotPath::File(file) => {
                let recording = r.recording(file, &self.inputs)?;
                note = below_ground(&recording, ground);
                Path::Recording(recording)
            }
        };
        Ok(RobotTrajectory {
            trajectory: Trajectory {
                path,
                pace: r.pace(),
                body: Body {
                    wheelbase_m: r.wheelbase_m,
                    track_m: r.track_m,
                },
                gait: gait_of(r),
            },
            note,
            has_water: ground.has_beds(),
            chunk_size_m: self.chunk_size_m,
        })
    }
}

/// A walker's sway; `None` if the robot rolls.
fn gait_of(robot: &config::Robot) -> Option<Gait> {
    let gait = &robot.gait;
    (gait.step_m > 0.0).then(|| Gait {
        step_m: gait.step_m,
        bob_m: gait.bob_m,
        sway_m: gait.sway_m,
        pitch_rad: gait.pitch_deg.to_radians(),
        roll_rad: gait.roll_deg.to_radians(),
        hip_m: gait.hip_m,
    })
}

/// What a user should know about poses that are deep in the ground.
fn below_ground(recording: &RecordedTrajectory, ground: &GroundModel) -> Option<String> {
    if recording.is_on_ground() {
        return None;
    }
    // Ways may be cut into the ground.
    const DEEP_M: f64 = 3.0;
    let depth_m = |pose: u64| {
        let at = recording.at(recording.time_s(pose)).translation_m;
        ground.natural_height_m(at.truncate()) - at.z
    };
    let mut below = (0..recording.count()).filter(|&pose| depth_m(pose) > DEEP_M);
    let first = below.next()?;
    Some(format!(
        "{} of {} poses are below the ground, pose {first} by {:.0} m: heights in robot.file are \
         those of this world, unless robot.file.on_ground is true",
        1 + below.count(),
        recording.count(),
        depth_m(first),
    ))
}

impl Encode for TrajectoryRecipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            robot,
            chunk_size_m,
            inputs: _,
        } = self;
        encoder.field("robot", robot);
        encoder.field("chunk_size_m", chunk_size_m);
    }
}
