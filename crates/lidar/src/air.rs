//! The air that pulses pass: it weakens echoes, and fog has echoes of its own.
//!
//! Extinction decreases with height in two layers, haze and fog. Light that goes to a surface and
//! back is weakened by `e^(−2τ)`, where `τ` is the extinction along the path (Beer and Lambert).

mod backscatter;
mod params;

use nemoral_scene::Hydrometeor;
use nemoral_scene::glam::DVec3;
use nemoral_seed::{Domain, Key};

pub use self::params::{AirLayer, AirParams};

use self::backscatter::{OVERLAP_TO_M, Piece};
use crate::beam::Beam;
use crate::echo::AirEcho;
use crate::exponential::exp;
use crate::precipitation::Precipitation;

/// The air of a scanner.
#[derive(Clone, Debug)]
pub(crate) struct Air {
    params: AirParams,
    /// By range.
    pieces: Vec<Piece>,
    /// The greatest `geometry`.
    most: f64,
    /// The weakest power that is seen.
    weakest: f64,
    /// The extinction of rain and snowfall, per metre.
    falling_per_m: f64,
    /// What of rain and of snowfall is seen.
    falling: [Option<Precipitation>; 2],
    /// The least share of the light of a surface 1 m away that still comes from one that is seen.
    faintest: f64,
}

/// The air along the pulses that leave a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AirFrom<'a> {
    air: &'a Air,
    /// The extinction here of haze and fog.
    here: [f64; 2],
}

const RAIN: Domain = Domain::new("lidar.rain");
const SNOW: Domain = Domain::new("lidar.snow");

impl Air {
    /// The air for a beam, with a blind zone and a range.
    pub(crate) fn new(params: AirParams, beam: &Beam, (near_m, far_m): (f64, f64)) -> Self {
        let length_m = 2.0 * beam.resolution_m;
        let mut pieces = Vec::new();
        let mut range_m = near_m.max(OVERLAP_TO_M);
        let has_echoes = length_m > 0.0 && params.layers().iter().any(|l| l.extinction_per_m > 0.0);
        while has_echoes && range_m < far_m {
            let piece = Piece::new(range_m, length_m, params.near_m);
            range_m += piece.step_m;
            pieces.push(piece);
        }
        let most = pieces.iter().map(|p| p.geometry).fold(0.0, f64::max);
        let range_m = params.reference_range_m;
        let weakest = params.reference_reflectance / (range_m * range_m);
        let rain = Hydrometeor::Raindrop.sizes(params.rain_mm_per_h);
        let snow = Hydrometeor::Snowflake.sizes(params.snowfall_mm_per_h);
        Self {
            params,
            pieces,
            most,
            weakest,
            falling_per_m: rain.extinction_per_m() + snow.extinction_per_m(),
            falling: [
                (rain, params.drop_reflectance),
                (snow, params.flake_reflectance),
            ]
            .map(|(sizes, reflectance)| {
                let (beam_sr, reach_m) = (beam.solid_angle_sr(), (near_m, far_m));
                let near_m = params.near_m;
                Precipitation::new(sizes, reflectance, beam_sr, weakest, near_m, reach_m)
            }),
            faintest: weakest.min(1.0 / (far_m * far_m)),
        }
    }

    /// The weakest power that the receiver sees: reflectance over the square of the range.
    pub(crate) fn weakest(&self) -> f64 {
        self.weakest
    }

    /// The air from a height in the scene.
    pub(crate) fn at_height(&self, z_m: f64) -> Option<AirFrom<'_>> {
        let here = self.params.layers().map(|layer| {
            let above_m = z_m - layer.base_m.unwrap_or(z_m);
            // Far below its base a layer would overflow; this is opaque already.
            layer.extinction_per_m * libm::exp((-above_m / layer.height_m).min(20.0))
        });
        let is_there = here != [0.0; 2] || self.falling_per_m > 0.0;
        is_there.then_some(AirFrom { air: self, here })
    }
}

