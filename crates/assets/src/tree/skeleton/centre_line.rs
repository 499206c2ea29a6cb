//! The centre line of a stem.

use std::f64::consts::TAU;

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_seed::{Domain, Draw, Key};

use crate::tree::Species;

const STEM: Domain = Domain::new("assets.tree.stem");

/// The stem's centre line: a lean, a sweep at the base, a slow winding.
pub(super) struct CentreLine {
    lean: DVec2,
    sweep: DVec2,
    /// Height over which the basal sweep straightens.
    sweep_m: f64,
    /// Where it ends.
    top_m: f64,
    /// Amplitude vectors and phases of two windings of 0.7 and 2.3 turns.
    windings: [(DVec2, f64, f64); 2],
}

impl CentreLine {
    pub(super) fn new(species: &Species, top_m: f64, lean: DVec2, key: Key) -> Self {
        let mut rng = key.domain(STEM).rng();
        let mut heading = |length: f64| {
            let (sin, cos) = libm::sincos(rng.range_f64(0.0, TAU));
            DVec2::new(cos, sin) * length * rng.range_f64(0.2, 1.0)
        };
        let sweep = heading(libm::tan(species.stem.sweep_deg.to_radians()));
        let amplitude = species.stem.sinuosity * top_m;
        let windings = [(heading(amplitude), 0.7), (heading(0.4 * amplitude), 2.3)];
        Self {
            lean,
            sweep,
            sweep_m: 0.08 * top_m,
            top_m,
            windings: windings.map(|(a, turns)| (a, turns * TAU, rng.range_f64(0.0, TAU))),
        }
    }

    /// The centre at height z; straight down below the ground.
    pub(super) fn at(&self, z: f64) -> DVec3 {
        let x = (z / self.top_m).max(0.0);
        // The offset grows like tan(sweep) z at the foot, and a linear term brings it back to zero
        // at the top.
        let bend = |z: f64| 1.0 - libm::exp(-z.max(0.0) / self.sweep_m);
        let bow = self.sweep_m * (bend(z) - x * bend(self.top_m));
        let mut xy = self.lean * z.max(0.0) + self.sweep * bow;
        for &(amplitude, rate, phase) in &self.windings {
            // The windings are zero at the foot and at the top.
            xy += amplitude * (4.0 * x * (1.0 - x).max(0.0) * libm::sin(rate * x + phase));
        }
        xy.extend(z)
    }
}
