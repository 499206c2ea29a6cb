//! What holds for any picture: threads, samples, refusals, values.

use crate::analytic::{World, camera, object};
use crate::still_life::{KEY, plain, renderer, still_life, sunlight};
use glam::{DVec3, Vec3};
use nemoral_render::{
    CameraRenderer, Exposure, Lighting, RayCastCamera, RayCastParams, SceneView, SkyParams, Sun,
    View,
};
use nemoral_scene::{Hit, Material, Ray, RayCaster, Semantic};

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
