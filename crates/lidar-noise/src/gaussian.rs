//! The Gaussian range measurement, and spreads that depend on range alone.

use nemoral_scene::{EchoObservation, ParamError};
use rand::Rng;

use crate::deviates::{open_unit, quantile};
use crate::model::{Detection, MeanError, Sigma};

/// A range measured with a mean error and a spread that may both depend on the echo: the paper's
/// noise model, for any pair of functions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GaussianRange<M, S> {
    /// The systematic error.
    pub mean: M,
    /// The random error.
    pub sigma: S,
}

impl<M: MeanError, S: Sigma> GaussianRange<M, S> {
    /// One measurement of the range, metres, at least 0: true range + mean + σ · standard normal.
    ///
    /// Always takes one 64-bit word from the generator.
    pub fn measure(&self, o: &EchoObservation, rng: &mut (impl Rng + ?Sized)) -> f64 {
        let share = open_unit(rng);
        self.measured_m(o, self.mean.mean_error_m(o), share)
    }

    /// The measurement at a quantile: the range below which a share of all measurements with this
    /// mean error lies.
    fn measured_m(&self, o: &EchoObservation, mean_error_m: f64, share: f64) -> f64 {
        let error_m = mean_error_m + self.sigma.sigma_m(o) * quantile(share);
        (o.range_m + error_m).max(0.0)
    }

    /// Measures many echoes, each with its generator. Each step is done for all echoes before the
    /// next step, so that none waits for another.
    pub(crate) fn measure_each(
        &self,
        os: &[EchoObservation],
        rngs: impl Iterator<Item = impl Rng>,
        ranges_m: &mut [Option<f64>],
    ) {
        let rngs = rngs.take(os.len());
        let shares: Vec<f64> = rngs.map(|mut rng| open_unit(&mut rng)).collect();
        let means: Vec<f64> = os.iter().map(|o| self.mean.mean_error_m(o)).collect();
        let errors = os.iter().zip(shares).zip(means);
        for (range_m, ((o, share), mean_m)) in ranges_m.iter_mut().zip(errors) {
            *range_m = Some(self.measured_m(o, mean_m, share));
        }
    }
}

/// A receiver that misses echoes: any detection before any Gaussian measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DetectedRange<D, M, S> {
    /// Which echoes are seen.
    pub detection: D,
    /// How the range of a seen echo is measured.
    pub range: GaussianRange<M, S>,
}

impl<D: Detection, M: MeanError, S: Sigma> DetectedRange<D, M, S> {
    /// One measurement: the range in metres, at least 0, or `None` if the echo is not seen.
    ///
    /// Takes one 64-bit word from the generator, and another if the echo is seen.
    pub fn measure(&self, o: &EchoObservation, rng: &mut (impl Rng + ?Sized)) -> Option<f64> {
        (self.detection.detects(o, rng)).then(|| self.range.measure(o, rng))
    }
}

/// The absence of a systematic error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoMeanError;

impl MeanError for NoMeanError {
    fn mean_error_m(&self, _: &EchoObservation) -> f64 {
        0.0
    }
}

/// A constant spread: the paper's configurable sigma.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConstantSigma {
    sigma_m: f64,
}

impl ConstantSigma {
    /// A spread in metres, at least 0.
    ///
    /// # Errors
    /// If it is negative or not finite.
    pub fn new(sigma_m: f64) -> Result<Self, ParamError> {
        ParamError::check_at_least_zero("sigma_m", sigma_m)?;
        Ok(Self { sigma_m })
    }
}

impl Sigma for ConstantSigma {
    fn sigma_m(&self, _: &EchoObservation) -> f64 {
        self.sigma_m
    }
}

/// Parameters of [`LinearSigma`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSigmaParams {
    /// The least spread, metres, at least 0.
    pub min_m: f64,
    /// The line's spread at range 0, metres; it may be negative.
    pub base_m: f64,
    /// Growth per metre of range, at least 0.
    pub per_metre: f64,
}

impl LinearSigmaParams {
    /// Sick LMS1xx (libpointmatcher's `SimpleSensorNoise`).
    pub const SICK_LMS1XX: Self = Self {
        min_m: 0.012,
        base_m: 0.0008,
        per_metre: 0.0068,
    };
    /// Hokuyo UTM-30LX (libpointmatcher's `SimpleSensorNoise`).
    pub const HOKUYO_UTM30LX: Self = Self {
        min_m: 0.018,
        base_m: 0.0015,
        per_metre: 0.0006,
    };
}

/// `σ = max(min, base + per_metre · R)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSigma {
    params: LinearSigmaParams,
}

impl LinearSigma {
    /// The law with these parameters.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: LinearSigmaParams) -> Result<Self, ParamError> {
        ParamError::check_at_least_zero("min_m", params.min_m)?;
        ParamError::check(params.base_m.is_finite(), "base_m", params.base_m, "finite")?;
        ParamError::check_at_least_zero("per_metre", params.per_metre)?;
        Ok(Self { params })
    }
}

impl Sigma for LinearSigma {
    fn sigma_m(&self, o: &EchoObservation) -> f64 {
        let p = &self.params;
        (p.base_m + p.per_metre * o.range_m).max(p.min_m)
    }
}
