//! Scan mirrors over a plane, whose densities are formulas.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nemoral_lidar::{
    ExactRange, MirrorMotion, Pulse, ScanMirror, ScanMirrorParams, ScanPattern, ScanRequest,
    Scanner, ScannerParams,
};
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{
    Hit, Material, MaterialId, MaterialLibrary, Ray, RayCaster, RigidTransform, Semantic,
};
use nemoral_seed::Key;
use proptest::prelude::*;

const VUX: ScanMirrorParams = ScanMirrorParams {
    motion: MirrorMotion::Rotating,
    rate_hz: 550_000,
    lines_hz: 100,
    half_angle_rad: PI / 4.0,
};
const ALS50: ScanMirrorParams = ScanMirrorParams {
    motion: MirrorMotion::Sine,
    rate_hz: 83_000,
    lines_hz: 50,
    half_angle_rad: PI / 6.0,
};
/// The nutating mirror of the VQ-840-G at 50 kHz.
const VQ840: ScanMirrorParams = ScanMirrorParams {
    motion: MirrorMotion::Nutating,
    rate_hz: 50_000,
    lines_hz: 69,
    half_angle_rad: PI / 9.0,
};

fn mirror(params: ScanMirrorParams) -> ScanMirror {
    ScanMirror::new(params).expect("valid")
}

/// A mirror that flies straight on over a plane.
struct Flight {
    mirror: ScanMirror,
    height_m: f64,
    speed_m_s: f64,
}

impl Flight {
    fn new(params: ScanMirrorParams, height_m: f64, speed_m_s: f64) -> Self {
        Self {
            mirror: mirror(params),
            height_m,
            speed_m_s,
        }
    }

    /// Where pulses meet the plane (forward, left), and when they are fired.
    fn points(&self, pulses: u64) -> impl Iterator<Item = (DVec2, f64)> + '_ {
        (0..pulses).map(|k| {
            let Pulse {
                direction: d,
                time_s,
                ..
            } = self.mirror.pulse(k);
            let on_plane = d.truncate() * (self.height_m / -d.z);
            (on_plane + DVec2::X * self.speed_m_s * time_s, time_s)
        })
    }

    /// Points per square metre of a line's points between two distances to the left.
    fn density(&self, pulses_per_line: u64, from_m: f64, to_m: f64) -> f64 {
        let ys: Vec<f64> = (self.points(pulses_per_line).map(|(at, _)| at.y))
            .filter(|y| (from_m..to_m).contains(y))
            .collect();
        let spacing_m = (ys[ys.len() - 1] - ys[0]) / (ys.len() - 1) as f64;
        let line = self.mirror.pulse(pulses_per_line).time_s - self.mirror.pulse(0).time_s;
        1.0 / (spacing_m * self.speed_m_s * line)
    }
}

/// ρ = P cos²θ / (2π h v): 291.8 points per square metre below, and half as many at 45°.
#[test]
fn a_rotating_mirror_has_the_density_of_the_formula() {
    let flight = Flight::new(VUX, 60.0, 5.0);
    let per_line = 1375;
    assert_eq!(flight.mirror.rate_hz(), 137_500.0);
    let line_s = flight.mirror.pulse(per_line).time_s;
    assert!((line_s - 0.01).abs() < 1e-15, "{line_s}");
    for (from_m, to_m, expected) in [(-2.0, 2.0, 291.8), (59.3, 60.0, 145.9)] {
        let found = flight.density(per_line, from_m, to_m);
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
    }
}

