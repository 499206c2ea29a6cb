//! What the air itself sends back.
//!
//! # Model
//! From each range `R`, the air sends back what a pulse of the shape `sin²` and the length `L`
//! meets there (Rasshofer, Spies and Spies 2011, "Influences of weather phenomena on automotive
//! laser radar systems"; Hahner et al. 2021, "Fog Simulation on Real LiDAR Point Clouds for 3D
//! Object Detection in Adverse Weather"):
//! ```text
//! π β e^(−2τ) ∫ ξ(r) / r² sin²(π (R + L/2 − r) / L) dr,   R − L/2 ≤ r ≤ R + L/2
//! ```
//! in the unit in which a surface of reflectance ρ at the range R, seen head-on, sends back ρ / R².
//! `τ` is the extinction along the path, `β` the extinction over the lidar ratio, and `ξ` the share
//! of the beam that the receiver sees: it grows from 0 to 1 between 0.9 and 1 m.
//!
//! We differ in three places. Their lidar ratio is 65 sr; drops of fog have 18.8 sr (O'Connor,
//! Illingworth and Hogan 2004). Receivers are less sensitive at short range, without which every
//! fog would hide all that is farther than some metres. And light that drops scatter is a sum of
//! waves with random phases (speckle), so that the strongest echo of fog is not at one range for
//! all pulses: the power from each piece of air has Goodman's gamma distribution, of four looks.

use nemoral_scene::glam::DVec3;
use nemoral_seed::{PhiloxRng, Rng};

use super::{Air, AirFrom};
use crate::echo::AirEcho;
use crate::exponential::exp;

/// The receiver sees nothing of the air nearer than this, metres …
const OVERLAP_FROM_M: f64 = 0.9;
/// … and all of the beam from here on.
pub(super) const OVERLAP_TO_M: f64 = 1.0;
/// Pieces of air whose light adds up without a phase, as a number of looks.
const LOOKS: i32 = 4;
/// The brightest speckle; one in ten thousand would be brighter.
const BRIGHTEST: f64 = 4.0;
/// Pieces of air grow with range beyond where they are as long as the pulse.
const GROWTH: f64 = 0.05;
/// Pieces whose light is computed together.
const TOGETHER: usize = 8;
/// Steps of the integral over a pulse.
const STEPS: u32 = 64;

/// A piece of air along every pulse.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    range_m: f64,
    /// The distance to the next one.
    pub(super) step_m: f64,
    /// The range of the middle of its light.
    middle_m: f64,
    /// What air of backscatter 1 sends back from here, without its own extinction.
    pub(super) geometry: f64,
    /// Whether that is less from each farther piece.
    is_beyond_peak: bool,
}

impl Piece {
    pub(super) fn new(range_m: f64, length_m: f64, near_m: f64) -> Self {
        let (mut sum, mut moment) = (0.0, 0.0);
        for step in 0..STEPS {
            let share = (f64::from(step) + 0.5) / f64::from(STEPS);
            let r = range_m + (share - 0.5) * length_m;
            let seen = ((r - OVERLAP_FROM_M) / (OVERLAP_TO_M - OVERLAP_FROM_M)).clamp(0.0, 1.0);
            if seen > 0.0 {
                let sine = libm::sin(std::f64::consts::PI * share);
                let light = seen / (r * r) * sine * sine;
                sum += light;
                moment += light * r;
            }
        }
        let sensitivity = (range_m / near_m.max(range_m)).powi(2);
        Self {
            range_m,
            step_m: (length_m / 2.0).max(GROWTH * range_m),
            middle_m: if sum > 0.0 { moment / sum } else { range_m },
            geometry: std::f64::consts::PI * sum * length_m / f64::from(STEPS) * sensitivity,
            is_beyond_peak: range_m > near_m.max(OVERLAP_TO_M + length_m),
        }
    }
}

