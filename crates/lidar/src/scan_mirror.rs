//! Scan mirrors of airborne scanners, which look down.

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2, TAU};

use nemoral_scene::DirectionCone;
use nemoral_scene::glam::DVec3;

use crate::pattern::turned;
use crate::{ParamError, Pulse, ScanPattern};

/// How a scan mirror moves the beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MirrorMotion {
    /// A single facet at 45° to its axis, which lies along x: the beam turns through the full
    /// circle at a constant rate, from right over down to left (RIEGL VUX-1).
    Rotating,
    /// A polygon with several facets: each sweeps the beam from right to left at a constant rate
    /// (RIEGL LMS-Q780, VQ-780i).
    Polygon {
        /// The part of a sweep in which pulses are measured, greater than 0, at most 1. At the
        /// edges of a facet the beam is cut, and the housing hides it: 2/3 of the VQ-1560i's pulses
        /// are measured, by its data sheet.
        duty: f64,
    },
    /// An oscillating mirror whose angle is a sine of time (Leica ALS50): lines are denser at the
    /// edges.
    Sine,
    /// An oscillating mirror that turns back at once, so that its angle is a triangle wave.
    Triangle,
    /// A Palmer scanner: all pulses are at the half angle to straight down.
    Cone,
    /// A nutating mirror, which wobbles about an axis at 45° to the beam: nearly an ellipse, which
    /// has the half angle across the flight and about 1/√2 of it along (RIEGL VQ-840-G: ±20° and
    /// ±14°).
    Nutating,
}

/// Parameters of a [`ScanMirror`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanMirrorParams {
    /// How the beam moves.
    pub motion: MirrorMotion,
    /// Pulses that the laser fires in a second, measured or not, 1 to 10,000,000.
    pub rate_hz: u32,
    /// Lines per second, 1 to 1,000, and so few that each has a pulse: turns of a rotating mirror,
    /// facets of a polygon, turns of a cone or of a nutation. An oscillating mirror swings to the
    /// left and back to the right in one.
    pub lines_hz: u32,
    /// The greatest angle to straight down at which pulses are measured, radians, greater than 0,
    /// at most π/2; at most π for a rotating mirror.
    pub half_angle_rad: f64,
}

impl Default for ScanMirrorParams {
    /// A RIEGL VUX-1UAV at its fastest, of which 90° are used.
    fn default() -> Self {
        Self {
            motion: MirrorMotion::Rotating,
            rate_hz: 550_000,
            lines_hz: 100,
            half_angle_rad: PI / 4.0,
        }
    }
}

/// A scan mirror over the ground: it moves the beam across the flight, which the platform carries
/// on.
///
/// It looks down by itself: x is the flight's direction, y is left, and a beam at an angle θ to
/// the left of straight down is (0, sin θ, −cos θ). These are the beam deflectors of HELIOS++
/// (Winiwarter et al. 2022) with the nutating mirror besides; Wehr and Lohr 1999 compare them.
///
/// Pulses that cannot be measured have no number: after the last pulse of a line, times jump to
/// the first of the next one. The lines of a rotating mirror and of a polygon are all alike, as if
/// the laser were in step with the mirror: their pulses are at equal angles, symmetric about
/// straight down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanMirror {
    params: ScanMirrorParams,
    path: Path,
}

/// How pulses follow each other, with the numbers that all of them share.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Path {
    /// From right to left at equal steps, and a pause.
    Sweep { pulses: u64, step_rad: f64 },
    /// Without a pause.
    Cycle(Cycle),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Cycle {
    /// Across, by a sine of this size, radians.
    Sine(f64),
    /// Across, by a triangle wave of this size, radians.
    Triangle(f64),
    /// Around, with the half angle's sine and cosine.
    Cone(f64, f64),
    /// Around, with the sine and cosine of the mirror's tilt.
    Nutation(f64, f64),
}

/// Keeps directions at the half angle within the field of view after rounding, radians.
const ROUNDING_RAD: f64 = 1e-7;

