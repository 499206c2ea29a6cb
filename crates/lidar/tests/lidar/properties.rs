//! Scans of scenes for which the correct result is a formula.

use nemoral_lidar::{
    EchoObservation, ExactRange, LivoxHorizonLike, Mid40, Pulse, RangeModel, RepeatingLines,
    ScanPattern, ScanRequest, Scanner, ScannerParams, Wavelength,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    ChunkCoord, Hit, LaserBand, LidarPoint, Material, MaterialId, MaterialLibrary, ObjectId,
    Optics, Ray, RayCaster, RigidTransform, Semantic,
};
use nemoral_seed::{Domain, Draw, Key};
use proptest::prelude::*;

const KEY: Key = Key::world(7).domain(Domain::new("lidar.test"));

/// Bark: 0.4 at 905 nm, 0.5 at 1550 nm.
const BARK: MaterialId = MaterialId(0);

fn materials() -> MaterialLibrary {
    let band = |reflectance| LaserBand {
        reflectance,
        transmittance: 0.0,
    };
    let mut bark = Material::plain("bark", Semantic::Stem, Vec3::splat(0.2));
    bark.optics = Optics {
        nm905: band(0.4),
        nm1550: band(0.5),
    };
    let mut library = MaterialLibrary::new();
    assert_eq!(library.add(bark), BARK);
    library
}

fn tree() -> ObjectId {
    ObjectId::new(ChunkCoord::new(-1, 2), 5).expect("in range")
}

fn hit(ray: &Ray, distance_m: f64, normal: DVec3) -> Option<Hit> {
    let range = f64::from(ray.t_min_m)..=f64::from(ray.t_max_m);
    let hit = || Hit::new(distance_m as f32, normal.as_vec3(), BARK).with_object(tree());
    range.contains(&distance_m).then(hit)
}

/// All points with `normal · p = offset_m`.
struct Plane {
    normal: DVec3,
    offset_m: f64,
}

impl RayCaster for Plane {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let (origin, direction): (DVec3, DVec3) = (ray.origin.into(), ray.direction.into());
        let distance = (self.offset_m - self.normal.dot(origin)) / self.normal.dot(direction);
        hit(ray, distance, self.normal)
    }
}

/// A sphere, seen from inside.
struct Sphere {
    centre: DVec3,
    radius_m: f64,
}

impl RayCaster for Sphere {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let (origin, direction): (DVec3, DVec3) = (ray.origin.into(), ray.direction.into());
        let to_centre = self.centre - origin;
        let along = to_centre.dot(direction);
        let half_chord =
            (along * along - to_centre.length_squared() + self.radius_m * self.radius_m).sqrt();
        let distance = along + half_chord;
        let outward = (origin + direction * distance - self.centre) / self.radius_m;
        hit(ray, distance, outward)
    }
}

fn scanner(pulses_per_scan: u32, pattern: impl ScanPattern + 'static) -> Scanner {
    let params = ScannerParams {
        pulses_per_scan,
        ..ScannerParams::default()
    };
    Scanner::new(params, Box::new(pattern)).expect("in range")
}

fn standing(_: f64) -> RigidTransform {
    RigidTransform::from_xyz_rpy(DVec3::new(20.0, 30.0, 1.0), 0.02, -0.05, 0.7)
}

/// A robot that drives 2 m/s, turns, and rolls over roots.
fn driving(time_s: f64) -> RigidTransform {
    let yaw = 0.7 + 0.8 * time_s;
    let roll = 0.05 * (9.0 * time_s).sin();
    let position = DVec3::new(20.0 + 2.0 * time_s, 30.0 - time_s, 1.0 + 0.1 * time_s);
    RigidTransform::from_xyz_rpy(position, roll, -0.05, yaw)
}

fn wall() -> Plane {
    Plane {
        normal: DVec3::new(-0.8, -0.6, 0.0),
        offset_m: -50.0,
    }
}

fn gaussian(o: &EchoObservation, key: Key) -> Option<f64> {
    Some(o.range_m + 0.02 * key.rng().normal())
}

/// A model that sees two of three echoes, chosen by their keys.
fn losing(o: &EchoObservation, key: Key) -> Option<f64> {
    (key.rng().below(3) > 0).then_some(o.range_m)
}

