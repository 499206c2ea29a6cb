//! Optical flow between two views of a scene that stands still.

use glam::DVec2;
use nemoral_scene::{Flow, Image, Ray, RayCaster, TruthImages};
use rayon::prelude::*;

use super::pixel_centre;
use crate::View;

/// Where each surface of a picture is in the next one. The world stands still, so this follows from
/// depth and the two views; whether the next picture shows a surface is found by a ray.
///
/// `truth` is what `view` sees; both views are in the frame of `caster`'s scene.
#[must_use]
pub fn optical_flow(
    caster: &dyn RayCaster,
    truth: &TruthImages,
    view: &View,
    next: &View,
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
                seen: inside,
            });
            if inside {
                let eye = next.scene_from_row(at.y).translation_m;
                let way = place - eye;
                let far_m = way.length();
                // The ray ends short of the surface itself, by the error of f32 under grazing
                // incidence.
                let spare_m = 1e-3 + 2e-4 * far_m;
                rays.push(Ray {
                    origin: eye.as_vec3(),
                    direction: (way / far_m).as_vec3(),
                    t_min_m: 0.0,
                    t_max_m: (far_m - spare_m) as f32,
                });
                of.push(x);
            }
        }
        let mut hidden = vec![false; rays.len()];
        caster.are_occluded(&rays, &mut hidden);
        for (&x, hidden) in of.iter().zip(hidden) {
            if let Some(flow) = &mut row[x] {
                flow.seen = !hidden;
            }
        }
        row
    };
    let pixels = (0..height).into_par_iter().flat_map_iter(row).collect();
    Image::new(width, height, pixels)
}
