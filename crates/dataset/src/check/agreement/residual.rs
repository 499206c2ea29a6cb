//! How far points lie behind the surfaces of their pixels.

use super::view::{Pixel, on_a_surface};
use crate::PlyPoint;

/// The median of a residual is judged if it comes from at least this many points, and must not
/// exceed [`MOST_RESIDUAL_M`].
const ENOUGH_RESIDUALS: usize = 100;
const MOST_RESIDUAL_M: f64 = 0.02;
/// Residuals are counted up to this, metres …
const GREATEST_RESIDUAL_M: f64 = 0.5;
/// … in steps of a twentieth of a millimetre. Zero, the limit of what is allowed, and the limits
/// of what rounds to the same tenth of a millimetre lie between two steps, so that a median is
/// judged and printed as if all residuals were kept.
const STEPS_PER_M: f64 = 20_000.0;
/// The number of the step that begins at 0.
const STEP_OF_ZERO: usize = (GREATEST_RESIDUAL_M * STEPS_PER_M) as usize;

/// A depth residual.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Residual {
    /// How many residuals within half a metre each step has, from the lowest on; empty without
    /// any.
    counts: Vec<u64>,
}

impl Residual {
    /// The number of points in it.
    #[must_use]
    pub fn points(&self) -> usize {
        self.counts.iter().sum::<u64>() as usize
    }

    /// The median within a fortieth of a millimetre, metres; `None` without points.
    #[must_use]
    pub fn median_m(&self) -> Option<f64> {
        let middle = self.counts.iter().sum::<u64>() / 2;
        let mut below = 0;
        let step = self.counts.iter().position(|count| {
            below += count;
            below > middle
        })?;
        // The middle of the step.
        Some((step as f64 - STEP_OF_ZERO as f64 + 0.5) / STEPS_PER_M)
    }

    pub(super) fn failure(&self, what: &str) -> Option<String> {
        let median = self.median_m()?;
        (self.points() >= ENOUGH_RESIDUALS && median.abs() > MOST_RESIDUAL_M).then(|| {
            format!(
                "{what}: points lie {:.1} cm behind their pixels (median), at most {:.0} cm are \
                 allowed",
                100.0 * median,
                100.0 * MOST_RESIDUAL_M
            )
        })
    }

    pub(super) fn add(&mut self, p: &PlyPoint, pixel: &Pixel) {
        let facing = p.point.incidence_cos >= 0.7 && on_a_surface(p);
        let smooth = pixel.filled && pixel.spread_m <= 0.1;
        if facing && smooth {
            self.count(pixel.difference_m);
        }
    }

    /// Counts a residual that is small enough.
    fn count(&mut self, residual_m: f64) {
        if residual_m.abs() <= GREATEST_RESIDUAL_M {
            let step = (residual_m * STEPS_PER_M).floor() + STEP_OF_ZERO as f64;
            self.counts.resize(2 * STEP_OF_ZERO + 1, 0);
            self.counts[step as usize] += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_judged_and_printed_as_the_exact_one() {
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for middle_m in [-0.31, -0.02, -4e-4, -2e-5, 0.0, 3e-5, 1e-3, 0.02, 0.49] {
            for width_m in [1e-5, 1e-3, 0.2] {
                let values: Vec<f64> = (0..501).map(|_| middle_m + width_m * noise()).collect();
                let mut residual = Residual::default();
                values.iter().for_each(|&value| residual.count(value));
                let mut kept: Vec<f64> = values.into_iter().filter(|v| v.abs() <= 0.5).collect();
                kept.sort_by(f64::total_cmp);
                assert_eq!(residual.points(), kept.len());
                let (exact, found) = (kept[kept.len() / 2], residual.median_m());
                let found = found.expect("some are kept");
                assert!((found - exact).abs() <= 2.5e-5 + 1e-12, "{found} {exact}");
                let printed = |m: f64| format!("{:+.2} cm, {:.1} cm", 100.0 * m, 100.0 * m);
                assert_eq!(printed(found), printed(exact));
                assert_eq!(found.abs() > MOST_RESIDUAL_M, exact.abs() > MOST_RESIDUAL_M);
            }
        }
        assert_eq!(Residual::default().median_m(), None);
        let mut ends = Residual::default();
        for residual_m in [-0.5, 0.5, 0.500_001, f64::NAN] {
            ends.count(residual_m);
        }
        assert_eq!(ends.points(), 2);
    }
}
