//! skeleton
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::Key;

use crate::{ParamError, TrailDressing, TrailGround, TrailParams, TrailPath};

/// All trails of a world.
pub struct Trails;

impl std::fmt::Debug for Trails {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Trails").finish_non_exhaustive()
    }
}

impl Trails {
    /// The trails of the world of `key`, on a ground `base`.
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn new(
        params: TrailParams,
        chunk_size_m: f64,
        _key: Key,
        _base: Arc<dyn Surface>,
    ) -> Result<Self, ParamError> {
        params.check(chunk_size_m)?;
        Ok(Self)
    }

    /// Every trail that touches a chunk, sorted by id.
    #[must_use]
    pub fn in_chunk(&self, _coord: ChunkCoord) -> Vec<Arc<TrailPath>> {
        unimplemented!("skeleton")
    }

    /// The ground, trails carved in, for points at most `margin_m` from a chunk.
    #[must_use]
    pub fn ground_near(&self, _coord: ChunkCoord, _margin_m: f64) -> TrailGround {
        unimplemented!("skeleton")
    }

    /// The trail nearest to a point within `radius_m` of it, and the arc length of the closest point.
    #[must_use]
    pub fn nearest(&self, _world_m: DVec2, _radius_m: f64) -> Option<(Arc<TrailPath>, f64)> {
        unimplemented!("skeleton")
    }

    /// The grass and stones of trails whose position is in a chunk.
    #[must_use]
    pub fn dressing(&self, _coord: ChunkCoord) -> Vec<TrailDressing> {
        unimplemented!("skeleton")
    }
}
