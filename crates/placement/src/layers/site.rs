//! The sites of plants and rocks, and where none may stand.

use glam::DVec2;
use nemoral_seed::Key;

/// A place for a rock, a tree, a stump or a shrub.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// World position, metres.
    pub position_m: DVec2,
    /// The occupancy of the trunk or foot, metres; spacing and density factor not applied.
    pub radius_m: f64,
    /// The index of its layer in [`PlacementParams::layers`](crate::PlacementParams); 0 for rocks.
    pub layer: u8,
    /// The index of its variety in its layer (or among the rocks).
    pub variety: u16,
    /// Its own key: whatever else is drawn for this thing (yaw, scale, age) comes from here.
    pub key: Key,
}

/// Where things may stand: how trails, water or a map reach the sampler.
///
/// It is asked for positions inside the chunk in hand only. Closures implement it.
pub trait Exclusion: Sync {
    /// Whether a thing that occupies a disc of `radius_m` around the world position may stand.
    fn allows(&self, position_m: DVec2, radius_m: f64) -> bool;
}

impl<F: Fn(DVec2, f64) -> bool + Sync> Exclusion for F {
    fn allows(&self, position_m: DVec2, radius_m: f64) -> bool {
        self(position_m, radius_m)
    }
}
