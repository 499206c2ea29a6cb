//! Surveys from the air: where their lines are, how they follow the ground, and what is refused.

use std::f64::consts::FRAC_PI_2;

use proptest::prelude::*;

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_seed::Key;
use nemoral_trajectory::{AltitudeMode, FlightLines, FlightLinesParams};

const PLAN: FlightLinesParams = FlightLinesParams {
    middle_m: DVec2::new(1000.0, -500.0),
    forward: DVec2::Y,
    length_m: 100.0,
    width_m: 50.0,
    margin_m: 20.0,
    line_spacing_m: 20.0,
    is_crossed: false,
    height_m: 60.0,
    follow: AltitudeMode::Ground,
    speed_m_s: 5.0,
    step_s: 1.0,
    turn_s: 40.0,
    sway_rad: 0.0,
};

fn level(_: DVec2) -> f64 {
    7.0
}

fn hills(p: DVec2) -> f64 {
    20.0 * (p.x / 60.0).sin() + 15.0 * (p.y / 45.0).cos()
}

fn lines(params: FlightLinesParams, ground_m: impl Fn(DVec2) -> f64) -> FlightLines {
    FlightLines::new(params, ground_m, Key::world(7)).expect("in range")
}

#[test]
fn lines_are_flown_in_turn_without_gaps() {
    let flight = lines(PLAN, level);
    // 140 m are 28 frames of 5 m; 50 m are three spacings of at most 20 m.
    assert_eq!(flight.count(), 4 * 28);
    let firsts: Vec<u64> = flight.first_frames().collect();
    assert_eq!(firsts, [0, 28, 56, 84]);
    assert_eq!([0, 27, 28].map(|k| flight.time_s(k)), [0.5, 27.5, 68.5]);
    let place = |frame, offset_s| flight.pose(frame, offset_s).translation_m;
    // From the south-west to the north, and back 20 m east of it.
    assert_eq!(place(0, -0.5), DVec3::new(970.0, -570.0, 67.0));
    assert_eq!(place(27, 0.5), DVec3::new(970.0, -430.0, 67.0));
    assert!(place(28, -0.5).distance(DVec3::new(990.0, -430.0, 67.0)) < 1e-9);
    for k in (0..111).filter(|k| k % 28 != 27) {
        assert!(place(k, 0.5).distance(place(k + 1, -0.5)) < 1e-9, "{k}");
    }
    let ahead = |frame| flight.pose(frame, 0.0).transform_vector(DVec3::X);
    assert!(ahead(3).distance(DVec3::Y) < 1e-12);
    assert!(ahead(30).distance(DVec3::NEG_Y) < 1e-12);
    // Beyond the end it flies straight on.
    assert_eq!(place(27, 2.5).y, -420.0);
}

#[test]
fn crossed_lines_are_at_right_angles_over_the_same_area() {
    let crossed = FlightLinesParams {
        is_crossed: true,
        ..PLAN
    };
    let flight = lines(crossed, level);
    // 100 m across are six lines of 50 m and two margins, 18 frames.
    assert_eq!(flight.count(), 4 * 28 + 6 * 18);
    assert_eq!(flight.first_frames().count(), 10);
    let ahead = flight.pose(4 * 28, 0.0).transform_vector(DVec3::X);
    assert!(ahead.distance(DVec3::X) < 1e-12);
    let at: Vec<DVec3> = (112..220)
        .map(|k| flight.pose(k, 0.0).translation_m)
        .collect();
    let (south, north) = (at.iter()).fold((0.0_f64, -1e4_f64), |(low, high), p| {
        (low.min(p.y), high.max(p.y))
    });
    assert!((south + 550.0).abs() < 1e-9 && (north + 450.0).abs() < 1e-9);
    let single = FlightLinesParams {
        width_m: 0.0,
        ..crossed
    };
    assert_eq!(single.frames(), 28);
}

#[test]
fn a_flight_follows_the_ground_or_a_level() {
    let flight = lines(PLAN, hills);
    let mut clearances = Vec::new();
    for frame in 0..flight.count() {
        for offset_s in [-0.4, 0.0, 0.4] {
            let p = flight.pose(frame, offset_s).translation_m;
            clearances.push(p.z - hills(p.truncate()));
        }
    }
    let least = clearances.iter().copied().fold(f64::MAX, f64::min);
    let most = clearances.iter().copied().fold(f64::MIN, f64::max);
    assert!(least > 59.0 && most < 82.0, "{least} {most}");
    // It climbs steadily.
    let z = |t: f64| flight.pose(14, t).translation_m.z;
    for i in -130..130 {
        let t = f64::from(i) * 0.1;
        let bend = z(t + 0.1) - 2.0 * z(t) + z(t - 0.1);
        assert!(bend.abs() < 0.01, "at {t}: {bend}");
    }

    let above = FlightLinesParams {
        follow: AltitudeMode::Level,
        ..PLAN
    };
    let flight = lines(above, hills);
    let heights: Vec<f64> = (0..flight.count())
        .map(|k| flight.pose(k, 0.0).translation_m.z)
        .collect();
    assert!(heights.iter().all(|z| (z - heights[0]).abs() < 1e-9));
    let below = (-30..=30).flat_map(|x| (-70..=70).map(move |y| DVec2::new(x.into(), y.into())));
    let highest_m = below.map(|p| hills(PLAN.middle_m + p)).fold(0.0, f64::max);
    let above_m = heights[0] - 60.0 - highest_m;
    assert!((0.0..5.0).contains(&above_m), "{above_m}");
}

