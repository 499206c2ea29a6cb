//! Where a ground has break-lines.

use glam::DVec2;

/// What a ground needs of its mesh at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZoneSample {
    /// Signed distance to the nearest break-line, metres, negative inside the zone;
    /// `f64::INFINITY` where none is near. It may not change faster than the position does by more
    /// than a tenth. Zones may lie in zones: what touches must differ in sign, and what is narrower
    /// than the diagonal of a fine cell may be missed.
    pub edge_m: f64,
    /// Cells should be this small here, metres; `f64::INFINITY` for no wish.
    pub detail_m: f64,
}

/// A zone of the plane (all trails, a lake, a field) whose border the mesh follows.
pub trait GroundZones: Send + Sync {
    /// What is at a world point. A pure function.
    fn sample(&self, world_m: DVec2) -> ZoneSample;
}

/// No zone anywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoZones;

impl GroundZones for NoZones {
    fn sample(&self, _world_m: DVec2) -> ZoneSample {
        ZoneSample {
            edge_m: f64::INFINITY,
            detail_m: f64::INFINITY,
        }
    }
}
