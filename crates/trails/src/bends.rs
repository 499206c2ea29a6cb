//! Where the nearest point of a trail is not one that moves with the place: inside its bends.

use glam::DVec2;
use nemoral_scene::Dual;

use crate::curve::{Cubic, smoothstep};
use crate::path::{Foot, Knot, cubic};

/// The cost of looking along a trail instead of across it, in metres of the distance to its edge
/// per metre along. With it, the edge is that at the foot unless the width changes faster.
const SLANT: f64 = 0.5;

/// The number of intervals to both sides whose bends count, as the nearest knot is found first.
const AROUND: usize = 2;

/// The share of a bend's radius over which the shape of a surface fades inside of it.
const FADE: f64 = 0.25;

/// The share over which the rounding of corners fades, which moves edges and so has to be gradual.
const LONG_FADE: f64 = 0.75;

/// How well a foot is known: 1 outside of bends and near the trail, falling to 0 towards the centre
/// of the sharpest bend around, where a foot may leap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Firmness {
    /// For the shape of the surface.
    pub(crate) shape: Dual,
    /// For the rounding of corners between edges.
    pub(crate) corner: Dual,
}

/// Parts of an interval that are searched for one minimum each.
const PARTS: usize = 8;

/// The number of steps of a search, each of which leaves 0.62 of the part.
const SEARCH_STEPS: usize = 30;

/// How sharply a trail bends.
#[derive(Debug)]
pub(crate) struct Bends {
    /// For each knot, the greatest curvature near it to the left and to the right, 1/m.
    sharpest: Vec<[f64; 2]>,
    /// For each interval, the distance from its first knot below which each point's edge is that
    /// at its foot, metres.
    free_m: Vec<f64>,
}

impl Bends {
    pub(crate) fn new(knots: &[Knot]) -> Self {
        let curvatures: Vec<_> = knots.windows(2).map(curvatures).collect();
        let widenings: Vec<_> = knots.windows(2).map(widening).collect();
        let intervals = curvatures.len();
        let sharpest_in = |from: usize, to: usize| {
            let of = &curvatures[from..=to.min(intervals - 1)];
            of.iter()
                .fold([0.0_f64; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])])
        };
        let sharpest = (0..knots.len())
            .map(|k| sharpest_in(k.saturating_sub(AROUND + 1), k + AROUND))
            .collect();
        let free_m: Vec<f64> = (0..intervals)
            .map(|i| {
                let (from, to) = around(i, intervals);
                let [left, right] = sharpest_in(from, to);
                let widening = widenings[from..=to].iter().copied().fold(0.0, f64::max);
                let step = knots[i + 1].arc - knots[i].arc;
                let bearable = 1.0 - widening / SLANT;
                (bearable / left.max(right).max(1e-9) - step).max(0.0)
            })
            .collect();
        Self { sharpest, free_m }
    }

    /// Whether the edge of points that are nearer than a distance may not be that at their foot, in
    /// the interval from a knot on.
    pub(crate) fn is_tight(&self, knot: usize, within_m: f64) -> bool {
        self.free_m.get(knot).is_some_and(|free| *free < within_m)
    }

    /// What the distance to the edge of an interval cannot be less than, metres.
    pub(crate) fn least_edge_m(&self, knots: &[Knot], i: usize, p: DVec2) -> f64 {
        let (a, b) = (&knots[i], &knots[i + 1]);
        let half_step = 0.5 * (b.arc - a.arc);
        let square = (a.position.distance_squared(p)).min(b.position.distance_squared(p));
        let to_chord = libm::sqrt((square - half_step * half_step).max(0.0));
        let [left, right] = self.sharpest[i];
        // The curve is at most this far from its chord.
        let bulge = (half_step * half_step * left.max(right)).min(half_step);
        to_chord - bulge - a.attributes.half_width.max(b.attributes.half_width) - 1e-9
    }

    /// Whether the edge may be that at another place than the foot, for points near an interval.
    pub(crate) fn is_folded(&self, knots: &[Knot], i: usize, p: DVec2) -> bool {
        let free = self.free_m[i];
        knots[i].position.distance_squared(p) >= free * free && self.is_inside(knots, i, p)
    }

    /// Whether a point is inside of a bend near an interval, about as far as its centre.
    fn is_inside(&self, knots: &[Knot], i: usize, p: DVec2) -> bool {
        let (from, to) = around(i, self.free_m.len());
        let all = knots[from..=to + 1].windows(2);
        let widening = all.clone().map(widening).fold(0.0, f64::max);
        let bearable = 0.9 - widening / SLANT;
        all.map(|pair| cubic(&pair[0], &pair[1])).any(|curve| {
            [0.0, 0.25, 0.5, 0.75, 1.0].into_iter().any(|t| {
                let [q, d1, d2] = curve.at(t);
                (p - q).dot(d2) > bearable * d1.length_squared()
            })
        })
    }

    pub(crate) fn firmness(&self, foot: &Foot, knots: &[Knot]) -> Firmness {
        let i = foot.interval;
        let offset = foot.away.dot(foot.left);
        let side = usize::from(offset < 0.0);
        let [a, b] = [self.sharpest[i][side], self.sharpest[i + 1][side]];
        let one = Dual::constant(1.0);
        let depth = Dual::new(offset.abs(), foot.left * offset.signum());
        if a.max(b) * depth.value <= 1.0 - LONG_FADE {
            return Firmness {
                shape: one,
                corner: one,
            };
        }
        let step = knots[i + 1].arc - knots[i].arc;
        let sharpness = a + (foot.arc - knots[i].arc) / step * (b - a);
        let sharpness = Dual::new(sharpness, (b - a) / step * foot.along);
        let left = one - sharpness * depth;
        let over = |fade: f64| {
            let t = (left.value / fade).clamp(0.0, 1.0);
            left.chain((smoothstep(t), 6.0 * t * (1.0 - t) / fade))
        };
        Firmness {
            shape: over(FADE),
            corner: over(LONG_FADE),
        }
    }
}

