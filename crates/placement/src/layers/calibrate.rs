//! Calibration: finds hard cores for a target number, and the share of a sample (or of planted
//! rows) that is to be kept.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::ChunkCoord;
use nemoral_seed::{Domain, Draw, Key};

use super::blocks::Blocks;
use super::open_land::EdgeProfile;
use super::params::{LayerParams, PlacementParams};
use super::patches::{PatchMap, Patches};
use super::rows::Rows;
use super::size_bias::SizeBias;
use crate::error::PlacementError;
use crate::sampler::fill::{SamplePoint, fill, halo};
use crate::sampler::quadtree::{QuadTree, is_free};
use crate::sampler::sizes::DiskSizes;
use crate::sampler::tile::Square;
use crate::variety::mean_over_radius;

const THINNING: Domain = Domain::new("placement.thinning");
const CALIBRATION: Domain = Domain::new("placement.calibration");

/// Points per square of the hard-core distance in a saturated pattern of one radius (five runs of
/// 7·10⁷ points, spread 2·10⁻⁵).
const SATURATED: f64 = 0.6966;
/// The edge of the calibration's window in mean hard-core distances: some 3000 points.
const WINDOW: f64 = 72.0;
/// More rounds than this add almost no points.
const MAX_ROUNDS: u32 = 4;
/// Patterns whose halo is wider than this, in chunk edges, are found for blocks of chunks.
const WIDE_HALO: f64 = 0.5;
/// Probes along the edge of the grid that measures the room that earlier layers leave.
const PROBES: u32 = 64;

/// A layer that can be placed: its sampler and the share that is kept.
#[derive(Clone, Debug)]
pub(crate) struct CalibratedLayer {
    sizes: DiskSizes,
    pattern: Pattern,
    blocks: Arc<Blocks>,
    chunk_size_m: f64,
    /// The largest occupancy radius, in chunk edges.
    pub(crate) max_radius: f64,
    /// Per variety: the share of the pattern that is kept outside of gaps and inside of clusters.
    keep: Vec<f64>,
    in_gaps: f64,
    clusters: Option<Patches>,
    at_edges: Option<EdgeProfile>,
}

/// The pattern of places where a layer's plants could stand.
#[derive(Clone, Copy, Debug)]
enum Pattern {
    /// A sample by Bridson's algorithm, with its number of rounds.
    Fill(u32),
    Rows(Rows),
}

impl CalibratedLayer {
    /// The pattern in the square of half width `need` around a chunk's centre, before thinning; of
    /// a layer with `clusters`, all that they have of it, and some more.
    pub(crate) fn points_around(
        &self,
        key: Key,
        chunk: ChunkCoord,
        need: f64,
        clusters: Option<&PatchMap>,
    ) -> Vec<SamplePoint<Key>> {
        let whole = Square::around_tile(need);
        let Pattern::Fill(rounds) = self.pattern else {
            return self.pattern_in(key, chunk, whole);
        };
        let halo = halo(&self.sizes, rounds);
        // Where it is narrow, blocks would be computed for chunks that nobody asks for.
        if halo > WIDE_HALO {
            let make = |chunk, need| self.pattern_in(key, chunk, Square::around_tile(need));
            return self.blocks.points_around(key, chunk, need, &make);
        }
        if let Some(clusters) = clusters {
            // Clusters are dense, and most of the plane is not in one.
            let cost = |square: Square| {
                let edge = 2.0 * (square.half_width + halo);
                edge * edge
            };
            let squares: Vec<Square> = clusters.squares(need).collect();
            if squares.iter().copied().map(cost).sum::<f64>() < cost(whole) {
                let points = (squares.into_iter()).flat_map(|s| self.pattern_in(key, chunk, s));
                let mut points: Vec<_> = points.filter(|p| whole.contains(p.p)).collect();
                points.sort_unstable_by_key(|point| point.key);
                points.dedup_by_key(|point| point.key);
                return points;
            }
        }
        self.pattern_in(key, chunk, whole)
    }

    /// The pattern in a square, computed anew; that of rows in one around the chunk's centre.
    fn pattern_in(&self, key: Key, chunk: ChunkCoord, square: Square) -> Vec<SamplePoint<Key>> {
        let (sizes, size_m) = (&self.sizes, self.chunk_size_m);
        match self.pattern {
            Pattern::Fill(rounds) => fill(sizes, rounds, key, chunk.into(), square),
            Pattern::Rows(rows) => rows.plant(sizes, key, chunk, size_m, square.half_width),
        }
    }

