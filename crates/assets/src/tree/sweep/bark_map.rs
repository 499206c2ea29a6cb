//! How bark is mapped to an axis.

use std::f64::consts::TAU;

use nemoral_seed::{Domain, Draw};

use super::rings::Ring;
use super::tube::Tube;

const BARK: Domain = Domain::new("assets.tree.bark");

/// The size of one repetition of bark on stems of 0.2 to 0.8 m, metres: across and along.
const TILE_M: [f64; 2] = [1.0, 2.0];
/// Least and most of the spiral grain: u per v.
const SPIRAL: [f64; 2] = [0.17, 0.24];

/// Which of the species' barks a piece of a stem has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Zone {
    Lower,
    Change,
    Upper,
}

/// How bark is mapped to an axis: a whole number of repetitions around it, and the picture's
/// proportions along it. On a stem v is 0 at the ground, so that moss is at the foot, and the lower
/// bark turns into the upper one within one repetition of the picture.
pub(super) struct BarkMap {
    pub(super) wraps: f64,
    pub(super) u0: f64,
    pub(super) v0: f64,
    /// u per v: a spiral grain of 5 to 7 degrees. Without it one picture would repeat straight
    /// above itself.
    pub(super) spiral: f64,
    /// v per metre.
    pub(super) per_m: f64,
    /// v where the change of bark begins; a whole number.
    change: f64,
    is_stem: bool,
}

impl BarkMap {
    pub(super) fn new(tube: &Tube<'_>, rings: &[Ring]) -> Self {
        let is_stem = tube.axis.order == 0;
        let reference = rings[if is_stem { rings.len() / 3 } else { 0 }].radius;
        let around = TAU * reference;
        // With three repetitions around the stem, two would be visible at once.
        let wraps = (around / TILE_M[0]).round().clamp(1.0, 2.0);
        // The bark of thin wood is finer and that of old trees coarser, so the picture keeps its
        // proportions within these limits.
        let finer = (wraps * TILE_M[0] / around).clamp(0.4, 4.0);
        let per_m = finer / TILE_M[1];
        let mut rng = tube.axis.key.domain(BARK).rng();
        let (mut u0, mut v0) = (0.0, rng.unit_f64());
        let side = if rng.chance(0.5) { 1.0 } else { -1.0 };
        let spiral = side * rng.range_f64(SPIRAL[0], SPIRAL[1]);
        if is_stem {
            u0 = v0;
            v0 = rings[0].centre.z * per_m;
        }
        Self {
            wraps,
            u0,
            v0,
            spiral,
            per_m,
            change: (tube.upper_from_m * per_m).round(),
            is_stem,
        }
    }

    pub(super) fn zone(&self, v: f64) -> Zone {
        if !self.is_stem || v >= self.change + 1.0 {
            Zone::Upper
        } else if v >= self.change {
            Zone::Change
        } else {
            Zone::Lower
        }
    }

    /// The rings, with two more on a stem where the zones meet.
    pub(super) fn with_borders(&self, rings: &[Ring]) -> Vec<Ring> {
        let mut out = vec![rings[0]];
        let mut v = self.v0;
        for pair in rings.windows(2) {
            let next = v + pair[1].centre.distance(pair[0].centre) * self.per_m;
            for border in [self.change, self.change + 1.0] {
                let t = (border - v) / (next - v).max(1e-12);
                if self.is_stem && t > 1e-3 && t < 1.0 - 1e-3 {
                    out.push(Ring {
                        centre: pair[0].centre.lerp(pair[1].centre, t),
                        radius: pair[0].radius + (pair[1].radius - pair[0].radius) * t,
                    });
                }
            }
            out.push(pair[1]);
            v = next;
        }
        out
    }
}
