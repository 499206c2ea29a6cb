//! The radiance of surfaces against closed forms, and the exposure of what is seen.

use crate::analytic::{Shape, World, camera, grey};
use crate::still_life::{KEY, plain, renderer, still_life, sunlight};
use glam::{DVec3, Vec3};
use nemoral_render::{
    CameraRenderer, Exposure, Lighting, OpenSky, RayCastParams, SceneView, SkyParams,
    SkyVisibility, Sun, ToneCurve, View,
};
use nemoral_scene::{Material, Semantic};

/// Radiance of the middle of a picture.
fn middle(world: &World, lighting: Lighting, view: &View) -> Vec3 {
    let images = renderer(plain(), lighting)
        .render(&world.view(), view, KEY)
        .expect("renders");
    let linear = images.linear.expect("asked for");
    *linear.at(linear.width() / 2, linear.height() / 2)
}

#[test]
fn a_perfect_plane_vanishes_in_a_white_furnace() {
    let radiance = Vec3::new(3.0, 2.0, 1.0);
    let from = DVec3::new(0.0, 0.0, 3.0);
    for (roughness, reflected, passed) in [
        (1.0, 1.0, 0.0),
        (0.4, 1.0, 0.0),
        (0.5, 0.6, 0.4),
        (1.0, 0.0, 1.0),
    ] {
        for to in [
            DVec3::new(1.0, 0.0, 0.0),
            DVec3::new(5.0, 2.0, 0.0),
            DVec3::new(1.0, 0.0, 6.0),
        ] {
            let mut world = World::default();
            let white = Material {
                roughness,
                transmittance: Vec3::splat(passed),
                ..Material::plain("white", Semantic::Leaf, Vec3::splat(reflected))
            };
            world.add(
                Shape::Plane {
                    normal: DVec3::new(0.1, 0.2, 1.0) / 1.05_f64.sqrt(),
                    offset: 0.0,
                },
                white,
                0,
            );
            let got = middle(
                &world,
                Lighting::uniform(radiance),
                &camera(4, 4, 20.0, from, to),
            );
            assert!(
                (got / radiance - Vec3::ONE).length() < 0.02,
                "{roughness} {reflected} {passed}: {got}"
            );
        }
    }
}

#[test]
fn no_surface_sends_more_than_it_gets() {
    // R + T of 2 is asked for, and limited to 1.
    let mut world = World::default();
    let greedy = Material {
        transmittance: Vec3::ONE,
        ..Material::plain("greedy", Semantic::Leaf, Vec3::ONE)
    };
    world.add(
        Shape::Plane {
            normal: DVec3::Z,
            offset: 0.0,
        },
        greedy,
        0,
    );
    let view = camera(
        4,
        4,
        20.0,
        DVec3::new(0.0, 0.0, 3.0),
        DVec3::new(1.0, 0.0, 0.0),
    );
    let got = middle(&world, Lighting::uniform(Vec3::ONE), &view);
    assert!(got.max_element() < 1.01, "{got}");
}

#[test]
fn a_grey_card_in_the_sun_has_its_radiance_and_code_value() {
    let mut world = World::default();
    world.add(
        Shape::Plane {
            normal: DVec3::Z,
            offset: 0.0,
        },
        grey(0.18),
        0,
    );
    let lighting = sunlight(180.0, 50.0);
    let global =
        lighting.sky_irradiance(Vec3::Z) + lighting.sun_irradiance() * lighting.sun_direction().z;
    let mut view = camera(
        9,
        9,
        20.0,
        DVec3::new(0.0, 0.0, 3.0),
        DVec3::new(1.0, 0.0, 0.0),
    );
    let luminance = Vec3::new(0.2126, 0.7152, 0.0722);
    // The light meter reads the card, which must become middle grey.
    let ev100 = f64::from(global.dot(luminance) * 0.18 / std::f32::consts::PI / 0.125).log2();
    view.exposure = Exposure::Fixed { ev100 };
    let codes = [
        (ToneCurve::Linear, 118),
        (ToneCurve::Standard, 118),
        (ToneCurve::Filmic, 125),
    ];
    for (tone, code) in codes {
        view.tone = tone;
        let images = renderer(plain(), lighting.clone())
            .render(&world.view(), &view, KEY)
            .expect("renders");
        let got = images.linear.expect("asked for").at(4, 4).dot(luminance);
        let exact = global.dot(luminance) * 0.18 / std::f32::consts::PI;
        assert!((got / exact - 1.0).abs() < 0.02, "{got} for {exact}");
        assert!(
            images.rgb.at(4, 4)[1].abs_diff(code) <= 2,
            "{:?}",
            images.rgb.at(4, 4)
        );
        assert_eq!(images.ev100, ev100);
    }
}

#[test]
fn a_leaf_against_the_sun_glows() {
    let colour = Vec3::new(0.06, 0.12, 0.03);
    let shot = |transmittance| {
        let mut world = World::default();
        let leaf = Material {
            transmittance,
            ..Material::plain("leaf", Semantic::Leaf, colour)
        };
        // A wall between the camera and a southern sun.
        world.add(
            Shape::Plane {
                normal: DVec3::Y,
                offset: -5.0,
            },
            leaf,
            0,
        );
        middle(
            &world,
            sunlight(180.0, 30.0),
            &camera(4, 4, 20.0, DVec3::ZERO, DVec3::new(0.0, -5.0, 0.0)),
        )
    };
    let (opaque, glowing) = (shot(Vec3::ZERO), shot(Vec3::new(0.07, 0.13, 0.0)));
    assert!(glowing.y > 3.0 * opaque.y, "{glowing} {opaque}");
    assert!(
        glowing.y > 1.5 * glowing.x && glowing.x > glowing.z,
        "yellow-green: {glowing}"
    );
}

