//! The streak of a particle in the picture.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::{Vec2, Vec3};
use nemoral_scene::Hydrometeor;

use crate::light::lamp::droplet_phase;

/// The light of its surroundings that a drop lets through (Garg and Nayar 2007), and that a flake
/// scatters.
pub(super) const DROP_ALBEDO: f32 = 0.94;
pub(super) const FLAKE_ALBEDO: f32 = 0.9;

/// The way of a particle in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Streak {
    pub(super) from_px: Vec2,
    pub(super) to_px: Vec2,
    /// From its middle line to where it ends, pixels.
    pub(super) reach_px: f32,
    /// The width of its soft edge, which ends there, pixels: at most that reach.
    pub(super) soft_px: f32,
    /// The area of the particle, which its streak covers on average, square pixels.
    pub(super) area_px2: f32,
    pub(super) depth_m: f32,
    pub(super) of: Hydrometeor,
    /// Where it is in the scene.
    pub(super) place_m: Vec3,
}

impl Streak {
    /// Its radiance over the mean radiance of its surroundings.
    pub(super) fn albedo(&self) -> f32 {
        match self.of {
            Hydrometeor::Raindrop => DROP_ALBEDO,
            Hydrometeor::Snowflake => FLAKE_ALBEDO,
        }
    }

    /// Its radiance over a lamp's irradiance, 1/sr, where the light turns by an angle of this
    /// cosine. Drops scatter by the phase function of droplets, and flakes as matt balls
    /// (Lambert's law over the part of a ball that is lit and seen). Nothing shades them.
    pub(super) fn glow(&self, cos: f32) -> f32 {
        match self.of {
            Hydrometeor::Raindrop => droplet_phase(cos),
            Hydrometeor::Snowflake => {
                let cos = cos.clamp(-1.0, 1.0);
                let (turn, sin) = (libm::acosf(cos), (1.0 - cos * cos).max(0.0).sqrt());
                FLAKE_ALBEDO * (2.0 / 3.0) * (sin - turn * cos) * (FRAC_1_PI * FRAC_1_PI)
            }
        }
    }

    /// The share of a pixel that it covers on average, by the distance from its middle line: a
    /// plateau with a soft edge, whose volume over the picture is what it covers. Its height is at
    /// most 1, since it is at least as wide as the particle.
    fn coverage(&self, at: Vec2) -> f32 {
        let way = self.to_px - self.from_px;
        let along = (at - self.from_px).dot(way) / way.length_squared().max(1e-12);
        let nearest = self.from_px + way * along.clamp(0.0, 1.0);
        let (r, s) = (self.reach_px, self.soft_px);
        let height = ((r - at.distance(nearest)) / s).clamp(0.0, 1.0);
        // Along the way, and at its two ends.
        let volume = (2.0 * r - s) * way.length() + PI * (r * r - r * s + s * s / 3.0);
        self.area_px2 * height / volume
    }

    pub(super) fn draw(&self, pixels: &mut [Vec3], depth_m: &[f32], width: usize, radiance: Vec3) {
        let height = pixels.len() / width;
        let low = self.from_px.min(self.to_px) - self.reach_px;
        let high = self.from_px.max(self.to_px) + self.reach_px;
        let range = |low: f32, high: f32, n: usize| {
            (low.floor().max(0.0) as usize)..(high.ceil().max(0.0) as usize).min(n)
        };
        let way = self.to_px - self.from_px;
        for y in range(low.y, high.y, height) {
            // Only the part of the way that is near this row, as a long slanting one would visit
            // all pixels of its rectangle.
            let shares = if way.y.abs() > 1.0 {
                [-self.reach_px, self.reach_px].map(|reach_px| {
                    let share = (y as f32 + 0.5 + reach_px - self.from_px.y) / way.y;
                    share.clamp(0.0, 1.0)
                })
            } else {
                [0.0, 1.0]
            };
            let [a, b] = shares.map(|share| self.from_px.x + share * way.x);
            let (low, high) = (a.min(b) - self.reach_px, a.max(b) + self.reach_px);
            for x in range(low, high, width) {
                let i = y * width + x;
                if depth_m[i] > 0.0 && depth_m[i] < self.depth_m {
                    continue;
                }
                let share = self.coverage(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                pixels[i] = pixels[i].lerp(radiance, share);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_streak_covers_as_much_as_its_particle() {
        for (to, reach_px, soft_px, area_px2) in [
            ((60.0, 60.0), 3.0, 3.0, 2.5),
            ((71.5, 90.25), 2.0, 2.0, 2.5),
            ((60.0, 110.0), 8.0, 5.0, 2.5),
            ((140.0, 20.0), 1.5, 1.5, 2.5),
            ((20.0, 60.5), 2.0, 1.0, 2.5),
            // A flake of 10 mm at 0.25 m, 30.4 pixels wide, out of focus, in 0.1 ms and in 4 ms.
            ((60.0, 60.3), 18.4, 6.4, 725.8),
            ((60.0, 72.2), 18.4, 6.4, 725.8),
        ] {
            let streak = Streak {
                from_px: Vec2::new(60.0, 60.0),
                to_px: Vec2::from(to),
                reach_px,
                soft_px,
                area_px2,
                depth_m: 1.0,
                of: Hydrometeor::Snowflake,
                place_m: Vec3::ZERO,
            };
            let mut pixels = vec![Vec3::ZERO; 160 * 160];
            streak.draw(&mut pixels, &vec![0.0; 160 * 160], 160, Vec3::ONE);
            let sum: f32 = pixels.iter().map(|p| p.x).sum();
            assert!((sum / area_px2 - 1.0).abs() < 0.03, "{sum} for {area_px2}");
            assert!(pixels.iter().all(|p| p.x <= 1.0));
        }
    }

    /// A matt ball reflects all that falls on it, its albedo, over all directions.
    #[test]
    fn what_a_lamp_shines_on_scatters_its_light() {
        for (of, share) in [
            (Hydrometeor::Raindrop, 1.0),
            (Hydrometeor::Snowflake, FLAKE_ALBEDO),
        ] {
            let streak = Streak {
                from_px: Vec2::ZERO,
                to_px: Vec2::ONE,
                reach_px: 1.0,
                soft_px: 1.0,
                area_px2: 1.0,
                depth_m: 1.0,
                of,
                place_m: Vec3::ZERO,
            };
            let n = 100_000;
            let cos = |i: i32| (i as f32 + 0.5) / n as f32 * 2.0 - 1.0;
            let sum: f64 = (0..n).map(|i| f64::from(streak.glow(cos(i)))).sum();
            // Radiance times the area that is seen, over all directions.
            let whole = sum * 2.0 / f64::from(n) * std::f64::consts::TAU;
            assert!((whole - f64::from(share)).abs() < 2e-3, "{of:?}: {whole}");
        }
    }
}
