//! How wet, sunny and deep the ground of a chunk is: known on a lattice, and smooth between.

use std::sync::OnceLock;

use nemoral_scene::Surface;
use nemoral_scene::glam::DVec2;
use nemoral_stand::{GroundConditions, Hemisphere};

use crate::config;

/// Side of the lattice's cells, metres; conditions change over larger distances.
const CELL_M: f64 = 5.0;
/// How far from water the ground is moister, metres, and how much of what it lacks the nearest
/// ground has.
const BANK_M: f64 = 4.0;
const BANK_WETNESS: f64 = 0.8;
/// How much drier the sunniest slopes are.
const SUN_DRIES: f64 = 0.7;

/// How strongly the conditions of a place steer what covers it.
#[derive(Clone, Debug)]
pub(crate) struct ConditionEffects {
    pub(crate) of: config::GroundEffects,
    /// By which the sun stands in the south or in the north.
    pub(crate) hemisphere: Hemisphere,
}

impl ConditionEffects {
    fn is_any(&self) -> bool {
        self.of.wetness > 0.0 || self.of.heat_load > 0.0 || self.of.soil > 0.0
    }

    /// The conditions at a place whose ground has these, `bank_m` from water, as far as they
    /// matter.
    fn applied(&self, here: GroundConditions, bank_m: f64) -> GroundConditions {
        let of = &self.of;
        let heat_load = (of.heat_load * here.heat_load).clamp(-1.0, 1.0);
        let is_wetted = of.wetness.min(1.0);
        let wetness = of.wetness * here.wetness - SUN_DRIES * is_wetted * heat_load;
        let wetness = wetness.clamp(-1.0, 1.0);
        let by_water = (1.0 - bank_m / BANK_M).clamp(0.0, 1.0) * BANK_WETNESS;
        let usual_m = GroundConditions::NEUTRAL.soil_m;
        GroundConditions {
            wetness: wetness + (1.0 - wetness) * by_water * is_wetted,
            heat_load,
            soil_m: (usual_m + of.soil * (here.soil_m - usual_m)).max(0.0),
        }
    }
}

/// The conditions in and around a square, from the ground without trails, beds and pits.
#[derive(Debug)]
pub(crate) struct Conditions {
    effects: ConditionEffects,
    /// The lattice's first corner and its corners along each side.
    first: [i64; 2],
    side: usize,
    /// Filled when it is first asked for: most chunks are never looked at so closely.
    corners: OnceLock<Vec<GroundConditions>>,
}

impl Conditions {
    pub(crate) fn new(effects: &ConditionEffects, (low_m, high_m): (DVec2, DVec2)) -> Self {
        let first = (low_m / CELL_M).floor();
        let last = (high_m / CELL_M).floor() + 1.0;
        Self {
            effects: effects.clone(),
            first: [first.x as i64, first.y as i64],
            side: (last - first).max_element() as usize + 1,
            corners: OnceLock::new(),
        }
    }

    /// The conditions at a world position, `bank_m` from water.
    ///
    /// Corners belong to the plane, so that two chunks agree on their border; places beyond the
    /// square are computed by themselves.
    pub(crate) fn at(&self, base: &dyn Surface, world_m: DVec2, bank_m: f64) -> GroundConditions {
        if !self.effects.is_any() {
            return GroundConditions::NEUTRAL;
        }
        let place = world_m / CELL_M;
        let cell = place.floor();
        let t = place - cell;
        let [x, y] = [cell.x as i64, cell.y as i64];
        let weights = [
            (1.0 - t.x) * (1.0 - t.y),
            t.x * (1.0 - t.y),
            (1.0 - t.x) * t.y,
            t.x * t.y,
        ];
        let around = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
        let around = around.map(|corner| self.corner(base, corner));
        self.effects
            .applied(GroundConditions::mean(around, weights), bank_m)
    }

    /// Whether the ground there is bare mud, if it is this wet: `wave`, −1..=1, makes its border
    /// ragged. It is asked for near that border alone.
    pub(crate) fn is_mud(&self, wetness: f64, wave: impl FnOnce() -> f64) -> bool {
        const RAGGED: f64 = 0.12;
        let mud = self.effects.of.mud;
        let border = 1.0 - 0.35 * mud;
        // A little more than the wave can bring, so that rounding does not matter.
        let is_near = wetness + 1.01 * RAGGED > border;
        mud > 0.0 && is_near && wetness + RAGGED * wave() > border
    }

    /// How many more puddles a place has than others.
    pub(crate) fn puddles(effects: &ConditionEffects, base: &dyn Surface, world_m: DVec2) -> f64 {
        if !effects.is_any() {
            return 1.0;
        }
        let here = GroundConditions::at(base, world_m, effects.hemisphere);
        1.0 + 0.8 * effects.applied(here, f64::INFINITY).wetness
    }