    /// Its clusters, if it has any.
    pub(crate) fn clusters(&self, key: Key, chunk: ChunkCoord, need: f64) -> Option<PatchMap> {
        let clusters = self.clusters.as_ref()?;
        Some(clusters.around(key, chunk, self.chunk_size_m, need))
    }

    /// Whether its density in gaps differs.
    pub(crate) fn minds_gaps(&self) -> bool {
        self.in_gaps != 1.0
    }

    /// Its density at a distance from the edge of a wood, if that matters to it.
    pub(crate) fn at_edge(&self, depth_m: impl FnOnce() -> f64) -> f64 {
        (self.at_edges.as_ref()).map_or(1.0, |profile| profile.at(depth_m()))
    }

    /// The thinning, which is keyed by the point and depends on nothing but the patches that the
    /// point is in, and on its density at the edge of a wood.
    pub(crate) fn keeps(
        &self,
        point: &SamplePoint<Key>,
        gaps: Option<&PatchMap>,
        clusters: Option<&PatchMap>,
        at_edge: f64,
    ) -> bool {
        if clusters.is_some_and(|c| !c.contain(point.p)) {
            return false;
        }
        let in_gap = self.minds_gaps() && gaps.is_some_and(|g| g.contain(point.p));
        let factor = if in_gap { self.in_gaps } else { 1.0 };
        self.keeps_share(point, together(factor, at_edge))
    }

    fn keeps_share(&self, point: &SamplePoint<Key>, factor: f64) -> bool {
        let mut rng = point.key.domain(THINNING).rng();
        rng.chance(factor * self.keep[usize::from(point.variety)])
    }
}

/// How uneven a layer's density is: its mean over woods and its maximum, relative to the density
/// outside of gaps and inside of clusters.
struct Unevenness {
    mean: f64,
    most: f64,
}

impl Unevenness {
    fn of(params: &PlacementParams, layer: &LayerParams) -> Self {
        let gap_share = params.gaps.map_or(0.0, |g| g.share);
        let cluster_share = layer.clusters.map_or(1.0, |c| c.share);
        let in_gaps = params.gaps.map_or(1.0, |_| layer.in_gaps);
        let at_edges = layer.at_edges.as_ref().map_or(1.0, EdgeProfile::most);
        Self {
            mean: (1.0 - gap_share + gap_share * in_gaps) * cluster_share,
            most: in_gaps.max(1.0).max(at_edges),
        }
    }
}

/// The relative density of a layer in a gap at the edge of a wood: where it is light for both
/// reasons, the greater one counts.
fn together(in_gap: f64, at_edge: f64) -> f64 {
    if in_gap > 1.0 && at_edge > 1.0 {
        in_gap.max(at_edge)
    } else {
        in_gap * at_edge
    }
}

