//! Keys of what sets one camera's pictures apart from another's: colour, lens and processing.

use crate::schema::AllowedValues::{Flag, OneOf, Real, Whole};
use crate::schema::section;
use crate::{ToneChoice, VignettingModel, WhiteBalanceMode};

section! {
    /// The camera's white balance: the light that it takes for white, and the errors it makes.
    CameraWhiteBalance at "camera.white_balance" {
        /// Whether white is a light that was set (`fixed`), or found in each picture (`auto`): the
        /// mean of its pixels is then taken for grey under the nearest light.
        mode: WhiteBalanceMode = WhiteBalanceMode::Fixed, OneOf(WhiteBalanceMode::WORDS),
            "colours as the light had them; `auto` is Finlayson and Trezzi 2004";
        /// The `fixed` light. Below 6504, pictures of daylight are blue, above they are orange.
        kelvin: f64 = 6504.0, Real(2500.0, 12_000.0), "D65, sRGB's white";
        /// Added to the temperature that was set or found: above 0 pictures are warmer.
        error_k: f64 = 0.0, Real(-10_000.0, 10_000.0), "none";
        /// Error across the line of temperatures: above 0 pictures are more magenta, below greener.
        /// 3000 units are 1 in CIE 1960 (u, v).
        tint: f64 = 0.0, Real(-150.0, 150.0), "none; the unit of Adobe's DNG SDK";
    }
}

section! {
    /// The camera's tone and colour.
    CameraTone at "camera.tone" {
        /// The curve from light to brightness: that of `camera.look`, a camera's standard picture,
        /// proportional to light, or a film's with a soft toe and shoulder.
        curve: ToneChoice = ToneChoice::Look, OneOf(ToneChoice::WORDS), "as the look says";
        /// Slope of logarithmic brightness about middle grey, before that curve.
        contrast: f64 = 1.0, Real(0.6, 2.0), "the curve's own";
        /// Factor on the distance of colours from grey of the same luma: 0 is black and white.
        saturation: f64 = 1.0, Real(0.0, 3.0), "as they are; 1.1 to 1.4 of vivid modes";
    }
}

section! {
    /// How corners darken.
    CameraVignetting at "camera.vignetting" {
        /// As `camera.look` says, by the fourth power of the cosine of the angle from the axis, or
        /// by a polynomial in the distance from the principal point.
        model: VignettingModel = VignettingModel::Look, OneOf(VignettingModel::WORDS),
            "as the look says";
        /// How much of that fall-off `cos4` has: 0 none, 1 all of it.
        strength: f64 = 1.0, Real(0.0, 1.0), "a plain lens";
        /// The `polynomial` is 1 + a2 ρ² + a4 ρ⁴ + a6 ρ⁶, with ρ = 1 half a diagonal from the
        /// principal point; it must stay between 0 and 2 all over the picture.
        a2: f64 = -0.3, Real(-2.0, 2.0), "our choice: corners half a stop darker";
        /// Of the fourth power.
        a4: f64 = 0.0, Real(-2.0, 2.0), "none";
        /// Of the sixth power.
        a6: f64 = 0.0, Real(-2.0, 2.0), "none";
    }
}

section! {
    /// Lateral chromatic aberration: red and blue are imaged larger or smaller than green, so that
    /// edges far from the middle have coloured fringes.
    CameraAberration at "camera.aberration" {
        /// Shift of red half a diagonal from the principal point, outwards, pixels; elsewhere in
        /// proportion to the distance.
        red_px: f64 = 0.0, Real(-50.0, 50.0), "none; 0.5 to 2 of cheap wide lenses";
        /// The same for blue.
        blue_px: f64 = 0.0, Real(-50.0, 50.0), "none; often opposite to red";
    }
}

section! {
    /// What the camera does to a picture before it is a file. It is written as PNG in any case,
    /// with the artefacts that a JPEG would have.
    CameraProcessing at "camera.processing" {
        /// Strength of noise reduction, a bilateral filter; it takes fine texture with the noise.
        denoising: f64 = 0.0, Real(0.0, 1.0), "off; Tomasi and Manduchi 1998";
        /// Strength of sharpening, an unsharp mask of luma.
        sharpening: f64 = 0.0, Real(0.0, 5.0), "off; 0.2 to 1 in most cameras";
        /// Spread of that mask.
        sharpening_radius_px: f64 = 1.0, Real(0.3, 10.0), "our choice: 0.5-2";
        /// Quality of the JPEG whose artefacts the picture has, on the scale of the Independent
        /// JPEG Group; 0 for none.
        jpeg_quality: u32 = 0, Whole(0, 100), "none; 75 to 95 in most cameras";
        /// Whether that JPEG has colours at half the resolution (4:2:0).
        jpeg_subsampling: bool = true, Flag, "as most cameras do";
    }
}

section! {
    /// Dirt and drops on the lens, out of focus. They are the same in all pictures of a sequence,
    /// and in the picture alone: truth sees through them.
    CameraSoiling at "camera.soiling" {
        /// Specks of dirt.
        specks: u32 = 0, Whole(0, 2000), "a clean lens";
        /// Mean radius of a speck, as a share of the picture's width.
        speck_radius: f64 = 0.015, Real(0.001, 0.2), "our choice: soft spots";
        /// Share of light that a dense speck stops in its middle.
        opacity: f64 = 0.6, Real(0.0, 1.0), "our choice: thin mud";
        /// Share of what it stops that it scatters into the camera.
        albedo: f64 = 0.25, Real(0.0, 1.0), "our choice: soil, dust 0.4";
        /// Drops of water, each of which shows its surroundings upside down.
        drops: u32 = 0, Whole(0, 500), "a dry lens";
        /// Mean radius of a drop, as a share of the picture's width.
        drop_radius: f64 = 0.02, Real(0.001, 0.2), "our choice: 2 mm near a small lens";
    }
}
