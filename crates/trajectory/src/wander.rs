//! A smooth wander between stems, which can be evaluated anywhere without what comes before.

mod course;
mod displacements;

use std::sync::{Arc, Mutex, PoisonError};

use nemoral_scene::ParamError;
use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Key};

use self::course::{Course, Guide};
use crate::spline::CubicBSpline;
use crate::{Lanes, Obstacles, Pose2d};

/// The name is older than this crate; another one would change every wander.
const WANDER: Domain = Domain::new("pipeline.wander");

/// Distance between knots along the guide line, metres.
const KNOT_M: f64 = 3.0;
/// Knots in a block.
const BLOCK: usize = 24;
/// The length of a block along the guide line, metres.
const BLOCK_M: f64 = BLOCK as f64 * KNOT_M;
/// The most blocks whose curves are kept. A drive needs three at a place, and frames may be asked
/// for on many stretches of it at once.
const KEPT_BLOCKS: usize = 64;

/// A curve about a guide line, displaced sideways so that it keeps its clearance. The line is
/// straight, or a loop of lanes.
///
/// The line is cut into blocks of 72 m. Where blocks meet, the displacement is keyed; inside a
/// block it is the best of all paths over a grid of choices, by dynamic programming over clearance
/// of the curve itself, slope and curvature. A uniform cubic B-spline about the choices is the
/// curve, so that curvature is continuous. A point depends only on its own block and those beside
/// it.
///
/// Positions are in metres travelled. Each block begins and ends with those of the guide line, and
/// as the curve is longer, the body drives a little faster within a block: by a few percent, and up
/// to a quarter where it winds between stems that stand closest.
#[derive(Debug)]
pub struct Wander {
    guide: Guide,
    amplitude_m: f64,
    clearance_m: f64,
    key: Key,
    /// The displacements of the knots of blocks.
    blocks: Memory<[f64; BLOCK]>,
    courses: Memory<Course>,
}

/// What a drive needs again and again of the blocks around, by their numbers; that which was used
/// last comes last.
type Memory<T> = Mutex<Vec<(i64, Arc<T>)>>;

impl Wander {
    /// A wander from `start_m` along `forward`, which deviates by up to `amplitude_m` to either
    /// side and keeps `clearance_m` from obstacles where there is room. Where there is not, it
    /// passes several too near rather than touch one.
    #[must_use]
    pub fn new(
        start_m: DVec2,
        forward: DVec2,
        amplitude_m: f64,
        clearance_m: f64,
        key: Key,
    ) -> Self {
        let forward = forward.normalize_or(DVec2::X);
        let guide = Guide::Straight { start_m, forward };
        Self::about(guide, amplitude_m, clearance_m, key)
    }

    /// The same about a loop of lanes, which [ends](Self::length_m) near where it begins.
    #[must_use]
    pub fn along_lanes(lanes: Lanes, amplitude_m: f64, clearance_m: f64, key: Key) -> Self {
        Self::about(Guide::Lanes(lanes), amplitude_m, clearance_m, key)
    }

    fn about(guide: Guide, amplitude_m: f64, clearance_m: f64, key: Key) -> Self {
        Self {
            guide,
            amplitude_m,
            clearance_m,
            key: key.domain(WANDER),
            blocks: Memory::default(),
            courses: Memory::default(),
        }
    }

    /// The length of a loop of lanes, metres; `None` if the line is straight and has no end.
    #[must_use]
    pub fn length_m(&self) -> Option<f64> {
        match &self.guide {
            Guide::Straight { .. } => None,
            Guide::Lanes(lanes) => Some(lanes.length_m()),
        }
    }

    /// Checks the values.
    ///
    /// # Errors
    /// If the start, the amplitude or the clearance is not finite, one of the latter two is
    /// negative, or the amplitude about lanes is more than a fifth of their distance.
    pub fn check(&self) -> Result<(), ParamError> {
        ParamError::check_at_least_zero("wander.amplitude_m", self.amplitude_m)?;
        match &self.guide {
            Guide::Straight { start_m, .. } => {
                ParamError::check(start_m.is_finite(), "wander.start_m", start_m, "finite")?;
            }
            Guide::Lanes(lanes) => ParamError::check(
                self.amplitude_m <= lanes.most_amplitude_m(),
                "wander.amplitude_m",
                self.amplitude_m,
                "at most a fifth of the distance of the lanes",
            )?,
        }
        ParamError::check_at_least_zero("wander.clearance_m", self.clearance_m)
    }

