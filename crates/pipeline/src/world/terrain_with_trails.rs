//! The ground with its trails, as water finds it.

use std::convert::Infallible;
use std::sync::Arc;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface, SurfaceSample};
use nemoral_trails::{TrailGround, Trails};
use nemoral_water::GroundWithWays;
use quick_cache::sync::Cache;

/// Grounds of chunks that are remembered.
const REMEMBERED: usize = 256;

/// The terrain with its trails, before there is water.
pub(crate) struct TerrainWithTrails {
    base: Arc<dyn Surface>,
    trails: Option<Arc<Trails>>,
    chunk_size_m: f64,
    /// Grounds are pure functions of their chunks, so it does not matter which are remembered.
    grounds: Cache<ChunkCoord, Arc<TrailGround>>,
}

impl TerrainWithTrails {
    pub(crate) fn new(
        base: Arc<dyn Surface>,
        trails: Option<Arc<Trails>>,
        chunk_size_m: f64,
    ) -> Self {
        Self {
            base,
            trails,
            chunk_size_m,
            grounds: Cache::new(REMEMBERED),
        }
    }

    fn near(&self, world_m: DVec2) -> Option<Arc<TrailGround>> {
        let trails = self.trails.as_ref()?;
        let chunk = ChunkCoord::containing(world_m, self.chunk_size_m);
        let make = || Ok::<_, Infallible>(Arc::new(trails.ground_near(chunk, 0.0)));
        let Ok(ground) = self.grounds.get_or_insert_with(&chunk, make);
        Some(ground)
    }
}

impl GroundWithWays for TerrainWithTrails {
    fn ground(&self, world_m: DVec2) -> SurfaceSample {
        match self.near(world_m) {
            Some(ground) => ground.sample(world_m),
            None => self.base.sample(world_m),
        }
    }

    fn edge_m(&self, world_m: DVec2) -> f64 {
        self.near(world_m)
            .map_or(f64::INFINITY, |ground| ground.edge_m(world_m))
    }
}
