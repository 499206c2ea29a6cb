//! Shadows and their penumbrae against closed forms.

use crate::analytic::{Shape, World, camera, grey};
use crate::still_life::{KEY, plain, renderer, sunlight};
use glam::{DVec2, DVec3, Vec3};
use nemoral_render::{CameraRenderer, RayCastParams, SceneView};
use nemoral_scene::{Hit, ObjectId, Ray, RayCaster, RigidTransform, Semantic};

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
