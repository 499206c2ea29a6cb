//! Tone curve and transfer function, which turn exposed light into code values.

use glam::Vec3;
use nemoral_scene::{CodeTable, Image};
use nemoral_seed::Key;
use rayon::prelude::*;

use super::exposure::{MIDDLE_GREY, scale_of};
use super::processing::Processing;
use super::sensor_noise::{Sensor, SensorNoise};

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
mod tests;
