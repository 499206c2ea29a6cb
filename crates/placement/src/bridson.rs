//! Bridson's sampler on an endless plane, without an order.
//!
//! Lengths here are in chunk edges and positions are relative to a chunk's south-west corner.
//! Positions are multiples of 2⁻³⁰, so that sums and differences of positions are exact: two chunks
//! that look at the same pair of points from different origins decide on the same bits.

use std::ops::ControlFlow;

use glam::DVec2;
use nemoral_scene::ChunkCoord;
use nemoral_seed::{Domain, Draw, Key, PhiloxRng, Rng};

use crate::index::overlap;
use crate::params::Variety;
use crate::quadtree::QuadTree;

const SEEDS: Domain = Domain::new("placement.seeds");
const DARTS: Domain = Domain::new("placement.darts");

/// The darts around each point (Bridson 2007: k, "typically 30").
const DARTS_PER_POINT: u32 = 30;
/// The initial samples thrown per square of the mean hard-core distance.
const SEED_DENSITY: f64 = 0.3;
/// More than the rounding of a position, for the reckoning of what is known.
const SLACK: f64 = 1e-8;

/// What a layer's points look like to the sampler.
#[derive(Clone, Debug)]
pub(crate) struct Kinds {
    /// Per variety: the running sum of the weights, normalised to end at 1.
    cumulative: Vec<f64>,
    /// The varieties that are ever placed, small ones first, each with its share below and its own.
    by_size: Vec<(usize, f64, f64)>,
    /// Per variety: the hard core's least radius.
    core: Vec<f64>,
    /// Per variety: the range of the occupancy radius.
    radius: Vec<(f64, f64)>,
    /// The distance rule's factor on occupancy radii.
    factor: f64,
    mean_core: f64,
    max_core: f64,
}

/// A point of the fill.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) p: DVec2,
    /// Two points of a layer are at least the sum of their hard cores apart.
    pub(crate) core: f64,
    /// The occupancy radius.
    pub(crate) radius: f64,
    pub(crate) variety: u16,
    pub(crate) key: Key,
}

impl Kinds {
    /// `core[i]` is a wish: a hard core never falls below the scaled occupancy radius.
    pub(crate) fn new(varieties: &[Variety], core: Vec<f64>, chunk_m: f64, factor: f64) -> Self {
        let total: f64 = varieties.iter().map(|v| v.weight).sum();
        let mut sum = 0.0;
        let cumulative = varieties.iter().map(|v| {
            sum += v.weight / total;
            sum
        });
        let cumulative: Vec<f64> = cumulative.collect();
        let radius: Vec<_> = varieties
            .iter()
            .map(|v| (v.radius_m.0 / chunk_m, v.radius_m.1 / chunk_m))
            .collect();
        let mut kinds = Self {
            cumulative,
            by_size: by_size(varieties, total),
            core,
            radius,
            factor,
            mean_core: 0.0,
            max_core: 0.0,
        };
        for (i, v) in varieties.iter().enumerate().filter(|(_, v)| v.weight > 0.0) {
            kinds.mean_core += v.weight / total * kinds.typical_core(i);
            let largest = kinds.core[i].max(factor * kinds.radius[i].1);
            kinds.max_core = kinds.max_core.max(largest);
        }
        kinds
    }

    /// The hard core of a variety's typical member.
    pub(crate) fn typical_core(&self, variety: usize) -> f64 {
        let (low, high) = self.radius[variety];
        self.core[variety].max(self.factor * (low + high) / 2.0)
    }

    pub(crate) fn mean_core(&self) -> f64 {
        self.mean_core
    }

    /// Draws the variety of a dart, its occupancy radius and its hard core.
    pub(crate) fn draw(&self, rng: &mut PhiloxRng) -> (u16, f64, f64) {
        let u = unit(rng);
        let last = self.cumulative.len() - 1;
        let variety = self.cumulative.partition_point(|c| *c <= u).min(last);
        self.member(variety, unit(rng))
    }

    /// What a share `quantile` (0..1) of all is smaller than: its variety, radius and core, as [`draw`](Self::draw)
    /// draws them if the quantile is uniform.
    pub(crate) fn of_quantile(&self, quantile: f64) -> (u16, f64, f64) {
        let above = self.by_size.partition_point(|(_, low, _)| *low <= quantile);
        let (variety, low, share) = self.by_size[above.saturating_sub(1)];
        self.member(variety, ((quantile - low) / share).clamp(0.0, 1.0))
    }

    /// A member of a variety, `within` (0..1) the range of its radius.
    fn member(&self, variety: usize, within: f64) -> (u16, f64, f64) {
        let (low, high) = self.radius[variety];
        let radius = low + (high - low) * within;
        let core = self.core[variety].max(self.factor * radius);
        (variety as u16, radius, core)
    }
}

