//! The objects of a chunk: its sites, numbered and put on the ground.

use nemoral_placement::Site;
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::{FallenStem, InstanceVariation, SceneObjects};

use crate::Error;
use crate::plan::{ForestTypes, Hasher, Node, Stage, Values, WorldEdge};
use crate::world::assets::WorldAssets;
use crate::world::chunk_ground::ChunkGround;
use crate::world::ground::GroundModel;
use crate::world::object_sites::object_sites;

/// Numbers the sites of a chunk and puts them on its ground.
#[derive(Clone, Copy, Debug)]
pub struct SceneObjectStage;

impl Stage<ForestTypes> for SceneObjectStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<WorldAssets>,
        WorldEdge<GroundModel>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, Vec<Site>>,
        Node<ChunkCoord, Vec<Site>>,
        Node<ChunkCoord, Vec<FallenStem>>,
    );
    type Output = SceneObjects;
    const ID: &'static str = "chunk.objects";
    const VERSION: u32 = 7;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (assets, model, ground, rocks, woody, logs): Values<'_, Self>,
    ) -> Result<SceneObjects, Error> {
        let sites = object_sites(at, world, (&rocks, &woody, &logs), &ground, &assets, &model);
        let variation = InstanceVariation::new(world);
        SceneObjects::place_on_ground(at, &sites, &*ground, &variation).map_err(Error::of_stage)
    }
}