/// Makes every layer of valid parameters, in order, by growing a window of each; `None` for an
/// empty layer.
///
/// Calibration has a key of its own, so that equal parameters keep equal shares in every world.
pub(crate) fn calibrate(
    params: &PlacementParams,
) -> Result<Vec<Option<CalibratedLayer>>, PlacementError> {
    let mut layers = Vec::new();
    let mut earlier = EarlierLayers {
        factor: params.factor(),
        half: f64::INFINITY,
        points: Vec::new(),
    };
    for (number, layer) in params.layers.iter().enumerate() {
        if layer.per_chunk == 0.0 {
            layers.push(None);
            continue;
        }
        let target = layer.per_chunk
            / (params.allowed_fraction * params.density_factor * params.density_factor);
        let uneven = Unevenness::of(params, layer);
        // The hard cores must leave room where the density is greatest, too.
        let sizes = sizes(params, layer, target * uneven.most / uneven.mean);
        let half = WINDOW * sizes.mean_core();
        let max_radius = layer.max_radius_m() / params.chunk_size_m;
        // Slightly more than will be needed, so that rounding puts no radius beyond the last probe.
        let clearances = Clearances::of(&earlier, 1.001 * params.factor() * max_radius);
        // The share of all darts of a variety that overlap neither rocks nor earlier layers.
        let room: Vec<f64> = layer
            .varieties
            .iter()
            .map(|v| {
                mean_over_radius(v, |r| rock_free(params, r))
                    * mean_over_radius(v, |r| {
                        clearances.share(params.factor() * r / params.chunk_size_m)
                    })
            })
            .collect();
        let key = Key::world(0).domain(CALIBRATION).item(number as u64);
        let mut most = f64::INFINITY;
        let mut patterns: Vec<Pattern> = (1..=MAX_ROUNDS).map(Pattern::Fill).collect();
        if let Some(rows) = layer.rows {
            patterns = vec![Pattern::Rows(rows)];
        }
        for pattern in patterns {
            let mut made = CalibratedLayer {
                sizes: sizes.clone(),
                pattern,
                blocks: Arc::default(),
                chunk_size_m: params.chunk_size_m,
                max_radius,
                keep: Vec::new(),
                in_gaps: layer.in_gaps,
                clusters: layer.clusters,
                at_edges: layer.at_edges.clone(),
            };
            let square = Square::around_tile(half);
            let points = made.pattern_in(key, ChunkCoord::default(), square);
            let (filled, bias) = match pattern {
                Pattern::Fill(_) => (
                    points.len() as f64 / (4.0 * half * half),
                    SizeBias::of(&sizes, layer, &points),
                ),
                // Planted places are known and take any variety.
                Pattern::Rows(rows) => (rows.per_chunk(params.chunk_size_m), SizeBias::NONE),
            };
            made.keep = (0..room.len())
                .map(|i| target / (uneven.mean * filled * bias.acceptance(&sizes, i) * room[i]))
                .collect();
            let kept = made.keep.iter().zip(&layer.varieties);
            most = kept
                .filter(|(_, v)| v.weight > 0.0)
                .map(|(keep, _)| *keep * uneven.most)
                .fold(0.0, f64::max);
            if most <= 1.0 {
                earlier.add(points, &made, uneven.mean, half);
                layers.push(Some(made));
                break;
            }
        }
        if layers.len() == number {
            return Err(PlacementError::TooDense {
                layer: number,
                name: layer.name.clone(),
                per_chunk: layer.per_chunk,
                at_most: layer.per_chunk / most,
            });
        }
    }
    Ok(layers)
}

/// The points of the layers so far in the calibration's window.
struct EarlierLayers {
    factor: f64,
    /// Half the edge of the square where the points are complete.
    half: f64,
    points: Vec<SamplePoint<Key>>,
}

impl EarlierLayers {
    /// Adds a layer with `share` of its density everywhere. For the mean room that others find,
    /// this is equivalent to the full density in a part of the plane.
    fn add(
        &mut self,
        mut points: Vec<SamplePoint<Key>>,
        layer: &CalibratedLayer,
        share: f64,
        half: f64,
    ) {
        let half = half.min(self.half);
        let index = self.index();
        let square = Square::around_tile(half);
        points.retain(|p| {
            square.contains(p.p)
                && layer.keeps_share(p, share)
                && is_free(&index, p.p, self.factor * p.radius)
        });
        self.half = half;
        self.points.retain(|p| square.contains(p.p));
        self.points.append(&mut points);
    }

    fn index(&self) -> QuadTree {
        let mut index = QuadTree::new(DVec2::splat(0.5 - self.half), 2.0 * self.half);
        for point in &self.points {
            index.insert(point.p, self.factor * point.radius);
        }
        index
    }
}

/// The hard cores of a layer: `hard_core` times the spacing that the target implies, and more for
/// large varieties.
fn sizes(params: &PlacementParams, layer: &LayerParams, target: f64) -> DiskSizes {
    let total: f64 = layer.varieties.iter().map(|v| v.weight).sum();
    let mid = |i: usize| (layer.varieties[i].radius_m.0 + layer.varieties[i].radius_m.1) / 2.0;
    // The room that a tree takes grows like the width of its crown, which is about the square root
    // of its stem's: a stem four times as thick keeps twice the distance. Where its own occupancy
    // is larger, that decides.
    let relative: Vec<f64> = {
        let mean = (0..layer.varieties.len())
            .map(|i| layer.varieties[i].weight / total * mid(i))
            .sum::<f64>();
        (0..layer.varieties.len())
            .map(|i| libm::sqrt(mid(i) / mean).clamp(0.5, 2.0))
            .collect()
    };
    let mean_square: f64 = layer
        .varieties
        .iter()
        .zip(&relative)
        .map(|(v, r)| v.weight / total * r * r)
        .sum();
    let core = params.hard_core * libm::sqrt(SATURATED / (target * mean_square)) / 2.0;
    DiskSizes::new(
        &layer.varieties,
        relative.iter().map(|r| core * r).collect(),
        params.chunk_size_m,
        params.factor(),
    )
}

