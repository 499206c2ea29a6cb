//! Truth without a picture.

use glam::{DVec2, Vec3};
use nemoral_scene::{Image, ObjectId, Semantic, TruthImages};
use rayon::prelude::*;

use super::{BATCH, ROWS, RayCastCamera, truth};
use crate::error::ParamError;
use crate::maps::filled;
use crate::{SceneView, View};

impl RayCastCamera {
    /// What is exactly at each pixel's centre, without colour: the same rays in the same batches, and the
    /// same answers, as in [`render`](crate::CameraRenderer::render).
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
                let (rows, top) = (semantic.len() / width, index * ROWS);
                let strip = BATCH / ROWS;
                let (mut rays, mut hits) = (Vec::new(), Vec::new());
                for left in (0..width).step_by(strip) {
                    let columns = strip.min(width - left);
                    // Pixels of the band, and their centres.
                    let at = |i: usize| {
                        DVec2::new((i % width) as f64 + 0.5, (top + i / width) as f64 + 0.5)
                    };
                    let pixels =
                        (0..rows * columns).map(|i| i / columns * width + left + i % columns);
                    rays.clear();
                    rays.extend((pixels.clone()).map(|i| view.ray(at(i), self.params.max_range_m)));
                    hits.clear();
                    hits.resize(rays.len(), None);
                    scene.caster.closest_hits(&rays, &mut hits);
                    for ((i, ray), hit) in pixels.zip(&rays).zip(&hits) {
                        let t = truth(scene, view, at(i), ray, hit.as_ref());
                        semantic[i] = t.semantic;
                        object[i] = t.object;
                        depth_m[i] = t.depth_m;
                        normal[i] = t.normal;
                    }
                }
            },
        );
        Ok(TruthImages {
            semantic: Image::new(width, height, semantic),
            object: Image::new(width, height, object),
            depth_m: Image::new(width, height, depth_m),
            normal: Image::new(width, height, normal),
        })
    }
}
