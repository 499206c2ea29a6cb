//! skeleton
use glam::DVec2;
use nemoral_scene::{Surface, SurfaceSample};
use nemoral_seed::Key;

use crate::{ParamError, TerrainParams};

/// Octaves of gradient noise.
#[derive(Clone, Debug)]
pub struct Terrain;

impl Terrain {
    /// New.
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn new(params: TerrainParams, _key: Key) -> Result<Self, ParamError> {
        params.check()?;
        Ok(Self)
    }
}

impl Surface for Terrain {
    fn sample(&self, _world_m: DVec2) -> SurfaceSample {
        unimplemented!("skeleton")
    }
}
