//! One octave of noise in the world: turned, shifted, and with crests where it is ridged.

use std::f64::consts::TAU;

use glam::{DMat2, DVec2};
use nemoral_seed::{Draw, Key, Rng};

use crate::gradient_noise::{SIGMA, gradient_noise};

/// How round crests are: the width of the smooth absolute value, in deviations of the noise.
const CREST: f64 = 0.25;

/// Mean and standard deviation of the smooth absolute value of gradient noise over the plane, in
/// deviations of the noise; measured.
const CREST_MEAN: f64 = 0.880_7;
const CREST_SIGMA: f64 = 0.535_8;

/// Gradient noise with its own turn and shift, so that lattice points, where it is 0, of different
/// octaves never coincide.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Octave {
    seed: u64,
    /// The linear map from world metres to octave space: a rotation and a scale.
    linear: DMat2,
    shift: DVec2,
    amplitude: f64,
    /// The share of ridges, 0..=1.
    ridges: f64,
}

impl Octave {
    /// The octave of a key, of this frequency (1/m) and factor on the noise.
    pub(crate) fn new(key: Key, frequency: f64, amplitude: f64, ridges: f64) -> Self {
        let mut rng = key.rng();
        let angle = rng.range_f64(0.0, TAU);
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let turn = DMat2::from_cols(DVec2::new(cos, sin), DVec2::new(-sin, cos));
        Self {
            seed: rng.next_u64(),
            linear: turn * frequency,
            shift: DVec2::new(rng.unit_f64(), rng.unit_f64()) * 1024.0,
            amplitude,
            ridges,
        }
    }

    /// Value and gradient at a world point.
    #[inline]
    pub(crate) fn sample(&self, world_m: DVec2) -> (f64, DVec2) {
        let (mut value, mut slope) = gradient_noise(self.seed, self.linear * world_m + self.shift);
        if self.ridges > 0.0 {
            let (ridged, rate) = ridged(value, self.ridges);
            value = ridged;
            slope *= rate;
        }
        // The transpose transforms a gradient back: d/dx f(L x + s) = Lᵀ f'.
        let gradient = DVec2::new(self.linear.x_axis.dot(slope), self.linear.y_axis.dot(slope));
        (self.amplitude * value, self.amplitude * gradient)
    }
}

/// A value of gradient noise with a share of ridges, and its derivative.
///
/// A ridge is the negative absolute value of noise (Musgrave, Kolb and Mace 1989), here of the
/// smooth kind √(n² + e²), so that the gradient is continuous on crests too. Noise and its absolute
/// value are uncorrelated, so the deviation stays that of the noise.
fn ridged(noise: f64, share: f64) -> (f64, f64) {
    const WIDTH: f64 = CREST * SIGMA;
    let rest = 1.0 - share;
    let norm = libm::sqrt(rest * rest + share * share);
    let root = libm::sqrt(noise * noise + WIDTH * WIDTH);
    let crest = (CREST_MEAN * SIGMA - root) / CREST_SIGMA;
    let value = (rest * noise + share * crest) / norm;
    (value, (rest - share * noise / (CREST_SIGMA * root)) / norm)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ridged_noise_has_the_mean_and_deviation_of_noise() {
        for share in [0.0, 0.3, 0.7, 1.0] {
            let (mut sum, mut square) = (0.0, 0.0);
            let n = 600;
            for i in 0..n * n {
                let p = DVec2::new(f64::from(i % n) * 0.618_034, f64::from(i / n) * 0.414_214);
                let (value, _) = ridged(gradient_noise(11, p).0, share);
                sum += value / SIGMA;
                square += (value / SIGMA).powi(2);
            }
            let n = f64::from(n * n);
            let (mean, deviation) = (sum / n, (square / n).sqrt());
            assert!(mean.abs() < 0.02, "{share}: {mean}");
            assert!((deviation - 1.0).abs() < 0.02, "{share}: {deviation}");
        }
    }

    #[test]
    fn crests_are_the_highest_places_and_round() {
        let (top, rate) = ridged(0.0, 1.0);
        assert_eq!(rate, 0.0);
        for noise in [-0.6, -0.2, -0.01, 0.01, 0.2, 0.6] {
            let (value, rate) = ridged(noise, 1.0);
            assert!(value < top && rate * noise < 0.0);
        }
    }
}