impl ScanMirror {
    /// The pattern with these parameters.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: ScanMirrorParams) -> Result<Self, ParamError> {
        let p = &params;
        ParamError::check(
            (1..=10_000_000).contains(&p.rate_hz),
            "rate_hz",
            p.rate_hz,
            "1..=10,000,000",
        )?;
        ParamError::check(
            (1..=1000).contains(&p.lines_hz),
            "lines_hz",
            p.lines_hz,
            "1..=1,000",
        )?;
        let (widest_rad, allowed) = match p.motion {
            MirrorMotion::Rotating => (PI, "greater than 0 and at most π"),
            _ => (FRAC_PI_2, "greater than 0 and at most π/2"),
        };
        let half_rad = p.half_angle_rad;
        ParamError::check(
            half_rad > 0.0 && half_rad <= widest_rad,
            "half_angle_rad",
            half_rad,
            allowed,
        )?;
        if let MirrorMotion::Polygon { duty } = p.motion {
            let is_share = duty > 0.0 && duty <= 1.0;
            ParamError::check(is_share, "duty", duty, "greater than 0 and at most 1")?;
        }
        let per_line = p.used_share() * f64::from(p.rate_hz) / f64::from(p.lines_hz);
        // Even if this is rounded up, the outermost pulses are half a step within the half angle.
        let pulses = per_line.round();
        ParamError::check(
            pulses >= 1.0 && p.lines_hz <= p.rate_hz,
            "lines_hz",
            p.lines_hz,
            "so few that a line has a pulse",
        )?;
        let path = match p.motion {
            MirrorMotion::Rotating | MirrorMotion::Polygon { .. } => Path::Sweep {
                pulses: pulses as u64,
                step_rad: 2.0 * half_rad / per_line,
            },
            MirrorMotion::Sine => Path::Cycle(Cycle::Sine(half_rad)),
            MirrorMotion::Triangle => Path::Cycle(Cycle::Triangle(half_rad)),
            MirrorMotion::Cone => {
                let (sin, cos) = libm::sincos(half_rad);
                Path::Cycle(Cycle::Cone(sin, cos))
            }
            MirrorMotion::Nutating => {
                // A mirror turns the beam by twice its own angle.
                let (sin, cos) = libm::sincos(0.5 * half_rad);
                Path::Cycle(Cycle::Nutation(sin, cos))
            }
        };
        Ok(Self { params, path })
    }

    /// The parameters.
    #[must_use]
    pub fn params(&self) -> &ScanMirrorParams {
        &self.params
    }
}

impl ScanMirrorParams {
    /// The part of the time in which pulses are measured.
    fn used_share(&self) -> f64 {
        match self.motion {
            MirrorMotion::Rotating => self.half_angle_rad / PI,
            MirrorMotion::Polygon { duty } => duty,
            _ => 1.0,
        }
    }
}

impl Cycle {
    /// The direction after a part of the cycle, 0..1.
    fn direction(self, part: f64) -> DVec3 {
        let (sin, cos) = libm::sincos(TAU * part);
        match self {
            Self::Sine(size_rad) => across(size_rad * sin),
            Self::Triangle(size_rad) => across(size_rad * triangle(part)),
            Self::Cone(sideways, down) => DVec3::new(sideways * cos, sideways * sin, -down),
            Self::Nutation(tilt, along) => {
                // The beam comes along y and is mirrored by d − 2 (d · n) n. The mirror's axis is
                // (0, 1, 1) / √2; its normal n is tilted from there, first to the right, which
                // sends the beam to the left, and goes around as on a cone.
                let onto = along - tilt * cos;
                let up = along + tilt * cos;
                DVec3::new(-SQRT_2 * onto * tilt * sin, 1.0 - onto * onto, -onto * up)
            }
        }
    }
}

/// The direction at an angle to the left of straight down.
fn across(left_rad: f64) -> DVec3 {
    let (sin, cos) = libm::sincos(left_rad);
    DVec3::new(0.0, sin, -cos)
}

/// A wave of straight lines that is 0 at 0, 1 at 1/4 and −1 at 3/4, like the sine.
fn triangle(part: f64) -> f64 {
    match part {
        p if p < 0.25 => 4.0 * p,
        p if p < 0.75 => 2.0 - 4.0 * p,
        p => 4.0 * p - 4.0,
    }
}

/// `ticks` of which a second has `per_s`, in seconds. Whole seconds are taken out in integers.
fn seconds(ticks: u128, per_s: u64) -> f64 {
    let per = u128::from(per_s);
    (ticks / per) as f64 + (ticks % per) as f64 / per_s as f64
}

impl ScanPattern for ScanMirror {
    fn pulse(&self, number: u64) -> Pulse {
        let (rate, lines) = (self.params.rate_hz.into(), self.params.lines_hz.into());
        let (time_s, direction) = match self.path {
            Path::Sweep { pulses, step_rad } => {
                let (line, place) = (number / pulses, number % pulses);
                let ticks = u128::from(line) * u128::from(rate) + u128::from(place * lines);
                let steps = place as f64 - 0.5 * (pulses - 1) as f64;
                (seconds(ticks, rate * lines), across(steps * step_rad))
            }
            Path::Cycle(cycle) => (
                seconds(number.into(), rate),
                cycle.direction(turned(number, lines, rate)),
            ),
        };
        Pulse {
            time_s,
            direction,
            ring: 0,
        }
    }

    fn field_of_view(&self) -> DirectionCone {
        DirectionCone {
            axis: DVec3::NEG_Z,
            half_angle_rad: (self.params.half_angle_rad + ROUNDING_RAD).min(PI),
        }
    }

    fn rate_hz(&self) -> f64 {
        match self.path {
            Path::Sweep { pulses, .. } => (pulses * u64::from(self.params.lines_hz)) as f64,
            Path::Cycle(_) => self.params.rate_hz.into(),
        }
    }

    fn pause_s(&self) -> f64 {
        match self.path {
            Path::Sweep { pulses, .. } => {
                let (rate, line) = (self.params.rate_hz, f64::from(self.params.lines_hz).recip());
                (line - pulses as f64 / f64::from(rate)).max(0.0)
            }
            Path::Cycle(_) => 0.0,
        }
    }
}
