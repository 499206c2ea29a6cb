//! How much more easily small disks find places in a sample.

use glam::DVec2;
use nemoral_seed::Key;

use super::params::LayerParams;
use crate::sampler::bridson::SamplePoint;
use crate::sampler::sizes::DiskSizes;

/// Small disks find more places than large ones. In a fill, the density of a hard core c over its
/// share among the darts falls like exp(−a c − b c²), the form of a disk's probability to find room
/// among others; a and b are fitted to the first two moments of the fill (maximum likelihood).
pub(super) struct SizeBias {
    theta: DVec2,
    norm: f64,
}

impl SizeBias {
    /// No bias: every size finds a place.
    pub(super) const NONE: Self = Self {
        theta: DVec2::ZERO,
        norm: 1.0,
    };

    pub(super) fn of(sizes: &DiskSizes, layer: &LayerParams, points: &[SamplePoint<Key>]) -> Self {
        let total: f64 = layer.varieties.iter().map(|v| v.weight).sum();
        let thrown: Vec<(f64, DVec2)> = (0..layer.varieties.len())
            .map(|i| (layer.varieties[i].weight / total, core_powers(sizes, i)))
            .collect();
        let found = points
            .iter()
            .map(|p| core_powers(sizes, usize::from(p.variety)))
            .sum::<DVec2>()
            / points.len().max(1) as f64;
        // Newton's method on a convex function, which halves steps that overshoot; the ridge
        // regularises the fit where there are fewer than three hard cores.
        const RIDGE: f64 = 1e-4;
        let norm_at = |theta: DVec2| -> f64 {
            thrown
                .iter()
                .map(|&(share, x)| share * libm::exp(-theta.dot(x)))
                .sum()
        };
        let loss = |theta: DVec2| {
            libm::log(norm_at(theta)) + theta.dot(found) + RIDGE / 2.0 * theta.length_squared()
        };
        let mut theta = DVec2::ZERO;
        for _ in 0..30 {
            let (mut sum, mut mean, mut square, mut cross) = (0.0, DVec2::ZERO, DVec2::ZERO, 0.0);
            for &(share, x) in &thrown {
                let w = share * libm::exp(-theta.dot(x));
                sum += w;
                mean += w * x;
                square += w * x * x;
                cross += w * x.x * x.y;
            }
            mean /= sum;
            let variance = square / sum - mean * mean + RIDGE;
            let covariance = cross / sum - mean.x * mean.y;
            let gradient = mean - found - RIDGE * theta;
            let determinant = variance.x * variance.y - covariance * covariance;
            let mut step = DVec2::new(
                variance.y * gradient.x - covariance * gradient.y,
                variance.x * gradient.y - covariance * gradient.x,
            ) / determinant;
            let here = loss(theta);
            // Where no step goes downhill any more, the minimum is found.
            let halved = (0..40).find(|_| {
                let better = loss(theta + step) < here;
                if !better {
                    step *= 0.5;
                }
                better
            });
            if halved.is_none() {
                break;
            }
            theta += step;
        }
        let norm = norm_at(theta);
        Self { theta, norm }
    }

    /// The density of a variety in the fill, over the fill's density and the variety's weight.
    pub(super) fn acceptance(&self, sizes: &DiskSizes, variety: usize) -> f64 {
        libm::exp(-self.theta.dot(core_powers(sizes, variety))) / self.norm
    }
}

/// The first two powers of a variety's hard core, from the mean and in its units.
fn core_powers(sizes: &DiskSizes, variety: usize) -> DVec2 {
    let x = sizes.typical_core(variety) / sizes.mean_core() - 1.0;
    DVec2::new(x, x * x)
}
