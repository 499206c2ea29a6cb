//! Exposure, tone curve and transfer function, which turn luminance into code values.

use glam::Vec3;
use nemoral_scene::{CodeTable, Image};
use nemoral_seed::Key;
use rayon::prelude::*;

use super::processing::Processing;
use super::sensor_noise::{Sensor, SensorNoise};
use crate::error::{ParamError, check};

/// A light meter's reading at EV 0, ISO 100: K / 100 with K = 12.5 (ISO 2720), cd/m².
const LUMINANCE_AT_EV_0: f64 = 0.125;

/// The displayed reflectance of the metered luminance: middle grey.
const MIDDLE_GREY: f64 = 0.18;

/// The exposure of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Automatic, as in a camera: the picture's log-mean luminance becomes `key` (0.18 is middle
    /// grey), made brighter by `bias_ev` stops.
    Auto {
        /// 0.01..=1.
        key: f64,
        /// −10..=10 stops.
        bias_ev: f64,
        /// The least exposure value at ISO 100, −10..=25, at which shutter, aperture and gain end:
        /// what is darker stays dark.
        least_ev100: f64,
    },
    /// Fixed: a luminance of 0.125 · 2^ev100 cd/m² becomes middle grey. It is about 15 in sunshine,
    /// 12 in shade, and 7..10 under closed crowns.
    Fixed {
        /// −10..=25.
        ev100: f64,
    },
}

impl Default for Exposure {
    fn default() -> Self {
        Self::metered(0.0)
    }
}

impl Exposure {
    /// The exposure of a light meter, made brighter by `bias_ev` stops.
    #[must_use]
    pub const fn metered(bias_ev: f64) -> Self {
        Self::Auto {
            key: MIDDLE_GREY,
            bias_ev,
            least_ev100: -10.0,
        }
    }

    /// The same, if it is automatic, down to an exposure value at which shutter and gain end.
    #[must_use]
    pub fn down_to(self, least_ev100: f64) -> Self {
        match self {
            Self::Auto { key, bias_ev, .. } => Self::Auto {
                key,
                bias_ev,
                least_ev100,
            },
            Self::Fixed { .. } => self,
        }
    }

    pub(crate) fn check(&self) -> Result<(), ParamError> {
        match *self {
            Self::Auto {
                key,
                bias_ev,
                least_ev100,
            } => {
                check("exposure.least_ev100", least_ev100, -10.0, 25.0, "-10..=25")?;
                check("exposure.key", key, 0.01, 1.0, "0.01..=1")?;
                check("exposure.bias_ev", bias_ev, -10.0, 10.0, "-10..=10 stops")
            }
            Self::Fixed { ev100 } => check("exposure.ev100", ev100, -10.0, 25.0, "-10..=25"),
        }
    }

    /// The EV at ISO 100 for a picture with this log-mean luminance, cd/m².
    pub(crate) fn ev100(&self, log_mean: f64) -> f64 {
        match *self {
            Self::Fixed { ev100 } => ev100,
            Self::Auto {
                key,
                bias_ev,
                least_ev100,
            } => {
                let metered = log_mean / LUMINANCE_AT_EV_0 * (MIDDLE_GREY / key);
                (libm::log2(metered) - bias_ev).max(least_ev100)
            }
        }
    }
}

/// The factor on luminance that turns the metered one into middle grey.
pub(crate) fn scale_of(ev100: f64) -> f32 {
    (MIDDLE_GREY / (LUMINANCE_AT_EV_0 * libm::exp2(ev100))) as f32
}

/// The curve from exposed light to brightness on the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// A camera's standard picture: contrast about middle grey, dark shadows, and a shoulder that
    /// clips 3.4 stops above. It is the filmic curve behind a contrast of 1.25, with other
    /// constants: all greys have the codes of Adobe's default curve (DNG SDK 1.7,
    /// `dng_tone_curve_acr3_default`), within 3 of 255.
    #[default]
    Standard,
    /// Softer: a toe and a long shoulder (Hable 2010, "Uncharted 2", with his constants, white at
    /// 5.6), channel by channel, so that highlights lose their colour before they clip.
    Filmic,
    /// Light clipped at 1: brightness stays proportional to radiance.
    Linear,
}

/// The light that clips behind the filmic curve.
const FILMIC_WHITE: f64 = 5.6;

/// What the standard curve does to the light before the filmic one, and what then clips: fitted to
/// Adobe's curve.
const STANDARD_CONTRAST: f64 = 1.25;
const STANDARD_EXPOSURE: f64 = 0.8;
const STANDARD_WHITE: f64 = 2.75;

