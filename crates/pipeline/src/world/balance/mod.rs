//! Frames that are chosen among candidates beside the path, so that they show more of what is rare.
//!
//! Candidate j of frame k is drawn by the key (k, j) about the frame's place on the path, and a few
//! thousand rays say what a sensor there would see. The weights of the choice come from a pilot:
//! candidates at places along the path's beginning, whatever frames are asked for. So a frame
//! depends on the world and its own number alone.

mod pilot;
mod probe;
mod weights;

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, MaterialLibrary, RigidTransform, Surface};
use nemoral_seed::{Domain, Key};
use nemoral_trajectory::{PathPose, Pose2d, PoseSampler};
use rayon::prelude::*;

use self::probe::{PROBE_M, Probe, RAYS, TargetTable};
use super::assets::WorldAssets;
use super::lidars::LidarRig;
use super::litter::LitterPatch;
use super::trajectory::{RobotTrajectory, Surroundings};
use crate::config::{self, BalanceTarget, Config, CountedSurfaces};
use crate::plan::{Encode, Encoder, Hasher};
use crate::pool::in_pool;
use crate::recording::scene::{FrameScene, Geometry};
use crate::recording::visible_reach::VisibleReach;
use crate::{Error, InputFiles};

pub use self::pilot::Pilot;

const PLACES: Domain = Domain::new("pipeline.balance.places");
const CHOICE: Domain = Domain::new("pipeline.balance.choice");
const PILOT: Domain = Domain::new("pipeline.balance.pilot");

/// The steepest ground that a candidate may stand on: the cosine of 30°.
const STEEPEST: f64 = 0.866;

/// How many rays the choice of a frame takes, about.
#[must_use]
pub(crate) fn rays_of_choice(balance: &config::Balance) -> f64 {
    f64::from(RAYS) * f64::from(balance.candidates)
}

/// What frames are chosen for, and how.
#[derive(Clone, Debug)]
pub(crate) struct BalanceRecipe {
    balance: config::Balance,
    ontology: config::OntologyName,
    clearance_m: f64,
    reach: VisibleReach,
    /// The config's sensors, of which the first one's view is what counts.
    sensors: Box<Config>,
    inputs: InputFiles,
}

/// Where a frame is taken, and what it shows.
#[derive(Clone, Debug, PartialEq)]
pub struct BalanceChoice {
    /// The number of the candidate; `None` if none was fit, and the place is the path's.
    pub candidate: Option<u32>,
    /// Place on the map, metres, and direction.
    pub pose_2d: Pose2d,
    /// The body's pose at the frame's time.
    pub world_from_body: RigidTransform,
    /// The share of each target, in order of their names.
    pub shares: Vec<f64>,
}

/// A candidate that a body can stand at.
struct Candidate {
    number: u32,
    pose_2d: Pose2d,
    world_from_body: RigidTransform,
}

/// A candidate, and the share of each target in its view.
type Viewed = (Candidate, Vec<f64>);

/// The land around, whatever asks for it.
#[derive(Clone, Copy)]
pub(crate) struct Land<'a> {
    pub(crate) surroundings: Surroundings<'a>,
    pub(crate) geometry: Geometry<'a>,
}

impl BalanceRecipe {
    /// `None` if a config asks for no balance.
    pub(crate) fn new(config: &Config, inputs: &InputFiles) -> Option<Self> {
        if !config.balance.is_on() {
            return None;
        }
        let mut recipe = Self {
            balance: config.balance.clone(),
            ontology: config.output.ontology,
            clearance_m: config.robot.clearance_m,
            reach: VisibleReach::new(config),
            sensors: Box::new(config.clone()),
            inputs: inputs.clone(),
        };
        // Litter hides nothing, so it is looked for only where it is asked for.
        let is_litter = |counts: &CountedSurfaces| match counts {
            CountedSurfaces::Of(these) => these.iter().any(|s| LitterPatch::PARTS.contains(s)),
            CountedSurfaces::OnTrunks(_) | CountedSurfaces::NearObstacles(_) => false,
        };
        let is_asked_for = recipe.targets().iter().any(|t| is_litter(&t.counts));
        if !is_asked_for {
            recipe.reach.litter_radius_m = None;
        }
        Some(recipe)
    }

    pub(crate) fn fingerprint(&self, hasher: &mut Hasher) {
        self.inputs.encode(hasher, self);
    }

