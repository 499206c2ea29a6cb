//! Bridson's algorithm on an endless plane, without an order. Coordinates are those of
//! [`super::square`].

use std::ops::ControlFlow;

use glam::DVec2;
use nemoral_seed::{Draw, Rng};

use super::index::overlap;
use super::key::SampleKey;
use super::quadtree::QuadTree;
use super::sizes::{DiskSizes, unit};
use super::square::{Square, snap};

/// The darts around each point (Bridson 2007: k, "typically 30").
const DARTS_PER_POINT: u32 = 30;
/// The initial samples thrown per square of the mean hard-core distance.
const SEED_DENSITY: f64 = 0.3;
/// A length above the rounding of a position, which is added where the resolved window shrinks.
const SLACK: f64 = 1e-8;

/// A disk of the sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SamplePoint<K> {
    pub(crate) p: DVec2,
    /// The radius of the hard core: two points are at least the sum of theirs apart.
    pub(crate) core: f64,
    /// The occupancy radius, whose meaning is up to the user of the sampler.
    pub(crate) radius: f64,
    pub(crate) variety: u16,
    pub(crate) key: K,
}

/// All points of the endless plane's sample in a square, exactly; positions are relative to a tile.
///
/// Bridson's algorithm starts from one sample, keeps a list of active ones and throws k darts into
/// the annulus r..2r of one after the other. An endless plane has no first sample and no "one after
/// the other", so:
/// - the initial samples are a sparse Poisson process of darts, keyed by the cell they fall in;
/// - the active list is processed breadth-first: all active points throw their k darts, keyed by
///   the thrower, and the darts that become points are the next active list. It stops after
///   `rounds`, usually before the list is empty;
/// - the darts of one round are resolved in the order of keyed priorities: a dart becomes a point
///   if it overlaps no point of an earlier round and no dart of higher priority that became one.
///
/// This defines one point set of the whole plane, whose law is the same everywhere: there are no
/// borders of tiles in it. A window computes its part exactly, with three states. A dart is
/// *unknown* if a dart beyond the window could overlap it, or if only unknown darts overlap it; the
/// resolved part of the window shrinks to exclude unknown darts. If it ends up smaller than needed,
/// a larger window is taken. The result is therefore independent of the size of the window.
pub(crate) fn fill<K: SampleKey>(
    sizes: &DiskSizes,
    rounds: u32,
    key: K,
    tile: [i32; 2],
    need: Square,
) -> Vec<SamplePoint<K>> {
    let mut halo = halo(sizes, rounds);
    loop {
        if let Some(points) = fill_window(sizes, rounds, (key, tile), need, need.grown(halo)) {
            return points;
        }
        halo *= 1.25;
    }
}

/// How far beyond what is needed a window usually reaches: four core radii for each annulus, and
/// what resolving leaves unknown.
pub(crate) fn halo(sizes: &DiskSizes, rounds: u32) -> f64 {
    f64::from(6 + 7 * rounds) * sizes.max_core
}

fn fill_window<K: SampleKey>(
    sizes: &DiskSizes,
    rounds: u32,
    (key, tile): (K, [i32; 2]),
    need: Square,
    window: Square,
) -> Option<Vec<SamplePoint<K>>> {
    let mut resolved = ResolvedWindow {
        sizes,
        points: Vec::new(),
        index: QuadTree::new(window.low(), 2.0 * window.half_width),
        window,
    };
    resolved.resolve_round(&seeds(sizes, key, tile, window));
    let mut active = 0;
    for _ in 0..rounds {
        // A thrower reaches as far as twice the sum of two hard cores. Nearer to the border of the
        // resolved window, darts of unknown throwers would be missed.
        resolved.window = resolved.window.grown(-4.0 * sizes.max_core - SLACK);
        if !resolved.window.covers(&need) {
            return None;
        }
        let newest = active..resolved.points.len();
        active = resolved.points.len();
        let (mut darts, mut near) = (Vec::new(), Vec::new());
        for thrower in newest {
            resolved.throw(&resolved.points[thrower], &mut near, &mut darts);
        }
        resolved.resolve_round(&darts);
    }
    if !resolved.window.covers(&need) {
        return None;
    }
    let mut points = resolved.points;
    points.retain(|point| need.contains(point.p));
    Some(points)
}

/// The points of the rounds so far, complete inside a window.
struct ResolvedWindow<'a, K> {
    sizes: &'a DiskSizes,
    points: Vec<SamplePoint<K>>,
    index: QuadTree,
    window: Square,
}

