//! The noise of a sensor.

use glam::Vec3;
use nemoral_seed::{Domain, Draw, Key, Rng};

use crate::error::{ParamError, check};

/// The noise of a sensor by the linear model of EMVA 1288 (release 4.0), in electrons. Light frees
/// electrons at random (shot noise), reading adds an error (read noise), pixels differ from each
/// other (fixed pattern), and a converter counts in steps.
///
/// Each colour is a sensor of its own here: there is no colour filter mosaic, and noise is not
/// mixed between colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorNoise {
    /// Electrons that a pixel holds at the light that just clips in the standard picture,
    /// [`ToneCurve::Standard`](crate::ToneCurve::Standard) without more contrast, whatever the tone
    /// curve; 10..=10,000,000.
    pub full_well_e: f64,
    /// Standard deviation of reading, electrons, 0..=10,000.
    pub read_noise_e: f64,
    /// Amplification before the converter, 1..=1000: with 2 a pixel clips at half its full well.
    pub gain: f64,
    /// Below this exposure value (ISO 100) shutter and aperture are wide open, and each stop
    /// doubles the gain. −20..=30; with −20 the gain is constant.
    pub gain_below_ev: f64,
    /// Spread of the pixels' sensitivity (PRNU), 0..=0.5: 0.01 is a percent.
    pub prnu: f64,
    /// Spread of the pixels' dark level (DSNU), electrons, 0..=10,000.
    pub dsnu_e: f64,
    /// Bits of the converter, 1..=16.
    pub bits: u32,
    /// The individual sensor; equal keys have equal fixed patterns.
    pub serial: Key,
}

impl SensorNoise {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        let electrons = "0..=10,000 electrons";
        for (field, value, low, high, allowed) in [
            (
                "noise.full_well_e",
                self.full_well_e,
                10.0,
                1e7,
                "10..=10,000,000 electrons",
            ),
            ("noise.read_noise_e", self.read_noise_e, 0.0, 1e4, electrons),
            ("noise.gain", self.gain, 1.0, 1e3, "1..=1000"),
            (
                "noise.gain_below_ev",
                self.gain_below_ev,
                -20.0,
                30.0,
                "-20..=30",
            ),
            ("noise.prnu", self.prnu, 0.0, 0.5, "0..=0.5"),
            ("noise.dsnu_e", self.dsnu_e, 0.0, 1e4, electrons),
            ("noise.bits", self.bits.into(), 1.0, 16.0, "1..=16"),
        ] {
            check(field, value, low, high, allowed)?;
        }
        Ok(())
    }

    /// Electrons at which a pixel clips in a picture with this exposure.
    fn saturation_e(&self, ev100: f64) -> f64 {
        let stops = (self.gain_below_ev - ev100).max(0.0);
        (self.full_well_e / (self.gain * libm::exp2(stops))).max(1.0)
    }
}

const TEMPORAL: Domain = Domain::new("render.sensor");

/// A sensor that reads one picture.
pub(crate) struct Sensor {
    noise: SensorNoise,
    /// Electrons at which the pixels of each colour clip.
    saturation_e: [f64; 3],
    /// The converter's code of `full`.
    top: f64,
    /// The exposed light that fills pixels up to `saturation_e`.
    full: f64,
    /// The highest code that is read.
    highest: f64,
    temporal: Key,
}

impl Sensor {
    /// `full` is the exposed light that fills pixels, and `white` that which just clips in the
    /// picture: where the picture shows more than fills pixels, they hold as much more, so that the
    /// noise of a light does not depend on the tone curve. `gains` are those of the white balance,
    /// which amplify what the pixels of a colour hold, so that the most amplified clip with the
    /// fewest electrons; `key` is the camera's in this frame.
    pub(crate) fn new(
        noise: SensorNoise,
        ev100: f64,
        full: f64,
        white: f64,
        gains: Vec3,
        key: Key,
    ) -> Self {
        let saturation_e = noise.saturation_e(ev100);
        let least = gains.min_element();
        let top = f64::from((1_u32 << noise.bits) - 1);
        Self {
            noise,
            saturation_e: gains
                .to_array()
                .map(|gain| saturation_e * f64::from(least / gain)),
            top,
            full,
            highest: top * (white / full).max(1.0),
            temporal: key.domain(TEMPORAL),
        }
    }

    /// The value that is read for balanced exposed light at the `index`-th pixel. With noise it may
    /// be below 0, because the dark level is subtracted after the converter, as in cameras.
    pub(crate) fn read(&self, index: usize, exposed: Vec3) -> Vec3 {
        let n = &self.noise;
        let mut rng = self.temporal.item(index as u64).rng();
        let mut pattern =
            (n.prnu > 0.0 || n.dsnu_e > 0.0).then(|| n.serial.item(index as u64).rng());
        let read = std::array::from_fn(|colour| {
            let (light, saturation_e) = (exposed[colour], self.saturation_e[colour]);
            let (sensitivity, dark_e) = match &mut pattern {
                Some(pixel) => (1.0 + n.prnu * pixel.normal(), n.dsnu_e * pixel.normal()),
                None => (1.0, 0.0),
            };
            let share = f64::from(light.max(0.0)) / self.full;
            let mean_e = share * saturation_e * sensitivity.max(0.0);
            let read_e = shot(mean_e, &mut rng) + dark_e + n.read_noise_e * rng.normal();
            let code = (read_e / saturation_e * self.top).round();
            (code.min(self.highest) / self.top * self.full) as f32
        });
        Vec3::from_array(read)
    }
}

