//! The trajectory that a config asks for.

use nemoral_seed::Key;

use crate::Error;
use crate::plan::{ForestTypes, Hasher, Stage, Values, WorldEdge};
use crate::world::ground::GroundModel;
use crate::world::trajectory::RobotTrajectory;
use crate::world::trajectory_recipe::TrajectoryRecipe;

/// Finds the [`RobotTrajectory`].
#[derive(Clone, Debug)]
pub struct TrajectoryStage(pub(crate) TrajectoryRecipe);

impl Stage<ForestTypes> for TrajectoryStage {
    type At = ();
    type Inputs = (WorldEdge<GroundModel>,);
    type Output = RobotTrajectory;
    const ID: &'static str = "world.trajectory";
    const VERSION: u32 = 9;

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
