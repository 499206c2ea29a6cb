//! Where puddles are: in ruts and hollows of trails where these are level and wet.

use nemoral_scene::glam::DVec2;
use nemoral_scene::{Surface, TrailSurfaceKind};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_trails::TrailGround;
use nemoral_water::{Puddle, PuddleSite};

const PUDDLES: Domain = Domain::new("pipeline.puddles");
const WET: Domain = Domain::new("pipeline.puddles.wet");

/// Side of the cells of which each has one puddle at most, metres.
const CELL_M: f64 = 4.0;
/// Size of wet and dry stretches, metres.
const STRETCH_M: f64 = 24.0;
/// The steepest run of a trail on which water stays.
const LEVEL: f64 = 0.07;
/// How far from its middle line the lowest place across is looked for, metres.
const ACROSS_M: f64 = 0.7;
/// How much lower a rut is than what is beside it, at the least, metres.
const RUT_M: f64 = 0.012;
/// Puddles keep this far from a trail's edge and from each other, metres.
const VERGE_M: f64 = 0.15;
const APART_M: f64 = 0.5;
/// The places of its border at which a puddle must be this far within the trail, metres.
const AROUND: u32 = 24;
const RIM_M: f64 = 0.03;
/// The longest half of a puddle, metres.
const LONGEST_M: f64 = 1.7;

/// How far around a square the trails must be known for its puddles, metres.
pub(crate) const PUDDLE_REACH_M: f64 = LONGEST_M * 1.4 + 2.0 * CELL_M + 3.0;

/// The puddles of a world's trails.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Puddles {
    /// How many of the places that can hold one have one.
    pub(crate) share: f64,
    pub(crate) world: Key,
}

impl Puddles {
    /// The puddles that may change the ground within `margin_m` of a square. The trails must be
    /// known [`PUDDLE_REACH_M`] farther. `wetness` is how many more there are at a place than
    /// elsewhere by the lie of the ground.
    pub(crate) fn near(
        &self,
        (low_m, high_m): (DVec2, DVec2),
        margin_m: f64,
        trails: &TrailGround,
        wetness: &dyn Fn(DVec2) -> f64,
    ) -> Vec<Puddle> {
        let reach_m = margin_m + LONGEST_M * 1.4 + CELL_M;
        let first = ((low_m - reach_m) / CELL_M).floor();
        let last = ((high_m + reach_m) / CELL_M).floor();
        let cells = |from: f64, to: f64| from as i32..=to as i32;
        // A puddle yields to one in a neighbouring cell whose key is greater.
        let columns = cells(first.x, last.x).count() + 2;
        let (x, y) = (first.x as i32 - 1, first.y as i32 - 1);
        let rows = cells(first.y, last.y).count() + 2;
        let sites: Vec<Option<PuddleSite>> = (0..columns * rows)
            .map(|i| {
                self.site(
                    [x + (i % columns) as i32, y + (i / columns) as i32],
                    trails,
                    wetness,
                )
            })
            .collect();
        let mut puddles = Vec::new();
        for row in 1..rows - 1 {
            for column in 1..columns - 1 {
                let Some(site) = sites[row * columns + column] else {
                    continue;
                };
                let around = (0..9).filter(|i| *i != 4).filter_map(|i| {
                    let (down, right) = (row + i / 3 - 1, column + i % 3 - 1);
                    sites[down * columns + right]
                });
                let mut wins = true;
                for other in around {
                    let room = site.half_m[0] + other.half_m[0] + APART_M;
                    let is_near = site.middle_m.distance(other.middle_m) < room;
                    wins &= !is_near || site.key.to_u64() > other.key.to_u64();
                }
                // Where a trail forks or bends, its edge is near the ends of a puddle, too.
                let is_on_trail =
                    |of: &Puddle| of.ring(1.0, AROUND).all(|p| trails.edge_m(p) < -RIM_M);
                if wins {
                    puddles.extend(Puddle::dig(site, trails).filter(is_on_trail));
                }
            }
        }
        puddles
    }

