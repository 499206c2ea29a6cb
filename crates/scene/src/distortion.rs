//! Lens distortion: Brown–Conrady and the equidistant fisheye.

use glam::{DMat2, DVec2, DVec3};

/// The distortion of a lens, by OpenCV's models and coefficients. A ray is given by its position in
/// the image of a pinhole with focal length 1 (x/z, y/z of the optical frame), or by its angle to
/// the axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(tag = "model", rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Distortion {
    /// No distortion: a pinhole.
    #[default]
    None,
    /// Brown (1966) and Conrady (1919): with r² = x² + y², the point is projected to (x, y) (1 + k1
    /// r² + k2 r⁴ + k3 r⁶) + (2 p1 x y + p2 (r² + 2 x²), p1 (r² + 2 y²) + 2 p2 x y).
    BrownConrady {
        /// Radial coefficient of the second power.
        k1: f64,
        /// Radial coefficient of the fourth power.
        k2: f64,
        /// Radial coefficient of the sixth power.
        k3: f64,
        /// Tangential coefficient p1.
        p1: f64,
        /// Tangential coefficient p2.
        p2: f64,
    },
    /// Kannala and Brandt (2006): a ray at the angle θ to the axis is projected at the distance θ
    /// (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) from the middle; all zero is the equidistant fisheye.
    Fisheye {
        /// Coefficient of the third power of the angle.
        k1: f64,
        /// Coefficient of the fifth power of the angle.
        k2: f64,
        /// Coefficient of the seventh power of the angle.
        k3: f64,
        /// Coefficient of the ninth power of the angle.
        k4: f64,
    },
}

/// The greatest number of steps of Newton's method, which usually takes about five.
const STEPS: usize = 50;

