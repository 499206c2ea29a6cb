//! The camera against closed forms.

use crate::analytic::{Shape, World, camera, grey, object};
use glam::{DVec2, DVec3, Vec3};
use nemoral_render::{
    CameraRenderer, Exposure, Lens, Lighting, OpenSky, RayCastCamera, RayCastParams, SceneView,
    SkyParams, SkyVisibility, Sun, ToneCurve, View,
};
use nemoral_scene::{
    AlphaMask, Card, Hit, Material, ObjectId, Ray, RayCaster, RigidTransform, Semantic,
};
use nemoral_seed::Key;
use proptest::prelude::*;
use std::sync::Arc;

const KEY: Key = Key::world(7);

fn plain() -> RayCastParams {
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

fn sunlight(azimuth: f64, elevation: f64) -> Lighting {
    let sun = Sun::from_angles(azimuth, elevation).expect("valid");
    let sky = SkyParams {
        visibility_m: 1e6,
        ..SkyParams::default()
    };
    Lighting::new(&sun, &sky).expect("valid")
}

fn renderer(params: RayCastParams, lighting: Lighting) -> RayCastCamera {
    RayCastCamera::new(params, lighting).expect("valid")
}

/// A ground, a ball and an upright card on it.
fn still_life() -> World {
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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Depth, normal, class and object of a plane and a sphere, from any pose and at any image
    /// position, against f64.
    #[test]
    fn truth_is_the_closed_form(
        x in -40.0_f64..0.0,
        y in -20.0_f64..20.0,
        z in 0.5_f64..5.0,
        roll in -0.5_f64..0.5,
        pitch in -0.2_f64..0.6,
        yaw in -0.8_f64..0.8,
        fov in 0.4_f64..2.4,
        column in 0.0_f64..64.0,
        row in 0.0_f64..36.0,
    ) {
        let world = still_life();
        let pose = RigidTransform::from_xyz_rpy(DVec3::new(x, y, z), roll, pitch, yaw)
            * RigidTransform::body_from_optical();
        let intrinsics = nemoral_scene::Intrinsics::from_fov(64, 36, fov).expect("valid");
        let view = View::new(intrinsics, pose);
        let pixel = DVec2::new(column, row);
        let got =
            renderer(plain(), Lighting::uniform(Vec3::ONE)).truth_at(&world.view(), &view, pixel);

        // Everything is computed again in f64, without Ray.
        let d = pose.transform_vector(intrinsics.direction(pixel));
        let o = pose.translation_m;
        let ground = (d.z < 0.0).then(|| (-o.z / d.z, DVec3::Z, Semantic::Soil, ObjectId::NONE));
        let m = o - DVec3::new(5.0, 0.5, 1.0);
        let (b, c) = (m.dot(d), m.length_squared() - 1.0);
        // Rays very close to a silhouette may hit or miss.
        prop_assume!((b * b - c).abs() > 1e-4 && d.z.abs() > 1e-4);
        let ball = (b * b > c && b < 0.0).then(|| {
            let t = -b - (b * b - c).sqrt();
            (t, m + d * t, Semantic::Rock, object(1))
        });
        // The card is not part of this oracle.
        prop_assume!(got.semantic != Semantic::Leaf);
        let nearest = ground
            .into_iter()
            .chain(ball)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match nearest.filter(|n| n.0 < 9e4) {
            None => prop_assert_eq!((got.semantic, got.depth_m), (Semantic::Sky, 0.0)),
            Some((t, normal, semantic, id)) => {
                prop_assert_eq!((got.semantic, got.object), (semantic, id));
                let depth = pose.inverse().transform_point(o + d * t).z;
                prop_assert!(
                    (f64::from(got.depth_m) / depth - 1.0).abs() < 1e-4,
                    "{} for {depth}",
                    got.depth_m
                );
                let optical = pose.rotation.inverse() * normal;
                prop_assert!(
                    got.normal.as_dvec3().distance(optical) < 1e-2,
                    "{} for {optical}",
                    got.normal
                );
                prop_assert!(
                    got.normal.as_dvec3().dot(intrinsics.direction(pixel)) <= 1e-6,
                    "towards the camera"
                );
            }
        }
    }
}

/// A still life whose card has a normal that is no number.
struct Spoilt(World);

impl RayCaster for Spoilt {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let mut hit = self.0.closest_hit(ray)?;
        if hit.surface.object == object(2) {
            hit.shading.normal = Vec3::NAN;
        }
        Some(hit)
    }
}