    /// Where there may be a puddle in a cell.
    fn site(
        &self,
        cell: [i32; 2],
        trails: &TrailGround,
        wetness: &dyn Fn(DVec2) -> f64,
    ) -> Option<PuddleSite> {
        let key = self.world.domain(PUDDLES).chunk(cell);
        let mut rng = key.rng();
        let off = DVec2::new(rng.unit_f64(), rng.unit_f64());
        let drawn = rng.unit_f64();
        if drawn >= self.share {
            return None;
        }
        let p = (DVec2::new(f64::from(cell[0]), f64::from(cell[1])) + off) * CELL_M;
        let (edge_m, outwards) = trails.edge(p);
        if edge_m > -VERGE_M {
            return None;
        }
        let wet = (self.wetness(p) * wetness(p)).min(1.0);
        if drawn >= self.share * wet * holds(trails.kind(p)?) {
            return None;
        }
        let across = outwards.normalize_or_zero();
        if across == DVec2::ZERO {
            return None;
        }
        let (middle_m, is_rut) = lowest_across(p, across, trails);
        let along = across.perp();
        let slope = trails.sample(middle_m).gradient.dot(along);
        let half = rng.range_f64(0.35, 1.0);
        let width_m = if is_rut {
            rng.range_f64(0.24, 0.38)
        } else {
            rng.range_f64(0.3, 0.7)
        };
        let depth_m = rng.range_f64(0.05, 0.1);
        let room_m = -trails.edge_m(middle_m) - 0.05;
        // The steeper, the shorter, so that the lower end holds the water.
        let longest_m = (0.4 * depth_m / slope.abs().max(1e-6)).min(LONGEST_M);
        let half_m = [(half * LONGEST_M).min(longest_m), width_m.min(room_m / 1.2)];
        (slope.abs() < LEVEL && half_m[1] > 0.15 && half_m[0] > 0.25).then_some(PuddleSite {
            middle_m,
            along,
            half_m,
            depth_m,
            key,
        })
    }

    /// How wet a stretch is, 0..=1: smooth noise.
    fn wetness(&self, p: DVec2) -> f64 {
        let place = p / STRETCH_M;
        let cell = place.floor();
        let t = place - cell;
        let t = t * t * (3.0 - 2.0 * t);
        let [a, b, c, d] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
            let corner = [cell.x as i32 + i, cell.y as i32 + j];
            self.world.domain(WET).chunk(corner).rng().unit_f64()
        });
        let (low, high) = (a + t.x * (b - a), c + t.x * (d - c));
        ((low + t.y * (high - low) - 0.25) / 0.35).clamp(0.0, 1.0)
    }
}

/// How well water stays on a kind of surface.
fn holds(kind: TrailSurfaceKind) -> f64 {
    match kind {
        TrailSurfaceKind::Mud => 1.0,
        TrailSurfaceKind::DryEarth => 0.8,
        TrailSurfaceKind::LeafLitter | TrailSurfaceKind::Grassy => 0.7,
        TrailSurfaceKind::Needles | TrailSurfaceKind::Gravel => 0.5,
        TrailSurfaceKind::Rock => 0.25,
        TrailSurfaceKind::Sand => 0.08,
    }
}

/// The lowest place across a trail near a point, if that is lower than both of its sides: a rut.
/// Otherwise the point itself.
fn lowest_across(p: DVec2, across: DVec2, ground: &TrailGround) -> (DVec2, bool) {
    const STEPS: i32 = 14;
    let at = |i: i32| p + across * (ACROSS_M * f64::from(i) / f64::from(STEPS));
    let heights: Vec<f64> = (-STEPS..=STEPS).map(|i| ground.height_m(at(i))).collect();
    let lowest = (0..heights.len())
        .min_by(|&a, &b| heights[a].total_cmp(&heights[b]))
        .unwrap_or(STEPS as usize);
    let highest = |of: &[f64]| of.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (left, right) = (&heights[..=lowest], &heights[lowest..]);
    let dip = highest(left).min(highest(right)) - heights[lowest];
    if dip > RUT_M {
        (at(lowest as i32 - STEPS), true)
    } else {
        (p, false)
    }
}
