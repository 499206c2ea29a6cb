//! The space a crown fills.

use std::f64::consts::TAU;

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_seed::{Domain, Draw, Key};

use super::edge::CrownBase;
use super::{CrownForm, TreeSize};

const ASYMMETRY: Domain = Domain::new("assets.tree.asymmetry");

/// The least distance of branches from the ground, metres.
const CLEARANCE_M: f64 = 0.15;

/// Entries of the tables of the outline.
const CELLS: usize = 64;

/// The outline of one tree's crown around its leaning axis.
#[derive(Clone, Debug)]
pub(super) struct Envelope {
    base_m: f64,
    top_m: f64,
    /// Greatest radius.
    radius_m: f64,
    /// Radius over relative height, as a share of the greatest: 0 is the base, the last entry the
    /// top.
    profile: [f64; CELLS + 1],
    /// Radius over azimuth, relative to the mean, for one turn.
    sides: [f64; CELLS + 1],
    /// Horizontal offset of the crown's axis per metre of height.
    lean: DVec2,
}

impl Envelope {
    /// An envelope for wood: foliage reaches `margin_m` beyond it.
    pub(super) fn new(
        (size, base): (&TreeSize, &CrownBase),
        form: CrownForm,
        margin_m: f64,
        lean: DVec2,
        key: Key,
    ) -> Self {
        let form = base.form(form);
        let mut rng = key.domain(ASYMMETRY).rng();
        let harmonics: [[f64; 3]; 3] = std::array::from_fn(|k| {
            let order = (k + 1) as f64;
            let amplitude = form.asymmetry * rng.normal().clamp(-2.0, 2.0) / order;
            [order, amplitude, rng.range_f64(0.0, TAU)]
        });
        let side = |azimuth: f64| {
            let wobble: f64 = harmonics
                .iter()
                .map(|&[k, a, phase]| a * libm::cos(k * azimuth + phase))
                .sum();
            (1.0 + wobble + base.aside(libm::cos(azimuth))).max(0.3)
        };
        Self {
            base_m: size.crown_base_m,
            top_m: (size.height_m - margin_m).max(0.5 * (size.height_m + size.crown_base_m)),
            radius_m: (size.crown_radius_m - margin_m).max(0.5 * size.crown_radius_m),
            profile: std::array::from_fn(|i| form.radius(i as f64 / CELLS as f64)),
            sides: std::array::from_fn(|i| side(TAU * i as f64 / CELLS as f64)),
            lean,
        }
    }

    /// Whether the point is in the crown's space. Below the crown's base the space goes on with the
    /// same width, down to just above the ground.
    pub(super) fn contains(&self, p: DVec3) -> bool {
        if p.z < CLEARANCE_M {
            return false;
        }
        let t = ((p.z - self.base_m) / (self.top_m - self.base_m)).max(0.0);
        let from_axis = p.truncate() - self.lean * p.z;
        // Most points can be decided without the azimuth.
        t < 1.0 && from_axis.length() <= 2.0 * self.radius_m && {
            let turn = libm::atan2(from_axis.y, from_axis.x) / TAU;
            let side = look_up(&self.sides, turn - turn.floor());
            from_axis.length() <= self.radius_m * look_up(&self.profile, t) * side
        }
    }

    /// The distance from `p` along `direction` to the outline, to a twentieth of the radius; 0
    /// outside.
    pub(super) fn reach(&self, p: DVec3, direction: DVec3) -> f64 {
        let step = 0.05 * self.radius_m;
        let most = self.top_m + 2.0 * self.radius_m;
        let mut s = 0.0;
        while s < most && self.contains(p + direction * (s + step)) {
            s += step;
        }
        s
    }
}

impl CrownForm {
    /// Interpolates between two forms: `young` where `maturity` is 0, `self` where it is 1.
    pub(super) fn grown_from(self, young: Self, maturity: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * maturity;
        Self {
            widest_at: mix(young.widest_at, self.widest_at),
            base: mix(young.base, self.base),
            lower_power: mix(young.lower_power, self.lower_power),
            upper_power: mix(young.upper_power, self.upper_power),
            asymmetry: mix(young.asymmetry, self.asymmetry),
        }
    }

    /// Radius at relative height `t` of the crown, as a share of the greatest, 0..=1.
    fn radius(&self, t: f64) -> f64 {
        let arc = |s: f64, p: f64| libm::pow(1.0 - libm::pow(s.clamp(0.0, 1.0), p), 1.0 / p);
        if t < self.widest_at {
            self.base
                + (1.0 - self.base) * arc((self.widest_at - t) / self.widest_at, self.lower_power)
        } else {
            arc(
                (t - self.widest_at) / (1.0 - self.widest_at),
                self.upper_power,
            )
        }
    }
}

/// Interpolates between the entries of a table, `t` in 0..=1.
fn look_up(table: &[f64; CELLS + 1], t: f64) -> f64 {
    let x = t * CELLS as f64;
    let i = (x as usize).min(CELLS - 1);
    table[i] + (table[i + 1] - table[i]) * (x - i as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::Species;

    #[test]
    fn profiles_meet_at_the_widest_point_and_close_at_the_top() {
        for species in Species::all() {
            let f = species.crown;
            assert!((f.radius(0.0) - f.base).abs() < 1e-9);
            assert!((f.radius(f.widest_at) - 1.0).abs() < 1e-9);
            assert!((f.radius(f.widest_at - 1e-9) - 1.0).abs() < 1e-6);
            assert!(f.radius(1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn reach_ends_at_the_outline() {
        let species = Species::english_oak();
        let key = Key::world(7);
        let size = species.draw_size(0.4, key);
        let base = CrownBase::new(&size, None);
        let envelope = Envelope::new((&size, &base), species.crown, 0.2, DVec2::ZERO, key);
        let from = DVec3::new(0.0, 0.0, 0.6 * size.height_m);
        for i in 0..16 {
            let (sin, cos) = libm::sincos(TAU * f64::from(i) / 16.0);
            let direction = DVec3::new(cos, sin, 0.0);
            let reach = envelope.reach(from, direction);
            assert!(envelope.contains(from + direction * reach));
            assert!(!envelope.contains(from + direction * (reach + 0.06 * size.crown_radius_m)));
        }
        assert_eq!(envelope.reach(DVec3::new(0.0, 0.0, 99.0), DVec3::Z), 0.0);
    }
}