/// The mean over lines D apart is P_used / (v D), whatever the height.
#[test]
fn parallel_flights_have_the_mean_density_of_the_formula() {
    let (spacing_m, speed_m_s) = (20.0, 5.0);
    for (height_m, strips) in [(60.0, 4), (100.0, 6)] {
        let flight = Flight::new(VUX, height_m, speed_m_s);
        // 30 m long, of which 20 m are looked at; across, between two lines and off them.
        let of_strip = |strip: i32| {
            let beside = DVec2::Y * spacing_m * f64::from(strip);
            let points = flight.points(6 * 137_500).map(move |(at, _)| at + beside);
            points
                .filter(|at| (5.0..25.0).contains(&at.x) && (3.0..23.0).contains(&at.y))
                .count()
        };
        let count: usize = (-strips..=strips).map(of_strip).sum();
        let found = count as f64 / 400.0;
        assert!((found / 1375.0 - 1.0).abs() < 0.01, "{height_m} m: {found}");
    }
}

/// A polygon sweeps as its facets do: 90° for the 60° of which two in three pulses are measured.
#[test]
fn a_polygon_measures_its_duty() {
    let polygon = mirror(ScanMirrorParams {
        motion: MirrorMotion::Polygon { duty: 2.0 / 3.0 },
        rate_hz: 300_000,
        lines_hz: 100,
        half_angle_rad: PI / 6.0,
    });
    assert_eq!(polygon.rate_hz(), 200_000.0);
    assert!((polygon.pause_s() - 0.01 / 3.0).abs() < 1e-12);
    let left_rad = |k| angle_rad(&polygon.pulse(k));
    assert!((left_rad(1) - left_rad(0) - FRAC_PI_2 / 3000.0).abs() < 1e-12);
    let (first, last, next) = (polygon.pulse(0), polygon.pulse(1999), polygon.pulse(2000));
    assert!((angle_rad(&first) + angle_rad(&last)).abs() < 1e-12);
    assert_eq!(next.direction, first.direction);
    assert!((last.time_s - 1999.0 / 300_000.0).abs() < 1e-15);
    assert!((next.time_s - 0.01).abs() < 1e-15);
}

/// The angle to the left of straight down.
fn angle_rad(pulse: &Pulse) -> f64 {
    pulse.direction.y.atan2(-pulse.direction.z)
}

/// 2π f Θ h / P = 1.98 m below for a sine and 4 f Θ h / P = 1.26 m for a triangle wave, v / f at
/// the edges and half of it below; 1.027 points per square metre of the swath.
#[test]
fn an_oscillating_mirror_has_the_spacings_of_the_formulas() {
    let triangle = ScanMirrorParams {
        motion: MirrorMotion::Triangle,
        ..ALS50
    };
    for (params, expected_m) in [(ALS50, 1.981), (triangle, 1.2617)] {
        let flight = Flight::new(params, 1000.0, 70.0);
        let points: Vec<_> = flight.points(83_000).collect();
        let crossings: Vec<_> = points
            .windows(2)
            .filter(|w| (w[0].0.y < 0.0) != (w[1].0.y < 0.0))
            .collect();
        let half_width_m = 1000.0 * f64::tan(PI / 6.0);
        for pair in &crossings {
            let step_m = (pair[1].0.y - pair[0].0.y).abs();
            assert!((step_m / expected_m - 1.0).abs() < 2e-3, "{step_m}");
        }
        for pair in crossings.windows(2) {
            let along_m = pair[1][0].0.x - pair[0][0].0.x;
            assert!((along_m - 0.7).abs() < 2e-3, "{along_m}");
        }
        let edges: Vec<_> = points
            .windows(3)
            .filter(|w| w[1].0.y > w[0].0.y && w[1].0.y >= w[2].0.y)
            .map(|w| w[1].0)
            .collect();
        assert_eq!(edges.len(), 50);
        for pair in edges.windows(2) {
            assert!((pair[0].y / half_width_m - 1.0).abs() < 1e-3);
            assert!((pair[1].x - pair[0].x - 1.4).abs() < 2e-3);
        }
        let across = |end: fn(f64, f64) -> f64| points.iter().map(|p| p.0.y).fold(0.0, end);
        let area_m2 = 70.0 * (across(f64::max) - across(f64::min));
        let mean = points.len() as f64 / area_m2;
        assert!((mean / 1.027 - 1.0).abs() < 2e-3, "{mean}");
    }
}

