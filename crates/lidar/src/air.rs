//! The air that pulses pass: it weakens echoes, and fog has echoes of its own.
//!
//! # Model
//! Extinction decreases with height in two layers, haze and fog. Light that goes to a surface and
//! back is weakened by `e^(−2τ)`, where `τ` is the extinction along the path (Beer and Lambert).
//! Air itself sends back, from each range `R`, what a pulse of the shape `sin²` and the length `L`
//! meets there (Rasshofer, Spies and Spies 2011, "Influences of weather phenomena on automotive
//! laser radar systems"; Hahner et al. 2021, "Fog Simulation on Real LiDAR Point Clouds for 3D
//! Object Detection in Adverse Weather"):
//! ```text
//! π β e^(−2τ) ∫ ξ(r) / r² sin²(π (R + L/2 − r) / L) dr,   R − L/2 ≤ r ≤ R + L/2
//! ```
//! in the unit in which a surface of reflectance ρ at the range R, seen head-on, sends back ρ / R².
//! `β` is the extinction over the lidar ratio, and `ξ` the share of the beam that the receiver
//! sees: it grows from 0 to 1 between 0.9 and 1 m.
//!
//! We differ in three places. Their lidar ratio is 65 sr; drops of fog have 18.8 sr (O'Connor,
//! Illingworth and Hogan 2004). Receivers are less sensitive at short range, without which every
//! fog would hide all that is farther than some metres. And light that drops scatter is a sum of
//! waves with random phases (speckle), so that the strongest echo of fog is not at one range for
//! all pulses: the power from each piece of air has Goodman's gamma distribution, of four looks.

use nemoral_scene::glam::DVec3;
use nemoral_scene::{Hydrometeor, ParamError};
use nemoral_seed::{Domain, Key, PhiloxRng, Rng};

use crate::beam::Beam;
use crate::echo::AirEcho;
use crate::precipitation::Precipitation;

/// A layer of air whose extinction decreases with height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirLayer {
    /// Extinction at its base, at the laser's wavelength, per metre, at least 0.
    pub extinction_per_m: f64,
    /// The base's height in the scene, metres; the scanner's if none.
    pub base_m: Option<f64>,
    /// The height over which extinction decreases by a factor of e, metres, greater than 0.
    pub height_m: f64,
    /// Extinction over backscatter, steradians, greater than 0: 18.8 for drops of fog and clouds,
    /// some 50 for haze.
    pub lidar_ratio_sr: f64,
}

impl Default for AirLayer {
    /// None.
    fn default() -> Self {
        Self {
            extinction_per_m: 0.0,
            base_m: None,
            height_m: 100.0,
            lidar_ratio_sr: 18.8,
        }
    }
}

/// The air, and how well the receiver sees it. By default there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirParams {
    /// Haze and mist.
    pub haze: AirLayer,
    /// Fog near the ground.
    pub fog: AirLayer,
    /// Rain, everywhere, 0..=200.
    pub rain_mm_per_h: f64,
    /// Snowfall as water, everywhere, 0..=20.
    pub snowfall_mm_per_h: f64,
    /// The reflectance of a disc that sends as much light back as a raindrop of its width, 0..=1.
    pub drop_reflectance: f64,
    /// The same of a snowflake.
    pub flake_reflectance: f64,
    /// The farthest range at which the receiver sees a reference target, metres, greater than 0.
    pub reference_range_m: f64,
    /// The reflectance of that target, greater than 0.
    pub reference_reflectance: f64,
    /// Nearer than this, the receiver is less sensitive to the air's echoes, by the square of the
    /// range; metres, at least 0.
    pub near_m: f64,
}

impl Default for AirParams {
    /// No air, and the receiver of Livox's Mid-40: 90 m at 10 %.
    fn default() -> Self {
        Self {
            haze: AirLayer::default(),
            fog: AirLayer::default(),
            rain_mm_per_h: 0.0,
            snowfall_mm_per_h: 0.0,
            drop_reflectance: 0.024,
            flake_reflectance: 0.3,
            reference_range_m: 90.0,
            reference_reflectance: 0.1,
            near_m: 10.0,
        }
    }
}

