//! What leaves look like in their season.

use nemoral_scene::ParamError;
use serde::Deserialize;

use super::{LATE_DAYS, Phenology, PhenologyState, logistic, settled};
use crate::tree::look::LeafLook;
use crate::tree::ranges::Ranges;

/// The spectra of a leaf at some time of the year, as in [`LeafLook`].
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeafSpectra {
    /// Linear RGB reflectance, 0..=0.7.
    pub albedo: [f64; 3],
    /// Linear RGB transmittance, 0..=0.7.
    pub transmittance: [f64; 3],
    /// Reflectance and transmittance at 905 nm.
    pub nm905: [f64; 2],
    /// Reflectance and transmittance at 1550 nm.
    pub nm1550: [f64; 2],
}

/// Leaves that have just unfolded, and leaves that begin to turn, of all species (PROSPECT-D).
const YOUNG: LeafSpectra = LeafSpectra {
    albedo: [0.117, 0.154, 0.032],
    transmittance: [0.141, 0.175, 0.0],
    nm905: [0.45, 0.52],
    nm1550: [0.26, 0.37],
};
const TURNING: LeafSpectra = LeafSpectra {
    albedo: [0.208, 0.185, 0.029],
    transmittance: [0.168, 0.138, 0.0],
    nm905: [0.49, 0.45],
    nm1550: [0.32, 0.33],
};
/// Dead leaves that have hung through the winter.
const WINTERED: LeafSpectra = LeafSpectra {
    albedo: [0.17, 0.102, 0.074],
    transmittance: [0.077, 0.03, 0.013],
    nm905: [0.5, 0.34],
    nm1550: [0.47, 0.37],
};

/// Standard deviation of the days on which the leaves of one tree turn (our choice).
const LEAF_SD_DAYS: f64 = 5.0;
/// The scale of the curve by which one leaf turns, days.
const TURNING_DAYS: f64 = 4.0;
/// A leaf withers so many days after it has turned.
const WITHERING_AFTER_DAYS: f64 = 13.0;

impl LeafSpectra {
    /// The leaves of summer.
    fn of(look: &LeafLook) -> Self {
        Self {
            albedo: look.reflectance().to_array().map(f64::from),
            transmittance: look.transmittance,
            nm905: look.nm905,
            nm1550: look.nm1550,
        }
    }

    /// On the way to other spectra, by a share within 0..=1.
    fn towards(self, to: &Self, share: f64) -> Self {
        let share = share.clamp(0.0, 1.0);
        let mix = |a: f64, b: f64| a + (b - a) * share;
        fn each<const N: usize>(
            a: [f64; N],
            b: [f64; N],
            mix: impl Fn(f64, f64) -> f64,
        ) -> [f64; N] {
            std::array::from_fn(|i| mix(a[i], b[i]))
        }
        Self {
            albedo: each(self.albedo, to.albedo, mix),
            transmittance: each(self.transmittance, to.transmittance, mix),
            nm905: each(self.nm905, to.nm905, mix),
            nm1550: each(self.nm1550, to.nm1550, mix),
        }
    }

    pub(super) fn check(&self, r: &Ranges<'_>, name: &str) -> Result<(), ParamError> {
        let field = |part: &str| format!("{name}.{part}");
        r.each(&field("albedo"), &self.albedo, 0.0, 0.7)?;
        for (reflected, passed) in self.albedo.into_iter().zip(self.transmittance) {
            r.one(
                &field("transmittance"),
                passed,
                0.0,
                (0.99 - reflected).min(0.7),
            )?;
        }
        for (band, [reflected, passed]) in [("nm905", self.nm905), ("nm1550", self.nm1550)] {
            r.one(&field(band), reflected, 0.0, 1.0)?;
            r.one(&field(band), passed, 0.0, 1.0 - reflected)?;
        }
        Ok(())
    }
}

impl Phenology {
    /// A leaf of those that look like `own` in summer, which is `deviation` standard deviations
    /// later than most leaves of its tree.
    fn leaf(&self, own: &LeafLook, phase: &PhenologyState, deviation: f64) -> LeafSpectra {
        let days = phase.turned_days - LEAF_SD_DAYS * deviation;
        let turned = 2.0 * settled(logistic(days / TURNING_DAYS));
        LeafSpectra::of(own)
            .towards(&YOUNG, phase.young)
            .towards(&TURNING, turned.min(1.0))
            .towards(&self.turned, turned - 1.0)
            .towards(&self.withered, withered(days))
            .towards(&WINTERED, (phase.turned_days - 25.0) / (LATE_DAYS - 25.0))
    }
}

/// The share by which a leaf has withered so many days after it turned.
fn withered(days: f64) -> f64 {
    settled(logistic((days - WITHERING_AFTER_DAYS) / TURNING_DAYS))
}

/// The leaves of one kind of tree in their season: what its images are drawn by.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SeasonalLeaves {
    phase: PhenologyState,
    phenology: Phenology,
    /// The leaves of summer.
    own: LeafLook,
    silhouette_factor: f64,
}