#[test]
fn what_is_no_number_is_refused_or_stays_in_its_pixel() {
    let sound = still_life();
    let view = camera(64, 48, 60.0, DVec3::new(-3.0, 0.0, 1.5), DVec3::Z);
    let camera = renderer(RayCastParams::default(), sunlight(150.0, 40.0));
    let expected = camera.render(&sound.view(), &view, KEY).expect("valid");

    let refused = |scene: &SceneView<'_>| {
        let error = camera.render(scene, &view, KEY).expect_err("refused");
        error.to_string()
    };
    let nowhere = |_: Vec3| f32::NAN;
    let scene = SceneView {
        sky_visibility: &nowhere,
        ..sound.view()
    };
    let said = "sky_visibility.sky_view_factor(camera) = NaN: must be finite";
    assert_eq!(refused(&scene), said);
    type Spoil = fn(&mut Material);
    let spoilt: [(Spoil, &str); 4] = [
        (
            |m| m.roughness = f32::NAN,
            "roughness = NaN: must be from 0 to 1",
        ),
        (
            |m| m.roughness = 1.5,
            "roughness = 1.5: must be from 0 to 1",
        ),
        (
            |m| m.transmittance.y = f32::NAN,
            "transmittance = NaN: must be from 0 to 1",
        ),
        (
            |m| m.tile_m = 0.0,
            "tile_m = 0: must be finite and greater than 0",
        ),
    ];
    for (spoil, said) in spoilt {
        let mut materials = sound.materials.clone();
        let mut moss = Material::plain("moss", Semantic::GroundMoss, Vec3::splat(0.2));
        spoil(&mut moss);
        materials.add(moss);
        let scene = SceneView {
            materials: &materials,
            ..sound.view()
        };
        assert_eq!(refused(&scene), format!("materials[moss].{said}"));
    }

    let spoilt = Spoilt(still_life());
    let scene = SceneView {
        caster: &spoilt,
        ..sound.view()
    };
    let images = camera.render(&scene, &view, KEY).expect("valid");
    assert!(
        (images.ev100 - expected.ev100).abs() < 0.5,
        "{}",
        images.ev100
    );
    let same = |a: &[u8; 3], b: &[u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) < 20);
    let pairs = images.rgb.pixels().iter().zip(expected.rgb.pixels());
    let spoilt = pairs.filter(|(a, b)| !same(a, b)).count();
    assert!((1..64 * 48 / 10).contains(&spoilt), "{spoilt}");
}

#[test]
fn images_hold_the_truth_of_pixel_centres() {
    let world = still_life();
    let view = camera(
        67,
        41,
        90.0,
        DVec3::new(0.0, 0.0, 1.2),
        DVec3::new(5.0, -0.5, 1.0),
    );
    let camera = renderer(plain(), Lighting::uniform(Vec3::ONE));
    let images = camera.render(&world.view(), &view, KEY).expect("renders");
    let alone = camera.truth(&world.view(), &view).expect("casts");
    assert_eq!(alone, images.truth);
    let mut classes = std::collections::BTreeSet::new();
    for (row, column) in (0..41).flat_map(|r| (0..67).map(move |c| (r, c))) {
        let centre = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
        let exact = camera.truth_at(&world.view(), &view, centre);
        let t = &images.truth;
        assert_eq!(*t.semantic.at(column, row), exact.semantic);
        assert_eq!(*t.object.at(column, row), exact.object);
        assert_eq!(*t.depth_m.at(column, row), exact.depth_m);
        assert_eq!(*t.normal.at(column, row), exact.normal);
        classes.insert(exact.semantic);
    }
    assert_eq!(
        classes.len(),
        4,
        "sky, soil, ball and card are seen: {classes:?}"
    );
}

