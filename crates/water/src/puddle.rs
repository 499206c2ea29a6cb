//! Puddles: hollows of a way, filled to their lowest rims.

use std::f64::consts::TAU;

use glam::DVec2;
use nemoral_scene::{Surface, SurfaceSample};
use nemoral_seed::{Draw, Key};

use crate::directions::all_around;

/// How far the water stays below the lowest place of its rim, metres.
const FREEBOARD_M: f64 = 0.012;
/// Shallower ones dry out, metres.
const SHALLOWEST_M: f64 = 0.022;
/// Places of the rim that are looked at.
const RIM: u32 = 40;

/// Where there may be a puddle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PuddleSite {
    /// Its middle on the map, metres.
    pub middle_m: DVec2,
    /// Unit vector along it, such as that of a rut.
    pub along: DVec2,
    /// Half its length and half its width, metres.
    pub half_m: [f64; 2],
    /// How deep its hollow is at most, metres.
    pub depth_m: f64,
    /// Its own key.
    pub key: Key,
}

/// A puddle.
#[derive(Clone, Debug, PartialEq)]
pub struct Puddle {
    site: PuddleSite,
    /// Amplitude and phase of the waves of its outline.
    waves: [(f64, f64); 4],
    level_m: f64,
}

impl Puddle {
    /// The puddle at a site of a ground; `None` if the ground is too steep to hold it.
    #[must_use]
    pub fn dig(site: PuddleSite, ground: &dyn Surface) -> Option<Self> {
        let mut rng = site.key.rng();
        let mut puddle = Self {
            site,
            waves: [0.12, 0.10, 0.07, 0.05].map(|most| {
                let amplitude = most * rng.range_f64(0.3, 1.0);
                (amplitude, rng.range_f64(0.0, TAU))
            }),
            level_m: f64::INFINITY,
        };
        let rims = [1.0, 1.12].into_iter().flat_map(|r| puddle.ring(r, RIM));
        let lowest = rims
            .map(|p| ground.height_m(p))
            .fold(f64::INFINITY, f64::min);
        puddle.level_m = lowest - FREEBOARD_M;
        let mut bottom = ground.sample(site.middle_m);
        puddle.carve(site.middle_m, &mut bottom);
        (puddle.level_m - bottom.height_m >= SHALLOWEST_M).then_some(puddle)
    }

    /// Its middle on the map, metres.
    #[must_use]
    pub fn middle_m(&self) -> DVec2 {
        self.site.middle_m
    }

    /// The level of its water, metres above the world's zero.
    #[must_use]
    pub fn level_m(&self) -> f64 {
        self.level_m
    }

    /// The greatest distance from its middle at which it changes the ground, metres.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        1.35 * self.site.half_m[0].max(self.site.half_m[1])
    }

    /// Places on a ring that is as wide as this many radii, counter-clockwise.
    pub fn ring(&self, radii: f64, count: u32) -> impl Iterator<Item = DVec2> + '_ {
        let PuddleSite {
            middle_m,
            along,
            half_m: [a, b],
            ..
        } = self.site;
        all_around(count).map(move |way| {
            let r = radii * self.outline(way).0;
            middle_m + along * (a * r * way.x) + along.perp() * (b * r * way.y)
        })
    }

    /// The radius of its outline in a direction, relative to the ellipse, and its derivative by the
    /// angle.
    fn outline(&self, way: DVec2) -> (f64, f64) {
        let angle = libm::atan2(way.y, way.x);
        let (mut radius, mut slope) = (1.0, 0.0);
        for (k, (amplitude, phase)) in [2.0, 3.0, 5.0, 7.0].into_iter().zip(self.waves) {
            let (sin, cos) = libm::sincos(k * angle + phase);
            radius += amplitude * cos;
            slope -= amplitude * k * sin;
        }
        (radius, slope)
    }

    /// Distance from the middle in radii, and its gradient.
    fn radii(&self, world_m: DVec2) -> (f64, DVec2) {
        let PuddleSite {
            middle_m,
            along,
            half_m: [a, b],
            ..
        } = self.site;
        let off = world_m - middle_m;
        let q = DVec2::new(off.dot(along) / a, off.dot(along.perp()) / b);
        let distance = q.length();
        if distance < 1e-9 {
            return (0.0, DVec2::ZERO);
        }
        let way = q / distance;
        let (radius, slope) = self.outline(way);
        let by_q = way / radius - way.perp() * (slope / (radius * radius));
        (
            distance / radius,
            along * (by_q.x / a) + along.perp() * (by_q.y / b),
        )
    }

    /// Takes its hollow from a sample of the ground: a smooth bowl, level at its border.
    pub fn carve(&self, world_m: DVec2, ground: &mut SurfaceSample) {
        if world_m.distance_squared(self.site.middle_m) >= self.reach_m() * self.reach_m() {
            return;
        }
        let (radii, gradient) = self.radii(world_m);
        let rest = 1.0 - radii * radii;
        if rest > 0.0 {
            ground.height_m -= self.site.depth_m * rest * rest;
            ground.gradient += gradient * (4.0 * self.site.depth_m * rest * radii);
        }
    }

    /// Signed distance from its border, metres, nearly: negative in its hollow.
    #[must_use]
    pub fn edge_m(&self, world_m: DVec2) -> f64 {
        let off = world_m.distance(self.site.middle_m);
        let (radii, _) = self.radii(world_m);
        if radii == 0.0 {
            -self.site.half_m[1]
        } else {
            (1.0 - 1.0 / radii) * off
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::FlatSurface;

    fn site(seed: u64) -> PuddleSite {
        PuddleSite {
            middle_m: DVec2::new(3.0, -1.0),
            along: DVec2::new(0.6, 0.8),
            half_m: [1.6, 0.4],
            depth_m: 0.08,
            key: Key::world(seed),
        }
    }

    #[test]
    fn its_water_is_inside_of_its_rim() {
        for seed in 0..40 {
            let slope = FlatSurface {
                height_m: 2.0,
                gradient: DVec2::new(0.012, -0.006),
            };
            let puddle = Puddle::dig(site(seed), &slope).expect("it is nearly level");
            for radii in [1.0, 1.05, 1.1] {
                for p in puddle.ring(radii, 200) {
                    let mut ground = slope.sample(p);
                    puddle.carve(p, &mut ground);
                    assert!(ground.height_m > puddle.level_m());
                    assert!(puddle.edge_m(p) > -1e-9);
                }
            }
        }
    }

    #[test]
    fn none_stays_on_a_slope() {
        let slope = FlatSurface {
            height_m: 2.0,
            gradient: DVec2::new(0.05, 0.07),
        };
        assert_eq!(Puddle::dig(site(1), &slope), None);
    }

    #[test]
    fn its_gradient_is_a_difference_quotient() {
        let flat = FlatSurface::default();
        let puddle = Puddle::dig(site(1), &flat).expect("level");
        let at = |p: DVec2| {
            let mut ground = flat.sample(p);
            puddle.carve(p, &mut ground);
            ground
        };
        for i in 0..400 {
            let p =
                puddle.middle_m() + DVec2::new(f64::from(i % 20), f64::from(i / 20)) * 0.2 - 2.0;
            let e = 1e-6;
            let slope =
                |way: DVec2| (at(p + way * e).height_m - at(p - way * e).height_m) / 2.0 / e;
            let measured = DVec2::new(slope(DVec2::X), slope(DVec2::Y));
            assert!(at(p).gradient.distance(measured) < 1e-5, "{p}");
        }
    }
}
