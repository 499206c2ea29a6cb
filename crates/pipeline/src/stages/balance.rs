//! Frames that are chosen among candidates.

use nemoral_seed::Key;
use nemoral_stand::SceneObjects;

use crate::Error;
use crate::plan::{AnyChunkEdge, CacheCodec, ForestTypes, Hasher, Node, Stage, Values, WorldEdge};
use crate::recording::pose::FramePose;
use crate::world::assets::WorldAssets;
use crate::world::balance::{BalanceChoice, BalanceRecipe, Land, Pilot};
use crate::world::chunk_geometry::{LitterGeometry, ObjectGeometry, UndergrowthGeometry};
use crate::world::chunk_ground::ChunkGround;
use crate::world::lidars::LidarRig;
use crate::world::trajectory::{RobotTrajectory, Surroundings};

/// Finds the weights of a world.
#[derive(Clone, Debug)]
pub struct PilotStage(pub(crate) BalanceRecipe);

impl Stage<ForestTypes> for PilotStage {
    type At = ();
    type Inputs = (
        WorldEdge<RobotTrajectory>,
        WorldEdge<WorldAssets>,
        WorldEdge<Vec<LidarRig>>,
        AnyChunkEdge<ChunkGround>,
        AnyChunkEdge<SceneObjects>,
        AnyChunkEdge<ObjectGeometry>,
        AnyChunkEdge<UndergrowthGeometry>,
        AnyChunkEdge<LitterGeometry>,
    );
    type Output = Pilot;
    const ID: &'static str = "world.balance_pilot";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(
        &self,
        (): (),
        world: Key,
        (trajectory, assets, lidars, ground, objects, solid, undergrowth, litter): Values<'_, Self>,
    ) -> Result<Pilot, Error> {
        let land = Land {
            surroundings: Surroundings { ground, objects },
            geometry: (solid, undergrowth, litter),
        };
        self.0.pilot(&trajectory, (&assets, &lidars), land, world)
    }

    fn cache_codec() -> Option<CacheCodec<Pilot>> {
        Some(CacheCodec {
            write: |pilot, out| out.write_all(&pilot.to_bytes()),
            from_bytes: Pilot::from_bytes,
        })
    }
}

/// Chooses where a frame is taken.
#[derive(Clone, Debug)]
pub struct ChoiceStage(pub(crate) BalanceRecipe);

impl Stage<ForestTypes> for ChoiceStage {
    type At = u64;
    type Inputs = (
        WorldEdge<Pilot>,
        WorldEdge<RobotTrajectory>,
        WorldEdge<WorldAssets>,
        WorldEdge<Vec<LidarRig>>,
        AnyChunkEdge<ChunkGround>,
        AnyChunkEdge<SceneObjects>,
        AnyChunkEdge<ObjectGeometry>,
        AnyChunkEdge<UndergrowthGeometry>,
        AnyChunkEdge<LitterGeometry>,
    );
    type Output = BalanceChoice;
    const ID: &'static str = "frame.balance_choice";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(
        &self,
        at: u64,
        world: Key,
        (pilot, trajectory, assets, lidars, ground, objects, solid, undergrowth, litter): Values<
            '_,
            Self,
        >,
    ) -> Result<BalanceChoice, Error> {
        let land = Land {
            surroundings: Surroundings { ground, objects },
            geometry: (solid, undergrowth, litter),
        };
        let sensors = (&*assets, &**lidars);
        self.0
            .choose(at, (&pilot, &trajectory), sensors, land, world)
    }
}

/// Puts the robot where a frame was chosen; it drives straight on there.
#[derive(Clone, Copy, Debug)]
pub struct ChosenPoseStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
    /// How long the pictures take, seconds.
    pub pictures_s: f64,
}

impl Stage<ForestTypes> for ChosenPoseStage {
    type At = u64;
    type Inputs = (
        Node<u64, BalanceChoice>,
        WorldEdge<RobotTrajectory>,
        WorldEdge<Vec<LidarRig>>,
        AnyChunkEdge<ChunkGround>,
        AnyChunkEdge<SceneObjects>,
    );
    type Output = FramePose;
    const ID: &'static str = "frame.chosen_pose";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self {
            chunk_size_m,
            pictures_s,
        } = self;
        hasher.write_f64(*chunk_size_m);
        hasher.write_f64(*pictures_s);
    }

    fn run(
        &self,
        at: u64,
        _: Key,
        (choice, trajectory, lidars, ground, objects): Values<'_, Self>,
    ) -> Result<FramePose, Error> {
        let surroundings = Surroundings { ground, objects };
        let place = |offset_s| trajectory.drive_on(choice.pose_2d, offset_s, surroundings);
        let lengths = (self.chunk_size_m, self.pictures_s);
        FramePose::along(trajectory.time_s(at), &lidars, lengths, place)
    }
}
