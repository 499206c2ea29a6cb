//! The light that low plants, and what stands or lies on the ground, leave to the ground around.

use std::cell::RefCell;
use std::collections::HashMap;

use nemoral_raycast::Group;
use nemoral_scene::glam::{DVec2, IVec2, Vec2, Vec3};
use nemoral_scene::{ChunkCoord, Instance, Occluder, Surface};
use nemoral_seed::Key;
use nemoral_stand::GroundOcclusion;

use crate::Error;
use crate::plan::{Forest, Hasher, Node, OfWorld, Stage, Values};
use crate::world::assets::{LyingSnow, WorldAssets};
use crate::world::chunk_geometry::{ObjectGeometry, UndergrowthGeometry};
use crate::world::ground::ChunkGround;
use crate::world::snow::SnowCover;

/// Objects count up to this height, metres: what is higher hides as much of the sky from farther
/// ground, and is among what the sky view factor is measured with.
const CONTACT_M: f32 = 0.5;

/// Measures the [`GroundOcclusion`] by what belongs to a chunk; `None` where nothing stands.
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
        Node<ChunkCoord, ObjectGeometry>,
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
        (assets, ground, objects, plants): Values<'_, Self>,
    ) -> Result<Option<GroundOcclusion>, Error> {
        let origin_m = at.origin_m(self.chunk_size_m);
        let snow = assets.snow.as_ref();
        let snow = snow.map(|LyingSnow { depth_m, .. }| SnowCover {
            ground: &ground,
            below: &*ground,
            depth_m: *depth_m,
        });
        let buried_m = |plant: &Instance| {
            let place_m = origin_m + plant.position_m.truncate().as_dvec2();
            snow.as_ref().map_or(0.0, |snow| snow.depth_m(place_m)) as f32
        };
        let heights = Heights {
            ground: match &snow {
                Some(snow) => snow,
                None => &*ground,
            },
            origin_m,
            known: RefCell::default(),
        };
        let plants = plants.0.iter().flat_map(|group| of_plants(group, buried_m));
        let occluders = of_objects(&objects.group, &heights).chain(plants);
        Ok(GroundOcclusion::measure(
            (origin_m, self.chunk_size_m),
            occluders,
        ))
    }
}

/// Of low plants. The foot of each lies on the plane of its ground, `buried_m` below the surface;
/// that of a climber is level, which is about right near its stem.
fn of_plants(group: &Group, buried_m: impl Fn(&Instance) -> f32) -> impl Iterator<Item = Occluder> {
    group.instances().iter().flat_map(move |(plant, _)| {
        let linear = plant.linear;
        let normal = linear.x_axis.cross(linear.y_axis);
        let gradient = match normal.z == 0.0 {
            true => Vec2::ZERO,
            false => -normal.truncate() / normal.z,
        };
        let buried_m = buried_m(plant);
        placed(plant).map(move |(position_m, area_m2)| {
            let way_m = position_m - plant.position_m;
            let up_m = way_m.z - gradient.dot(way_m.truncate()) - buried_m;
            Occluder {
                position_m: position_m.truncate().extend(up_m),
                area_m2,
            }
        })
    })
}

/// Of what stands or lies in any way.
fn of_objects<'a>(group: &'a Group, ground: &'a Heights<'_>) -> impl Iterator<Item = Occluder> {
    let objects = group.instances().iter();
    objects
        .flat_map(|(object, _)| placed(object))
        .map(|(position_m, area_m2)| {
            let place_m = position_m.truncate();
            Occluder {
                position_m: place_m.extend(position_m.z - ground.at_m(place_m)),
                area_m2,
            }
        })
        .filter(|occluder| occluder.position_m.z < CONTACT_M)
}

/// Where the occluders of an instance are in its chunk, and their areas.
fn placed(instance: &Instance) -> impl Iterator<Item = (Vec3, f32)> {
    let (linear, position_m) = (instance.linear, instance.position_m);
    let squared = libm::cbrtf(linear.determinant() * linear.determinant());
    let place = move |occluder: &Occluder| {
        let position_m = position_m + linear * occluder.position_m;
        (position_m, occluder.area_m2 * squared)
    };
    instance.prototype.occluders().iter().map(place)
}

