//! The nearest hits so far of the rays of a packet.

use nemoral_scene::Ray;

use crate::nearest::Nearest;
use crate::ray_mask::{MAX_RAYS, RayMask};
use crate::simd::{F8, Isa};

/// The nearest hit so far of each ray, and the distance to which each ray still searches.
#[derive(Debug)]
pub(crate) struct NearestHits {
    pub(crate) nearest: [Nearest; MAX_RAYS],
    /// The distance that a hit of each ray must beat.
    t: [F8; MAX_RAYS / 8],
}

impl NearestHits {
    pub(crate) fn new() -> Self {
        Self {
            nearest: [Nearest::none(); MAX_RAYS],
            t: [F8::splat(0.0); MAX_RAYS / 8],
        }
    }

    /// Starts the search of ray `i` anew.
    #[inline(always)]
    pub(crate) fn start(&mut self, i: usize, ray: &Ray) {
        self.nearest[i] = Nearest::of(ray);
        self.update_reach::<false>(i);
    }

    #[inline(always)]
    pub(crate) fn of(&self, i: usize) -> &Nearest {
        &self.nearest[i & (MAX_RAYS - 1)]
    }

    #[inline(always)]
    pub(crate) fn of_mut(&mut self, i: usize) -> &mut Nearest {
        &mut self.nearest[i & (MAX_RAYS - 1)]
    }

    /// Updates the distance to which ray `i` searches, after its nearest hit has changed. With
    /// `ANY`, a ray that has found a hit searches no farther.
    #[inline(always)]
    pub(crate) fn update_reach<const ANY: bool>(&mut self, i: usize) {
        let nearest = &self.nearest[i];
        self.t[(i / 8) & 7].0[i & 7] = if ANY && nearest.found().is_some() {
            f32::NEG_INFINITY
        } else {
            nearest.t()
        };
    }

    /// The rays that still search as far as `t` or farther.
    #[inline(always)]
    pub(crate) fn beyond<I: Isa>(&self, isa: I, t: f32) -> RayMask {
        let t = isa.splat(t);
        let mut rays = 0;
        for (k, far) in self.t.iter().enumerate() {
            rays |= u64::from(isa.signs(isa.le(t, isa.load(far)))) << (8 * k);
        }
        rays
    }
}
