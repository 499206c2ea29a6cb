//! Lamps against closed forms.

use std::f32::consts::PI;

use crate::analytic::{Shape, World, camera, grey};
use glam::{DVec3, Vec3};
use nemoral_render::{
    CameraImages, CameraRenderer, Exposure, Lamp, LampParams, Lens, Lighting, Precipitation,
    RayCastCamera, RayCastParams, SceneView, SkyParams, Sun, View,
};
use nemoral_scene::{Liquid, Material, Semantic};
use nemoral_seed::Key;

const KEY: Key = Key::world(7);

/// A wall 10 m east of the origin, and a ball halfway on its right.
fn wall() -> World {
    let mut world = World::default();
    let plane = Shape::Plane {
        normal: -DVec3::X,
        offset: -10.0,
    };
    world.add(plane, grey(0.3), 0);
    let ball = Shape::Sphere {
        centre: DVec3::new(5.0, -1.0, 0.0),
        radius: 0.3,
    };
    world.add(ball, grey(0.3), 1);
    world
}

fn night(sky: &SkyParams) -> Lighting {
    let sun = Sun::from_angles(300.0, -40.0).expect("valid");
    Lighting::new(&sun, sky).expect("valid")
}

fn clear() -> SkyParams {
    SkyParams {
        visibility_m: 1e6,
        ..SkyParams::default()
    }
}

fn params() -> RayCastParams {
    RayCastParams {
        lens: Lens {
            veiling_glare: 0.0,
            vignetting: nemoral_render::Vignetting::CosineFourth(0.0),
            spread_px: 0.0,
            ..Lens::default()
        },
        keep_linear: true,
        max_range_m: 300.0,
        ..RayCastParams::draft()
    }
}

fn shot(
    world: &World,
    lamps: &[Lamp],
    view: &View,
    params: RayCastParams,
    sky: &SkyParams,
) -> CameraImages {
    let scene = SceneView {
        lamps,
        ..world.view()
    };
    let camera = RayCastCamera::new(params, night(sky)).expect("valid");
    camera.render(&scene, view, KEY).expect("renders")
}

fn ahead() -> View {
    camera(80, 60, 50.0, DVec3::ZERO, DVec3::X)
}

fn lamp(radius_m: f64, at: DVec3) -> Lamp {
    let params = LampParams {
        radius_m,
        ..LampParams::default()
    };
    Lamp::new(&params, at, DVec3::X).expect("valid")
}

#[test]
fn a_wall_has_the_radiance_of_a_point_source() {
    let at = DVec3::new(0.0, 0.2, 0.1);
    let lamp = lamp(0.02, at);
    for params in [
        params(),
        RayCastParams {
            colour_samples: 4,
            edge_samples: 8,
            edge_budget: 8.0,
            ..params()
        },
        RayCastParams {
            colour_samples: 64,
            bounces: 1,
            ..params()
        },
    ] {
        let images = shot(&wall(), &[lamp], &ahead(), params, &clear());
        let linear = images.linear.expect("asked for");
        for (x, y) in [(40, 30), (20, 30), (33, 12), (10, 50)] {
            let direction =
                (ahead().intrinsics).direction((f64::from(x) + 0.5, f64::from(y) + 0.5).into());
            // Right and down, and as far ahead as the wall is.
            let on_wall = DVec3::new(
                10.0,
                -direction.x / direction.z * 10.0,
                -direction.y / direction.z * 10.0,
            );
            let way = (on_wall - at).as_vec3();
            let cos = way.x / way.length();
            let illuminance = lamp.intensity_cd(way / way.length()) / way.length_squared() * cos;
            // Most of a dielectric's light is scattered below its interface; this wall is rough.
            let expected = illuminance * 0.3 / PI;
            let got = *linear.at(x as usize, y as usize);
            let error = (got / expected - Vec3::ONE).abs().max_element();
            assert!(error < 0.03, "{x} {y}: {got} for {expected}");
        }
    }
}