/// The heights of a surface where they are asked for, between nodes of a grid.
struct Heights<'a> {
    ground: &'a dyn Surface,
    /// The world position of the chunk's corner.
    origin_m: DVec2,
    known: RefCell<HashMap<IVec2, f32>>,
}

impl Heights<'_> {
    /// The distance of nodes, metres.
    const STEP_M: f32 = 0.5;

    /// The height at a place relative to the chunk's corner.
    fn at_m(&self, place_m: Vec2) -> f32 {
        let at = place_m / Self::STEP_M;
        let low = at.floor();
        let [fx, fy] = (at - low).to_array();
        let node = |dx, dy| self.of_node(low.as_ivec2() + IVec2::new(dx, dy));
        let row = |dy| node(0, dy) * (1.0 - fx) + node(1, dy) * fx;
        row(0) * (1.0 - fy) + row(1) * fy
    }

    fn of_node(&self, node: IVec2) -> f32 {
        let height = || {
            let place_m = node.as_dvec2() * f64::from(Self::STEP_M);
            self.ground.height_m(self.origin_m + place_m) as f32
        };
        *self.known.borrow_mut().entry(node).or_insert_with(height)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nemoral_raycast::Blas;
    use nemoral_scene::glam::Mat3;
    use nemoral_scene::{
        Card, FlatSurface, InstancePlace, Material, MaterialId, MaterialLibrary, Mesh, ObjectId,
        Prototype, Semantic,
    };

    use super::*;

    /// A group of one shape whose occluder is 0.3 m beside its foot and 0.4 m above it.
    fn group(linear: Mat3, position_m: Vec3) -> Group {
        let mut library = MaterialLibrary::new();
        library.add(Material::plain("leaf", Semantic::Leaf, Vec3::ONE));
        let card = Card {
            corner: Vec3::ZERO,
            edge_u: Vec3::X,
            edge_v: Vec3::Z,
            material: MaterialId(0),
        };
        let occluder = Occluder {
            position_m: Vec3::new(0.3, 0.0, 0.4),
            area_m2: 0.02,
        };
        let shape = Prototype::new("tuft", Mesh::default(), vec![card], &library);
        let shape = shape.expect("sound").with_occluders(vec![occluder]);
        let place = InstancePlace {
            position_m,
            linear,
            object: ObjectId::NONE,
            variation: 0.5,
        };
        Group::build(vec![(
            place,
            Arc::new(Blas::build(Arc::new(shape), &library)),
        )])
    }

    fn only(mut occluders: impl Iterator<Item = Occluder>) -> (Vec3, f32) {
        let occluder = occluders.next().expect("one");
        assert!(occluders.next().is_none());
        (occluder.position_m, occluder.area_m2)
    }

    #[test]
    fn plants_stand_above_the_plane_of_their_foot() {
        // Twice as large, on a slope that rises to the east as fast as it goes there.
        let linear = Instance::upright(0.0, 2.0, Vec2::new(1.0, 0.0));
        let group = group(linear, Vec3::new(10.0, 20.0, 5.0));
        for (buried_m, up_m) in [(0.0, 0.8), (0.5, 0.3)] {
            let (at_m, area_m2) = only(of_plants(&group, |_| buried_m));
            assert!(
                (at_m - Vec3::new(10.6, 20.0, up_m)).length() < 1e-5,
                "{at_m}"
            );
            assert!((area_m2 - 0.08).abs() < 1e-6, "{area_m2}");
        }
    }

    #[test]
    fn objects_stand_above_the_ground_below_them() {
        // A slope of a half to the east, 4 m high at the world's origin.
        let slope = FlatSurface {
            height_m: 4.0,
            gradient: DVec2::new(0.5, 0.0),
        };
        let heights = Heights {
            ground: &slope,
            origin_m: DVec2::new(100.0, 0.0),
            known: RefCell::default(),
        };
        // It lies 0.1 m above the slope, which is 59 m high at 110 m.
        let at = |up_m: f32| group(Mat3::IDENTITY, Vec3::new(9.7, 20.0, 59.0 - 0.4 + up_m));
        let low = at(0.1);
        let (at_m, _) = only(of_objects(&low, &heights));
        assert!(
            (at_m - Vec3::new(10.0, 20.0, 0.1)).length() < 1e-4,
            "{at_m}"
        );
        assert!(of_objects(&at(CONTACT_M + 0.01), &heights).next().is_none());
    }
}
