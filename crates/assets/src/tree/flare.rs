//! Root flares: stems widen towards the ground in lobes, which large roots go on from.

use std::f64::consts::{PI, TAU};

use nemoral_seed::{Domain, Draw, Key};
use serde::{Deserialize, Serialize};

use super::skeleton::BREAST_M;
use super::{StemForm, TreeSize};

const FLARE: Domain = Domain::new("assets.tree.flare");

/// A lobe of a root flare.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlareLobe {
    /// Where it is around the stem, from +x towards +y, radians.
    pub azimuth_rad: f64,
    /// What it adds to the stem's radius at the ground, as a share of it.
    pub share: f64,
    /// Its distance from the middle of the stem at the ground, metres.
    pub radius_m: f64,
}

/// The lobes of a root flare.
#[derive(Clone, Debug)]
pub(super) struct Flare {
    /// Azimuth and height (share of the radius) of each lobe.
    lobes: Vec<[f64; 2]>,
    /// Height over which they fade by e.
    fade_m: f64,
}

impl Flare {
    pub(super) fn new(stem: &StemForm, size: &TreeSize, key: Key) -> Self {
        let mut rng = key.domain(FLARE).rng();
        let n = rng.between(stem.flare_lobes[0], stem.flare_lobes[1]);
        let first = rng.range_f64(0.0, TAU);
        let lobes = (0..n).map(|k| {
            [
                first + TAU * (f64::from(k) + rng.range_f64(-0.2, 0.2)) / f64::from(n),
                rng.range_f64(stem.flare[0], stem.flare[1]),
            ]
        });
        Self {
            lobes: lobes.collect(),
            fade_m: 0.35 * (size.dbh_m / 0.3).sqrt().clamp(0.4, 1.6),
        }
    }

    /// The lobes of a stem that has this radius at the ground without them, metres.
    pub(super) fn lobes(&self, radius_m: f64) -> Vec<FlareLobe> {
        let lobe = |&[azimuth_rad, share]: &[f64; 2]| FlareLobe {
            azimuth_rad,
            share,
            radius_m: radius_m * (1.0 + share),
        };
        self.lobes.iter().map(lobe).collect()
    }

    /// The factor on the radius at an azimuth and a height. From breast height up the mean radius
    /// does not change: what the lobes add there is subtracted evenly all around.
    pub(super) fn factor(&self, azimuth: f64, z: f64) -> f64 {
        self.raw(azimuth, z) / self.mean(z.max(BREAST_M))
    }

    /// Mean radius over azimuth, without the correction.
    fn mean(&self, z: f64) -> f64 {
        let half_width = PI / self.lobes.len() as f64;
        1.0 + self.lobes.iter().map(|l| l[1]).sum::<f64>() * half_width / TAU * self.fade(z)
    }

    fn raw(&self, azimuth: f64, z: f64) -> f64 {
        let half_width = PI / self.lobes.len() as f64;
        let bumps: f64 = self
            .lobes
            .iter()
            .map(|&[at, height]| {
                let off = azimuth - at;
                let off = off - TAU * (off / TAU).round();
                let c = if off.abs() < half_width {
                    libm::cos(0.5 * PI * off / half_width)
                } else {
                    0.0
                };
                height * c * c
            })
            .sum();
        1.0 + bumps * self.fade(z)
    }

    /// The fading of the lobes with height. Below the ground, roots go on spreading.
    fn fade(&self, z: f64) -> f64 {
        if z < 0.0 {
            1.0 - z
        } else {
            libm::exp(-z / self.fade_m)
        }
    }

    /// The height at which the lobes have faded to at most a twentieth of the radius.
    pub(super) fn top_m(&self) -> f64 {
        let most = self.lobes.iter().fold(0.0_f64, |m, l| m.max(l[1]));
        self.fade_m * libm::log((most / 0.05).max(1.1))
    }

    /// The greatest factor at the ground.
    pub(super) fn greatest(&self) -> f64 {
        1.0 + self.lobes.iter().fold(0.0_f64, |m, l| m.max(l[1]))
    }
}