#[test]
fn auto_exposure_does_not_see_how_strong_the_light_is() {
    let world = still_life();
    let view = camera(
        64,
        36,
        90.0,
        DVec3::new(0.0, 0.0, 1.2),
        DVec3::new(5.0, -0.5, 1.0),
    );
    let shot = |sun_intensity| {
        let sky = SkyParams {
            sun_intensity,
            ..SkyParams::default()
        };
        let sun = Sun::from_angles(100.0, 40.0).expect("valid");
        let lighting = Lighting::new(&sun, &sky).expect("valid");
        renderer(RayCastParams::default(), lighting)
            .render(&world.view(), &view, KEY)
            .expect("renders")
    };
    let (one, ten) = (shot(1.0), shot(10.0));
    assert!((ten.ev100 - one.ev100 - 10.0_f64.log2()).abs() < 1e-3);
    for (a, b) in one.rgb.pixels().iter().zip(ten.rgb.pixels()) {
        assert!((0..3).all(|i| a[i].abs_diff(b[i]) <= 1), "{a:?} {b:?}");
    }
}

#[test]
fn the_end_of_the_world_is_the_sky() {
    let mut world = World::default();
    world.add(
        Shape::Plane {
            normal: DVec3::X,
            offset: 299.9,
        },
        grey(0.3),
        1,
    );
    let view = camera(16, 16, 20.0, DVec3::ZERO, DVec3::new(1.0, 0.0, 0.1));
    let params = RayCastParams {
        max_range_m: 300.0,
        ..plain()
    };
    let lighting = sunlight(200.0, 40.0);
    let wall = renderer(params, lighting.clone())
        .render(&world.view(), &view, KEY)
        .expect("renders");
    let nothing = renderer(params, lighting)
        .render(&World::default().view(), &view, KEY)
        .expect("renders");
    let n = wall
        .truth
        .semantic
        .pixels()
        .iter()
        .filter(|&&s| s == Semantic::Rock)
        .count();
    assert!(n > 4, "the wall is seen: {n}");
    let (a, b) = (
        wall.linear.expect("asked for"),
        nothing.linear.expect("asked for"),
    );
    for (a, b) in a.pixels().iter().zip(b.pixels()) {
        assert!((*a - *b).length() < 0.01 * b.length());
    }
}

#[test]
fn closed_crowns_make_it_dark() {
    let world = still_life();
    let view = camera(
        32,
        32,
        20.0,
        DVec3::new(0.0, 0.0, 2.0),
        DVec3::new(3.0, 3.0, 0.0),
    );
    let shot = |sky_view_factor: f32| {
        let crowns = move |_: Vec3| sky_view_factor;
        let scene = SceneView {
            sky_visibility: &crowns,
            ..world.view()
        };
        let sky = SkyParams {
            overcast: 1.0,
            ..SkyParams::default()
        };
        let lighting =
            Lighting::new(&Sun::from_angles(0.0, 50.0).expect("valid"), &sky).expect("valid");
        let images = renderer(plain(), lighting)
            .render(&scene, &view, KEY)
            .expect("renders");
        *images.linear.expect("asked for").at(16, 16)
    };
    let (open, closed) = (shot(1.0), shot(0.04));
    let share = closed / open;
    assert!(
        (0.04..0.08).contains(&share.y) && share.y > share.x && share.x > share.z,
        "{share}"
    );
}

/// Under crowns of one openness, with low plants that leave a half of the light to the ground.
struct LowPlants;

impl SkyVisibility for LowPlants {
    fn sky_view_factor(&self, _: Vec3) -> f32 {
        1.0
    }

    fn ground_occlusion(&self, scene_point: Vec3) -> f32 {
        if scene_point.x > 0.0 { 0.5 } else { 1.0 }
    }
}

#[test]
fn low_plants_darken_the_ground_and_what_lies_on_it() {
    let above = DVec3::new(4.0, 0.0, 3.0);
    let view = camera(32, 32, 20.0, above, above - DVec3::Z);
    let shot = |material: Material, plants: &dyn SkyVisibility| {
        let mut world = World::default();
        let plane = Shape::Plane {
            normal: DVec3::Z,
            offset: 0.0,
        };
        world.add(plane, material, 0);
        let scene = SceneView {
            sky_visibility: plants,
            ..world.view()
        };
        let images = renderer(plain(), Lighting::uniform(Vec3::ONE)).render(&scene, &view, KEY);
        let images = images.expect("renders");
        *images.linear.expect("asked for").at(16, 16)
    };
    let darkened = |semantic: Semantic| {
        let material = Material::plain("below plants", semantic, Vec3::splat(0.4));
        shot(material.clone(), &LowPlants) / shot(material, &OpenSky)
    };
    // Plants scatter a fifth, half of it back: a half over 1 minus a twentieth. The air adds light.
    for semantic in [Semantic::Litter, Semantic::Stone] {
        let share = darkened(semantic);
        assert!(
            (share - 0.5 / 0.95).length() < 2e-3,
            "{semantic:?}: {share}"
        );
    }
    for semantic in [Semantic::Log, Semantic::Fern] {
        assert_eq!(darkened(semantic), Vec3::ONE);
    }
}