    /// Position and direction after `travelled_m`.
    ///
    /// # Errors
    /// The first error of `obstacles`.
    pub fn at<O: Obstacles + ?Sized>(
        &self,
        travelled_m: f64,
        obstacles: &O,
    ) -> Result<Pose2d, O::Error> {
        let block = (travelled_m / BLOCK_M).floor();
        let course = remembered(&self.courses, block as i64, || {
            self.course(block as i64, obstacles)
        })?;
        let x = course.knots_after(&self.guide, travelled_m - block * BLOCK_M);
        let (offset, slope) = (course.curve.at(x), course.curve.slope(x) / KNOT_M);
        let on_line = self.guide.at(block * BLOCK_M + KNOT_M * x);
        let (forward, left) = (on_line.forward, on_line.forward.perp());
        // On the inner side of a turn the way is shorter.
        let along = 1.0 - on_line.curvature_per_m * offset;
        Ok((
            on_line.position_m + left * offset,
            (forward * along + left * slope).normalize_or(forward),
        ))
    }

    fn course<O: Obstacles + ?Sized>(&self, block: i64, obstacles: &O) -> Result<Course, O::Error> {
        let offsets = |block| remembered(&self.blocks, block, || self.solve(block, obstacles));
        let (before, within, after) = (offsets(block - 1)?, offsets(block)?, offsets(block + 1)?);
        let mut controls = [0.0; BLOCK + 3];
        controls[0] = before[BLOCK - 1];
        controls[1..=BLOCK].copy_from_slice(&*within);
        controls[BLOCK + 1..].copy_from_slice(&after[..2]);
        let from_m = block as f64 * BLOCK_M;
        Ok(Course::new(&self.guide, from_m, CubicBSpline { controls }))
    }
}

/// A value of a block, made where it is not known yet, while no lock is held: making it may ask for
/// others. It takes the place of that which was not used for longest.
fn remembered<T, E>(
    memory: &Memory<T>,
    block: i64,
    make: impl FnOnce() -> Result<T, E>,
) -> Result<Arc<T>, E> {
    let put_last = |made: Option<Arc<T>>| {
        let mut known = memory.lock().unwrap_or_else(PoisonError::into_inner);
        let at = known.iter().rposition(|&(other, _)| other == block);
        let value = match at {
            Some(at) => known.remove(at).1,
            None => made?,
        };
        if known.len() >= KEPT_BLOCKS {
            known.remove(0);
        }
        known.push((block, Arc::clone(&value)));
        Some(value)
    };
    if let Some(value) = put_last(None) {
        return Ok(value);
    }
    let value = Arc::new(make()?);
    Ok(put_last(Some(Arc::clone(&value))).unwrap_or(value))
}

#[cfg(test)]
mod tests {
    use nemoral_seed::Draw;

    use super::*;
    use crate::Obstacle;

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
    fn it_keeps_its_clearance_where_there_is_room() {
        // From 400 to 1,000 stems on a hectare.
        for (spacing_m, least_m) in [(5.0, 0.8), (3.7, 0.79), (3.16, 0.77)] {
            let obstacles = stand(spacing_m);
            for seed in 0_u32..2 {
                let (ahead, key) = (
                    DVec2::from_angle(f64::from(seed)),
                    Key::world(9 + u64::from(seed)),
                );
                let w = Wander::new(DVec2::new(5.0, -3.0), ahead, 8.0, 0.8, key);
                let mut worst = f64::INFINITY;
                for i in 0..1400 {
                    let (p, _) = w.at(f64::from(i) * 0.25, &obstacles).expect("never");
                    for stem in obstacles(p, 5.0).expect("never") {
                        worst = worst.min(p.distance(stem.position_m) - stem.radius_m);
                    }
                }
                assert!(
                    worst > least_m,
                    "{spacing_m} {seed}: passes a stem at {worst} m"
                );
            }
        }
    }

