//! The grass and stones of the trails themselves.

use glam::DVec2;

/// What stands on a trail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DressingKind {
    /// A tuft of grass.
    Grass,
    /// A stone.
    Stone,
}

/// A thing that belongs to a trail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrailDressing {
    /// World position, metres.
    pub position_m: DVec2,
    /// Turn about the vertical, 0..2π.
    pub yaw_rad: f64,
    /// Size relative to the usual one.
    pub scale: f64,
    /// What it is.
    pub kind: DressingKind,
}
