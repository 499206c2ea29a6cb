//! The port to the ways that streams pass under and ponds keep off.

use glam::DVec2;
use nemoral_scene::{Surface, SurfaceSample};

/// The ground that water finds, with the ways on it.
pub trait GroundWithWays: Send + Sync {
    /// The ground as it is without water, ways built.
    fn ground(&self, world_m: DVec2) -> SurfaceSample;

    /// Signed distance from the edge of the nearest way, metres: negative on it, `f64::INFINITY`
    /// far from any.
    fn edge_m(&self, world_m: DVec2) -> f64;

    /// Whether water keeps off a place for any other reason.
    fn is_dry(&self, world_m: DVec2) -> bool {
        let _ = world_m;
        false
    }
}

/// A ground without ways.
#[derive(Clone, Copy, Debug)]
pub struct GroundWithoutWays<S>(pub S);

impl<S: Surface> GroundWithWays for GroundWithoutWays<S> {
    fn ground(&self, world_m: DVec2) -> SurfaceSample {
        self.0.sample(world_m)
    }

    fn edge_m(&self, _: DVec2) -> f64 {
        f64::INFINITY
    }
}