fn by_size(varieties: &[Variety], total: f64) -> Vec<(usize, f64, f64)> {
    let weighted = varieties.iter().enumerate().filter(|(_, v)| v.weight > 0.0);
    let mut order: Vec<(usize, &Variety)> = weighted.collect();
    // Stable: varieties of one size keep their order.
    order.sort_by(|(_, a), (_, b)| {
        let middle = |v: &Variety| v.radius_m.0 + v.radius_m.1;
        middle(a).total_cmp(&middle(b))
    });
    let mut below = 0.0;
    let with_shares = order.into_iter().map(|(i, v)| {
        let share = v.weight / total;
        below += share;
        (i, below - share, share)
    });
    with_shares.collect()
}

/// All points of the endless plane's fill in the square of half edge `need` around a chunk's
/// centre, exactly.
///
/// Bridson's algorithm starts from one sample, keeps a list of active ones and throws k darts into
/// the annulus r..2r of one after the other. An endless plane has no first sample and no "one after
/// the other", so:
/// - the initial samples are a sparse Poisson process of darts, keyed by the cell they fall in;
/// - the active list is worked off breadth-first: all active points throw their k darts, keyed by
///   the thrower; the points that these darts bring are the next active list. It stops after
///   `rounds`, long before the list is empty, because the thinning wants no more;
/// - the darts of one round are settled in an order of keyed priorities: a dart becomes a point
///   if it meets no point of an earlier round and no better dart that became one.
///
/// That defines one point set of the whole plane whose law knows no place: neither border nor
/// phase. A window computes it exactly with three states. Where a dart beyond the window could
/// decide, a dart is *unknown*, and so is one that only unknown darts forbid; the known part of the
/// window shrinks to exclude them. If it ends up smaller than needed, a larger window is taken.
/// The size of the window therefore never shows in the result.
pub(crate) fn fill(
    kinds: &Kinds,
    rounds: u32,
    key: Key,
    chunk: ChunkCoord,
    need: f64,
) -> Vec<Point> {
    // Four for each annulus, the rest is what the settling usually leaves unknown.
    let mut halo = f64::from(6 + 7 * rounds) * kinds.max_core;
    loop {
        if let Some(points) = fill_window(kinds, rounds, key, chunk, need, need + halo) {
            return points;
        }
        halo *= 1.25;
    }
}

fn fill_window(
    kinds: &Kinds,
    rounds: u32,
    key: Key,
    chunk: ChunkCoord,
    need: f64,
    window: f64,
) -> Option<Vec<Point>> {
    let low = DVec2::splat(0.5 - window);
    let mut known = Known {
        kinds,
        points: Vec::new(),
        index: QuadTree::new(low, 2.0 * window),
        half: window,
    };
    known.settle(seeds(kinds, key, chunk, window));
    let mut active = 0;
    for _ in 0..rounds {
        // A thrower reaches as far as twice the sum of two hard cores: nearer to the border of
        // what is known, darts of unknown throwers would be missed.
        known.half -= 4.0 * kinds.max_core + SLACK;
        if known.half < need {
            return None;
        }
        let newest = active..known.points.len();
        active = known.points.len();
        let mut darts = Vec::new();
        for thrower in newest {
            known.throw(&known.points[thrower], &mut darts);
        }
        known.settle(darts);
    }
    if known.half < need {
        return None;
    }
    let mut points = known.points;
    points.retain(|point| from_centre(point.p) <= need);
    Some(points)
}

/// The point set so far, complete inside the square of half edge `half` around the chunk's centre.
struct Known<'a> {
    kinds: &'a Kinds,
    points: Vec<Point>,
    index: QuadTree,
    half: f64,
}