    /// A wall with two ways through it: one between two obstacles, 0.7 m wide, and one at the edge
    /// of the amplitude, 0.05 m from a stem.
    #[test]
    fn two_stems_passed_too_near_are_better_than_one_that_is_touched() {
        let obstacle = |y_m: f64, radius_m| Obstacle {
            position_m: DVec2::new(36.0, y_m),
            radius_m,
        };
        let wall = [obstacle(1.75, 0.2), obstacle(-2.15, 3.0)];
        let obstacles = |_: DVec2, _: f64| Ok::<_, Never>(wall.to_vec());
        let w = Wander::new(DVec2::ZERO, DVec2::X, 2.0, 0.8, Key::world(9));
        let mut least_m = f64::INFINITY;
        for i in 0..700 {
            let (p, _) = w.at(f64::from(i) * 0.1, &obstacles).expect("never");
            for o in &wall {
                least_m = least_m.min(p.distance(o.position_m) - o.radius_m);
            }
        }
        assert!(least_m > 0.2, "passes at {least_m} m");
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

    /// Many stretches of a drive are asked for at once, of which those at its start must not be
    /// forgotten first.
    #[test]
    fn places_below_a_long_drive_are_solved_once() {
        let asked = std::cell::Cell::new(0_u32);
        let nothing = |_: DVec2, _: f64| {
            asked.set(asked.get() + 1);
            Ok::<Vec<Obstacle>, Never>(Vec::new())
        };
        let w = Wander::new(DVec2::ZERO, DVec2::X, 20.0, 0.8, Key::world(9));
        let at = |block: f64| w.at((block + 0.5) * BLOCK_M, &nothing).expect("never");
        for block in 0..70_u32 {
            at(f64::from(block));
        }
        // Each block is solved once, by its knots and those about its two ends.
        let of_block = BLOCK as u32 + 1 + 2 * 3;
        assert_eq!(asked.replace(0), 72 * of_block);
        for _ in 0..5 {
            at(-8.0);
            at(-4.0);
        }
        assert_eq!(asked.get(), 6 * of_block);
    }

    #[test]
    fn it_is_smooth_and_starts_at_the_start() {
        let (w, obstacles) = (wander(), stand(5.0));
        let (p, _) = w
            .at(0.0, &|_: DVec2, _: f64| Ok::<_, Never>(Vec::new()))
            .expect("never");
        assert!(p.distance(DVec2::new(5.0, -3.0)) < 0.3, "{p}");
        let w = wander();
        // Speed, and how fast the heading turns.
        let step_m = 0.02;
        let motion = |s: f64| {
            let [(p, d), (q, e)] = [s, s + step_m].map(|s| w.at(s, &obstacles).expect("never"));
            assert!((q - p).dot(d) > 0.0);
            (p.distance(q) / step_m, d.angle_to(e) / step_m)
        };
        let (mut speed, mut bend) = motion(-0.02);
        for i in 0..20_000 {
            let s = f64::from(i) * step_m;
            let (new_speed, new_bend) = motion(s);
            assert!((0.95..1.3).contains(&new_speed), "at {s}: {new_speed}");
            assert!(
                (new_speed - speed).abs() < 2e-3,
                "at {s}: {speed} {new_speed}"
            );
            assert!(new_bend.abs() < 0.6, "at {s}: {new_bend} radians a metre");
            assert!((new_bend - bend).abs() < 0.02, "at {s}: {bend} {new_bend}");
            (speed, bend) = (new_speed, new_bend);
        }
    }

    fn walk(length_m: f64, width_m: f64, spacing_m: f64) -> Wander {
        let lanes = Lanes::new(crate::LanesParams {
            middle_m: DVec2::new(5.0, -3.0),
            forward: DVec2::new(1.0, 1.0),
            length_m,
            width_m,
            spacing_m,
        });
        let lanes = lanes.expect("in range");
        let amplitude_m = lanes.most_amplitude_m();
        Wander::along_lanes(lanes, amplitude_m, 0.6, Key::world(9))
    }

    /// Without anything in the way a loop ends where it began.
    #[test]
    fn a_loop_of_lanes_is_closed() {
        let nothing = |_: DVec2, _: f64| Ok::<_, Never>(Vec::new());
        for (length_m, width_m, spacing_m) in [
            // Shorter and longer than a block.
            (14.0, 10.0, 10.0),
            (40.0, 30.0, 4.0),
            (40.0, 30.0, 6.5),
            (40.0, 30.0, 10.0),
        ] {
            let w = walk(length_m, width_m, spacing_m);
            let length_m = w.length_m().expect("a loop");
            let [start, end] = [0.0, length_m].map(|s| w.at(s, &nothing).expect("never").0);
            assert!(start.distance(end) < 1e-6, "{spacing_m}: {start} {end}");
        }
    }

    #[test]
    fn lanes_are_walked_past_stems_at_an_even_speed() {
        for (spacing_m, least_m) in [(10.0, 0.58), (6.0, 0.5), (4.0, 0.2)] {
            let (w, obstacles) = (walk(40.0, 30.0, spacing_m), stand(4.5));
            assert_eq!(w.check(), Ok(()));
            let length_m = w.length_m().expect("a loop");
            let (step_m, mut worst) = (0.05, f64::INFINITY);
            let mut speeds = (f64::INFINITY, 0.0_f64);
            let at = |s: f64| w.at(s, &obstacles).expect("never");
            for i in 0..(length_m / step_m) as u32 {
                let s = f64::from(i) * step_m;
                let [(p, d), (q, _)] = [s, s + step_m].map(at);
                let speed = p.distance(q) / step_m;
                speeds = (speeds.0.min(speed), speeds.1.max(speed));
                // In the tightest turns the heading changes by some degrees in a step.
                assert!((q - p).normalize().dot(d) > 0.99, "at {s}");
                for stem in obstacles(p, 5.0).expect("never") {
                    let gap = p.distance(stem.position_m) - stem.radius_m;
                    worst = worst.min(gap);
                }
            }
            assert!(worst > least_m, "{spacing_m}: passes a stem at {worst} m");
            assert!(speeds.0 > 0.75 && speeds.1 < 1.35, "{speeds:?}");
        }
    }

    #[test]
    fn no_wander_leaves_its_lane_by_more_than_a_fifth() {
        let mut wide = walk(40.0, 30.0, 10.0);
        wide.amplitude_m = 2.1;
        assert_eq!(
            wide.check().expect_err("too wide").field,
            "wander.amplitude_m"
        );
    }
}