impl Distortion {
    /// Whether there is no distortion.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::None
    }

    /// The distance from the middle, at focal length 1, at which a ray at this angle to the axis is
    /// projected, without the tangential part.
    #[must_use]
    pub fn radius(&self, angle_rad: f64) -> f64 {
        match *self {
            Self::None => libm::tan(angle_rad),
            Self::BrownConrady { k1, k2, k3, .. } => odd(libm::tan(angle_rad), [k1, k2, k3, 0.0]).0,
            Self::Fisheye { k1, k2, k3, k4 } => odd(angle_rad, [k1, k2, k3, k4]).0,
        }
    }

    /// Its five or four coefficients with their names.
    #[must_use]
    pub fn coefficients(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Self::None => Vec::new(),
            Self::BrownConrady { k1, k2, k3, p1, p2 } => vec![
                ("brown_conrady.k1", k1),
                ("brown_conrady.k2", k2),
                ("brown_conrady.k3", k3),
                ("brown_conrady.p1", p1),
                ("brown_conrady.p2", p2),
            ],
            Self::Fisheye { k1, k2, k3, k4 } => vec![
                ("fisheye.k1", k1),
                ("fisheye.k2", k2),
                ("fisheye.k3", k3),
                ("fisheye.k4", k4),
            ],
        }
    }

    /// Where a point in front of the camera (z > 0) is projected at focal length 1; `None` beyond
    /// the angle where the lens folds. Such a ray is not in the picture, though the formula gives a
    /// position for it.
    pub(crate) fn draw(&self, point: DVec3) -> Option<DVec2> {
        let flat = point.truncate() / point.z;
        let drawn = match *self {
            Self::None => return Some(flat),
            Self::BrownConrady { k1, k2, k3, p1, p2 } => brown(flat, [k1, k2, k3], [p1, p2]).0,
            Self::Fisheye { k1, k2, k3, k4 } => {
                let r = flat.length();
                if r < 1e-12 {
                    return Some(flat);
                }
                flat * (odd(libm::atan(r), [k1, k2, k3, k4]).0 / r)
            }
        };
        let back = self.ray(drawn)?;
        let same = (back - point / point.length()).length() < 1e-7;
        same.then_some(drawn)
    }

    /// The unit direction that is projected there, on the near side of any fold, within 1e-12 where
    /// the lens is valid. `None` if there is none in front of the camera.
    pub(crate) fn ray(&self, drawn: DVec2) -> Option<DVec3> {
        match *self {
            Self::None => Some(drawn.extend(1.0).normalize()),
            Self::BrownConrady { k1, k2, k3, p1, p2 } => {
                let solve = |drawn, from| solve_brown(drawn, from, [k1, k2, k3], [p1, p2]);
                let unfolds = |flat: &DVec2| self.unfolds(flat.extend(1.0));
                let is_near =
                    |flat: &DVec2| surely_rises(flat.length(), [k1, k2, k3, 0.0]) || unfolds(flat);
                // From the projected point Newton's method converges to the near side for barrel
                // distortion, whose curve is concave, and for pincushion distortion, whose curve
                // is convex. A lens that changes from one to the other may start it beyond a fold.
                let quick = solve(drawn, drawn).filter(is_near);
                let flat = quick.or_else(|| {
                    let next = |share: f64, flat| solve(drawn * share, flat);
                    from_the_axis(DVec2::ZERO, next).filter(unfolds)
                })?;
                Some(flat.extend(1.0).normalize())
            }
            Self::Fisheye { k1, k2, k3, k4 } => {
                let radius = drawn.length();
                if radius < 1e-12 {
                    return Some(drawn.extend(1.0).normalize());
                }
                let solve = |radius, from| solve_fisheye(radius, from, [k1, k2, k3, k4]);
                let direction = |angle| {
                    let (sin, cos) = libm::sincos(angle);
                    (drawn * (sin / radius)).extend(cos)
                };
                let unfolds = |angle: &f64| self.unfolds(direction(*angle));
                let is_near =
                    |angle: &f64| surely_rises(*angle, [k1, k2, k3, k4]) || unfolds(angle);
                let quick = solve(radius, radius).filter(is_near);
                let angle = quick.or_else(|| {
                    let next = |share: f64, angle| solve(radius * share, angle);
                    from_the_axis(0.0, next).filter(unfolds)
                })?;
                Some(direction(angle))
            }
        }
    }

    /// Whether the lens projects every ray up to this one farther out than those before it.
    pub(crate) fn unfolds(&self, direction: DVec3) -> bool {
        /// Number of places tested from the axis outwards. A polynomial of ninth degree cannot turn
        /// twice between two neighbours out of so many.
        const PLACES: u32 = 200;
        let flat = direction.truncate() / direction.z;
        (0..=PLACES).all(|i| {
            let part = f64::from(i) / f64::from(PLACES);
            match *self {
                Self::None => true,
                Self::BrownConrady { k1, k2, k3, p1, p2 } => {
                    let slope = brown(flat * part, [k1, k2, k3], [p1, p2]).1;
                    odd(flat.length() * part, [k1, k2, k3, 0.0]).1 > 0.0
                        && slope.determinant() > 0.0
                }
                Self::Fisheye { k1, k2, k3, k4 } => {
                    odd(libm::atan(flat.length()) * part, [k1, k2, k3, k4]).1 > 0.0
                }
            }
        })
    }
}

/// Where Brown and Conrady's projection leads to `drawn`, by Newton's method from a place. `None`
/// if that does not converge, or where the picture is turned inside out.
fn solve_brown(drawn: DVec2, from: DVec2, k: [f64; 3], p: [f64; 2]) -> Option<DVec2> {
    let mut flat = from;
    for _ in 0..STEPS {
        let (there, slope) = brown(flat, k, p);
        let step = slope.inverse() * (there - drawn);
        flat -= step;
        if !flat.is_finite() {
            return None;
        }
        if step.length_squared() < 1e-30 * (1.0 + flat.length_squared()) {
            break;
        }
    }
    let (there, slope) = brown(flat, k, p);
    let sound = (there - drawn).length() < 1e-10 && slope.determinant() > 0.0;
    sound.then_some(flat)
}

