//! The sites of plants and rocks, and the places where none may be.

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
    /// Its own key, for everything else that is drawn for this site (yaw, scale, age).
    pub key: Key,
}

/// Where sites are allowed: the port through which trails, water or a map reach the sampler.
///
/// It is called with positions inside the current chunk only. Closures implement it.
pub trait SiteFilter: Sync {
    /// Whether a disk of `radius_m` around the world position may be occupied.
    fn allows(&self, position_m: DVec2, radius_m: f64) -> bool;
}

impl<F: Fn(DVec2, f64) -> bool + Sync> SiteFilter for F {
    fn allows(&self, position_m: DVec2, radius_m: f64) -> bool {
        self(position_m, radius_m)
    }
}
