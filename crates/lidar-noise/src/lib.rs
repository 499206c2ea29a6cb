//! This crate models the range errors of LiDARs: bias by distance and incidence, spread by signal
//! strength, and echoes too weak to be seen. It needs neither scenes nor rays nor scanners.
//!
//! ```
//! use nemoral_lidar_noise::{ConstantSigma, GaussianRange, LaconteDevice, EchoObservation};
//! use rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
//!
//! let sensor = GaussianRange {
//!     mean: LaconteDevice::SickLms1xx.waveform(),
//!     sigma: ConstantSigma::new(0.01)?,
//! };
//! let grazing = EchoObservation::at_angle(10.0, 1.4, 0.5);
//! let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
//! let n = 1000;
//! let mean_m = (0..n).map(|_| sensor.measure(&grazing, &mut rng)).sum::<f64>() / f64::from(n);
//! assert!((mean_m - 9.92).abs() < 0.01, "8 cm too short: {mean_m}");
//! # Ok::<(), nemoral_lidar_noise::ParamError>(())
//! ```
//!
//! # Model
//! A measured range is `R + mean_error(R, α, ρ) + sigma(R, α, ρ) · N(0, 1)`: the paper's Gaussian,
//! whose mean is a device's error function. The two functions are separate traits, because its
//! sources are of two kinds: Laconte et al. measure a *bias* ([`LaconteWaveform`]), Soudarissanane
//! et al. a *spread* ([`IncidenceLaw`], which can be both here). [`SnrSigma`] and [`RangeEquation`]
//! add what data sheets give: spread and greatest range by reflectance, around which detection
//! fades by [`SoftThreshold`]. [`DetectedRange`] puts any detection before any measurement. Errors
//! of pointing are left to the scanner, which knows the directions. [`RangeNoise`] names whole
//! models for configurations, and [`RangeNoiseSampler`] measures with them.
//!
//! An echo is described by a [`EchoObservation`]: its range in metres, the cosine of the angle of
//! incidence, and the surface's reflectance, 0..1. Transcendental functions go through libm and the
//! normal deviate is a quantile (Wichura's), so equal generators give equal ranges on every
//! platform.

mod deviates;
mod gaussian;
mod laconte;
mod link_budget;
mod model;
mod range_noise;
mod soudarissanane;

pub use gaussian::{
    ConstantSigma, DetectedRange, GaussianRange, LinearSigma, LinearSigmaParams, NoMeanError,
};
pub use laconte::{LaconteClosedForm, LaconteDevice, LaconteWaveform};
pub use link_budget::{
    RangeEquation, RangeEquationParams, SnrSigma, SnrSigmaParams, SoftThreshold,
};
pub use model::{Detection, MeanError, Sigma};
pub use nemoral_scene::{EchoObservation, ParamError};
pub use range_noise::{CombinedMeanError, LaconteForm, RangeNoise, RangeNoiseSampler};
pub use soudarissanane::{IncidenceLaw, IncidenceLawParams};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
