//! Jittered samples of pixels' colours besides the first one at each pixel's centre.

use glam::{DVec2, Vec3};
use nemoral_seed::{Draw, Key, Rng};
use rayon::prelude::*;

use super::context::{PictureContext, ShadowRays, sums_per_pixel};
use super::primary_rays::BATCH;

/// Samples that are added to those that a pixel has already.
#[derive(Clone, Copy)]
pub(super) struct AdditionalSamples {
    /// Samples that a pixel has already.
    before: u32,
    pub(super) samples: u32,
    /// The number of equal parts of the exposure, one for each sample.
    parts: u32,
    /// The part of the exposure that has a sample already, if any.
    done: Option<u32>,
}

impl AdditionalSamples {
    /// Samples after the first, which was taken in the middle of the exposure.
    pub(super) fn after_the_first(samples: u32) -> Self {
        let parts = samples + 1;
        Self {
            before: 1,
            samples,
            parts,
            done: Some(parts / 2),
        }
    }

    /// `samples` that cover the whole exposure, for pixels that have `before` samples already.
    pub(super) fn beside(before: u32, samples: u32) -> Self {
        Self {
            before,
            samples,
            parts: samples,
            done: None,
        }
    }

    /// When the samples of a pixel are taken, as shares of the exposure, -0.5..0.5: one in each
    /// part that is not done, in an order that does not depend on their positions in the pixel.
    fn times(&self, rng: &mut impl Rng, out: &mut Vec<f64>) {
        out.clear();
        out.extend(
            (0..self.parts)
                .filter(|&p| Some(p) != self.done)
                .map(f64::from),
        );
        for last in (1..out.len()).rev() {
            out.swap(last, rng.below(last as u32 + 1) as usize);
        }
        for part in out {
            *part = (*part + rng.unit_f64()) / f64::from(self.parts) - 0.5;
        }
    }
}

impl PictureContext<'_> {
    /// Adds jittered samples to those that some pixels (ascending) already have.
    pub(super) fn add_samples(
        &self,
        linear: &mut [Vec3],
        pixels: &[u32],
        additional: AdditionalSamples,
        key: Key,
    ) {
        let width = self.view.intrinsics.width;
        let AdditionalSamples {
            before, samples, ..
        } = additional;
        let blurs = self.view.blurs();
        let exposure_s = self.view.shutter.exposure_s;
        let range_m = self.params.max_range_m;
        let sums: Vec<Vec<Vec3>> = pixels
            .par_chunks((BATCH / samples as usize).max(1))
            .map(|pixels| {
                let (mut rays, mut suns) = (Vec::new(), Vec::new());
                let mut times = vec![0.0; samples as usize];
                for &pixel in pixels {
                    let mut rng = key.item(pixel.into()).rng();
                    let shift = DVec2::new(rng.unit_f64(), rng.unit_f64());
                    let corner = DVec2::new(f64::from(pixel % width), f64::from(pixel / width));
                    if blurs {
                        additional.times(&mut rng, &mut times);
                    }
                    for (k, &time) in times.iter().enumerate() {
                        // A randomly shifted Fibonacci lattice, which is even in rows and in
                        // columns.
                        let k = k as f64;
                        let at =
                            shift + DVec2::new(k / f64::from(samples), k * 0.618_033_988_749_895);
                        let at = corner + at - at.floor();
                        rays.push(self.view.ray_at(at, time * exposure_s, range_m));
                        suns.push(self.sun_disc.at_random(rng.next_u32()));
                    }
                }
                let mut hits = vec![None; rays.len()];
                self.scene.caster.closest_hits(&rays, &mut hits);
                if self.params.bounces > 0 {
                    let keys = pixels.iter().map(|&pixel| key.item(pixel.into()));
                    return self.path_traced(&rays, &hits, &suns, keys, samples as usize);
                }
                let mut shadows = ShadowRays::default();
                let (mut colours, suns): (Vec<Vec3>, Vec<Vec3>) = (0..rays.len())
                    .map(|k| {
                        let c = self.radiance(&rays[k], hits[k].as_ref(), suns[k]);
                        shadows.add(k, c.shadow);
                        (c.rest, c.sun)
                    })
                    .unzip();
                for k in shadows.lit(self.scene.caster) {
                    colours[k] += suns[k];
                }
                sums_per_pixel(&colours, samples as usize)
            })
            .collect();
        for (&pixel, sum) in pixels.iter().zip(sums.into_iter().flatten()) {
            let c = &mut linear[pixel as usize];
            *c = (*c * before as f32 + sum) / (before + samples) as f32;
        }
    }
}
