//! All trails of a world.

use std::fmt;
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::{Domain, Key};

use crate::cache::Cache;
use crate::dressing_placement::{grass, stones, verges};
use crate::ground::reach_m;
use crate::layout::Layout;
use crate::route::Router;
use crate::{DressingKind, ParamError, TrailDressing, TrailGround, TrailParams, TrailPath};

const TRAILS: Domain = Domain::new("trails");

/// The trails of an endless world, found from any chunk.
///
/// A pure function of its parameters, key and ground: what was asked before, from which thread, and
/// what its bounded memory has forgotten, cannot change an answer.
pub struct Trails {
    params: Arc<TrailParams>,
    chunk_size_m: f64,
    key: Key,
    base: Arc<dyn Surface>,
    router: Router,
    births: Cache<ChunkCoord, Arc<[ChunkCoord]>>,
    paths: Cache<ChunkCoord, Arc<TrailPath>>,
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
        Self::with_memory(params, chunk_size_m, key, base, [16_384, 160])
    }

    /// Trails whose caches hold so many chunks' births and so many paths.
    fn with_memory(
        params: TrailParams,
        chunk_size_m: f64,
        key: Key,
        base: Arc<dyn Surface>,
        [births, paths]: [usize; 2],
    ) -> Result<Self, ParamError> {
        params.check(chunk_size_m)?;
        let key = key.domain(TRAILS);
        Ok(Self {
            router: Router::new(&params, key),
            params: Arc::new(params),
            chunk_size_m,
            key,
            base,
            births: Cache::new(births),
            paths: Cache::new(paths),
        })
    }

    /// What these trails were made with.
    #[must_use]
    pub fn params(&self) -> &TrailParams {
        &self.params
    }

    /// Every trail that touches a chunk, sorted by id.
    #[must_use]
    pub fn in_chunk(&self, coord: ChunkCoord) -> Vec<Arc<TrailPath>> {
        self.births_through(coord)
            .iter()
            .map(|&birth| self.path(birth))
            .collect()
    }

    /// The ground, trails carved in, for points at most `margin_m` from a chunk; farther away it is
    /// the base ground.
    #[must_use]
    pub fn ground_near(&self, coord: ChunkCoord, margin_m: f64) -> TrailGround {
        let margin_m = margin_m.max(0.0);
        let size = self.chunk_size_m;
        // A hair more: vertices on the border are computed in other ways.
        let low = coord.origin_m(size) - DVec2::splat(margin_m + 1e-3);
        let high = low + DVec2::splat(size + 2.0 * (margin_m + 1e-3));
        let reach = (margin_m + reach_m(&self.params) + 1.0) / size;
        let rings = reach.ceil() as i32;
        let near = move |c: ChunkCoord| {
            c.x.abs_diff(coord.x) <= rings as u32 && c.y.abs_diff(coord.y) <= rings as u32
        };
        let mut births: Vec<ChunkCoord> = (-rings..=rings)
            .flat_map(|x| (-rings..=rings).map(move |y| coord.offset(x, y)))
            .flat_map(|c| self.births_through(c).to_vec())
            .collect();
        births.sort_unstable();
        births.dedup();
        let paths = births.into_iter().map(|birth| self.path(birth)).collect();
        TrailGround::new(
            Arc::clone(&self.params),
            Arc::clone(&self.base),
            paths,
            (low, high),
            &near,
        )
    }

    /// The trail nearest to a point within `radius_m` of it, and the arc length of the closest
    /// point of its middle. All chunks within the radius are looked at.
    #[must_use]
    pub fn nearest(&self, world_m: DVec2, radius_m: f64) -> Option<(Arc<TrailPath>, f64)> {
        let mut best = (radius_m, None);
        for chunk in ChunkCoord::within(world_m, radius_m, self.chunk_size_m) {
            for path in self.in_chunk(chunk) {
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
        best.1
    }

    /// The grass and stones of trails whose position is in a chunk: grass in a keyed order, then
    /// stones and verges by trail. At most `grass_max_per_chunk` tufts grow on the trails, however
    /// many meet there; where they meet, the verge of one does not grow on another.
    #[must_use]
    pub fn dressing(&self, coord: ChunkCoord) -> Vec<TrailDressing> {
        let size = self.chunk_size_m;
        let rings = (self.params.grass_spread_m / size).ceil().max(1.0) as i32;
        let here = |p: DVec2| ChunkCoord::containing(p, size) == coord;
        let mut tufts = Vec::new();
        for x in -rings..=rings {
            for y in -rings..=rings {
                let chunk = coord.offset(x, y);
                for path in self.in_chunk(chunk) {
                    grass(&self.params, self.key, &path, chunk, |priority, tuft| {
                        if here(tuft.position_m) {
                            tufts.push((priority, tuft));
                        }
                    });
                }
            }
        }
        // The keyed priority decides who stays.
        let most = self.params.grass_max_per_chunk as usize;
        tufts.sort_by_key(|t| t.0);
        tufts.truncate(most);
        let mut dressing: Vec<_> = tufts.into_iter().map(|t| t.1).collect();
        for path in self.in_chunk(coord) {
            dressing.extend(path.stones().iter().filter(|s| here(s.position_m)));
        }
        if self.params.verge_tufts_per_m > 0.0 {
            self.add_verges(coord, &mut dressing);
        }
        dressing
    }

    fn add_verges(&self, coord: ChunkCoord, dressing: &mut Vec<TrailDressing>) {
        let size = self.chunk_size_m;
        let others = dressing.len();
        // A trail just beyond the border has a verge here.
        for x in -1..=1 {
            for y in -1..=1 {
                let chunk = coord.offset(x, y);
                for path in self.in_chunk(chunk) {
                    verges(&self.params, self.key, &path, chunk, |tuft| {
                        if ChunkCoord::containing(tuft.position_m, size) == coord {
                            dressing.push(tuft);
                        }
                    });
                }
            }
        }
        if dressing.len() > others {
            let ground = self.ground_near(coord, 0.0);
            dressing
                .retain(|d| d.kind != DressingKind::Verge || ground.edge_m(d.position_m) >= 0.0);
        }
    }

    fn births_through(&self, chunk: ChunkCoord) -> Arc<[ChunkCoord]> {
        self.births
            .get_or_make(chunk, || self.router.births_through(chunk).into())
    }

    fn path(&self, birth: ChunkCoord) -> Arc<TrailPath> {
        self.paths.get_or_make(birth, || {
            let walk = self.router.walk(birth).into_iter().flatten();
            let base = &*self.base;
            let layout = Layout::new(self.key, walk.collect(), self.chunk_size_m, base);
            let path = TrailPath::new(&self.params, self.key, &layout, base);
            let stones = stones(&self.params, self.key, &path);
            Arc::new(path.with_stones(stones))
        })
    }
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
}
