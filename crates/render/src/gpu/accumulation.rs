//! A picture's light as the mean of several instants or sample positions.

use glam::{DVec2, Vec3};
use nemoral_scene::Image;

use super::backdrop::Backdrop;
use super::params::GpuParams;
use super::readback::Readback;
use super::{Gpu, GpuError};
use crate::{Lighting, View};

/// The four samples of a pixel; they must equal those in `lighting.wgsl`.
const SAMPLES: [DVec2; 4] = [
    DVec2::new(-0.125, -0.375),
    DVec2::new(0.375, -0.125),
    DVec2::new(-0.375, 0.125),
    DVec2::new(0.125, 0.375),
];

/// An image of colours that is being read back.
pub(crate) struct PendingReadback {
    pub(crate) view: View,
    pub(crate) readback: Readback,
    pub(crate) submission: wgpu::SubmissionIndex,
}

impl PendingReadback {
    pub(crate) fn add(
        self,
        gpu: &Gpu,
        (lighting, backdrop): (&Lighting, Backdrop),
        sum: &mut [Vec3],
    ) -> Result<(), GpuError> {
        self.readback.read(gpu, &self.submission, |rows| {
            backdrop.compose(rows, &self.view, lighting, sum);
        })
    }
}

/// The light of a picture: the sum of its instants, the last of which is still being read back.
pub(crate) struct AccumulatedLight {
    pub(crate) backdrop: Backdrop,
    pub(crate) sum: Vec<Vec3>,
    /// The number of instants.
    pub(crate) count: usize,
    pub(crate) last: PendingReadback,
}

impl AccumulatedLight {
    pub(crate) fn read(mut self, gpu: &Gpu, lighting: &Lighting) -> Result<Image<Vec3>, GpuError> {
        let k = self.last.view.intrinsics;
        let behind = (lighting, self.backdrop);
        self.last.add(gpu, behind, &mut self.sum)?;
        for c in &mut self.sum {
            *c /= self.count as f32;
        }
        Ok(Image::new(k.width as usize, k.height as usize, self.sum))
    }
}

/// The views whose mean is a picture: one for each instant or sample position.
pub(crate) fn instants(gpu: &Gpu, params: &GpuParams, view: &View) -> Vec<View> {
    // Where the GPU's shaders cannot choose samples, several pictures of one sample replace them.
    let several = params.colour_samples > 1 && !gpu.chooses_samples();
    let places: &[DVec2] = if several { &SAMPLES } else { &[DVec2::ZERO] };
    let count = if view.blurs() {
        params.blur_samples as usize
    } else {
        places.len()
    };
    let instant = |i: usize| {
        let mut instant = *view;
        if view.blurs() {
            let part = (i as f64 + 0.5) / count as f64 - 0.5;
            instant = view.later(part * view.shutter.exposure_s);
        }
        let place = places[i % places.len()];
        instant.intrinsics.cx -= place.x;
        instant.intrinsics.cy -= place.y;
        instant
    };
    (0..count).map(instant).collect()
}
