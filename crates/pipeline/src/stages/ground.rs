//! The ground of a world and of its chunks.

use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;

use crate::Error;
use crate::plan::{ForestTypes, Hasher, Stage, Values, WorldEdge};
use crate::world::chunk_ground::ChunkGround;
use crate::world::ground::GroundModel;
use crate::world::ground_recipe::GroundRecipe;

/// Makes the [`GroundModel`].
#[derive(Clone, Debug)]
pub struct GroundStage(pub(crate) GroundRecipe);

impl Stage<ForestTypes> for GroundStage {
    type At = ();
    type Inputs = ();
    type Output = GroundModel;
    const ID: &'static str = "world.ground";
    const VERSION: u32 = 10;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(&self, (): (), world: Key, (): ()) -> Result<GroundModel, Error> {
        self.0.make(world)
    }
}

/// The ground of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct ChunkGroundStage;

impl Stage<ForestTypes> for ChunkGroundStage {
    type At = ChunkCoord;
    type Inputs = (WorldEdge<GroundModel>,);
    type Output = ChunkGround;
    const ID: &'static str = "chunk.ground";
    const VERSION: u32 = 9;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (ground,): Values<'_, Self>,
    ) -> Result<ChunkGround, Error> {
        Ok(ground.near(at))
    }
}
