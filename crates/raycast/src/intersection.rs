//! Ray-primitive intersection in f64, the one place that decides what is hit.

use glam::{DVec3, Vec3, Vec3Swizzles};
use nemoral_scene::Ray;

/// A ray in the space of one shape. The direction is not normalised, so that `t` stays in metres of
/// the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalRay {
    pub(crate) origin: DVec3,
    pub(crate) direction: DVec3,
}

impl LocalRay {
    /// A ray of the scene in the frame of a group at `offset`. The difference of two f32 of similar
    /// size is exact in f64, so neighbouring groups see the same ray.
    #[inline(always)]
    pub(crate) fn in_group(ray: &Ray, offset: Vec3) -> Self {
        Self {
            origin: ray.origin.as_dvec3() - offset.as_dvec3(),
            direction: ray.direction.as_dvec3(),
        }
    }
}

/// The point of a primitive that a ray passes through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Intersection {
    /// Distance along the ray, metres of the scene.
    pub(crate) t: f64,
    /// Card: texture coordinate u. Triangle: weight of the second corner.
    pub(crate) u: f64,
    /// Card: texture coordinate v. Triangle: weight of the third corner.
    pub(crate) v: f64,
}

impl Intersection {
    /// A placeholder where nothing was intersected.
    pub(crate) const NONE: Self = Self {
        t: f64::NAN,
        u: f64::NAN,
        v: f64::NAN,
    };
}

/// Intersects the parallelogram `corner + u · edge_u + v · edge_v`, borders included.
#[inline(always)]
pub(crate) fn card(ray: &LocalRay, [corner, edge_u, edge_v]: [DVec3; 3]) -> Option<Intersection> {
    // Solve origin + t d = corner + u edge_u + v edge_v by Cramer's rule.
    let normal = edge_u.cross(edge_v);
    let det = normal.dot(ray.direction);
    let to_corner = corner - ray.origin;
    let moment = to_corner.cross(ray.direction);
    let u = moment.dot(edge_v) / det;
    let v = -moment.dot(edge_u) / det;
    // A ray in the plane (det = 0) gives infinities and NaNs, which no comparison lets pass.
    let inside = (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v);
    let t = normal.dot(to_corner) / det;
    (inside && t.is_finite()).then_some(Intersection { t, u, v })
}

/// Intersects the triangle of three corners from both sides, borders included.
///
/// Woop, Benthin and Wald 2013, "Watertight ray/triangle intersection", in f64: corners are sheared
/// so that the ray becomes the third axis, then the origin is located in the 2-D triangle. A corner
/// shared by two triangles lands on the same 2-D point in both, an edge function is the negative of
/// its twin in the neighbour, and as rounding is monotonic its sign is right or zero. Zero counts
/// as inside, so no ray passes between neighbours. (A triangle some 10¹⁶ times smaller than its
/// distance has no shape left, and the result no meaning.)
#[inline(always)]
pub(crate) fn triangle(ray: &LocalRay, corners: [DVec3; 3]) -> Option<Intersection> {
    // Make the direction's largest axis the third; a cyclic change of axes mirrors nothing.
    let (o, d) = (ray.origin, ray.direction);
    let size = d.abs();
    if size.z >= size.x && size.z >= size.y {
        sheared(o, d, corners)
    } else if size.x >= size.y {
        sheared(o.yzx(), d.yzx(), corners.map(DVec3::yzx))
    } else {
        sheared(o.zxy(), d.zxy(), corners.map(DVec3::zxy))
    }
}

#[inline(always)]
fn sheared(origin: DVec3, d: DVec3, corners: [DVec3; 3]) -> Option<Intersection> {
    let (shear_x, shear_y) = (d.x / d.z, d.y / d.z);
    let [a, b, c] = corners.map(|corner| {
        let p = corner - origin;
        DVec3::new(p.x - shear_x * p.z, p.y - shear_y * p.z, p.z)
    });
    let u = c.x * b.y - c.y * b.x;
    let v = a.x * c.y - a.y * c.x;
    let w = b.x * a.y - b.y * a.x;
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let det = u + v + w;
    if !inside || det == 0.0 {
        return None;
    }
    let t = (u * a.z + v * b.z + w * c.z) / det / d.z;
    t.is_finite().then_some(Intersection {
        t,
        u: v / det,
        v: w / det,
    })
}
