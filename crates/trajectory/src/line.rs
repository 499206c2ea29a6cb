//! A path along a line, there and back.

use std::sync::Arc;

use nemoral_scene::glam::DVec2;

use crate::Polyline;

/// The distance over which a body turns around at the end of a line, metres.
const TURN_M: f64 = 2.0;

/// Position on the map, metres, and direction of travel, of length 1.
pub type Heading = (DVec2, DVec2);

/// A path along a line to its end, back to its beginning, and so on.
#[derive(Clone, Debug)]
pub struct ThereAndBack {
    line: Arc<dyn Polyline>,
    start_m: f64,
}

impl ThereAndBack {
    /// Starts at `nearest_m` along the line, but not in a turn, and sets out towards the farther
    /// end. `None` if the line is too short to turn at both ends (8 m).
    #[must_use]
    pub fn new(line: Arc<dyn Polyline>, nearest_m: f64) -> Option<Self> {
        let length = line.length_m();
        if length <= 4.0 * TURN_M {
            return None;
        }
        let at = nearest_m.clamp(TURN_M, length - TURN_M);
        // The second half of the lap goes back.
        let start_m = if at <= length / 2.0 {
            at
        } else {
            2.0 * length - at
        };
        Some(Self { line, start_m })
    }

    /// The position and direction after `s_m` metres from the start; negative values are before the
    /// start.
    #[must_use]
    pub fn at(&self, s_m: f64) -> Heading {
        let length = self.line.length_m();
        let lap = (self.start_m + s_m).rem_euclid(2.0 * length);
        let s = if lap > length {
            2.0 * length - lap
        } else {
            lap
        };
        // The heading turns through 180 degrees about each end.
        let to_far_end = lap - length;
        let to_near_end = if lap > length {
            lap - 2.0 * length
        } else {
            lap
        };
        let turned = if to_far_end.abs() < TURN_M / 2.0 {
            to_far_end / TURN_M + 0.5
        } else if to_near_end.abs() < TURN_M / 2.0 {
            to_near_end / TURN_M + 1.5
        } else if lap > length {
            1.0
        } else {
            0.0
        };
        let tangent = self.line.tangent(s);
        (
            self.line.position_m(s),
            DVec2::from_angle(turned * std::f64::consts::PI).rotate(tangent),
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
        let path = ThereAndBack::new(Arc::new(East(20.0)), 5.0).expect("long enough");
        for (s, x, forward) in [
            (0.0, 5.0, 1.0),
            (10.0, 15.0, 1.0),
            (20.0, 15.0, -1.0),
            (33.0, 2.0, -1.0),
            (38.0, 3.0, 1.0),
            (40.0, 5.0, 1.0),
            (-40.0, 5.0, 1.0),
        ] {
            let (position, heading) = path.at(s);
            assert!(position.distance(DVec2::new(x, 0.0)) < 1e-12, "at {s} m");
            assert!((heading.x - forward).abs() < 1e-12, "at {s} m");
        }
        // There is no jump anywhere; a quarter turn is at the very end.
        for i in 0..8000 {
            let ((p, d), (q, e)) = (
                path.at(f64::from(i) * 0.01),
                path.at(f64::from(i + 1) * 0.01),
            );
            assert!(p.distance(q) < 0.02 && d.angle_to(e).abs() < 0.03, "at {i}");
        }
        assert!(path.at(15.0).1.x.abs() < 1e-12);
    }

    #[test]
    fn it_sets_out_towards_the_farther_end() {
        let path = ThereAndBack::new(Arc::new(East(20.0)), 19.5).expect("long enough");
        let (position, heading) = path.at(0.0);
        assert!((position.x - 18.0).abs() < 1e-12 && (heading.x + 1.0).abs() < 1e-12);
        assert!(ThereAndBack::new(Arc::new(East(8.0)), 4.0).is_none());
    }
}
