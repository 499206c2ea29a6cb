//! Scan patterns: the directions and the times of a scanner's pulses.

use nemoral_scene::DirectionCone;
use nemoral_scene::glam::DVec3;

/// One pulse of a laser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// When it is fired, seconds after the start of the pattern; exact to a nanosecond for three
    /// weeks.
    pub time_s: f64,
    /// Its direction: a unit vector in the LiDAR frame (x forward, y left, z up).
    pub direction: DVec3,
    /// The laser line or ring that fires it, from 0.
    pub ring: u8,
}

/// An endless sequence of pulses.
///
/// A pattern is a pure function of the pulse's number, so a scan can start anywhere in it, and
/// pulse times never decrease. Any `Fn(u64) -> Pulse` is a pattern.
pub trait ScanPattern: Send + Sync {
    /// The pulse with this number; number 0 is fired at time 0.
    fn pulse(&self, number: u64) -> Pulse;

    /// The `count` pulses from `first` on. Patterns whose pulses share work override this; each
    /// pulse must be what [`pulse`](Self::pulse) returns, to the bit.
    fn pulses(&self, first: u64, count: u32) -> Vec<Pulse> {
        let number = |i: u32| first.wrapping_add(i.into());
        (0..count).map(|i| self.pulse(number(i))).collect()
    }

    /// A number that keys a pulse's randomness and is different for every pulse: the pulse's
    /// number, unless the pattern has an identity for it that stays the same when a laser is added.
    fn identity(&self, number: u64) -> u64 {
        number
    }

    /// The z axis of the scanner itself, in the LiDAR frame, at the time of a pulse: the vertical
    /// width of the beam lies along it. By default it is that of the frame.
    fn up(&self, _time_s: f64) -> DVec3 {
        DVec3::Z
    }

    /// A cone in the LiDAR frame that contains the directions of all pulses: by default that of all
    /// directions.
    fn field_of_view(&self) -> DirectionCone {
        DirectionCone::ALL
    }

    /// Pulses per second, on average: by default that of the first million.
    fn rate_hz(&self) -> f64 {
        let many = 1 << 20;
        many as f64 / self.pulse(many).time_s
    }

    /// How many pulses it takes until directions repeat, of a scanner that begins anywhere in its
    /// figure when it is switched on. By default it is 0: the scanner begins at a set place, or is
    /// turned there.
    fn cycle(&self) -> u64 {
        0
    }

    /// The longest pause between pulses, beyond their usual interval, seconds: so much later than
    /// by the mean rate may the last pulse of a scan be fired. By default there is none.
    fn pause_s(&self) -> f64 {
        0.0
    }
}

impl<F: Fn(u64) -> Pulse + Send + Sync> ScanPattern for F {
    fn pulse(&self, number: u64) -> Pulse {
        self(number)
    }
}

/// The unit vector at an azimuth (from x towards y) and an elevation (from the xy plane towards z).
pub(crate) fn direction(azimuth_rad: f64, elevation_rad: f64) -> DVec3 {
    sloped(azimuth_rad, libm::sincos(elevation_rad))
}

/// The same vector, given the elevation's sine and cosine.
pub(crate) fn sloped(azimuth_rad: f64, (sin_el, cos_el): (f64, f64)) -> DVec3 {
    let (sin_az, cos_az) = libm::sincos(azimuth_rad);
    DVec3::new(cos_el * cos_az, cos_el * sin_az, sin_el)
}

/// The part of a turn, 0..1, after `ticks` of a rotor that makes `turns` turns in `per` ticks.
///
/// Whole turns are removed in integers, so the phase is as exact after a year as in the first
/// second.
pub(crate) fn turned(ticks: u64, turns: u64, per: u64) -> f64 {
    let rest = match ticks.checked_mul(turns) {
        Some(all) => all % per,
        None => (u128::from(ticks) * u128::from(turns) % u128::from(per)) as u64,
    };
    rest as f64 / per as f64
}

/// Sine and cosine of that part of a turn, after a phase.
pub(crate) fn rotor(ticks: u64, turns: u64, per: u64, phase_rad: f64) -> (f64, f64) {
    libm::sincos(std::f64::consts::TAU * turned(ticks, turns, per) + phase_rad)
}

/// The pulses from `first` on of lasers that fire together, `lasers` at each shot: `shot` computes
/// what they share, `pulse` the rest.
pub(crate) fn together<S>(
    (first, count): (u64, u32),
    lasers: u64,
    shot: impl Fn(u64) -> S,
    pulse: impl Fn(&S, u64, u64) -> Pulse,
) -> Vec<Pulse> {
    let mut last = None;
    let each = |i: u32| {
        let number = first.wrapping_add(i.into());
        let (at, laser) = (number / lasers, number % lasers);
        let shared = match last.take() {
            Some((fired, shared)) if fired == at => shared,
            _ => shot(at),
        };
        let pulse = pulse(&shared, at, laser);
        last = Some((at, shared));
        pulse
    };
    (0..count).map(each).collect()
}
