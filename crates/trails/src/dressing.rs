//! What grows and lies on trails and at their edges.

use glam::DVec2;

/// What stands on a trail or at its edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DressingKind {
    /// A tuft of grass, or what else can bear to be trodden on.
    Grass,
    /// A stone.
    Stone,
    /// A tuft of grass just beside the surface, where light and water are, whose blades hang over
    /// the edge.
    Verge,
}

/// A thing that belongs to a trail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrailDressing {
    /// World position, metres.
    pub position_m: DVec2,
    /// Turn about the vertical, 0..2π.
    pub yaw_rad: f64,
    /// Size relative to the usual one: grass 0.6..1.2, on a verge 0.6..1.6, stones lognormal,
    /// 0.4..2.5.
    pub scale: f64,
    /// What it is.
    pub kind: DressingKind,
}
