//! The port between sensors and ray casters.

use std::sync::Arc;

use crate::{Hit, Ray, SurfaceHit};

/// Anything that rays can be cast at. A texel that a mask declares transparent does not exist.
///
/// Hits at equal distance are decided by object id, then by instance and primitive number, never
/// by the order of traversal.
///
/// One method is enough for a caster of one's own:
///
/// ```
/// use nemoral_scene::glam::Vec3;
/// use nemoral_scene::{Hit, MaterialId, Ray, RayCaster};
///
/// /// A ground at height 0.
/// struct Level(MaterialId);
///
/// impl RayCaster for Level {
///     fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
///         let distance_m = -ray.origin.z / ray.direction.z;
///         ray.reaches(distance_m).then(|| Hit::new(distance_m, Vec3::Z, self.0))
///     }
/// }
///
/// let down = Ray::new(Vec3::Z * 1.5, Vec3::NEG_Z);
/// let hit = Level(MaterialId(0)).closest_hit(&down);
/// assert_eq!(hit.map(|hit| hit.surface.distance_m), Some(1.5));
/// ```
pub trait RayCaster: Sync {
    /// The nearest hit with `t_min_m <= distance <= t_max_m`.
    fn closest_hit(&self, ray: &Ray) -> Option<Hit>;

    /// The surface part of what [`closest_hit`](Self::closest_hit) finds. Casters for which that is
    /// less work override this.
    fn closest_surface(&self, ray: &Ray) -> Option<SurfaceHit> {
        self.closest_hit(ray).map(SurfaceHit::from)
    }

    /// Whether there is any hit.
    fn is_occluded(&self, ray: &Ray) -> bool {
        self.closest_hit(ray).is_some()
    }

    /// Whether there is any hit for each ray, as shadows need it. Casters that are faster with many
    /// rays at once override this. The result for a ray never depends on the other rays.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn are_occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "one result for each ray");
        for (ray, occluded) in rays.iter().zip(occluded) {
            *occluded = self.is_occluded(ray);
        }
    }

    /// The nearest hit of each ray. Casters that are faster with many rays at once override this.
    /// The result for a ray never depends on the other rays.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len(), "one hit for each ray");
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.closest_hit(ray);
        }
    }

    /// The surface part of the hits that [`closest_hits`](Self::closest_hits) finds. Casters for
    /// which that is less work override this.
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
}

/// Casters behind a pointer are casters; every method is forwarded, so that batches stay batches.
macro_rules! forward {
    ($(<$caster:ident $(: $bound:ident)?> $pointer:ty;)*) => {$(
        impl<$caster: RayCaster $(+ $bound)? + ?Sized> RayCaster for $pointer {
            fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
                (**self).closest_hit(ray)
            }

            fn closest_surface(&self, ray: &Ray) -> Option<SurfaceHit> {
                (**self).closest_surface(ray)
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
        }
    )*};
}

// A caster is `Sync`, and an `Arc` is that only if what it holds is `Send` too.
forward! {
    <C> &C;
    <C> Box<C>;
    <C: Send> Arc<C>;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MaterialId;
    use glam::Vec3;

    /// Each method answers in its own way.
    struct Batches;

    fn at(distance_m: f32) -> Option<Hit> {
        Some(Hit::new(distance_m, Vec3::Z, MaterialId(0)))
    }

    impl RayCaster for Batches {
        fn closest_hit(&self, _: &Ray) -> Option<Hit> {
            at(1.0)
        }

        fn closest_surface(&self, _: &Ray) -> Option<SurfaceHit> {
            at(2.0).map(SurfaceHit::from)
        }

        fn is_occluded(&self, _: &Ray) -> bool {
            false
        }

        fn are_occluded(&self, _: &[Ray], occluded: &mut [bool]) {
            occluded.fill(true);
        }

        fn closest_hits(&self, _: &[Ray], hits: &mut [Option<Hit>]) {
            hits.fill(at(3.0));
        }

        fn closest_surfaces(&self, _: &[Ray], surfaces: &mut [Option<SurfaceHit>]) {
            surfaces.fill(at(4.0).map(SurfaceHit::from));
        }
    }

    fn answers(caster: impl RayCaster) -> ([Option<f32>; 4], [bool; 2]) {
        let ray = Ray::new(Vec3::Z, Vec3::NEG_Z);
        let (mut hits, mut surfaces, mut occluded) = ([None], [None], [false]);
        caster.closest_hits(&[ray], &mut hits);
        caster.closest_surfaces(&[ray], &mut surfaces);
        caster.are_occluded(&[ray], &mut occluded);
        let [single, batch] = [caster.closest_hit(&ray), hits[0]].map(|h| h.map(SurfaceHit::from));
        let found = [single, caster.closest_surface(&ray), batch, surfaces[0]];
        (
            found.map(|hit| hit.map(|hit| hit.distance_m)),
            [caster.is_occluded(&ray), occluded[0]],
        )
    }

    #[test]
    fn pointers_to_casters_forward_every_method() {
        let own = ([1.0, 2.0, 3.0, 4.0].map(Some), [false, true]);
        assert_eq!(answers(&Batches), own);
        assert_eq!(answers(Box::new(Batches)), own);
        assert_eq!(answers(Arc::new(Batches)), own);
        assert_eq!(answers(Box::new(Batches) as Box<dyn RayCaster>), own);
        let shared: Arc<dyn RayCaster + Send> = Arc::new(Batches);
        assert_eq!(answers(shared), own);
    }
}