/// The number of electrons where `mean` are expected: Poisson's distribution, by inversion for
/// small means, and from 30 on the normal distribution of the same mean and variance.
fn shot(mean: f64, rng: &mut impl Rng) -> f64 {
    if mean >= 30.0 {
        return (mean + mean.sqrt() * rng.normal()).round();
    }
    let mut left = rng.unit_f64();
    let (mut count, mut probability) = (0.0, libm::exp(-mean));
    // Rounding may leave a little probability beyond all counts.
    while left >= probability && count < 200.0 {
        left -= probability;
        count += 1.0;
        probability *= mean / count;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shot and read noise of a good sensor for machine vision.
    const PLAIN: SensorNoise = SensorNoise {
        full_well_e: 10_000.0,
        read_noise_e: 2.5,
        gain: 1.0,
        gain_below_ev: -20.0,
        prnu: 0.0,
        dsnu_e: 0.0,
        bits: 14,
        serial: Key::world(5),
    };

    const PIXELS: usize = 20_000;

    /// Codes of an even field that should give `mean_e` electrons in the middle channel.
    fn codes(noise: SensorNoise, mean_e: f64, ev100: f64, frame: u64) -> Vec<f64> {
        let key = Key::world(9).item(frame);
        let sensor = Sensor::new(noise, ev100, 2.0, 2.0, Vec3::ONE, key);
        let light = (mean_e / noise.saturation_e(ev100) * 2.0) as f32;
        let read = |i| f64::from(sensor.read(i, Vec3::splat(light)).y) / 2.0 * sensor.top;
        (0..PIXELS).map(read).collect()
    }

    fn moments(codes: &[f64]) -> (f64, f64) {
        let n = codes.len() as f64;
        let mean = codes.iter().sum::<f64>() / n;
        let variance = codes.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, variance)
    }

    /// The photon transfer curve has the mean K μ and the variance K² (μ + σ²) + 1/12, with K codes
    /// per electron; 1/12 is valid while noise spans at least one code.
    #[test]
    fn mean_and_variance_are_emvas() {
        for bits in [12, 14] {
            for gain in [1.0, 4.0] {
                for mean_e in [0.0, 0.7, 6.0, 29.0, 31.0, 400.0, 2000.0] {
                    let noise = SensorNoise {
                        bits,
                        gain,
                        ..PLAIN
                    };
                    let (mean, variance) = moments(&codes(noise, mean_e, 0.0, 0));
                    let k = f64::from((1 << bits) - 1) / (noise.full_well_e / gain);
                    let counts = if mean_e >= 30.0 { 1.0 / 12.0 } else { 0.0 };
                    let exact = k * k * (mean_e + 2.5 * 2.5 + counts) + 1.0 / 12.0;
                    let n = PIXELS as f64;
                    let case = format!("{bits} bits, gain {gain}, {mean_e} electrons");
                    let off = (mean - k * mean_e) / (exact / n).sqrt();
                    assert!(
                        off.abs() < 4.5,
                        "{case}: the mean is {mean}, {off} sigma off"
                    );
                    // The deviation in units of the spread of a variance, for a fourth moment
                    // slightly above that of a normal distribution.
                    let off = (variance / exact - 1.0) / (2.2 / n).sqrt();
                    assert!(
                        off.abs() < 4.5,
                        "{case}: the variance is {variance} for {exact}, {off} sigma off"
                    );
                }
            }
        }
    }

    /// The third moment, μ^(-1/2), distinguishes Poisson's from a normal distribution.
    #[test]
    fn few_electrons_are_skewed() {
        let mut rng = Key::world(3).rng();
        let counts: Vec<f64> = (0..PIXELS).map(|_| shot(1.5, &mut rng)).collect();
        let (mean, variance) = moments(&counts);
        let third = counts.iter().map(|c| (c - mean).powi(3)).sum::<f64>() / PIXELS as f64;
        assert!((third / variance.powf(1.5) - 1.5_f64.powf(-0.5)).abs() < 0.1);
        let none = counts.iter().filter(|c| **c == 0.0).count() as f64 / PIXELS as f64;
        assert!((none - (-1.5_f64).exp()).abs() < 0.012, "{none}");
    }

    /// PRNU and DSNU by EMVA's definition: the part of the noise that is equal in all pictures.
    #[test]
    fn the_fixed_pattern_is_the_specimens() {
        let noise = SensorNoise {
            prnu: 0.02,
            dsnu_e: 30.0,
            read_noise_e: 0.0,
            ..PLAIN
        };
        let k = f64::from((1 << 14) - 1) / noise.full_well_e;
        let spread = |mean_e: f64| {
            // Shot noise in two pictures is independent, so their covariance is the variance of the
            // pattern.
            let (a, b) = (codes(noise, mean_e, 0.0, 1), codes(noise, mean_e, 0.0, 2));
            let ((mean_a, _), (mean_b, _)) = (moments(&a), moments(&b));
            let covariance = a.iter().zip(&b).map(|(a, b)| (a - mean_a) * (b - mean_b));
            covariance.sum::<f64>() / PIXELS as f64 / (k * k)
        };
        for mean_e in [0.0, 4000.0] {
            let exact = (0.02_f64 * mean_e).powi(2) + 30.0_f64.powi(2);
            let got = spread(mean_e);
            assert!((got / exact - 1.0).abs() < 0.06, "{got} for {exact}");
        }
        let other = SensorNoise {
            serial: Key::world(6),
            ..noise
        };
        assert_ne!(codes(noise, 0.0, 0.0, 1), codes(other, 0.0, 0.0, 1));
        assert_eq!(codes(noise, 0.0, 0.0, 1), codes(noise, 0.0, 0.0, 2));
    }

    #[test]
    fn gain_makes_up_for_what_light_lacks_and_pixels_clip() {
        let noise = SensorNoise {
            gain_below_ev: 8.0,
            ..PLAIN
        };
        assert_eq!(noise.saturation_e(9.0), 10_000.0);
        assert_eq!(noise.saturation_e(5.0), 1250.0);
        // Ten times the light that clips is all white, in spite of its shot noise.
        let top = f64::from((1 << 14) - 1);
        assert!(
            codes(noise, 1e5, 9.0, 0)
                .iter()
                .all(|c| (c - top).abs() < 1e-2)
        );
        // With three stops less light, the noise of the same grey is 8^(1/2) times as strong.
        let relative = |ev: f64, mean_e| {
            let (mean, variance) = moments(&codes(noise, mean_e, ev, 0));
            variance.sqrt() / mean
        };
        let ratio = relative(5.0, 250.0) / relative(8.0, 2000.0);
        assert!((ratio / 8.0_f64.sqrt() - 1.0).abs() < 0.03, "{ratio}");
    }

    /// Blue that is amplified four times has four times as few electrons, and half the ratio of
    /// signal to noise.
    #[test]
    fn white_balance_amplifies_noise() {
        let gains = Vec3::new(1.0, 2.0, 4.0);
        let sensor = Sensor::new(PLAIN, 10.0, 1.0, 1.0, gains, Key::world(9));
        let spread = |colour: usize| {
            let read = |i| f64::from(sensor.read(i, Vec3::splat(0.4))[colour]);
            let read: Vec<f64> = (0..PIXELS).map(read).collect();
            let (mean, variance) = moments(&read);
            assert!((mean - 0.4).abs() < 1e-3, "{mean}");
            variance.sqrt()
        };
        for (colour, factor) in [(1, 2.0_f64.sqrt()), (2, 2.0)] {
            let ratio = spread(colour) / spread(0);
            assert!((ratio / factor - 1.0).abs() < 0.03, "{colour}: {ratio}");
        }
    }

    /// Below what clips, the picture's white changes nothing that is read; above, pixels hold as
    /// much as the picture shows.
    #[test]
    fn the_full_well_does_not_follow_the_pictures_white() {
        let read = |white: f64, light: f32| {
            let sensor = Sensor::new(PLAIN, 10.0, 2.0, white, Vec3::ONE, Key::world(9));
            [3, 7, 11].map(|i| sensor.read(i, Vec3::splat(light)))
        };
        for light in [0.001, 0.18, 1.5] {
            assert_eq!(read(1.0, light), read(2.0, light));
            assert_eq!(read(5.6, light), read(2.0, light));
        }
        for (white, highest) in [(1.0, 2.0), (2.0, 2.0), (5.6, 5.6)] {
            for c in read(white, 20.0) {
                assert!((c - Vec3::splat(highest)).length() < 1e-5, "{white}: {c}");
            }
        }
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let bad = |noise: SensorNoise| noise.check().expect_err("bad").field;
        assert_eq!(bad(SensorNoise { gain: 0.5, ..PLAIN }), "noise.gain");
        assert_eq!(bad(SensorNoise { bits: 17, ..PLAIN }), "noise.bits");
        assert_eq!(
            bad(SensorNoise {
                full_well_e: f64::NAN,
                ..PLAIN
            }),
            "noise.full_well_e"
        );
    }

    #[test]
    fn value_stability() {
        let noise = SensorNoise {
            prnu: 0.01,
            dsnu_e: 1.0,
            ..PLAIN
        };
        let sensor = Sensor::new(noise, 10.0, 1.0, 1.0, Vec3::ONE, Key::world(9));
        let read = [0.0005, 0.02, 0.7].map(|x| sensor.read(7, Vec3::splat(x)));
        assert_eq!(format!("{read:?}"), VALUES);
    }
    const VALUES: &str = "[Vec3(0.001037661, 0.00079350546, 0.00042727217), Vec3(0.024415553, \
        0.019776598, 0.017823353), Vec3(0.725203, 0.68674845, 0.6827199)]";
}
