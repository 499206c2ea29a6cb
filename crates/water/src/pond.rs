//! Ponds: bowls in hollows, filled to below their rims.

use std::f64::consts::TAU;

use glam::DVec2;
use nemoral_scene::Dual;
use nemoral_seed::{Draw, Key};

use crate::ways::GroundWithWays;

/// How far the water stays below the lowest place of the rim, metres.
const FREEBOARD_M: f64 = 0.22;
/// The rim that is guaranteed around the water, metres above it.
const RIM_M: f64 = 0.16;
/// Where the rim is, in radii of the outline.
const RIM: f64 = 1.12;
/// A pond changes the ground within this many radii.
pub(crate) const REACH: f64 = 1.9;
/// The least radius of a pond, metres.
pub(crate) const LEAST_RADIUS_M: f64 = 1.8;
/// No bank is cut deeper than this, metres.
const DEEPEST_M: f64 = 2.2;
/// The water's edge is this near to a way at the nearest, metres.
const VERGE_M: f64 = 2.0;

/// A pond.
#[derive(Clone, Debug, PartialEq)]
pub struct Pond {
    pub(crate) middle_m: DVec2,
    radius_m: f64,
    /// Amplitude and phase of the waves of its outline: 2, 3, 4 and 5 around.
    waves: [(f64, f64); 4],
    pub(crate) level_m: f64,
    depth_m: f64,
}

impl Pond {
    /// The pond in a hollow, as large as ways around leave room for; `None` if that is too small,
    /// or if its banks would be too high.
    pub(crate) fn dig(
        middle_m: DVec2,
        largest_m: f64,
        ways: &dyn GroundWithWays,
        key: Key,
    ) -> Option<Self> {
        let mut rng = key.rng();
        let size = rng.range_f64(0.5, 1.0);
        let mut pond = Self {
            middle_m,
            radius_m: largest_m * size,
            waves: [0.16, 0.10, 0.06, 0.04].map(|most| {
                let amplitude = most * rng.range_f64(0.4, 1.0);
                (amplitude, rng.range_f64(0.0, TAU))
            }),
            level_m: 0.0,
            depth_m: 0.0,
        };
        while !pond.has_room(ways) {
            pond.radius_m *= 0.75;
            if pond.radius_m < LEAST_RADIUS_M {
                return None;
            }
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for ring in [1.02, RIM, 1.25] {
            for place in pond.ring(ring, 48) {
                let height = ways.ground(place).height_m;
                (low, high) = (low.min(height), high.max(height));
            }
        }
        pond.level_m = low - FREEBOARD_M;
        pond.depth_m = (0.16 * pond.radius_m).clamp(0.35, 1.1);
        (high - low < DEEPEST_M).then_some(pond)
    }

    fn has_room(&self, ways: &dyn GroundWithWays) -> bool {
        let rings = [0.0, 0.5, 1.0, 1.35];
        rings.iter().all(|&ring| {
            self.ring(ring, 32)
                .all(|place| ways.edge_m(place) > VERGE_M && !ways.is_dry(place))
        })
    }

    /// Places on a ring that is as wide as this many radii.
    fn ring(&self, radii: f64, count: u32) -> impl Iterator<Item = DVec2> + '_ {
        (0..count).map(move |i| {
            let (sin, cos) = libm::sincos(TAU * f64::from(i) / f64::from(count));
            let way = DVec2::new(cos, sin);
            self.middle_m + way * (radii * self.outline(way).0)
        })
    }

    /// The radius of its outline in a direction, metres, and its derivative by the angle.
    fn outline(&self, way: DVec2) -> (f64, f64) {
        let angle = libm::atan2(way.y, way.x);
        let (mut radius, mut slope) = (1.0, 0.0);
        for (k, (amplitude, phase)) in (2_u32..).zip(self.waves) {
            let k = f64::from(k);
            let (sin, cos) = libm::sincos(k * angle + phase);
            radius += amplitude * cos;
            slope -= amplitude * k * sin;
        }
        (self.radius_m * radius, self.radius_m * slope)
    }