impl<K: SampleKey> ResolvedWindow<'_, K> {
    /// Bridson 2007, step 2: k darts, uniform in the annulus r..2r. `near` is overwritten.
    fn throw(
        &self,
        thrower: &SamplePoint<K>,
        near: &mut Vec<(DVec2, f64)>,
        darts: &mut Vec<SamplePoint<K>>,
    ) {
        let largest = self.sizes.max_core;
        let reach = 2.0 * (thrower.core + largest);
        if !self.window.grown(reach).contains(thrower.p) {
            return;
        }
        // One search for all the darts: the points that any of them could overlap.
        near.clear();
        let _ = self.index.search(thrower.p, reach + largest, &mut |i| {
            near.push((self.points[i].p, self.points[i].core));
            ControlFlow::Continue(())
        });
        let mut rng = thrower.key.dart_rng();
        for i in 0..DARTS_PER_POINT {
            let (variety, radius, core) = self.sizes.draw(&mut rng);
            // r is the least distance by the two hard cores.
            let p = thrower.p + annulus(&mut rng, thrower.core + core);
            if !self.window.contains(p) {
                continue;
            }
            let blocked = near.iter().any(|&(q, r)| overlap(p, core, q, r));
            if !blocked {
                darts.push(SamplePoint {
                    p,
                    core,
                    radius,
                    variety,
                    key: thrower.key.child(u64::from(i)),
                });
            }
        }
    }

    /// Resolves one round of darts, which are all those in the window that overlap no earlier
    /// point. Shrinks the window to the part without unknown darts.
    fn resolve_round(&mut self, darts: &[SamplePoint<K>]) {
        // Places and hard cores are sorted with the darts, which lie far apart in memory.
        let of_dart =
            |(i, dart): (usize, &SamplePoint<K>)| (dart.key.priority(), i, dart.p, dart.core);
        let mut order: Vec<_> = darts.iter().enumerate().map(of_dart).collect();
        // Priorities are pseudo-random; the key itself breaks ties.
        order.sort_unstable_by(|(a, i, ..), (b, j, ..)| {
            (a.cmp(b)).then_with(|| darts[*i].key.cmp(&darts[*j].key))
        });
        let first = self.points.len();
        // Darts that are points, and unknown ones: `certain` tells them apart.
        let window = self.window;
        let mut index = QuadTree::new(window.low(), 2.0 * window.half_width);
        let mut certain = Vec::new();
        for (_, dart, p, core) in order {
            let away = window.away(p);
            let mut sure = away + core + self.sizes.max_core <= window.half_width;
            let verdict = index.search(p, core, &mut |i| {
                if certain[i] {
                    return ControlFlow::Break(());
                }
                sure = false;
                ControlFlow::Continue(())
            });
            if verdict.is_break() {
                continue;
            }
            index.insert(p, core);
            certain.push(sure);
            if sure {
                self.points.push(darts[dart]);
            } else {
                self.window.half_width = self.window.half_width.min(away);
            }
        }
        for point in &self.points[first..] {
            self.index.insert(point.p, point.core);
        }
    }
}

/// The initial samples that fall into the window.
fn seeds<K: SampleKey>(
    sizes: &DiskSizes,
    key: K,
    tile: [i32; 2],
    window: Square,
) -> Vec<SamplePoint<K>> {
    // Cells are blocks of 2^level tiles, large enough for some samples each: the wide window of
    // large disks then has no more cells than the window of small ones.
    let spacing = 2.0 * sizes.mean_core;
    let mut level = 0_u32;
    while f64::from(1 << level) < 4.0 * spacing {
        level += 1;
    }
    let edge = f64::from(1 << level);
    let mean = SEED_DENSITY * (edge / spacing) * (edge / spacing);
    let (low, high) = (window.low(), window.high());
    let cells = |axis: usize| {
        let cell = |at: f64| (f64::from(tile[axis]) + at).floor() as i64 >> level;
        cell(low[axis])..=cell(high[axis])
    };
    let mut darts = Vec::new();
    for cy in cells(1) {
        for cx in cells(0) {
            let corner = DVec2::new(
                ((cx << level) - i64::from(tile[0])) as f64,
                ((cy << level) - i64::from(tile[1])) as f64,
            );
            let cell = key.seed_cell([cx as i32, cy as i32]);
            let mut rng = cell.seed_rng();
            // A Poisson number of samples: arrivals with exponential gaps until the mean is used
            // up.
            let mut arrival = rng.exponential();
            let mut i = 0;
            while arrival < mean {
                let (variety, radius, core) = sizes.draw(&mut rng);
                let p = corner + snap(DVec2::new(rng.unit_f64(), rng.unit_f64()) * edge);
                if window.contains(p) {
                    darts.push(SamplePoint {
                        p,
                        core,
                        radius,
                        variety,
                        key: cell.child(i),
                    });
                }
                arrival += rng.exponential();
                i += 1;
            }
        }
    }
    darts
}

