//! Makes the description of a hit that a sensor asks for from the nearest primitive.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use nemoral_scene::{Hit, Instance, Shading, SurfaceHit, TextureWindow};

use crate::blas::{Blas, triangle_uv};
use crate::block::Shape;
use crate::group::{Group, Pose};
use crate::nearest::{Nearest, PrimitiveHit};

/// A description of a hit that a sensor can ask for.
pub(crate) trait ResolvedHit: Copy + Send + Sync {
    /// The description of the nearest hit of a ray, if there is one.
    fn of(groups: &[(Vec3, Arc<Group>)], nearest: &Nearest) -> Option<Self>;
}

impl ResolvedHit for Hit {
    fn of(groups: &[(Vec3, Arc<Group>)], nearest: &Nearest) -> Option<Self> {
        let found = nearest.found()?;
        let group = &groups[found.rank.group as usize].1;
        let number = found.rank.instance as usize;
        let (instance, blas) = &group.instances()[number];
        shaded_hit(blas, instance, group.pose(number)?, found, nearest.t())
    }
}

impl ResolvedHit for SurfaceHit {
    fn of(groups: &[(Vec3, Arc<Group>)], nearest: &Nearest) -> Option<Self> {
        let PrimitiveHit {
            rank, primitive, ..
        } = nearest.found()?;
        let instance = (groups[rank.group as usize].1).instance_ref(rank.group, primitive.part);
        let (shape, surface) = instance.blas.shape_at(rank.primitive, primitive)?;
        Some(Self {
            distance_m: nearest.t(),
            geometric_normal: geometric_normal(&shape, instance.pose).as_vec3(),
            material: surface.material,
            object: rank.object,
        })
    }
}

/// Unit normal of a primitive of an instance, in its group, on the side from which its corners are
/// counterclockwise in the prototype (in mirrored instances the placed corners are clockwise from
/// there); up for one without any area. It is inlined, so that the corners of the shape need not go
/// through memory.
#[inline(always)]
pub(crate) fn geometric_normal(shape: &Shape, pose: &Pose) -> DVec3 {
    let [u, v] = shape.edges();
    let normal = pose.normal_to_group(u.cross(v)).try_normalize();
    normal.unwrap_or(DVec3::Z)
}

/// The hit at the intersection of a ray with a primitive of an instance.
fn shaded_hit(
    blas: &Blas,
    instance: &Instance,
    pose: &Pose,
    found: &PrimitiveHit,
    distance_m: f32,
) -> Option<Hit> {
    let (primitive, m) = (found.rank.primitive, &found.intersection);
    let (shape, surface) = blas.shape_at(primitive, &found.primitive)?;
    let mesh = blas.prototype().mesh();
    // A quad is shaded as the triangle of it that was hit.
    let (triangle, weights) = match shape {
        Shape::Triangle(_) => (Some(primitive), [m.u, m.v]),
        Shape::Card(_) => match blas.quad(primitive) {
            Some(quad) => {
                let (number, u, v) = quad.triangle_at(m.u, m.v);
                (Some(number), [u, v])
            }
            None => (None, [m.u, m.v]),
        },
    };
    let linear = instance.linear.as_dmat3();
    let [edge_u, edge_v] = shape.edges();
    let mut mixture = None;
    let mut ambient_occlusion = 1.0;
    let card_uv = || surface.card_uv(m.u, m.v);
    let card_uv_area = || surface.window.as_ref().map_or(1.0, TextureWindow::area);
    let (vertex_normal, uv, uv_area) = if let Some(number) = triangle {
        let [u, v] = weights;
        let triangle = &mesh.triangles[number as usize];
        let normal = match triangle.corners.map(|i| mesh.normal(i)) {
            [Some(a), Some(b), Some(c)] => {
                let [a, b, c] = [a, b, c].map(|n| n.as_dvec3());
                Some(a * (1.0 - u - v) + b * u + c * v)
            }
            _ => None,
        };
        let blend = mesh.blends.get(number as usize).filter(|b| !b.is_uniform());
        mixture = blend.map(|b| b.at([1.0 - u - v, u, v].map(|weight| weight as f32)));
        if let Some(occlusion) = blas.prototype().ambient_occlusion() {
            ambient_occlusion = occlusion.in_triangle(triangle.corners, u as f32, v as f32);
        }
        let (uv, uv_area) = match shape {
            Shape::Triangle(_) => {
                let [a, b, c] = triangle.corners.map(|i| mesh.uv(i).as_dvec2());
                let area = (b - a).perp_dot(c - a).abs();
                (triangle_uv(mesh, triangle, m), area)
            }
            Shape::Card(_) => (card_uv(), card_uv_area()),
        };
        (normal, uv, uv_area)
    } else {
        if let Some(occlusion) = blas.prototype().ambient_occlusion() {
            let card = primitive as usize - mesh.triangles.len();
            ambient_occlusion = occlusion.on_card(card, m.u as f32, m.v as f32);
        }
        (None, card_uv(), card_uv_area())
    };
    let geometric = geometric_normal(&shape, pose);
    let to_group = |n: DVec3| pose.normal_to_group(n).try_normalize();
    let shading = vertex_normal.and_then(to_group).unwrap_or(geometric);
    let side = if shading.dot(geometric) < 0.0 {
        -1.0
    } else {
        1.0
    };
    let area = (linear * edge_u).cross(linear * edge_v).length();
    Some(Hit {
        surface: SurfaceHit {
            distance_m,
            geometric_normal: geometric.as_vec3(),
            material: surface.material,
            object: instance.object,
        },
        shading: Shading {
            normal: (shading * side).as_vec3(),
            uv,
            uv_per_m: (uv_area / area).sqrt() as f32,
            mixture,
            variation: instance.variation,
            ambient_occlusion,
        },
    })
}
