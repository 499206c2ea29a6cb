//! Patches of the plane: gaps in a canopy, places where seedlings cluster.

use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;

use glam::DVec2;
use nemoral_scene::ChunkCoord;
use nemoral_seed::{Domain, Draw, Key};

use crate::sampler::quadtree::QuadTree;
use crate::sampler::square::{Square, snap};
use nemoral_scene::ParamError;

const PATCHES: Domain = Domain::new("placement.patches");

/// Amplitudes of an outline about its mean radius, with two and with three waves around it.
const WAVES: [f64; 2] = [0.22, 0.14];

/// Patches with wavy outlines at random places of the plane, which may overlap (a Boolean model:
/// Matheron 1975). They belong to the plane, so chunks that share a patch see the same one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patches {
    /// The share of the plane that they cover, 0.001 to 0.9.
    pub share: f64,
    /// The range of their mean radius, metres: drawn uniformly, 0.5 to half a chunk.
    pub radius_m: (f64, f64),
}

impl Patches {
    pub(crate) fn check(&self, path: &str, chunk_size_m: f64) -> Result<(), ParamError> {
        ParamError::check_within(format!("{path}.share"), self.share, 0.001, 0.9)?;
        let (low, high) = self.radius_m;
        if low >= 0.5 && low <= high && high <= chunk_size_m / 2.0 {
            return Ok(());
        }
        let most = chunk_size_m / 2.0;
        let allowed = format!("a range (low, high) with 0.5 <= low <= high <= {most}");
        Err(ParamError::new(
            format!("{path}.radius_m"),
            format!("{:?}", self.radius_m),
            allowed,
        ))
    }

    /// Their mean number per square metre. In a Boolean model, a share of e^(−number · area) is
    /// left free.
    fn per_m2(&self) -> f64 {
        let (low, high) = self.radius_m;
        let mean_square = (low * low + low * high + high * high) / 3.0;
        let waves = WAVES.iter().map(|w| w * w).sum::<f64>() / 2.0;
        -libm::log(1.0 - self.share) / (PI * mean_square * (1.0 + waves))
    }

    /// The patches that reach into the square of half width `window` (chunk edges) around a chunk's
    /// centre.
    pub(crate) fn around(
        &self,
        key: Key,
        chunk: ChunkCoord,
        chunk_size_m: f64,
        window: f64,
    ) -> PatchMap {
        let swing = 1.0 + WAVES.iter().sum::<f64>();
        let widest = swing * self.radius_m.1 / chunk_size_m;
        let reach = window + widest;
        // Cells are 2^level chunks wide, so that few of them have to be visited.
        let mut level = 0_u32;
        while f64::from(1 << level) < 2.0 * widest {
            level += 1;
        }
        let edge = f64::from(1 << level);
        let mean = self.per_m2() * (edge * chunk_size_m) * (edge * chunk_size_m);
        let cells = |at: i32| {
            let low = (f64::from(at) + 0.5 - reach).floor() as i64 >> level;
            let high = (f64::from(at) + 0.5 + reach).floor() as i64 >> level;
            low..=high
        };
        let mut map = PatchMap {
            index: QuadTree::new(DVec2::splat(0.5 - reach), 2.0 * reach),
            outlines: Vec::new(),
        };
        for cy in cells(chunk.y) {
            for cx in cells(chunk.x) {
                let corner = DVec2::new(
                    ((cx << level) - i64::from(chunk.x)) as f64,
                    ((cy << level) - i64::from(chunk.y)) as f64,
                );
                let cell = key.domain(PATCHES).chunk([cx as i32, cy as i32]);
                let mut rng = cell.rng();
                // A Poisson number: arrivals with exponential gaps until the mean is used up.
                let mut arrival = rng.exponential();
                while arrival < mean {
                    let p = corner + snap(DVec2::new(rng.unit_f64(), rng.unit_f64()) * edge);
                    let (low, high) = self.radius_m;
                    let radius = rng.range_f64(low, high) / chunk_size_m;
                    let waves = [(); 2].map(|()| {
                        let (sin, cos) = libm::sincos(rng.range_f64(0.0, TAU));
                        DVec2::new(cos, sin)
                    });
                    map.index.insert(p, swing * radius);
                    map.outlines.push(Outline { radius, waves });
                    arrival += rng.exponential();
                }
            }
        }
        map
    }
}

/// The patches around a chunk.
#[derive(Debug)]
pub(crate) struct PatchMap {
    /// Disks around the outlines, in the same order.
    index: QuadTree,
    outlines: Vec<Outline>,
}