/// Seen from its front (edge_u × edge_v points at the camera), the card's u runs to the right and v
/// upwards, so the mask's row 0 is at the bottom.
#[test]
fn a_letter_f_is_not_mirrored() {
    const PICTURE: [&str; 7] = [
        "#####", "#....", "#....", "###..", "#....", "#....", "#....",
    ];
    let mask = AlphaMask::from_fn(5, 7, |c, r| PICTURE[6 - r].as_bytes()[c] == b'#').expect("size");
    let mut world = World::default();
    let paper = Material {
        mask: Some(Arc::new(mask)),
        ..Material::plain("f", Semantic::Leaf, Vec3::ONE)
    };
    // The camera looks east, so right is south: u runs towards −y.
    let card = Card {
        corner: Vec3::new(10.0, 2.5, 0.0),
        edge_u: Vec3::new(0.0, -5.0, 0.0),
        edge_v: Vec3::new(0.0, 0.0, 7.0),
        material: nemoral_scene::MaterialId(0),
    };
    world.add(Shape::Card(card), paper, 1);
    // 10 pixels per metre at 10 m: one mask texel is 10 × 10 pixels.
    let mut view = camera(
        50,
        70,
        28.0,
        DVec3::new(0.0, 0.0, 3.5),
        DVec3::new(10.0, 0.0, 3.5),
    );
    (view.intrinsics.fx, view.intrinsics.fy) = (100.0, 100.0);
    let images = renderer(plain(), Lighting::uniform(Vec3::ONE))
        .render(&world.view(), &view, KEY)
        .expect("renders");
    for (row, line) in PICTURE.iter().enumerate() {
        for (column, ink) in line.bytes().enumerate() {
            let seen = *images.truth.semantic.at(column * 10 + 5, row * 10 + 5) == Semantic::Leaf;
            assert_eq!(seen, ink == b'#', "column {column}, row {row}");
        }
    }
}

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
fn the_shadow_of_a_ball_is_where_it_must_be() {
    let mut world = World::default();
    world.add(
        Shape::Plane {
            normal: DVec3::Z,
            offset: 0.0,
        },
        grey(0.3),
        0,
    );
    let (centre, radius) = (DVec3::new(0.0, 0.0, 2.0), 1.0);
    world.add(Shape::Sphere { centre, radius }, grey(0.3), 1);
    let lighting = sunlight(120.0, 40.0);
    let sun = lighting.sun_direction().as_dvec3();
    let view = camera(
        160,
        120,
        40.0,
        DVec3::new(1.0, -9.0, 7.0),
        DVec3::new(-2.0, 1.0, 0.0),
    );
    let images = renderer(plain(), lighting.clone())
        .render(&world.view(), &view, KEY)
        .expect("renders");
    let linear = images.linear.expect("asked for");
    let half = 0.5 * lighting.sun_irradiance().y * sun.z as f32 * 0.3 / std::f32::consts::PI
        + lighting.sky_irradiance(Vec3::Z).y * 0.3 / std::f32::consts::PI;
    let (mut dark, mut compared) = (0, 0);
    for (row, column) in (0..120).flat_map(|r| (0..160).map(move |c| (r, c))) {
        if *images.truth.object.at(column, row) != ObjectId::NONE
            || *images.truth.semantic.at(column, row) == Semantic::Sky
        {
            continue;
        }
        let ray = view.ray(DVec2::new(column as f64 + 0.5, row as f64 + 0.5), 1e5);
        let p = ray.at(ray.origin.z / -ray.direction.z).as_dvec3();
        let m = centre - p;
        let off = (m - sun * m.dot(sun)).length();
        // Pixels away from the penumbra (2 m · 0.0047 rad / sin 40°) and from the smoothing over 3
        // × 3 pixels.
        if (off - radius).abs() > 0.25 {
            compared += 1;
            let shadowed = off < radius;
            dark += u32::from(shadowed);
            assert_eq!(
                linear.at(column, row).y < half,
                shadowed,
                "column {column}, row {row}"
            );
        }
    }
    assert!(dark > 300 && compared > 5000, "{dark} {compared}");
}

