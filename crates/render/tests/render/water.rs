//! The light of liquids against closed forms.

use std::f32::consts::PI;

use crate::analytic::{Shape, World, camera, grey, radiances};
use glam::{DVec3, Vec3};
use nemoral_render::{
    CameraRenderer, Lamp, LampParams, Lens, Lighting, RayCastCamera, RayCastParams, SceneView,
    SkyParams, Sun, View,
};
use nemoral_scene::{Liquid, Material, Semantic};
use nemoral_seed::Key;

const ROUGHNESS: f32 = 0.3;

fn liquid(absorption_per_m: f32) -> Liquid {
    Liquid {
        refractive_index: 1.33,
        absorption_per_m: Vec3::splat(absorption_per_m),
        ripple_slope: 0.0,
        ripple_m: 1.0,
    }
}

/// Still water at height 0 that scatters this share of the light, and what it scatters exactly, as
/// its texture is of bytes.
fn water(scattered: f32, absorption_per_m: f32) -> (Material, f32) {
    let water = Material {
        roughness: ROUGHNESS,
        liquid: Some(liquid(absorption_per_m)),
        ..Material::plain("water", Semantic::Water, Vec3::splat(scattered))
    };
    let scattered = water.albedo.mean().x;
    (water, scattered)
}

fn level(height_m: f64) -> Shape {
    Shape::Plane {
        normal: DVec3::Z,
        offset: height_m,
    }
}

/// Straight down from 3 m.
fn down() -> View {
    let above = DVec3::new(0.0, 0.0, 3.0);
    camera(9, 9, 1.0, above, above - DVec3::Z)
}

fn middle(world: &World, lighting: &Lighting, view: &View) -> Vec3 {
    let images = radiances(world, lighting.clone(), view, RayCastParams::draft());
    *images.linear.expect("asked for").at(4, 4)
}

/// Water so deep that no bed is seen.
fn deep(scattered: f32) -> (World, f32) {
    let (water, scattered) = water(scattered, 1.0);
    let mut world = World::default();
    world.add(level(0.0), water, 0);
    (world, scattered)
}

fn noon(elevation_deg: f64) -> Lighting {
    let sun = Sun::from_angles(180.0, elevation_deg).expect("valid");
    let sky = SkyParams {
        visibility_m: 1e6,
        ..SkyParams::default()
    };
    Lighting::new(&sun, &sky).expect("valid")
}

/// Of even light from all around, Fresnel's share is mirrored, and what the water scatters of it
/// leaves it by the rest.
#[test]
fn water_scatters_its_albedo() {
    for scattered in [0.02, 0.2] {
        let (world, scattered) = deep(scattered);
        for to in [DVec3::ZERO, DVec3::new(4.0, 1.0, 0.0)] {
            let from = DVec3::new(0.0, 0.0, 3.0);
            let view = camera(9, 9, 1.0, from, to);
            let cos = 3.0 / (to - from).length();
            let mirrored = liquid(1.0).mirrored(cos as f32);
            let exact = mirrored + scattered * (1.0 - mirrored);
            let got = middle(&world, &Lighting::uniform(Vec3::ONE), &view).x;
            // The air on the way adds less than a thousandth of the sky's light.
            let most = 0.001 + 0.01 * exact;
            assert!((got - exact).abs() < most, "{got} for {exact}");
        }
    }
}

#[test]
fn water_scatters_the_suns_light_as_it_does_the_skys() {
    let lighting = noon(50.0);
    let global =
        lighting.sky_irradiance(Vec3::Z) + lighting.sun_irradiance() * lighting.sun_direction().z;
    let ((turbid, scattered), (clear, _)) = (deep(0.1), deep(0.0));
    let of = |world: &World| middle(world, &lighting, &down());
    let got = (of(&turbid) - of(&clear)).y;
    let exact = scattered / PI * global.y * (1.0 - liquid(1.0).mirrored(1.0));
    assert!((got / exact - 1.0).abs() < 0.02, "{got} for {exact}");
}

/// Where the bed is seen, the water scatters what its depth takes from it, of any light.
#[test]
fn shallow_water_scatters_what_it_takes_from_its_bed() {
    let depth_m = 0.25;
    let by_day = noon(50.0);
    let by_night = {
        let sun = Sun::from_angles(300.0, -40.0).expect("valid");
        Lighting::new(&sun, &SkyParams::default()).expect("valid")
    };
    let above = DVec3::new(0.0, 0.3, 3.0);
    let params = LampParams {
        radius_m: 0.0,
        ..LampParams::default()
    };
    let lamp = Lamp::new(&params, above, -DVec3::Z).expect("valid");
    let of = |lighting: &Lighting, lamps: &[Lamp], scattered: f32, absorption_per_m: f32| {
        let (water, scattered) = water(scattered, absorption_per_m);
        let mut world = World::default();
        world.add(level(0.0), water, 0);
        world.add(level(-depth_m), grey(0.3), 1);
        let params = RayCastParams {
            lens: Lens {
                veiling_glare: 0.0,
                ..Lens::default()
            },
            keep_linear: true,
            ..RayCastParams::draft()
        };
        let camera = RayCastCamera::new(params, lighting.clone()).expect("valid");
        let scene = SceneView {
            lamps,
            ..world.view()
        };
        let images = camera.render(&scene, &down(), Key::world(7));
        let linear = images.expect("renders").linear.expect("asked for");
        (linear.at(4, 4).y, scattered)
    };
    let entering = 1.0 - liquid(1.0).mirrored(1.0);
    let shining: [&[Lamp]; 2] = [&[], &[lamp]];
    for (lighting, lamps) in [&by_day, &by_night].into_iter().zip(shining) {
        let global = match lamps {
            [] => {
                let sun = lighting.sun_irradiance().y * lighting.sun_direction().z;
                lighting.sky_irradiance(Vec3::Z).y + sun
            }
            [lamp, ..] => {
                // The lamp is 3 m above and a little beside of what is seen.
                let way = Vec3::new(0.0, -0.3, -3.0);
                let direction = way / way.length();
                lamp.intensity_cd(direction).y * -direction.z / way.length_squared()
            }
        };
        for absorption_per_m in [0.0, 2.0] {
            let (clear, _) = of(lighting, lamps, 0.0, absorption_per_m);
            let (turbid, scattered) = of(lighting, lamps, 0.1, absorption_per_m);
            // Down and up again.
            let taken = 1.0 - (-absorption_per_m * 2.0 * depth_m as f32).exp();
            let all = scattered / PI * global * entering;
            let (got, exact) = (turbid - clear, all * taken);
            assert!(
                (got - exact).abs() < 0.02 * all,
                "{absorption_per_m}: {got} for {exact}"
            );
        }
    }
}

/// The sun's image in rough water is as bright as Fresnel's share at right angles says: half as
/// bright as on a surface of glass.
#[test]
fn the_suns_image_is_that_in_water() {
    let lighting = noon(90.0);
    let (black, _) = deep(0.0);
    let got = middle(&black, &lighting, &down()).y;
    let alpha = ROUGHNESS * ROUGHNESS;
    let mirrored = liquid(1.0).mirrored(1.0);
    let gloss = 1.0 - ROUGHNESS * ROUGHNESS;
    let glint = gloss * mirrored / (PI * alpha * alpha) / 4.0 * lighting.sun_irradiance().y;
    let exact = glint + mirrored * lighting.sky_radiance(Vec3::Z).y;
    assert!((got / exact - 1.0).abs() < 0.03, "{got} for {exact}");
}
