//! The three parts of a noise model: mean error, spread and detection.

use nemoral_scene::EchoObservation;
use rand::Rng;

use crate::deviates::unit;

/// The systematic part of a range error. Any `Fn(&EchoObservation) -> f64` is one.
pub trait MeanError {
    /// Expected measured range minus true range, metres: negative where the sensor measures short.
    fn mean_error_m(&self, o: &EchoObservation) -> f64;
}

impl<F: Fn(&EchoObservation) -> f64> MeanError for F {
    fn mean_error_m(&self, o: &EchoObservation) -> f64 {
        self(o)
    }
}

/// The random part of a range error. Any `Fn(&EchoObservation) -> f64` is one.
pub trait Sigma {
    /// Standard deviation of the measured range, metres, at least 0.
    fn sigma_m(&self, o: &EchoObservation) -> f64;
}

impl<F: Fn(&EchoObservation) -> f64> Sigma for F {
    fn sigma_m(&self, o: &EchoObservation) -> f64 {
        self(o)
    }
}

/// Whether an echo is seen at all. Any `Fn(&EchoObservation) -> f64` is one.
pub trait Detection {
    /// The probability, 0..1, that the receiver reports this echo.
    fn probability(&self, o: &EchoObservation) -> f64;

    /// Whether this echo is reported. Always takes one 64-bit word from the generator.
    fn detects(&self, o: &EchoObservation, rng: &mut (impl Rng + ?Sized)) -> bool
    where
        Self: Sized,
    {
        unit(rng) < self.probability(o)
    }
}

impl<F: Fn(&EchoObservation) -> f64> Detection for F {
    fn probability(&self, o: &EchoObservation) -> f64 {
        self(o)
    }
}