    fn targets(&self) -> Vec<BalanceTarget> {
        self.balance.targets(&self.ontology.table())
    }

    /// Chooses a frame.
    pub(crate) fn choose(
        &self,
        frame: u64,
        (pilot, trajectory): (&Pilot, &RobotTrajectory),
        (assets, lidars): (&WorldAssets, &[LidarRig]),
        land: Land<'_>,
        world: Key,
    ) -> Result<BalanceChoice, Error> {
        let on_path = trajectory.pose_2d(frame, 0.0, land.surroundings)?;
        let looker = self.looker(&assets.library.materials, lidars)?;
        let scene = looker.scene(on_path, land)?;
        let key = world.domain(PLACES).item(frame);
        let stands = looker.candidates(on_path, trajectory, land, key)?;
        let mut viewed = looker.view(&scene, stands);
        let goals: Vec<f64> = pilot.targets.iter().map(|t| t.goal).collect();
        let weights: Vec<f64> = pilot.targets.iter().map(|t| t.weight).collect();
        let scored: Vec<(u32, Vec<f64>)> = (viewed.iter())
            .map(|(c, shares)| (c.number, weights::capped(shares, &goals)))
            .collect();
        let key = world.domain(CHOICE).item(frame);
        if let Some(taken) = weights::choice(&scored, &weights, key) {
            let (candidate, shares) = viewed.swap_remove(taken);
            return Ok(BalanceChoice {
                candidate: Some(candidate.number),
                pose_2d: candidate.pose_2d,
                world_from_body: candidate.world_from_body,
                shares,
            });
        }
        // No candidate is fit: the frame is the path's own.
        let world_from_body = trajectory.pose_on_ground(on_path, land.surroundings)?;
        let shares = looker.shares(&scene, &world_from_body);
        Ok(BalanceChoice {
            candidate: None,
            pose_2d: on_path,
            world_from_body,
            shares: shares.unwrap_or_else(|| vec![0.0; goals.len()]),
        })
    }

    fn looker(&self, materials: &MaterialLibrary, lidars: &[LidarRig]) -> Result<Looker, Error> {
        let targets = self.targets();
        let sampler = PoseSampler {
            reach_m: self.balance.reach_m,
            turn_rad: self.balance.turn_deg.to_radians(),
            clearance_m: self.clearance_m,
        };
        let seen_m = PROBE_M.min(self.reach.visible_radius_m);
        let near = |radius_m: f64| radius_m.min(PROBE_M) + sampler.reach_m;
        Ok(Looker {
            probe: Probe::new(&self.sensors, lidars)?,
            table: TargetTable::new(&targets, self.balance.near_m, materials),
            seen_m,
            // A frame's own chunks, or fewer.
            reach: VisibleReach {
                visible_radius_m: near(self.reach.visible_radius_m),
                undergrowth_radius_m: near(self.reach.undergrowth_radius_m),
                litter_radius_m: self.reach.litter_radius_m.map(near),
                ..self.reach
            },
            sampler,
            candidates: self.balance.candidates,
        })
    }
}

/// Looks at candidates.
struct Looker {
    probe: Probe,
    table: TargetTable,
    seen_m: f64,
    reach: VisibleReach,
    sampler: PoseSampler,
    candidates: u32,
}

impl Looker {
    /// What rays from around a place on the path may meet.
    fn scene(&self, (place_m, _): Pose2d, land: Land<'_>) -> Result<FrameScene, Error> {
        let around = ChunkCoord::containing(place_m, self.reach.chunk_size_m);
        FrameScene::gather(&self.reach, (around, place_m), None, land.geometry, None)
    }

    /// The candidates about a place on the path that a body can stand at.
    fn candidates(
        &self,
        on_path: Pose2d,
        trajectory: &RobotTrajectory,
        land: Land<'_>,
        key: Key,
    ) -> Result<Vec<Candidate>, Error> {
        let near_m = self.sampler.obstacles_m();
        let obstacles = trajectory.obstacles(on_path.0, near_m, land.surroundings)?;
        let mut stands = Vec::new();
        for number in 0..self.candidates {
            let key = key.item(u64::from(number));
            let Some(pose_2d) = self.sampler.draw(on_path, &obstacles, key) else {
                continue;
            };
            let world_from_body = trajectory.pose_on_ground(pose_2d, land.surroundings)?;
            let up = world_from_body.transform_vector(DVec3::Z);
            if up.z >= STEEPEST {
                stands.push(Candidate {
                    number,
                    pose_2d,
                    world_from_body,
                });
            }
        }
        Ok(stands)
    }