impl AirParams {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        for layer in [&self.haze, &self.fog] {
            ParamError::check_at_least_zero("air.extinction_per_m", layer.extinction_per_m)?;
            ParamError::check_positive("air.height_m", layer.height_m)?;
            ParamError::check_positive("air.lidar_ratio_sr", layer.lidar_ratio_sr)?;
            let base_m = layer.base_m.unwrap_or(0.0);
            ParamError::check(base_m.is_finite(), "air.base_m", base_m, "finite")?;
        }
        for (field, value, most, allowed) in [
            ("air.rain_mm_per_h", self.rain_mm_per_h, 200.0, "0..=200"),
            (
                "air.snowfall_mm_per_h",
                self.snowfall_mm_per_h,
                20.0,
                "0..=20",
            ),
            ("air.drop_reflectance", self.drop_reflectance, 1.0, "0..=1"),
            (
                "air.flake_reflectance",
                self.flake_reflectance,
                1.0,
                "0..=1",
            ),
        ] {
            ParamError::check((0.0..=most).contains(&value), field, value, allowed)?;
        }
        ParamError::check_positive("air.reference_range_m", self.reference_range_m)?;
        ParamError::check_positive("air.reference_reflectance", self.reference_reflectance)?;
        ParamError::check_at_least_zero("air.near_m", self.near_m)
    }

    fn layers(&self) -> [AirLayer; 2] {
        [self.haze, self.fog]
    }
}

/// The receiver sees nothing of the air nearer than this, metres …
const OVERLAP_FROM_M: f64 = 0.9;
/// … and all of the beam from here on.
const OVERLAP_TO_M: f64 = 1.0;
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
struct Piece {
    range_m: f64,
    /// The distance to the next one.
    step_m: f64,
    /// The range of the middle of its light.
    middle_m: f64,
    /// What air of backscatter 1 sends back from here, without its own extinction.
    geometry: f64,
    /// Whether that is less from each farther piece.
    is_beyond_peak: bool,
}

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

impl Piece {
    fn new(range_m: f64, length_m: f64, near_m: f64) -> Self {
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

/// Above 0, at most 1.
fn unit(word: u32) -> f64 {
    (f64::from(word) + 1.0) / 4_294_967_296.0
}

/// The factor of speckle: a gamma variate with mean 1, as a sum of exponential ones.
fn speckle(rng: &mut PhiloxRng) -> f64 {
    let product: f64 = (0..LOOKS).map(|_| unit(rng.next_u32())).product();
    (-libm::log(product) / f64::from(LOOKS)).min(BRIGHTEST)
}

/// e^x to 3e-10 of it, from −700 to 700, and as at these beyond them. The compiler inlines it and
/// computes several at once; with a library's, a scan in fog takes half as long again.
#[inline]
pub(crate) fn exp(x: f64) -> f64 {
    // Adding it rounds to a whole number.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let x = x.clamp(-700.0, 700.0);
    let doublings = (x * std::f64::consts::LOG2_E + ROUND) - ROUND;
    let rest = x - doublings * std::f64::consts::LN_2;
    // Taylor's series from its eighth power on down; the next term is at most 0.35⁹ / 9!.
    let series = INVERSE_FACTORIALS.iter().fold(0.0, |sum, c| sum * rest + c);
    series * f64::from_bits((((doublings as i64) + 1023) << 52) as u64)
}

/// 1 / n!, from 8 to 0.
const INVERSE_FACTORIALS: [f64; 9] = [
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn uniform(extinction_per_m: f64, lidar_ratio_sr: f64) -> AirLayer {
        AirLayer {
            extinction_per_m,
            height_m: 1e9,
            lidar_ratio_sr,
            ..AirLayer::default()
        }
    }

    fn pulse(length_m: f64) -> Beam {
        Beam {
            resolution_m: length_m / 2.0,
            ..Beam::default()
        }
    }

    fn air(fog: AirLayer, near_m: f64, length_m: f64) -> Air {
        let params = AirParams {
            fog,
            near_m,
            ..AirParams::default()
        };
        Air::new(params, &pulse(length_m), (0.5, 300.0))
    }

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
    fn exponentials_are_those_of_a_library() {
        for i in -70_000..=70_000 {
            let x = f64::from(i) * 0.01 + 0.003_1;
            assert!(
                (exp(x) / libm::exp(x.clamp(-700.0, 700.0)) - 1.0).abs() < 3e-10,
                "{x}"
            );
        }
        assert!(exp(0.0) == 1.0 && exp(-1e300) < 1e-300);
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
