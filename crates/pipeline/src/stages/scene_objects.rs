//! The objects of a chunk: its sites, numbered and put on the ground.

use nemoral_placement::Site;
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::{FallenStem, InstanceVariation, SceneObjects};

use crate::Error;
use crate::plan::{Forest, Hasher, Node, OfWorld, Stage, Values};
use crate::world::assets::WorldAssets;
use crate::world::chunk_ground::ChunkGround;
use crate::world::ground::GroundModel;
use crate::world::object_sites::object_sites;

/// Numbers the sites of a chunk and puts them on its ground.
#[derive(Clone, Copy, Debug)]
pub struct SceneObjectStage;

impl Stage<Forest> for SceneObjectStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        OfWorld<GroundModel>,
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
        SceneObjects::stand(at, &sites, &*ground, &variation).map_err(Error::of_stage)
    }
}