fn scan(
    scanner: &Scanner,
    first_pulse: u64,
    caster: &dyn RayCaster,
    pose: &(dyn Fn(f64) -> RigidTransform + Sync),
    noise: &dyn RangeModel,
) -> Vec<LidarPoint> {
    scanner.scan(&ScanRequest {
        first_pulse,
        caster,
        materials: &materials(),
        scene_from_lidar_at: pose,
        range_model: noise,
        key: KEY,
    })
}

#[test]
fn a_sphere_from_its_inside_has_its_closed_form() {
    let sensor = standing(0.0);
    let radius_m = 12.0;
    let offset = DVec3::new(3.0, -2.0, 1.0);
    let sphere = Sphere {
        centre: sensor.translation_m + offset,
        radius_m,
    };
    let scanner = scanner(20_000, RepeatingLines::default());
    let points = scan(&scanner, 0, &sphere, &standing, &ExactRange);
    assert_eq!(points.len(), 20_000);
    // In the LiDAR frame: |r d − c| = radius.
    let centre = sensor.inverse().transform_vector(offset);
    for (point, pulse) in points.iter().zip(scanner.pulses(0)) {
        let along = centre.dot(pulse.direction);
        let half_chord = (along * along - centre.length_squared() + radius_m * radius_m).sqrt();
        let range_m = along + half_chord;
        assert!((f64::from(point.true_range_m) - range_m).abs() < 1e-5);
        assert!((f64::from(point.range_m) - range_m).abs() < 1e-5);
        let position = DVec3::from(point.position_m);
        assert!(position.distance(pulse.direction * range_m) < 2e-5);
        let inward = (centre - position) / radius_m;
        assert!(inward.distance(point.normal.into()) < 1e-5);
        assert!((f64::from(point.incidence_cos) - half_chord / radius_m).abs() < 1e-5);
        let intensity = 0.4 * half_chord / radius_m;
        assert!((f64::from(point.intensity) - intensity).abs() < 1e-5);
        assert!((f64::from(point.reflectivity) - 150.0 * intensity).abs() < 0.501);
        assert_eq!((point.semantic, point.object), (Semantic::Stem, tree()));
        assert_eq!(
            (point.return_number, point.returns, point.ring),
            (1, 1, pulse.ring)
        );
    }
}

#[test]
fn the_wavelength_chooses_the_reflectance() {
    let params = ScannerParams {
        pulses_per_scan: 10,
        wavelength: Wavelength::Nm1550,
        ..ScannerParams::default()
    };
    let scanner = Scanner::new(params, Box::new(Mid40)).unwrap();
    let points = scan(
        &scanner,
        0,
        &wall(),
        &standing,
        &|o: &EchoObservation, _| {
            assert_eq!(o.reflectance, 0.5);
            Some(o.range_m)
        },
    );
    for p in points {
        assert!((p.intensity - 0.5 * p.incidence_cos).abs() < 1e-6);
    }
}

#[test]
fn points_of_a_moving_sensor_lie_where_the_surface_is_at_the_frame_time() {
    let wall = wall();
    let frame = driving(0.0);
    // The wall in the LiDAR frame at the frame's time.
    let normal = frame.inverse().transform_vector(wall.normal);
    let offset_m = wall.offset_m - wall.normal.dot(frame.translation_m);
    let scanner = scanner(50_000, LivoxHorizonLike);
    let mut skewed = 0.0_f64;
    let points = scan(&scanner, 77, &wall, &driving, &ExactRange);
    assert!(points.len() > 40_000);
    let pulses: Vec<_> = scanner.pulses(77).collect();
    for p in &points {
        let off_wall = normal.dot(p.position_m.into()) - offset_m;
        assert!(off_wall.abs() < 5e-5, "{off_wall}");
        assert!(normal.dot(p.normal.into()) > 1.0 - 1e-6);
        // Where the point would be if the sensor had stood still.
        let pulse = &pulses[p.pulse as usize];
        let still = pulse.direction * f64::from(p.true_range_m);
        skewed = skewed.max((normal.dot(still) - offset_m).abs());
    }
    assert!(skewed > 0.5, "the motion matters: {skewed}");
}

#[test]
fn impossible_ranges_are_not_seen() {
    let scanner = scanner(20, LivoxHorizonLike);
    let seen = |range_m: f64| {
        let model = move |_: &EchoObservation, _: Key| Some(range_m);
        scan(&scanner, 0, &wall(), &standing, &model).len()
    };
    for range_m in [f64::NAN, -3.0, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        assert_eq!(seen(range_m), 0, "{range_m}");
    }
    // A range that is measured wrong may be beyond the scanner's.
    assert_eq!((seen(0.0), seen(300.0)), (20, 20));
}