/// Where a layer clusters in a chunk: [`Placement::clusters`](crate::Placement::clusters).
#[derive(Debug)]
pub struct Clusters {
    pub(crate) map: PatchMap,
    pub(crate) origin_m: DVec2,
    pub(crate) chunk_size_m: f64,
}

impl Clusters {
    /// Whether a world position of the chunk is in a cluster.
    #[must_use]
    pub fn contain(&self, world_m: DVec2) -> bool {
        let local = (world_m - self.origin_m) / self.chunk_size_m;
        self.map.contain(local)
    }
}

/// r(θ) = radius · (1 + Σ WAVES\[n\] · cos((n + 2) θ + phase)).
#[derive(Debug)]
struct Outline {
    radius: f64,
    /// Cosine and sine of the phases.
    waves: [DVec2; 2],
}

impl PatchMap {
    /// Squares that together cover what the patches have of the square of half width `need` around
    /// the chunk's centre. They may overlap.
    pub(crate) fn squares(&self, need: f64) -> impl Iterator<Item = Square> {
        let whole = Square::around_tile(need);
        let disks = (0..self.outlines.len()).filter_map(|i| self.index.get(i));
        disks.filter_map(move |(centre, radius)| {
            let low = (centre - radius).max(whole.low());
            let high = (centre + radius).min(whole.high());
            low.cmple(high).all().then(|| Square::covering(low, high))
        })
    }

    /// Whether a point, relative to the chunk's corner, is in a patch. The result is the same from
    /// any chunk, as differences of positions are exact.
    pub(crate) fn contain(&self, p: DVec2) -> bool {
        let verdict = self.index.search(p, 0.0, &mut |i| {
            let inside = self
                .index
                .get(i)
                .is_some_and(|(centre, _)| self.outlines[i].contains(p - centre));
            if inside {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        verdict.is_break()
    }
}

impl Outline {
    fn contains(&self, d: DVec2) -> bool {
        let distance = d.length();
        if distance == 0.0 {
            return true;
        }
        let u = d / distance;
        // cos and sin of 2θ and 3θ without the angle.
        let double = DVec2::new(u.x * u.x - u.y * u.y, 2.0 * u.x * u.y);
        let triple = DVec2::new(
            double.x * u.x - double.y * u.y,
            double.x * u.y + double.y * u.x,
        );
        let wave = |turn: DVec2, phase: DVec2| turn.x * phase.x - turn.y * phase.y;
        let swing = WAVES[0] * wave(double, self.waves[0]) + WAVES[1] * wave(triple, self.waves[1]);
        distance < self.radius * (1.0 + swing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAPS: Patches = Patches {
        share: 0.12,
        radius_m: (4.0, 9.0),
    };

    fn key() -> Key {
        Key::world(3).domain(Domain::new("patches.test"))
    }

    fn grid(n: u32) -> impl Iterator<Item = DVec2> {
        (0..n * n).map(move |i| {
            snap((DVec2::new(f64::from(i % n), f64::from(i / n)) + 0.5) / f64::from(n))
        })
    }

    #[test]
    fn they_cover_their_share() {
        for patches in [
            GAPS,
            Patches {
                share: 0.5,
                radius_m: (1.5, 3.0),
            },
            Patches {
                share: 0.03,
                radius_m: (20.0, 25.0),
            },
        ] {
            let (mut inside, mut all) = (0, 0);
            for i in 0..400 {
                let map = patches.around(key(), ChunkCoord::new(i % 20, i / 20), 50.0, 0.5);
                inside += grid(20).filter(|p| map.contain(*p)).count();
                all += 400;
            }
            let share = f64::from(inside as u32) / f64::from(all);
            // A large patch covers a third of a percent of this window.
            let tolerance = 0.05 * patches.share + 0.006;
            assert!(
                (share - patches.share).abs() < tolerance,
                "{share} of {patches:?}"
            );
        }
    }

    #[test]
    fn neighbours_agree_and_the_window_does_not_show() {
        for (x, y) in [(0, 0), (-5, 7), (1_000_000, -1_000_000)] {
            let chunk = ChunkCoord::new(x, y);
            let own = GAPS.around(key(), chunk, 50.0, 0.5);
            let wide = GAPS.around(key(), chunk, 50.0, 2.5);
            let neighbours = GAPS.around(key(), chunk.offset(1, -1), 50.0, 1.5);
            for p in grid(64) {
                assert_eq!(own.contain(p), wide.contain(p));
                assert_eq!(
                    own.contain(p),
                    neighbours.contain(p - DVec2::new(1.0, -1.0))
                );
            }
        }
    }
}
