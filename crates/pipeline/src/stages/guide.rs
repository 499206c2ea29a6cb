//! The trajectory that a config asks for, on the ground and between the things of the forest.

use std::sync::Arc;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, FlatSurface, RigidTransform};
use nemoral_seed::Key;
use nemoral_trails::TrailPath;
use nemoral_trajectory::{
    Body, Obstacle, Obstacles, Pace, Path, Polyline, PoseFormat, Recording, Stations, ThereAndBack,
    Trajectory, Wander, read_poses,
};

use super::ground::{ChunkGround, GroundModel};
use super::things::Things;
use crate::config::{self, Config, RobotPath};
use crate::plan::{Demand, Encode, Encoder, Forest, Hasher, OfWorld, Stage};
use crate::{Error, InputFile, InputFiles};

/// Where the robot goes: a pure function of the frame's number.
#[derive(Debug)]
pub struct Guide {
    trajectory: Trajectory,
    /// What the user should know: that there is no trail to follow.
    note: Option<String>,
    chunk_size_m: f64,
}

/// What a guide needs to know of the land: its ground and what stands on it.
#[derive(Clone, Copy, Debug)]
pub struct Land<'a> {
    /// The ground of any chunk.
    pub ground: Demand<'a, ChunkGround>,
    /// The things of any chunk.
    pub things: Demand<'a, Things>,
}

impl Guide {
    /// What the user should know about the path that was found.
    #[must_use]
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// How many frames the path has, if it ends.
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
    /// If the land cannot be made.
    pub fn pose(&self, frame: u64, offset_s: f64, land: Land<'_>) -> Result<RigidTransform, Error> {
        let chunk_size_m = self.chunk_size_m;
        let obstacles = ChunkObstacles {
            things: land.things,
            chunk_size_m,
        };
        let stance = self.trajectory.stance(frame, offset_s, &obstacles)?;
        let body = &self.trajectory.body;
        match stance.ground_m() {
            Some(position_m) => {
                let chunk = ChunkCoord::containing(position_m, chunk_size_m);
                Ok(stance.pose(body, &*land.ground.at(chunk)?))
            }
            // Any ground will do: the pose does not depend on it.
            None => Ok(stance.pose(body, &FlatSurface::default())),
        }
    }
}

/// The things of chunks that are in a robot's way.
struct ChunkObstacles<'a> {
    things: Demand<'a, Things>,
    chunk_size_m: f64,
}

impl Obstacles for ChunkObstacles<'_> {
    type Error = Error;

    fn near(&self, place_m: DVec2, reach_m: f64) -> Result<Vec<Obstacle>, Error> {
        let mut out = Vec::new();
        for chunk in ChunkCoord::within(place_m, reach_m, self.chunk_size_m) {
            for thing in &self.things.at(chunk)?.0 {
                let position_m = thing.position_m.truncate();
                let radius_m = thing.radius_m;
                if !thing.on_trail && position_m.distance(place_m) - radius_m < reach_m {
                    out.push(Obstacle {
                        position_m,
                        radius_m,
                    });
                }
            }
        }
        Ok(out)
    }
}

/// A trail as a line.
#[derive(Debug)]
struct TrailLine(Arc<TrailPath>);

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

/// Finds the [`Guide`].
#[derive(Clone, Debug)]
pub struct GuideStage {
    robot: config::Robot,
    chunk_size_m: f64,
    inputs: InputFiles,
}

impl GuideStage {
    /// The stage of a config and the files that it names.
    #[must_use]
    pub fn new(config: &Config, inputs: &InputFiles) -> Self {
        Self {
            robot: config.robot.clone(),
            chunk_size_m: config.chunks.size_m,
            inputs: inputs.clone(),
        }
    }

    fn pace(&self) -> Pace {
        Pace {
            spacing_m: self.robot.spacing_m,
            spacing_s: self.robot.spacing_s,
            speed_m_s: self.robot.speed_m_s,
        }
    }

    fn recording(&self, file: &config::PathFile) -> Result<Recording, Error> {
        let origin = file.path.as_str();
        let text = self
            .inputs
            .get(&file.path)
            .map_or(Ok(""), InputFile::text)?;
        let format =
            PoseFormat::by_name(&file.format).expect("the config's words are the formats' names");
        read_poses(text, origin, format)
            .and_then(|poses| Recording::new(poses, self.pace().step_s(), file.on_ground, origin))
            .map_err(|e| Error::request(e.to_string()))
    }
}

impl Encode for GuideStage {
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

impl Stage<Forest> for GuideStage {
    type At = ();
    type Inputs = (OfWorld<GroundModel>,);
    type Output = Guide;
    const ID: &'static str = "world.guide";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.inputs.encode(hasher, self);
    }

    fn run(&self, (): (), world: Key, (ground,): (Arc<GroundModel>,)) -> Result<Guide, Error> {
        let r = &self.robot;
        let start_m = DVec2::new(r.start_x_m, r.start_y_m);
        let (sin, cos) = libm::sincos(r.heading_deg.to_radians());
        let forward = DVec2::new(sin, cos);
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
                    .and_then(|t| t.nearest(start_m, trail.search_radius_m))
                    .and_then(|(path, nearest_m)| {
                        ThereAndBack::new(Arc::new(TrailLine(path)), nearest_m)
                    });
                match found {
                    Some(line) => Path::ThereAndBack(line),
                    None => {
                        note = Some(format!(
                            "no trail within {} m of ({}, {}): the robot wanders instead",
                            trail.search_radius_m, start_m.x, start_m.y
                        ));
                        wander(config::PathWander::default().amplitude_m)
                    }
                }
            }
            RobotPath::Wander(path) => wander(path.amplitude_m),
            RobotPath::Straight(_) => Path::Straight { start_m, forward },
            RobotPath::Stations(grid) => Path::Stations(Stations {
                middle_m: start_m,
                forward,
                columns: grid.columns,
                rows: grid.rows,
                distance_m: grid.distance_m,
                clearance_m: r.clearance_m,
            }),
            RobotPath::File(file) => Path::Recording(self.recording(file)?),
        };
        Ok(Guide {
            trajectory: Trajectory {
                path,
                pace: self.pace(),
                body: Body {
                    wheelbase_m: r.wheelbase_m,
                    track_m: r.track_m,
                },
            },
            note,
            chunk_size_m: self.chunk_size_m,
        })
    }
}