/// The half plane x > 0 at height 10 is a roof, the penumbra of whose edge is as wide as the sun's
/// angle times the distance.
struct Roof {
    ground: World,
    height: f32,
}

impl RayCaster for Roof {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.ground.closest_hit(ray)
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        let p = ray.at((self.height - ray.origin.z) / ray.direction.z);
        p.x > 0.0
    }
}

/// The width of the penumbra below a roof of this height, metres, as measured in pictures of this
/// number of rows.
fn penumbra_m(height: f32, rows: u32, params: RayCastParams) -> f64 {
    let mut ground = World::default();
    ground.add(
        Shape::Plane {
            normal: DVec3::Z,
            offset: 0.0,
        },
        grey(0.3),
        0,
    );
    let roof = Roof { ground, height };
    let scene = SceneView {
        caster: &roof,
        ..roof.ground.view()
    };
    // The view is straight down from 1 m, with 400 columns over 0.2 m, and the sun is in the
    // zenith.
    let mut view = camera(
        400,
        rows,
        20.0,
        DVec3::new(0.0, 0.0, 1.0),
        DVec3::new(0.0, 1e-9, 0.0),
    );
    view.scene_from_camera = RigidTransform::from_xyz_rpy(
        DVec3::new(0.0, 0.0, 1.0),
        0.0,
        std::f64::consts::FRAC_PI_2,
        0.0,
    ) * RigidTransform::body_from_optical();
    // Camera right is −y there: turn by a quarter so that columns run along x.
    view.scene_from_camera.rotation =
        glam::DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2) * view.scene_from_camera.rotation;
    (view.intrinsics.fx, view.intrinsics.fy) = (2000.0, 2000.0);
    let lighting = sunlight(0.0, 90.0);
    let sun = lighting.sun_irradiance().y * 0.3 / std::f32::consts::PI;
    let images = renderer(params, lighting)
        .render(&scene, &view, KEY)
        .expect("renders");
    let linear = images.linear.expect("asked for");
    let share = |column: usize| {
        let of_row = |row: usize| (linear.at(column, row).y - linear.at(399, row).y) / sun;
        (0..rows as usize).map(of_row).sum::<f32>() / rows as f32
    };
    assert!((share(0) - 1.0).abs() < 0.05, "{}", share(0));
    // The disc's covered share is the circle segment: 20 % and 80 % lie 0.4918 diameters apart.
    let first = |level: f32| (0..400).find(|&c| share(c) < level).expect("falls") as f64;
    (first(0.2) - first(0.8)) / 2000.0 / 0.4918
}

#[test]
fn penumbrae_are_as_wide_as_the_sun() {
    let fine = RayCastParams {
        colour_samples: 256,
        ..plain()
    };
    // One ray per pixel, filtered over neighbours, must give the same.
    let draft = RayCastParams {
        edge_samples: 0,
        ..plain()
    };
    for (rows, params) in [(3, fine), (120, draft)] {
        for height in [5.0, 10.0] {
            let width_m = penumbra_m(height, rows, params);
            let exact = 0.0093 * f64::from(height);
            let off = width_m / exact - 1.0;
            println!(
                "{height} m, {rows} rows: {width_m:.4} m for {exact}, {:.1} %",
                100.0 * off
            );
            assert!(off.abs() < 0.1, "{width_m} for {exact}");
        }
    }
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
fn threads_and_anti_aliasing_leave_the_truth_alone() {
    let world = still_life();
    let view = camera(
        97,
        61,
        90.0,
        DVec3::new(0.0, 0.0, 1.2),
        DVec3::new(5.0, -0.5, 1.0),
    );
    let shot = |params, threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        let camera = renderer(params, sunlight(100.0, 40.0));
        pool.install(|| camera.render(&world.view(), &view, KEY).expect("renders"))
    };
    let one = shot(RayCastParams::default(), 1);
    assert_eq!(one, shot(RayCastParams::default(), 5));
    let draft = shot(RayCastParams::draft(), 2);
    let fine = shot(RayCastParams::fine(), 2);
    assert_eq!(one.truth, draft.truth);
    assert_eq!(one.truth, fine.truth);
    assert!(one.rgb != draft.rgb && one.rgb != fine.rgb);
}