/// The sine has its density P / (2π f Θ h) · cos²θ / cos(phase) twice a swing; the triangle wave
/// that of a line scanner.
#[test]
fn swings_have_their_parts_of_the_pulses() {
    let share = |motion, within: f64| {
        let params = ScanMirrorParams { motion, ..ALS50 };
        let pattern = mirror(params);
        let inside = |k: &u64| angle_rad(&pattern.pulse(*k)).abs() < within * params.half_angle_rad;
        (0..83_000).filter(inside).count() as f64 / 83_000.0
    };
    for within in [0.25_f64, 0.5, 0.9] {
        let sine = share(MirrorMotion::Sine, within);
        assert!((sine - within.asin() / FRAC_PI_2).abs() < 2e-3, "{sine}");
        let triangle = share(MirrorMotion::Triangle, within);
        assert!((triangle - within).abs() < 2e-3, "{triangle}");
    }
}

/// ρ(y) = P / (π v √(r² − y²)), as of a ring that is drawn over the plane.
#[test]
fn a_cone_has_the_density_of_a_ring() {
    let params = ScanMirrorParams {
        motion: MirrorMotion::Cone,
        rate_hz: 100_003,
        lines_hz: 150,
        half_angle_rad: PI / 9.0,
    };
    let (height_m, speed_m_s) = (500.0, 60.0);
    let flight = Flight::new(params, height_m, speed_m_s);
    let radius_m = height_m * f64::tan(PI / 9.0);
    let ys: Vec<f64> = flight.points(100_003).map(|(at, _)| at.y).collect();
    for (from, to) in [(-0.1, 0.1), (0.4, 0.6), (0.9, 1.0)] {
        let (from_m, to_m) = (radius_m * from, radius_m * to);
        let inside = ys.iter().filter(|y| (from_m..to_m).contains(*y)).count();
        let found = inside as f64 / (speed_m_s * (to_m - from_m));
        let integral = f64::asin(to) - f64::asin(from);
        let expected = 100_003.0 / (PI * speed_m_s) * integral / (to_m - from_m);
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
    }
    for k in 0..1000 {
        let off_nadir = flight.mirror.pulse(k).direction.angle_between(DVec3::NEG_Z);
        assert!((off_nadir - PI / 9.0).abs() < 1e-12);
    }
    // It starts ahead and turns to the left.
    let (first, next) = (flight.mirror.pulse(0), flight.mirror.pulse(1));
    assert!(first.direction.x > 0.3 && next.direction.y > first.direction.y);
}

/// A mirror that is tilted by 10° turns the beam by 20.00° in the plane of incidence, which lies
/// across the flight, and by 14.21° along it: the data sheet of the VQ-840-G has 20° and 14°.
#[test]
fn a_nutating_mirror_draws_an_ellipse() {
    let pattern = mirror(VQ840);
    let [mut left, mut right, mut ahead, mut behind] = [0.0_f64; 4];
    for k in 0..50_000 {
        let d = pattern.pulse(k).direction;
        let (along_deg, across_deg) = (d.x.asin().to_degrees(), d.y.atan2(-d.z).to_degrees());
        (left, right) = (left.max(across_deg), right.min(across_deg));
        (ahead, behind) = (ahead.max(along_deg), behind.min(along_deg));
    }
    for (found, expected) in [
        (left, 20.0),
        (-right, 20.0),
        (ahead, 14.2096),
        (-behind, 14.2096),
    ] {
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    }
    // It goes around: of the swings across, each has one along.
    let first = pattern.pulse(0).direction;
    assert!(first.y > 0.34 && pattern.pulse(181).direction.x < -0.2);
}

