//! Fog and falling snow weaken echoes and have their own.

use nemoral_lidar::{AirLayer, AirParams, Beam, ReturnMode, Scanner, ScannerParams};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{LidarPoint, ObjectId, PointFlags, RayCaster, Semantic};

use crate::walls::{Step, Void, ahead, params, scan_with};

/// Fog with this visibility.
fn foggy(visibility_m: f64) -> AirParams {
    let fog = AirLayer {
        extinction_per_m: 3.912 / visibility_m,
        height_m: 1e9,
        ..AirLayer::default()
    };
    AirParams {
        fog,
        ..AirParams::default()
    }
}

#[test]
fn fog_weakens_echoes_and_has_its_own() {
    let scan = |visibility_m, returns, caster: &dyn RayCaster| {
        let air = foggy(visibility_m);
        let params = ScannerParams {
            air,
            ..params(Beam::default(), returns)
        };
        scan_with(params, caster)
    };
    let is_air = |p: &&LidarPoint| p.semantic == Semantic::AirborneEcho;
    let wall = |m: f32| Step { near: m, far: m };

    // A wall that is near is seen through fog, and is as dark as Beer and Lambert say.
    let clear = scan_with(params(Beam::default(), ReturnMode::Strongest), &wall(6.0));
    let dim = scan(100.0, ReturnMode::Strongest, &wall(6.0));
    assert_eq!(clear.len(), dim.len());
    let mut walls = 0;
    // Fog that is right before the wall is merged with it.
    let is_pure = |p: &LidarPoint| !is_air(&p) && !p.flags.has(PointFlags::MIXED);
    for (a, b) in clear.iter().zip(&dim).filter(|(_, b)| is_pure(b)) {
        let left = libm::exp(-2.0 * 0.03912 * f64::from(a.true_range_m));
        assert!((f64::from(b.intensity / a.intensity) - left).abs() < 1e-4);
        assert_eq!(
            (a.position_m, a.semantic, a.flags),
            (b.position_m, b.semantic, b.flags)
        );
        walls += 1;
    }
    assert!(f64::from(walls) > 0.8 * clear.len() as f64, "{walls}");
    assert!(dim.iter().filter(is_air).count() < clear.len() / 100);

    // One that is far is hidden: fog is stronger, but not the last.
    let hidden = scan(50.0, ReturnMode::Strongest, &wall(60.0));
    assert!(hidden.len() > 29_000 && hidden.iter().all(|p| is_air(&p)));
    for p in &hidden {
        assert!(p.flags == PointFlags(PointFlags::FALSE_ALARM) && p.object == ObjectId::NONE);
        assert!((1.0..30.0).contains(&p.range_m) && p.range_m == p.true_range_m);
        assert!(p.normal == Vec3::ZERO && p.intensity > 0.0);
    }
    let ranges: Vec<f32> = hidden.iter().map(|p| p.range_m).collect();
    let spread = ranges.iter().copied().fold(0.0, f32::max);
    assert!(spread > 5.0, "no thin shell: {spread}");
    let last = scan(50.0, ReturnMode::Last, &wall(20.0));
    assert!(
        last.iter()
            .all(|p| p.semantic == Semantic::Leaf || p.semantic == Semantic::Stem)
    );
    // Behind so much of it, no surface is seen, though the range model has no threshold.
    assert!(scan(50.0, ReturnMode::Last, &wall(60.0)) == hidden);
    let first = scan(50.0, ReturnMode::First, &wall(20.0));
    assert!(first.iter().filter(is_air).count() > 29_000);

    // The sky has echoes in fog, and none in clear air.
    assert!(scan(50.0, ReturnMode::Strongest, &Void).len() > 29_000);
    assert!(scan(20_000.0, ReturnMode::Strongest, &Void).is_empty());
    assert!(scan(1e6, ReturnMode::Strongest, &Void).is_empty());
}