/// Hable's curve for a light of at least 0 that is white at `white`.
fn filmic(x: f64, white: f64) -> f64 {
    // The factor is his exposure bias.
    let hable = |x: f64| {
        let x = 2.0 * x;
        (x * (0.22 * x + 0.03) + 0.002) / (x * (0.22 * x + 0.3) + 0.06) - 0.01 / 0.3
    };
    (hable(x.min(white)) / hable(white)).clamp(0.0, 1.0)
}

/// Light whose distance from middle grey, in stops, is multiplied.
fn with_contrast(x: f64, contrast: f64) -> f64 {
    MIDDLE_GREY * libm::pow(x / MIDDLE_GREY, contrast)
}

impl ToneCurve {
    /// The exposed light that just clips.
    pub(crate) fn white(self) -> f64 {
        match self {
            Self::Linear => 1.0,
            Self::Filmic => FILMIC_WHITE,
            Self::Standard => {
                with_contrast(STANDARD_WHITE / STANDARD_EXPOSURE, 1.0 / STANDARD_CONTRAST)
            }
        }
    }

    /// Maps exposed linear light to displayed linear light, for one channel; monotone, and 0 for 0.
    fn apply(self, x: f64) -> f64 {
        match self {
            Self::Linear => x.min(1.0),
            Self::Filmic => filmic(x, FILMIC_WHITE),
            Self::Standard => filmic(
                STANDARD_EXPOSURE * with_contrast(x, STANDARD_CONTRAST),
                STANDARD_WHITE,
            ),
        }
    }
}

/// A tone curve after a change of contrast: logarithmic brightness has the slope `contrast` about
/// middle grey.
#[derive(Clone, Copy, Debug)]
struct Curve {
    tone: ToneCurve,
    contrast: f64,
}

impl Curve {
    /// The exposed light that just clips.
    fn white(self) -> f64 {
        let white = self.tone.white();
        if self.contrast == 1.0 {
            return white;
        }
        with_contrast(white, 1.0 / self.contrast)
    }

    fn apply(self, x: f64) -> f64 {
        if self.contrast == 1.0 {
            return self.tone.apply(x);
        }
        self.tone.apply(with_contrast(x, self.contrast))
    }
}

/// IEC 61966-2-1: linear to sRGB.
fn srgb_oetf(x: f64) -> f64 {
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * libm::pow(x, 1.0 / 2.4) - 0.055
    }
}

/// Maps light to code values, exactly and fast.
struct Encoder {
    table: CodeTable,
    /// The light that just clips.
    white: f32,
}

impl Encoder {
    fn new(curve: Curve) -> Self {
        let code = |x: f32| 255.0 * srgb_oetf(curve.apply(f64::from(x))) + 0.5;
        Self {
            table: CodeTable::new(64.0, code),
            white: curve.white() as f32,
        }
    }

    /// The code value before rounding, 0..=255: the curve is taken to be straight between the
    /// lights of neighbouring codes.
    #[inline]
    fn level(&self, x: f32) -> f32 {
        let (code, least) = (usize::from(self.table.code(x)), self.table.least());
        let (low, from) = match code {
            0 => (0.0, 0.0),
            _ => (least[code - 1], code as f32 - 0.5),
        };
        let (high, to) = match least.get(code) {
            Some(&next) => (next, code as f32 + 0.5),
            None => (self.white.max(low), 255.0),
        };
        if high <= low {
            return to;
        }
        from + (to - from) * ((x.max(0.0) - low) / (high - low)).min(1.0)
    }

    fn encode(&self, exposed: Vec3) -> [u8; 3] {
        exposed.to_array().map(|x| self.table.code(x))
    }

    fn levels(&self, exposed: Vec3) -> Vec3 {
        exposed.map(|x| self.level(x))
    }
}

