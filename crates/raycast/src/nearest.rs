//! The nearest hit so far, and who wins a tie.

use nemoral_scene::{ObjectId, Ray};

use crate::exact::Meeting;

/// What decides between hits at the same distance, the most significant first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Rank {
    pub(crate) object: ObjectId,
    pub(crate) group: u32,
    pub(crate) instance: u32,
    pub(crate) primitive: u32,
}

/// Where a primitive was met: enough to describe the hit without its shape's vertices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// The part of an instance, in its group.
    pub(crate) entry: u32,
    /// The block and the lane in the instance's [`Blas`](crate::Blas).
    pub(crate) block: u32,
    pub(crate) lane: u32,
}

impl Place {
    /// Of primitives met without a tree.
    pub(crate) const NONE: Self = Self {
        entry: u32::MAX,
        block: u32::MAX,
        lane: 0,
    };
}

/// A hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub(crate) rank: Rank,
    pub(crate) meeting: Meeting,
    pub(crate) place: Place,
}

/// The nearest hit so far of one ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    t_min: f32,
    /// The distance to beat: the ray's `t_max_m` until something is found.
    t: f32,
    found: Option<Found>,
}

impl Nearest {
    /// Of no ray.
    pub(crate) const fn none() -> Self {
        Self {
            t_min: 0.0,
            t: f32::NEG_INFINITY,
            found: None,
        }
    }

    #[inline(always)]
    pub(crate) fn of(ray: &Ray) -> Self {
        Self {
            t_min: ray.t_min_m,
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

    /// What is hit.
    #[inline(always)]
    pub(crate) fn found(&self) -> Option<&Found> {
        self.found.as_ref()
    }

    /// Would a hit at this distance count, rank permitting? Never for NaN.
    #[inline(always)]
    pub(crate) fn wants(&self, t: f32) -> bool {
        t >= self.t_min && t <= self.t
    }

    /// Takes a hit if it is in range and nearer, or as near and of lower rank: the outcome does not
    /// depend on the order of the calls.
    #[inline(always)]
    pub(crate) fn offer(&mut self, found: Found) {
        let t = found.meeting.t as f32;
        let wins = t < self.t || self.found.is_none_or(|best| found.rank < best.rank);
        if self.wants(t) && wins {
            self.t = t;
            self.found = Some(found);
        }
    }
}
