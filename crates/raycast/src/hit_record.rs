//! Which primitive of which instance a ray hits.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::ObjectId;

use crate::group::Group;
use crate::hit::{ResolvedHit, geometric_normal};
use crate::nearest::{Nearest, PrimitiveHit};

/// A primitive of a [`Prototype`](nemoral_scene::Prototype), by its number there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Primitive {
    /// A triangle of the mesh, also where two of them form a card.
    Triangle(u32),
    /// A card.
    Card(u32),
}

/// Where a ray hits which primitive of which instance: what physics and picking ask for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HitRecord {
    /// Distance from the ray's origin, metres.
    pub distance_m: f32,
    /// The object that was hit.
    pub object: ObjectId,
    /// The number of the group in its [`RayScene`](crate::RayScene).
    pub group: u32,
    /// The number of the instance in its [`Group`].
    pub instance: u32,
    /// The primitive of the instance's prototype.
    pub primitive: Primitive,
    /// Where on the primitive. Triangle: the weights of its second and third corner. Card: the
    /// shares of its edges u and v.
    pub place: [f64; 2],
    /// Unit normal of the primitive, on the side from which its corners are counterclockwise in the
    /// prototype; in mirrored instances the placed corners are clockwise from there.
    pub geometric_normal: Vec3,
}

impl ResolvedHit for HitRecord {
    fn of(groups: &[(Vec3, Arc<Group>)], nearest: &Nearest) -> Option<Self> {
        let PrimitiveHit {
            rank,
            intersection,
            primitive: stored,
        } = nearest.found()?;
        let instance = (groups[rank.group as usize].1).instance_ref(rank.group, stored.part);
        let blas = instance.blas;
        // What was cast is still in the cache; the mesh is not.
        let (shape, _) = blas.shape_at(rank.primitive, stored)?;
        let mesh = blas.prototype().mesh();
        let triangles = mesh.triangles.len() as u32;
        let (primitive, place) = if let Some(quad) = blas.quad(rank.primitive) {
            let (number, u, v) = quad.triangle_at(intersection.u, intersection.v);
            (Primitive::Triangle(number), [u, v])
        } else {
            let place = [intersection.u, intersection.v];
            match rank.primitive.checked_sub(triangles) {
                None => (Primitive::Triangle(rank.primitive), place),
                Some(card) => (Primitive::Card(card), place),
            }
        };
        Some(Self {
            distance_m: nearest.t(),
            object: rank.object,
            group: rank.group,
            instance: rank.instance,
            primitive,
            place,
            geometric_normal: geometric_normal(&shape, instance.pose).as_vec3(),
        })
    }
}
