//! All trails of a world.

mod dressing;
mod given_lines;
mod nearest;

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fmt;
use std::hash::Hash;
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::{Domain, Draw, Key};
use quick_cache::sync::Cache;

use crate::dressing_placement::stones;
use crate::earthwork::Earthworks;
use crate::layout::{Course, Layout};
use crate::path::STEP_M;
use crate::route::{Block, Router};
use crate::trail_id::TrailId;
use crate::turning;
use crate::{ParamError, TrailGround, TrailParams, TrailPath, WayKind};

const TRAILS: Domain = Domain::new("trails");
const WAYS: Domain = Domain::new("trails.ways");

/// The greatest margin around a chunk, metres.
const WIDEST_M: f64 = 1000.0;

/// The trails of an endless world, found from any chunk.
///
/// A value is a pure function of its parameters, key and ground: neither earlier calls, nor
/// threads, nor evictions from its bounded cache can change a result.
pub struct Trails {
    params: TrailParams,
    ways: Vec<Arc<WayKind>>,
    /// Whether there are trails of each of them.
    used: Vec<bool>,
    earthworks: Earthworks,
    chunk_size_m: f64,
    key: Key,
    base: Arc<dyn Surface>,
    router: Router,
    /// The trails of the chunks of a block.
    through: Cache<Block, Arc<[Arc<[TrailId]>]>>,
    paths: Cache<TrailId, Arc<TrailPath>>,
    /// The same on the map only.
    outlines: Cache<TrailId, Arc<TrailPath>>,
    /// Trails along given lines.
    given: Vec<Arc<TrailPath>>,
    /// The number of the next of them.
    numbered: u32,
    /// The indices of those that touch each chunk.
    given_in: BTreeMap<[i32; 2], Vec<usize>>,
}

/// The edges of trails near a chunk.
#[derive(Debug)]
pub struct TrailEdges(TrailGround);

impl TrailEdges {
    /// Signed distance to the edge of the union of trail surfaces, metres: negative on a trail,
    /// `f64::INFINITY` farther than 12 m from all.
    #[must_use]
    pub fn edge_m(&self, world_m: DVec2) -> f64 {
        self.0.edge_m(world_m)
    }
}

impl fmt::Debug for Trails {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Trails")
            .field("params", &self.params)
            .field("chunk_size_m", &self.chunk_size_m)
            .finish_non_exhaustive()
    }
}

