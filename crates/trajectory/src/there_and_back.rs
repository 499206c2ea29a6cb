//! A path along a line, there and back.

use std::f64::consts::PI;
use std::sync::Arc;

use nemoral_scene::glam::DVec2;

use crate::Polyline;
use crate::speed_profile::sped_up;

/// How long a body takes to turn around where it stands, seconds.
const TURN_S: f64 = 5.0;
/// Nearer to an end, metres, a body does not start.
const START_M: f64 = 2.0;

/// Position on the map, metres, and direction of travel, of length 1.
pub type Pose2d = (DVec2, DVec2);

/// A path along a line to its end, back to its beginning, and so on. At an end the body brakes,
/// turns around on the spot, and speeds up again.
///
/// Positions are in metres that the body would have driven if it kept its speed, so that it is at
/// `speed · time`.
#[derive(Clone, Debug)]
pub struct ThereAndBack {
    line: Arc<dyn Polyline>,
    start_m: f64,
    /// The way on which the body brakes, metres.
    braking_m: f64,
    /// What it would drive while it turns around.
    turning_m: f64,
}

impl ThereAndBack {
    /// Starts at `nearest_m` along the line, but not where it brakes, and sets out towards the
    /// farther end. `None` if the line is too short to turn at both ends (8 m), or if the speed is
    /// not finite and above 0.
    #[must_use]
    pub fn new(line: Arc<dyn Polyline>, nearest_m: f64, speed_m_s: f64) -> Option<Self> {
        let length = line.length_m();
        if length <= 4.0 * START_M || !(speed_m_s.is_finite() && speed_m_s > 0.0) {
            return None;
        }
        // Short lines take a harder brake.
        let braking_m = sped_up::way_m(speed_m_s).min(length / 4.0);
        let room_m = braking_m.max(START_M);
        let at = nearest_m.clamp(room_m, length - room_m);
        let mut path = Self {
            line,
            start_m: 0.0,
            braking_m,
            turning_m: speed_m_s * TURN_S,
        };
        // The second half of the lap goes back.
        path.start_m = if at <= length / 2.0 {
            braking_m + at
        } else {
            path.half_lap_m() + braking_m + length - at
        };
        Some(path)
    }

    /// From the end of one turn to the end of the next. On a way on which the body speeds up or
    /// brakes it would drive twice as far.
    fn half_lap_m(&self) -> f64 {
        self.line.length_m() + 2.0 * self.braking_m + self.turning_m
    }

    /// The way that the body has driven after `s_m` metres at full speed; negative values are
    /// before the start. It stands still where it turns.
    #[must_use]
    pub fn driven_m(&self, s_m: f64) -> f64 {
        let half_lap_m = self.half_lap_m();
        let from_first_m = |s_m: f64| {
            let half_laps = (s_m / half_lap_m).floor();
            half_laps * self.line.length_m() + self.along_m(s_m - half_laps * half_lap_m)
        };
        from_first_m(self.start_m + s_m) - from_first_m(self.start_m)
    }

    /// The way on the line within half a lap, by that at full speed.
    fn along_m(&self, way_m: f64) -> f64 {
        let length = self.line.length_m();
        let brakes = length + 2.0 * self.braking_m - way_m;
        let full = 2.0 * self.braking_m;
        if way_m < full {
            full * sped_up::share(way_m / full)
        } else if brakes < full {
            length - full * sped_up::share((brakes / full).max(0.0))
        } else {
            way_m - self.braking_m
        }
    }

