//! The ground with its trails, as water finds it.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface, SurfaceSample};
use nemoral_trails::{TrailGround, Trails};
use nemoral_water::Ways;

/// Grounds of chunks that are remembered.
const REMEMBERED: usize = 256;

/// The terrain with its trails, before there is water.
pub(crate) struct BuiltWays {
    base: Arc<dyn Surface>,
    trails: Option<Arc<Trails>>,
    chunk_size_m: f64,
    /// Grounds are pure functions of their chunks, so it does not matter which are remembered.
    grounds: Mutex<Remembered>,
}

/// Grounds by chunk, and the chunks in the order in which they came.
#[derive(Default)]
struct Remembered {
    grounds: BTreeMap<[i32; 2], Arc<TrailGround>>,
    order: VecDeque<[i32; 2]>,
}

impl BuiltWays {
    pub(crate) fn new(
        base: Arc<dyn Surface>,
        trails: Option<Arc<Trails>>,
        chunk_size_m: f64,
    ) -> Self {
        Self {
            base,
            trails,
            chunk_size_m,
            grounds: Mutex::default(),
        }
    }

    fn near(&self, world_m: DVec2) -> Option<Arc<TrailGround>> {
        let trails = self.trails.as_ref()?;
        let chunk = ChunkCoord::containing(world_m, self.chunk_size_m);
        let key = [chunk.x, chunk.y];
        let lock = || self.grounds.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(ground) = lock().grounds.get(&key) {
            return Some(Arc::clone(ground));
        }
        let ground = Arc::new(trails.ground_near(chunk, 0.0));
        let mut remembered = lock();
        let known = remembered.grounds.insert(key, Arc::clone(&ground));
        if known.is_none() {
            remembered.order.push_back(key);
        }
        if remembered.order.len() > REMEMBERED
            && let Some(oldest) = remembered.order.pop_front()
        {
            remembered.grounds.remove(&oldest);
        }
        Some(ground)
    }
}

impl Ways for BuiltWays {
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
