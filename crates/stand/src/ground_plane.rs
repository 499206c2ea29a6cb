//! Planes that patches of what lies are laid on.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4};

use nemoral_scene::glam::DVec2;
use nemoral_scene::{Surface, SurfaceSample};

/// Places on each ring around the middle.
const AROUND: u32 = 8;

/// The plane that is nearest to the ground of a disc, by least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundPlane {
    /// The middle of the disc on the map, metres.
    pub middle_m: DVec2,
    /// The plane's height there above the world's zero, metres.
    pub height_m: f64,
    /// (dz/dx, dz/dy), metres per metre.
    pub gradient: DVec2,
    /// How far it misses the ground at most, metres, of the places that were looked at.
    pub gap_m: f64,
}

impl GroundPlane {
    /// The plane of a disc on the map, metres, from heights at its middle and at sixteen places:
    /// eight on the circle that halves its area, and eight on its rim.
    ///
    /// On ground that is bent evenly the plane misses the middle as far as the rim, so by half of
    /// what the tangent at the middle would miss the rim.
    pub fn fit(middle_m: DVec2, radius_m: f64, height_m: impl Fn(DVec2) -> f64) -> Self {
        let at_middle = height_m(middle_m);
        let (mut sum, mut slope, mut weight) = (0.0, DVec2::ZERO, 0.0);
        let mut places = [(DVec2::ZERO, at_middle); 1 + 2 * AROUND as usize];
        for i in 0..2 * AROUND {
            let share = if i < AROUND { FRAC_1_SQRT_2 } else { 1.0 };
            // The rim's places are between those of the inner ring.
            let turn = FRAC_PI_4 * (f64::from(i) + if i < AROUND { 0.0 } else { 0.5 });
            let (sin, cos) = libm::sincos(turn);
            let way = DVec2::new(cos, sin) * (share * radius_m);
            let height = height_m(middle_m + way);
            if i < AROUND {
                sum += height;
            }
            slope += way * (height - at_middle);
            // The mean square of a coordinate on a circle is half of its radius squared.
            weight += 0.5 * way.length_squared();
            places[i as usize + 1] = (way, height);
        }
        let (height, gradient) = (sum / f64::from(AROUND), slope / weight);
        let misses = |(way, z): &(DVec2, f64)| (z - height - gradient.dot(*way)).abs();
        let gap_m = places.iter().map(misses).fold(0.0, f64::max);
        Self {
            middle_m,
            height_m: height,
            gradient,
            gap_m,
        }
    }
}

impl Surface for GroundPlane {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        SurfaceSample {
            height_m: self.height_m + self.gradient.dot(world_m - self.middle_m),
            gradient: self.gradient,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_plane_is_found_and_a_bowl_is_met_half_way(
            x in -1e4_f64..1e4, y in -1e4_f64..1e4, z in -50.0_f64..50.0,
            gx in -1.0_f64..1.0, gy in -1.0_f64..1.0,
            bend in -0.3_f64..0.3, radius_m in 0.1_f64..3.0,
        ) {
            let (middle, gradient) = (DVec2::new(x, y), DVec2::new(gx, gy));
            let plane = |p: DVec2| z + gradient.dot(p - middle);
            let fit = GroundPlane::fit(middle, radius_m, plane);
            prop_assert!(fit.gap_m < 1e-9 && (fit.gradient - gradient).length() < 1e-9);
            prop_assert!((fit.height_m - z).abs() < 1e-9);
            let bowl = |p: DVec2| plane(p) + 0.5 * bend * (p - middle).length_squared();
            let fit = GroundPlane::fit(middle, radius_m, bowl);
            prop_assert!((fit.gradient - gradient).length() < 1e-9);
            let quarter = 0.25 * bend.abs() * radius_m * radius_m;
            prop_assert!((fit.gap_m - quarter).abs() < 1e-9, "{} {quarter}", fit.gap_m);
        }

        #[test]
        fn no_place_that_was_looked_at_is_missed_farther(
            tilt in -0.5_f64..0.5, step in -0.2_f64..0.2, radius_m in 0.2..1.5,
        ) {
            // A step through the disc.
            let ground = |p: DVec2| tilt * p.x + if p.y > 0.1 { step } else { 0.0 };
            let fit = GroundPlane::fit(DVec2::ZERO, radius_m, ground);
            let gap = (fit.height_m(DVec2::ZERO) - ground(DVec2::ZERO)).abs();
            prop_assert!(gap <= fit.gap_m + 1e-12);
            prop_assert!(fit.gap_m <= step.abs() + 1e-12);
        }
    }
}
