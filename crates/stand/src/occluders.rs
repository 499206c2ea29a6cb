//! What hides light from the ground, where it stands.

use std::cell::RefCell;
use std::collections::HashMap;

use nemoral_scene::glam::{DVec2, IVec2, Vec2};
use nemoral_scene::{Instance, Occluder, Surface};

/// Objects count up to this height, metres: what is higher hides as much of the sky from farther
/// ground, and is among what the sky view factor is measured with.
const CONTACT_M: f32 = 0.5;

/// The occluders of low plants, with heights above the ground, by which
/// [`GroundOcclusion`](crate::GroundOcclusion) is measured.
///
/// The foot of each lies on the plane of its ground, which is `buried_m` below the surface; that of
/// a climber is level, which is about right near its stem.
pub fn occluders_of_plants<'a>(
    plants: impl Iterator<Item = &'a Instance>,
    buried_m: impl Fn(&Instance) -> f32,
) -> impl Iterator<Item = Occluder> {
    plants.flat_map(move |plant| {
        let normal = plant.linear.x_axis.cross(plant.linear.y_axis);
        let gradient = match normal.z == 0.0 {
            true => Vec2::ZERO,
            false => -normal.truncate() / normal.z,
        };
        let surface_m = plant.position_m.z + buried_m(plant);
        placed(plant).map(move |mut occluder| {
            let way_m = (occluder.position_m - plant.position_m).truncate();
            occluder.position_m.z -= surface_m + gradient.dot(way_m);
            occluder
        })
    })
}

/// The same of objects that stand or lie in any way on a ground, in world coordinates; theirs are
/// relative to a corner at `origin_m`. Only what is near the ground counts.
pub fn occluders_of_objects<'a>(
    objects: impl Iterator<Item = &'a Instance>,
    (ground, origin_m): (&dyn Surface, DVec2),
) -> impl Iterator<Item = Occluder> {
    let heights = Heights {
        ground,
        origin_m,
        known: RefCell::default(),
    };
    let above_ground = move |mut occluder: Occluder| {
        occluder.position_m.z -= heights.at_m(occluder.position_m.truncate());
        occluder
    };
    (objects.flat_map(placed).map(above_ground))
        .filter(|occluder| occluder.position_m.z < CONTACT_M)
}

/// The occluders of an instance where it is placed.
fn placed(instance: &Instance) -> impl Iterator<Item = Occluder> {
    let (linear, position_m) = (instance.linear, instance.position_m);
    let squared = libm::cbrtf(linear.determinant() * linear.determinant());
    let place = move |occluder: &Occluder| Occluder {
        position_m: position_m + linear * occluder.position_m,
        area_m2: occluder.area_m2 * squared,
    };
    instance.prototype.occluders().iter().map(place)
}

/// The heights of a surface where they are asked for, between nodes of a grid.
struct Heights<'a> {
    ground: &'a dyn Surface,
    /// The world position of the corner.
    origin_m: DVec2,
    known: RefCell<HashMap<IVec2, f32>>,
}

impl Heights<'_> {
    /// The distance of nodes, metres.
    const STEP_M: f32 = 0.5;

    /// The height at a place relative to the corner.
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

    use nemoral_scene::glam::{Mat3, Vec3};
    use nemoral_scene::{
        Card, FlatSurface, InstancePlace, Material, MaterialId, MaterialLibrary, Mesh, Prototype,
        Semantic,
    };

    use super::*;

    /// A shape whose occluder is 0.3 m beside its foot and 0.4 m above it.
    fn tuft(linear: Mat3, position_m: Vec3) -> Instance {
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
            linear,
            ..InstancePlace::at(position_m)
        };
        Instance::new(Arc::new(shape), place)
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
        let tuft = tuft(linear, Vec3::new(10.0, 20.0, 5.0));
        for (buried_m, up_m) in [(0.0, 0.8), (0.5, 0.3)] {
            let plants = std::iter::once(&tuft);
            let (at_m, area_m2) = only(occluders_of_plants(plants, |_| buried_m));
            let expected_m = Vec3::new(10.6, 20.0, up_m);
            assert!((at_m - expected_m).length() < 1e-5, "{at_m}");
            assert!((area_m2 - 0.08).abs() < 1e-6, "{area_m2}");
        }
    }

    #[test]
    fn objects_stand_above_the_ground_below_them() {
        // A slope of a half to the east, which is 4 m high at the world's origin and 59 m at 110 m.
        let slope = FlatSurface {
            height_m: 4.0,
            gradient: DVec2::new(0.5, 0.0),
        };
        let ground = (&slope as &dyn Surface, DVec2::new(100.0, 0.0));
        let up = |up_m: f32| tuft(Mat3::IDENTITY, Vec3::new(9.7, 20.0, 59.0 - 0.4 + up_m));
        let low = up(0.1);
        let (at_m, _) = only(occluders_of_objects(std::iter::once(&low), ground));
        assert!(
            (at_m - Vec3::new(10.0, 20.0, 0.1)).length() < 1e-4,
            "{at_m}"
        );
        let high = up(CONTACT_M + 0.01);
        assert!(
            occluders_of_objects(std::iter::once(&high), ground)
                .next()
                .is_none()
        );
    }
}
