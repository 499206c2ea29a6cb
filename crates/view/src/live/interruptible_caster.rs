//! A caster that can be interrupted.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

use nemoral_scene::{Hit, Ray, RayCaster, SurfaceHit};

/// Casts rays until it is stopped. Then it unwinds to [`unless_given_up`], so that a picture that
/// is not wanted any more takes no more time, whatever renderer casts the rays; in a program that
/// cannot unwind it meets nothing from then on.
#[derive(Clone, Copy)]
pub(super) struct InterruptibleCaster<'a> {
    pub(super) caster: &'a dyn RayCaster,
    pub(super) stop: &'a AtomicBool,
}

/// What is unwound with.
struct GivenUp;

/// Runs something that may be interrupted; `None` if it was.
pub(super) fn unless_given_up<T>(run: impl FnOnce() -> T) -> Option<T> {
    // What it had begun is dropped, and nothing else was changed.
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(done) => Some(done),
        Err(cause) if cause.is::<GivenUp>() => None,
        Err(panic) => resume_unwind(panic),
    }
}

impl InterruptibleCaster<'_> {
    fn is_stopped(&self) -> bool {
        let stopped = self.stop.load(Ordering::Relaxed);
        if stopped && cfg!(panic = "unwind") {
            resume_unwind(Box::new(GivenUp));
        }
        stopped
    }
}

impl RayCaster for InterruptibleCaster<'_> {
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