#[test]
fn what_stands_before_the_lamp_casts_a_shadow() {
    // From the lamp, which is 1 m to the left, the ball hides a place beside it in the picture.
    let at = DVec3::new(0.0, 1.0, 0.0);
    let shadow_y = 1.0 + (-1.0 - 1.0) * 2.0;
    let view = ahead();
    let pixel = view
        .project(DVec3::new(10.0, shadow_y, 0.0))
        .expect("in the picture");
    let (x, y) = (pixel.x as usize, pixel.y as usize);
    let radiance = |radius_m: f64, params: RayCastParams| {
        let images = shot(&wall(), &[lamp(radius_m, at)], &view, params, &clear());
        assert_eq!(*images.truth.semantic.at(x, y), Semantic::Rock);
        assert!(
            (images.truth.depth_m.at(x, y) - 10.0).abs() < 1e-3,
            "the wall"
        );
        let linear = images.linear.expect("asked for");
        (linear.at(x, y).y, linear.at(8, y).y)
    };
    let fine = RayCastParams {
        colour_samples: 64,
        ..params()
    };
    for params in [
        params(),
        RayCastParams {
            colour_samples: 3,
            ..params()
        },
        fine,
    ] {
        let (dark, lit) = radiance(0.02, params);
        assert!(dark < 0.01 * lit, "{dark} {lit}");
    }
    // A lamp as wide as the ball shines past it, on the shadow's middle not yet.
    let (half, lit) = radiance(0.6, fine);
    assert!(half > 0.05 * lit && half < 0.8 * lit, "{half} {lit}");
}

#[test]
fn truth_does_not_depend_on_lamps() {
    let (lit, dark) = (lamp(0.03, DVec3::new(0.1, 0.3, 0.2)), wall());
    let with = shot(&dark, &[lit], &ahead(), params(), &clear());
    let without = shot(&dark, &[], &ahead(), params(), &clear());
    assert_eq!(with.truth, without.truth);
    assert!(with.ev100 > without.ev100 + 5.0);
}

#[test]
fn two_lamps_are_their_sum() {
    let lamps = [0.4, -0.4].map(|y| lamp(0.03, DVec3::new(0.1, y, 0.2)));
    let of = |lamps: &[Lamp]| {
        let images = shot(
            &wall(),
            lamps,
            &ahead(),
            RayCastParams::default().keeping(),
            &clear(),
        );
        images.linear.expect("asked for").into_pixels()
    };
    let (both, dark) = (of(&lamps), of(&[]));
    let (left, right) = (of(&lamps[..1]), of(&lamps[1..]));
    for (i, both) in both.iter().enumerate() {
        let sum = left[i] + right[i] - dark[i];
        assert!(
            (*both - sum).length() < 1e-4 * (1.0 + sum.length()),
            "{i}: {both} {sum}"
        );
    }
}

/// Parameters that keep the radiance.
trait Keeping {
    fn keeping(self) -> Self;
}

impl Keeping for RayCastParams {
    fn keeping(self) -> Self {
        Self {
            keep_linear: true,
            // Equal pixels are refined in all pictures.
            edge_samples: 0,
            ..self
        }
    }
}

#[test]
fn fog_and_snow_glow_in_the_beam() {
    let lamps = [lamp(0.03, DVec3::new(0.0, 0.3, -0.2))];
    let mean = |view: &View, sky: &SkyParams| {
        let empty = World::default();
        let images = shot(&empty, &lamps, view, params(), sky);
        let linear = images.linear.expect("asked for").into_pixels();
        linear.iter().map(|c| c.y).sum::<f32>() / linear.len() as f32
    };
    let foggy = SkyParams {
        fog_per_m: 0.05,
        ..clear()
    };
    let (air, fog) = (mean(&ahead(), &clear()), mean(&ahead(), &foggy));
    assert!(fog > 100.0 * air, "{fog} {air}");
    let snow = View {
        precipitation: Some(Precipitation {
            rain_mm_per_h: 0.0,
            snowfall_mm_per_h: 3.0,
            time_s: 4.0,
            scene_origin_m: DVec3::ZERO,
            key: KEY,
        }),
        ..ahead()
    };
    let flakes = mean(&snow, &clear());
    assert!(flakes > 20.0 * air, "{flakes} {air}");
}