    /// The level of its water, metres above the world's zero.
    #[must_use]
    pub fn level_m(&self) -> f64 {
        self.level_m
    }

    /// Its middle on the map.
    #[must_use]
    pub fn middle_m(&self) -> DVec2 {
        self.middle_m
    }

    /// The greatest distance of its water from its middle, metres.
    #[must_use]
    pub fn widest_m(&self) -> f64 {
        let waves: f64 = self.waves.iter().map(|w| w.0).sum();
        self.radius_m * (1.0 + waves)
    }

    /// The greatest distance from its middle at which it changes the ground, metres.
    pub(crate) fn reach_m(&self) -> f64 {
        self.radius_m * 1.36 * REACH
    }

    /// Distance from the middle over the radius of the outline there.
    fn radii(&self, world_m: DVec2) -> Dual {
        let off = world_m - self.middle_m;
        let distance = off.length();
        if distance < 1e-9 {
            return Dual::constant(0.0);
        }
        let way = off / distance;
        let (radius, slope) = self.outline(way);
        let gradient = way / radius - way.perp() * (slope / (radius * radius));
        Dual::new(distance / radius, gradient)
    }

    /// Signed distance from the water's edge, metres, nearly; negative in the pond.
    #[must_use]
    pub fn edge_m(&self, world_m: DVec2) -> f64 {
        let radii = self.radii(world_m).value;
        if radii == 0.0 {
            return -self.radius_m;
        }
        (1.0 - 1.0 / radii) * world_m.distance(self.middle_m)
    }

    /// The heights down to which the ground is cut, and up to which it is filled, at a place.
    pub(crate) fn cut_and_fill(&self, world_m: DVec2) -> Option<(Dual, Dual)> {
        let radii = self.radii(world_m);
        let beyond = (radii.value - 1.0) / (REACH - 1.0);
        if beyond >= 1.0 {
            return None;
        }
        let r = radii.value;
        let bowl = self.depth_m * (r * r - 1.0);
        let steep = 2.0 * self.depth_m * r;
        let cut = radii.chain(without_bound((bowl, steep), (r - 1.0, REACH - 1.0)));
        let x = r - RIM;
        let fall = 0.45 * self.radius_m;
        let fill = if x <= 0.0 {
            Dual::constant(RIM_M)
        } else {
            let (drop, slope) = without_bound((fall * x * x, 2.0 * fall * x), (x, REACH - RIM));
            radii.chain((RIM_M - drop, -slope))
        };
        let level = Dual::constant(self.level_m);
        Some((cut + level, fill + level))
    }

    /// The border of its surface, inside of the bank, and rings within, from the middle out.
    pub(crate) fn rings(&self) -> (Vec<f64>, u32) {
        let count = (TAU * self.radius_m / 0.6).ceil().clamp(24.0, 128.0);
        let rings = (self.radius_m / 1.5).ceil().max(2.0) as u32;
        let of = |i: u32| SURFACE * f64::from(i) / f64::from(rings);
        ((1..=rings).map(of).collect(), count as u32)
    }

    /// The places on a ring of the surface.
    pub(crate) fn surface_ring(&self, radii: f64, count: u32) -> Vec<DVec2> {
        self.ring(radii, count).collect()
    }
}

/// How far the surface reaches, in radii: into the bank, below the rim.
const SURFACE: f64 = 1.07;

/// A function of x, by its value and derivative, that rises without bound towards `reach`, but is
/// as it was for x below 0.
pub(crate) fn without_bound((value, slope): (f64, f64), (x, reach): (f64, f64)) -> (f64, f64) {
    if x <= 0.0 {
        return (value, slope);
    }
    let t = (x / reach).min(1.0 - 1e-6);
    let rest = 1.0 - t * t;
    (
        value / rest,
        slope / rest + value * 2.0 * t / (reach * rest * rest),
    )
}
