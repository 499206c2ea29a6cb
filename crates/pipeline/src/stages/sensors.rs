//! The robot's sensors.

use nemoral_seed::Key;

use crate::Error;
use crate::plan::{ForestTypes, Hasher, Stage};
use crate::pool::in_pool;
use crate::world::cameras::{CameraRecipe, CameraRig};
use crate::world::lidars::{LidarRecipe, LidarRig};

/// Makes the robot's cameras.
#[derive(Clone, Debug)]
pub struct CameraStage(pub(crate) CameraRecipe);

impl Stage<ForestTypes> for CameraStage {
    type At = ();
    type Inputs = ();
    type Output = Vec<CameraRig>;
    const ID: &'static str = "world.cameras";
    const VERSION: u32 = 4;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(&self, (): (), world: Key, (): ()) -> Result<Vec<CameraRig>, Error> {
        in_pool(|| self.0.make(world))
    }
}

/// Makes the robot's LiDARs.
#[derive(Clone, Debug)]
pub struct LidarStage(pub(crate) Vec<LidarRecipe>);

impl Stage<ForestTypes> for LidarStage {
    type At = ();
    type Inputs = ();
    type Output = Vec<LidarRig>;
    const ID: &'static str = "world.lidars";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        for lidar in &self.0 {
            lidar.fingerprint(hasher);
        }
    }

    fn run(&self, (): (), _: Key, (): ()) -> Result<Vec<LidarRig>, Error> {
        self.0.iter().map(LidarRecipe::make).collect()
    }
}
