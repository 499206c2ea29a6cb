//! Path tracing against closed forms.

use std::f32::consts::PI;

use crate::analytic::{Shape, World, camera, grey};
use glam::{DVec3, Vec3};
use nemoral_render::{
    CameraRenderer, Lens, Lighting, RayCastCamera, RayCastParams, SkyParams, Sun, View,
};
use nemoral_scene::{Material, Semantic};
use nemoral_seed::Key;

/// The mean radiance of a path-traced picture.
fn path_traced(world: &World, lighting: Lighting, bounces: u32, view: &View) -> Vec3 {
    let params = RayCastParams {
        lens: Lens {
            veiling_glare: 0.0,
            ..Lens::default()
        },
        colour_samples: 256,
        bounces,
        keep_linear: true,
        max_range_m: 1e5,
        ..RayCastParams::draft()
    };
    let camera = RayCastCamera::new(params, lighting).expect("valid");
    let images = camera
        .render(&world.view(), view, Key::world(7))
        .expect("renders");
    let linear = images.linear.expect("asked for");
    linear.pixels().iter().sum::<Vec3>() / linear.pixels().len() as f32
}

fn level(height_m: f64) -> Shape {
    Shape::Plane {
        normal: DVec3::Z,
        offset: height_m,
    }
}

fn leaf(reflected: f32, passed: f32) -> Material {
    Material {
        transmittance: Vec3::splat(passed),
        ..Material::plain("leaf", Semantic::Leaf, Vec3::splat(reflected))
    }
}

/// A few pixels around the origin of the ground, from the side and from below the leaves.
fn of_the_ground() -> View {
    camera(8, 8, 5.0, DVec3::new(0.5, 0.0, 0.5), DVec3::ZERO)
}

#[test]
fn whatever_loses_no_light_vanishes_in_a_white_furnace() {
    let radiance = Vec3::new(3.0, 2.0, 1.0);
    let mut world = World::default();
    // A part of the light is reflected specularly, and the rest enters the surface.
    let glossy = Material {
        roughness: 0.4,
        ..grey(1.0)
    };
    world.add(level(0.0), glossy, 0);
    world.add(level(2.0), leaf(0.3, 0.7), 1);
    let ball = Shape::Sphere {
        centre: DVec3::new(0.0, 0.6, 0.5),
        radius: 0.5,
    };
    world.add(ball, grey(1.0), 2);
    // The view is from above and along the ground, where the specular reflection is strong.
    let along = camera(8, 8, 5.0, DVec3::new(3.0, 0.0, 0.3), DVec3::ZERO);
    for (bounces, view) in [(1, of_the_ground()), (5, of_the_ground()), (2, along)] {
        let got = path_traced(&world, Lighting::uniform(radiance), bounces, &view);
        assert!(
            (got / radiance - Vec3::ONE).length() < 0.02,
            "{bounces}: {got}"
        );
    }
}

#[test]
fn a_black_ball_hides_its_form_factor_of_the_sky() {
    let mut world = World::default();
    world.add(level(0.0), grey(0.4), 0);
    let (radius, height) = (0.7, 1.0);
    let ball = Shape::Sphere {
        centre: DVec3::new(0.0, 0.0, height),
        radius,
    };
    world.add(ball, grey(0.0), 1);
    // The view is from between the ball and the ground.
    let view = camera(4, 4, 5.0, DVec3::new(0.3, 0.0, 0.29), DVec3::ZERO);
    let got = path_traced(&world, Lighting::uniform(Vec3::ONE), 1, &view).x;
    // The formula is exact below the middle of the ball; the picture is 4 cm wide there.
    let expected = 0.4 * (1.0 - (radius / height).powi(2)) as f32;
    assert!((got / expected - 1.0).abs() < 0.03, "{got} for {expected}");
}

#[test]
fn light_between_leaves_and_ground_is_a_geometric_series() {
    let (reflected, passed, albedo) = (0.3_f32, 0.2_f32, 0.5_f32);
    let mut world = World::default();
    world.add(level(0.0), grey(albedo), 0);
    world.add(level(1.0), leaf(reflected, passed), 1);
    let got = path_traced(&world, Lighting::uniform(Vec3::ONE), 16, &of_the_ground()).x;
    let expected = albedo * passed / (1.0 - reflected * albedo);
    assert!((got / expected - 1.0).abs() < 0.02, "{got} for {expected}");
    // With fewer bounces the mean light of a place replaces the rest, which is that of the open
    // here.
    let cut = path_traced(&world, Lighting::uniform(Vec3::ONE), 1, &of_the_ground()).x;
    assert!(cut > 1.5 * expected, "{cut} for {expected}");
}

#[test]
fn the_sun_shines_through_leaves_to_the_ground() {
    let (reflected, passed, albedo) = (0.1_f32, 0.2_f32, 0.25_f32);
    let mut world = World::default();
    world.add(level(0.0), grey(albedo), 0);
    world.add(level(1.0), leaf(reflected, passed), 1);
    let sun = Sun::from_angles(180.0, 50.0).expect("valid");
    let sky = SkyParams {
        visibility_m: 1e6,
        ..SkyParams::default()
    };
    let lighting = Lighting::new(&sun, &sky).expect("valid");
    let above =
        lighting.sun_irradiance() * lighting.sun_direction().z + lighting.sky_irradiance(Vec3::Z);
    let expected = above * (albedo * passed / (1.0 - reflected * albedo) / PI);
    let got = path_traced(&world, lighting, 12, &of_the_ground());
    assert!(
        (got / expected - Vec3::ONE).abs().max_element() < 0.03,
        "{got} for {expected}"
    );
}

#[test]
fn value_stability() {
    let mut world = World::default();
    world.add(level(0.0), grey(0.5), 0);
    world.add(level(1.0), leaf(0.3, 0.2), 1);
    let got = path_traced(&world, Lighting::uniform(Vec3::ONE), 3, &of_the_ground());
    assert!((got.x - 0.139_310_45).abs() < 1e-7, "{}", got.x);
}
