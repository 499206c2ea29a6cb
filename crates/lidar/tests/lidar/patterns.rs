//! The patterns against published numbers.

use crate::common::{azimuth_elevation_deg, coverage, disc, lit};
use nemoral_lidar::{
    Avia, LivoxHorizonLike, Mid40, Mid70, Pulse, RepeatingLines, RepeatingLinesParams, ScanPattern,
    Scanner, ScannerParams, SpinningPattern,
};
use nemoral_scene::glam::DVec3;
use nemoral_seed::Key;
use proptest::prelude::*;

/// Directions in the tables of Livox's simulator: time, azimuth, elevation.
#[test]
fn golden_vectors_of_the_livox_tables() {
    let mid40 = [
        (1e-5, 0.334_621_6, 0.000_525_8),
        (0.01, 0.067_091_4, 0.328_001_7),
        (0.25, -0.283_661_6, 0.041_400_8),
        (4.0, 0.134_602_0, 0.237_365_1),
    ];
    let mid70 = [
        (1e-5, -0.614_613_3, -0.000_421_8),
        (0.01, -0.133_457_9, -0.601_577_8),
        (0.25, 0.492_895_7, -0.041_738_9),
        (4.0, -0.262_521_3, -0.385_764_2),
    ];
    let patterns: [(&dyn ScanPattern, _); 2] = [(&Mid40, mid40), (&Mid70, mid70)];
    for (pattern, golden) in patterns {
        for (time_s, azimuth, elevation) in golden {
            let pulse = pattern.pulse((time_s * pattern.rate_hz()).round() as u64);
            assert!((pulse.time_s - time_s).abs() < 1e-12);
            let (az, el) = azimuth_elevation_deg(&pulse);
            assert!((az.to_radians() - azimuth).abs() < 1e-5, "{time_s}: {az}");
            assert!((el.to_radians() - elevation).abs() < 1e-5, "{time_s}: {el}");
        }
    }
}

#[test]
fn circular_fields_of_view_have_the_published_radius() {
    let patterns: [(&dyn ScanPattern, f64); 2] = [(&Mid40, 19.1728), (&Mid70, 35.2158)];
    for (pattern, radius_deg) in patterns {
        let widest = (0..200_000)
            .map(|i| pattern.pulse(i).direction.x.acos().to_degrees())
            .fold(0.0, f64::max);
        assert!((widest - radius_deg).abs() < 1e-3, "{widest}");
    }
}

/// The field of view is ±41.1° and ±13.8°, the extent that the documentation states.
#[test]
fn the_rectangular_field_of_view_is_what_it_says() {
    let (mut azimuth, mut elevation) = (0.0_f64, 0.0_f64);
    for i in 0..1_000_000 {
        let (az, el) = azimuth_elevation_deg(&LivoxHorizonLike.pulse(i));
        azimuth = azimuth.max(az.abs());
        elevation = elevation.max(el.abs());
    }
    assert!((azimuth - 41.1).abs() < 0.1, "{azimuth}");
    assert!((elevation - 13.8).abs() < 0.1, "{elevation}");
}

#[test]
fn no_pulse_leaves_the_field_of_view() {
    let patterns: [(&dyn ScanPattern, f64); 4] = [
        (&Mid40, 19.3),
        (&Mid70, 35.3),
        (&Avia, 38.7),
        (&LivoxHorizonLike, 44.0),
    ];
    for (pattern, widest_deg) in patterns {
        let cone = pattern.field_of_view();
        // An odd stride, which meets every ring.
        for i in (0..12_000_000).step_by(7) {
            assert!(cone.contains(pattern.pulse(i).direction), "pulse {i}");
        }
        let half_angle_deg = cone.half_angle_rad.to_degrees();
        assert!(half_angle_deg < widest_deg + 0.1, "{half_angle_deg}");
    }
    assert!(
        SpinningPattern::vlp16(10.0)
            .expect("valid")
            .field_of_view()
            .contains(-DVec3::X)
    );
}

/// A figure closes after its period and not after any proper divisor of it.
#[test]
fn figures_close_after_their_period() {
    let close = |a: Pulse, b: Pulse| a.direction.distance(b.direction) < 1e-9 && a.ring == b.ring;
    let lines = RepeatingLines::default();
    let patterns: [(&dyn ScanPattern, u64, &[u64]); 5] = [
        (&Mid40, 3_000_000, &[2, 3, 5]),
        (&Mid70, 3_000_000, &[2, 3, 5]),
        (&LivoxHorizonLike, 12_000_000, &[2, 3, 5]),
        (&Avia, 2_400_000_000, &[2, 3, 5]),
        (&lines, 30_000, &[2, 3, 5]),
    ];
    for (pattern, period, primes) in patterns {
        let sample = || (0..1000).map(|i| i * 7919);
        let repeats =
            |after: u64| sample().all(|i| close(pattern.pulse(i), pattern.pulse(i + after)));
        assert!(repeats(period));
        assert!(repeats(1_000_000_000 * period), "no drift over centuries");
        for prime in primes {
            assert!(!repeats(period / prime), "{period} / {prime}");
        }
        // Lines begin at a set place, prisms anywhere.
        let is_set = period == 30_000;
        assert_eq!(pattern.cycle(), if is_set { 0 } else { period });
    }
}

