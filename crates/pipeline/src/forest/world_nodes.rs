//! What is made once for the world.

use nemoral_assets::Library;
use nemoral_placement::Placement;
use nemoral_scene::MaterialLibrary;

use crate::config::Config;
use crate::plan::{Node, Plan};
use crate::stages::assets::{AssetStage, LibraryStage, MaterialStage};
use crate::stages::ground::GroundStage;
use crate::stages::placement::PlacementStage;
use crate::stages::sensors::{CameraStage, LidarStage};
use crate::stages::trajectory::TrajectoryStage;
use crate::stages::undergrowth::FloraStage;
use crate::world::assets::WorldAssets;
use crate::world::cameras::{CameraRecipe, CameraRig};
use crate::world::flora::{Flora, FloraRecipe};
use crate::world::ground::GroundModel;
use crate::world::ground_recipe::GroundRecipe;
use crate::world::library_recipe::LibraryRecipe;
use crate::world::lidars::{LidarRecipe, LidarRig};
use crate::world::models::ModelRecipe;
use crate::world::placement::PlacementRecipe;
use crate::world::trajectory::RobotTrajectory;
use crate::world::trajectory_recipe::TrajectoryRecipe;
use crate::{Backend, InputFiles};

/// The nodes of the world.
pub(super) struct WorldNodes {
    pub(super) ground_model: Node<(), GroundModel>,
    pub(super) library: Node<(), Library>,
    pub(super) assets: Node<(), WorldAssets>,
    pub(super) textured_assets: Node<(), WorldAssets>,
    pub(super) materials: Node<(), MaterialLibrary>,
    pub(super) placement: Node<(), Placement>,
    pub(super) flora: Node<(), Flora>,
    pub(super) trajectory: Node<(), RobotTrajectory>,
    pub(super) cameras: Node<(), Vec<CameraRig>>,
    pub(super) lidars: Node<(), Vec<LidarRig>>,
}

impl WorldNodes {
    /// Adds them to a plan.
    pub(super) fn add_to(
        plan: &mut Plan,
        config: &Config,
        inputs: &InputFiles,
        backend: &Backend,
    ) -> Self {
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
        Self {
            ground_model,
            library,
            assets,
            textured_assets,
            materials,
            placement,
            flora,
            trajectory,
            cameras,
            lidars,
        }
    }
}
