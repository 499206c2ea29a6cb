//! All trails of a world.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fmt;
use std::hash::Hash;
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::{Domain, Draw, Key};
use quick_cache::sync::Cache;

use crate::dressing_placement::{beds, culverts, grass, roots, steps, stones, strip, verges};
use crate::given::{course, free_ends};
use crate::layer::Earthworks;
use crate::layout::{Course, Layout};
use crate::path::STEP_M;
use crate::route::{Block, Router};
use crate::trail_id::TrailId;
use crate::turning;
use crate::{
    DressingKind, ParamError, TrailDressing, TrailGround, TrailParams, TrailPath, TrailZone, Way,
};

/// Hands over what lies along a trail's passage through a chunk.
type Dress<'a> = dyn Fn(&TrailPath, ChunkCoord, &mut dyn FnMut(TrailDressing)) + 'a;

const TRAILS: Domain = Domain::new("trails");
const WAYS: Domain = Domain::new("trails.ways");

/// The greatest coordinate of a given line, metres.
const FARTHEST_M: f64 = 1e8;
/// The greatest length of all given lines together, metres.
const LONGEST_M: f64 = 1e7;
/// The greatest margin around a chunk, metres.
const WIDEST_M: f64 = 1000.0;
/// The greatest distance within which a trail is searched, metres.
const SEARCHED_M: f64 = 5000.0;
/// No chunk that is searched or makes a trail there is as many chunks away.
const SEARCHED_CHUNKS: i32 = 10_000;
/// How much farther than its nearest place the chunk of a passage may be, metres.
const BESIDE_M: f64 = 2.0;

/// The trails of an endless world, found from any chunk.
///
/// A value is a pure function of its parameters, key and ground: neither earlier calls, nor
/// threads, nor evictions from its bounded cache can change a result.
pub struct Trails {
    params: TrailParams,
    ways: Vec<Arc<Way>>,
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

    /// These trails and further ones along given lines, of the way with this number among the
    /// parameters' ways (the last one, if there are fewer): smooth curves through their vertices,
    /// in world coordinates. Lines shorter than a metre are left out. Trails narrow and fade at
    /// their ends, but where the line's other end or the end of another given line is within a
    /// metre: there they go on.
    ///
    /// # Errors
    /// If a coordinate of a vertex is not within ±100,000 km, or if lines are longer than 10,000 km
    /// in all.
    pub fn along(mut self, lines_m: &[Vec<DVec2>], way: usize) -> Result<Self, ParamError> {
        for (number, line) in lines_m.iter().enumerate() {
            let beyond = |p: &&DVec2| !p.abs().cmple(DVec2::splat(FARTHEST_M)).all();
            if let Some(vertex) = line.iter().find(beyond) {
                let field = format!("lines_m[{number}]");
                return Err(ParamError::new(field, vertex, "finite and within ±1e8 m"));
            }
        }
        let length_m =
            |line: &Vec<DVec2>| line.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
        let all_m: f64 = lines_m.iter().map(length_m).sum();
        ParamError::check(all_m <= LONGEST_M, "lines_m", all_m, "at most 1e7 m in all")?;
        let way = way.min(self.ways.len() - 1);
        let numbered = (self.numbered..).zip(lines_m);
        let courses: Vec<Course> = numbered
            .filter_map(|(number, line)| course(line, number, self.chunk_size_m))
            .collect();
        let known = self.given.iter().map(|path| {
            let knots = path.knots();
            let ends = [0, knots.len() - 1].map(|i| knots[i].position);
            (ends, path.length_m())
        });
        let added = courses.iter().map(|course| {
            let [first, last] = [0, course.points.len() - 1].map(|i| course.points[i]);
            ([first.0, last.0], last.2)
        });
        let free = free_ends(&known.chain(added).collect::<Vec<_>>());
        let (of_known, of_added) = free.split_at(self.given.len());
        for (i, &free) in of_known.iter().enumerate() {
            let path = Arc::clone(&self.given[i]);
            if path.free() != free {
                self.given[i] = Arc::new(self.lay(path.way_number(), path.course(free)));
            }
        }
        for (course, &free) in courses.into_iter().zip(of_added) {
            let path = Arc::new(self.lay(way, Course { free, ..course }));
            for chunk in path.chunks() {
                let here = self.given_in.entry([chunk.x, chunk.y]).or_default();
                if here.last() != Some(&self.given.len()) {
                    here.push(self.given.len());
                }
            }
            self.given.push(path);
        }
        self.numbered += lines_m.len() as u32;
        if !self.given.is_empty() && !self.used[way] {
            self.used[way] = true;
            self.earthworks = Earthworks::new(&self.ways, &self.used);
        }
        Ok(self)
    }

