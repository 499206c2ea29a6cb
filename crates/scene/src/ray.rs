//! Rays, hits, and the seam between sensors and casters.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::{Instance, MaterialId, ObjectId};

/// A ray in a frame's scene. `direction` has unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts, metres.
    pub origin: Vec3,
    /// Where it goes; unit length.
    pub direction: Vec3,
    /// Hits nearer than this are ignored, metres.
    pub t_min_m: f32,
    /// Hits farther than this are ignored, metres.
    pub t_max_m: f32,
}

impl Ray {
    /// A ray from the origin to infinity.
    #[must_use]
    pub const fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            t_min_m: 0.0,
            t_max_m: f32::INFINITY,
        }
    }

    /// The point at a distance.
    #[inline]
    #[must_use]
    pub fn at(&self, distance_m: f32) -> Vec3 {
        self.origin + self.direction * distance_m
    }
}

/// The nearest opaque surface point on a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin, metres.
    pub distance_m: f32,
    /// Unit normal of the flat primitive; its side is the shape's, not the ray's.
    pub geometric_normal: Vec3,
    /// Unit interpolated normal, on the same side as `geometric_normal`.
    pub shading_normal: Vec3,
    /// Texture coordinate.
    pub uv: Vec2,
    /// Texture repetitions per metre of surface at the hit.
    pub uv_per_m: f32,
    /// The surface's material; its semantic is the truth.
    pub material: MaterialId,
    /// The ground that the colour passes over into here, and its share, 0..=1, before it is roughened
    /// by what lies about.
    pub blend: Option<(MaterialId, f32)>,
    /// Whose surface it is.
    pub object: ObjectId,
    /// The instance's colour variation, 0..1.
    pub variation: f32,
    /// The share of the light from all around that near parts of the same shape leave, 0..=1: see
    /// [`NearLight`](crate::NearLight). 1 where nothing is known.
    pub near_light: f32,
}

/// What a range sensor needs of a [`Hit`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHit {
    /// Distance from the ray's origin, metres.
    pub distance_m: f32,
    /// Unit normal of the flat primitive; its side is the shape's, not the ray's.
    pub geometric_normal: Vec3,
    /// The surface's material; its semantic is the truth.
    pub material: MaterialId,
    /// Whose surface it is.
    pub object: ObjectId,
}

impl From<Hit> for SurfaceHit {
    fn from(hit: Hit) -> Self {
        Self {
            distance_m: hit.distance_m,
            geometric_normal: hit.geometric_normal,
            material: hit.material,
            object: hit.object,
        }
    }
}

/// Instances that are made and dropped together: a chunk's.
pub trait InstanceGroup: Send + Sync {
    /// They, in order of their numbers.
    fn instances(&self) -> Box<dyn ExactSizeIterator<Item = &Instance> + '_>;
}

/// A group and where its frame lies in the scene, metres.
pub type PlacedGroup = (Vec3, Arc<dyn InstanceGroup>);

/// Whatever rays can be cast at. A texel that a mask declares transparent is not there.
///
/// Hits at equal distance are decided by object id, then by instance and primitive number, never
/// by the order of traversal.
pub trait RayCaster: Sync {
    /// The nearest hit with `t_min_m <= distance <= t_max_m`.
    fn closest_hit(&self, ray: &Ray) -> Option<Hit>;

    /// Is there any hit?
    fn is_occluded(&self, ray: &Ray) -> bool {
        self.closest_hit(ray).is_some()
    }

    /// Is there any hit, for each ray: shadows. Casters that gain by working on many rays override
    /// this; the answer for a ray never depends on the others.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn are_occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "one answer for each ray");
        for (ray, occluded) in rays.iter().zip(occluded) {
            *occluded = self.is_occluded(ray);
        }
    }

    /// The nearest hit of each ray. Casters that gain by working on many rays override this; the
    /// answer for a ray never depends on the others.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len(), "one hit for each ray");
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.closest_hit(ray);
        }
    }

    /// The same as [`closest_hits`](Self::closest_hits), but less of each hit: casters for which that is
    /// less work override this.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn closest_surfaces(&self, rays: &[Ray], surfaces: &mut [Option<SurfaceHit>]) {
        assert_eq!(rays.len(), surfaces.len(), "one surface for each ray");
        let mut hits = vec![None; rays.len()];
        self.closest_hits(rays, &mut hits);
        for (surface, hit) in surfaces.iter_mut().zip(hits) {
            *surface = hit.map(SurfaceHit::from);
        }
    }

    /// The shapes behind the answers, for renderers that draw shapes instead of casting rays at
    /// them: so both see one scene. `None` if the caster does not tell.
    ///
    /// An instance whose linear map is singular or not finite is never hit, and not to be drawn.
    fn placed_groups(&self) -> Option<Vec<PlacedGroup>> {
        None
    }
}

impl<C: RayCaster + ?Sized> RayCaster for &C {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        (**self).closest_hit(ray)
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        (**self).is_occluded(ray)
    }

    fn are_occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        (**self).are_occluded(rays, occluded);
    }

    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        (**self).closest_hits(rays, hits);
    }

    fn closest_surfaces(&self, rays: &[Ray], surfaces: &mut [Option<SurfaceHit>]) {
        (**self).closest_surfaces(rays, surfaces);
    }

    fn placed_groups(&self) -> Option<Vec<PlacedGroup>> {
        (**self).placed_groups()
    }
}
