//! Points on the discs of the sun and of lamps.

use glam::{Vec2, Vec3};
use nemoral_seed::{Domain, Draw, Key};

use crate::Sun;

/// Parts of the disc, of equal area: one for each pixel of any 3 × 3.
const PARTS: usize = 9;
/// Points in each.
const POINTS: usize = 128;

/// A point of a source of light that is a disc.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DiscPoint {
    /// In the unit disc.
    pub(crate) on_disc: Vec2,
    /// The direction to the point of the sun's disc.
    pub(crate) sun: Vec3,
}

/// Points of the sun's disc, and of those of lamps.
#[derive(Clone, Debug)]
pub(crate) struct SunDisc {
    /// `PARTS` of `POINTS`.
    points: Vec<DiscPoint>,
}

impl SunDisc {
    pub(crate) fn new(centre: Vec3) -> Self {
        let (x, y) = centre.any_orthonormal_pair();
        // The table is the same for every picture; a picture's key chooses from it.
        let mut rng = Key::world(0).domain(Domain::new("render.sun_disc")).rng();
        let points = (0..PARTS * POINTS)
            .map(|i| {
                let (part, _) = (i / POINTS, i % POINTS);
                let a = ((part % 3) as f64 + rng.unit_f64()) / 1.5 - 1.0;
                let b = ((part / 3) as f64 + rng.unit_f64()) / 1.5 - 1.0;
                let (u, v) = disc_from_square(a, b);
                let r = Sun::ANGULAR_RADIUS_RAD;
                let d = centre + x * (r * u) as f32 + y * (r * v) as f32;
                DiscPoint {
                    on_disc: Vec2::new(u as f32, v as f32),
                    sun: d / d.length(),
                }
            })
            .collect();
        Self { points }
    }

    /// The point for the first sample of a pixel (column, row); any 3 × 3 pixels get all parts
    /// of the disc.
    pub(crate) fn of_pixel(&self, (x, y): (usize, usize), word: u32) -> DiscPoint {
        let part = x % 3 + 3 * (y % 3);
        self.points[part * POINTS + word as usize % POINTS]
    }

    /// A random point of the disc.
    pub(crate) fn at_random(&self, word: u32) -> DiscPoint {
        // Lemire's multiplication gives an index with negligible bias.
        let index = (u64::from(word) * self.points.len() as u64) >> 32;
        self.points[index as usize]
    }
}

/// Maps the square −1..1 to the unit disc with proportional areas (Shirley and Chiu 1997).
fn disc_from_square(a: f64, b: f64) -> (f64, f64) {
    use std::f64::consts::FRAC_PI_4;
    let (r, angle) = if a == 0.0 && b == 0.0 {
        (0.0, 0.0)
    } else if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, FRAC_PI_4 * (2.0 - a / b))
    };
    (r * libm::cos(angle), r * libm::sin(angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_fill_the_disc_evenly() {
        let centre = Vec3::new(0.48, 0.6, 0.64);
        let disc = SunDisc::new(centre);
        let radius = Sun::ANGULAR_RADIUS_RAD as f32;
        let offsets: Vec<Vec3> = disc.points.iter().map(|p| p.sun - centre).collect();
        assert!(offsets.iter().all(|o| o.length() < radius * 1.001));
        // Half of the points lie within radius / sqrt 2; the mean is the centre.
        let inner = offsets
            .iter()
            .filter(|o| o.length() < radius * std::f32::consts::FRAC_1_SQRT_2)
            .count();
        assert!(
            (inner as f32 / offsets.len() as f32 - 0.5).abs() < 0.04,
            "{inner}"
        );
        let mean = offsets.iter().sum::<Vec3>() / offsets.len() as f32;
        assert!(mean.length() < 0.03 * radius);
    }

    #[test]
    fn nine_neighbours_see_nine_parts() {
        let disc = SunDisc::new(Vec3::Z);
        let mean = (0..9)
            .map(|k| disc.of_pixel((7 + k % 3, 4 + k / 3), 77).sun)
            .sum::<Vec3>()
            / 9.0;
        assert!((mean - Vec3::Z).length() < 0.3 * Sun::ANGULAR_RADIUS_RAD as f32);
    }
}