impl AirFrom<'_> {
    /// The strongest echo of the air before a range, if the receiver sees it. What is drawn for a
    /// piece of air does not depend on the range.
    pub(crate) fn echo(
        &self,
        direction: DVec3,
        before_m: f64,
        rng: impl FnOnce() -> PhiloxRng,
    ) -> Option<AirEcho> {
        let Air {
            pieces,
            most,
            weakest,
            ..
        } = self.air;
        let rise = direction.z;
        // Layers are densest at an end of the way.
        let [here, there] = self.at([0.0, before_m], rise).1;
        let brightest = here.max(there) * BRIGHTEST;
        if most * brightest < *weakest {
            return None;
        }
        let mut rng = rng();
        // Each pulse cuts the air into other pieces, or fog would be shells around the scanner.
        let shift = unit(rng.next_u32());
        let mut strongest: Option<(f64, f64)> = None;
        // The processor overlaps the sums of several pieces.
        'way: for pieces in pieces.chunks(TOGETHER) {
            let mut middles_m = [pieces[0].middle_m; TOGETHER];
            for (middle_m, piece) in middles_m.iter_mut().zip(pieces) {
                *middle_m = piece.middle_m;
            }
            let (depths, backscatters) = self.at(middles_m, rise);
            let left = depths.map(|depth| exp(-2.0 * depth));
            for ((piece, left), backscatter) in pieces.iter().zip(left).zip(backscatters) {
                let range_m = piece.range_m + shift * piece.step_m;
                let seen = piece.geometry * left;
                let beaten = strongest.map_or(*weakest, |(power, _)| power);
                if range_m >= before_m || piece.is_beyond_peak && seen * brightest < beaten {
                    break 'way;
                }
                let mean = seen * backscatter;
                if mean * BRIGHTEST >= beaten {
                    let power = mean * speckle(&mut rng);
                    if power >= beaten {
                        strongest = Some((power, range_m));
                    }
                }
            }
        }
        strongest.map(|(power, range_m)| AirEcho {
            range_m,
            sent_back: power * range_m * range_m,
        })
    }
}

/// Above 0, at most 1.
fn unit(word: u32) -> f64 {
    (f64::from(word) + 1.0) / 4_294_967_296.0
}

/// The factor of speckle: a gamma variate with mean 1, as a sum of exponential ones.
fn speckle(rng: &mut PhiloxRng) -> f64 {
    let product: f64 = (0..LOOKS).map(|_| unit(rng.next_u32())).product();
    (-libm::log(product) / f64::from(LOOKS)).min(BRIGHTEST)
}

#[cfg(test)]
mod tests {
    use nemoral_seed::Key;
    use proptest::prelude::*;

    use super::*;
    use crate::air::tests::{air, pulse, uniform};
    use crate::air::{AirLayer, AirParams};

    /// The greatest mean power of air with backscatter 1 / π, and where it is.
    fn strongest(extinction_per_m: f64, length_m: f64) -> (f64, f64) {
        let at = |i: u32| {
            let piece = Piece::new(1.0 + 0.01 * f64::from(i), length_m, 0.0);
            let left = libm::exp(-2.0 * extinction_per_m * piece.middle_m);
            (piece.geometry * left / std::f64::consts::PI, piece.range_m)
        };
        (0..300)
            .map(at)
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .expect("some")
    }

    /// By Hahner et al.'s integral with Rasshofer's constants, computed apart from this program.
    /// The visibility is that of 5 % of the contrast.
    #[test]
    fn fog_sends_back_what_the_integral_says() {
        let cases = [
            (20.0, 6.0, 0.432, 1.55),
            (50.0, 6.0, 0.572, 1.65),
            (200.0, 6.0, 0.662, 1.70),
            (20.0, 1.5, 0.272, 1.25),
            (50.0, 1.5, 0.341, 1.25),
            (200.0, 1.5, 0.382, 1.30),
        ];
        for (visibility_m, length_m, expected, range_m) in cases {
            let (got, at) = strongest(libm::log(20.0) / visibility_m, length_m);
            assert!(
                (got / expected - 1.0).abs() < 0.02,
                "{visibility_m} m: {got}"
            );
            assert!((at - range_m).abs() < 0.1, "{visibility_m} m: at {at} m");
        }
    }

    /// The ranges at which a surface sends back as much as fog does, from the same source.
    #[test]
    fn fog_hides_what_is_darker() {
        for (visibility_m, ratio_sr, reflectance, expected_m) in [
            (50.0, 65.0, 0.1, 5.6),
            (50.0, 65.0, 0.4, 9.0),
            (50.0, 18.8, 0.4, 5.9),
            (200.0, 65.0, 0.4, 21.1),
            (20.0, 18.8, 0.1, 2.2),
        ] {
            let extinction = libm::log(20.0) / visibility_m;
            let fog = std::f64::consts::PI * extinction / ratio_sr * strongest(extinction, 6.0).0;
            let surface = |m: f64| reflectance * libm::exp(-2.0 * extinction * m) / (m * m);
            let (mut near, mut far) = (0.1, 300.0);
            for _ in 0..60 {
                let middle = f64::midpoint(near, far);
                if surface(middle) > fog {
                    near = middle
                } else {
                    far = middle
                }
            }
            assert!(
                (near / expected_m - 1.0).abs() < 0.04,
                "{visibility_m}: {near}"
            );
        }
    }

