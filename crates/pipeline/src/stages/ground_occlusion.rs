//! The light that low plants leave to the ground between them.

use nemoral_raycast::Group;
use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_scene::{ChunkCoord, Instance, Occluder};
use nemoral_seed::Key;
use nemoral_stand::GroundOcclusion;

use crate::Error;
use crate::plan::{Forest, Hasher, Node, OfWorld, Stage, Values};
use crate::world::assets::{LyingSnow, WorldAssets};
use crate::world::chunk_geometry::UndergrowthGeometry;
use crate::world::ground::ChunkGround;
use crate::world::snow::SnowCover;

/// Measures the [`GroundOcclusion`] by the low plants of a chunk; `None` where none grow.
#[derive(Clone, Copy, Debug)]
pub struct GroundOcclusionStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage<Forest> for GroundOcclusionStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, UndergrowthGeometry>,
    );
    type Output = Option<GroundOcclusion>;
    const ID: &'static str = "chunk.ground_occlusion";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (assets, ground, plants): Values<'_, Self>,
    ) -> Result<Option<GroundOcclusion>, Error> {
        let Some(group) = &plants.0 else {
            return Ok(None);
        };
        let origin_m = at.origin_m(self.chunk_size_m);
        let snow = assets
            .snow
            .as_ref()
            .map(|LyingSnow { depth_m, .. }| SnowCover {
                ground: &ground,
                below: &*ground,
                depth_m: *depth_m,
            });
        let buried_m = |plant: &Instance| {
            let place_m = origin_m + plant.position_m.truncate().as_dvec2();
            snow.as_ref().map_or(0.0, |snow| snow.depth_m(place_m)) as f32
        };
        let square = (origin_m, self.chunk_size_m);
        Ok(GroundOcclusion::measure(square, occluders(group, buried_m)))
    }
}

/// What of a group's plants hides light from the ground. Heights are above it, of which `buried_m`
/// is the part of a plant that is below.
fn occluders(group: &Group, buried_m: impl Fn(&Instance) -> f32) -> impl Iterator<Item = Occluder> {
    group.instances().iter().flat_map(move |(plant, _)| {
        let linear = plant.linear;
        // A plant's foot lies on the plane of its ground.
        let normal = linear.x_axis.cross(linear.y_axis);
        let gradient = match normal.z == 0.0 {
            true => Vec2::ZERO,
            false => -normal.truncate() / normal.z,
        };
        let buried_m = buried_m(plant);
        let squared = libm::cbrtf(linear.determinant().powi(2));
        let place = move |occluder: &Occluder| {
            let way_m = linear * occluder.position_m;
            let up_m = way_m.z - gradient.dot(way_m.truncate()) - buried_m;
            let at_m = plant.position_m + way_m;
            Occluder {
                position_m: Vec3::new(at_m.x, at_m.y, up_m),
                area_m2: occluder.area_m2 * squared,
            }
        };
        let of_shape = plant.prototype.ambient_occlusion();
        of_shape
            .into_iter()
            .flat_map(move |of| of.occluders.iter().map(place))
    })
}