#[test]
fn directions_are_unit_vectors() {
    for spoilt in [DVec3::ZERO, DVec3::NAN, 2.0 * DVec3::X] {
        let pattern = move |n: u64| Pulse {
            time_s: n as f64 * 1e-4,
            direction: if n == 5 { spoilt } else { DVec3::X },
            ring: 0,
        };
        let params = ScannerParams {
            pulses_per_scan: 100,
            ..ScannerParams::default()
        };
        let error = Scanner::new(params, Box::new(pattern)).expect_err("no direction");
        assert_eq!(error.field, "direction.length()");
    }
}

#[cfg(debug_assertions)]
#[test]
#[should_panic(expected = "must be a rotation")]
fn poses_are_rotations() {
    let double = |time_s| RigidTransform {
        rotation: standing(time_s).rotation * 2.0,
        ..standing(time_s)
    };
    scan(
        &scanner(20, LivoxHorizonLike),
        0,
        &wall(),
        &double,
        &ExactRange,
    );
}

#[test]
fn the_scan_is_centred_on_the_frame_and_times_are_the_patterns() {
    let scanner = scanner(48_001, LivoxHorizonLike);
    let duration_s = scanner.duration_s();
    assert!((duration_s - 48_001.0 / 240_000.0).abs() < 1e-15);
    // The sensor drives towards the wall at 1 m/s, so each range tells the time of its pulse.
    let wall = Plane {
        normal: DVec3::NEG_X,
        offset_m: -10.0,
    };
    let approaching = |time_s: f64| RigidTransform {
        translation_m: DVec3::new(time_s, 0.0, 0.0),
        ..RigidTransform::IDENTITY
    };
    let first = scanner.first_pulse_at(3.7);
    assert_eq!(first, 888_000);
    let points = scan(&scanner, first, &wall, &approaching, &ExactRange);
    assert_eq!(points.len(), 48_001);
    for (i, p) in points.iter().enumerate() {
        assert_eq!(p.pulse as usize, i);
        let after_first_ns = (i / 6 * 25_000) as f64;
        assert_eq!(
            p.time_ns,
            (after_first_ns - 0.5e9 * duration_s).round() as i64
        );
        let direction = LivoxHorizonLike.pulse(first + i as u64).direction;
        let told_s = 10.0 - f64::from(p.true_range_m) * direction.x;
        let fired_s = p.time_ns as f64 * 1e-9;
        assert!((told_s - fired_s).abs() < 2e-5, "{told_s} {fired_s}");
    }
}

#[test]
fn points_are_the_pulses_that_come_back() {
    // The ground: pulses above the horizon, or too flat, meet nothing.
    let ground = Plane {
        normal: DVec3::Z,
        offset_m: 0.0,
    };
    let params = ScannerParams {
        pulses_per_scan: 30_000,
        min_range_m: 4.1,
        max_range_m: 60.0,
        ..ScannerParams::default()
    };
    let level = |_: f64| RigidTransform {
        translation_m: DVec3::new(0.0, 0.0, 1.0),
        ..RigidTransform::IDENTITY
    };
    let scanner = Scanner::new(params, Box::new(RepeatingLines::default())).unwrap();
    let points = scan(&scanner, 0, &ground, &level, &ExactRange);
    // Lines at −15°, −13° ... reach the ground at 3.9 m, 4.4 m ... −1° at 57 m.
    let rings: Vec<u8> = points.iter().map(|p| p.ring).collect();
    assert_eq!(points.len(), 7 * 1875);
    assert!(rings.iter().all(|ring| (1..=7).contains(ring)));

    let seen = scan(&scanner, 0, &ground, &level, &losing);
    assert!(
        seen.len() > 8000 && seen.len() < 9500,
        "two in three: {}",
        seen.len()
    );
    assert!(seen.iter().all(|p| points.contains(p)));
}

#[test]
fn a_hit_in_the_blind_zone_hides_what_is_behind() {
    /// Glass at 0.3 m before a wall at 10 m.
    struct Near;
    impl RayCaster for Near {
        fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
            hit(ray, 0.3, DVec3::X).or_else(|| hit(ray, 10.0, DVec3::X))
        }
    }
    let scanner = scanner(100, Mid40);
    assert!(scan(&scanner, 0, &Near, &standing, &ExactRange).is_empty());
}