/// Scanners whose figure begins anywhere begin with the first laser of a shot, spread evenly over
/// the figure; others begin at their start.
#[test]
fn recordings_begin_anywhere_in_a_figure() {
    let params = ScannerParams {
        pulses_per_scan: 5,
        ..ScannerParams::default()
    };
    let scanner = |pattern: Box<dyn ScanPattern>| Scanner::new(params, pattern).expect("valid");
    let start = |scanner: &Scanner, i: u64| scanner.start(Key::world(7).item(i));
    let prisms: [(Box<dyn ScanPattern>, u64); 4] = [
        (Box::new(Mid40), 1),
        (Box::new(Mid70), 1),
        (Box::new(Avia), 6),
        (Box::new(LivoxHorizonLike), 6),
    ];
    for (pattern, lasers) in prisms {
        let cycle = pattern.cycle();
        let scanner = scanner(pattern);
        let n = 2000;
        let starts: Vec<u64> = (0..n).map(|i| start(&scanner, i)).collect();
        assert!(starts.iter().all(|s| *s < cycle && s % lasers == 0));
        assert!(
            starts
                .iter()
                .enumerate()
                .all(|(i, s)| *s == start(&scanner, i as u64))
        );
        let first = |s: &u64| {
            let fired_s = |number: u64| scanner.pulses(number).next().map(|p| p.time_s);
            *s == 0 || fired_s(*s) > fired_s(*s - 1)
        };
        assert!(starts.iter().all(first));
        let mean = starts.iter().map(|s| *s as f64 / cycle as f64).sum::<f64>() / n as f64;
        // The standard deviation of an even spread is √(1/12).
        assert!(
            (mean - 0.5).abs() < 4.0 * (1.0 / (12.0 * n as f64)).sqrt(),
            "{mean}"
        );
    }
    let set: [Box<dyn ScanPattern>; 2] = [
        Box::new(RepeatingLines::default()),
        Box::new(SpinningPattern::vlp16(10.0).expect("valid")),
    ];
    for pattern in set {
        assert_eq!(start(&scanner(pattern), 3), 0);
    }
}

/// Coverage is within 2 percentage points of Livox's published curve.
#[test]
fn mid40_coverage_follows_the_published_curve() {
    let cell_deg = 0.265;
    let field = disc(19.2, cell_deg);
    for start in [0, 1_234_567] {
        for (time_s, published) in [(0.1, 19.2), (0.2, 35.1), (0.5, 68.4), (1.0, 92.4)] {
            let got = coverage(&Mid40, start, time_s, cell_deg, &field);
            assert!(
                (got - published).abs() <= 2.0,
                "{start} {time_s}: {got} {published}"
            );
        }
    }
}

/// Coverage is within 3 percentage points of Livox's published curve.
#[test]
fn horizon_coverage_follows_the_published_curve() {
    let cell_deg = 0.32;
    let field = lit(&LivoxHorizonLike, 0..720_000, cell_deg);
    for (time_s, published) in [(0.1, 61.2), (0.2, 84.3), (0.3, 93.4), (0.5, 98.9)] {
        let got = coverage(&LivoxHorizonLike, 0, time_s, cell_deg, &field);
        assert!(
            (got - published).abs() <= 3.0,
            "{time_s}: {got} {published}"
        );
    }
}

#[test]
fn non_repeating_patterns_keep_filling_and_lines_do_not() {
    let cell_deg = 0.265;
    let grow = |pattern: &dyn ScanPattern, field: &_| {
        [0.1, 0.2, 0.4, 0.8].map(|time_s| coverage(pattern, 0, time_s, cell_deg, field))
    };
    let circle = grow(&Mid40, &disc(19.2, cell_deg));
    assert!(circle.windows(2).all(|w| w[1] > w[0] + 5.0), "{circle:?}");
    let rectangle = grow(
        &LivoxHorizonLike,
        &lit(&LivoxHorizonLike, 0..720_000, cell_deg),
    );
    assert!(
        rectangle.windows(2).all(|w| w[1] > w[0] + 1.0),
        "{rectangle:?}"
    );
    let lines = RepeatingLines::default();
    let flat = grow(&lines, &disc(14.0, cell_deg));
    assert!(
        flat[0] > 5.0 && flat.iter().all(|c| *c == flat[0]),
        "{flat:?}"
    );
}