/// The angle in front of the camera that a fisheye projects at this radius, in the same way.
fn solve_fisheye(radius: f64, from: f64, k: [f64; 4]) -> Option<f64> {
    let mut angle = from;
    for _ in 0..STEPS {
        let (there, slope) = odd(angle, k);
        let step = (there - radius) / slope;
        angle -= step;
        if !angle.is_finite() {
            return None;
        }
        if step.abs() < 1e-15 * (1.0 + angle) {
            break;
        }
    }
    let (there, slope) = odd(angle, k);
    let is_ahead = angle > 0.0 && angle < std::f64::consts::FRAC_PI_2;
    let sound = (there - radius).abs() < 1e-10 && slope > 0.0 && is_ahead;
    sound.then_some(angle)
}

/// Follows a solution from the axis outwards, where it is on the near side of any fold: `next`
/// finds that for a share of the whole radius, from the one before.
fn from_the_axis<T>(axis: T, next: impl Fn(f64, T) -> Option<T>) -> Option<T> {
    /// Number of equal steps. In one of them no usual lens turns so much that Newton's method
    /// leaves its curve.
    const PARTS: u32 = 32;
    (1..=PARTS).try_fold(axis, |before, i| {
        next(f64::from(i) / f64::from(PARTS), before)
    })
}

/// Whether [`odd`] rises all the way to `x` by Bernstein's coefficients of its slope over the
/// square of the way, between which the slope lies. It may rise even if this is false.
fn surely_rises(x: f64, [a, b, c, d]: [f64; 4]) -> bool {
    let s = x * x;
    let (a, b) = (3.0 * a * s, 5.0 * b * s * s);
    let (c, d) = (7.0 * c * s * s * s, 9.0 * d * s * s * s * s);
    let bounds = [
        1.0 + a / 4.0,
        1.0 + a / 2.0 + b / 6.0,
        1.0 + 0.75 * a + b / 2.0 + c / 4.0,
        1.0 + a + b + c + d,
    ];
    bounds.into_iter().all(|bound| bound > 0.0)
}

/// x (1 + a x² + b x⁴ + c x⁶ + d x⁸) and its derivative.
fn odd(x: f64, [a, b, c, d]: [f64; 4]) -> (f64, f64) {
    let s = x * x;
    let value = x * (1.0 + s * (a + s * (b + s * (c + s * d))));
    let slope = 1.0 + s * (3.0 * a + s * (5.0 * b + s * (7.0 * c + s * 9.0 * d)));
    (value, slope)
}