#[test]
fn silhouettes_get_closer_to_the_area_average() {
    let world = still_life();
    // Without shadows, all edges are silhouettes.
    let sky = SkyParams {
        overcast: 1.0,
        ..SkyParams::default()
    };
    let overcast =
        Lighting::new(&Sun::from_angles(0.0, 40.0).expect("valid"), &sky).expect("valid");
    let mut view = camera(
        96,
        64,
        90.0,
        DVec3::new(0.0, 0.0, 1.2),
        DVec3::new(5.0, -0.5, 1.0),
    );
    // The camera is rolled, so that the horizon covers pixels by all shares.
    view.scene_from_camera.rotation *= glam::DQuat::from_rotation_z(0.3);
    let shot = |colour_samples, edge_samples| {
        let params = RayCastParams {
            colour_samples,
            edge_samples,
            edge_budget: 3.0,
            ..plain()
        };
        renderer(params, overcast.clone())
            .render(&world.view(), &view, KEY)
            .expect("renders")
            .linear
            .expect("asked for")
    };
    let exact = shot(256, 0);
    let error = |a: &nemoral_scene::Image<Vec3>| -> f64 {
        a.pixels()
            .iter()
            .zip(exact.pixels())
            .map(|(a, b)| f64::from((*a - *b).length_squared()))
            .sum()
    };
    let (one, edges) = (error(&shot(1, 0)), error(&shot(1, 3)));
    assert!(edges < 0.4 * one, "{edges} of {one}");
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

#[test]
fn impossible_requests_are_refused() {
    let world = still_life();
    let good = camera(8, 8, 60.0, DVec3::ZERO, DVec3::X);
    let camera = renderer(plain(), Lighting::uniform(Vec3::ONE));
    let field = |view: &View| {
        camera
            .render(&world.view(), view, KEY)
            .expect_err("refused")
            .field
    };
    let mut view = good;
    view.intrinsics.fx = 0.0;
    assert_eq!(field(&view), "view.fx");
    view = good;
    view.intrinsics.width = 0;
    assert_eq!(field(&view), "view.width_px");
    view = good;
    view.scene_from_camera.translation_m.x = f64::NAN;
    assert_eq!(field(&view), "view.translation_m");
    view = good;
    view.exposure = Exposure::Fixed { ev100: 99.0 };
    assert_eq!(field(&view), "exposure.ev100");
    let params = RayCastParams {
        colour_samples: 0,
        ..plain()
    };
    let error = RayCastCamera::new(params, Lighting::uniform(Vec3::ONE)).expect_err("refused");
    assert_eq!(
        error.to_string(),
        "camera.colour_samples = 0: must be 1..=256"
    );
}

#[test]
fn value_stability() {
    let world = still_life();
    let view = camera(
        48,
        32,
        90.0,
        DVec3::new(0.0, 0.0, 1.2),
        DVec3::new(5.0, -0.5, 1.0),
    );
    let sun = Sun::from_angles(110.0, 35.0).expect("valid");
    let lighting = Lighting::new(&sun, &SkyParams::default()).expect("valid");
    let images = renderer(RayCastParams::default(), lighting)
        .render(&world.view(), &view, KEY)
        .expect("renders");
    // FNV-1a over the code values.
    let hash = images
        .rgb
        .pixels()
        .iter()
        .flatten()
        .fold(0xCBF2_9CE4_8422_2325_u64, |h, &b| {
            (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01B3)
        });
    assert_eq!((hash, format!("{:.6}", images.ev100).as_str()), VALUES);
}
const VALUES: (u64, &str) = (11406569128894081289, "15.266675");