    /// The position and direction after `s_m` metres from the start; negative values are before the
    /// start.
    #[must_use]
    pub fn at(&self, s_m: f64) -> Pose2d {
        let (length, half_lap) = (self.line.length_m(), self.half_lap_m());
        let lap = (self.start_m + s_m).rem_euclid(2.0 * half_lap);
        let returns = lap >= half_lap;
        let way = if returns { lap - half_lap } else { lap };
        let driven = self.along_m(way);
        let stands = way - (length + 2.0 * self.braking_m);
        let turn = (stands / self.turning_m).clamp(0.0, 1.0);
        // As even as accelerations are.
        let turned = turn * turn * turn * (10.0 + turn * (6.0 * turn - 15.0));
        let s = if returns { length - driven } else { driven };
        let back = if returns { PI } else { 0.0 };
        (
            self.line.position_m(s),
            DVec2::from_angle(back + turned * PI).rotate(self.line.tangent(s)),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Due east from the origin.
    #[derive(Debug)]
    struct East(f64);

    impl Polyline for East {
        fn length_m(&self) -> f64 {
            self.0
        }

        fn position_m(&self, s_m: f64) -> DVec2 {
            DVec2::new(s_m, 0.0)
        }

        fn tangent(&self, _: f64) -> DVec2 {
            DVec2::X
        }
    }

    #[test]
    fn it_turns_at_both_ends() {
        // At 1 m/s it brakes on 0.75 m in 1.5 s.
        let path = ThereAndBack::new(Arc::new(East(20.0)), 5.0, 1.0).expect("long enough");
        let lap = 2.0 * (20.0 + 1.5 + 5.0);
        for (s, x, forward) in [
            (0.0, 5.0, 1.0),
            (10.0, 15.0, 1.0),
            // 14.25 m to where it brakes, 1.5 s until it stands, 5 s until it has turned.
            (15.75, 20.0, 1.0),
            (20.75, 20.0, -1.0),
            (22.25, 19.25, -1.0),
            (22.25 + 18.5, 0.75, -1.0),
            (lap - 4.25, 0.75, 1.0),
            (lap, 5.0, 1.0),
            (-lap, 5.0, 1.0),
        ] {
            let (position, heading) = path.at(s);
            assert!(
                position.distance(DVec2::new(x, 0.0)) < 1e-12,
                "at {s} m: {position}"
            );
            assert!((heading.x - forward).abs() < 1e-12, "at {s} m");
        }
        assert!(path.at(18.25).1.x.abs() < 1e-12, "half of the turn");
        for (s, way) in [
            (0.0, 0.0),
            (10.0, 10.0),
            (18.0, 15.0),
            (22.25, 15.75),
            (lap, 40.0),
        ] {
            assert!((path.driven_m(s) - way).abs() < 1e-12, "at {s} m");
        }
        assert!((path.driven_m(-1.0) + 1.0).abs() < 1e-12);
        // Speeds and accelerations are those of a vehicle.
        let (h, speed_m_s) = (0.01, 5.0);
        let path = ThereAndBack::new(Arc::new(East(200.0)), 60.0, speed_m_s).expect("long enough");
        for i in 0..20_000 {
            let t = f64::from(i) * h;
            let [(p, a), (q, b), (r, c)] = [t - h, t, t + h].map(|t| path.at(speed_m_s * t));
            let pull = ((r - q) - (q - p)).length() / (h * h);
            assert!(pull < 1.01, "at {t} s: {pull} m/s²");
            let [before, after] = [a.angle_to(b) / h, b.angle_to(c) / h];
            assert!(
                after.abs() < 1.2 && (after - before).abs() < 0.02,
                "at {t} s: {after}"
            );
        }
    }

    #[test]
    fn it_sets_out_towards_the_farther_end() {
        let path = ThereAndBack::new(Arc::new(East(20.0)), 19.5, 1.0).expect("long enough");
        let (position, heading) = path.at(0.0);
        assert!((position.x - 18.0).abs() < 1e-12 && (heading.x + 1.0).abs() < 1e-12);
        assert!(ThereAndBack::new(Arc::new(East(8.0)), 4.0, 1.0).is_none());
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(ThereAndBack::new(Arc::new(East(20.0)), 5.0, wrong).is_none());
        }
        // A short line takes a hard brake.
        let fast = ThereAndBack::new(Arc::new(East(20.0)), 1.0, 30.0).expect("long enough");
        assert_eq!(fast.at(0.0).0.x, 5.0);
    }
}
