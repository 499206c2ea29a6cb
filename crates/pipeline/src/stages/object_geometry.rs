//! The geometry of a chunk's ground and objects, ready for rays.

use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::SceneObjects;

use crate::plan::{ForestTypes, Hasher, Node, Stage, Values, WorldEdge};
use crate::pool::in_pool;
use crate::world::assets::WorldAssets;
use crate::world::chunk_geometry::ObjectGeometry;
use crate::world::chunk_ground::ChunkGround;
use crate::world::ground_mesh::GroundMeshRecipe;
use crate::world::water::water_surfaces;
use crate::{Error, InputFiles};

/// Meshes the ground of a chunk and places its objects on it.
#[derive(Clone, Debug)]
pub struct ObjectGeometryStage {
    pub(crate) ground: GroundMeshRecipe,
    pub(crate) chunk_size_m: f64,
}

impl Stage<ForestTypes> for ObjectGeometryStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<WorldAssets>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, SceneObjects>,
    );
    type Output = ObjectGeometry;
    const ID: &'static str = "chunk.object_geometry";
    const VERSION: u32 = 11;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, &self.ground);
    }

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (assets, ground, objects): Values<'_, Self>,
    ) -> Result<ObjectGeometry, Error> {
        let waters = match &assets.water {
            Some(materials) => water_surfaces(&ground, materials, &assets.library)?,
            None => None,
        };
        let floor = |snow| -> Result<Vec<_>, Error> {
            let ground = in_pool(|| self.ground.make((at, world), &assets, &ground, snow))?;
            Ok(std::iter::once(ground).chain(waters.clone()).collect())
        };
        let in_summer = if assets.differs_from_summer() {
            let placed = |object| assets.instance_in_full_leaf(object, at, self.chunk_size_m);
            let floor = floor(None)?.into_iter();
            Some(floor.chain(objects.0.iter().map(placed)).collect())
        } else {
            None
        };
        let placed = |object| assets.instance(object, at, self.chunk_size_m);
        let floor = floor(assets.snow.as_ref())?.into_iter();
        let instances = floor.chain(objects.0.iter().map(placed));
        Ok(ObjectGeometry::new(instances.collect(), in_summer))
    }
}