/// Brown and Conrady's projection and its Jacobian.
fn brown(p: DVec2, [k1, k2, k3]: [f64; 3], [p1, p2]: [f64; 2]) -> (DVec2, DMat2) {
    let (x, y) = (p.x, p.y);
    let s = p.length_squared();
    let radial = 1.0 + s * (k1 + s * (k2 + s * k3));
    // The derivative by s.
    let slope = k1 + s * (2.0 * k2 + s * 3.0 * k3);
    let aside = DVec2::new(
        2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
        p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y,
    );
    let mixed = 2.0 * x * y * slope + 2.0 * (p1 * x + p2 * y);
    let jacobian = DMat2::from_cols(
        DVec2::new(
            radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
            mixed,
        ),
        DVec2::new(
            mixed,
            radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
        ),
    );
    (p * radial + aside, jacobian)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_jacobian_is_the_slope(
            x in -1.0_f64..1.0,
            y in -1.0_f64..1.0,
            k in prop::array::uniform3(-0.3_f64..0.3),
            t in prop::array::uniform2(-0.02_f64..0.02),
        ) {
            let at = |x, y| brown(DVec2::new(x, y), k, t).0;
            let h = 1e-6;
            let slope = brown(DVec2::new(x, y), k, t).1;
            let by_x = (at(x + h, y) - at(x - h, y)) / (2.0 * h);
            let by_y = (at(x, y + h) - at(x, y - h)) / (2.0 * h);
            prop_assert!(
                (slope.x_axis - by_x).length() < 1e-7 && (slope.y_axis - by_y).length() < 1e-7
            );
        }

        #[test]
        fn what_surely_rises_does(
            k in prop::array::uniform4(-0.8_f64..0.8),
            x in 0.0_f64..1.5,
        ) {
            let rises = (0..=500).all(|i| odd(x * f64::from(i) / 500.0, k).1 > 0.0);
            prop_assert!(rises || !surely_rises(x, k));
        }

        /// Whichever way Newton's method finds it, it is the ray of the near side.
        #[test]
        fn rays_of_the_near_side_are_found(
            k in prop::array::uniform3(-0.9_f64..0.9),
            x in 0.01_f64..1.5,
        ) {
            let lens = Distortion::BrownConrady {
                k1: k[0],
                k2: k[1],
                k3: k[2],
                p1: 0.0,
                p2: 0.0,
            };
            let k = [k[0], k[1], k[2], 0.0];
            let steepness = |i: u32| odd(x * f64::from(i) / 500.0, k).1;
            prop_assume!((0..=500).map(steepness).fold(f64::MAX, f64::min) > 0.05);
            let ray = lens.ray(DVec2::new(odd(x, k).0, 0.0)).expect("there");
            prop_assert!((ray.x / ray.z - x).abs() < 1e-8, "{ray}");
        }
    }

    #[test]
    fn most_usual_lenses_are_known_to_rise_without_a_search() {
        // Barrel distortion, and fisheyes.
        assert!(surely_rises(0.9, [-0.28, 0.09, -0.01, 0.0]));
        assert!(surely_rises(1.3, [-0.02, 0.004, -0.001, 0.0001]));
        assert!(!surely_rises(1.1, [-0.3, 0.0, 0.0, 0.0]));
    }

    #[test]
    fn published_points() {
        // OpenCV's formulas computed by hand: x = 0.3, y = -0.2, r² = 0.13.
        let lens = Distortion::BrownConrady {
            k1: -0.28,
            k2: 0.07,
            k3: 0.01,
            p1: 0.001,
            p2: -0.002,
        };
        let at = lens.draw(DVec3::new(0.3, -0.2, 1.0)).expect("there");
        let radial = 1.0 - 0.28 * 0.13 + 0.07 * 0.0169 + 0.01 * 0.002_197;
        let x = 0.3 * radial + 2.0 * 0.001 * -0.06 - 0.002 * (0.13 + 0.18);
        let y = -0.2 * radial + 0.001 * (0.13 + 0.08) + 2.0 * -0.002 * -0.06;
        assert!((at - DVec2::new(x, y)).length() < 1e-15, "{at}");
        // For the equidistant fisheye the distance is the angle.
        let fish = Distortion::Fisheye {
            k1: 0.0,
            k2: 0.0,
            k3: 0.0,
            k4: 0.0,
        };
        let at = fish.draw(DVec3::new(1.0, 0.0, 1.0)).expect("there");
        assert!((at.x - std::f64::consts::FRAC_PI_4).abs() < 1e-15 && at.y == 0.0);
    }

    #[test]
    fn behind_a_fold_nothing_is_drawn() {
        // r (1 - 0.3 r²) turns at r = 1.054.
        let lens = Distortion::BrownConrady {
            k1: -0.3,
            k2: 0.0,
            k3: 0.0,
            p1: 0.0,
            p2: 0.0,
        };
        assert!(lens.draw(DVec3::new(1.0, 0.0, 1.0)).is_some());
        assert!(lens.draw(DVec3::new(1.5, 0.0, 1.0)).is_none());
        assert!(lens.unfolds(DVec3::new(1.0, 0.0, 1.0)));
        assert!(!lens.unfolds(DVec3::new(1.1, 0.0, 1.0)));
        // Pincushion and then barrel distortion, which turns at r = 1.12 and crosses the axis at
        // 1.41: what is beyond is projected into the picture, too.
        let lens = Distortion::BrownConrady {
            k1: 0.09,
            k2: 0.67,
            k3: -0.49,
            p1: 0.0,
            p2: 0.0,
        };
        for (x, is_drawn) in [
            (0.9, true),
            (1.1, true),
            (1.2, false),
            (1.3, false),
            (1.5, false),
        ] {
            let at = lens.draw(DVec3::new(x, 0.0, 1.0));
            assert_eq!(at.is_some(), is_drawn, "{x}: {at:?}");
        }
    }
}
