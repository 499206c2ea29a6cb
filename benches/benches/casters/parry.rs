//! parry3d's bounding volume hierarchies on two levels, with masks looked up in the leaves.

use nemoral_scene::Ray;
use nemoral_scene::glam::{DMat3, Vec3};
use parry3d::bounding_volume::Aabb;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};
use parry3d::query::{Ray as ParryRay, RayCast};
use parry3d::shape::Triangle as ParryTriangle;

use crate::placed::{Placed, Triangle, bounds_of};

pub(crate) struct Parry<'a> {
    placed: &'a Placed,
    inverses: Vec<DMat3>,
    shapes: Vec<Bvh>,
    top: Bvh,
}

fn tree(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> Bvh {
    let boxes: Vec<Aabb> = boxes.map(|(min, max)| Aabb::new(min, max)).collect();
    Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes)
}

impl<'a> Parry<'a> {
    pub(crate) fn new(placed: &'a Placed) -> Self {
        let shapes = &placed.shapes;
        let bounds: Vec<_> = shapes.iter().map(|s| bounds_of(s)).collect();
        let top = placed.instances.iter().map(|i| {
            let (min, max) = i.bounds(bounds[i.shape]);
            (min.as_vec3(), max.as_vec3())
        });
        Self {
            inverses: placed.instances.iter().map(|i| i.inverse()).collect(),
            shapes: shapes
                .iter()
                .map(|s| tree(s.iter().map(Triangle::bounds)))
                .collect(),
            top: tree(top),
            placed,
        }
    }

    /// The distance of the nearest hit; infinite if there is none.
    pub(crate) fn cast(&self, ray: &Ray) -> f32 {
        let along = ParryRay::new(ray.origin, ray.direction);
        let found = self.top.cast_ray(&along, ray.t_max_m, |i, best| {
            let instance = &self.placed.instances[i as usize];
            let inverse = &self.inverses[i as usize];
            let origin = *inverse * (ray.origin.as_dvec3() - instance.position);
            let direction = *inverse * ray.direction.as_dvec3();
            let local = ParryRay::new(origin.as_vec3(), direction.as_vec3());
            let shape = &self.placed.shapes[instance.shape];
            let hit = self.shapes[instance.shape].cast_ray(&local, best, |t, best| {
                self.triangle(&shape[t as usize], &local, best)
            });
            hit.map(|(_, t)| t)
        });
        found.map_or(f32::INFINITY, |(_, t)| t)
    }

    fn triangle(&self, triangle: &Triangle, ray: &ParryRay, best: f32) -> Option<f32> {
        let [a, b, c] = triangle.corners;
        let t = ParryTriangle::new(a, b, c).cast_local_ray(ray, best, false)?;
        let Some(mask) = triangle.mask else {
            return Some(t);
        };
        let (e, f, p) = (b - a, c - a, ray.origin + ray.dir * t - a);
        let n = e.cross(f);
        let (u, v) = (
            p.cross(f).dot(n) / n.length_squared(),
            e.cross(p).dot(n) / n.length_squared(),
        );
        let uv = triangle.uv(u, v);
        self.placed.masks[mask as usize]
            .is_opaque(uv.x, uv.y)
            .then_some(t)
    }
}
