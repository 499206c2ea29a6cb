//! A referee for rays on which two casters differ: it tests every triangle in f64, in scene
//! coordinates.

use nemoral_scene::Ray;
use nemoral_scene::glam::DVec3;

use crate::placed::{Instance, Placed, Triangle, bounds_of};

/// The distance of the nearest hit; infinite if there is none. Shares no code with any caster.
pub(crate) fn nearest(placed: &Placed, ray: &Ray) -> f64 {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let boxes: Vec<_> = placed.shapes.iter().map(|s| bounds_of(s)).collect();
    let mut best = f64::INFINITY;
    for instance in &placed.instances {
        let (min, max) = instance.bounds(boxes[instance.shape]);
        if passes(o, d, min - 1e-3, max + 1e-3) {
            for triangle in &placed.shapes[instance.shape] {
                if let Some(t) = meet(placed, instance, triangle, o, d) {
                    best = best.min(t);
                }
            }
        }
    }
    if best <= f64::from(ray.t_max_m) {
        best
    } else {
        f64::INFINITY
    }
}

fn passes(o: DVec3, d: DVec3, min: DVec3, max: DVec3) -> bool {
    let (a, b) = ((min - o) / d, (max - o) / d);
    a.min(b).max_element().max(0.0) <= a.max(b).min_element()
}

/// The intersection test of Möller and Trumbore (1997).
fn meet(
    placed: &Placed,
    instance: &Instance,
    triangle: &Triangle,
    o: DVec3,
    d: DVec3,
) -> Option<f64> {
    let linear = instance.linear.as_dmat3();
    let [a, b, c] = triangle
        .corners
        .map(|p| linear * p.as_dvec3() + instance.position);
    let (e, f) = (b - a, c - a);
    let p = d.cross(f);
    let det = e.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = o - a;
    let u = s.dot(p) / det;
    let q = s.cross(e);
    let v = d.dot(q) / det;
    let t = f.dot(q) / det;
    if u < 0.0 || v < 0.0 || u + v > 1.0 || t < 0.0 {
        return None;
    }
    let Some(mask) = triangle.mask else {
        return Some(t);
    };
    let mask = &placed.masks[mask as usize];
    let [s, x, y] = triangle.uvs.map(|uv| uv.as_dvec2());
    let uv = s + (x - s) * u + (y - s) * v;
    let texel = |x: f64, n: usize| ((x.clamp(0.0, 1.0) * n as f64) as usize).min(n - 1);
    mask.texel(texel(uv.x, mask.width()), texel(uv.y, mask.height()))
        .then_some(t)
}
