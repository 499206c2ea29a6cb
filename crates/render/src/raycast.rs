use nemoral_seed::Key;

use crate::error::ParamError;
use crate::{CameraImages, CameraRenderer, Lighting, SceneView, View};

/// How carefully a picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayCastParams {
    /// Colour samples of every pixel, 1..=256; the first is at its centre.
    pub colour_samples: u32,
    /// Further colour samples of pixels on an edge, 0..=256.
    pub edge_samples: u32,
    /// The most further rays for edges, as a share of the number of pixels, 0..=256.
    pub edge_budget: f32,
    /// How far is seen; everything fades into the sky towards there, metres, 1..=100,000.
    pub max_range_m: f32,
    /// Also return the radiance image?
    pub keep_linear: bool,
}

/// The camera that casts rays on the CPU.
#[derive(Clone, Debug)]
pub struct RayCastCamera {
    params: RayCastParams,
    lighting: Lighting,
}

impl RayCastCamera {
    /// A camera under a light.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: RayCastParams, lighting: Lighting) -> Result<Self, ParamError> {
        Ok(Self { params, lighting })
    }
}

impl CameraRenderer for RayCastCamera {
    type Error = ParamError;

    fn render(
        &self,
        _scene: &SceneView<'_>,
        view: &View,
        _key: Key,
    ) -> Result<CameraImages, ParamError> {
        view.check()?;
        let _ = (&self.params, &self.lighting);
        unimplemented!()
    }
}
