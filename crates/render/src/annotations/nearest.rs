//! The nearest surface on each pixel's ray, of a scene from which parts were taken away.

use nemoral_scene::{Image, ObjectId, Ray, RayCaster};
use rayon::prelude::*;

use super::pixel_centre;
use crate::View;

/// Distance and owner of the nearest surface on the ray of each pixel's centre, of a scene from
/// which things were taken away; infinite and [`ObjectId::NONE`] where there is none.
#[must_use]
pub fn nearest_objects(
    caster: &dyn RayCaster,
    view: &View,
    max_range_m: f32,
) -> Image<(f32, ObjectId)> {
    let (width, height) = (
        view.intrinsics.width as usize,
        view.intrinsics.height as usize,
    );
    let row = |y: usize| {
        let rays: Vec<Ray> = (0..width)
            .map(|x| view.ray(pixel_centre(x, y), max_range_m))
            .collect();
        let mut hits = vec![None; width];
        caster.closest_hits(&rays, &mut hits);
        hits.into_iter().map(|hit| {
            hit.map_or((f32::INFINITY, ObjectId::NONE), |h| {
                (h.surface.distance_m, h.surface.object)
            })
        })
    };
    let pixels = (0..height).into_par_iter().flat_map_iter(row).collect();
    Image::new(width, height, pixels)
}
