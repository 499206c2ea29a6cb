//! What carries a scanner and hides what is behind it.

use std::f64::consts::PI;

use nemoral_lidar::{
    AirLayer, AirParams, Beam, Carrier, Device, ExactRange, MotorParams, MotorisedPattern, Pulse,
    ReturnMode, ScanRequest, Scanner, ScannerParams, SpinningPattern,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    Hit, LidarPoint, Material, MaterialId, MaterialLibrary, Ray, RayCaster, RigidTransform,
    Semantic,
};
use nemoral_seed::Key;

/// The inside of a sphere around the origin.
struct Ball {
    radius_m: f32,
}

impl RayCaster for Ball {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let along = ray.origin.dot(ray.direction);
        let rest = ray.origin.length_squared() - self.radius_m * self.radius_m;
        let distance_m = (along * along - rest).sqrt() - along;
        let normal = -ray.at(distance_m) / self.radius_m;
        ray.reaches(distance_m)
            .then(|| Hit::new(distance_m, normal, MaterialId(0)))
    }
}

/// A person 0.4 m behind a scanner that is held 1.2 m above the ground.
fn person() -> Carrier {
    Carrier {
        low_m: DVec3::new(-0.3, -0.25, 0.0),
        high_m: DVec3::new(0.0, 0.25, 1.8),
        carrier_from_lidar: RigidTransform::from_xyz_rpy(DVec3::new(0.4, 0.0, 1.2), 0.1, -0.2, 0.3),
    }
}

/// A tenth of a second of a head of 16 lines, which walks and turns.
fn scan(params: ScannerParams, caster: &dyn RayCaster) -> (Vec<LidarPoint>, Vec<Pulse>) {
    let params = ScannerParams {
        pulses_per_scan: 28_935,
        ..params
    };
    let head = Box::new(SpinningPattern::vlp16(10.0).expect("valid"));
    let pattern = MotorisedPattern::new(head, MotorParams::default()).expect("valid");
    let scanner = Scanner::new(params, Box::new(pattern)).expect("valid");
    let mut materials = MaterialLibrary::new();
    materials.add(Material::plain("plaster", Semantic::Rock, Vec3::splat(0.5)));
    let pose =
        |time_s: f64| RigidTransform::from_xyz_rpy(DVec3::X * time_s, 0.0, 0.0, 0.5 * time_s);
    let points = scanner.scan(&ScanRequest {
        first_pulse: 1000,
        caster,
        materials: &materials,
        scene_from_lidar_at: &pose,
        range_model: &ExactRange,
        key: Key::world(7),
    });
    let pulses = scanner.pulses(1000).collect();
    (points, pulses)
}

/// Whether the box is nearer than a range, by steps along the ray.
fn is_hidden(carrier: &Carrier, direction: DVec3, range_m: f64) -> bool {
    let steps = (range_m.min(3.0) / 0.002) as u32;
    (0..steps).any(|i| {
        let along = direction * (0.002 * f64::from(i));
        let at = carrier.carrier_from_lidar.transform_point(along);
        carrier.low_m.cmple(at).all() && at.cmple(carrier.high_m).all()
    })
}

#[test]
fn a_person_hides_what_is_behind_and_nothing_else() {
    let ball = Ball { radius_m: 6.0 };
    let (all, pulses) = scan(ScannerParams::default(), &ball);
    let params = ScannerParams {
        carrier: Some(person()),
        ..ScannerParams::default()
    };
    let (seen, _) = scan(params, &ball);
    assert_eq!(all.len(), pulses.len());
    let mut left = seen.iter().peekable();
    let (mut hidden, mut unsure) = (0, 0);
    for point in &all {
        let is_seen = left.next_if(|p| p.pulse == point.pulse);
        let direction = pulses[point.pulse as usize].direction;
        if is_hidden(&person(), direction, 6.0) {
            assert!(is_seen.is_none(), "{direction}");
            hidden += 1;
        } else if is_seen.is_none() {
            // The steps have missed a corner.
            unsure += 1;
        } else {
            assert_eq!(is_seen, Some(point));
        }
    }
    assert!(left.next().is_none());
    let share = f64::from(hidden) / all.len() as f64;
    assert!(
        (0.03..0.3).contains(&share) && unsure < 200,
        "{share} {unsure}"
    );

    // What is nearer than the person is seen before them.
    let near = Ball { radius_m: 0.3 };
    let close = |carrier| ScannerParams {
        min_range_m: 0.1,
        carrier,
        ..ScannerParams::default()
    };
    let (points, pulses) = scan(close(Some(person())), &near);
    assert_eq!(points.len(), pulses.len());
    assert_eq!(points, scan(close(None), &near).0);
}