/// Water at this height, before a wall or over a bed; it scatters nothing itself.
fn under_water(mut world: World, height: f64, absorption_per_m: f32) -> World {
    let water = Material {
        liquid: Some(Liquid {
            refractive_index: 1.33,
            absorption_per_m: Vec3::splat(absorption_per_m),
            ripple_slope: 0.0,
            ripple_m: 1.0,
        }),
        ..Material::plain("water", Semantic::Water, Vec3::ZERO)
    };
    let plane = Shape::Plane {
        normal: DVec3::Z,
        offset: height,
    };
    world.add(plane, water, 2);
    world
}

#[test]
fn water_mirrors_what_a_lamp_shines_on() {
    let lamps = [lamp(0.0, DVec3::new(0.0, 0.2, 0.2))];
    let view = camera(81, 60, 50.0, DVec3::ZERO, DVec3::new(10.0, 0.0, -1.6));
    let images = shot(
        &under_water(wall(), -1.0, 10.0),
        &lamps,
        &view,
        params(),
        &clear(),
    );
    let linear = images.linear.expect("asked for");
    let at = |z: f64| {
        let pixel = view
            .project(DVec3::new(10.0, 0.0, z))
            .expect("in the picture");
        linear.at(pixel.x as usize, pixel.y as usize).y
    };
    // Where the wall's image is as far below the water as the wall's place is above it. The camera
    // is 1 m above the water, so its ray meets it at this angle.
    let rise: f64 = 0.3;
    let cos = (1.0 + rise) / libm::hypot(10.0, 1.0 + rise);
    let water = Liquid {
        refractive_index: 1.33,
        absorption_per_m: Vec3::ONE,
        ripple_slope: 0.0,
        ripple_m: 1.0,
    };
    let expected = at(rise - 1.0) * water.mirrored(cos as f32);
    let got = at(-rise - 1.0);
    assert!((got / expected - 1.0).abs() < 0.1, "{got} for {expected}");
}

#[test]
fn a_lamp_shines_through_water_on_its_bed() {
    let mut bed = World::default();
    let plane = Shape::Plane {
        normal: DVec3::Z,
        offset: -1.4,
    };
    bed.add(plane, grey(0.3), 0);
    let lamps = [lamp(0.0, DVec3::new(0.0, 0.2, 0.2))];
    let view = camera(80, 60, 50.0, DVec3::ZERO, DVec3::new(2.5, 0.0, -1.4));
    let of = |world: &World| {
        let images = shot(world, &lamps, &view, params(), &clear());
        images.linear.expect("asked for").at(40, 30).y
    };
    let dry = of(&bed);
    let shallow = of(&under_water(bed, -1.3, 0.2));
    assert!(shallow > 0.2 * dry && shallow < dry, "{shallow} {dry}");
}

#[test]
fn what_no_exposure_reaches_stays_dark() {
    let least = |least_ev100: f64| View {
        exposure: Exposure::Auto {
            key: 0.18,
            bias_ev: 0.0,
            least_ev100,
        },
        ..ahead()
    };
    let mean = |view: &View| {
        let images = shot(&wall(), &[], view, params(), &clear());
        let codes: u64 = (images.rgb.pixels().iter())
            .map(|[_, g, _]| u64::from(*g))
            .sum();
        (codes / 4800, images.ev100)
    };
    let (grey, found) = mean(&least(-10.0));
    let (dark, held) = mean(&least(0.0));
    assert!(grey > 30 && found < -5.0, "{grey} {found}");
    assert!(dark < 5 && held == 0.0, "{dark} {held}");
}