impl Known<'_> {
    /// Bridson 2007, step 2: k darts, uniform in the annulus r..2r.
    fn throw(&self, thrower: &Point, darts: &mut Vec<Point>) {
        let largest = self.kinds.max_core;
        let reach = 2.0 * (thrower.core + largest);
        if from_centre(thrower.p) > self.half + reach {
            return;
        }
        // One search for all the darts: what any of them could meet.
        let mut near = Vec::new();
        let _ = self.index.search(thrower.p, reach + largest, &mut |i| {
            near.push((self.points[i].p, self.points[i].core));
            ControlFlow::Continue(())
        });
        let mut rng = thrower.key.domain(DARTS).rng();
        for i in 0..DARTS_PER_POINT {
            let (variety, radius, core) = self.kinds.draw(&mut rng);
            // r is the distance that the two hard cores ask for.
            let p = thrower.p + annulus(&mut rng, thrower.core + core);
            if from_centre(p) > self.half {
                continue;
            }
            let blocked = near.iter().any(|&(q, r)| overlap(p, core, q, r));
            if !blocked {
                darts.push(Point {
                    p,
                    core,
                    radius,
                    variety,
                    key: thrower.key.item(u64::from(i)),
                });
            }
        }
    }

    /// Settles one round of darts: all those in the square of half edge `half` that meet no
    /// earlier point. Shrinks `half` to what is certain.
    fn settle(&mut self, mut darts: Vec<Point>) {
        // A key's hash is as good as random; the key itself breaks ties.
        darts.sort_unstable_by_key(|dart| (dart.key.to_u64(), dart.key));
        let first = self.points.len();
        // Darts that are points, or may be: `certain` tells.
        let mut index = QuadTree::new(DVec2::splat(0.5 - self.half), 2.0 * self.half);
        let mut certain = Vec::new();
        let mut half = self.half;
        for point in darts {
            let away = from_centre(point.p);
            let mut sure = away + point.core + self.kinds.max_core <= self.half;
            let verdict = index.search(point.p, point.core, &mut |i| {
                if certain[i] {
                    return ControlFlow::Break(());
                }
                sure = false;
                ControlFlow::Continue(())
            });
            if verdict.is_break() {
                continue;
            }
            index.insert(point.p, point.core);
            certain.push(sure);
            if sure {
                self.points.push(point);
            } else {
                half = half.min(away);
            }
        }
        self.half = half;
        for point in &self.points[first..] {
            self.index.insert(point.p, point.core);
        }
    }
}

/// The initial samples that fall into the window.
fn seeds(kinds: &Kinds, key: Key, chunk: ChunkCoord, window: f64) -> Vec<Point> {
    // Cells are blocks of 2^level chunks, large enough for some samples each: a sparse layer's wide
    // window then has no more of them than a dense layer's.
    let spacing = 2.0 * kinds.mean_core;
    let mut level = 0_u32;
    while f64::from(1 << level) < 4.0 * spacing {
        level += 1;
    }
    let edge = f64::from(1 << level);
    let mean = SEED_DENSITY * (edge / spacing) * (edge / spacing);
    let stage = key.domain(SEEDS);
    let cells = |at: i32| {
        let low = (f64::from(at) + 0.5 - window).floor() as i64 >> level;
        let high = (f64::from(at) + 0.5 + window).floor() as i64 >> level;
        low..=high
    };
    let mut darts = Vec::new();
    for cy in cells(chunk.y) {
        for cx in cells(chunk.x) {
            let corner = DVec2::new(
                ((cx << level) - i64::from(chunk.x)) as f64,
                ((cy << level) - i64::from(chunk.y)) as f64,
            );
            let cell = stage.chunk([cx as i32, cy as i32]);
            let mut rng = cell.rng();
            // A Poisson number of samples: arrivals with exponential gaps until the mean is used up.
            let mut arrival = rng.exponential();
            let mut i = 0;
            while arrival < mean {
                let (variety, radius, core) = kinds.draw(&mut rng);
                let p = corner + snap(DVec2::new(rng.unit_f64(), rng.unit_f64()) * edge);
                if from_centre(p) <= window {
                    darts.push(Point {
                        p,
                        core,
                        radius,
                        variety,
                        key: cell.item(i),
                    });
                }
                arrival += rng.exponential();
                i += 1;
            }
        }
    }
    darts
}

/// The distance from a chunk's centre in the norm whose discs are squares.
pub(crate) fn from_centre(p: DVec2) -> f64 {
    (p - DVec2::splat(0.5)).abs().max_element()
}

/// Uniform in the annulus between r and 2r, by rejection from its square.
fn annulus(rng: &mut PhiloxRng, r: f64) -> DVec2 {
    loop {
        let x = DVec2::new(unit(rng), unit(rng)) * 4.0 - 2.0;
        let square = x.length_squared();
        if (1.0..4.0).contains(&square) {
            return snap(x * r);
        }
    }
}

/// Uniform in `[0, 1)`, 32 bits: positions keep no more, and darts are many.
#[inline]
fn unit(rng: &mut PhiloxRng) -> f64 {
    f64::from(rng.next_u32()) * (1.0 / 4_294_967_296.0)
}

