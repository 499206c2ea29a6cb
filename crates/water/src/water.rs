//! All streams and ponds of a world.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fmt;
use std::hash::Hash;
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::{ChunkCoord, ParamError, Surface};
use nemoral_seed::{Domain, Draw, Key};
use quick_cache::sync::Cache;

use crate::channel::CHANNEL_REACH_M;
use crate::chunk_water::ChunkWater;
use crate::lattice::{Lattice, Node, SPACING_M};
use crate::network::reaches;
use crate::pond::Pond;
use crate::stream::{CELL_M, Finder, PONDS, Stream};
use crate::ways::GroundWithWays;
use crate::{REACH_M, WaterParams};

const WATER: Domain = Domain::new("water");

/// No reach between two nodes is longer than this, metres.
const LONGEST_REACH_M: f64 = 48.0;

/// The surfaces of a chunk's waters end at most this far beyond its borders, metres: as far as a
/// reach of a stream, and half of its width, or as the largest pond.
pub const SURFACE_REACH_M: f64 = LONGEST_REACH_M + 16.0;

/// The greatest margin around a chunk, metres.
const WIDEST_M: f64 = 1000.0;

/// The streams and ponds of an endless world, found from any chunk.
///
/// A value is a pure function of its parameters, key and ground: neither earlier calls, nor
/// threads, nor evictions from its bounded caches can change a result.
pub struct Water {
    params: WaterParams,
    chunk_size_m: f64,
    key: Key,
    base: Arc<dyn Surface>,
    ways: Arc<dyn GroundWithWays>,
    streams: Cache<[i32; 2], Option<Arc<Stream>>>,
    ponds: Cache<Node, Option<Arc<Pond>>>,
    near: Cache<([i32; 2], u64), Arc<ChunkWater>>,
}

impl fmt::Debug for Water {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Water")
            .field("params", &self.params)
            .field("chunk_size_m", &self.chunk_size_m)
            .finish_non_exhaustive()
    }
}

impl Water {
    /// The water of the world of `key`, in square chunks. It runs down the terrain `base`, and
    /// passes under `ways`, which are built on it.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(
        params: WaterParams,
        chunk_size_m: f64,
        key: Key,
        base: Arc<dyn Surface>,
        ways: Arc<dyn GroundWithWays>,
    ) -> Result<Self, ParamError> {
        params.check()?;
        ParamError::check_range("chunk_size_m", chunk_size_m, 1.0..=1000.0, "1..=1000 m")?;
        Ok(Self {
            params,
            chunk_size_m,
            key: key.domain(WATER),
            base,
            ways,
            streams: Cache::new(4096),
            ponds: Cache::new(1024),
            near: Cache::new(128),
        })
    }

    /// The parameters of this water.
    #[must_use]
    pub fn params(&self) -> &WaterParams {
        &self.params
    }

    /// The water for points at most `margin_m` from a chunk, 0..=1000, and the surfaces that are
    /// the chunk's. Other margins count as the nearest of these.
    #[must_use]
    pub fn near(&self, coord: ChunkCoord, margin_m: f64) -> Arc<ChunkWater> {
        let margin_m = if margin_m > 0.0 {
            margin_m.min(WIDEST_M)
        } else {
            0.0
        };
        let key = ([coord.x, coord.y], margin_m.to_bits());
        let make = || Arc::new(self.find_near(coord, margin_m));
        get_or_make(&self.near, key, make)
    }

    fn find_near(&self, coord: ChunkCoord, margin_m: f64) -> ChunkWater {
        let origin = coord.origin_m(self.chunk_size_m);
        let square = (origin, origin + self.chunk_size_m);
        let lattice = Lattice::new(&*self.base, self.key);
        let finder = Finder {
            params: &self.params,
            lattice: &lattice,
            ways: &*self.ways,
            key: self.key,
        };
        // Streams that meet a reach which comes near do so within its length.
        let margin = margin_m + CHANNEL_REACH_M;
        let streams = self.streams_near(&finder, square, margin + LONGEST_REACH_M);
        let mut ponds = BTreeMap::new();
        for stream in &streams {
            let hollow = stream.nodes[stream.nodes.len() - 1];
            if let Some(pond) = self.pond(&finder, hollow) {
                ponds.insert(hollow, pond);
            }
        }
        self.add_ponds_near(&finder, square, margin_m, &mut ponds);
        let reaches = reaches(&finder, &streams, &ponds);
        ChunkWater::new(
            origin,
            self.chunk_size_m,
            margin_m,
            reaches,
            ponds.into_values(),
        )
    }

    /// The streams that may come within `margin_m` of a square, in the order of their springs.
    fn streams_near(
        &self,
        finder: &Finder<'_>,
        square: (DVec2, DVec2),
        margin_m: f64,
    ) -> Vec<Arc<Stream>> {
        if self.params.springs_per_km2 <= 0.0 {
            return Vec::new();
        }
        let reach = REACH_M + margin_m;
        let first = ((square.0 - reach) / CELL_M).floor();
        let last = ((square.1 + reach) / CELL_M).floor();
        let mut found = Vec::new();
        for x in first.x as i32..=last.x as i32 {
            for y in first.y as i32..=last.y as i32 {
                let make = || finder.stream([x, y]).map(Arc::new);
                let stream = get_or_make(&self.streams, [x, y], make);
                found.extend(stream.filter(|s| s.is_near(square, margin_m)));
            }
        }
        found
    }

    fn pond(&self, finder: &Finder<'_>, hollow: Node) -> Option<Arc<Pond>> {
        get_or_make(&self.ponds, hollow, || finder.pond(hollow).map(Arc::new))
    }

    /// Adds the ponds without a stream that may come near a square.
    fn add_ponds_near(
        &self,
        finder: &Finder<'_>,
        square: (DVec2, DVec2),
        margin_m: f64,
        ponds: &mut BTreeMap<Node, Arc<Pond>>,
    ) {
        if self.params.ponds <= 0.0 {
            return;
        }
        let reach = margin_m + 2.6 * self.params.pond_radius_m;
        let first = ((square.0 - reach) / SPACING_M).floor();
        let last = ((square.1 + reach) / SPACING_M).ceil();
        for x in first.x as i32..=last.x as i32 {
            for y in first.y as i32..=last.y as i32 {
                let mut rng = self.key.domain(PONDS).chunk([x, y]).item(1).rng();
                if rng.chance(self.params.ponds)
                    && finder.lattice.next([x, y]).is_none()
                    && let Some(pond) = self.pond(finder, [x, y])
                {
                    ponds.insert([x, y], pond);
                }
            }
        }
    }
}

/// The value of a key, which is made if it is not there. Whoever asks for it meanwhile waits for
/// the thread that makes it, on which all of the work is done. What makes a value asks other
/// memories in one order, and never its own, so nobody waits in a circle.
fn get_or_make<K: Clone + Eq + Hash, V: Clone>(
    cache: &Cache<K, V>,
    key: K,
    make: impl FnOnce() -> V,
) -> V {
    let Ok(value) = cache.get_or_insert_with(&key, || Ok::<_, Infallible>(make()));
    value
}