#[test]
fn wrong_values_are_named() {
    let nan = f64::NAN;
    for (params, field) in [
        (
            FlightLinesParams {
                length_m: 0.0,
                ..PLAN
            },
            "length_m",
        ),
        (
            FlightLinesParams {
                width_m: -1.0,
                ..PLAN
            },
            "width_m",
        ),
        (
            FlightLinesParams {
                line_spacing_m: nan,
                ..PLAN
            },
            "line_spacing_m",
        ),
        (
            FlightLinesParams {
                width_m: 0.0,
                line_spacing_m: 1e8,
                ..PLAN
            },
            "line_spacing_m",
        ),
        (
            FlightLinesParams {
                step_s: 0.0,
                ..PLAN
            },
            "step_s",
        ),
        (
            FlightLinesParams {
                step_s: 1e-9,
                ..PLAN
            },
            "step_s",
        ),
        (
            FlightLinesParams {
                forward: DVec2::ZERO,
                ..PLAN
            },
            "forward",
        ),
    ] {
        let refused = FlightLines::new(params, level, Key::world(7));
        assert_eq!(refused.expect_err("is refused").field, field);
    }
}

#[test]
fn more_frames_than_can_be_counted_are_refused() {
    let endless = FlightLinesParams {
        width_m: 1e300,
        step_s: 1e-300,
        ..PLAN
    };
    assert_eq!(endless.frames(), u64::MAX);
    assert_eq!(endless.check().expect_err("too many").field, "step_s");
}

#[test]
fn value_stability() {
    let swaying = FlightLinesParams {
        sway_rad: 0.02,
        ..PLAN
    };
    let pose = lines(swaying, hills).pose(30, 0.2);
    assert_eq!(
        format!("{:?} {:?}", pose.translation_m, pose.rotation),
        VALUES
    );
}
const VALUES: &str = "DVec3(990.0, -443.5, 39.01461260748108) \
    DQuat(-0.009572914794387023, -0.010403438720580692, -0.7227349109247803, \
    0.6909807351118238)";

proptest! {
    #[test]
    fn every_place_of_the_area_is_near_a_line(
        (length_m, width_m) in (1.0_f64..300.0, 0.0_f64..300.0),
        (line_spacing_m, step_s) in (2.0_f64..60.0, 0.1_f64..8.0),
        heading in -3.0_f64..3.0,
        (x, y) in (-0.5_f64..=0.5, -0.5_f64..=0.5),
    ) {
        let forward = DVec2::from_angle(heading);
        let params = FlightLinesParams {
            length_m, width_m, line_spacing_m, step_s, forward, ..PLAN
        };
        let flight = lines(params, level);
        let place = PLAN.middle_m + forward * (x * length_m) + forward.perp() * (y * width_m);
        let distances = (0..flight.count()).map(|k| {
            let at = flight.pose(k, 0.0).translation_m.truncate();
            let to = place - at;
            let aside = to.dot(forward.perp()).abs();
            let ahead = to.dot(forward).abs();
            if ahead <= 0.5 * step_s * PLAN.speed_m_s + 1e-9 { aside } else { f64::MAX }
        });
        let nearest_m = distances.fold(f64::MAX, f64::min);
        prop_assert!(nearest_m <= line_spacing_m / 2.0 + 1e-9, "{nearest_m}");
        // Times increase, by a turn between lines.
        let firsts: Vec<u64> = flight.first_frames().collect();
        for k in 1..flight.count() {
            let step = flight.time_s(k) - flight.time_s(k - 1);
            let turn = if firsts.contains(&k) { PLAN.turn_s } else { 0.0 };
            prop_assert!((step - step_s - turn).abs() < 1e-6);
        }
        let yaw = flight.pose(0, 0.0).transform_vector(DVec3::X).truncate().to_angle();
        prop_assert!((yaw - heading).abs() < FRAC_PI_2 * 1e-9);
    }
}
