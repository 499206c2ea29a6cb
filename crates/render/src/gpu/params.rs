//! The parameters of the GPU camera.

use crate::Lens;
use crate::error::{ParamError, check};

/// The parameters of pictures by the GPU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GpuParams {
    /// The greatest visible distance, metres, 1..=100,000; surfaces fade into the sky towards it.
    pub max_range_m: f32,
    /// Scattering and fall-off of the lens.
    pub lens: Lens,
    /// Whether the radiance image is returned, too.
    pub keep_linear: bool,
    /// Colour samples of a pixel: 1, at its centre, or 4.
    pub colour_samples: u32,
    /// Number of instants of a picture with motion blur, 2..=256, one in each of as many equal
    /// parts of the exposure; each is drawn with `colour_samples`.
    pub blur_samples: u32,
    /// Side of each shadow map, texels, 256..=8192.
    pub shadow_px: u32,
    /// The most device memory that is used, MiB, 128..=1,048,576.
    pub memory_mib: u32,
}

impl Default for GpuParams {
    fn default() -> Self {
        Self {
            max_range_m: 300.0,
            lens: Lens::default(),
            keep_linear: false,
            colour_samples: 4,
            blur_samples: 9,
            shadow_px: 2048,
            memory_mib: 4096,
        }
    }
}

impl GpuParams {
    /// # Errors
    /// If a parameter is out of its range.
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        let range = self.max_range_m.into();
        check("camera.max_range_m", range, 1.0, 1e5, "1..=100,000 m")?;
        self.lens.check()?;
        // WebGPU guarantees these two numbers.
        if ![1, 4].contains(&self.colour_samples) {
            return Err(ParamError::new(
                "camera.colour_samples",
                self.colour_samples,
                "1 or 4",
            ));
        }
        let instants = self.blur_samples.into();
        check("camera.blur_samples", instants, 2.0, 256.0, "2..=256")?;
        let shadow = self.shadow_px.into();
        check("camera.shadow_px", shadow, 256.0, 8192.0, "256..=8192")?;
        let memory = self.memory_mib.into();
        check(
            "camera.memory_mib",
            memory,
            128.0,
            1_048_576.0,
            "128..=1,048,576 MiB",
        )
    }
}
