//! Scanners on motors: what the motor does to a pattern's pulses, and what they see together.

use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nemoral_lidar::{
    Avia, Device, Mid40, MotorParams, MotorisedPattern, Pulse, ScanPattern, SpinningPattern,
};
use nemoral_scene::DirectionCone;
use nemoral_scene::glam::{DMat3, DVec3};
use proptest::prelude::*;

fn head() -> Box<dyn ScanPattern> {
    Box::new(SpinningPattern::vlp16(10.0).expect("valid"))
}

fn motorised(pattern: Box<dyn ScanPattern>, params: MotorParams) -> MotorisedPattern {
    MotorisedPattern::new(pattern, params).expect("in range")
}

#[test]
fn a_motor_turns_each_pulse_by_its_time() {
    let params = MotorParams {
        turns_hz: 0.5,
        tilt_rad: 0.7,
    };
    let (still, turned) = (head(), motorised(head(), params));
    assert_eq!(turned.rate_hz(), still.rate_hz());
    // A head begins at its start, prisms anywhere, on a motor, too.
    let prisms = motorised(Box::new(Mid40), params);
    assert_eq!((turned.cycle(), prisms.cycle()), (0, Mid40.cycle()));
    for number in (0..3_000_000).step_by(40_009) {
        let (a, b) = (still.pulse(number), turned.pulse(number));
        assert_eq!((a.time_s, a.ring), (b.time_s, b.ring));
        assert_eq!(turned.identity(number), still.identity(number));
        // The scanner's frame at that moment, turned back.
        let motor = DMat3::from_rotation_z(TAU * 0.5 * a.time_s) * DMat3::from_rotation_x(0.7);
        assert!((motor.transpose() * b.direction).distance(a.direction) < 1e-9);
        // The beam's section turns with the scanner.
        assert_eq!(still.up(a.time_s), DVec3::Z);
        assert!((motor.transpose() * turned.up(b.time_s)).distance(DVec3::Z) < 1e-9);
    }
    assert_eq!(
        turned.pulses(100, 50),
        (100..150).map(|i| turned.pulse(i)).collect::<Vec<_>>()
    );
}

/// Half a turn of the motor lays the head's plane over all directions, which the head alone does
/// not see: in cells of 10°, by azimuth and by height, so that all are equally large.
#[test]
fn a_handheld_mapper_sees_in_all_directions() {
    let cell = |pulse: &Pulse| {
        let d = pulse.direction;
        let azimuth = (d.y.atan2(d.x) + PI) / TAU;
        ((azimuth * 36.0) as u32, ((d.z + 1.0) * 0.5 * 18.0) as u32)
    };
    let seen = |pattern: &dyn ScanPattern, seconds: f64| {
        let count = (seconds * pattern.rate_hz()) as u32;
        let cells: BTreeSet<_> = pattern.pulses(0, count).iter().map(cell).collect();
        cells.len()
    };
    let mapper = Device::ZebHorizon;
    assert_eq!(seen(&*mapper.pattern(), 1.0), 36 * 18);
    assert!(seen(&*Device::Vlp16.pattern(), 1.0) < 36 * 18 / 2);
    // A tenth of a second is a slice of it.
    assert_eq!(
        mapper.params().pulses_per_scan,
        Device::Vlp16.params().pulses_per_scan
    );
    assert!(seen(&*mapper.pattern(), 0.1) < 36 * 18 / 2);
}

proptest! {
    #[test]
    fn no_pulse_leaves_the_cone(
        is_avia in any::<bool>(),
        turns_hz in 1e-6_f64..100.0,
        tilt_rad in 0.0_f64..PI,
        first in 0_u64..1_000_000_000,
    ) {
        let pattern: Box<dyn ScanPattern> = if is_avia { Box::new(Avia) } else { Box::new(Mid40) };
        let pattern = motorised(pattern, MotorParams { turns_hz, tilt_rad });
        let cone = pattern.field_of_view();
        for pulse in pattern.pulses(first, 2000) {
            prop_assert!(cone.contains(pulse.direction));
            prop_assert!((pulse.direction.length() - 1.0).abs() < 1e-9);
        }
    }
}

/// Looks up, within a tenth of a radian.
struct Up;

impl ScanPattern for Up {
    fn pulse(&self, number: u64) -> Pulse {
        Pulse {
            time_s: 1e-5 * number as f64,
            direction: DVec3::new(0.0, 0.1_f64.sin(), 0.1_f64.cos()),
            ring: 0,
        }
    }

    fn field_of_view(&self) -> DirectionCone {
        DirectionCone {
            axis: DVec3::Z,
            half_angle_rad: 0.1,
        }
    }
}

#[test]
fn a_cone_is_as_wide_as_the_tilt_and_the_scanner() {
    for (tilt_rad, axis, half_angle_rad) in [
        (0.0, DVec3::Z, 0.1),
        (0.3, DVec3::Z, 0.4),
        (PI - 0.3, DVec3::NEG_Z, 0.4),
    ] {
        let up = motorised(
            Box::new(Up),
            MotorParams {
                turns_hz: 1.0,
                tilt_rad,
            },
        );
        let cone = up.field_of_view();
        assert!(cone.axis.distance(axis) < 1e-12);
        assert!(
            (cone.half_angle_rad - half_angle_rad).abs() < 1e-5,
            "{tilt_rad}"
        );
        assert!(
            (0..100_000)
                .step_by(100)
                .all(|i| cone.contains(up.pulse(i).direction))
        );
    }
    // The scanner's x axis is ahead, so only its tilt to the side lifts it off the horizon.
    let ahead = motorised(
        Box::new(Mid40),
        MotorParams {
            turns_hz: 1.0,
            tilt_rad: 1.0,
        },
    );
    let cone = ahead.field_of_view();
    let widest = FRAC_PI_2 + Mid40.field_of_view().half_angle_rad;
    assert!(
        (cone.half_angle_rad - widest).abs() < 1e-5,
        "{}",
        cone.half_angle_rad
    );
}

#[test]
fn wrong_motors_are_refused_by_name() {
    let refused = |turns_hz, tilt_rad| {
        let motor = MotorisedPattern::new(head(), MotorParams { turns_hz, tilt_rad });
        motor.expect_err("out of range").field
    };
    for turns_hz in [0.0, -1.0, 1e3, f64::NAN] {
        assert_eq!(refused(turns_hz, 1.0), "turns_hz");
    }
    for tilt_rad in [-0.1, 4.0, f64::NAN] {
        assert_eq!(refused(0.5, tilt_rad), "tilt_rad");
    }
}
