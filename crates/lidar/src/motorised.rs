//! Scanners that a motor turns.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt;

use nemoral_scene::DirectionCone;
use nemoral_scene::glam::{DMat3, DVec3};

use crate::{ParamError, Pulse, ScanPattern};

/// How a motor turns a scanner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorParams {
    /// Turns per second, counterclockwise from above, above 0, at most 100.
    pub turns_hz: f64,
    /// The angle from the motor's axis to the scanner's own z axis, which leans to the right at the
    /// start, radians, 0 to π.
    pub tilt_rad: f64,
}

impl Default for MotorParams {
    /// Half a turn a second, nearly, of a scanner that lies on its side, as on handheld mappers.
    /// Heads of 5, 10 or 20 Hz do not turn a whole number of times in that, so that the lines of
    /// one turn are not those of the next.
    fn default() -> Self {
        Self {
            turns_hz: 0.497,
            tilt_rad: FRAC_PI_2,
        }
    }
}

/// A scanner on a motor, as on handheld and backpack mappers: a pattern of which the motor turns
/// the frame about the z axis of the LiDAR frame, which itself is that of the handle.
///
/// A head of few lines so sees in nearly all directions.
pub struct MotorisedPattern {
    pattern: Box<dyn ScanPattern>,
    params: MotorParams,
    /// The frame of the handle from that of the scanner, when the motor is at its start.
    tilted: DMat3,
}

impl fmt::Debug for MotorisedPattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MotorisedPattern")
            .field("params", &self.params)
            .finish_non_exhaustive()
    }
}

impl MotorisedPattern {
    /// A pattern on a motor.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(pattern: Box<dyn ScanPattern>, params: MotorParams) -> Result<Self, ParamError> {
        let (turns, tilt) = (params.turns_hz, params.tilt_rad);
        let is_turning = turns > 0.0 && turns <= 100.0;
        ParamError::check(is_turning, "turns_hz", turns, "above 0, at most 100")?;
        ParamError::check_range("tilt_rad", tilt, 0.0..=PI, "0 to π")?;
        let (sin, cos) = libm::sincos(tilt);
        let tilted = DMat3::from_cols(
            DVec3::X,
            DVec3::new(0.0, cos, sin),
            DVec3::new(0.0, -sin, cos),
        );
        Ok(Self {
            pattern,
            params,
            tilted,
        })
    }

    /// A direction of the scanner's frame in that of the handle.
    fn turned(&self, direction: DVec3, time_s: f64) -> DVec3 {
        // Whole turns are removed before they are radians.
        let turns = time_s * self.params.turns_hz;
        let (sin, cos) = libm::sincos(TAU * (turns - turns.floor()));
        let d = self.tilted * direction;
        DVec3::new(cos * d.x - sin * d.y, sin * d.x + cos * d.y, d.z)
    }

    fn fired(&self, pulse: Pulse) -> Pulse {
        Pulse {
            direction: self.turned(pulse.direction, pulse.time_s),
            ..pulse
        }
    }
}

impl ScanPattern for MotorisedPattern {
    fn pulse(&self, number: u64) -> Pulse {
        self.fired(self.pattern.pulse(number))
    }

    fn pulses(&self, first: u64, count: u32) -> Vec<Pulse> {
        let mut pulses = self.pattern.pulses(first, count);
        for pulse in &mut pulses {
            *pulse = self.fired(*pulse);
        }
        pulses
    }

    fn identity(&self, number: u64) -> u64 {
        self.pattern.identity(number)
    }

    fn up(&self, time_s: f64) -> DVec3 {
        self.turned(self.pattern.up(time_s), time_s)
    }

    fn field_of_view(&self) -> DirectionCone {
        let seen = self.pattern.field_of_view();
        // The nearer end of the axis has the smaller cone around it.
        let to_axis_rad = (self.tilted * seen.axis).angle_between(DVec3::Z);
        let (axis, to_axis_rad) = if to_axis_rad <= FRAC_PI_2 {
            (DVec3::Z, to_axis_rad)
        } else {
            (DVec3::NEG_Z, PI - to_axis_rad)
        };
        let half_angle_rad = to_axis_rad + seen.half_angle_rad + ROUNDING_RAD;
        if half_angle_rad >= PI {
            return DirectionCone::ALL;
        }
        DirectionCone {
            axis,
            half_angle_rad,
        }
    }

    fn rate_hz(&self) -> f64 {
        self.pattern.rate_hz()
    }

    /// That of the pattern itself.
    fn cycle(&self) -> u64 {
        self.pattern.cycle()
    }

    fn pause_s(&self) -> f64 {
        self.pattern.pause_s()
    }
}

/// More than an angle between unit vectors is off by rounding.
const ROUNDING_RAD: f64 = 1e-6;