impl Trails {
    /// The trails of the world of `key`, in square chunks, on a ground `base`.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(
        params: TrailParams,
        chunk_size_m: f64,
        key: Key,
        base: Arc<dyn Surface>,
    ) -> Result<Self, ParamError> {
        Self::with_memory(params, chunk_size_m, key, base, [256, 160])
    }

    /// Trails whose caches hold this number of blocks' trails, and of paths.
    fn with_memory(
        params: TrailParams,
        chunk_size_m: f64,
        key: Key,
        base: Arc<dyn Surface>,
        [through, paths]: [usize; 2],
    ) -> Result<Self, ParamError> {
        params.check(chunk_size_m)?;
        let key = key.domain(TRAILS);
        let ways: Vec<_> = params.ways.iter().map(|w| Arc::new(w.0.clone())).collect();
        let used: Vec<bool> = params.ways.iter().map(|w| w.1 > 0.0).collect();
        Ok(Self {
            router: Router::new(&params, key),
            earthworks: Earthworks::new(&ways, &used),
            ways,
            used,
            params,
            chunk_size_m,
            key,
            base,
            through: Cache::new(through),
            paths: Cache::new(paths),
            outlines: Cache::new(paths),
            given: Vec::new(),
            numbered: 1,
            given_in: BTreeMap::new(),
        })
    }

    /// The kinds of way of which there are trails.
    fn used_ways(&self) -> impl Iterator<Item = &WayKind> {
        let used = self.ways.iter().zip(&self.used).filter(|(_, used)| **used);
        used.map(|(way, _)| &**way)
    }

    /// The parameters of these trails.
    #[must_use]
    pub fn params(&self) -> &TrailParams {
        &self.params
    }

    /// Every trail that touches a chunk, sorted by id, given ones last.
    #[must_use]
    pub fn in_chunk(&self, coord: ChunkCoord) -> Vec<Arc<TrailPath>> {
        self.through(coord)
            .iter()
            .map(|&id| self.path(id))
            .chain(
                self.given_in(coord)
                    .iter()
                    .map(|&i| Arc::clone(&self.given[i])),
            )
            .collect()
    }

    /// The ground, trails carved in, for points at most `margin_m` from a chunk, 0..=1000; farther
    /// away it is the base ground. Other margins count as the nearest of these.
    #[must_use]
    pub fn ground_near(&self, coord: ChunkCoord, margin_m: f64) -> TrailGround {
        self.near(coord, margin_m, |id| self.path(id))
    }

    /// Whether any trail touches a chunk.
    #[must_use]
    pub fn is_crossed(&self, coord: ChunkCoord) -> bool {
        !self.through(coord).is_empty() || !self.given_in(coord).is_empty()
    }

    /// The edges of trails, for points at most `margin_m` from a chunk: as in
    /// [`ground_near`](Self::ground_near), but without computing heights.
    #[must_use]
    pub fn edges_near(&self, coord: ChunkCoord, margin_m: f64) -> TrailEdges {
        TrailEdges(self.near(coord, margin_m, |id| self.outline(id)))
    }

    /// The ground near a chunk, with paths that `path` makes.
    fn near(
        &self,
        coord: ChunkCoord,
        margin_m: f64,
        path: impl Fn(TrailId) -> Arc<TrailPath>,
    ) -> TrailGround {
        let margin_m = if margin_m > 0.0 {
            margin_m.min(WIDEST_M)
        } else {
            0.0
        };
        let size = self.chunk_size_m;
        // Slightly more, as vertices on the border may be computed with other rounding.
        let low = coord.origin_m(size) - DVec2::splat(margin_m + 1e-3);
        let high = low + DVec2::splat(size + 2.0 * (margin_m + 1e-3));
        let reach = (margin_m + self.earthworks.reach_m + 1.0) / size;
        let rings = reach.ceil() as i32;
        let near = move |c: ChunkCoord| {
            c.x.abs_diff(coord.x) <= rings as u32 && c.y.abs_diff(coord.y) <= rings as u32
        };
        let around = || coord.square(rings);
        let mut born: Vec<TrailId> = around().flat_map(|c| self.through(c).to_vec()).collect();
        let mut given: Vec<usize> = around().flat_map(|c| self.given_in(c).to_vec()).collect();
        given.sort_unstable();
        given.dedup();
        born.sort_unstable();
        born.dedup();
        let given = given.into_iter().map(|i| Arc::clone(&self.given[i]));
        let paths: Vec<_> = born.into_iter().map(path).chain(given).collect();
        TrailGround::new(
            &self.earthworks,
            self.key,
            Arc::clone(&self.base),
            &paths,
            (low, high),
            &near,
        )
    }

    /// The trails that were born, and their branches, that touch a chunk.
    fn through(&self, chunk: ChunkCoord) -> Arc<[TrailId]> {
        let block = Block::of(chunk);
        let make = || {
            let through = self.router.through(block).into_iter();
            through.map(Arc::from).collect()
        };
        let through = get_or_make(&self.through, block, make);
        let index = block.index(chunk).expect("a chunk is in its block");
        Arc::clone(&through[index])
    }

    fn path(&self, id: TrailId) -> Arc<TrailPath> {
        get_or_make(&self.paths, id, || {
            let course = self.layout(id).course(STEP_M);
            Arc::new(self.lay(self.way(id), course))
        })
    }

    /// The same on the map only.
    fn outline(&self, id: TrailId) -> Arc<TrailPath> {
        get_or_make(&self.outlines, id, || {
            let course = self.layout(id).course(STEP_M);
            let way = self.way(id);
            let way = (way, Arc::clone(&self.ways[way]));
            Arc::new(TrailPath::outline(way, self.key, course))
        })
    }

    /// A trail of a kind along a course, with the stones on it.
    fn lay(&self, way: usize, course: Course) -> TrailPath {
        let way = (way, Arc::clone(&self.ways[way]));
        let path = TrailPath::new(way, self.key, course, &*self.base);
        let stones = stones(self.key, &path);
        path.with_stones(stones)
    }

    /// The number of the kind of a trail that is born; branches are of their trail's kind.
    fn way(&self, id: TrailId) -> usize {
        let shares: Vec<f64> = self.params.ways.iter().map(|w| w.1).collect();
        let mut rng = self.key.domain(WAYS).chunk(id.birth).rng();
        rng.weighted(&shares).unwrap_or(0)
    }

    fn layout(&self, id: TrailId) -> Layout {
        let born = |id: TrailId, steps, fork| {
            let way = &self.ways[self.way(id)];
            let size_m = self.chunk_size_m;
            let turning_m = turning::radius_m(way.turning_radius_m, way.width_m, size_m);
            Layout::new(self.key, (id, steps), fork, size_m, turning_m, &*self.base)
        };
        let walk = self.router.walk(id.birth).into_iter().flatten();
        let trail = born(TrailId { number: 0, ..id }, walk.collect(), None);
        let Some(step) = id.leaves_at() else {
            return trail;
        };
        let walk =
            (self.router.branch(id.birth, trail.steps(), step)).expect("the router found it");
        born(id, walk.collect(), Some(trail.node(step)))
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

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::FlatSurface;

    #[test]
    fn what_is_forgotten_is_made_again() {
        let trails = |memory| {
            let params = TrailParams {
                spawn_probability: 0.1,
                max_length_chunks: 10,
                ..TrailParams::default()
            };
            let base = Arc::new(FlatSurface::default());
            Trails::with_memory(params, 50.0, Key::world(1), base, memory).expect("valid")
        };
        let (all, none) = (trails([1000, 1000]), trails([1, 1]));
        for i in 0..60 {
            let chunk = ChunkCoord::new(i * 7 % 5, i * 11 % 4);
            assert_eq!(all.dressing(chunk), none.dressing(chunk));
            let [a, b] = [&all, &none].map(|t| {
                let paths = t.in_chunk(chunk).into_iter();
                let middles: Vec<_> = paths.map(|p| (p.id(), p.position_m(55.5))).collect();
                let ground = t.ground_near(chunk, 2.0);
                let samples = (0..50).map(|i| {
                    let p = chunk.centre_m(50.0) + f64::from(i - 25);
                    (ground.sample(p), ground.edge_m(p))
                });
                (middles, samples.collect::<Vec<_>>())
            });
            assert_eq!(a, b);
        }
    }

    #[test]
    fn edges_are_where_the_ground_has_them() {
        let params = TrailParams {
            spawn_probability: 0.5,
            max_length_chunks: 10,
            ..TrailParams::default()
        };
        let base = Arc::new(FlatSurface::default());
        let trails = Trails::new(params, 50.0, Key::world(3), base).expect("valid");
        let mut on_trails = 0;
        for i in 0..9 {
            let chunk = ChunkCoord::new(i % 3 * 4, i / 3 * 4);
            assert_eq!(trails.is_crossed(chunk), !trails.in_chunk(chunk).is_empty());
            let (ground, edges) = (
                trails.ground_near(chunk, 1.0),
                trails.edges_near(chunk, 1.0),
            );
            for k in 0..400 {
                let cell = DVec2::new(f64::from(k % 20), f64::from(k / 20)) + 0.37;
                let p = chunk.origin_m(50.0) + cell * 2.5;
                assert_eq!(edges.edge_m(p).to_bits(), ground.edge_m(p).to_bits(), "{p}");
                on_trails += u32::from(edges.edge_m(p) < 0.0);
            }
        }
        assert!(on_trails > 400, "{on_trails}");
    }
}