/// A wide beam that is hidden in part gives the rest of its light.
#[test]
fn sub_rays_are_hidden_one_by_one() {
    let ball = Ball { radius_m: 6.0 };
    let wide = ScannerParams {
        beam: Beam {
            rings: 2,
            ..Device::Os0.params().beam
        },
        ..ScannerParams::default()
    };
    let hidden = ScannerParams {
        carrier: Some(person()),
        ..wide
    };
    let (all, _) = scan(wide, &ball);
    let (seen, _) = scan(hidden, &ball);
    // Every pulse comes back.
    assert!((0_u32..).zip(&all).all(|(number, p)| p.pulse == number));
    let part = seen.iter().filter(|p| {
        let share = p.intensity / all[p.pulse as usize].intensity;
        assert!(share < 1.0 + 1e-5);
        share < 0.99
    });
    let parts = part.count();
    assert!(seen.len() < all.len() && parts > 50, "{parts}");
}

/// Neither surfaces nor fog nor drops are seen through a carrier, by any beam.
#[test]
fn a_carrier_hides_the_air() {
    let layer = AirLayer {
        extinction_per_m: 0.08,
        height_m: 1e9,
        ..AirLayer::default()
    };
    let params = ScannerParams {
        air: AirParams {
            fog: layer,
            rain_mm_per_h: 50.0,
            ..AirParams::default()
        },
        carrier: Some(person()),
        returns: ReturnMode::All(8),
        beam: Beam {
            horizontal_fwhm_rad: 0.003,
            vertical_fwhm_rad: 0.003,
            ..Beam::default()
        },
        ..ScannerParams::default()
    };
    let (points, pulses) = scan(params, &Ball { radius_m: 30.0 });
    let of_air = points
        .iter()
        .filter(|p| p.semantic == Semantic::AirborneEcho);
    assert!(of_air.count() > 10_000);
    for p in &points {
        let direction = pulses[p.pulse as usize].direction;
        let hidden = is_hidden(&person(), direction, p.true_range_m.into());
        assert!(!hidden, "{p:?}");
    }
}

#[test]
fn a_scanner_inside_of_its_carrier_is_refused() {
    let mut carrier = person();
    carrier.carrier_from_lidar.translation_m = DVec3::new(-0.1, 0.0, 1.0);
    let params = ScannerParams {
        carrier: Some(carrier),
        ..ScannerParams::default()
    };
    let head = SpinningPattern::vlp16(10.0).expect("valid");
    let error = Scanner::new(params, Box::new(head)).expect_err("nothing would be seen");
    assert_eq!(error.field, "carrier.carrier_from_lidar");
    assert!(error.to_string().contains("outside of the box"), "{error}");
}

/// Of the directions all around, a box hides as many as its face has of the sphere.
#[test]
fn a_carrier_hides_its_solid_angle() {
    // Its face is a square of 0.4 m at 0.4 m.
    let carrier = Carrier {
        low_m: DVec3::new(-0.6, -0.2, -0.2),
        high_m: DVec3::new(-0.4, 0.2, 0.2),
        carrier_from_lidar: RigidTransform::IDENTITY,
    };
    let params = ScannerParams {
        pulses_per_scan: 40_000,
        carrier: Some(carrier),
        ..ScannerParams::default()
    };
    // Fibonacci's lattice on the sphere.
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let around = move |number: u64| {
        let up = 1.0 - (2.0 * number as f64 + 1.0) / 40_000.0;
        let (sin, cos) = (golden * number as f64).sin_cos();
        let level = (1.0 - up * up).max(0.0).sqrt();
        Pulse {
            time_s: number as f64 * 1e-6,
            direction: DVec3::new(level * cos, level * sin, up),
            ring: 0,
        }
    };
    let scanner = Scanner::new(params, Box::new(around)).expect("valid");
    let mut materials = MaterialLibrary::new();
    materials.add(Material::plain("plaster", Semantic::Rock, Vec3::splat(0.5)));
    let points = scanner.scan(&ScanRequest {
        first_pulse: 0,
        caster: &Ball { radius_m: 6.0 },
        materials: &materials,
        scene_from_lidar_at: &|_| RigidTransform::IDENTITY,
        range_model: &ExactRange,
        key: Key::world(7),
    });
    let hidden = 1.0 - points.len() as f64 / 40_000.0;
    // A rectangle of half sides a and b at the distance d: 4 atan(a b / (d √(a² + b² + d²))).
    let expected = 4.0 * (0.04 / (0.4 * (0.04_f64 + 0.04 + 0.16).sqrt())).atan() / (4.0 * PI);
    assert!(
        (hidden / expected - 1.0).abs() < 0.02,
        "{hidden} {expected}"
    );
}
