//! The space a crown fills.

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_seed::{Draw, Key, Stage};

use super::{CrownForm, TreeSize};

const ASYMMETRY: Stage = Stage::new("assets.tree.asymmetry");

/// The outline of one tree's crown around its leaning axis.
#[derive(Clone, Debug)]
pub(super) struct Envelope {
    base_m: f64,
    top_m: f64,
    radius_m: f64,
    form: CrownForm,
    /// Amplitude and phase of the first three harmonics of the radius over azimuth.
    harmonics: [[f64; 2]; 3],
    /// Horizontal way of the crown's axis per metre of height.
    lean: DVec2,
}

impl Envelope {
    /// An envelope for wood: foliage reaches `margin_m` beyond it.
    pub(super) fn new(
        size: &TreeSize,
        form: CrownForm,
        margin_m: f64,
        lean: DVec2,
        key: Key,
    ) -> Self {
        let mut rng = key.stage(ASYMMETRY).rng();
        let harmonics = std::array::from_fn(|k| {
            let amplitude = form.asymmetry * rng.normal().clamp(-2.0, 2.0) / (k + 1) as f64;
            [amplitude, rng.range_f64(0.0, std::f64::consts::TAU)]
        });
        Self {
            base_m: size.crown_base_m,
            top_m: (size.height_m - margin_m).max(0.5 * (size.height_m + size.crown_base_m)),
            radius_m: (size.crown_radius_m - margin_m).max(0.5 * size.crown_radius_m),
            form,
            harmonics,
            lean,
        }
    }

    /// Radius at relative height `t` of the crown, as a share of the greatest, 0..=1.
    fn profile(&self, t: f64) -> f64 {
        let f = &self.form;
        let arc = |s: f64, p: f64| libm::pow(1.0 - libm::pow(s.clamp(0.0, 1.0), p), 1.0 / p);
        if t < f.widest_at {
            f.base + (1.0 - f.base) * arc((f.widest_at - t) / f.widest_at, f.lower_power)
        } else {
            arc((t - f.widest_at) / (1.0 - f.widest_at), f.upper_power)
        }
    }

    /// Is the point in the crown's space? The space goes on below the crown's base as wide as there.
    fn contains(&self, p: DVec3) -> bool {
        if p.z >= self.top_m {
            return false;
        }
        let t = ((p.z - self.base_m) / (self.top_m - self.base_m)).max(0.0);
        let from_axis = p.truncate() - self.lean * p.z;
        let azimuth = libm::atan2(from_axis.y, from_axis.x);
        let wobble: f64 = self
            .harmonics
            .iter()
            .zip(1..)
            .map(|(&[a, phase], k)| a * libm::cos(f64::from(k) * azimuth + phase))
            .sum();
        from_axis.length() <= self.radius_m * self.profile(t) * (1.0 + wobble).max(0.3)
    }

    /// How far it is from `p` along `direction` to the outline, within a fiftieth of the radius; 0 outside.
    pub(super) fn reach(&self, p: DVec3, direction: DVec3) -> f64 {
        let step = 0.02 * self.radius_m;
        let most = self.top_m + 2.0 * self.radius_m;
        let mut s = 0.0;
        while s < most && self.contains(p + direction * (s + step)) {
            s += step;
        }
        s
    }
}
