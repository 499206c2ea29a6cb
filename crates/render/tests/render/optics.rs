//! Light against closed forms: a white furnace, leaves against the sun, the shadow of a card, fog.

use crate::analytic::{Shape, World, camera, grey, look, radiances};
use glam::{DVec2, DVec3, Vec3};
use nemoral_render::{
    CameraRenderer, Lighting, OpenSky, RayCastCamera, RayCastParams, SceneView, SkyParams, Sun,
    View,
};
use nemoral_scene::{
    Card, Hit, Image, Material, MaterialId, MaterialLibrary, Ray, RayCaster, Semantic,
};
use nemoral_seed::Key;

/// The radiance with one ray per pixel.
fn radiance(world: &World, lighting: Lighting, view: &View) -> Image<Vec3> {
    let images = radiances(world, lighting, view, RayCastParams::draft());
    images.linear.expect("asked for")
}

fn clear(sky: SkyParams) -> SkyParams {
    SkyParams {
        visibility_m: 1e6,
        ..sky
    }
}

/// All directions and surfaces are white, so nothing is distinguishable.
#[test]
fn a_closed_white_furnace_is_even() {
    let mut world = World::default();
    let white = |passed: f32| Material {
        transmittance: Vec3::splat(passed),
        ..Material::plain("white", Semantic::Leaf, Vec3::splat(1.0 - passed))
    };
    let ball = |x: f64, radius: f64| Shape::Sphere {
        centre: DVec3::new(x, 0.0, 0.0),
        radius,
    };
    world.add(ball(0.0, 20.0), white(0.0), 0);
    world.add(ball(5.0, 1.0), white(0.0), 1);
    let card = Card {
        corner: Vec3::new(4.0, 0.5, -0.8),
        edge_u: Vec3::new(0.5, 2.0, 0.3),
        edge_v: Vec3::new(0.2, 0.0, 1.5),
        material: MaterialId(2),
    };
    world.add(Shape::Card(card), white(0.45), 2);
    let light = Vec3::new(3.0, 2.0, 1.0);
    for to in [DVec3::X, DVec3::Y, DVec3::new(0.5, 0.5, -1.0), DVec3::Z] {
        let to = to + DVec3::new(1e-3, 0.0, 0.0);
        let view = camera(40, 24, 90.0, DVec3::new(0.1, -0.3, 0.2), to);
        for (i, c) in radiance(&world, Lighting::uniform(light), &view)
            .pixels()
            .iter()
            .enumerate()
        {
            let off = (*c / light - Vec3::ONE).abs().max_element();
            assert!(off < 0.01, "pixel {i} towards {to}: {c}");
        }
    }
}

/// A beech leaf in May transmits more light than it reflects (PROSPECT-D).
#[test]
fn a_leaf_is_brighter_with_the_sun_behind_it() {
    let shot = |azimuth: f64, passed: Vec3| {
        let mut world = World::default();
        let leaf = Material {
            transmittance: passed,
            ..Material::plain("leaf", Semantic::Leaf, Vec3::new(0.067, 0.120, 0.033))
        };
        let wall = Shape::Plane {
            normal: DVec3::Y,
            offset: -5.0,
        };
        world.add(wall, leaf, 0);
        // Towards the south; the sun behind the wall, or behind the camera.
        let view = camera(4, 4, 20.0, DVec3::ZERO, DVec3::new(0.0, -5.0, 0.0));
        let sun = Sun::from_angles(azimuth, 35.0).expect("valid");
        let sky = clear(SkyParams::default());
        *radiance(&world, Lighting::new(&sun, &sky).expect("valid"), &view).at(2, 2)
    };
    let beech = Vec3::new(0.072, 0.133, 0.0);
    let (behind, before) = (shot(180.0, beech), shot(0.0, beech));
    // By the sun alone it is 0.133 to 0.120; the sky's aureole adds to the light from behind.
    assert!(behind.y > before.y, "{behind} {before}");
    // It is yellower, as the blade absorbs blue.
    assert!(behind.z / behind.y < before.z / before.y);
    // For a card of wood it is the other way round.
    let (behind, before) = (shot(180.0, Vec3::ZERO), shot(0.0, Vec3::ZERO));
    assert!(before.y > 3.0 * behind.y, "{behind} {before}");
}

/// A level surface whose triangles have this normal, as they lean behind the crest of a smooth
/// rise, which is 2 cm higher.
struct Leaning(Vec3);

impl RayCaster for Leaning {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let distance_m = -ray.origin.z / ray.direction.z;
        (distance_m > ray.t_min_m && distance_m < ray.t_max_m).then(|| {
            let mut hit = Hit::new(distance_m, self.0, MaterialId(0));
            hit.shading.normal = Vec3::Z;
            hit
        })
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        self.0 != Vec3::Z && ray.origin.z < 0.02
    }
}