    fn corner(&self, base: &dyn Surface, (x, y): (i64, i64)) -> GroundConditions {
        let of = |x: i64, y: i64| {
            let place_m = DVec2::new(x as f64, y as f64) * CELL_M;
            GroundConditions::at(base, place_m, self.effects.hemisphere)
        };
        let [i, j] = [x - self.first[0], y - self.first[1]];
        let side = self.side as i64;
        if !(0..side).contains(&i) || !(0..side).contains(&j) {
            return of(x, y);
        }
        let corners = self.corners.get_or_init(|| {
            (0..side * side)
                .map(|k| of(self.first[0] + k % side, self.first[1] + k / side))
                .collect()
        });
        corners[(j * side + i) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_seed::Key;
    use nemoral_terrain::{NoiseTerrain, TerrainParams};

    fn effects(change: impl Fn(&mut config::GroundEffects)) -> ConditionEffects {
        let mut of = config::GroundEffects::default();
        change(&mut of);
        in_the_north(of)
    }

    fn in_the_north(of: config::GroundEffects) -> ConditionEffects {
        ConditionEffects {
            of,
            hemisphere: Hemisphere::Northern,
        }
    }

    fn square(x: f64, y: f64) -> (DVec2, DVec2) {
        (DVec2::new(x, y), DVec2::new(x, y) + 50.0)
    }

    #[test]
    fn neighbours_agree_and_there_are_no_jumps() {
        let base = NoiseTerrain::new(TerrainParams::default(), Key::world(2)).expect("valid");
        let effects = effects(|_| {});
        let west = Conditions::new(&effects, square(-50.0, 0.0));
        let east = Conditions::new(&effects, square(0.0, 0.0));
        let mut before: Option<GroundConditions> = None;
        for i in 0..5000 {
            let p = DVec2::new(0.0, f64::from(i) * 0.01);
            let [a, b] = [&west, &east].map(|c| c.at(&base, p, f64::INFINITY));
            assert_eq!(a, b);
            if let Some(before) = before {
                assert!((a.wetness - before.wetness).abs() < 0.02);
                assert!((a.soil_m - before.soil_m).abs() < 0.02);
            }
            before = Some(a);
        }
    }

    #[test]
    fn wet_places_are_in_hollows_and_by_water() {
        let base = NoiseTerrain::new(TerrainParams::default(), Key::world(4)).expect("valid");
        let effects = effects(|_| {});
        let mut found: Vec<(f64, f64)> = Vec::new();
        for i in 0..40 * 40 {
            let p = DVec2::new(f64::from(i % 40), f64::from(i / 40)) * 9.0;
            let here = Conditions::new(&effects, (p, p)).at(&base, p, f64::INFINITY);
            let ways = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];
            let around: f64 = ways.iter().map(|w| base.height_m(p + 15.0 * w)).sum();
            found.push((here.wetness, around / 4.0 - base.height_m(p)));
            let by_water = Conditions::new(&effects, (p, p)).at(&base, p, 0.5);
            assert!(by_water.wetness >= here.wetness && by_water.wetness > 0.3);
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mean = |of: &[(f64, f64)]| of.iter().map(|f| f.1).sum::<f64>() / of.len() as f64;
        let (dry, wet) = (mean(&found[..400]), mean(&found[1200..]));
        assert!(wet > 0.3 && dry < -0.3, "{wet} {dry}");
        // Most of the ground is neither.
        let median = found[800].0;
        assert!(median.abs() < 0.35, "{median}");
    }

    /// On a slope to the south-west, as it is north and south of the equator.
    #[test]
    fn the_sun_of_the_hemisphere_dries_slopes() {
        let slope = nemoral_scene::FlatSurface {
            height_m: 0.0,
            gradient: DVec2::splat(0.3),
        };
        let at = |hemisphere| {
            let effects = ConditionEffects {
                hemisphere,
                ..effects(|_| {})
            };
            let p = DVec2::new(7.0, 9.0);
            Conditions::new(&effects, square(0.0, 0.0)).at(&slope, p, f64::INFINITY)
        };
        let [north, south] = [Hemisphere::Northern, Hemisphere::Southern].map(at);
        assert!(north.heat_load > 0.3 && south.heat_load.abs() < 1e-9);
        assert!(north.wetness < south.wetness - 0.1);
    }

    #[test]
    fn nothing_steers_without_being_asked_for() {
        let base = NoiseTerrain::new(TerrainParams::default(), Key::world(4)).expect("valid");
        let none = in_the_north(config::GroundEffects::none());
        let here = Conditions::new(&none, square(0.0, 0.0));
        let found = here.at(&base, DVec2::new(3.0, 4.0), 0.1);
        assert_eq!(found, GroundConditions::NEUTRAL);
        assert!(!here.is_mud(1.0, || 1.0));
        assert_eq!(Conditions::puddles(&none, &base, DVec2::ZERO), 1.0);
    }
}