#[test]
fn falling_snow_weakens_echoes_and_flakes_have_their_own() {
    // The beam of a Mid-40, as a line.
    let beam = Beam {
        horizontal_fwhm_rad: 0.28_f64.to_radians(),
        vertical_fwhm_rad: 0.03_f64.to_radians(),
        ..Beam::default()
    };
    let scan = |snowfall_mm_per_h, returns, caster: &dyn RayCaster| {
        let air = AirParams {
            snowfall_mm_per_h,
            ..AirParams::default()
        };
        let params = ScannerParams {
            air,
            ..params(beam, returns)
        };
        scan_with(params, caster)
    };
    let is_flake = |p: &&LidarPoint| p.semantic == Semantic::AirborneEcho;
    let wall = Step {
        near: 60.0,
        far: 60.0,
    };
    let clear = scan(0.0, ReturnMode::All(15), &wall);
    let snow = scan(1.0, ReturnMode::All(15), &wall);
    assert!(clear.iter().all(|p| !is_flake(&p)));
    // 0.94 flakes a pulse, of which few are merged, or beyond the wall.
    let flakes = snow.iter().filter(is_flake).count() as f64 / clear.len() as f64;
    assert!((0.85..0.95).contains(&flakes), "{flakes}");
    for p in snow.iter().filter(is_flake) {
        assert!(p.flags == PointFlags(PointFlags::FALSE_ALARM) && p.object == ObjectId::NONE);
        assert!(p.range_m < 60.0 && p.normal == Vec3::ZERO && p.intensity > 0.0);
    }
    // The wall is as dark as Beer and Lambert say.
    let walls: Vec<_> = snow.iter().filter(|p| !is_flake(p)).collect();
    assert_eq!(walls.len(), clear.len());
    for (a, b) in clear.iter().zip(walls) {
        let left = libm::exp(-2.0 * 3.33e-3 * f64::from(a.true_range_m));
        assert!((f64::from(b.intensity / a.intensity) / left - 1.0).abs() < 0.01);
    }
    // The first echo is often a flake's, the strongest one sometimes, the last one never.
    let share = |returns| {
        let points = scan(1.0, returns, &wall);
        points.iter().filter(is_flake).count() as f64 / points.len() as f64
    };
    assert!(share(ReturnMode::First) > 0.5 && share(ReturnMode::Last) == 0.0);
    assert!((0.0..share(ReturnMode::First)).contains(&share(ReturnMode::Strongest)));
    // A line without width meets no flake.
    let line = scan_with(
        ScannerParams {
            air: AirParams {
                snowfall_mm_per_h: 5.0,
                ..AirParams::default()
            },
            ..params(Beam::default(), ReturnMode::First)
        },
        &wall,
    );
    assert!(line.iter().all(|p| !is_flake(&p)));
}

#[test]
fn bad_air_is_refused_by_name() {
    let refused = |air| {
        let params = ScannerParams {
            air,
            ..ScannerParams::default()
        };
        Scanner::new(params, Box::new(ahead()))
            .expect_err("bad")
            .field
    };
    let base = AirParams::default();
    let of = |fog| AirParams { fog, ..base };
    let layer = AirLayer::default();
    for (air, field) in [
        (
            of(AirLayer {
                extinction_per_m: -1.0,
                ..layer
            }),
            "air.extinction_per_m",
        ),
        (
            of(AirLayer {
                height_m: 0.0,
                ..layer
            }),
            "air.height_m",
        ),
        (
            of(AirLayer {
                lidar_ratio_sr: f64::NAN,
                ..layer
            }),
            "air.lidar_ratio_sr",
        ),
        (
            of(AirLayer {
                base_m: Some(f64::INFINITY),
                ..layer
            }),
            "air.base_m",
        ),
        (
            AirParams {
                reference_range_m: 0.0,
                ..base
            },
            "air.reference_range_m",
        ),
        (
            AirParams {
                reference_reflectance: 0.0,
                ..base
            },
            "air.reference_reflectance",
        ),
        (
            AirParams {
                near_m: -1.0,
                ..base
            },
            "air.near_m",
        ),
        (
            AirParams {
                rain_mm_per_h: -1.0,
                ..base
            },
            "air.rain_mm_per_h",
        ),
        (
            AirParams {
                flake_reflectance: 1.5,
                ..base
            },
            "air.flake_reflectance",
        ),
    ] {
        assert_eq!(refused(air), field);
    }
}
