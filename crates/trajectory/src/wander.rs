//! A smooth wander between stems, which can be evaluated anywhere without what comes before.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};

use crate::{Heading, Obstacle, Obstacles};

/// The name is older than this crate; another one would change every wander.
const WANDER: Domain = Domain::new("pipeline.wander");

/// Distance between knots along the guide line, metres.
const KNOT_M: f64 = 3.0;
/// Knots in a block.
const BLOCK: i64 = 24;
/// Number of lateral choices at a knot, evenly spaced over the amplitude.
const CHOICES: usize = 41;

/// A curve about a straight guide line, displaced sideways so that it keeps its clearance.
///
/// The line is cut into blocks of 72 m. Where blocks meet, the displacement is keyed; inside a
/// block it is the best of all paths over a grid of choices (by dynamic programming over clearance
/// and smoothness), and a cubic spline joins the knots. So a point depends only on its own and the
/// next block. Positions are in metres along the guide line; the path itself is longer by the slope
/// of the displacement, at most by a few percent.
#[derive(Debug)]
pub struct Wander {
    start_m: DVec2,
    forward: DVec2,
    amplitude_m: f64,
    clearance_m: f64,
    key: Key,
    blocks: Mutex<BTreeMap<i64, Arc<Vec<f64>>>>,
}

impl Wander {
    /// A wander from `start_m` along `forward`, which deviates by up to `amplitude_m` to either
    /// side and keeps `clearance_m` from obstacles where there is room.
    #[must_use]
    pub fn new(
        start_m: DVec2,
        forward: DVec2,
        amplitude_m: f64,
        clearance_m: f64,
        key: Key,
    ) -> Self {
        let key = key.domain(WANDER);
        Self {
            start_m,
            forward: forward.normalize_or(DVec2::X),
            amplitude_m,
            clearance_m,
            key,
            blocks: Mutex::default(),
        }
    }

    /// Position and direction at `s_m` along the guide line.
    ///
    /// # Errors
    /// The first error of `obstacles`.
    pub fn at<O: Obstacles + ?Sized>(&self, s_m: f64, obstacles: &O) -> Result<Heading, O::Error> {
        let x = s_m / KNOT_M;
        let i = x.floor() as i64;
        let t = x - i as f64;
        // A Catmull-Rom spline through the four surrounding knots.
        let mut d = [0.0; 4];
        for (k, value) in d.iter_mut().enumerate() {
            *value = self.knot(i + k as i64 - 1, obstacles)?;
        }
        let (m1, m2) = ((d[2] - d[0]) / 2.0, (d[3] - d[1]) / 2.0);
        let (a, b) = (
            2.0 * (d[1] - d[2]) + m1 + m2,
            3.0 * (d[2] - d[1]) - 2.0 * m1 - m2,
        );
        let offset = d[1] + t * (m1 + t * (b + t * a));
        let slope = (m1 + t * (2.0 * b + 3.0 * t * a)) / KNOT_M;
        let left = self.forward.perp();
        let position = self.start_m + self.forward * s_m + left * offset;
        Ok((
            position,
            (self.forward + left * slope).normalize_or(self.forward),
        ))
    }

    fn knot<O: Obstacles + ?Sized>(&self, index: i64, obstacles: &O) -> Result<f64, O::Error> {
        let block = index.div_euclid(BLOCK);
        let cached = self
            .blocks
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get(&block)
            .cloned();
        let offsets = match cached {
            Some(offsets) => offsets,
            None => {
                let offsets = Arc::new(self.solve(block, obstacles)?);
                let mut blocks = self.blocks.lock().unwrap_or_else(PoisonError::into_inner);
                // A drive needs the current block and its neighbours.
                while blocks.len() >= 16 {
                    blocks.pop_first();
                }
                blocks.insert(block, Arc::clone(&offsets));
                offsets
            }
        };
        Ok(offsets[index.rem_euclid(BLOCK) as usize])
    }

    fn choice_m(&self, choice: usize) -> f64 {
        (choice as f64 / (CHOICES - 1) as f64 * 2.0 - 1.0) * self.amplitude_m
    }

    /// The displacement without obstacles: a slow keyed curve, which is 0 at the start.
    fn undisturbed_m(&self, index: i64) -> f64 {
        let anchor = |block: i64| {
            if block == 0 {
                return 0.0;
            }
            self.key.item(block as u64).rng().range_f64(-0.7, 0.7) * self.amplitude_m
        };
        let block = index.div_euclid(BLOCK);
        let t = index.rem_euclid(BLOCK) as f64 / BLOCK as f64;
        let ease = t * t * (3.0 - 2.0 * t);
        anchor(block) * (1.0 - ease) + anchor(block + 1) * ease
    }

    /// The displacement of the first knot of a block: the free choice nearest to the undisturbed
    /// one.
    fn entry<O: Obstacles + ?Sized>(&self, block: i64, obstacles: &O) -> Result<usize, O::Error> {
        let costs = self.costs(block * BLOCK, obstacles)?;
        let best = (0..CHOICES).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
        Ok(best.expect("there are choices"))
    }

