//! Grass and stones on trails and at their edges.

use glam::DVec2;

/// The kinds of dressing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DressingKind {
    /// A tuft of grass or of another plant that tolerates being trodden on.
    Grass,
    /// A stone.
    Stone,
    /// A tuft of grass just beside the surface, whose blades hang over the edge.
    Verge,
}

/// A tuft or stone that belongs to a trail.
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
