//! A caster that can be interrupted.

use std::sync::atomic::{AtomicBool, Ordering};

use nemoral_scene::{Hit, Ray, RayCaster, SurfaceHit};

/// Casts rays until it is stopped, and meets nothing from then on. A picture that is not wanted any
/// more ends soon after, as the sky takes little time.
#[derive(Clone, Copy)]
pub(super) struct Interruptible<'a> {
    pub(super) caster: &'a dyn RayCaster,
    pub(super) stop: &'a AtomicBool,
}

impl Interruptible<'_> {
    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

impl RayCaster for Interruptible<'_> {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        if self.is_stopped() {
            return None;
        }
        self.caster.closest_hit(ray)
    }

    fn closest_surface(&self, ray: &Ray) -> Option<SurfaceHit> {
        if self.is_stopped() {
            return None;
        }
        self.caster.closest_surface(ray)
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        !self.is_stopped() && self.caster.is_occluded(ray)
    }

    fn are_occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        if self.is_stopped() {
            occluded.fill(false);
        } else {
            self.caster.are_occluded(rays, occluded);
        }
    }

    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        if self.is_stopped() {
            hits.fill(None);
        } else {
            self.caster.closest_hits(rays, hits);
        }
    }

    fn closest_surfaces(&self, rays: &[Ray], surfaces: &mut [Option<SurfaceHit>]) {
        if self.is_stopped() {
            surfaces.fill(None);
        } else {
            self.caster.closest_surfaces(rays, surfaces);
        }
    }
}