/// A low sun in the east shines on smooth ground though its triangles face away, and not on other
/// surfaces with such triangles.
#[test]
fn smooth_ground_has_no_dark_triangles() {
    let sun = Sun::from_angles(90.0, 8.0).expect("valid");
    let lighting = Lighting::new(&sun, &clear(SkyParams::default())).expect("valid");
    let of = |ground: bool, normal: Vec3| {
        let mut materials = MaterialLibrary::new();
        let material = Material {
            ground,
            roughness: 1.0,
            ..grey(0.3)
        };
        materials.add(material);
        let scene = SceneView {
            caster: &Leaning(normal),
            instances: None,
            materials: &materials,
            sky_visibility: &OpenSky,
            lamps: &[],
        };
        let params = RayCastParams {
            keep_linear: true,
            ..RayCastParams::draft()
        };
        let camera = RayCastCamera::new(params, lighting.clone()).expect("valid");
        let view = camera_down();
        let images = camera
            .render(&scene, &view, Key::world(3))
            .expect("renders");
        images.linear.expect("asked for").at(16, 16).y
    };
    let west = Vec3::new(-0.2, 0.0, 0.979_796);
    let (level, leaning) = (of(true, Vec3::Z), of(true, west));
    assert!((leaning / level - 1.0).abs() < 1e-3, "{leaning} {level}");
    let (level, leaning) = (of(false, Vec3::Z), of(false, west));
    assert!(leaning < 0.8 * level, "{leaning} {level}");
}

/// A view from 5 m above the ground, nearly straight down.
fn camera_down() -> View {
    camera(
        32,
        32,
        20.0,
        DVec3::new(0.0, 0.0, 5.0),
        DVec3::new(0.1, 0.0, 0.0),
    )
}

/// However the sun lies on the pixels, all of its light is in the picture, which is what glare is
/// made of.
#[test]
fn the_sun_in_a_picture_has_its_light() {
    let sun = Sun::from_angles(90.0, 20.0).expect("valid");
    let lighting = Lighting::new(&sun, &clear(SkyParams::default())).expect("valid");
    let towards = lighting.sun_direction().as_dvec3();
    for tenths in 0..10 {
        // 0.6 degrees a pixel; the sun is 0.53 wide.
        let beside = towards + DVec3::new(0.0, 0.01, 0.003) * (f64::from(tenths) / 10.0);
        let view = camera(96, 64, 60.0, DVec3::ZERO, beside);
        for colour_samples in [1, 3] {
            let params = RayCastParams {
                colour_samples,
                ..RayCastParams::draft()
            };
            let images = radiances(&World::default(), lighting.clone(), &view, params);
            let light = images.linear.expect("asked for").into_pixels();
            let seen: f64 = (0..96 * 64)
                .map(|i| {
                    let pixel = DVec2::new(f64::from(i % 96) + 0.5, f64::from(i / 96) + 0.5);
                    let cos = view.intrinsics.direction(pixel).z;
                    let solid_angle = cos * cos * cos / (view.intrinsics.fx * view.intrinsics.fy);
                    let sky = lighting.sky_radiance(view.ray(pixel, 1.0).direction);
                    f64::from((light[i as usize] - sky).y) * solid_angle
                })
                .sum();
            let share = seen / f64::from(lighting.sun_irradiance().y);
            assert!(
                (share - 1.0).abs() < 0.08,
                "{tenths}, {colour_samples}: {share}"
            );
        }
    }
}

