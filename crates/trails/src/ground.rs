//! skeleton
use glam::DVec2;
use nemoral_scene::{Surface, SurfaceSample};

use crate::TrailSurfaceKind;

/// Which part of a trail a point is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum TrailZone {
    /// Ground that no trail has touched.
    Off,
    /// A slope that a trail has cut or filled, beside its surface.
    CutSlope,
    /// The surface of a trail, apart from ruts and strip.
    Surface,
    /// A wheel rut.
    Rut,
    /// The strip between the ruts.
    Strip,
}

/// The ground with its trails carved in.
#[derive(Debug)]
pub struct TrailGround;

impl TrailGround {
    /// Signed distance to the edge of the union of trail surfaces, metres: negative on a trail,
    /// `f64::INFINITY` farther than 10 m from all.
    #[must_use]
    pub fn edge_m(&self, _world_m: DVec2) -> f64 {
        unimplemented!("skeleton")
    }

    /// Which part of a trail is here.
    #[must_use]
    pub fn zone(&self, _world_m: DVec2) -> TrailZone {
        unimplemented!("skeleton")
    }

    /// The material of the trail here; `None` off the trails.
    #[must_use]
    pub fn kind(&self, _world_m: DVec2) -> Option<TrailSurfaceKind> {
        unimplemented!("skeleton")
    }

    /// Signed offset from the middle of the nearest trail, left positive; `None` farther than 10 m
    /// from all edges.
    #[must_use]
    pub fn offset_m(&self, _world_m: DVec2) -> Option<f64> {
        unimplemented!("skeleton")
    }
}

impl Surface for TrailGround {
    fn sample(&self, _world_m: DVec2) -> SurfaceSample {
        unimplemented!("skeleton")
    }
}