/// The first and the last of the intervals around one.
fn around(i: usize, intervals: usize) -> (usize, usize) {
    (i.saturating_sub(AROUND), (i + AROUND).min(intervals - 1))
}

/// The greatest curvatures to the left and the right between two knots.
fn curvatures(pair: &[Knot]) -> [f64; 2] {
    let curve = cubic(&pair[0], &pair[1]);
    [0.0, 0.25, 0.5, 0.75, 1.0]
        .into_iter()
        .fold([0.0_f64; 2], |[left, right], t| {
            let [_, d1, d2] = curve.at(t);
            let speed = d1.length().max(1e-6);
            let curvature = d1.perp_dot(d2) / (speed * speed * speed);
            [left.max(curvature), right.max(-curvature)]
        })
}

/// How much half the width changes per metre between two knots.
fn widening(pair: &[Knot]) -> f64 {
    let change = pair[1].attributes.half_width - pair[0].attributes.half_width;
    (change / (pair[1].arc - pair[0].arc)).abs()
}

/// The part of a trail between two knots, seen from a point.
pub(crate) struct View<'a> {
    p: DVec2,
    ends: [&'a Knot; 2],
    curve: Cubic,
    /// Whether the trail begins, and ends, there.
    bare: [bool; 2],
}

impl<'a> View<'a> {
    pub(crate) fn new(knots: &'a [Knot], i: usize, p: DVec2) -> Self {
        let ends = [&knots[i], &knots[i + 1]];
        Self {
            p,
            ends,
            curve: cubic(ends[0], ends[1]),
            bare: [i == 0, i + 2 == knots.len()],
        }
    }

    /// The distance to the edge at a knot, metres, at least as great as that of its trail.
    pub(crate) fn edge_at_knot_m(knots: &[Knot], i: usize, p: DVec2) -> f64 {
        let knot = &knots[i];
        let away = p - knot.position;
        away.length() - knot.attributes.half_width + SLANT * away.dot(knot.tangent).abs() + 1e-9
    }

    /// The least distance to the edge over all places of the part, where looking along the trail
    /// costs something. It is continuous, as it is a minimum of continuous functions.
    pub(crate) fn edge(&self) -> Dual {
        let at = |i: usize| i as f64 / PARTS as f64;
        let values: [f64; PARTS + 1] = std::array::from_fn(|i| self.at(at(i)).value);
        let mut best = if values[PARTS] < values[0] { 1.0 } else { 0.0 };
        let mut least = values[0].min(values[PARTS]);
        for i in 0..=PARTS {
            let (low, high) = (i.saturating_sub(1), (i + 1).min(PARTS));
            if values[i] > values[low] || values[i] > values[high] {
                continue;
            }
            let t = self.search(at(low), at(high));
            let value = self.at(t).value;
            if value < least {
                (best, least) = (t, value);
            }
        }
        self.at(best)
    }

    /// The place of the least distance between two places (golden section).
    fn search(&self, mut low: f64, mut high: f64) -> f64 {
        const SHARE: f64 = 0.618_033_988_749_894_9;
        let value = |t: f64| self.at(t).value;
        let (mut a, mut b) = (high - SHARE * (high - low), low + SHARE * (high - low));
        let (mut at_a, mut at_b) = (value(a), value(b));
        for _ in 0..SEARCH_STEPS {
            if at_a <= at_b {
                (high, b, at_b) = (b, a, at_a);
                a = high - SHARE * (high - low);
                at_a = value(a);
            } else {
                (low, a, at_a) = (a, b, at_b);
                b = low + SHARE * (high - low);
                at_b = value(b);
            }
        }
        0.5 * (low + high)
    }

    fn at(&self, t: f64) -> Dual {
        let [a, b] = self.ends;
        let [q, d1, _] = self.curve.at(t);
        let (away, tangent) = (self.p - q, d1 / d1.length().max(f64::MIN_POSITIVE));
        let distance = away.length();
        let half_width =
            a.attributes.half_width + t * (b.attributes.half_width - a.attributes.half_width);
        let ahead = away.dot(tangent);
        // Nothing is to be seen beyond the ends of a trail but these.
        let is_end =
            (self.bare[0] && t <= 0.0 && ahead < 0.0) || (self.bare[1] && t >= 1.0 && ahead > 0.0);
        let cost = if is_end { 0.0 } else { SLANT };
        Dual::new(
            distance - half_width + cost * ahead.abs(),
            away / distance.max(f64::MIN_POSITIVE) + cost * ahead.signum() * tangent,
        )
    }
}
