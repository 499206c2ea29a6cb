//! What a camera makes of a sensor's values before they are a file.

use glam::Vec3;
use rayon::prelude::*;

use super::denoise::denoise;
use super::jpeg::Jpeg;
use super::luma::luma;
use super::sharpening::sharpen;
use super::white_balance::WhiteBalance;
use crate::error::{ParamError, check};

/// What a camera makes of a sensor's values before they are a file, in this order: white balance,
/// contrast and tone curve, noise reduction, saturation, sharpening, JPEG. The default does none of
/// it.
///
/// Noise reduction is a filter of code values. In dark pictures that matters: the curve has spread
/// the noise of shadows over many codes and cut what is below black, so that filtered shadows are
/// slightly brighter than their light was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Processing {
    /// White balance.
    pub white_balance: WhiteBalance,
    /// Slope of logarithmic brightness about middle grey before the tone curve, 0.6..=2; 1 leaves
    /// it to the curve.
    pub contrast: f64,
    /// Strength of noise reduction, after the tone curve, 0..=1; 0 for none.
    pub denoising: f64,
    /// Factor on the distance of code values from their luma, 0..=3: 0 is grey, 1 leaves colours.
    pub saturation: f64,
    /// Strength of an unsharp mask of luma, 0..=5; 0 for none.
    pub sharpening: f64,
    /// Its spread, pixels, 0.3..=10.
    pub sharpening_radius_px: f64,
    /// The compression whose artefacts the picture has.
    pub jpeg: Option<Jpeg>,
}

impl Default for Processing {
    fn default() -> Self {
        Self {
            white_balance: WhiteBalance::default(),
            contrast: 1.0,
            denoising: 0.0,
            saturation: 1.0,
            sharpening: 0.0,
            sharpening_radius_px: 1.0,
            jpeg: None,
        }
    }
}

impl Processing {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        for (field, value, low, high, allowed) in [
            ("processing.contrast", self.contrast, 0.6, 2.0, "0.6..=2"),
            ("processing.denoising", self.denoising, 0.0, 1.0, "0..=1"),
            ("processing.saturation", self.saturation, 0.0, 3.0, "0..=3"),
            ("processing.sharpening", self.sharpening, 0.0, 5.0, "0..=5"),
            (
                "processing.sharpening_radius_px",
                self.sharpening_radius_px,
                0.3,
                10.0,
                "0.3..=10 pixels",
            ),
        ] {
            check(field, value, low, high, allowed)?;
        }
        if let Some(jpeg) = &self.jpeg {
            jpeg.check()?;
        }
        self.white_balance.check()
    }

    /// Whether code values need no more than the tone curve.
    pub(super) fn leaves_levels(&self) -> bool {
        self.denoising == 0.0 && self.saturation == 1.0 && self.sharpening == 0.0
    }

    /// The code values of a picture's levels, which are code values before rounding, row by row.
    pub(super) fn codes(&self, mut levels: Vec<Vec3>, width: usize) -> Vec<[u8; 3]> {
        denoise(&mut levels, width, self.denoising);
        saturate(&mut levels, self.saturation);
        sharpen(
            &mut levels,
            width,
            self.sharpening,
            self.sharpening_radius_px,
        );
        let code = |c: &Vec3| c.to_array().map(|x| x.round() as u8);
        levels.par_iter().map(code).collect()
    }
}

fn saturate(levels: &mut [Vec3], factor: f64) {
    if factor == 1.0 {
        return;
    }
    let factor = factor as f32;
    levels.par_iter_mut().for_each(|c| {
        let grey = Vec3::splat(luma(*c));
        *c = grey + (*c - grey) * factor;
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saturation_scales_chroma_and_keeps_luma() {
        let colour = Vec3::new(90.0, 140.0, 60.0);
        let of = |saturation| {
            let processing = Processing {
                saturation,
                ..Processing::default()
            };
            let c = processing.codes(vec![colour; 4], 2)[3];
            Vec3::from_array(c.map(f32::from))
        };
        let grey = luma(colour);
        for factor in [0.0, 0.5, 1.0, 1.4] {
            let c = of(factor);
            assert!((luma(c) - grey).abs() < 0.6, "{factor}: {c}");
            let exact = Vec3::splat(grey) + (colour - Vec3::splat(grey)) * factor as f32;
            assert!((c - exact).abs().max_element() <= 0.5, "{factor}: {c}");
        }
    }

    #[test]
    fn values_outside_of_codes_are_clipped() {
        let codes = Processing::default().codes(vec![Vec3::new(-3.0, 300.0, 254.6)], 1);
        assert_eq!(codes, [[0, 255, 255]]);
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let bad = |p: Processing| p.check().expect_err("bad").field;
        let plain = Processing::default();
        assert!(plain.check().is_ok());
        assert_eq!(
            bad(Processing {
                contrast: 0.0,
                ..plain
            }),
            "processing.contrast"
        );
        let jpeg = Some(Jpeg {
            quality: 0,
            subsampled: true,
        });
        assert_eq!(bad(Processing { jpeg, ..plain }), "processing.jpeg_quality");
        let white_balance = WhiteBalance {
            tint: f64::NAN,
            ..WhiteBalance::default()
        };
        assert_eq!(
            bad(Processing {
                white_balance,
                ..plain
            }),
            "white_balance.tint"
        );
    }
}
