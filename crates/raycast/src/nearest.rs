//! The nearest hit so far of a ray, and the ranking that decides ties.

use nemoral_scene::{ObjectId, Ray};

use crate::intersection::Intersection;

/// The numbers that decide between hits at the same distance, the most significant first; the
/// lowest wins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Rank {
    pub(crate) object: ObjectId,
    pub(crate) group: u32,
    pub(crate) instance: u32,
    pub(crate) primitive: u32,
}

/// Where the primitive of a hit is stored, which is enough to describe the hit without the shape's
/// vertices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PrimitiveRef {
    /// The number of the instance part in its group.
    pub(crate) part: u32,
    /// The block and the lane in the instance's [`Blas`](crate::Blas).
    pub(crate) block: u32,
    pub(crate) lane: u32,
}

impl PrimitiveRef {
    /// The reference of primitives that were found without a tree.
    pub(crate) const NONE: Self = Self {
        part: u32::MAX,
        block: u32::MAX,
        lane: 0,
    };
}

/// A hit of a primitive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PrimitiveHit {
    pub(crate) rank: Rank,
    pub(crate) intersection: Intersection,
    pub(crate) primitive: PrimitiveRef,
}

/// The nearest hit so far of one ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    t_min: f32,
    /// The distance to beat: the ray's `t_max_m` until something is found.
    t: f32,
    found: Option<PrimitiveHit>,
}

impl Nearest {
    /// A search without a ray, for which no hit is near enough.
    pub(crate) const fn none() -> Self {
        Self {
            t_min: 0.0,
            t: f32::NEG_INFINITY,
            found: None,
        }
    }

    /// The search of a ray before anything is found.
    #[inline(always)]
    pub(crate) fn of(ray: &Ray) -> Self {
        Self {
            // Never −0, whose bits sort after all positive distances.
            t_min: ray.t_min_m + 0.0,
            t: ray.t_max_m,
            found: None,
        }
    }

    #[inline(always)]
    pub(crate) fn t_min(&self) -> f32 {
        self.t_min
    }

    #[inline(always)]
    pub(crate) fn t(&self) -> f32 {
        self.t
    }

    /// Whether nothing counts any more at this distance, nor at any that has its
    /// [key](crate::simd::Keys) or a later one.
    #[inline(always)]
    pub(crate) fn is_below_key(&self, distance: f32) -> bool {
        // Keys are the upper halves of distances. They are in order unless some are negative.
        let least = f32::from_bits(distance.to_bits() & 0xFFFF_0000);
        least > self.t && self.t_min.is_sign_positive()
    }

    /// The nearest hit so far.
    #[inline(always)]
    pub(crate) fn found(&self) -> Option<&PrimitiveHit> {
        self.found.as_ref()
    }

    /// Whether a hit at this distance would count if its rank allows. NaN never does.
    #[inline(always)]
    pub(crate) fn wants(&self, t: f32) -> bool {
        t >= self.t_min && t <= self.t
    }

    /// Takes a hit if it is in range and nearer, or as near and of lower rank: the outcome does not
    /// depend on the order of the calls.
    #[inline(always)]
    pub(crate) fn offer(&mut self, found: PrimitiveHit) {
        let t = found.intersection.t as f32;
        let wins = t < self.t || self.found.is_none_or(|best| found.rank < best.rank);
        if self.wants(t) && wins {
            self.t = t;
            self.found = Some(found);
        }
    }
}
