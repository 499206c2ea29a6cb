//! Terraces: ground that rises in steps.

use std::f64::consts::TAU;

use glam::DVec2;
use nemoral_scene::SurfaceSample;
use nemoral_seed::{Domain, Key};

use crate::ReliefParams;
use crate::gradient_noise::SIGMA;
use crate::octave::Octave;

const PLACES: Domain = Domain::new("terrain.terraces.places");
const DIP: Domain = Domain::new("terrain.terraces.dip");

/// Wavelength of where terraces are, in multiples of the terrain's scale.
const PLACES_SCALE: f64 = 1.7;
/// Wavelength of how their levels dip, likewise, and by how many steps.
const DIP_SCALE: f64 = 1.2;
const DIP_STEPS: f64 = 0.45;

/// Steps in a terrain's height, as hard beds of rock leave them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Terraces {
    share: f64,
    cliffs: f64,
    step_m: f64,
    max_height_m: f64,
    places: Octave,
    dip: Octave,
}

impl Terraces {
    pub(crate) fn new(
        relief: &ReliefParams,
        (scale_m, max_height_m): (f64, f64),
        key: Key,
    ) -> Self {
        let octave = |domain, scale: f64, factor: f64| {
            Octave::new(
                key.domain(domain),
                1.0 / (scale * scale_m),
                factor / SIGMA,
                0.0,
            )
        };
        Self {
            share: relief.terraces,
            cliffs: relief.cliffs,
            step_m: relief.terrace_step_m,
            max_height_m,
            places: octave(PLACES, PLACES_SCALE, 2.0),
            dip: octave(DIP, DIP_SCALE, DIP_STEPS),
        }
    }

    /// The terraced ground at a world point where the ground was `sample`.
    pub(crate) fn apply(&self, world_m: DVec2, sample: SurfaceSample) -> SurfaceSample {
        let SurfaceSample { height_m, gradient } = sample;
        let (x, slope) = self.places.sample(world_m);
        let root = libm::sqrt(1.0 + x * x);
        let here = 0.5 * self.share * (1.0 + x / root);
        let here_gradient = 0.5 * self.share / (root * root * root) * slope;
        // Towards the lowest and highest ground they fade, so that heights stay in range.
        let max = self.max_height_m;
        let fade = 4.0 * height_m * (max - height_m) / (max * max);
        let fade_rate = 4.0 * (max - 2.0 * height_m) / (max * max);
        let (dip, dip_gradient) = self.dip.sample(world_m);
        let (off, off_rate) = step(height_m / self.step_m + dip, self.cliffs);
        let by_step = self.step_m * off_rate * fade * here;
        SurfaceSample {
            height_m: height_m + self.step_m * off * fade * here,
            gradient: gradient * (1.0 + by_step / self.step_m)
                + by_step * dip_gradient
                + self.step_m * off * (fade_rate * here * gradient + fade * here_gradient),
        }
    }
}

/// How far a staircase of unit steps is above the line of its middles, and the derivative. Its
/// treads are level, and its risers have a slope of 4, or of 8 where `cliffs` is 1.
fn step(at: f64, cliffs: f64) -> (f64, f64) {
    // u − sin(2πu)/2π climbs with a slope of 2 between level places; twice, of 4; thrice, of 8.
    let climb = |u: f64| u - libm::sin(TAU * u) / TAU;
    let rate = |u: f64| 1.0 - libm::cos(TAU * u);
    let t = at - libm::floor(at);
    let once = climb(t);
    let twice = climb(once);
    let thrice = climb(twice);
    let twice_rate = rate(once) * rate(t);
    let thrice_rate = rate(twice) * twice_rate;
    (
        twice + cliffs * (thrice - twice) - t,
        twice_rate + cliffs * (thrice_rate - twice_rate) - 1.0,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stairs_climb_and_have_treads() {
        for (cliffs, steepest) in [(0.0, 4.0), (0.5, 6.0), (1.0, 8.0)] {
            let at = |u: f64| u + step(u, cliffs).0;
            let mut before = at(-2.0);
            for i in -199..200 {
                let u = f64::from(i) / 100.0;
                let here = at(u);
                assert!(here >= before - 1e-12, "{u}");
                // The range that terraces stay in depends on this bound.
                assert!(step(u, cliffs).0.abs() < 0.5, "{u}");
                let quotient = (at(u + 1e-5) - at(u - 1e-5)) / 2e-5 - 1.0;
                assert!((step(u, cliffs).1 - quotient).abs() < 1e-5, "{u}");
                before = here;
            }
            assert_eq!(at(1.0), 1.0);
            assert!((at(0.1) - at(-0.1)).abs() < 1e-4);
            assert!((step(0.5, cliffs).1 + 1.0 - steepest).abs() < 1e-12);
        }
    }
}