/// Uniform in the annulus between r and 2r, by rejection from its square.
fn annulus(rng: &mut impl Rng, r: f64) -> DVec2 {
    loop {
        let x = DVec2::new(unit(rng), unit(rng)) * 4.0 - 2.0;
        let square = x.length_squared();
        if (1.0..4.0).contains(&square) {
            return snap(x * r);
        }
    }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::ChunkCoord;
    use nemoral_seed::{Domain, Key};

    use super::super::index::{LinearScan, NeighbourIndex};
    use super::*;
    use crate::variety::DiskKind;

    fn sizes() -> DiskSizes {
        let varieties = [(3.0, 0.1, 0.2), (1.0, 0.3, 0.5), (0.0, 3.0, 3.0)];
        let varieties = varieties.map(|(weight, low, high)| DiskKind {
            weight,
            radius_m: (low, high),
        });
        DiskSizes::new(&varieties, vec![0.02, 0.03, 0.2], 50.0, 1.0)
    }

    fn key() -> Key {
        Key::world(5).domain(Domain::new("placement.test"))
    }

    fn sorted(mut points: Vec<SamplePoint<Key>>) -> Vec<(Key, DVec2, u16)> {
        points.sort_unstable_by_key(|p| p.key);
        points.iter().map(|p| (p.key, p.p, p.variety)).collect()
    }

    /// The definition without windows, states or trees: all points of a square that is so large
    /// that its border cannot influence the middle.
    fn oracle(
        sizes: &DiskSizes,
        rounds: u32,
        chunk: ChunkCoord,
        need: Square,
    ) -> Vec<SamplePoint<Key>> {
        let mut index = LinearScan::default();
        let mut points: Vec<SamplePoint<Key>> = Vec::new();
        let mut darts = seeds(sizes, key(), chunk.into(), need.grown(0.8));
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
                let mut rng = thrower.key.dart_rng();
                for i in 0..DARTS_PER_POINT {
                    let (variety, radius, core) = sizes.draw(&mut rng);
                    let p = thrower.p + annulus(&mut rng, thrower.core + core);
                    let key = thrower.key.item(u64::from(i));
                    darts.push(SamplePoint {
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
        points.retain(|p| need.contains(p.p));
        points
    }

    #[test]
    fn the_fill_is_what_its_definition_says() {
        let chunk = ChunkCoord::new(-7, 3);
        for rounds in 0..3 {
            let aside = Square::covering(DVec2::new(-0.3, 0.6), DVec2::new(0.1, 1.4));
            for need in [Square::around_tile(0.5), aside] {
                let points = fill(&sizes(), rounds, key(), chunk.into(), need);
                assert!(points.len() > 30);
                assert_eq!(
                    sorted(points),
                    sorted(oracle(&sizes(), rounds, chunk, need)),
                    "{rounds} rounds"
                );
            }
        }
    }

    #[test]
    fn the_size_of_the_window_does_not_show() {
        for i in 0..20 {
            let chunk = ChunkCoord::new(i, 1 - i);
            let need = Square::around_tile(0.5);
            let small = sorted(fill(&sizes(), 2, key(), chunk.into(), need));
            for window in [
                Square::around_tile(2.0),
                Square::covering(DVec2::splat(-1.1), DVec2::splat(2.9)),
            ] {
                let large = fill_window(&sizes(), 2, (key(), chunk.into()), need, window);
                assert_eq!(small, sorted(large.expect("wide enough")));
            }
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
            let [here, around] = [0.5, 1.5].map(Square::around_tile);
            let own = fill(&sizes(), 1, key(), chunk.into(), here);
            let mut seen = fill(&sizes(), 1, key(), chunk.offset(1, -1).into(), around);
            for point in &mut seen {
                point.p += DVec2::new(1.0, -1.0);
            }
            seen.retain(|p| here.contains(p.p));
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
            let variety = DiskKind {
                weight: 1.0,
                radius_m: (0.1, 0.2),
            };
            let sizes = DiskSizes::new(&[variety], vec![core], 50.0, 1.0);
            let window = Square::around_tile(0.5 + 13.0 * core);
            let thrown = seeds(&sizes, key(), [-5, 9], window);
            assert!((1..2000).contains(&thrown.len()), "{}", thrown.len());
        }
    }
}