    /// The cost of each choice at a knot: the distance from the undisturbed curve, and lack of
    /// clearance.
    fn costs<O: Obstacles + ?Sized>(
        &self,
        index: i64,
        obstacles: &O,
    ) -> Result<Vec<f64>, O::Error> {
        let on_line = self.start_m + self.forward * (index as f64 * KNOT_M);
        let left = self.forward.perp();
        let reach = self.amplitude_m + self.clearance_m + KNOT_M + 2.0;
        let near = obstacles.near(on_line, reach)?;
        let undisturbed = self.undisturbed_m(index);
        let costs = (0..CHOICES).map(|choice| {
            let offset = self.choice_m(choice);
            let p = on_line + left * offset;
            // A knot stands for half the path to its neighbours, so points ahead and behind are
            // tested as well.
            let blocked: f64 = near
                .iter()
                .map(
                    |&Obstacle {
                         position_m: q,
                         radius_m: r,
                     }| {
                        let along = (q - p).dot(self.forward).clamp(-KNOT_M / 2.0, KNOT_M / 2.0);
                        let gap = q.distance(p + self.forward * along) - r;
                        let lack = (self.clearance_m + 0.4 - gap).max(0.0);
                        // Touching costs more than any detour.
                        if gap < self.clearance_m {
                            1000.0 + 1000.0 * lack
                        } else {
                            30.0 * lack
                        }
                    },
                )
                .sum();
            blocked + (offset - undisturbed).powi(2) * 0.05
        });
        Ok(costs.collect())
    }

    /// The displacements of a block's knots: the cheapest path from its entry to that of the next
    /// block.
    fn solve<O: Obstacles + ?Sized>(
        &self,
        block: i64,
        obstacles: &O,
    ) -> Result<Vec<f64>, O::Error> {
        let (entry, exit) = (
            self.entry(block, obstacles)?,
            self.entry(block + 1, obstacles)?,
        );
        let step_cost = |a: usize, b: usize| {
            let step = (self.choice_m(a) - self.choice_m(b)) / KNOT_M;
            // Steps beyond 45 degrees are penalised, as a body would turn rather than drive.
            40.0 * step * step
                + if step.abs() > 1.0 {
                    1e5 * step.abs()
                } else {
                    0.0
                }
        };
        let mut total = vec![f64::INFINITY; CHOICES];
        total[entry] = 0.0;
        let mut from: Vec<Vec<usize>> = Vec::new();
        for k in 1..=BLOCK {
            let costs = if k == BLOCK {
                (0..CHOICES)
                    .map(|c| if c == exit { 0.0 } else { f64::INFINITY })
                    .collect()
            } else {
                self.costs(block * BLOCK + k, obstacles)?
            };
            let mut next = vec![f64::INFINITY; CHOICES];
            let mut best_from = vec![0; CHOICES];
            for b in 0..CHOICES {
                for (a, so_far) in total.iter().enumerate() {
                    let sum = so_far + step_cost(a, b) + costs[b];
                    if sum < next[b] {
                        (next[b], best_from[b]) = (sum, a);
                    }
                }
            }
            total = next;
            from.push(best_from);
        }
        let mut offsets = vec![0.0; BLOCK as usize];
        let mut choice = exit;
        for k in (0..BLOCK as usize).rev() {
            choice = from[k][choice];
            offsets[k] = self.choice_m(choice);
        }
        Ok(offsets)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Never = std::convert::Infallible;

    fn stand(spacing: f64) -> impl Fn(DVec2, f64) -> Result<Vec<Obstacle>, Never> {
        move |p, reach| {
            let cells = |c: f64| {
                ((c - reach) / spacing).floor() as i64..=((c + reach) / spacing).ceil() as i64
            };
            let mut out = Vec::new();
            for x in cells(p.x) {
                for y in cells(p.y) {
                    let mut rng = Key::world(3).chunk([x as i32, y as i32]).rng();
                    let q = DVec2::new(
                        x as f64 + rng.range_f64(0.1, 0.9),
                        y as f64 + rng.range_f64(0.1, 0.9),
                    ) * spacing;
                    if q.distance(p) < reach {
                        out.push(Obstacle {
                            position_m: q,
                            radius_m: 0.2,
                        });
                    }
                }
            }
            Ok(out)
        }
    }

    fn wander() -> Wander {
        Wander::new(
            DVec2::new(5.0, -3.0),
            DVec2::new(1.0, 1.0),
            8.0,
            0.8,
            Key::world(9),
        )
    }

    #[test]
    fn it_keeps_its_clearance_in_a_stand_with_room() {
        let (w, obstacles) = (wander(), stand(5.0));
        let mut worst = f64::INFINITY;
        for i in 0..4000 {
            let (p, _) = w.at(f64::from(i) * 0.25, &obstacles).expect("never");
            for stem in obstacles(p, 5.0).expect("never") {
                worst = worst.min(p.distance(stem.position_m) - stem.radius_m);
            }
        }
        assert!(worst > 0.5, "passes a stem at {worst} m");
    }

    #[test]
    fn any_point_needs_none_before_it() {
        let (a, b, obstacles) = (wander(), wander(), stand(5.0));
        let forwards: Vec<_> = (0..900)
            .map(|i| a.at(f64::from(i), &obstacles).expect("never"))
            .collect();
        for i in (0..900).rev() {
            assert_eq!(
                b.at(f64::from(i), &obstacles).expect("never"),
                forwards[i as usize]
            );
        }
    }

    #[test]
    fn it_is_smooth_and_starts_at_the_start() {
        let (w, obstacles) = (wander(), stand(5.0));
        let (p, _) = w
            .at(0.0, &|_: DVec2, _: f64| Ok::<_, Never>(Vec::new()))
            .expect("never");
        assert!(p.distance(DVec2::new(5.0, -3.0)) < 0.3, "{p}");
        let w = {
            let _ = w;
            wander()
        };
        for i in 0..20_000 {
            let s = f64::from(i) * 0.02;
            let ((p, d), (q, e)) = (
                w.at(s, &obstacles).expect("never"),
                w.at(s + 0.02, &obstacles).expect("never"),
            );
            assert!(p.distance(q) < 0.04 && d.angle_to(e).abs() < 0.05, "at {s}");
            assert!((q - p).dot(d) > 0.0);
        }
    }
}
