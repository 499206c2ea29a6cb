//! Lanes up and down an area, along which one walks a plot, and back to where they began.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nemoral_scene::ParamError;
use nemoral_scene::glam::DVec2;

use crate::spline::gauss_legendre;

/// Parameters of [`Lanes`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LanesParams {
    /// The middle of the area on the map, metres.
    pub middle_m: DVec2,
    /// The direction of the first lane, of any length above 0.
    pub forward: DVec2,
    /// The extent of the area along the lanes, metres; above 0.
    pub length_m: f64,
    /// The extent of the area across the lanes, metres; above 0.
    pub width_m: f64,
    /// Distance between neighbouring lanes, metres; above 0. There are as many as cover the width,
    /// and one more where they would be odd, so that the last leads back.
    pub spacing_m: f64,
}

impl LanesParams {
    /// Checks the values.
    ///
    /// # Errors
    /// If one is out of its range, or there would be more than 10,000 lanes.
    pub fn check(&self) -> Result<(), ParamError> {
        let is_direction = self.forward.is_finite() && self.forward.length() > 0.0;
        let allowed = "finite and longer than 0";
        ParamError::check(is_direction, "forward", self.forward, allowed)?;
        ParamError::check(
            self.middle_m.is_finite(),
            "middle_m",
            self.middle_m,
            "finite",
        )?;
        ParamError::check_positive("length_m", self.length_m)?;
        ParamError::check_positive("width_m", self.width_m)?;
        ParamError::check_positive("spacing_m", self.spacing_m)?;
        let most = 1e4;
        let allowed = "so wide that there are at most 10,000 lanes";
        ParamError::check(
            self.width_m / self.spacing_m < most,
            "spacing_m",
            self.spacing_m,
            allowed,
        )
    }
}

/// A closed loop: lanes in alternating directions, as one mows a lawn, with turns between them, and
/// a way back along the side where the first began. Its curvature is continuous.
#[derive(Clone, Debug)]
pub struct Lanes {
    pieces: Vec<Piece>,
    length_m: f64,
    spacing_m: f64,
}

/// A straight piece or a quarter of a turn.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// How long the loop is up to here, metres.
    from_m: f64,
    length_m: f64,
    start_m: DVec2,
    forward: DVec2,
    /// By how much it turns to the left in all, radians.
    turn_rad: f64,
}

/// A place on a guide line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GuidePlace {
    pub(crate) position_m: DVec2,
    /// Of length 1.
    pub(crate) forward: DVec2,
    /// To the left, per metre.
    pub(crate) curvature_per_m: f64,
}

/// The part of a turn after a part of its length: its curvature is 0 at both ends and twice the
/// mean in the middle, as a squared sine.
fn turned(part: f64) -> f64 {
    part - libm::sin(TAU * part) / TAU
}

/// The displacement by a turn of so many radians after a part of its length, forward and to the
/// left, in lengths of the turn.
fn displaced(turn_rad: f64, part: f64) -> DVec2 {
    // Two pieces are exact to 1e-7 for a quarter of a turn.
    let half = 0.5 * part;
    let sum = |value: &dyn Fn(f64) -> f64| {
        gauss_legendre(0.0, half, value) + gauss_legendre(half, part, value)
    };
    DVec2::new(
        sum(&|u| libm::cos(turn_rad * turned(u))),
        sum(&|u| libm::sin(turn_rad * turned(u))),
    )
}

impl Lanes {
    /// The lanes of an area.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: LanesParams) -> Result<Self, ParamError> {
        params.check()?;
        let LanesParams {
            middle_m,
            length_m,
            width_m,
            spacing_m,
            ..
        } = params;
        let forward = params.forward.normalize();
        let lanes = (width_m / spacing_m - 1e-6).ceil() as usize + 1;
        let lanes = lanes.next_multiple_of(2);
        // The first lane is the rightmost one.
        let corner = DVec2::new(-0.5 * length_m, -0.5 * (lanes - 1) as f64 * spacing_m);
        let mut this = Self {
            pieces: Vec::with_capacity(4 * lanes),
            length_m: 0.0,
            spacing_m,
        };
        // Two quarters of a turn lead from a lane to the next.
        let quarter_m = 0.5 * spacing_m / displaced(FRAC_PI_2, 1.0).y;
        let mut at = (middle_m + forward.rotate(corner), forward);
        let mut side = 1.0;
        for lane in 0..lanes {
            at = this.push(at, length_m, 0.0);
            at = this.push(at, quarter_m, side * FRAC_PI_2);
            if lane + 1 == lanes && lanes > 2 {
                at = this.push(at, (lanes - 2) as f64 * spacing_m, 0.0);
            }
            at = this.push(at, quarter_m, side * FRAC_PI_2);
            side = if lane + 2 == lanes { 1.0 } else { -side };
        }
        Ok(this)
    }

    /// Adds a piece and tells where it ends.
    fn push(&mut self, at: (DVec2, DVec2), length_m: f64, turn_rad: f64) -> (DVec2, DVec2) {
        let (start_m, forward) = at;
        let piece = Piece {
            from_m: self.length_m,
            length_m,
            start_m,
            forward,
            turn_rad,
        };
        self.length_m += length_m;
        self.pieces.push(piece);
        let end = piece.at(length_m);
        (end.position_m, end.forward)
    }

    /// The length of the loop, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// How far from the lanes a wander about them may go, metres: a fifth of their distance, as
    /// turns between them have a radius of a quarter of it.
    #[must_use]
    pub fn most_amplitude_m(&self) -> f64 {
        0.2 * self.spacing_m
    }

    /// The place after so many metres; whole loops do not count.
    pub(crate) fn at(&self, along_m: f64) -> GuidePlace {
        let along_m = along_m.rem_euclid(self.length_m);
        let after = self.pieces.partition_point(|piece| piece.from_m <= along_m);
        let piece = &self.pieces[after.max(1) - 1];
        piece.at(along_m - piece.from_m)
    }
}

