//! skeleton
use glam::DVec2;
use nemoral_scene::{Surface, SurfaceSample};
use nemoral_seed::Key;

use crate::{ParamError, TerrainParams};

/// Fbm of the noise crate.
#[derive(Clone, Debug)]
pub struct PerlinTerrain;

impl PerlinTerrain {
    /// New.
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn new(params: TerrainParams, _key: Key) -> Result<Self, ParamError> {
        params.check()?;
        Ok(Self)
    }
}

impl Surface for PerlinTerrain {
    fn sample(&self, _world_m: DVec2) -> SurfaceSample {
        unimplemented!("skeleton")
    }
}
