//! The rays through the centres of pixels: truth, and the first sample of colour.

use glam::{DVec2, Vec3};
use nemoral_scene::{Hit, Image, ObjectId, Ray, Semantic, TruthImages};
use rayon::prelude::*;

use super::frame_buffer::filled;
use super::pixel_truth::PixelTruth;
use crate::{SceneView, View};

/// Rows that are cast together.
pub(super) const ROWS: usize = 16;
/// Rays that are cast together, so many that a caster finds similar ones.
pub(super) const BATCH: usize = 4096;

/// The centre of a pixel (column, row), in pixels.
pub(super) fn pixel_centre((x, y): (usize, usize)) -> DVec2 {
    DVec2::new(x as f64 + 0.5, y as f64 + 0.5)
}

/// The truth at an image position whose ray was cast.
pub(super) fn pixel_truth(
    scene: &SceneView<'_>,
    view: &View,
    pixel: DVec2,
    ray: &Ray,
    hit: Option<&Hit>,
) -> PixelTruth {
    let Some(hit) = hit else {
        return PixelTruth {
            semantic: Semantic::Sky,
            object: ObjectId::NONE,
            depth_m: 0.0,
            normal: Vec3::ZERO,
        };
    };
    let away = hit.surface.geometric_normal.dot(ray.direction) > 0.0;
    let normal = hit.surface.geometric_normal * if away { -1.0 } else { 1.0 };
    PixelTruth {
        semantic: scene.materials.get(hit.surface.material).semantic,
        object: hit.surface.object,
        depth_m: (f64::from(hit.surface.distance_m) * view.intrinsics.direction(pixel).z) as f32,
        normal: view.to_optical(normal, pixel.y),
    }
}

/// The truth at each pixel's centre.
pub(super) fn truth_images(scene: &SceneView<'_>, view: &View, max_range_m: f32) -> TruthImages {
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
    bands
        .into_par_iter()
        .enumerate()
        .for_each(|(index, (semantic, object, depth_m, normal))| {
            cast_band(scene, view, max_range_m, index, |i, pixel, ray, hit| {
                let t = pixel_truth(scene, view, pixel_centre(pixel), ray, hit);
                semantic[i] = t.semantic;
                object[i] = t.object;
                depth_m[i] = t.depth_m;
                normal[i] = t.normal;
            });
        });
    TruthImages {
        semantic: Image::new(width, height, semantic),
        object: Image::new(width, height, object),
        depth_m: Image::new(width, height, depth_m),
        normal: Image::new(width, height, normal),
    }
}

/// Casts the rays through the centres of a band of [`ROWS`] rows, or of those that are left, in
/// batches of at most [`BATCH`]. Calls `visit` for each pixel with its number in the band, its
/// column and row, its ray, and the hit.
pub(super) fn cast_band(
    scene: &SceneView<'_>,
    view: &View,
    max_range_m: f32,
    band: usize,
    mut visit: impl FnMut(usize, (usize, usize), &Ray, Option<&Hit>),
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
        let ray = |pixel| view.ray(pixel_centre(pixel), max_range_m);
        rays.clear();
        rays.extend(pixels.clone().map(ray));
        hits.clear();
        hits.resize(rays.len(), None);
        scene.caster.closest_hits(&rays, &mut hits);
        for ((pixel, ray), hit) in pixels.zip(&rays).zip(&hits) {
            let (x, y) = pixel;
            visit((y - top) * width + x, pixel, ray, hit.as_ref());
        }
    }
}
