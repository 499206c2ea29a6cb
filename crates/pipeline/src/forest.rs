//! All plans of a request, wired.

mod chunk_nodes;
mod frame_nodes;
mod world_nodes;

use nemoral_assets::Library;
use nemoral_placement::{CoverPoint, Placement, Site};
use nemoral_render::CameraImages;
use nemoral_scene::{Annotations, ChunkCoord, LidarPoint, MaterialLibrary};
use nemoral_seed::Key;
use nemoral_stand::{FallenStem, GroundOcclusion, SceneObjects, SkyViewFactor};

use self::chunk_nodes::ChunkNodes;
use self::frame_nodes::FrameNodes;
use self::world_nodes::WorldNodes;
use crate::config::Config;
use crate::plan::{Node, Plan};
use crate::recording::pose::FramePose;
use crate::recording::scene::FrameScene;
use crate::recording::visible_reach::VisibleReach;
use crate::world::assets::WorldAssets;
use crate::world::balance::{BalanceChoice, Pilot};
use crate::world::cameras::CameraRig;
use crate::world::chunk_geometry::{LitterGeometry, ObjectGeometry, UndergrowthGeometry};
use crate::world::chunk_ground::ChunkGround;
use crate::world::ground::GroundModel;
use crate::world::lidars::LidarRig;
use crate::world::litter::LitterPatch;
use crate::world::patch::Patch;
use crate::world::trajectory::RobotTrajectory;
use crate::world::uncovered::UncoveredGeometry;
use crate::{Backend, Error, InputFiles};

/// The world, chunk and frame plans of a config.
#[derive(Debug)]
pub struct ForestPlan {
    plan: Plan,
    backend: Backend,
    world: Key,
    pub(crate) reach: VisibleReach,
    /// World: the ground's terrain and trails.
    pub ground_model: Node<(), GroundModel>,
    /// World: the library of grown plants.
    pub library: Node<(), Library>,
    /// World: the library, prepared for ray casting.
    pub assets: Node<(), WorldAssets>,
    /// World: the same with textures, which `assets` lacks where no camera looks at them.
    pub textured_assets: Node<(), WorldAssets>,
    /// World: the materials of `assets`, as wet as the weather makes them.
    pub materials: Node<(), MaterialLibrary>,
    /// World: how objects are placed.
    pub placement: Node<(), Placement>,
    /// World: the robot's path.
    pub trajectory: Node<(), RobotTrajectory>,
    /// World: the cameras, the first one first.
    pub cameras: Node<(), Vec<CameraRig>>,
    /// World: the LiDARs, the first one first.
    pub lidars: Node<(), Vec<LidarRig>>,
    /// Chunk: its ground as a surface.
    pub ground: Node<ChunkCoord, ChunkGround>,
    /// Chunk: where its rocks are.
    pub rocks: Node<ChunkCoord, Vec<Site>>,
    /// Chunk: where its trees, stumps and shrubs are.
    pub woody: Node<ChunkCoord, Vec<Site>>,
    /// Chunk: where its logs lie.
    pub deadwood: Node<ChunkCoord, Vec<FallenStem>>,
    /// Chunk: everything with an id.
    pub objects: Node<ChunkCoord, SceneObjects>,
    /// Chunk: the sky view factor under its crowns.
    pub sky_view_factor: Node<ChunkCoord, SkyViewFactor>,
    /// Chunk: the part of it near the ground, by which plants grow.
    pub ground_sky_view_factor: Node<ChunkCoord, SkyViewFactor>,
    /// Chunk: its low plants.
    pub undergrowth: Node<ChunkCoord, Vec<Patch>>,
    /// Chunk: its tree seedlings.
    pub seedlings: Node<ChunkCoord, Vec<CoverPoint>>,
    /// Chunk: what its trees shed.
    pub litter: Node<ChunkCoord, Vec<LitterPatch>>,
    /// Chunk: geometry of ground and objects.
    pub object_geometry: Node<ChunkCoord, ObjectGeometry>,
    /// Chunk: geometry of low plants.
    pub undergrowth_geometry: Node<ChunkCoord, UndergrowthGeometry>,
    /// Chunk: the light that what stands there leaves to the ground; `None` where nothing does.
    pub ground_occlusion: Node<ChunkCoord, Option<GroundOcclusion>>,
    /// Chunk: geometry of litter.
    pub litter_geometry: Node<ChunkCoord, LitterGeometry>,
    /// World: the weights by which frames are chosen; `None` if the robot drives.
    pub balance_pilot: Option<Node<(), Pilot>>,
    /// Frame: where it is taken; `None` if the robot drives.
    pub balance_choice: Option<Node<u64, BalanceChoice>>,
    /// Frame: the robot's pose.
    pub pose: Node<u64, FramePose>,
    /// Frame: everything that is visible from there, in any direction.
    pub scene: Node<u64, FrameScene>,
    /// Frame: the part of it that the cameras see, which is all that their pictures depend on.
    pub camera_scene: Node<u64, FrameScene>,
    /// Frame: the part of it that the LiDARs see, which is all that their points depend on.
    pub lidar_scene: Node<u64, FrameScene>,
    /// Frame: colour and truth images of each camera.
    pub images: Node<u64, Vec<CameraImages>>,
    /// Chunk: ground and trunks alone.
    pub uncovered_geometry: Node<ChunkCoord, UncoveredGeometry>,
    /// Frame: the annotations that each camera was asked for.
    pub annotations: Node<u64, Vec<Annotations>>,
    /// Frame: the points of each LiDAR.
    pub scans: Node<u64, Vec<Vec<LidarPoint>>>,
}