    /// The kinds of way of which there are trails.
    fn used_ways(&self) -> impl Iterator<Item = &Way> {
        let used = self.ways.iter().zip(&self.used).filter(|(_, used)| **used);
        used.map(|(way, _)| &**way)
    }

    /// The given trails that touch a chunk.
    fn given_in(&self, chunk: ChunkCoord) -> &[usize] {
        self.given_in
            .get(&[chunk.x, chunk.y])
            .map_or(&[], Vec::as_slice)
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

    /// The trail nearest to a point within `radius_m` of it, and the arc length of the closest
    /// point of its middle. Chunks are searched ring by ring until a trail is found; a radius above
    /// 5 km counts as that.
    #[must_use]
    pub fn nearest(&self, world_m: DVec2, radius_m: f64) -> Option<(Arc<TrailPath>, f64)> {
        self.nearest_where(world_m, radius_m, |_| true)
    }

    /// As [`nearest`](Self::nearest), of the trails that are `wanted`.
    #[must_use]
    pub fn nearest_where(
        &self,
        world_m: DVec2,
        radius_m: f64,
        wanted: impl Fn(&TrailPath) -> bool,
    ) -> Option<(Arc<TrailPath>, f64)> {
        let size = self.chunk_size_m;
        // Rings of chunks have coordinates, and what is not a number has no trail.
        let farthest_m = f64::from(i32::MAX - SEARCHED_CHUNKS) * size;
        let has_chunks = world_m.abs().cmple(DVec2::splat(farthest_m)).all();
        if !has_chunks || radius_m.is_nan() {
            return None;
        }
        let radius_m = radius_m.min(SEARCHED_M);
        let centre = ChunkCoord::containing(world_m, size);
        let rings = (radius_m / size).ceil().max(0.0) as i32;
        let (bound_m, _) = (0..=rings).find_map(|i| {
            let near = ring(centre, i).filter(|c| c.distance_m(world_m, size) <= radius_m);
            self.nearest_in(near, (world_m, radius_m), &wanted)
        })?;
        // In the next rings there may be nearer ones, and of equally near ones the first counts.
        let reach_m = radius_m.min(bound_m + BESIDE_M);
        let near = ChunkCoord::within(world_m, reach_m, size).into_iter();
        let best = self.nearest_in(near, (world_m, radius_m), &wanted);
        best.map(|(_, found)| found)
    }

    /// The nearest of the trails that are `wanted` by their passages through chunks, its distance
    /// and the arc length of its closest point; of equally near ones, that which is found first.
    fn nearest_in(
        &self,
        chunks: impl Iterator<Item = ChunkCoord>,
        (world_m, radius_m): (DVec2, f64),
        wanted: &impl Fn(&TrailPath) -> bool,
    ) -> Option<(f64, (Arc<TrailPath>, f64))> {
        let mut best = (radius_m, None);
        for chunk in chunks {
            for path in self.in_chunk(chunk).into_iter().filter(|p| wanted(p)) {
                for (_, _, knots) in path.transits().filter(|t| t.1 == chunk) {
                    let square = |i: usize| path.knots()[i].position.distance_squared(world_m);
                    // The knot after a transit's last is on its border.
                    let end = (knots.end + 1).min(path.knots().len());
                    let knot = (knots.start..end).min_by(|&a, &b| square(a).total_cmp(&square(b)));
                    let foot = knot.map(|knot| path.foot(world_m, knot));
                    let closer = |d: f64| d < best.0 || (d == best.0 && best.1.is_none());
                    if let Some(foot) = foot.filter(|f| closer(f.distance)) {
                        best = (foot.distance, Some((Arc::clone(&path), foot.arc)));
                    }
                }
            }
        }
        let (distance_m, found) = best;
        found.map(|found| (distance_m, found))
    }

    /// What lies and grows on trails and at their edges, whose position is in a chunk: grass in a
    /// keyed order, then stones, verges, roots and beds, culverts, and steps, by trail. At most the
    /// greatest `grass_max_per_chunk` of tufts grow on the trails, however many meet there;
    /// where they meet, the verge of one does not grow on another.
    #[must_use]
    pub fn dressing(&self, coord: ChunkCoord) -> Vec<TrailDressing> {
        let size = self.chunk_size_m;
        let spread_m = self
            .used_ways()
            .fold(0.0_f64, |a, w| a.max(w.grass_spread_m));
        let rings = (spread_m / size).ceil().max(1.0) as i32;
        let here = |p: DVec2| ChunkCoord::containing(p, size) == coord;
        let most = self.used_ways().map(|w| w.grass_max_per_chunk).max();
        let most = most.unwrap_or(0) as usize;
        // The keyed priority decides which tufts stay.
        let keep = |tufts: &mut Vec<(u64, TrailDressing)>| {
            tufts.sort_by_key(|t| t.0);
            tufts.truncate(most);
        };
        let mut tufts = Vec::new();
        for x in -rings..=rings {
            for y in -rings..=rings {
                let chunk = coord.offset(x, y);
                for path in self.in_chunk(chunk) {
                    grass(self.key, &path, chunk, |priority, tuft| {
                        if here(tuft.position_m) {
                            tufts.push((priority, tuft));
                            // However many passages there are, memory stays bounded.
                            if tufts.len() >= 4 * most + 4096 {
                                keep(&mut tufts);
                            }
                        }
                    });
                }
            }
        }
        keep(&mut tufts);
        let mut dressing: Vec<_> = tufts.into_iter().map(|t| t.1).collect();
        for path in self.in_chunk(coord) {
            dressing.extend(path.stones().iter().filter(|s| here(s.position_m)));
        }
        let has_any = |of: &dyn Fn(&Way) -> f64| self.used_ways().any(|w| of(w) > 0.0);
        if has_any(&|w| w.verge_tufts_per_m) {
            self.add(coord, &mut dressing, &|path, chunk, emit| {
                verges(self.key, path, chunk, emit);
            });
        }
        if has_any(&|w| w.roots_per_m) || has_any(&|w| w.stone_beds) {
            self.add(coord, &mut dressing, &|path, chunk, emit| {
                roots(self.key, path, chunk, &mut *emit);
                beds(self.key, path, chunk, emit);
            });
        }
        if has_any(&|w| w.culvert_spacing_m) {
            self.add(coord, &mut dressing, &|path, chunk, emit| {
                culverts(self.key, path, chunk, emit);
            });
        }
        if has_any(&|w| w.steps_from_grade) {
            self.add(coord, &mut dressing, &|path, chunk, emit| {
                steps(self.key, path, chunk, emit);
            });
        }
        if has_any(&|w| w.strip_cover) {
            self.add(coord, &mut dressing, &|path, chunk, emit| {
                strip(self.key, path, chunk, emit);
            });
        }
        dressing
    }

    /// Adds what trails have in a chunk, each along its passage through one; nothing of a verge or
    /// a ditch lies on another trail, and no root or step on another kind of way.
    fn add(&self, coord: ChunkCoord, dressing: &mut Vec<TrailDressing>, dress: &Dress<'_>) {
        let size = self.chunk_size_m;
        let mut added = Vec::new();
        // A trail just beyond the border may have a verge here.
        for x in -1..=1 {
            for y in -1..=1 {
                let chunk = coord.offset(x, y);
                for path in self.in_chunk(chunk) {
                    dress(&path, chunk, &mut |it| {
                        if ChunkCoord::containing(it.position_m, size) == coord {
                            added.push((path.way_number(), it));
                        }
                    });
                }
            }
        }
        if added.is_empty() {
            return;
        }
        let ground = self.ground_near(coord, 0.0);
        let stays = |&(own, d): &(usize, TrailDressing)| match d.kind {
            DressingKind::Verge | DressingKind::Bed | DressingKind::Culvert => {
                ground.edge_m(d.position_m) >= 0.0
            }
            DressingKind::Strip => ground.zone(d.position_m) == TrailZone::Strip,
            _ => (ground.way_number(d.position_m)).is_none_or(|way| way == own),
        };
        dressing.extend(added.into_iter().filter(stays).map(|(_, d)| d));
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

/// The chunks that are this many chunks away from one, diagonally too, in order of (x, y).
fn ring(centre: ChunkCoord, rings: i32) -> impl Iterator<Item = ChunkCoord> {
    (-rings..=rings).flat_map(move |x| {
        // Whole columns at both sides, and the ends of those between.
        let step = if x.abs() == rings {
            1
        } else {
            2 * rings as usize
        };
        (-rings..=rings)
            .step_by(step)
            .map(move |y| centre.offset(x, y))
    })
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
    fn lines_that_are_not_finite_are_refused() {
        for bad in [f64::NAN, f64::INFINITY, -1e300] {
            let base = Arc::new(FlatSurface::default());
            let trails = Trails::new(TrailParams::default(), 50.0, Key::world(3), base);
            let good = vec![DVec2::ZERO, DVec2::new(40.0, 0.0)];
            let spoilt = vec![DVec2::ZERO, DVec2::new(40.0, bad)];
            let found = trails.expect("valid").along(&[good, spoilt], 0);
            let error = found.expect_err("refused").to_string();
            let said = "lines_m[1] = [40, ";
            assert!(
                error.starts_with(said) && error.ends_with("within ±1e8 m"),
                "{error}"
            );
        }
    }

    #[test]
    fn given_lines_are_trails_in_every_chunk_that_they_cross() {
        let params = TrailParams {
            spawn_probability: 0.0,
            ..TrailParams::default()
        };
        let line = vec![
            DVec2::new(-70.0, 3.0),
            DVec2::new(-20.0, 12.0),
            DVec2::new(-20.0, 12.3),
            DVec2::new(35.0, -4.0),
            DVec2::new(80.0, 40.0),
        ];
        let short = vec![DVec2::ZERO, DVec2::new(0.3, 0.0)];
        let base = Arc::new(FlatSurface::default());
        let trails = Trails::new(params, 50.0, Key::world(3), base).expect("valid");
        assert!(!trails.is_crossed(ChunkCoord::new(0, 0)));
        let trails = trails.along(&[short, line.clone()], 0).expect("finite");
        for (i, vertex) in line.iter().enumerate() {
            let chunk = ChunkCoord::containing(*vertex, 50.0);
            assert!(trails.is_crossed(chunk) && trails.in_chunk(chunk).len() == 1);
            let ground = trails.ground_near(chunk, 2.0);
            let inner = i > 0 && i + 1 < line.len();
            // The middle of the surface, which is narrower at its ends.
            let edge = ground.edge_m(*vertex);
            let width = 0.5 * trails.params().ways[0].0.width_m;
            assert!(
                edge < -0.25 && (!inner || (edge + width).abs() < 0.4),
                "{vertex}: {edge}"
            );
            let edges = trails.edges_near(chunk, 2.0);
            assert_eq!(edges.edge_m(*vertex).to_bits(), edge.to_bits());
        }
        // Every place along it is on it, from whichever chunk it is asked.
        let (path, _) = trails.nearest(DVec2::ZERO, 100.0).expect("it is near");
        assert_eq!(path.id().number, 2);
        let mut s_m = 0.0;
        while s_m < path.length_m() {
            let p = path.position_m(s_m);
            let home = ChunkCoord::containing(p, 50.0);
            let here = trails.ground_near(home, 2.0).edge_m(p);
            assert!(here < -0.25, "{s_m}: {here}");
            s_m += 0.37;
        }
        assert!(!trails.is_crossed(ChunkCoord::new(3, 3)));
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

    #[test]
    fn of_endless_grass_the_same_tufts_stay() {
        let way = Way {
            grass_max_per_chunk: 10,
            rocks_max_per_trail: 0,
            verge_tufts_per_m: 0.0,
            strip_cover: 0.0,
            ..Way::default()
        };
        let params = TrailParams {
            spawn_probability: 0.0,
            ..TrailParams::of(way)
        };
        // It crosses the border of a chunk many times.
        let line =
            (0..2400).map(|i| DVec2::new(f64::from(i % 2 * 6 - 3), 1.0 + 0.02 * f64::from(i)));
        let base = Arc::new(FlatSurface::default());
        let trails = Trails::new(params, 50.0, Key::world(1), base).expect("valid");
        let trails = trails.along(&[line.collect()], 0).expect("finite");
        let here = ChunkCoord::new(0, 0);
        let mut all = Vec::new();
        for chunk in here.square(1) {
            for path in trails.in_chunk(chunk) {
                grass(trails.key, &path, chunk, |priority, tuft| {
                    if ChunkCoord::containing(tuft.position_m, 50.0) == here {
                        all.push((priority, tuft));
                    }
                });
            }
        }
        assert!(all.len() > 4 * 10 + 4096, "{}", all.len());
        all.sort_by_key(|t| t.0);
        let first: Vec<_> = all.into_iter().take(10).map(|t| t.1).collect();
        assert_eq!(trails.dressing(here), first);
    }
}
