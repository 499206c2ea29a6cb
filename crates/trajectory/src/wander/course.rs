//! The guide line of a wander, and the curve of a block about it by the metres travelled.

use nemoral_scene::glam::DVec2;

use super::{BLOCK, BLOCK_M, KNOT_M};
use crate::Lanes;
use crate::lanes::GuidePlace;
use crate::spline::{CubicBSpline, gauss_legendre};

/// The part of a block over which the body changes its speed, at either end.
const RAMP: f64 = 0.15;

/// What a wander goes about.
#[derive(Debug)]
pub(super) enum Guide {
    Straight { start_m: DVec2, forward: DVec2 },
    Lanes(Lanes),
}

impl Guide {
    pub(super) fn at(&self, along_m: f64) -> GuidePlace {
        match self {
            Self::Straight { start_m, forward } => GuidePlace {
                position_m: *start_m + *forward * along_m,
                forward: *forward,
                curvature_per_m: 0.0,
            },
            Self::Lanes(lanes) => lanes.at(along_m),
        }
    }
}

/// The curve of a block: displacements about a guide line, from so many metres on it.
#[derive(Debug)]
pub(super) struct Course {
    pub(super) curve: CubicBSpline<[f64; BLOCK + 3]>,
    from_m: f64,
    /// How long the curve is up to each knot, metres.
    lengths_m: [f64; BLOCK + 1],
}

impl Course {
    pub(super) fn new(guide: &Guide, from_m: f64, curve: CubicBSpline<[f64; BLOCK + 3]>) -> Self {
        let mut this = Self {
            curve,
            from_m,
            lengths_m: [0.0; BLOCK + 1],
        };
        for knot in 0..BLOCK {
            this.lengths_m[knot + 1] = this.lengths_m[knot] + this.length_m(guide, knot, 1.0);
        }
        this
    }

    /// The length from a knot to `t` of the way to the next, metres.
    fn length_m(&self, guide: &Guide, knot: usize, t: f64) -> f64 {
        gauss_legendre(0.0, t, |t| self.speed_m(guide, knot as f64 + t))
    }

    /// The metres for each knot.
    fn speed_m(&self, guide: &Guide, x: f64) -> f64 {
        let curvature_per_m = guide.at(self.from_m + KNOT_M * x).curvature_per_m;
        let along_m = KNOT_M * (1.0 - curvature_per_m * self.curve.at(x));
        DVec2::new(along_m, self.curve.slope(x)).length()
    }

    /// The place, in knots from the block's first, after so many metres in the block.
    pub(super) fn knots_after(&self, guide: &Guide, travelled_m: f64) -> f64 {
        let longer_m = self.lengths_m[BLOCK] - BLOCK_M;
        let wanted_m = travelled_m + longer_m * plateau(travelled_m / BLOCK_M);
        let after = self.lengths_m[1..BLOCK].partition_point(|&length| length <= wanted_m);
        let rest_m = wanted_m - self.lengths_m[after];
        // Newton's method; the length is nearly straight in t.
        let mut t = rest_m / (self.lengths_m[after + 1] - self.lengths_m[after]);
        for _ in 0..6 {
            let x = after as f64 + t;
            t -= (self.length_m(guide, after, t) - rest_m) / self.speed_m(guide, x);
        }
        after as f64 + t
    }
}

/// From 0 to 1, even in the middle, with smooth ends.
fn plateau(x: f64) -> f64 {
    let height = 1.0 / (1.0 - RAMP);
    let ramp = |x: f64| {
        let u = x / RAMP;
        height * RAMP * u * u * u * (1.0 - 0.5 * u)
    };
    if x < RAMP {
        ramp(x)
    } else if x > 1.0 - RAMP {
        1.0 - ramp(1.0 - x)
    } else {
        height * (x - 0.5 * RAMP)
    }
}