impl ForestPlan {
    /// Wires the plans of a config; the CPU takes the pictures.
    ///
    /// # Errors
    /// As [`ForestPlan::on`].
    pub fn new(config: &Config) -> Result<Self, Error> {
        Self::on(config, Backend::Cpu)
    }

    /// Wires the plans of a config; `backend` takes the pictures. The files that the config names
    /// are read now.
    ///
    /// # Errors
    /// As [`ForestPlan::with_inputs`], if a file cannot be read, and all of [`Config::check`].
    pub fn on(config: &Config, backend: Backend) -> Result<Self, Error> {
        let inputs = InputFiles::read(config)?;
        config.check(&inputs)?;
        Self::with_inputs(config, &inputs, backend)
    }

    /// Wires the plans of a config and the files that it names, which were read with it.
    ///
    /// Each value is checked. Combinations of values and what is in the files are not, which would
    /// take longer: call [`Config::check`] with a config that code has put together. Those of
    /// [`ConfigLayers`](crate::config::ConfigLayers) and [`Sequences`](crate::config::Sequences)
    /// are checked.
    ///
    /// # Errors
    /// If a value is none that its key allows, if the config names a file that is not among
    /// `inputs`, or if it asks for something impossible that only a stage's crate can detect.
    pub fn with_inputs(
        config: &Config,
        inputs: &InputFiles,
        backend: Backend,
    ) -> Result<Self, Error> {
        config.check_values(inputs)?;
        let world = Key::world(config.seed);
        let mut plan = Plan::new(world);
        let of_world = WorldNodes::add_to(&mut plan, config, inputs, &backend);
        let of_chunk = ChunkNodes::add_to(&mut plan, config, &of_world)?;
        let reach = VisibleReach::new(config);
        let of_frame = FrameNodes::add_to(&mut plan, config, inputs, reach, (&of_world, &of_chunk));
        Ok(Self {
            plan,
            backend,
            world,
            reach,
            ground_model: of_world.ground_model,
            library: of_world.library,
            assets: of_world.assets,
            textured_assets: of_world.textured_assets,
            materials: of_world.materials,
            placement: of_world.placement,
            trajectory: of_world.trajectory,
            cameras: of_world.cameras,
            lidars: of_world.lidars,
            ground: of_chunk.ground,
            rocks: of_chunk.rocks,
            woody: of_chunk.woody,
            deadwood: of_chunk.deadwood,
            objects: of_chunk.objects,
            sky_view_factor: of_chunk.sky_view_factor,
            ground_sky_view_factor: of_chunk.ground_sky_view_factor,
            undergrowth: of_chunk.undergrowth,
            seedlings: of_chunk.seedlings,
            litter: of_chunk.litter,
            object_geometry: of_chunk.object_geometry,
            undergrowth_geometry: of_chunk.undergrowth_geometry,
            ground_occlusion: of_chunk.ground_occlusion,
            litter_geometry: of_chunk.litter_geometry,
            balance_pilot: of_frame.balance_pilot,
            balance_choice: of_frame.balance_choice,
            pose: of_frame.pose,
            scene: of_frame.scene,
            camera_scene: of_frame.camera_scene,
            lidar_scene: of_frame.lidar_scene,
            images: of_frame.images,
            uncovered_geometry: of_frame.uncovered_geometry,
            annotations: of_frame.annotations,
            scans: of_frame.scans,
        })
    }

    /// The renderer that takes the pictures.
    #[must_use]
    pub fn backend(&self) -> &Backend {
        &self.backend
    }

    /// The world's key.
    #[must_use]
    pub fn world(&self) -> Key {
        self.world
    }

    /// The plan itself.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }
}