/// Riegl's sheet has 92 points per square metre from 75 m at 10 m/s, and 18 from 150 m at 26 m/s.
#[test]
fn a_vq840_has_its_published_densities() {
    for (lines_hz, height_m, speed_m_s, expected) in
        [(69, 75.0, 10.0, 91.6), (77, 150.0, 26.0, 17.6)]
    {
        let params = ScanMirrorParams { lines_hz, ..VQ840 };
        let flight = Flight::new(params, height_m, speed_m_s);
        let (mut low_m, mut high_m) = (0.0_f64, 0.0_f64);
        let mut end_s = 0.0;
        for (at, time_s) in flight.points(100_001) {
            (low_m, high_m) = (low_m.min(at.y), high_m.max(at.y));
            end_s = time_s;
        }
        let found = 100_000.0 / (speed_m_s * end_s * (high_m - low_m));
        assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
    }
}

/// Far out, after weeks, times and phases are what integers say.
#[test]
fn pulses_are_exact_after_weeks() {
    let far = 1_000_000_000_000;
    let vux = mirror(VUX);
    // 727,272,727 lines of 10 ms, and 375 pulses.
    assert_eq!(
        vux.pulse(far).time_s,
        7_272_727.0 + 0.27 + 375.0 / 550_000.0
    );
    assert_eq!(vux.pulse(far).direction, vux.pulse(375).direction);
    let als = mirror(ALS50);
    assert_eq!(als.pulse(far).time_s, 1e12 / 83_000.0);
    // A swing takes 1660 pulses.
    assert_eq!(far % 1660, 920);
    assert_eq!(als.pulse(far).direction, als.pulse(920).direction);
    let last = als.pulse(u64::MAX);
    assert_eq!(last.direction, als.pulse(u64::MAX % 1660).direction);
    assert!((last.time_s / (u64::MAX as f64 / 83_000.0) - 1.0).abs() < 1e-15);
}

#[test]
fn the_field_of_view_is_tight() {
    for params in [VUX, ALS50, VQ840] {
        let pattern = mirror(params);
        let cone = pattern.field_of_view();
        assert_eq!(cone.axis, DVec3::NEG_Z);
        let widest = (0..50_000)
            .map(|k| cone.axis.angle_between(pattern.pulse(k).direction))
            .fold(0.0, f64::max);
        assert!(cone.half_angle_rad - widest < 1e-3, "{widest}");
    }
}

fn any_motion() -> impl Strategy<Value = MirrorMotion> {
    prop_oneof![
        Just(MirrorMotion::Rotating),
        (0.01..=1.0).prop_map(|duty| MirrorMotion::Polygon { duty }),
        Just(MirrorMotion::Sine),
        Just(MirrorMotion::Triangle),
        Just(MirrorMotion::Cone),
        Just(MirrorMotion::Nutating),
    ]
}

prop_compose! {
    fn any_params()(
        motion in any_motion(),
        rate_hz in prop_oneof![1_u32..2000, 1_u32..=10_000_000],
        lines_hz in 1_u32..=1000,
        part in 0.001..=1.0,
    ) -> ScanMirrorParams {
        let widest_rad = if motion == MirrorMotion::Rotating { PI } else { FRAC_PI_2 };
        ScanMirrorParams { motion, rate_hz, lines_hz, half_angle_rad: part * widest_rad }
    }
}

