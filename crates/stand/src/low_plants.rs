//! Low plants on the ground: their shapes, turns and colours.

use nemoral_scene::glam::{DVec2, Vec2};
use nemoral_scene::{Instance, InstancePlace, ObjectId, Surface};
use nemoral_seed::{Domain, Draw, Key};

/// The domain of the draws by which low plants differ.
pub const LOW_PLANT_VARIATION: Domain = Domain::new("pipeline.low.look");

/// Where a low plant grows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPlant {
    /// World position, metres.
    pub position_m: DVec2,
    /// Its turn about the vertical, radians.
    pub yaw_rad: f64,
    /// Its size relative to its shape.
    pub scale: f64,
    /// Its own key.
    pub key: Key,
}

impl LowPlant {
    /// The plant as one of several shapes, on the slope of its ground, its stems vertical.
    ///
    /// Shapes are chosen with these weights, or with equal chances; there is no plant if there is
    /// nothing to choose from. `origin_m` is the world position of the instance's frame.
    pub fn place<'s, S>(
        &self,
        shapes: &'s [S],
        weights: Option<&[f64]>,
        ground: &(impl Surface + ?Sized),
        origin_m: DVec2,
    ) -> Option<(InstancePlace, &'s S)> {
        let mut rng = self.key.domain(LOW_PLANT_VARIATION).rng();
        let chosen = match weights {
            Some(weights) => rng.weighted(weights),
            None if shapes.is_empty() => None,
            None => Some(rng.below(shapes.len() as u32) as usize),
        };
        let shape = shapes.get(chosen?)?;
        let sample = ground.sample(self.position_m);
        let gradient: Vec2 = sample.gradient.as_vec2();
        let local_m = (self.position_m - origin_m).extend(sample.height_m);
        let place = InstancePlace {
            position_m: local_m.as_vec3(),
            linear: Instance::upright(self.yaw_rad as f32, self.scale as f32, gradient),
            object: ObjectId::NONE,
            variation: rng.unit_f32(),
        };
        Some((place, shape))
    }
}
