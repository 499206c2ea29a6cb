//! A Gaussian range measurement, and the plain spreads.

use rand::Rng;

use crate::error::{at_least_zero, check};
use crate::{MeanError, Observation, ParamError, Sigma};

/// A range measured with a mean error and a spread that may both depend on what was met: the
/// paper's noise model, for any pair of functions.
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
    /// Takes two 64-bit words from the generator, always.
    pub fn measure(&self, o: &Observation, rng: &mut (impl Rng + ?Sized)) -> f64 {
        let error_m = self.mean.mean_error_m(o) + self.sigma.sigma_m(o) * standard_normal(rng);
        (o.range_m + error_m).max(0.0)
    }
}

/// No systematic error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoMeanError;

impl MeanError for NoMeanError {
    fn mean_error_m(&self, _: &Observation) -> f64 {
        0.0
    }
}

/// The same spread everywhere: the paper's configurable sigma.
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
        at_least_zero("sigma_m", sigma_m)?;
        Ok(Self { sigma_m })
    }
}

impl Sigma for ConstantSigma {
    fn sigma_m(&self, _: &Observation) -> f64 {
        self.sigma_m
    }
}

/// Parameters of [`LinearSigma`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSigmaParams {
    /// The least spread, metres, at least 0.
    pub min_m: f64,
    /// Spread at range 0 of the line, metres; may be negative.
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
        at_least_zero("min_m", params.min_m)?;
        check(params.base_m.is_finite(), "base_m", params.base_m, "finite")?;
        at_least_zero("per_metre", params.per_metre)?;
        Ok(Self { params })
    }
}

impl Sigma for LinearSigma {
    fn sigma_m(&self, o: &Observation) -> f64 {
        let p = &self.params;
        (p.base_m + p.per_metre * o.range_m).max(p.min_m)
    }
}

/// Standard normal (Box and Muller 1958, the cosine branch), through libm: the same bits on every
/// platform.
fn standard_normal(rng: &mut (impl Rng + ?Sized)) -> f64 {
    let u = 1.0 - unit(rng);
    let v = unit(rng);
    (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
}

/// Uniform in `[0, 1)`, 53 bits.
pub(crate) fn unit(rng: &mut (impl Rng + ?Sized)) -> f64 {
    (rng.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}
