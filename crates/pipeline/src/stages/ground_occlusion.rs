//! The light that low plants, and what stands or lies on the ground, leave to the ground around.

use nemoral_raycast::Group;
use nemoral_scene::{ChunkCoord, Instance, Surface};
use nemoral_seed::Key;
use nemoral_stand::{GroundOcclusion, occluders_of_objects, occluders_of_plants};

use crate::Error;
use crate::plan::{ForestTypes, Hasher, Node, Stage, Values, WorldEdge};
use crate::world::assets::WorldAssets;
use crate::world::chunk_geometry::{ObjectGeometry, UndergrowthGeometry};
use crate::world::chunk_ground::ChunkGround;
use crate::world::snow::SnowCover;

/// Measures the [`GroundOcclusion`] by what belongs to a chunk; `None` where nothing stands.
#[derive(Clone, Copy, Debug)]
pub struct GroundOcclusionStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage<ForestTypes> for GroundOcclusionStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<WorldAssets>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, ObjectGeometry>,
        Node<ChunkCoord, UndergrowthGeometry>,
    );
    type Output = Option<GroundOcclusion>;
    const ID: &'static str = "chunk.ground_occlusion";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (assets, ground, objects, plants): Values<'_, Self>,
    ) -> Result<Option<GroundOcclusion>, Error> {
        let origin_m = at.origin_m(self.chunk_size_m);
        let snow = assets.snow.as_ref();
        let snow = snow.map(|snow| SnowCover::new(snow, &ground, &*ground));
        let buried_m = |plant: &Instance| {
            let place_m = origin_m + plant.position_m.truncate().as_dvec2();
            snow.as_ref().map_or(0.0, |snow| snow.depth_m(place_m)) as f32
        };
        let surface: &dyn Surface = match &snow {
            Some(snow) => snow,
            None => &*ground,
        };
        let objects = occluders_of_objects(instances(&objects.group), (surface, origin_m));
        let plants = plants.0.iter().flat_map(|group| instances(group));
        let occluders = objects.chain(occluders_of_plants(plants, buried_m));
        let square = (origin_m, self.chunk_size_m);
        Ok(GroundOcclusion::measure(square, occluders))
    }
}

fn instances(group: &Group) -> impl Iterator<Item = &Instance> {
    group.instances().iter().map(|(instance, _)| instance)
}
