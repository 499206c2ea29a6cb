//! The line a robot follows.

use std::sync::Arc;

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, RigidTransform, Surface};
use nemoral_seed::Key;
use nemoral_trails::TrailPath;

use super::body::Body;
use super::file::read_poses;
use super::stations::Stations;
use super::wander::{Obstacle, Wander};
use crate::config::{self, Config, RobotPath};
use crate::plan::{Demand, Encode, Encoder, Forest, Hasher, OfWorld, Stage};
use crate::stages::ground::{ChunkGround, GroundModel};
use crate::stages::things::Things;
use crate::{Error, InputFile, InputFiles};

/// At the end of a trail the robot turns on the spot within this way, metres.
const TURN_M: f64 = 2.0;

/// Position and direction of travel on the map.
pub type Heading = (DVec2, DVec2);

/// Where the robot goes: a pure function of the frame's number.
#[derive(Debug)]
pub struct Guide {
    path: Path,
    /// What the user should know: that there is no trail to follow.
    note: Option<String>,
    robot: config::Robot,
    chunk_size_m: f64,
}

#[derive(Debug)]
enum Path {
    Trail {
        path: Arc<TrailPath>,
        start_m: f64,
    },
    Wander(Wander),
    Straight {
        start_m: DVec2,
        forward: DVec2,
    },
    Stations(Stations),
    File {
        times_s: Vec<f64>,
        poses: Vec<RigidTransform>,
        on_ground: bool,
    },
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
        match &self.path {
            Path::File { poses, .. } => Some(poses.len() as u64),
            Path::Stations(stations) => Some(stations.count()),
            _ => None,
        }
    }

    /// A frame's time, seconds.
    #[must_use]
    pub fn time_s(&self, frame: u64) -> f64 {
        match &self.path {
            Path::File { times_s, .. } => times_s[frame as usize],
            _ if self.robot.spacing_s > 0.0 => frame as f64 * self.robot.spacing_s,
            _ => frame as f64 * self.robot.spacing_m / self.robot.speed_m_s,
        }
    }

    /// The body's world pose `offset_s` after a frame's time.
    ///
    /// # Errors
    /// If the land cannot be made.
    pub fn pose(&self, frame: u64, offset_s: f64, land: Land<'_>) -> Result<RigidTransform, Error> {
        let s = self.robot.speed_m_s * (self.time_s(frame) + offset_s);
        let (position, forward) = match &self.path {
            Path::Trail { path, start_m } => there_and_back(path, start_m + s),
            Path::Wander(wander) => {
                wander.at(s, &|p, reach| obstacles(p, reach, self.chunk_size_m, land))?
            }
            Path::Straight { start_m, forward } => (*start_m + *forward * s, *forward),
            Path::Stations(stations) => {
                let clearance = self.robot.clearance_m;
                let position = stations.place(frame, clearance, &|p, reach| {
                    obstacles(p, reach, self.chunk_size_m, land)
                })?;
                let ground = land
                    .ground
                    .at(ChunkCoord::containing(position, self.chunk_size_m))?;
                return Ok(stations.stand(position, ground.height_m(position)));
            }
            Path::File {
                times_s,
                poses,
                on_ground,
            } => {
                let pose = interpolate(times_s, poses, times_s[frame as usize] + offset_s);
                if !on_ground {
                    return Ok(pose);
                }
                let forward = pose.transform_vector(DVec3::X).truncate();
                (pose.translation_m.truncate(), forward)
            }
        };
        let ground = land
            .ground
            .at(ChunkCoord::containing(position, self.chunk_size_m))?;
        let body = Body {
            wheelbase_m: self.robot.wheelbase_m,
            track_m: self.robot.track_m,
        };
        Ok(body.stand(position, forward, &*ground))
    }
}

