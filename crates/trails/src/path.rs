//! skeleton
use glam::DVec2;
use nemoral_scene::ChunkCoord;

use crate::TrailSurfaceKind;

/// The name of a trail: the chunk it was born in (at most one trail a chunk).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TrailId {
    /// Where it was born.
    pub birth: ChunkCoord,
}

/// The run of one trail.
#[derive(Debug)]
pub struct TrailPath {
    id: TrailId,
}

impl TrailPath {
    /// Which trail it is.
    #[must_use]
    pub fn id(&self) -> TrailId {
        self.id
    }

    /// Length along the middle, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        unimplemented!("skeleton")
    }

    /// World position of the middle at arc length `s_m` (clamped to the trail).
    #[must_use]
    pub fn position_m(&self, _s_m: f64) -> DVec2 {
        unimplemented!("skeleton")
    }

    /// Unit direction of travel at arc length `s_m`.
    #[must_use]
    pub fn tangent(&self, _s_m: f64) -> DVec2 {
        unimplemented!("skeleton")
    }

    /// Curvature at arc length `s_m`, 1/m, positive to the left.
    #[must_use]
    pub fn curvature(&self, _s_m: f64) -> f64 {
        unimplemented!("skeleton")
    }

    /// The material at arc length `s_m`.
    #[must_use]
    pub fn kind(&self, _s_m: f64) -> TrailSurfaceKind {
        unimplemented!("skeleton")
    }
}
