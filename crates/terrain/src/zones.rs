//! The break-lines of a ground.

use glam::DVec2;

/// The requirements on a ground's mesh at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZoneSample {
    /// Signed distance to the nearest break-line, metres, negative inside the zone; `f64::INFINITY`
    /// where none is near. It may not change faster than the position does by more than a tenth.
    /// Zones may be nested: zones that touch must differ in sign, and zones that are narrower than
    /// the diagonal of a fine cell may be missed.
    pub edge_m: f64,
    /// The size of cells that is required here, metres; `f64::INFINITY` for any size.
    pub detail_m: f64,
}

/// A zone of the plane (all trails, a lake, a field) whose border the mesh follows.
pub trait GroundZones: Send + Sync {
    /// The sample at a world point. It must be a pure function.
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
