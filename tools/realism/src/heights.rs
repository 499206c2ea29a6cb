//! Scatter of trees' heights about their height curve.

use nemoral_assets::{Species, TreeSize};

/// The shape of the Weibull distribution of an even-aged stand's diameters.
const EVEN_AGED: f64 = 3.0;

/// Residuals of heights about the curve of the species' mean height over diameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightScatter {
    /// Mean height, metres.
    pub mean_m: f64,
    /// Standard deviation of the residuals, metres.
    pub sd_m: f64,
    /// Standard deviation of the residuals over the curve's height.
    pub sd_share: f64,
    /// The share of trees at a limit of their species' slenderness, to which they were clipped.
    pub clipped: f64,
}

impl HeightScatter {
    /// The scatter of trees of this species.
    #[must_use]
    pub fn of(species: &Species, sizes: &[TreeSize]) -> Self {
        let n = sizes.len() as f64;
        let mean = |of: &dyn Fn(&TreeSize) -> f64| sizes.iter().map(of).sum::<f64>() / n;
        let curve_m = |t: &TreeSize| species.mean_height_m(t.dbh_m);
        let deviation = |of: &dyn Fn(&TreeSize) -> f64| {
            let middle = mean(of);
            mean(&|t| (of(t) - middle).powi(2)).sqrt()
        };
        let [least, most] = species.allometry.slenderness;
        let clipped = |t: &TreeSize| {
            let slender = t.height_m / t.dbh_m;
            slender <= 1.001 * least || slender >= 0.999 * most
        };
        Self {
            mean_m: mean(&|t| t.height_m),
            sd_m: deviation(&|t| t.height_m - curve_m(t)),
            sd_share: deviation(&|t| t.height_m / curve_m(t)),
            clipped: mean(&|t| f64::from(u8::from(clipped(t)))),
        }
    }
}

/// The diameters of this many trees of an even-aged mature stand, metres, in ascending order; the
/// mean diameter is the least of the species' mature trees. Our scatter is a share of height and
/// that of published fits is in metres, so they are comparable only at the heights of those fits:
/// thin trees, of which the relations' even diameters have many, scatter by less and are clipped by
/// the limits of slenderness.
#[must_use]
pub fn stand_diameters(species: &Species, trees: u32) -> Vec<f64> {
    let al = &species.allometry;
    let rank = |i: u32| (f64::from(i) + 0.5) / f64::from(trees);
    let of_rank = |i| species.dbh_of_rank(al.class_dbh_m[1], EVEN_AGED, al.dbh_range_m, rank(i));
    (0..trees).map(of_rank).collect()
}
