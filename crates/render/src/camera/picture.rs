//! From the light of a scene to a picture, for every renderer.

use glam::Vec3;
use nemoral_scene::{Image, TruthImages};
use nemoral_seed::Key;
use rayon::prelude::*;

use super::lens::Lens;
use super::point_spread::spread;
use super::tone::develop;
use super::view::View;
use crate::light::lamp::LampInAir;

/// A picture of the light that a renderer computed.
pub(crate) struct Picture {
    /// Code values.
    pub(crate) rgb: Image<[u8; 3]>,
    /// The light behind the lens.
    pub(crate) linear: Image<Vec3>,
    /// The exposure as EV at ISO 100.
    pub(crate) ev100: f64,
}

/// The light around a camera that is on no surface.
pub(crate) struct Surroundings<'a> {
    /// The mean radiance from all sides.
    pub(crate) ambient: Vec3,
    /// The lamps that shine.
    pub(crate) lamps: &'a [LampInAir],
}

/// Takes the picture of the light in front of a lens; `key` is for the sensor's noise alone.
pub(crate) fn take(
    light: Image<Vec3>,
    around: &Surroundings<'_>,
    truth: &TruthImages,
    lens: &Lens,
    view: &View,
    key: Key,
) -> Picture {
    let (width, height) = (light.width(), light.height());
    let mut pixels = light.into_pixels();
    // One that is no number would be spread over others, and decide the exposure of all.
    let spoilt = pixels.par_iter_mut().filter(|c| !c.is_finite());
    spoilt.for_each(|c| *c = Vec3::ZERO);
    lens.aberration.apply(&mut pixels, &view.intrinsics);
    spread(&mut pixels, width, lens.spread_px);
    if let Some(precipitation) = &view.precipitation {
        precipitation.apply(&mut pixels, truth.depth_m.pixels(), view, around);
    }
    if let Some(soiling) = &view.soiling {
        soiling.apply(&mut pixels, width);
    }
    lens.apply(&mut pixels, &view.intrinsics);
    let semantic = truth.semantic.pixels();
    let metered = (view.metering).luminance(&pixels, width, semantic);
    let ev100 = view.exposure.ev100(metered) - view.exposure_error_ev;
    let linear = Image::new(width, height, pixels);
    Picture {
        rgb: develop(&linear, ev100, view.tone, view.noise, &view.processing, key),
        linear,
        ev100,
    }
}
