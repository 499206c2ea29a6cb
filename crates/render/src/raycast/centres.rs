//! The rays through the centres of pixels: truth, and the first sample of colour.

use glam::{DVec2, Vec3};
use nemoral_scene::{Hit, Image, ObjectId, Ray, Semantic, TruthImages};
use rayon::prelude::*;

use super::{BATCH, ROWS, RayCastCamera, truth};
use crate::error::ParamError;
use crate::maps::filled;
use crate::{SceneView, View};

/// The middle of a pixel, column and row.
pub(super) fn centre((x, y): (usize, usize)) -> DVec2 {
    DVec2::new(x as f64 + 0.5, y as f64 + 0.5)
}

impl RayCastCamera {
    /// What is exactly at each pixel's centre, without colour: as in [`render`](crate::CameraRenderer::render).
    ///
    /// # Errors
    /// If the view is impossible.
    pub fn truth(&self, scene: &SceneView<'_>, view: &View) -> Result<TruthImages, ParamError> {
        view.check()?;
        let k = &view.intrinsics;
        let (width, height) = (k.width as usize, k.height as usize);
        let n = width * height;
        let mut semantic = filled(Semantic::Sky, n);
        let mut object = filled(ObjectId::NONE, n);
        let mut depth_m = filled(0.0, n);
        let mut normal = filled(Vec3::ZERO, n);
        let band = ROWS * width;
        let bands = (
            semantic.par_chunks_mut(band),
            object.par_chunks_mut(band),
            depth_m.par_chunks_mut(band),
            normal.par_chunks_mut(band),
        );
        bands.into_par_iter().enumerate().for_each(
            |(index, (semantic, object, depth_m, normal))| {
                self.cast_band(scene, view, index, |i, pixel, ray, hit| {
                    let t = truth(scene, view, centre(pixel), ray, hit);
                    semantic[i] = t.semantic;
                    object[i] = t.object;
                    depth_m[i] = t.depth_m;
                    normal[i] = t.normal;
                });
            },
        );
        Ok(TruthImages {
            semantic: Image::new(width, height, semantic),
            object: Image::new(width, height, object),
            depth_m: Image::new(width, height, depth_m),
            normal: Image::new(width, height, normal),
        })
    }

    /// Casts the rays through the centres of a band of [`ROWS`] rows, or of those that are left, in batches, and
    /// tells of each: the pixel's number in the band, its column and row, its ray, and what that hits.
    pub(super) fn cast_band(
        &self,
        scene: &SceneView<'_>,
        view: &View,
        band: usize,
        mut tell: impl FnMut(usize, (usize, usize), &Ray, Option<&Hit>),
    ) {
        let k = &view.intrinsics;
        let (width, height) = (k.width as usize, k.height as usize);
        let top = band * ROWS;
        let rows = ROWS.min(height - top);
        let (mut rays, mut hits) = (Vec::new(), Vec::new());
        let strip = BATCH / ROWS;
        for left in (0..width).step_by(strip) {
            let columns = strip.min(width - left);
            let pixels = (0..rows * columns).map(|i| (left + i % columns, top + i / columns));
            let ray = |pixel| view.ray(centre(pixel), self.params.max_range_m);
            rays.clear();
            rays.extend(pixels.clone().map(ray));
            hits.clear();
            hits.resize(rays.len(), None);
            scene.caster.closest_hits(&rays, &mut hits);
            for ((pixel, ray), hit) in pixels.zip(&rays).zip(&hits) {
                let (x, y) = pixel;
                tell((y - top) * width + x, pixel, ray, hit.as_ref());
            }
        }
    }
}
