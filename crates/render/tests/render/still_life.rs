//! A still life, its light, and cameras without a lens for it.

use crate::analytic::{Shape, World, grey};
use glam::{DVec3, Vec3};
use nemoral_render::{Lens, Lighting, RayCastCamera, RayCastParams, SkyParams, Sun};
use nemoral_scene::{Card, Material, Semantic};
use nemoral_seed::Key;

pub(crate) const KEY: Key = Key::world(7);

pub(crate) fn plain() -> RayCastParams {
    RayCastParams {
        lens: Lens {
            veiling_glare: 0.0,
            ..Lens::default()
        },
        keep_linear: true,
        max_range_m: 1e5,
        ..RayCastParams::draft()
    }
}

pub(crate) fn sunlight(azimuth: f64, elevation: f64) -> Lighting {
    let sun = Sun::from_angles(azimuth, elevation).expect("valid");
    let sky = SkyParams {
        visibility_m: 1e6,
        ..SkyParams::default()
    };
    Lighting::new(&sun, &sky).expect("valid")
}

pub(crate) fn renderer(params: RayCastParams, lighting: Lighting) -> RayCastCamera {
    RayCastCamera::new(params, lighting).expect("valid")
}

/// A ground, a ball and an upright card on it.
pub(crate) fn still_life() -> World {
    let mut world = World::default();
    let soil = Material::plain("soil", Semantic::Soil, Vec3::new(0.2, 0.15, 0.1));
    world.add(
        Shape::Plane {
            normal: DVec3::Z,
            offset: 0.0,
        },
        soil,
        0,
    );
    world.add(
        Shape::Sphere {
            centre: DVec3::new(5.0, 0.5, 1.0),
            radius: 1.0,
        },
        grey(0.3),
        1,
    );
    let leaf = Material {
        transmittance: Vec3::new(0.06, 0.12, 0.01),
        roughness: 0.5,
        ..Material::plain("leaf", Semantic::Leaf, Vec3::new(0.06, 0.12, 0.03))
    };
    let card = Card {
        corner: Vec3::new(4.0, -2.5, 0.2),
        edge_u: Vec3::new(0.3, 1.2, 0.0),
        edge_v: Vec3::new(0.1, 0.0, 1.1),
        material: nemoral_scene::MaterialId(2),
    };
    world.add(Shape::Card(card), leaf, 2);
    world
}