#[test]
fn threads_do_not_matter() {
    let scanner = scanner(20_000, LivoxHorizonLike);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| scan(&scanner, 5, &wall(), &driving, &gaussian))
    };
    let one = on(1);
    assert!(!one.is_empty());
    assert_eq!(one, on(2));
    assert_eq!(one, on(7));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// A pulse keeps its point when the scan gets longer.
    #[test]
    fn one_more_pulse_changes_no_other(pulses in 1_u32..6000, first in 0_u64..1 << 36) {
        // Longer scans start earlier, by half a pulse, which has no other effect on a sensor that
        // stands still.
        let mut shorter = scan(&scanner(pulses, Mid40), first, &wall(), &standing, &gaussian);
        for p in &mut shorter {
            p.time_ns -= 5_000;
        }
        let longer = scan(&scanner(pulses + 1, Mid40), first, &wall(), &standing, &gaussian);
        prop_assert_eq!(&longer[..shorter.len()], &shorter[..]);
        prop_assert_eq!(longer.len(), shorter.len() + 1);
    }

    #[test]
    fn two_halves_are_the_whole(half in 1_u32..3000, first in 0_u64..1 << 36) {
        let halved = scanner(half, Mid40);
        let whole = scan(&scanner(2 * half, Mid40), first, &wall(), &standing, &gaussian);
        let mut halves = scan(&halved, first, &wall(), &standing, &gaussian);
        let second = scan(&halved, first + u64::from(half), &wall(), &standing, &gaussian);
        // A half's time is that of its own middle.
        let quarter_ns = i64::from(half) * 5_000;
        for p in &mut halves {
            p.time_ns -= quarter_ns;
        }
        halves.extend(second.into_iter().map(|p| LidarPoint {
            pulse: p.pulse + half,
            time_ns: p.time_ns + quarter_ns,
            ..p
        }));
        prop_assert_eq!(halves, whole);
    }

    /// Noise moves points along their beams and touches nothing else.
    #[test]
    fn noise_is_along_the_beam(first in 0_u64..1 << 36) {
        let scanner = scanner(2000, LivoxHorizonLike);
        let exact = scan(&scanner, first, &wall(), &driving, &ExactRange);
        let noisy = scan(&scanner, first, &wall(), &driving, &gaussian);
        prop_assert_eq!(exact.len(), noisy.len());
        let mut moved_points = 0;
        for (e, n) in exact.iter().zip(&noisy) {
            let error_m = n.range_m - e.range_m;
            moved_points += usize::from(error_m != 0.0);
            let moved = n.position_m.distance(e.position_m);
            prop_assert!((moved - error_m.abs()).abs() < 5e-5);
            prop_assert_eq!(
                LidarPoint { range_m: e.range_m, position_m: e.position_m, ..*n },
                *e
            );
        }
        prop_assert!(moved_points > 1900, "{moved_points}");
    }
}

#[test]
fn bad_parameters_are_refused_by_name() {
    let good = ScannerParams::default();
    for (bad, field) in [
        (
            ScannerParams {
                pulses_per_scan: 0,
                ..good
            },
            "pulses_per_scan",
        ),
        (
            ScannerParams {
                pulses_per_scan: 400_000_000,
                ..good
            },
            "pulses_per_scan",
        ),
        (
            ScannerParams {
                min_range_m: -1.0,
                ..good
            },
            "min_range_m",
        ),
        (
            ScannerParams {
                max_range_m: 0.5,
                ..good
            },
            "max_range_m",
        ),
        (
            ScannerParams {
                max_range_m: f32::NAN,
                ..good
            },
            "max_range_m",
        ),
    ] {
        assert_eq!(Scanner::new(bad, Box::new(Mid40)).unwrap_err().field, field);
    }
}

#[test]
fn value_stability() {
    let points = scan(
        &scanner(3, LivoxHorizonLike),
        1_000_001,
        &wall(),
        &driving,
        &gaussian,
    );
    let got: Vec<_> = points
        .iter()
        .map(|p| {
            (
                p.position_m.to_array(),
                p.true_range_m,
                p.range_m,
                p.time_ns,
            )
        })
        .collect();
    assert_eq!(format!("{got:?}"), VALUES);
}
const VALUES: &str = "[([15.850436, -2.8488946, -0.67743796], 16.118631, 16.118675, -6250), \
    ([15.818215, -2.7126105, -1.9149655], 16.140772, 16.162937, 18750), ([15.807784, -2.7060547, \
    -1.6646084], 16.125166, 16.123863, 18750)]";