impl Piece {
    fn at(&self, along_m: f64) -> GuidePlace {
        if self.turn_rad == 0.0 {
            return GuidePlace {
                position_m: self.start_m + self.forward * along_m,
                forward: self.forward,
                curvature_per_m: 0.0,
            };
        }
        let part = along_m / self.length_m;
        let way = displaced(self.turn_rad, part) * self.length_m;
        let sine = libm::sin(PI * part);
        GuidePlace {
            position_m: self.start_m + self.forward.rotate(way),
            forward: rotated(self.forward, self.turn_rad * turned(part)),
            curvature_per_m: 2.0 * sine * sine * self.turn_rad / self.length_m,
        }
    }
}

/// A direction turned to the left.
fn rotated(direction: DVec2, angle_rad: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(angle_rad);
    DVec2::new(cos, sin).rotate(direction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PLOT: LanesParams = LanesParams {
        middle_m: DVec2::new(100.0, -50.0),
        forward: DVec2::Y,
        length_m: 30.0,
        width_m: 30.0,
        spacing_m: 10.0,
    };

    #[test]
    fn lanes_are_walked_in_turn_and_lead_back() {
        let lanes = Lanes::new(PLOT).expect("in range");
        // Northwards, to the left of which is west.
        let at = |s: f64| lanes.at(s).position_m;
        assert!(at(0.0).distance(DVec2::new(115.0, -65.0)) < 1e-9);
        assert!(at(30.0).distance(DVec2::new(115.0, -35.0)) < 1e-9);
        let turn_m = lanes.pieces[1].length_m + lanes.pieces[2].length_m;
        for lane in 0_u32..4 {
            let from = f64::from(lane) * (30.0 + turn_m);
            let x = 115.0 - 10.0 * f64::from(lane);
            let north = if lane % 2 == 0 { 1.0 } else { -1.0 };
            for s in [0.0, 15.0, 30.0] {
                let here = lanes.at(from + s);
                assert!((here.position_m.x - x).abs() < 1e-6, "{lane} {s}");
                assert!((here.position_m.y + 50.0 - north * (s - 15.0)).abs() < 1e-6);
                assert!(here.forward.distance(DVec2::new(0.0, north)) < 1e-9);
            }
        }
        assert!(at(lanes.length_m() - 1e-9).distance(at(0.0)) < 1e-6);
        assert_eq!(lanes.at(lanes.length_m() + 3.0).curvature_per_m, 0.0);
    }

    proptest! {
        /// Positions, directions and curvature are each the derivative of the one before, also over
        /// the end of the loop.
        #[test]
        fn the_loop_is_smooth(
            angle in 0.0_f64..TAU,
            length_m in 1.0_f64..100.0,
            width_m in 0.1_f64..60.0,
            spacing_m in 0.5_f64..30.0,
            part in 0.0_f64..1.0,
        ) {
            let forward = DVec2::from_angle(angle) * 3.0;
            let lanes = Lanes::new(LanesParams { forward, length_m, width_m, spacing_m, ..PLOT });
            let lanes = lanes.expect("in range");
            let h = 1e-5 * spacing_m;
            let s = lanes.length_m() * part;
            for s in [s, 0.0] {
                let [a, b] = [lanes.at(s - h), lanes.at(s + h)];
                let here = lanes.at(s);
                let step = (b.position_m - a.position_m) / (2.0 * h);
                prop_assert!(step.distance(here.forward) < 1e-4, "{step} {}", here.forward);
                prop_assert!((here.forward.length() - 1.0).abs() < 1e-9);
                let bend = a.forward.angle_to(b.forward) / (2.0 * h);
                let off = (bend - here.curvature_per_m) * spacing_m;
                prop_assert!(off.abs() < 1e-3, "{off}");
            }
        }
    }

    #[test]
    fn areas_of_any_width_are_covered_by_an_even_number() {
        let count = |width_m: f64| {
            let lanes = Lanes::new(LanesParams { width_m, ..PLOT }).expect("in range");
            let pieces = lanes.pieces.iter();
            pieces
                .filter(|p| p.turn_rad == 0.0 && p.length_m == 30.0)
                .count()
        };
        assert_eq!([1.0, 10.0, 10.1, 30.0, 31.0].map(count), [2, 2, 4, 4, 6]);
    }

    #[test]
    fn wrong_values_are_refused_by_name() {
        let refused = |params| Lanes::new(params).expect_err("out of range").field;
        assert_eq!(
            refused(LanesParams {
                width_m: 0.0,
                ..PLOT
            }),
            "width_m"
        );
        assert_eq!(
            refused(LanesParams {
                spacing_m: 1e-3,
                ..PLOT
            }),
            "spacing_m"
        );
        assert_eq!(
            refused(LanesParams {
                forward: DVec2::ZERO,
                ..PLOT
            }),
            "forward"
        );
        assert_eq!(
            refused(LanesParams {
                length_m: f64::NAN,
                ..PLOT
            }),
            "length_m"
        );
    }
}
