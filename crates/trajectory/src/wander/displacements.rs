//! The displacements of a block's knots: the best of all paths over a grid of choices.

use nemoral_scene::glam::DVec2;
use nemoral_seed::Draw;

use super::course::Guide;
use super::{BLOCK, BLOCK_M, KNOT_M, Wander};
use crate::{Obstacle, Obstacles};

/// Number of lateral choices at a knot, evenly spaced over the amplitude.
const CHOICES: usize = 41;
/// The cost of the squared slope between two knots, and of its squared change at a knot.
const STEEP: f64 = 40.0;
const BENT: f64 = 60.0;

impl Wander {
    fn choice_m(&self, choice: usize) -> f64 {
        (choice as f64 / (CHOICES - 1) as f64 * 2.0 - 1.0) * self.amplitude_m
    }

    /// The displacement without obstacles: a slow keyed curve, which is 0 at the start, and at the
    /// end of a loop.
    fn undisturbed_m(&self, knot: i64) -> f64 {
        let last = self.length_m().map(|loop_m| (loop_m / BLOCK_M) as i64);
        let anchor = |block: i64| {
            if block == 0 || last.is_some_and(|last| (last..=last + 1).contains(&block)) {
                return 0.0;
            }
            self.key.item(block as u64).rng().range_f64(-0.7, 0.7) * self.amplitude_m
        };
        let block = knot.div_euclid(BLOCK as i64);
        let t = knot.rem_euclid(BLOCK as i64) as f64 / BLOCK as f64;
        let ease = t * t * (3.0 - 2.0 * t);
        anchor(block) * (1.0 - ease) + anchor(block + 1) * ease
    }

    /// What is near a knot, with its displacement without obstacles.
    fn surroundings<O: Obstacles + ?Sized>(
        &self,
        knot: i64,
        obstacles: &O,
    ) -> Result<Surroundings, O::Error> {
        let along_m = knot as f64 * KNOT_M;
        let here = self.guide.at(along_m);
        let on_line = here.position_m;
        let seen = |away: DVec2| DVec2::new(away.dot(here.forward), here.forward.perp_dot(away));
        let reach = self.amplitude_m + self.clearance_m + KNOT_M + 2.0;
        let relative = |o: Obstacle| {
            let along_and_left = seen(o.position_m - on_line);
            (along_and_left, o.radius_m)
        };
        // The line some way to the knots beside this one, and its left. Of a straight line they are
        // known without rounding.
        let beside = |knots: f64| match &self.guide {
            Guide::Straight { .. } => (DVec2::new(knots * KNOT_M, 0.0), DVec2::Y),
            Guide::Lanes(lanes) => {
                let there = lanes.at(along_m + knots * KNOT_M);
                (seen(there.position_m - on_line), seen(there.forward.perp()))
            }
        };
        // A turn bulges by decimetres beyond a chord of half the way to the next knot.
        let between = match &self.guide {
            Guide::Straight { .. } => None,
            Guide::Lanes(_) => Some([beside(-0.25), beside(0.25)]),
        };
        Ok(Surroundings {
            obstacles: obstacles
                .near(on_line, reach)?
                .into_iter()
                .map(relative)
                .collect(),
            undisturbed_m: self.undisturbed_m(knot),
            halfway: [beside(-0.5), beside(0.5)],
            between,
            clearance_m: self.clearance_m,
        })
    }

    /// The displacement of the first knot of a block and of those beside it: the free choice
    /// nearest to the undisturbed one.
    fn entry<O: Obstacles + ?Sized>(&self, block: i64, obstacles: &O) -> Result<usize, O::Error> {
        let mut costs = [0.0; CHOICES];
        for beside in -1..=1 {
            let around = self.surroundings(block * BLOCK as i64 + beside, obstacles)?;
            for (choice, cost) in costs.iter_mut().enumerate() {
                *cost += around.cost([self.choice_m(choice); 3]);
            }
        }
        let best = (0..CHOICES).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
        Ok(best.expect("there are choices"))
    }

    /// The displacements of a block's knots: the cheapest path from its entry to that of the next
    /// block, parallel to the guide line around both.
    pub(super) fn solve<O: Obstacles + ?Sized>(
        &self,
        block: i64,
        obstacles: &O,
    ) -> Result<[f64; BLOCK], O::Error> {
        let (entry, exit) = (
            self.entry(block, obstacles)?,
            self.entry(block + 1, obstacles)?,
        );
        // Beyond 45 degrees a body would turn rather than drive.
        let step_m = 2.0 * self.amplitude_m / (CHOICES - 1) as f64;
        let most = (KNOT_M / step_m.max(1e-9)).min((CHOICES - 1) as f64) as usize;
        let near = |c: usize| c.saturating_sub(most)..=(c + most).min(CHOICES - 1);
        // Straight ahead from block to block.
        let is_open = |knot: usize, choice: usize| match knot {
            0 | 1 => choice == entry,
            _ if knot + 1 >= BLOCK => choice == exit,
            _ => true,
        };
        // The least cost of all paths to a pair of choices at a knot and the next, and the choice
        // before them.
        let pair = |a: usize, b: usize| a * CHOICES + b;
        let mut total = vec![f64::INFINITY; CHOICES * CHOICES];
        total[pair(entry, entry)] = 0.0;
        let mut from: Vec<Vec<usize>> = Vec::with_capacity(BLOCK + 1);
        for k in 0..=BLOCK {
            let around = self.surroundings(block * BLOCK as i64 + k as i64, obstacles)?;
            let mut next = vec![f64::INFINITY; CHOICES * CHOICES];
            let mut best_from = vec![0; CHOICES * CHOICES];
            for b in (0..CHOICES).filter(|&b| is_open(k, b)) {
                for a in near(b).filter(|&a| total[pair(a, b)] < f64::INFINITY) {
                    for c in near(b).filter(|&c| is_open(k + 1, c)) {
                        let offsets_m = [a, b, c].map(|choice| self.choice_m(choice));
                        let sum = total[pair(a, b)] + around.cost(offsets_m);
                        if sum < next[pair(b, c)] {
                            (next[pair(b, c)], best_from[pair(b, c)]) = (sum, a);
                        }
                    }
                }
            }
            total = next;
            from.push(best_from);
        }
        let mut offsets = [0.0; BLOCK];
        let (mut here, mut ahead) = (exit, exit);
        for k in (1..=BLOCK).rev() {
            (here, ahead) = (from[k][pair(here, ahead)], here);
            offsets[k - 1] = self.choice_m(here);
        }
        Ok(offsets)
    }
}