impl AirFrom<'_> {
    /// The optical depth of the ways to ranges in a direction that rises by `rise` per metre, and
    /// the backscatter there, per metre and steradian.
    fn at<const N: usize>(&self, ranges_m: [f64; N], rise: f64) -> ([f64; N], [f64; N]) {
        let mut depth = ranges_m.map(|range_m| self.air.falling_per_m * range_m);
        let mut backscatter = [0.0; N];
        for (layer, here) in self.air.params.layers().into_iter().zip(self.here) {
            if here > 0.0 {
                let (per_m, per_sr) = (rise / layer.height_m, here / layer.lidar_ratio_sr);
                for i in 0..N {
                    let x = (per_m * ranges_m[i]).max(-20.0);
                    let left = exp(-x);
                    // The series of the quotient, where the quotient itself would be inexact.
                    let (near, far) = (1.0 - x * (0.5 - x / 6.0), (1.0 - left) / x);
                    let mean = if x.abs() < 1e-4 { near } else { far };
                    depth[i] += here * ranges_m[i] * mean;
                    backscatter[i] += per_sr * left;
                }
            }
        }
        (depth, backscatter)
    }

    /// The share of light that comes back through the air from a range; `None` if nothing is seen
    /// there: a white surface would be weaker than the weakest echo that the receiver sees, and any
    /// surface weaker than at the scanner's greatest range in a vacuum.
    pub(crate) fn two_way(&self, range_m: f64, direction: DVec3) -> Option<f64> {
        let share = exp(-2.0 * self.at([range_m], direction.z).0[0]);
        (share >= self.air.faintest * range_m * range_m).then_some(share)
    }

    /// Calls `see` for the echo of each drop and flake before a range that the receiver sees.
    pub(crate) fn falling(
        &self,
        direction: DVec3,
        before_m: f64,
        key: impl Fn(Domain) -> Key,
        mut see: impl FnMut(AirEcho),
    ) {
        for (seen, domain) in self.air.falling.iter().zip([RAIN, SNOW]) {
            let Some(seen) = seen else { continue };
            seen.each(before_m, &mut key(domain).rng(), |particle| {
                if let Some(left) = self.two_way(particle.range_m, direction) {
                    see(AirEcho {
                        sent_back: particle.sent_back * left,
                        ..particle
                    });
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    pub(super) fn uniform(extinction_per_m: f64, lidar_ratio_sr: f64) -> AirLayer {
        AirLayer {
            extinction_per_m,
            height_m: 1e9,
            lidar_ratio_sr,
            ..AirLayer::default()
        }
    }

    pub(super) fn pulse(length_m: f64) -> Beam {
        Beam {
            resolution_m: length_m / 2.0,
            ..Beam::default()
        }
    }

    pub(super) fn air(fog: AirLayer, near_m: f64, length_m: f64) -> Air {
        let params = AirParams {
            fog,
            near_m,
            ..AirParams::default()
        };
        Air::new(params, &pulse(length_m), (0.5, 300.0))
    }

    #[test]
    fn the_range_ladder_is_shorter_in_fog() {
        let air = air(uniform(libm::log(20.0) / 200.0, 18.8), 10.0, 1.2);
        let from = air.at_height(0.0).expect("fog");
        let power = |m: f64| 0.1 * from.two_way(m, DVec3::X).expect("seen") / (m * m);
        let weakest = 0.1 / (90.0 * 90.0);
        assert!(power(45.4) > weakest && power(45.6) < weakest);
    }

    #[test]
    fn air_hides_what_it_weakens_too_much() {
        // e^(−2 · 0.07824 · 29.13) / 29.13² = 0.1 / 90², and 1 / far² at the others.
        for (far_m, seen_m) in [(100.0, 29.13), (300.0, 29.60), (1000.0, 40.87)] {
            let params = AirParams {
                fog: uniform(3.912 / 50.0, 18.8),
                ..AirParams::default()
            };
            let air = Air::new(params, &pulse(1.2), (0.5, far_m));
            let from = air.at_height(0.0).expect("fog");
            let is_seen = |m: f64| from.two_way(m, DVec3::X).is_some();
            assert!(is_seen(seen_m - 0.05) && !is_seen(seen_m + 0.05), "{far_m}");
        }
    }

    proptest! {
        /// Depth and backscatter of two layers are compared with a sum over many steps.
        #[test]
        fn layers_are_exponential(
            rise in -1.0_f64..1.0,
            range_m in 0.1_f64..200.0,
            z_m in -5.0_f64..80.0,
            height_m in 5.0_f64..200.0,
        ) {
            let params = AirParams {
                haze: AirLayer { height_m: 100.0, ..uniform(0.002, 50.0) },
                fog: AirLayer { height_m, base_m: Some(2.0), ..uniform(0.1, 18.8) },
                ..AirParams::default()
            };
            let air = Air::new(params, &pulse(1.2), (0.5, 300.0));
            let from = air.at_height(z_m).expect("fog");
            let extinction = |m: f64| {
                let z = z_m + rise * m;
                [
                    0.002 * libm::exp(-(z - z_m) / 100.0),
                    0.1 * libm::exp(-(z - 2.0) / height_m),
                ]
            };
            prop_assume!((rise * range_m / height_m).abs() < 19.0);
            let steps = 4000;
            let sum: f64 = (0..steps)
                .map(|i| extinction((f64::from(i) + 0.5) / f64::from(steps) * range_m))
                .map(|[a, b]| (a + b) * range_m / f64::from(steps))
                .sum();
            let [haze, fog] = extinction(range_m);
            let ([depth], [backscatter]) = from.at([range_m], rise);
            prop_assert!((depth / sum - 1.0).abs() < 1e-3, "{depth} for {sum}");
            prop_assert!((backscatter / (haze / 50.0 + fog / 18.8) - 1.0).abs() < 1e-9);
        }
    }
}