/// What the season makes of one leaf of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SeasonalLeaf {
    /// Its length and width over those of a grown leaf.
    pub(crate) size: f32,
    /// How far it has rolled in from its sides, 0..=1.
    pub(crate) withered: f32,
    /// Linear RGB reflectance, as in a shoot.
    pub(crate) albedo: [f64; 3],
}

impl SeasonalLeaves {
    /// Leaves that hang on a shoot of this silhouette factor, 1 for single leaves.
    pub(crate) const fn new(
        own: LeafLook,
        phenology: Phenology,
        phase: PhenologyState,
        silhouette_factor: f64,
    ) -> Self {
        Self {
            phase,
            phenology,
            own,
            silhouette_factor,
        }
    }

    /// The same leaves with no others around them.
    pub(crate) fn alone(self) -> Self {
        Self {
            silhouette_factor: 1.0,
            ..self
        }
    }

    /// A leaf with a draw that decides when it falls, 0..1, and one that decides when it turns,
    /// standard normal; `None` if it has fallen or not come. What has fallen on one day has fallen
    /// on all that follow, until spring.
    pub(crate) fn leaf(&self, falls: f64, deviation: f64) -> Option<SeasonalLeaf> {
        let phase = &self.phase;
        if falls >= phase.kept || phase.grown == 0.0 {
            return None;
        }
        let spectra = self.phenology.leaf(&self.own, phase, deviation);
        let days = phase.turned_days - LEAF_SD_DAYS * deviation;
        Some(SeasonalLeaf {
            size: libm::sqrt(phase.grown) as f32,
            withered: withered(days) as f32,
            albedo: self.look_of(&spectra).albedo,
        })
    }

    /// The mean of its leaves, as in a shoot: reflectance and transmittance.
    pub(crate) fn mean_look(&self) -> LeafLook {
        // The nine tenths' quantiles of a standard normal distribution.
        const QUANTILES: [f64; 9] = [
            -1.593, -0.967, -0.589, -0.282, 0.0, 0.282, 0.589, 0.967, 1.593,
        ];
        let leaves = QUANTILES.map(|z| self.phenology.leaf(&self.own, &self.phase, z));
        let mut mean = leaves[0];
        for (i, leaf) in leaves.iter().enumerate().skip(1) {
            mean = mean.towards(leaf, 1.0 / (i + 1) as f64);
        }
        self.look_of(&mean)
    }

    fn look_of(&self, spectra: &LeafSpectra) -> LeafLook {
        LeafLook {
            albedo: spectra.albedo,
            glaucous: 0.0,
            transmittance: spectra.transmittance,
            nm905: spectra.nm905,
            nm1550: spectra.nm1550,
            ..self.own
        }
        .in_shoot(self.silhouette_factor)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::tree::phenology::tests::{at, deciduous};

    #[test]
    fn leaves_turn_from_green_to_yellow_or_brown_and_dry() {
        let green = |rgb: [f64; 3]| rgb[1] / rgb.iter().sum::<f64>();
        for (species, p) in deciduous() {
            let mean = |day| {
                let phase = p.phase(&at(day), 0.0, false);
                SeasonalLeaves::new(species.leaves.clone(), p, phase, 1.0).mean_look()
            };
            let (summer, peak) = (mean(200.0), mean(p.peak_colour[1] + 6.0));
            assert!(green(summer.albedo) > 0.5, "{}", species.name);
            assert!(green(peak.albedo) < 0.4, "{} {peak:?}", species.name);
            let ratio = |look: &LeafLook| look.nm1550[0] / look.nm905[0];
            let dry = ratio(&mean(p.half_fallen[1] + 20.0));
            assert!(dry > ratio(&summer) && dry < 1.0, "{}: {dry}", species.name);
        }
    }

    proptest! {
        /// No leaf scatters more light than it gets, and what has fallen stays fallen.
        #[test]
        fn leaves_are_possible_and_stay_fallen(
            day in 150_u32..365,
            late in -10.0..10.0,
            falls in 0.0..1.0,
            deviation in -3.0..3.0,
        ) {
            for (species, p) in deciduous() {
                let leaf = |day: u32| {
                    let phase = p.phase(&at(f64::from(day)), late, false);
                    let leaves = SeasonalLeaves::new(species.leaves.clone(), p, phase, 1.0);
                    leaves.leaf(falls, deviation)
                };
                prop_assert!(leaf(day).is_some() || leaf(day + 1).is_none());
                let phase = p.phase(&at(f64::from(day)), late, false);
                let spectra = p.leaf(&species.leaves, &phase, deviation);
                for (r, t) in spectra.albedo.into_iter().zip(spectra.transmittance) {
                    prop_assert!(r >= 0.0 && t >= 0.0 && r + t < 1.0);
                }
                for [r, t] in [spectra.nm905, spectra.nm1550] {
                    prop_assert!(r + t <= 1.0);
                }
            }
        }
    }
}