/// The share of the plane where rocks leave room for a radius (m): rocks fall nearly independently.
fn rock_free(params: &PlacementParams, radius_m: f64) -> f64 {
    let rocks = &params.rocks;
    if rocks.max_per_chunk == 0 {
        return 1.0;
    }
    let total: f64 = rocks.varieties.iter().map(|v| v.weight).sum();
    let area_m2 = |rock_m: f64| {
        let reach = params.rock_factor() * (rock_m + radius_m);
        PI * reach * reach
    };
    let mean_area_m2: f64 = rocks
        .varieties
        .iter()
        .map(|v| v.weight / total * mean_over_radius(v, area_m2))
        .sum();
    let number = f64::from(rocks.min_per_chunk + rocks.max_per_chunk) / 2.0;
    libm::exp(-number * mean_area_m2 / (params.chunk_size_m * params.chunk_size_m))
}

/// The distances of probes from the nearest site, ascending, up to the greatest that is needed.
struct Clearances(Vec<f64>);

impl Clearances {
    /// `most` is the largest scaled radius that [`share`](Self::share) will be called with.
    fn of(earlier: &EarlierLayers, most: f64) -> Self {
        if earlier.points.is_empty() {
            return Self(Vec::new());
        }
        let index = earlier.index();
        let largest = earlier.points.iter().map(|p| p.radius).fold(0.0, f64::max);
        let half = earlier.half - (most + earlier.factor * largest);
        let mut rng = Key::world(0).domain(CALIBRATION).rng();
        let mut clearances = Vec::new();
        for y in 0..PROBES {
            for x in 0..PROBES {
                let cell = DVec2::new(f64::from(x), f64::from(y));
                let at = (cell + DVec2::new(rng.unit_f64(), rng.unit_f64())) / f64::from(PROBES);
                let p = DVec2::splat(0.5 - half) + at * (2.0 * half);
                let mut clearance = most;
                let _ = index.search(p, most, &mut |i| {
                    if let Some((q, r)) = index.get(i) {
                        clearance = clearance.min(p.distance(q) - r);
                    }
                    ControlFlow::Continue(())
                });
                clearances.push(clearance);
            }
        }
        clearances.sort_unstable_by(f64::total_cmp);
        Self(clearances)
    }

    /// The share of the plane where a disc finds room.
    fn share(&self, radius: f64) -> f64 {
        if self.0.is_empty() {
            return 1.0;
        }
        let blocked = self.0.partition_point(|c| *c < radius);
        1.0 - blocked as f64 / self.0.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variety::Variety;

    #[test]
    fn clusters_have_the_pattern_that_is_there_without_them() {
        let variety = Variety {
            weight: 1.0,
            radius_m: (0.05, 0.1),
        };
        let clusters = Patches {
            share: 0.08,
            radius_m: (2.0, 5.0),
        };
        let layer = CalibratedLayer {
            sizes: DiskSizes::new(&[variety], vec![0.006], 50.0, 1.0),
            pattern: Pattern::Fill(1),
            blocks: Arc::default(),
            chunk_size_m: 50.0,
            max_radius: 0.002,
            keep: vec![1.0],
            in_gaps: 1.0,
            clusters: Some(clusters),
            at_edges: None,
        };
        let (key, need) = (Key::world(8), 0.55);
        let (mut found, mut of_plane) = (0, 0);
        for (x, y) in [(0, 0), (-7, 3), (40, -1), (1_000_000, -1_000_000)] {
            let chunk = ChunkCoord::new(x, y);
            let map = layer.clusters(key, chunk, need).expect("it has clusters");
            let in_clusters = |mut points: Vec<SamplePoint<Key>>| {
                points.retain(|p| map.contain(p.p));
                points.sort_unstable_by_key(|p| p.key);
                let bits = points.iter().map(|p| (p.key, p.p, p.radius));
                bits.collect::<Vec<_>>()
            };
            let whole = layer.points_around(key, chunk, need, None);
            let of_clusters = layer.points_around(key, chunk, need, Some(&map));
            found += of_clusters.len();
            of_plane += whole.len();
            assert!(in_clusters(of_clusters) == in_clusters(whole), "{chunk}");
        }
        // Most of the plane is not looked at.
        assert!(
            3 * found < 2 * of_plane && found > 100,
            "{found} of {of_plane}"
        );
    }
}