/// Along a trail to its end, back to its beginning, and so on.
fn there_and_back(path: &TrailPath, s_m: f64) -> Heading {
    let length = path.length_m();
    let lap = s_m.rem_euclid(2.0 * length);
    let s = if lap > length {
        2.0 * length - lap
    } else {
        lap
    };
    // The heading turns through 180 degrees about each end.
    let to_far_end = lap - length;
    let to_near_end = if lap > length {
        lap - 2.0 * length
    } else {
        lap
    };
    let turned = if to_far_end.abs() < TURN_M / 2.0 {
        to_far_end / TURN_M + 0.5
    } else if to_near_end.abs() < TURN_M / 2.0 {
        to_near_end / TURN_M + 1.5
    } else if lap > length {
        1.0
    } else {
        0.0
    };
    let tangent = path.tangent(s);
    (
        path.position_m(s),
        DVec2::from_angle(turned * std::f64::consts::PI).rotate(tangent),
    )
}

/// What stands within `reach` of a point and is in a robot's way.
fn obstacles(
    p: DVec2,
    reach: f64,
    chunk_size_m: f64,
    land: Land<'_>,
) -> Result<Vec<Obstacle>, Error> {
    let mut out = Vec::new();
    for chunk in ChunkCoord::within(p, reach, chunk_size_m) {
        for thing in &land.things.at(chunk)?.0 {
            let q = thing.position_m.truncate();
            if !thing.on_trail && q.distance(p) - thing.radius_m < reach {
                out.push((q, thing.radius_m));
            }
        }
    }
    Ok(out)
}

fn interpolate(times_s: &[f64], poses: &[RigidTransform], time_s: f64) -> RigidTransform {
    let after = times_s.partition_point(|&t| t <= time_s);
    if after == 0 || poses.len() == 1 {
        return poses[0];
    }
    if after == poses.len() {
        return poses[poses.len() - 1];
    }
    let (a, b) = (&poses[after - 1], &poses[after]);
    let t = (time_s - times_s[after - 1]) / (times_s[after] - times_s[after - 1]);
    RigidTransform {
        rotation: a.rotation.slerp(b.rotation, t),
        translation_m: a.translation_m.lerp(b.translation_m, t),
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

    fn file_path(&self, file: &config::PathFile) -> Result<Path, Error> {
        let origin = file.path.as_str();
        let text = self
            .inputs
            .get(&file.path)
            .map_or(Ok(""), InputFile::text)?;
        let read = read_poses(text, origin, &file.format)?;
        let step = if self.robot.spacing_s > 0.0 {
            self.robot.spacing_s
        } else {
            self.robot.spacing_m / self.robot.speed_m_s
        };
        let times_s: Vec<f64> = read
            .iter()
            .enumerate()
            .map(|(i, (t, _))| t.unwrap_or(i as f64 * step))
            .collect();
        if let Some(i) = times_s.windows(2).position(|w| w[1] <= w[0]) {
            let (path, a, b) = (&file.path, times_s[i], times_s[i + 1]);
            return Err(Error::request(format!(
                "{path}: time {b} of pose {} is not after {a}: times must increase",
                i + 2
            )));
        }
        let poses = read.into_iter().map(|(_, pose)| pose).collect();
        Ok(Path::File {
            times_s,
            poses,
            on_ground: file.on_ground,
        })
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
                    .filter(|(path, _)| path.length_m() > 4.0 * TURN_M);
                match found {
                    Some((path, nearest_m)) => {
                        let length = path.length_m();
                        let at = nearest_m.clamp(TURN_M, length - TURN_M);
                        // Set out towards the farther end: the second half of the lap goes back.
                        let start_m = if at <= length / 2.0 {
                            at
                        } else {
                            2.0 * length - at
                        };
                        Path::Trail { path, start_m }
                    }
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
            }),
            RobotPath::File(file) => self.file_path(file)?,
        };
        Ok(Guide {
            path,
            note,
            robot: r.clone(),
            chunk_size_m: self.chunk_size_m,
        })
    }
}