/// Pixel by pixel, away from the penumbra and from the 3 × 3 pixels that smooth it.
#[test]
fn the_shadow_of_a_card_is_its_projection() {
    let (corner, u, v) = (
        DVec3::new(3.0, -1.0, 1.0),
        DVec3::new(0.4, 2.2, 0.0),
        DVec3::new(0.5, -0.1, 1.1),
    );
    let mut world = World::default();
    let ground = Shape::Plane {
        normal: DVec3::Z,
        offset: 0.0,
    };
    world.add(ground, grey(0.3), 0);
    let card = Card {
        corner: corner.as_vec3(),
        edge_u: u.as_vec3(),
        edge_v: v.as_vec3(),
        material: MaterialId(1),
    };
    world.add(Shape::Card(card), grey(0.3), 1);
    for (azimuth, elevation) in [(250.0, 52.0), (80.0, 35.0), (185.0, 70.0)] {
        let sun = Sun::from_angles(azimuth, elevation).expect("valid");
        let sky = clear(SkyParams::default());
        let lighting = Lighting::new(&sun, &sky).expect("valid");
        let s = lighting.sun_direction().as_dvec3();
        let mut view = camera(640, 400, 45.0, DVec3::ZERO, DVec3::X);
        view.scene_from_camera = look(DVec3::new(-1.5, 0.3, 5.5), DVec3::new(4.0, 0.0, 0.0));
        let light = radiance(&world, lighting.clone(), &view);
        let per_pi = 0.3 / std::f32::consts::PI;
        let half = per_pi
            * (lighting.sky_irradiance(Vec3::Z).y
                + 0.5 * lighting.sun_irradiance().y * lighting.sun_direction().z);
        let (mut dark, mut edge, mut compared) = (0, 0, 0);
        for (row, column) in (0..400).flat_map(|r| (0..640).map(move |c| (r, c))) {
            let pixel = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            let d = view
                .scene_from_camera
                .transform_vector(view.intrinsics.direction(pixel));
            let o = view.scene_from_camera.translation_m;
            // The intersection of a ray with the card's plane, in units of its edges.
            let n = u.cross(v);
            let meet = |o: DVec3, d: DVec3| {
                let t = (corner - o).dot(n) / d.dot(n);
                let p = o + d * t - corner;
                let (a, b) = (p.cross(v).dot(n), u.cross(p).dot(n));
                (t, a / n.length_squared(), b / n.length_squared())
            };
            // The distance from the border, metres; negative outside.
            let inside = |a: f64, b: f64| {
                let (a, b) = (0.5 - (a - 0.5).abs(), 0.5 - (b - 0.5).abs());
                (a * n.length() / v.length()).min(b * n.length() / u.length())
            };
            let to_ground = -o.z / d.z;
            let (t, a, b) = meet(o, d);
            let seen = inside(a, b);
            let pixel_m = 2.0 * to_ground / view.intrinsics.fx;
            // The card itself, and its silhouette.
            if d.z >= 0.0 || to_ground > 30.0 || (t > 0.0 && t < to_ground && seen > -pixel_m) {
                continue;
            }
            let (way, a, b) = meet(o + d * to_ground, s);
            let covered = inside(a, b);
            // The width of the penumbra on the card's plane, and that of the surrounding pixels on
            // the ground, which are stretched along the sun's azimuth.
            let blur = 0.00466 * way.abs() / (s.dot(n) / n.length()).abs()
                + pixel_m / (-d.z) / (s.dot(n) / n.length()).abs();
            if way > 0.0 && covered.abs() < blur {
                edge += 1;
                continue;
            }
            let shadowed = way > 0.0 && covered > 0.0;
            compared += 1;
            dark += u32::from(shadowed);
            assert_eq!(
                light.at(column, row).y < half,
                shadowed,
                "sun {azimuth} {elevation}: column {column}, row {row}, {covered} m inside"
            );
        }
        println!("{azimuth} {elevation}: {dark} dark, {edge} on the edge, {compared} compared");
        assert!(dark > 1000 && compared > 100_000 && edge < 3 * dark);
    }
}

/// The radiance of a black wall in fog is that of the fog in front of it, 1 − e^(−σ d) of that of
/// endless fog; from higher up, where fog is less dense, it is less.
#[test]
fn fog_veils_a_black_wall_by_beer_and_lamberts_law() {
    let sky = SkyParams {
        fog_per_m: 0.02,
        fog_height_m: 10.0,
        fog_base_m: 2.0,
        ..clear(SkyParams::default())
    };
    let sun = Sun::from_angles(90.0, 30.0).expect("valid");
    let lighting = Lighting::new(&sun, &sky).expect("valid");
    let veil = |distance: f64, height: f64| {
        let mut world = World::default();
        let wall = Shape::Plane {
            normal: DVec3::X,
            offset: distance,
        };
        world.add(wall, grey(0.0), 0);
        let view = camera(
            3,
            3,
            1.0,
            DVec3::new(0.0, 0.0, height),
            DVec3::new(1.0, 0.0, height),
        );
        let on_wall = *radiance(&world, lighting.clone(), &view).at(1, 1);
        let endless = *radiance(&World::default(), lighting.clone(), &view).at(1, 1);
        f64::from(on_wall.y / endless.y)
    };
    for (distance, height) in [
        (10.0, 2.0),
        (60.0, 2.0),
        (150.0, 2.0),
        (60.0, 12.0),
        (60.0, -3.0),
    ] {
        let sigma = 0.02 * (-(height - 2.0) / 10.0_f64).exp() + 3.912e-6;
        let exact = 1.0 - (-sigma * distance).exp();
        let got = veil(distance, height);
        assert!(
            (got - exact).abs() < 1e-3,
            "{distance} {height}: {got} for {exact}"
        );
    }
}
