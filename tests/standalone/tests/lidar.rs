//! Use of `nemoral-lidar` alone: a scanner in another scene.

use nemoral_lidar::{
    EchoObservation, ExactRange, Mid40, ParamError, Pulse, ScanPattern, ScanRequest, Scanner,
    ScannerParams,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    Hit, Material, MaterialId, MaterialLibrary, Ray, RayCaster, RigidTransform, Semantic,
};
use nemoral_seed::Key;

/// The inside of a sphere of 20 m around the origin.
struct Ball(MaterialId);

impl RayCaster for Ball {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let along = ray.origin.dot(ray.direction);
        let rest = ray.origin.length_squared() - 400.0;
        let distance_m = (along * along - rest).sqrt() - along;
        let normal = -ray.at(distance_m) / 20.0;
        Some(Hit::new(distance_m, normal, self.0))
    }
}

fn ball() -> (MaterialLibrary, Ball) {
    let mut materials = MaterialLibrary::new();
    let plaster = Material::plain("plaster", Semantic::Rock, Vec3::splat(0.6));
    let ball = Ball(materials.add(plaster));
    (materials, ball)
}

#[test]
fn points_lie_on_what_is_there_although_the_scanner_drives() -> Result<(), ParamError> {
    let (materials, ball) = ball();
    let scanner = Scanner::new(ScannerParams::default(), Box::new(Mid40))?;
    let pose = |time_s: f64| RigidTransform::from_xyz_rpy(DVec3::X * time_s, 0.0, 0.0, 0.3);
    let key = Key::world(7);
    let points = scanner.scan(&ScanRequest {
        first_pulse: 0,
        caster: &ball,
        materials: &materials,
        scene_from_lidar_at: &pose,
        range_model: &ExactRange,
        key,
    });
    assert_eq!(points.len(), 50_000);
    for p in &points {
        let at = pose(0.0).transform_point(p.position_m.as_dvec3());
        assert!((at.length() - 20.0).abs() < 1e-3, "{at}");
        assert_eq!(p.semantic, Semantic::Rock);
    }
    // The Mid-40 looks 19.2 degrees to all sides of ahead.
    let off = |p: Vec3| (p.x / p.length()).acos().to_degrees();
    let widest = points.iter().map(|p| off(p.position_m));
    let widest = widest.fold(0.0, f32::max);
    assert!((18.0..21.0).contains(&widest), "{widest} degrees");
    Ok(())
}

#[test]
fn closures_are_patterns_and_range_models() -> Result<(), ParamError> {
    let (materials, ball) = ball();
    // One turn per second, 1000 pulses per turn.
    let turning = |number: u64| {
        let time_s = number as f64 / 1000.0;
        let (sin, cos) = (std::f64::consts::TAU * time_s).sin_cos();
        Pulse {
            time_s,
            direction: DVec3::new(cos, sin, 0.0),
            ring: 3,
        }
    };
    assert!((turning.rate_hz() - 1000.0).abs() < 1e-6);
    let params = ScannerParams {
        pulses_per_scan: 1000,
        ..ScannerParams::default()
    };
    let scanner = Scanner::new(params, Box::new(turning))?;
    assert!((scanner.duration_s() - 1.0).abs() < 0.01);
    // Ranges that are 0.1 m too long.
    let model = |echo: &EchoObservation, _: Key| Some(echo.range_m + 0.1);
    let standing = |_: f64| RigidTransform::IDENTITY;
    let points = scanner.scan(&ScanRequest {
        first_pulse: 0,
        caster: &ball,
        materials: &materials,
        scene_from_lidar_at: &standing,
        range_model: &model,
        key: Key::world(7),
    });
    assert_eq!(points.len(), 1000);
    for p in points {
        assert!((p.range_m - 20.1).abs() < 1e-4 && (p.true_range_m - 20.0).abs() < 1e-4);
        assert_eq!(p.ring, 3);
    }
    Ok(())
}
