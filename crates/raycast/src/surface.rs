//! From the nearest primitive to what a sensor wants to know of it.

use glam::{DVec3, Vec2, Vec3};
use nemoral_scene::{Hit, Instance, Mesh, Triangle};

use crate::blas::Blas;
use crate::block::Shape;
use crate::exact::Meeting;
use crate::group::Pose;
use crate::nearest::Found;

/// The interpolated texture coordinate.
#[inline(always)]
pub(crate) fn triangle_uv(mesh: &Mesh, triangle: &Triangle, m: &Meeting) -> Vec2 {
    let [a, b, c] = triangle.corners.map(|i| mesh.uv(i).as_dvec2());
    (a * (1.0 - m.u - m.v) + b * m.u + c * m.v).as_vec2()
}

/// The hit at a meeting of the ray with a primitive of an instance.
pub(crate) fn hit(
    blas: &Blas,
    instance: &Instance,
    pose: &Pose,
    found: &Found,
    distance_m: f32,
) -> Option<Hit> {
    let (primitive, m) = (found.rank.primitive, &found.meeting);
    let (shape, material) = blas.shape_at(primitive, &found.place)?;
    let linear = instance.linear.as_dmat3();
    let [edge_u, edge_v] = shape.edges();
    let mut blend = None;
    let mut near_light = 1.0;
    let (vertex_normal, uv, uv_area) = match shape {
        Shape::Triangle(_) => {
            let mesh = blas.prototype().mesh();
            let triangle = &mesh.triangles[primitive as usize];
            let normal = match triangle.corners.map(|i| mesh.normal(i)) {
                [Some(a), Some(b), Some(c)] => {
                    let [a, b, c] = [a, b, c].map(|n| n.as_dvec3());
                    Some(a * (1.0 - m.u - m.v) + b * m.u + c * m.v)
                }
                _ => None,
            };
            let [a, b, c] = triangle.corners.map(|i| mesh.uv(i).as_dvec2());
            let uv_area = (b - a).perp_dot(c - a).abs();
            blend = mesh.blends.get(primitive as usize).and_then(|blend| {
                let [a, b, c] = blend.shares.map(f64::from);
                let share = (a * (1.0 - m.u - m.v) + b * m.u + c * m.v) as f32;
                (share > 0.0).then_some((blend.other, share))
            });
            if let Some(near) = blas.prototype().near_light() {
                near_light = near.in_triangle(triangle.corners, m.u as f32, m.v as f32);
            }
            (normal, triangle_uv(mesh, triangle, m), uv_area)
        }
        Shape::Card(_) => {
            let uv = DVec3::new(m.u, m.v, 0.0).as_vec3().truncate();
            if let Some(near) = blas.prototype().near_light() {
                let card = primitive as usize - blas.prototype().mesh().triangles.len();
                near_light = near.on_card(card, uv.x, uv.y);
            }
            (None, uv, 1.0)
        }
    };
    let normal_to_scene = |n: DVec3| pose.normal_to_group(n).try_normalize();
    let geometric = normal_to_scene(edge_u.cross(edge_v)).unwrap_or(DVec3::Z);
    let shading = vertex_normal.and_then(normal_to_scene).unwrap_or(geometric);
    let side = if shading.dot(geometric) < 0.0 {
        -1.0
    } else {
        1.0
    };
    let area = (linear * edge_u).cross(linear * edge_v).length();
    Some(Hit {
        distance_m,
        geometric_normal: unit(geometric),
        shading_normal: unit(shading * side),
        uv,
        uv_per_m: (uv_area / area).sqrt() as f32,
        material,
        blend,
        object: instance.object,
        variation: instance.variation,
        near_light,
    })
}

fn unit(n: DVec3) -> Vec3 {
    n.as_vec3()
}