/// What decides about the displacement of a knot.
struct Surroundings {
    /// Places ahead of the knot on the guide line and to the left of it, and radii, metres.
    obstacles: Vec<(DVec2, f64)>,
    undisturbed_m: f64,
    /// The guide line halfway to the knots before and after this one, and its left, as obstacles
    /// are.
    halfway: [(DVec2, DVec2); 2],
    /// The same in the middle between this knot and halfway, where the line is bent.
    between: Option<[(DVec2, DVec2); 2]>,
    clearance_m: f64,
}

impl Surroundings {
    /// The cost of the curve about a knot, from halfway after the knot before to halfway before the
    /// next, by the displacements of these three: lack of clearance, the distance from the
    /// undisturbed curve, slope and curvature.
    fn cost(&self, [before_m, here_m, ahead_m]: [f64; 3]) -> f64 {
        // The middle is on the B-spline, the ends are within a few centimetres of it.
        let middle = DVec2::new(0.0, (before_m + 4.0 * here_m + ahead_m) / 6.0);
        let ends_m = [0.5 * (before_m + here_m), 0.5 * (here_m + ahead_m)];
        let displaced = |(place, left): (DVec2, DVec2), offset_m: f64| place + left * offset_m;
        let [first, last] = [0, 1].map(|i| displaced(self.halfway[i], ends_m[i]));
        let between = self
            .between
            .map(|between| [0, 1].map(|i| displaced(between[i], 0.5 * (ends_m[i] + middle.y))));
        let blocked = |&(place, radius_m): &(DVec2, f64)| {
            let to = |a, b| to_segment(place, a, b);
            let away_m = match between {
                None => to(first, middle).min(to(middle, last)),
                Some([early, late]) => to(first, early)
                    .min(to(early, middle))
                    .min(to(middle, late))
                    .min(to(late, last)),
            };
            let gap = away_m - radius_m;
            obstacle_cost(gap, self.clearance_m)
        };
        let [up, down] = [(here_m - before_m) / KNOT_M, (ahead_m - here_m) / KNOT_M];
        self.obstacles.iter().map(blocked).sum::<f64>()
            + 0.05 * (middle.y - self.undisturbed_m).powi(2)
            + STEEP * down * down
            + BENT * (down - up).powi(2)
    }
}

/// Beyond the clearance, so much more room is worth a small detour, metres.
const SPARE_M: f64 = 0.4;

/// What it costs to pass an obstacle at a gap, which is negative inside of it; metres. It is finite
/// and never less for a smaller gap:
///
/// - From the clearance on it is at most 12: other terms decide.
/// - Below the clearance it is at least 1000, which is more than any detour. With the cube of what
///   is missing, an obstacle that is nearly touched costs more than several that the body passes
///   somewhat too near; linear in it, one touch would be cheaper than two narrow passages.
/// - Inside it is more than all of that, whatever the clearance, and grows with the depth, so that
///   a curve that cannot avoid an obstacle crosses it where it is thin.
fn obstacle_cost(gap_m: f64, clearance_m: f64) -> f64 {
    let lack_m = (clearance_m + SPARE_M - gap_m).max(0.0);
    if gap_m < 0.0 {
        100_000.0 * (1.0 + lack_m)
    } else if gap_m < clearance_m {
        let missing = 1.0 - gap_m / clearance_m;
        1000.0 * (1.0 + lack_m) + 40_000.0 * missing.powi(3)
    } else {
        30.0 * lack_m
    }
}

/// The distance of a point from a segment.
fn to_segment(point: DVec2, a: DVec2, b: DVec2) -> f64 {
    let way = b - a;
    let t = ((point - a).dot(way) / way.length_squared()).clamp(0.0, 1.0);
    point.distance(a + way * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_gap_never_costs_less() {
        for clearance_m in [0.0, 1e-9, 0.4, 0.8, 10.0] {
            let gaps_m = (-4000..4000).rev().map(|i| f64::from(i) * 0.005);
            let costs: Vec<f64> = gaps_m.map(|gap| obstacle_cost(gap, clearance_m)).collect();
            assert!(costs.iter().all(|cost| cost.is_finite()), "{clearance_m}");
            assert!(costs.windows(2).all(|c| c[0] <= c[1]), "{clearance_m}");
            assert!(costs[0] < costs[costs.len() - 1]);
        }
    }

    #[test]
    fn one_touch_costs_more_than_several_narrow_passages() {
        let cost = |gap_m: f64| obstacle_cost(gap_m, 0.8);
        assert!(cost(0.05) > 3.0 * cost(0.35) && cost(0.05) > 20.0 * cost(0.7));
        assert!(cost(-0.01) > 5.0 * cost(0.05));
        assert!(cost(0.79) > 80.0 * cost(0.8));
    }
}
