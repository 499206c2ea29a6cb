//! All plans of a request, wired.

use nemoral_assets::Library;
use nemoral_placement::{CoverPoint, Placement, Site};
use nemoral_render::CameraImages;
use nemoral_scene::{Annotations, ChunkCoord, LidarPoint, MaterialLibrary};
use nemoral_seed::Key;
use nemoral_stand::{FallenStem, GroundOcclusion, SceneObjects, SkyViewFactor};

use crate::config::Config;
use crate::plan::{Node, Plan};
use crate::recording::annotations::AnnotationRecipe;
use crate::recording::pose::{FramePose, pictures_s};
use crate::recording::scene::FrameScene;
use crate::recording::visible_reach::VisibleReach;
use crate::stages::annotations::{AnnotationStage, TrunkStage, UncoveredGeometryStage};
use crate::stages::assets::{AssetStage, LibraryStage, MaterialStage};
use crate::stages::balance::{ChoiceStage, ChosenPoseStage, PilotStage};
use crate::stages::deadwood::{DeadwoodStage, FallenStemStage};
use crate::stages::frame::{
    CameraSceneStage, ImageStage, LidarSceneStage, PoseStage, ScanStage, SceneStage,
};
use crate::stages::ground::{ChunkGroundStage, GroundStage};
use crate::stages::ground_occlusion::GroundOcclusionStage;
use crate::stages::litter::{LitterGeometryStage, LitterStage};
use crate::stages::object_geometry::ObjectGeometryStage;
use crate::stages::placement::{PlacementStage, RockPhaseStage, RockStage, WoodyStage};
use crate::stages::scene_objects::SceneObjectStage;
use crate::stages::sensors::{CameraStage, LidarStage};
use crate::stages::sky_view_factor::{GroundSkyViewStage, SkyViewStage};
use crate::stages::trajectory::TrajectoryStage;
use crate::stages::undergrowth::{FloraStage, SeedlingStage, UndergrowthStage};
use crate::stages::undergrowth_geometry::UndergrowthGeometryStage;
use crate::world::assets::WorldAssets;
use crate::world::balance::{BalanceChoice, BalanceRecipe, Pilot};
use crate::world::cameras::{CameraRecipe, CameraRig};
use crate::world::chunk_geometry::{LitterGeometry, ObjectGeometry, UndergrowthGeometry};
use crate::world::chunk_ground::ChunkGround;
use crate::world::deadwood::LogRecipe;
use crate::world::flora::FloraRecipe;
use crate::world::ground::GroundModel;
use crate::world::ground_mesh::GroundMeshRecipe;
use crate::world::ground_recipe::GroundRecipe;
use crate::world::library_recipe::LibraryRecipe;
use crate::world::lidars::{LidarRecipe, LidarRig};
use crate::world::litter::LitterPatch;
use crate::world::models::ModelRecipe;
use crate::world::patch::Patch;
use crate::world::placement::PlacementRecipe;
use crate::world::trajectory::RobotTrajectory;
use crate::world::trajectory_recipe::TrajectoryRecipe;
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
        config.check_values()?;
        inputs.check(config)?;
        let chunk_size_m = config.chunks.size_m;
        let world_key = Key::world(config.seed);
        let mut plan = Plan::new(world_key);

        let ground_model = plan.add(GroundStage(GroundRecipe::new(config, inputs)), ());
        let recipe = LibraryRecipe::new(config, inputs);
        let models = ModelRecipe::new(config, inputs);
        let mut add_assets = |recipe: LibraryRecipe| {
            let library = plan.add(LibraryStage(recipe.clone()), ());
            let models = models.clone();
            (
                library,
                plan.add(AssetStage { recipe, models }, (library.global(),)),
            )
        };
        let (library, assets) = add_assets(recipe.clone());
        // Grown only when asked for, and the same node where there is a camera.
        let textured_assets = match config.all_cameras().next() {
            Some(_) => assets,
            None => add_assets(recipe.textured()).1,
        };
        let wetness = config.weather.wetness();
        let materials = plan.add(MaterialStage { wetness }, (assets.global(),));
        let placement = plan.add(
            PlacementStage(PlacementRecipe::new(config)),
            (assets.global(), ground_model.global()),
        );
        let flora = plan.add(FloraStage(FloraRecipe::new(config)), ());
        let trajectory = plan.add(
            TrajectoryStage(TrajectoryRecipe::new(config, inputs)),
            (ground_model.global(),),
        );
        let cameras = plan.add(
            CameraStage(CameraRecipe::new(config, inputs, backend.clone())),
            (),
        );
        let lidars = plan.add(LidarStage(LidarRecipe::all(config, inputs)), ());

        let ground = plan.add(ChunkGroundStage, (ground_model.global(),));
        // Rocks of a phase see those of lower phases, so there are four nodes and the plan is
        // acyclic.
        let world = placement.global();
        let phase0 = plan.add(RockPhaseStage::<0>, (world, ground, []));
        let phase1 = plan.add(RockPhaseStage::<1>, (world, ground, [phase0.anywhere()]));
        let lower = [phase0.anywhere(), phase1.anywhere()];
        let phase2 = plan.add(RockPhaseStage::<2>, (world, ground, lower));
        let lower = [phase0.anywhere(), phase1.anywhere(), phase2.anywhere()];
        let phase3 = plan.add(RockPhaseStage::<3>, (world, ground, lower));
        let phases = [phase0, phase1, phase2, phase3].map(Node::anywhere);
        let rocks = plan.add(
            RockStage {
                outcrops: config.placement.outcrops,
                chunk_size_m,
            },
            (world, ground, phases),
        );
        let woody = plan.add(WoodyStage, (world, ground, rocks.anywhere()));
        let logs = LogRecipe::new(config);
        let is_empty = logs.is_empty();
        let fallen = plan.add(
            FallenStemStage(logs),
            (
                assets.global(),
                ground_model.global(),
                ground,
                rocks.anywhere(),
                woody.anywhere(),
            ),
        );
        let deadwood = plan.add(DeadwoodStage { is_empty }, (fallen.anywhere(),));
        let objects = plan.add(
            SceneObjectStage,
            (
                assets.global(),
                ground_model.global(),
                ground,
                rocks,
                woody,
                deadwood,
            ),
        );
        let object_geometry = plan.add(
            ObjectGeometryStage {
                ground: GroundMeshRecipe::new(config)?,
                chunk_size_m,
            },
            (assets.global(), ground, objects),
        );
        let ground_sky_view_factor = plan.add(
            GroundSkyViewStage { chunk_size_m },
            (assets.global(), ground, object_geometry.anywhere()),
        );
        let sky_view_factor = plan.add(
            SkyViewStage { chunk_size_m },
            (
                assets.global(),
                ground,
                ground_sky_view_factor,
                object_geometry.anywhere(),
            ),
        );
        let undergrowth = plan.add(
            UndergrowthStage,
            (flora.global(), ground, ground_sky_view_factor),
        );
        let seedlings = plan.add(
            SeedlingStage {
                per_m2: config.placement.regeneration.seedlings,
                chunk_size_m,
            },
            (world, ground, ground_sky_view_factor),
        );
        let undergrowth_geometry = plan.add(
            UndergrowthGeometryStage {
                climbers: config.climbers.clone(),
                banks: config.trails.banks,
                surface_roots: config.undergrowth.surface_roots,
                chunk_size_m,
            },
            (
                assets.global(),
                ground_model.global(),
                ground,
                undergrowth,
                seedlings,
                objects,
                ground_sky_view_factor,
            ),
        );
        let ground_occlusion = plan.add(
            GroundOcclusionStage { chunk_size_m },
            (
                assets.global(),
                ground,
                object_geometry,
                undergrowth_geometry,
            ),
        );
        let litter = plan.add(
            LitterStage { chunk_size_m },
            (
                flora.global(),
                assets.global(),
                ground,
                ground_sky_view_factor,
                object_geometry,
                objects.anywhere(),
            ),
        );
        let litter_geometry = plan.add(
            LitterGeometryStage { chunk_size_m },
            (assets.global(), litter),
        );

        let (ground_there, objects_there) = (ground.anywhere(), objects.anywhere());
        let pictures_s = pictures_s(config);
        let chosen = BalanceRecipe::new(config, inputs).map(|recipe| {
            let (path, assets, lidars) = (trajectory.global(), assets.global(), lidars.global());
            let (solid, low) = (object_geometry.anywhere(), undergrowth_geometry.anywhere());
            let litter = litter_geometry.anywhere();
            let pilot = plan.add(
                PilotStage(recipe.clone()),
                (
                    path,
                    assets,
                    lidars,
                    ground_there,
                    objects_there,
                    solid,
                    low,
                    litter,
                ),
            );
            let choice = plan.add(
                ChoiceStage(recipe),
                (
                    pilot.global(),
                    path,
                    assets,
                    lidars,
                    ground_there,
                    objects_there,
                    solid,
                    low,
                    litter,
                ),
            );
            let pose = plan.add(
                ChosenPoseStage {
                    chunk_size_m,
                    pictures_s,
                },
                (choice, path, lidars, ground_there, objects_there),
            );
            (pilot, choice, pose)
        });
        let pose = match chosen {
            Some((_, _, pose)) => pose,
            None => plan.add(
                PoseStage {
                    chunk_size_m,
                    pictures_s,
                },
                (
                    trajectory.global(),
                    lidars.global(),
                    ground_there,
                    objects_there,
                ),
            ),
        };
        let reach = VisibleReach::new(config);
        let scene = plan.add(
            SceneStage(reach),
            (
                pose,
                object_geometry.anywhere(),
                undergrowth_geometry.anywhere(),
                litter_geometry.anywhere(),
                sky_view_factor.anywhere(),
                ground_occlusion.anywhere(),
            ),
        );
        let camera_scene = plan.add(
            CameraSceneStage(reach),
            (
                cameras.global(),
                assets.global(),
                ground_model.global(),
                pose,
                object_geometry.anywhere(),
                undergrowth_geometry.anywhere(),
                litter_geometry.anywhere(),
                sky_view_factor.anywhere(),
                ground_occlusion.anywhere(),
            ),
        );
        let lidar_scene = plan.add(
            LidarSceneStage(reach),
            (
                lidars.global(),
                assets.global(),
                ground_model.global(),
                pose,
                object_geometry.anywhere(),
                undergrowth_geometry.anywhere(),
                litter_geometry.anywhere(),
            ),
        );
        let images = plan.add(
            ImageStage,
            (cameras.global(), materials.global(), pose, camera_scene),
        );
        let trunks = plan.add(
            TrunkStage {
                ontology: config.output.ontology,
            },
            (assets.global(),),
        );
        let uncovered_geometry = plan.add(
            UncoveredGeometryStage { chunk_size_m },
            (trunks.global(), assets.global(), object_geometry, objects),
        );
        let annotations = plan.add(
            AnnotationStage(AnnotationRecipe::new(config)),
            (
                cameras.global(),
                trajectory.global(),
                pose.anywhere(),
                camera_scene.anywhere(),
                images,
                uncovered_geometry.anywhere(),
            ),
        );
        let scans = plan.add(
            ScanStage,
            (lidars.global(), materials.global(), pose, lidar_scene),
        );

        Ok(Self {
            plan,
            backend,
            world: world_key,
            reach,
            ground_model,
            library,
            assets,
            textured_assets,
            materials,
            placement,
            trajectory,
            cameras,
            lidars,
            ground,
            rocks,
            woody,
            deadwood,
            objects,
            sky_view_factor,
            ground_sky_view_factor,
            undergrowth,
            seedlings,
            object_geometry,
            undergrowth_geometry,
            ground_occlusion,
            litter,
            litter_geometry,
            balance_pilot: chosen.map(|(pilot, _, _)| pilot),
            balance_choice: chosen.map(|(_, choice, _)| choice),
            pose,
            scene,
            camera_scene,
            lidar_scene,
            images,
            uncovered_geometry,
            annotations,
            scans,
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