proptest! {
    #[test]
    fn pulses_are_unit_vectors_within_the_cone_in_the_order_of_time(
        params in any_params(),
        number in prop_oneof![0_u64..10_000, 0_u64..1 << 50],
        count in 1_u32..3000,
    ) {
        let Ok(pattern) = ScanMirror::new(params) else {
            prop_assert!(params.lines_hz > params.rate_hz / 1000);
            return Ok(());
        };
        let cone = pattern.field_of_view();
        let pulses = pattern.pulses(number, count.min(40));
        for (k, pulse) in (number..).zip(&pulses) {
            prop_assert_eq!(*pulse, pattern.pulse(k));
            prop_assert!((pulse.direction.length() - 1.0).abs() < 1e-12);
            prop_assert!(cone.contains(pulse.direction));
        }
        prop_assert!(pulses.windows(2).all(|w| w[0].time_s <= w[1].time_s));
        // A scan lasts as long as its pulses at the mean rate, and at most a pause longer.
        let (start_s, rate_hz) = (pulses[0].time_s, pattern.rate_hz());
        let last = pattern.pulse(number + u64::from(count) - 1);
        let rounding_s = 1e-15 * last.time_s;
        let longest_s = f64::from(count) / rate_hz + pattern.pause_s() + 2.0 * rounding_s;
        prop_assert!(last.time_s - start_s <= longest_s);
        // Pulses keep the mean rate for ever.
        let line_s = f64::from(params.lines_hz).recip();
        prop_assert!((start_s - number as f64 / rate_hz).abs() <= line_s + 1e-15 * start_s);
    }

    /// Lines are all alike, and symmetric.
    #[test]
    fn sweeps_repeat_and_are_symmetric(
        params in any_params(),
        line in 0_u64..1 << 40,
        place in any::<prop::sample::Index>(),
    ) {
        let Ok(pattern) = ScanMirror::new(params) else {
            return Ok(());
        };
        if !matches!(params.motion, MirrorMotion::Rotating | MirrorMotion::Polygon { .. }) {
            return Ok(());
        }
        let per_line = (pattern.rate_hz() / f64::from(params.lines_hz)).round() as u64;
        let place = place.index(per_line as usize) as u64;
        let here = pattern.pulse(line * per_line + place);
        prop_assert_eq!(here.direction, pattern.pulse(place).direction);
        let other = pattern.pulse((line + 1) * per_line - 1 - place);
        prop_assert!((angle_rad(&here) + angle_rad(&other)).abs() < 1e-9);
        prop_assert!(angle_rad(&here).abs() <= params.half_angle_rad);
        // To the exact value, within the rounding of the result.
        let exact = u128::from(line) * u128::from(params.rate_hz)
            + u128::from(place) * u128::from(params.lines_hz);
        let per_s = u128::from(params.rate_hz) * u128::from(params.lines_hz);
        let (whole, rest) = ((exact / per_s) as f64, (exact % per_s) as f64 / per_s as f64);
        prop_assert!((here.time_s - whole - rest).abs() <= f64::EPSILON * here.time_s);
    }
}

/// The plane 60 m below.
struct Ground(MaterialId);

impl RayCaster for Ground {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let distance_m = (-60.0 - ray.origin.z) / ray.direction.z;
        ray.reaches(distance_m)
            .then(|| Hit::new(distance_m, Vec3::Z, self.0))
    }
}

/// A scan that starts in the middle of a line ends in a later one, and asks for no pose beyond what
/// the scanner says.
#[test]
fn a_scan_knows_how_long_it_lasts() {
    let mut materials = MaterialLibrary::new();
    let soil = Material::plain("soil", Semantic::Soil, Vec3::splat(0.3));
    let ground = Ground(materials.add(soil));
    let params = ScannerParams {
        // A pulse at the end of a line, the next line, and the first pulse after it.
        pulses_per_scan: 1377,
        ..ScannerParams::default()
    };
    let scanner = Scanner::new(params, Box::new(mirror(VUX))).expect("valid");
    let half_s = 0.5 * 1377.0 / 137_500.0;
    assert!((scanner.duration_s() - 2.0 * half_s).abs() < 1e-12);
    assert!((scanner.half_scan_s() - half_s - 0.0075).abs() < 1e-12);
    let latest_s = |first_pulse| {
        let asked = std::sync::Mutex::new(0.0_f64);
        let pose = |time_s: f64| {
            let mut latest = asked.lock().expect("a number");
            *latest = latest.max(time_s.abs());
            RigidTransform::IDENTITY
        };
        let points = scanner.scan(&ScanRequest {
            first_pulse,
            caster: &ground,
            materials: &materials,
            scene_from_lidar_at: &pose,
            range_model: &ExactRange,
            key: Key::world(7),
        });
        assert_eq!(points.len(), 1377);
        *asked.lock().expect("a number")
    };
    assert!(latest_s(0) < half_s + 1e-12);
    let late_s = latest_s(1374);
    assert!(
        late_s > half_s + 0.0074 && late_s <= scanner.half_scan_s(),
        "{late_s}"
    );
}