/// The picture of a radiance image at an exposure, as a camera with this sensor and this processing
/// makes it. `key` is for the noise alone.
pub(crate) fn develop(
    linear: &Image<Vec3>,
    ev100: f64,
    tone: ToneCurve,
    noise: Option<SensorNoise>,
    processing: &Processing,
    key: Key,
) -> Image<[u8; 3]> {
    let curve = Curve {
        tone,
        contrast: processing.contrast,
    };
    let white = curve.white();
    let scale = scale_of(ev100);
    let gains = (processing.white_balance).gains(linear.pixels(), white as f32 / scale);
    // The electrons of a light must not depend on how the picture shows it.
    let full = ToneCurve::Standard.white();
    let sensor = noise.map(|noise| Sensor::new(noise, ev100, full, white, gains, key));
    let read = |i: usize, light: Vec3| {
        let exposed = light * scale * gains;
        match &sensor {
            None => exposed,
            Some(sensor) => sensor.read(i, exposed),
        }
    };
    let encoder = Encoder::new(curve);
    let (width, height) = (linear.width(), linear.height());
    let light = linear.pixels().par_iter().enumerate();
    let mut codes: Vec<[u8; 3]> = if processing.leaves_levels() {
        light.map(|(i, &c)| encoder.encode(read(i, c))).collect()
    } else {
        let levels = light.map(|(i, &c)| encoder.levels(read(i, c))).collect();
        processing.codes(levels, width)
    };
    if let Some(jpeg) = &processing.jpeg {
        jpeg.bake(&mut codes, width);
    }
    Image::new(width, height, codes)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::metering::log_mean_luminance;
    use super::*;

    /// Code values of a perfect sensor.
    fn shown(linear: &Image<Vec3>, ev100: f64, tone: ToneCurve) -> Image<[u8; 3]> {
        develop(
            linear,
            ev100,
            tone,
            None,
            &Processing::default(),
            Key::world(1),
        )
    }

    const TONES: [ToneCurve; 3] = [ToneCurve::Standard, ToneCurve::Filmic, ToneCurve::Linear];

    fn curve(tone: ToneCurve, contrast: f64) -> Curve {
        Curve { tone, contrast }
    }

    fn any_tone() -> impl Strategy<Value = ToneCurve> {
        proptest::sample::select(TONES.to_vec())
    }

    #[test]
    fn white_is_where_the_curve_ends() {
        for tone in TONES {
            for contrast in [0.6, 1.0, 1.7] {
                let curve = curve(tone, contrast);
                let (at, below) = (
                    curve.apply(curve.white()),
                    curve.apply(0.99 * curve.white()),
                );
                assert!(at > 1.0 - 1e-9 && below < 1.0, "{curve:?}");
                assert!(curve.white() < 64.0, "within the table");
            }
        }
    }

    proptest! {
        #[test]
        fn the_table_is_the_formula(
            exponent in -16.0_f32..4.0, tone in any_tone(), lift in 0.0..1.0,
        ) {
            let x = exponent.exp2();
            let contrast = if lift < 0.3 { 1.0 } else { 0.6 + 1.4 * lift };
            let curve = curve(tone, contrast);
            let encoder = Encoder::new(curve);
            let got = encoder.encode(Vec3::splat(x))[1];
            let exact = 255.0 * srgb_oetf(curve.apply(f64::from(x)));
            prop_assert!((f64::from(got) - exact).abs() <= 0.501, "{got} for {exact}");
            let level = f64::from(encoder.levels(Vec3::splat(x)).y);
            // The darkest code's part of the curve is not straight.
            let bend = if exact < 0.5 { 0.25 } else { 0.12 };
            prop_assert!((level - exact).abs() <= bend, "{level} for {exact}");
        }

        #[test]
        fn contrast_turns_about_middle_grey(contrast in 0.6..2.0, stops in -3.0..1.0) {
            let curve = curve(ToneCurve::Linear, contrast);
            prop_assert!((curve.apply(MIDDLE_GREY) - MIDDLE_GREY).abs() < 1e-12);
            let x = MIDDLE_GREY * libm::exp2(stops);
            let shown = libm::log2(curve.apply(x) / MIDDLE_GREY);
            prop_assert!((shown - contrast * stops).abs() < 1e-9);
        }

        #[test]
        fn a_stop_of_error_doubles_the_light(ev in -5.0..20.0) {
            let ratio = scale_of(ev - 1.0) / scale_of(ev);
            prop_assert!((ratio - 2.0).abs() < 1e-5, "{ratio}");
        }

        #[test]
        fn more_light_is_never_darker(
            x in 0.0_f32..20.0, more in 0.0_f32..2.0, tone in any_tone(),
        ) {
            let e = Encoder::new(curve(tone, 1.0));
            prop_assert!(e.encode(Vec3::splat(x + more))[0] >= e.encode(Vec3::splat(x))[0]);
        }

        #[test]
        fn auto_exposure_cancels_the_strength_of_the_light(scale in 0.001_f32..1000.0) {
            let pixels: Vec<Vec3> = (1..200).map(|i| Vec3::new(1.0, 0.5, 0.2) * i as f32).collect();
            let dim: Vec<Vec3> = pixels.iter().map(|&p| p * scale).collect();
            let shot = |p: Vec<Vec3>| {
                let ev = Exposure::default().ev100(log_mean_luminance(&p));
                shown(&Image::new(p.len(), 1, p), ev, ToneCurve::Standard)
            };
            for (a, b) in shot(pixels).pixels().iter().zip(shot(dim).pixels()) {
                for i in 0..3 { prop_assert!(a[i].abs_diff(b[i]) <= 1); }
            }
        }
    }

    #[test]
    fn ends_and_order() {
        for tone in TONES {
            let e = Encoder::new(curve(tone, 1.0));
            assert_eq!(e.encode(Vec3::ZERO), [0; 3]);
            assert_eq!(e.encode(Vec3::splat(6.0)), [255; 3]);
            assert!(
                e.table.least().windows(2).all(|w| w[0] < w[1]),
                "each code is reached"
            );
        }
        // A well-known pair of sRGB values.
        assert_eq!(
            Encoder::new(curve(ToneCurve::Linear, 1.0)).encode(Vec3::splat(0.2140)),
            [127; 3]
        );
    }

    #[test]
    fn middle_grey_has_its_place() {
        let ev = 12.0;
        let grey = Vec3::splat(0.125 * 4096.0);
        let shot = |tone| *shown(&Image::new(1, 1, vec![grey]), ev, tone).at(0, 0);
        assert_eq!(shot(ToneCurve::Linear), [118; 3]);
        assert_eq!(shot(ToneCurve::Filmic), [125; 3]);
        assert_eq!(shot(ToneCurve::Standard), [118; 3]);
        let auto = Exposure::default().ev100(log_mean_luminance(&[grey; 9]));
        assert!((auto - ev).abs() < 1e-5, "{auto}");
    }

    #[test]
    fn the_standard_curve_is_that_of_a_camera() {
        // What Adobe's default curve shows of greys, in stops from the one it shows as 18 %.
        let of_adobe = [
            (-5.0, 8.0),
            (-4.0, 15.0),
            (-3.0, 26.0),
            (-2.0, 45.0),
            (-1.0, 75.0),
            (0.0, 118.0),
            (1.0, 171.0),
            (2.0, 217.0),
            (3.0, 248.0),
        ];
        for (stops, code) in of_adobe {
            let x = MIDDLE_GREY * libm::exp2(stops);
            let got = 255.0 * srgb_oetf(ToneCurve::Standard.apply(x));
            assert!((got - code).abs() <= 3.0, "{got} at {stops} stops");
        }
        let stops = libm::log2(ToneCurve::Standard.white() / MIDDLE_GREY);
        assert!((stops - 3.41).abs() < 0.02, "{stops}");
    }

    /// Shot noise is that of the electrons of a light, however the picture shows it.
    #[test]
    fn noise_is_that_of_the_light_behind_any_curve_and_contrast() {
        const PIXELS: usize = 20_000;
        let noise = SensorNoise {
            full_well_e: 4000.0,
            read_noise_e: 0.0,
            gain: 1.0,
            gain_below_ev: -20.0,
            prnu: 0.0,
            dsnu_e: 0.0,
            bits: 16,
            serial: Key::world(5),
        };
        let ev100 = 12.0;
        let linear = Image::new(PIXELS, 1, vec![Vec3::splat(0.125 * 4096.0); PIXELS]);
        let electrons = MIDDLE_GREY / ToneCurve::Standard.white() * noise.full_well_e;
        for tone in TONES {
            for contrast in [0.7, 1.0, 1.6] {
                let processing = Processing {
                    contrast,
                    ..Processing::default()
                };
                let key = Key::world(1);
                let shot = develop(&linear, ev100, tone, Some(noise), &processing, key);
                // The light in the middle of each code, by bisection.
                let curve = curve(tone, contrast);
                let light = |code: u8| {
                    let (mut low, mut high) = (0.0, curve.white());
                    for _ in 0..60 {
                        let middle = 0.5 * (low + high);
                        if 255.0 * srgb_oetf(curve.apply(middle)) < f64::from(code) {
                            low = middle;
                        } else {
                            high = middle;
                        }
                    }
                    low
                };
                let of_codes: Vec<f64> = (0..=255).map(light).collect();
                let lights = shot.pixels().iter().map(|c| of_codes[usize::from(c[1])]);
                let lights: Vec<f64> = lights.collect();
                let mean = lights.iter().sum::<f64>() / PIXELS as f64;
                let squares: f64 = lights.iter().map(|l| (l - mean).powi(2)).sum();
                let relative = (squares / PIXELS as f64).sqrt() / mean;
                let exact = electrons.sqrt().recip();
                assert!(
                    (relative / exact - 1.0).abs() < 0.05,
                    "{tone:?} {contrast}: {relative} for {exact}"
                );
            }
        }
    }

    #[test]
    fn black_pictures_and_bad_settings() {
        assert!(log_mean_luminance(&[Vec3::ZERO; 4]) > 0.0);
        assert!(Exposure::Fixed { ev100: f64::NAN }.check().is_err());
        assert!(
            Exposure::Auto {
                key: 0.0,
                least_ev100: -10.0,
                bias_ev: 0.0
            }
            .check()
            .is_err()
        );
    }
}