/// To the nearest multiple of 2⁻³⁰, for magnitudes below 2²¹.
pub(crate) fn snap(p: DVec2) -> DVec2 {
    // Adding 1.5 · 2²² leaves exactly 30 binary places, whatever the sign.
    let shift = DVec2::splat(6_291_456.0);
    (p + shift) - shift
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::index::{LinearScan, NeighbourIndex};

    fn kinds() -> Kinds {
        let varieties = [(3.0, 0.1, 0.2), (1.0, 0.3, 0.5), (0.0, 3.0, 3.0)];
        let varieties = varieties.map(|(weight, low, high)| Variety {
            weight,
            radius_m: (low, high),
        });
        Kinds::new(&varieties, vec![0.02, 0.03, 0.2], 50.0, 1.0)
    }

    fn key() -> Key {
        Key::world(5).domain(Domain::new("placement.test"))
    }

    fn sorted(mut points: Vec<Point>) -> Vec<(Key, DVec2, u16)> {
        points.sort_unstable_by_key(|p| p.key);
        points.iter().map(|p| (p.key, p.p, p.variety)).collect()
    }

    /// The definition, without windows, states or trees: everything in a square so large that what
    /// happens at its border cannot reach the middle.
    fn oracle(kinds: &Kinds, rounds: u32, chunk: ChunkCoord, need: f64) -> Vec<Point> {
        let mut index = LinearScan::default();
        let mut points: Vec<Point> = Vec::new();
        let mut darts = seeds(kinds, key(), chunk, need + 0.8);
        for round in 0..=rounds {
            darts.sort_by_key(|d| (d.key.to_u64(), d.key));
            let first = points.len();
            for dart in darts {
                if index.is_free(dart.p, dart.core) {
                    index.insert(dart.p, dart.core);
                    points.push(dart);
                }
            }
            darts = Vec::new();
            for thrower in &points[first..] {
                let mut rng = thrower.key.domain(DARTS).rng();
                for i in 0..DARTS_PER_POINT {
                    let (variety, radius, core) = kinds.draw(&mut rng);
                    let p = thrower.p + annulus(&mut rng, thrower.core + core);
                    let key = thrower.key.item(u64::from(i));
                    darts.push(Point {
                        p,
                        core,
                        radius,
                        variety,
                        key,
                    });
                }
            }
            assert!(round == rounds || !darts.is_empty());
        }
        points.retain(|p| from_centre(p.p) <= need);
        points
    }

    #[test]
    fn the_fill_is_what_its_definition_says() {
        let chunk = ChunkCoord::new(-7, 3);
        for rounds in 0..3 {
            let points = fill(&kinds(), rounds, key(), chunk, 0.5);
            assert!(points.len() > 50);
            assert_eq!(
                sorted(points),
                sorted(oracle(&kinds(), rounds, chunk, 0.5)),
                "{rounds} rounds"
            );
        }
    }

    #[test]
    fn the_size_of_the_window_does_not_show() {
        for i in 0..20 {
            let chunk = ChunkCoord::new(i, 1 - i);
            let small = sorted(fill(&kinds(), 2, key(), chunk, 0.5));
            let large = fill_window(&kinds(), 2, key(), chunk, 0.5, 2.0).expect("wide enough");
            assert_eq!(small, sorted(large));
        }
    }

    #[test]
    fn neighbours_agree_to_the_bit() {
        // The chunk to the west, seen from its own corner and from the chunk's.
        for (x, y) in [
            (0, 0),
            (123, -45),
            (1_000_000, -1_000_000),
            (i32::MAX - 9, i32::MIN + 9),
        ] {
            let chunk = ChunkCoord::new(x, y);
            let own = fill(&kinds(), 1, key(), chunk, 0.5);
            let mut seen = fill(&kinds(), 1, key(), chunk.offset(1, -1), 1.5);
            for point in &mut seen {
                point.p += DVec2::new(1.0, -1.0);
            }
            seen.retain(|p| from_centre(p.p) <= 0.5);
            assert_eq!(sorted(own), sorted(seen), "chunk {chunk}");
        }
    }

    #[test]
    fn darts_stay_in_the_annulus() {
        let mut rng = key().rng();
        for _ in 0..10_000 {
            let distance = annulus(&mut rng, 0.03).length();
            assert!((0.03 - SLACK..0.06 + SLACK).contains(&distance));
        }
    }

    #[test]
    fn sparse_layers_take_no_more_work_than_dense_ones() {
        for core in [0.3, 30.0, 300.0] {
            let variety = Variety {
                weight: 1.0,
                radius_m: (0.1, 0.2),
            };
            let kinds = Kinds::new(&[variety], vec![core], 50.0, 1.0);
            let thrown = seeds(&kinds, key(), ChunkCoord::new(-5, 9), 0.5 + 13.0 * core);
            assert!((1..2000).contains(&thrown.len()), "{}", thrown.len());
        }
    }
}