#[test]
fn bad_parameters_are_refused_by_name() {
    let polygon = |duty| ScanMirrorParams {
        motion: MirrorMotion::Polygon { duty },
        half_angle_rad: 0.5,
        ..VUX
    };
    for (bad, field) in [
        (ScanMirrorParams { rate_hz: 0, ..VUX }, "rate_hz"),
        (
            ScanMirrorParams {
                rate_hz: 10_000_001,
                ..VUX
            },
            "rate_hz",
        ),
        (ScanMirrorParams { lines_hz: 0, ..VUX }, "lines_hz"),
        (
            ScanMirrorParams {
                lines_hz: 1001,
                ..VUX
            },
            "lines_hz",
        ),
        (
            ScanMirrorParams {
                rate_hz: 49,
                ..ALS50
            },
            "lines_hz",
        ),
        // A quarter of a line of one pulse has none.
        (
            ScanMirrorParams {
                rate_hz: 100,
                ..VUX
            },
            "lines_hz",
        ),
        (
            ScanMirrorParams {
                half_angle_rad: 0.0,
                ..VUX
            },
            "half_angle_rad",
        ),
        (
            ScanMirrorParams {
                half_angle_rad: f64::NAN,
                ..VUX
            },
            "half_angle_rad",
        ),
        (
            ScanMirrorParams {
                half_angle_rad: 3.2,
                ..VUX
            },
            "half_angle_rad",
        ),
        (
            ScanMirrorParams {
                half_angle_rad: 1.6,
                ..ALS50
            },
            "half_angle_rad",
        ),
        (polygon(0.0), "duty"),
        (polygon(1.1), "duty"),
        (polygon(f64::NAN), "duty"),
    ] {
        let refused = ScanMirror::new(bad).expect_err("out of range");
        assert_eq!(refused.field, field, "{bad:?}");
    }
    // A turn is a line, too.
    let all_around = mirror(ScanMirrorParams {
        half_angle_rad: PI,
        ..VUX
    });
    assert_eq!(all_around.rate_hz(), 550_000.0);
    let step_rad = angle_rad(&all_around.pulse(1)) - angle_rad(&all_around.pulse(0));
    assert!((step_rad - TAU / 5500.0).abs() < 1e-12);
}

#[test]
fn value_stability() {
    let cone = |motion| ScanMirrorParams { motion, ..VQ840 };
    let all = [
        VUX,
        ALS50,
        ScanMirrorParams {
            motion: MirrorMotion::Triangle,
            ..ALS50
        },
        cone(MirrorMotion::Cone),
        VQ840,
    ];
    let got = all.map(|params| {
        let pulse = mirror(params).pulse(123_457);
        (pulse.time_s, pulse.direction.to_array())
    });
    assert_eq!(format!("{got:?}"), VALUES);
}
const VALUES: &str = "[(0.8919672727272727, [0.0, 0.43608800348405535, -0.8999040244477688]), \
    (1.487433734939759, [0.0, 0.3689388269225913, -0.9294536793132739]), (1.487433734939759, [0.0, \
    0.26551557113364316, -0.9641065716431847]), (2.46914, [-0.23516079697562983, \
    0.24834890377510743, -0.9396926207859084]), (2.46914, [-0.1968993703335799, \
    -0.21926209804123142, -0.9555913197203063])]";
