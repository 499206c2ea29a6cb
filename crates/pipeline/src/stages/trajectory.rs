//! The trajectory that a config asks for.

use nemoral_seed::Key;

use crate::Error;
use crate::plan::{Forest, Hasher, OfWorld, Stage, Values};
use crate::world::ground::GroundModel;
use crate::world::trajectory::RobotTrajectory;
use crate::world::trajectory_recipe::TrajectoryRecipe;

/// Finds the [`RobotTrajectory`].
#[derive(Clone, Debug)]
pub struct TrajectoryStage(pub(crate) TrajectoryRecipe);

impl Stage<Forest> for TrajectoryStage {
    type At = ();
    type Inputs = (OfWorld<GroundModel>,);
    type Output = RobotTrajectory;
    const ID: &'static str = "world.trajectory";
    const VERSION: u32 = 8;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(
        &self,
        (): (),
        world: Key,
        (ground,): Values<'_, Self>,
    ) -> Result<RobotTrajectory, Error> {
        self.0.make(&ground, world)
    }
}
