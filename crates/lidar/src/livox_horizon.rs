//! A scanner like the Livox Horizon: three rotors, six lines.

use nemoral_scene::DirectionCone;
use nemoral_scene::glam::{DVec2, DVec3};

use crate::pattern::{rotor, together};
use crate::{Pulse, ScanPattern};

/// The paper's "non-repeating, rectangular field of view": 82° × 28° like the Livox Horizon's.
///
/// Livox publishes no formula for the Horizon. This is a model of three rotors in the plane of
/// direction cosines (two that turn against each other in lock make the horizontal sweep, a slow
/// third moves it), fitted to the 0.1 s figure in Livox's documentation (median line distance about
/// 0.1°) and to its curve of coverage over time (within 3 percentage points). It reaches ±41.1° and
/// ±13.8°; the data sheet says ±40.85° and ±12.55°, the figure ±14°. Six lines fire together 40,000
/// times a second. The figure closes after 50 s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LivoxHorizonLike;

const LINES: u64 = 6;
const SHOTS_HZ: u64 = 40_000;
/// Distance between the lines, direction cosine (0.87°).
const LINE_STEP: f64 = 0.01524;

/// One rotor: turns per 100 s, radius in direction cosines, phase.
struct Rotor {
    centihertz: u64,
    radius: f64,
    phase_rad: f64,
}

const FORWARD: Rotor = Rotor {
    centihertz: 11_886,
    radius: 0.2427,
    phase_rad: 3.15,
};
const BACKWARD: Rotor = Rotor {
    centihertz: 11_886,
    radius: 0.2283,
    phase_rad: 3.144,
};
const SLOW: Rotor = Rotor {
    centihertz: 1012,
    radius: 0.1855,
    phase_rad: 2.4576,
};

impl Rotor {
    fn at(&self, shot: u64) -> DVec2 {
        let (sin, cos) = rotor(shot, self.centihertz, 100 * SHOTS_HZ, self.phase_rad);
        self.radius * DVec2::new(cos, sin)
    }
}

/// The middle of the six lines.
fn middle(shot: u64) -> DVec2 {
    let back = BACKWARD.at(shot);
    FORWARD.at(shot) + DVec2::new(back.x, -back.y) + SLOW.at(shot)
}

fn pulse(middle: &DVec2, shot: u64, line: u64) -> Pulse {
    let mut hv = *middle;
    hv.y += LINE_STEP * (line as f64 - 2.5);
    Pulse {
        time_s: shot as f64 / SHOTS_HZ as f64,
        direction: DVec3::new((1.0 - hv.length_squared()).sqrt(), hv.x, hv.y),
        ring: line as u8,
    }
}

impl ScanPattern for LivoxHorizonLike {
    fn pulse(&self, number: u64) -> Pulse {
        let shot = number / LINES;
        pulse(&middle(shot), shot, number % LINES)
    }

    fn pulses(&self, first: u64, count: u32) -> Vec<Pulse> {
        together((first, count), LINES, middle, pulse)
    }

    fn field_of_view(&self) -> DirectionCone {
        // All rotors aligned, and the outermost line on their side.
        let widest = FORWARD.radius + BACKWARD.radius + SLOW.radius + 2.5 * LINE_STEP;
        DirectionCone {
            axis: DVec3::X,
            half_angle_rad: libm::asin(widest),
        }
    }

    fn rate_hz(&self) -> f64 {
        (LINES * SHOTS_HZ) as f64
    }

    /// The shots of 50 s, as the rotors make even numbers of turns in 100 s.
    fn cycle(&self) -> u64 {
        50 * SHOTS_HZ * LINES
    }
}
