//! What a pulse met, and what a model says about it.

use rand::Rng;

use crate::gaussian::unit;

/// What one pulse met: all that the models of this crate need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// True distance from the sensor to the surface, metres, at least 0.
    pub range_m: f64,
    /// Cosine of the angle between the beam and the surface normal, 1 (head-on) to 0 (grazing): what
    /// a ray caster has, and what the models need.
    pub incidence_cos: f64,
    /// Diffuse reflectance of the surface at the laser's wavelength, 0..1.
    pub reflectance: f64,
}

impl Observation {
    /// The same by the angle, radians, 0 (head-on) to π/2 (grazing).
    #[must_use]
    pub fn at_angle(range_m: f64, incidence_rad: f64, reflectance: f64) -> Self {
        Self {
            range_m,
            incidence_cos: libm::cos(incidence_rad).max(0.0),
            reflectance,
        }
    }
}

/// The systematic part of a range error. Any `Fn(&Observation) -> f64` is one.
pub trait MeanError {
    /// Expected measured range minus true range, metres: negative where the sensor measures short.
    fn mean_error_m(&self, o: &Observation) -> f64;
}

impl<F: Fn(&Observation) -> f64> MeanError for F {
    fn mean_error_m(&self, o: &Observation) -> f64 {
        self(o)
    }
}

/// The random part of a range error. Any `Fn(&Observation) -> f64` is one.
pub trait Sigma {
    /// Standard deviation of the measured range, metres, at least 0.
    fn sigma_m(&self, o: &Observation) -> f64;
}

impl<F: Fn(&Observation) -> f64> Sigma for F {
    fn sigma_m(&self, o: &Observation) -> f64 {
        self(o)
    }
}

/// Whether a pulse comes back at all. Any `Fn(&Observation) -> f64` is one.
pub trait Detection {
    /// The probability, 0..1, that the receiver reports this echo.
    fn probability(&self, o: &Observation) -> f64;

    /// Does this echo come back? Takes one 64-bit word from the generator, always.
    fn detects(&self, o: &Observation, rng: &mut (impl Rng + ?Sized)) -> bool
    where
        Self: Sized,
    {
        unit(rng) < self.probability(o)
    }
}

impl<F: Fn(&Observation) -> f64> Detection for F {
    fn probability(&self, o: &Observation) -> f64 {
        self(o)
    }
}