    #[test]
    fn a_receiver_that_is_less_sensitive_nearby_sees_through_fog() {
        // The default receiver at a visibility of 50 m, with a pulse of 4 ns.
        let extinction = 3.912 / 50.0;
        let air = air(uniform(extinction, 18.8), 10.0, 1.2);
        let from = air.at_height(0.0).expect("fog");
        let mean = |p: &Piece| {
            let ([depth], [backscatter]) = from.at([p.middle_m], 0.0);
            p.geometry * backscatter * libm::exp(-2.0 * depth)
        };
        let fog = air.pieces.iter().map(mean).fold(0.0, f64::max);
        let surface = |m: f64| 0.4 * libm::exp(-2.0 * extinction * m) / (m * m);
        assert!(surface(16.0) > fog && surface(30.0) < fog);
    }

    #[test]
    fn clear_air_has_no_echo() {
        let haze = uniform(3.912 / 20_000.0 * libm::pow(905.0 / 550.0, -1.3), 50.0);
        for near_m in [0.0, 10.0] {
            let air = air(haze, near_m, 1.2);
            let from = air.at_height(1.5).expect("haze");
            for pulse in 0..2000 {
                let rng = || Key::world(1).item(pulse).rng();
                assert_eq!(from.echo(DVec3::X, 300.0, rng), None);
            }
            assert!(
                from.two_way(50.0, DVec3::X)
                    .is_some_and(|share| share > 0.98)
            );
        }
        assert!(
            Air::new(AirParams::default(), &pulse(1.2), (0.5, 260.0))
                .at_height(3.0)
                .is_none()
        );
    }

    #[test]
    fn speckle_is_a_gamma_variate_of_four_looks() {
        let mut rng = Key::world(7).rng();
        let n = 40_000;
        let all: Vec<f64> = (0..n).map(|_| speckle(&mut rng)).collect();
        let mean = all.iter().sum::<f64>() / f64::from(n);
        let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / f64::from(n);
        assert!(
            (mean - 1.0).abs() < 0.01 && (variance - 0.25).abs() < 0.01,
            "{mean} {variance}"
        );
    }

    #[test]
    fn echoes_of_fog_are_stable() {
        let air = air(uniform(0.08, 18.8), 10.0, 1.2);
        let from = air.at_height(0.0).expect("fog");
        let echo = from
            .echo(DVec3::X, 100.0, || Key::world(3).rng())
            .expect("fog is seen");
        let rounded = (echo.range_m * 1e4).round();
        assert_eq!((rounded, (echo.sent_back * 1e6).round()), (17_082.0, 262.0));
    }

    proptest! {
        /// Pieces that are left out could not be seen.
        #[test]
        fn geometry_falls_beyond_its_peak(length_m in 0.1_f64..20.0, near_m in 0.0_f64..50.0) {
            let air = air(uniform(0.05, 18.8), near_m, length_m);
            for pair in air.pieces.windows(2).filter(|pair| pair[0].is_beyond_peak) {
                prop_assert!(pair[1].geometry <= pair[0].geometry);
            }
        }

        /// What is nearer than a surface does not depend on it, and nothing is behind it.
        #[test]
        fn a_surface_hides_the_air_behind_it(
            seed in any::<u64>(),
            rise in -0.9_f64..0.9,
            before_m in 1.0_f64..60.0,
        ) {
            let fog = AirLayer { height_m: 20.0, ..uniform(0.05, 18.8) };
            let air = air(fog, 10.0, 1.2);
            let from = air.at_height(1.0).expect("fog");
            let direction = DVec3::new((1.0 - rise * rise).sqrt(), 0.0, rise);
            let rng = || Key::world(seed).rng();
            let near = from.echo(direction, before_m, rng);
            let all = from.echo(direction, 300.0, rng);
            if let Some(echo) = near {
                prop_assert!(echo.range_m < before_m);
            }
            match all {
                Some(echo) if echo.range_m < before_m => prop_assert_eq!(near, all),
                _ => {}
            }
        }
    }
}
