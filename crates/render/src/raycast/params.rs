//! The parameters of the ray-cast camera.

use crate::camera::lens::Lens;
use crate::error::{ParamError, check};

/// The parameters of a ray-cast picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayCastParams {
    /// Colour samples of every pixel, 1..=256; the first lies at its centre.
    pub colour_samples: u32,
    /// Further colour samples of pixels on silhouettes, 0..=256.
    pub edge_samples: u32,
    /// The most further samples for silhouettes, as a share of the number of pixels, 0..=256; the
    /// strongest contrasts are served first.
    pub edge_budget: f32,
    /// The least number of colour samples of every pixel of a picture with motion blur, 2..=256,
    /// one in each of as many equal parts of the exposure.
    pub blur_samples: u32,
    /// The number of surfaces over which light is followed by random rays, 0..=16. After the last
    /// one, the mean light of its place is used; with 0 it is used at once.
    pub bounces: u32,
    /// The greatest visible distance, metres, 1..=100,000; surfaces fade into the sky towards it.
    pub max_range_m: f32,
    /// Scattering and fall-off of the lens.
    pub lens: Lens,
    /// Whether the radiance image is returned, too.
    pub keep_linear: bool,
}

impl RayCastParams {
    /// One ray per pixel, for previews and speed.
    #[must_use]
    pub fn draft() -> Self {
        Self {
            edge_samples: 0,
            ..Self::default()
        }
    }

    /// Four samples everywhere and twelve on silhouettes, for figures.
    #[must_use]
    pub fn fine() -> Self {
        Self {
            colour_samples: 4,
            edge_samples: 8,
            edge_budget: 8.0,
            ..Self::default()
        }
    }
}

impl Default for RayCastParams {
    /// One sample of every pixel and a second one on silhouettes.
    fn default() -> Self {
        Self {
            colour_samples: 1,
            edge_samples: 1,
            edge_budget: 1.0,
            blur_samples: 9,
            bounces: 0,
            max_range_m: 300.0,
            lens: Lens::default(),
            keep_linear: false,
        }
    }
}

impl RayCastParams {
    /// # Errors
    /// If a parameter is out of its range.
    pub(super) fn check(&self) -> Result<(), ParamError> {
        check(
            "camera.colour_samples",
            self.colour_samples.into(),
            1.0,
            256.0,
            "1..=256",
        )?;
        check(
            "camera.edge_samples",
            self.edge_samples.into(),
            0.0,
            256.0,
            "0..=256",
        )?;
        check(
            "camera.edge_budget",
            self.edge_budget.into(),
            0.0,
            256.0,
            "0..=256",
        )?;
        check(
            "camera.blur_samples",
            self.blur_samples.into(),
            2.0,
            256.0,
            "2..=256",
        )?;
        check("camera.bounces", self.bounces.into(), 0.0, 16.0, "0..=16")?;
        check(
            "camera.max_range_m",
            self.max_range_m.into(),
            1.0,
            1e5,
            "1..=100,000 m",
        )?;
        self.lens.check()
    }
}