fn line_params() -> impl Strategy<Value = RepeatingLinesParams> {
    (
        1_u8..,
        -1.5_f64..1.5,
        0.0_f64..1.0,
        0.01_f64..=1.0,
        1_u32..5000,
        0.1_f64..100.0,
    )
        .prop_map(|(lines, bottom_rad, height, width, columns, rotation_hz)| {
            RepeatingLinesParams {
                lines,
                bottom_rad,
                top_rad: bottom_rad + height * (1.5 - bottom_rad),
                horizontal_fov_rad: width * std::f64::consts::TAU,
                columns,
                rotation_hz,
            }
        })
}

proptest! {
    #[test]
    fn lines_stay_in_their_field_and_repeat(params in line_params(), number in 0_u64..1 << 40) {
        let pattern = RepeatingLines::new(params).unwrap();
        let pulse = pattern.pulse(number);
        let (azimuth, elevation) = azimuth_elevation_deg(&pulse);
        let tiny = 1e-9;
        prop_assert!(azimuth.to_radians().abs() <= params.horizontal_fov_rad / 2.0 + tiny);
        prop_assert!(elevation.to_radians() >= params.bottom_rad - tiny);
        prop_assert!(elevation.to_radians() <= params.top_rad + tiny);
        prop_assert!(pulse.ring < params.lines);
        let seen = pattern.field_of_view();
        prop_assert!(seen.axis.angle_between(pulse.direction) <= seen.half_angle_rad + 1e-7);
        let next = pattern.pulse(number + pattern.pulses_per_sweep());
        prop_assert_eq!(next.direction, pulse.direction);
        let sweep_s = next.time_s - pulse.time_s;
        prop_assert!((sweep_s * params.rotation_hz - 1.0).abs() < 1e-3);
    }

    #[test]
    fn pulses_together_are_those_alone(
        first in prop_oneof![0_u64..1 << 40, any::<u64>()],
        count in 0_u32..30,
    ) {
        let (lines, spinning) = (
            RepeatingLines::default(),
            SpinningPattern::hdl64e(10.0).expect("a rate"),
        );
        let patterns: [&dyn ScanPattern; 5] = [&Mid40, &Avia, &LivoxHorizonLike, &lines, &spinning];
        for pattern in patterns {
            let alone = (0..count).map(|i| pattern.pulse(first.wrapping_add(i.into())));
            prop_assert_eq!(pattern.pulses(first, count), alone.collect::<Vec<_>>());
        }
    }

    #[test]
    fn pulses_are_unit_vectors_in_the_order_of_time(number in 0_u64..1 << 40) {
        let lines = RepeatingLines::default();
        let patterns: [&dyn ScanPattern; 4] = [&Mid40, &Mid70, &LivoxHorizonLike, &lines];
        for pattern in patterns {
            let (pulse, next) = (pattern.pulse(number), pattern.pulse(number + 1));
            prop_assert!((pulse.direction.length() - 1.0).abs() < 1e-12);
            prop_assert!(pulse.direction.is_normalized());
            prop_assert!(next.time_s >= pulse.time_s);
            // The n-th pulse is fired at n / rate, to the shot of a multi-line scanner.
            let expected_s = number as f64 / pattern.rate_hz();
            prop_assert!((pulse.time_s - expected_s).abs() < 2.5e-5);
        }
    }
}

#[test]
fn a_closure_is_a_pattern_and_its_rate_is_found() {
    let mid40 = |i: u64| Mid40.pulse(i);
    assert!((mid40.rate_hz() - 100_000.0).abs() < 1e-6);
}

#[test]
fn bad_parameters_are_refused_by_name() {
    let good = RepeatingLinesParams::default();
    for (bad, field) in [
        (RepeatingLinesParams { lines: 0, ..good }, "lines"),
        (
            RepeatingLinesParams {
                bottom_rad: f64::NAN,
                ..good
            },
            "bottom_rad",
        ),
        (
            RepeatingLinesParams {
                top_rad: -1.0,
                ..good
            },
            "top_rad",
        ),
        (
            RepeatingLinesParams {
                horizontal_fov_rad: 7.0,
                ..good
            },
            "horizontal_fov_rad",
        ),
        (RepeatingLinesParams { columns: 0, ..good }, "columns"),
        (
            RepeatingLinesParams {
                rotation_hz: 0.0,
                ..good
            },
            "rotation_hz",
        ),
    ] {
        assert_eq!(RepeatingLines::new(bad).unwrap_err().field, field);
    }
}

#[test]
fn value_stability() {
    let lines = RepeatingLines::default();
    let patterns: [&dyn ScanPattern; 4] = [&lines, &Mid40, &Mid70, &LivoxHorizonLike];
    let got = patterns.map(|p| p.pulse(123_457).direction.to_array());
    assert_eq!(format!("{got:?}"), VALUES);
}
const VALUES: &str = "[[-0.7298727080095402, -0.6455097623215346, -0.22495105434386498], \
    [0.9458246557888573, 0.30296423693881885, 0.11674070257612958], [0.8232543680873062, \
    -0.5339304681847736, -0.19279652634100264], [0.8834609082110862, -0.446771853731301, \
    -0.1410380600275669]]";
