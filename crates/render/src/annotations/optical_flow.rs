//! Optical flow between two views of a world that stands still.

use glam::DVec2;
use nemoral_scene::{Flow, Image, Ray, RayCaster, TruthImages};
use rayon::prelude::*;

use super::pixel_centre;
use crate::View;

/// Where each surface of a picture is in the next one. Surfaces stand still, so this follows from
/// depth and the two views. Whether the next picture shows a surface is found by a ray: it must lie
/// within `max_range_m` of the next camera, metres, which is how far pictures show anything, and be
/// the first thing that is met there. What surrounds the two cameras need not be the same, as
/// details are left out farther away.
///
/// `truth` is what `view` sees. `caster` has the scene of the next picture, and both views are in
/// its frame.
#[must_use]
pub fn optical_flow(
    caster: &dyn RayCaster,
    truth: &TruthImages,
    view: &View,
    next: &View,
    max_range_m: f32,
) -> Image<Option<Flow>> {
    let depth = &truth.depth_m;
    let (width, height) = (depth.width(), depth.height());
    let size = DVec2::new(next.intrinsics.width.into(), next.intrinsics.height.into());
    let row = |y: usize| {
        let mut row = vec![None; width];
        let (mut rays, mut of) = (Vec::new(), Vec::new());
        for (x, out) in row.iter_mut().enumerate() {
            let z = f64::from(*depth.at(x, y));
            if z == 0.0 {
                continue;
            }
            let pixel = pixel_centre(x, y);
            let direction = view.intrinsics.direction(pixel);
            let here = view.scene_from_row(pixel.y);
            let place = here.transform_point(direction * (z / direction.z));
            let Some(at) = next.project(place) else {
                continue;
            };
            let inside = at.cmpge(DVec2::ZERO).all() && at.cmplt(size).all();
            *out = Some(Flow {
                offset_px: (at - pixel).as_vec2(),
                seen: false,
            });
            let eye = next.scene_from_row(at.y).translation_m;
            let way = place - eye;
            let far_m = way.length();
            if inside && far_m <= f64::from(max_range_m) {
                // The surface itself is met nearly there, by the error of f32 under grazing
                // incidence.
                let spare_m = 1e-3 + 2e-4 * far_m;
                rays.push(Ray {
                    origin: eye.as_vec3(),
                    direction: (way / far_m).as_vec3(),
                    t_min_m: 0.0,
                    t_max_m: (far_m + spare_m) as f32,
                });
                of.push((x, (far_m - spare_m) as f32));
            }
        }
        let mut surfaces = vec![None; rays.len()];
        caster.closest_surfaces(&rays, &mut surfaces);
        for ((x, least_m), surface) in of.into_iter().zip(surfaces) {
            if let (Some(flow), Some(surface)) = (&mut row[x], surface) {
                flow.seen = surface.distance_m >= least_m;
            }
        }
        row
    };
    let pixels = (0..height).into_par_iter().flat_map_iter(row).collect();
    Image::new(width, height, pixels)
}