    fn shares(&self, scene: &FrameScene, world_from_body: &RigidTransform) -> Option<Vec<f64>> {
        (self.probe).shares((scene, self.seen_m), world_from_body, &self.table)
    }

    /// The candidates that are not blind, with what they see.
    fn view(&self, scene: &FrameScene, stands: Vec<Candidate>) -> Vec<Viewed> {
        let see = |c: Candidate| {
            let shares = self.shares(scene, &c.world_from_body)?;
            Some((c, shares))
        };
        in_pool(|| {
            let seen: Vec<Option<Viewed>> = stands.into_par_iter().map(see).collect();
            seen.into_iter().flatten().collect()
        })
    }
}

/// The path pose of a body that has driven straight on from a place.
fn straight_on((place_m, forward): Pose2d, distance_m: f64) -> PathPose {
    PathPose::OnWheels {
        position_m: place_m + forward * distance_m,
        forward,
    }
}

impl RobotTrajectory {
    /// The pose of a body that stands somewhere on its wheels.
    pub(crate) fn pose_on_ground(
        &self,
        pose_2d: Pose2d,
        surroundings: Surroundings<'_>,
    ) -> Result<RigidTransform, Error> {
        self.drive_on(pose_2d, 0.0, surroundings)
    }

    /// The pose of a body that drives straight on from there, `offset_s` later.
    pub(crate) fn drive_on(
        &self,
        pose_2d: Pose2d,
        offset_s: f64,
        surroundings: Surroundings<'_>,
    ) -> Result<RigidTransform, Error> {
        let path_pose = straight_on(pose_2d, self.trajectory.pace.speed_m_s * offset_s);
        let place_m = path_pose.ground_m().unwrap_or(pose_2d.0);
        let chunk = ChunkCoord::containing(place_m, self.chunk_size_m);
        let ground = surroundings.ground.at(chunk)?;
        Ok(path_pose.pose(&self.trajectory.body, &*ground as &dyn Surface))
    }

    /// Place and direction on the path, `offset_s` after a frame.
    fn pose_2d(
        &self,
        frame: u64,
        offset_s: f64,
        surroundings: Surroundings<'_>,
    ) -> Result<Pose2d, Error> {
        match self.path_pose(frame, offset_s, surroundings)? {
            PathPose::OnWheels {
                position_m,
                forward,
            }
            | PathPose::OnFoot {
                position_m,
                forward,
                ..
            }
            | PathPose::Level {
                position_m,
                forward,
            } => Ok((position_m, forward.normalize_or(DVec2::X))),
            PathPose::Free(pose) => {
                let forward = pose.transform_vector(DVec3::X);
                let forward = forward.truncate().normalize_or(DVec2::X);
                Ok((pose.translation_m.truncate(), forward))
            }
        }
    }
}

impl Encode for BalanceRecipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            balance,
            ontology,
            clearance_m,
            reach,
            sensors,
            inputs: _,
        } = self;
        encoder.field("balance", balance);
        encoder.field("ontology", ontology);
        encoder.field("clearance_m", clearance_m);
        encoder.field("visible_radius_m", &reach.visible_radius_m);
        encoder.field("undergrowth_radius_m", &reach.undergrowth_radius_m);
        encoder.field("chunk_size_m", &reach.chunk_size_m);
        if let Some(litter_radius_m) = &reach.litter_radius_m {
            encoder.field("litter_radius_m", litter_radius_m);
        }
        // Of the camera, where it looks; the LiDAR is a node of its own.
        let camera = &sensors.camera;
        encoder.field("enabled", &camera.enabled);
        encoder.field("size_px", &[camera.width_px, camera.height_px]);
        encoder.field("optics", &camera.optics);
        encoder.field("lens", &camera.lens);
        let mount = [
            camera.mount_x_m,
            camera.mount_y_m,
            camera.mount_z_m,
            camera.mount_yaw_deg,
            camera.mount_pitch_deg,
            camera.mount_roll_deg,
        ];
        encoder.field("mount", &mount);
    }
}
