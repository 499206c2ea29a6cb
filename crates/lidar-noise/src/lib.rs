//! This crate models the range errors of LiDARs: bias by distance and incidence, spread by signal
//! strength, and echoes too weak to be seen. It knows nothing of scenes, rays or scanners.
//!
//! ```
//! use nemoral_lidar_noise::{ConstantSigma, GaussianRange, LaconteDevice, Observation};
//! use rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
//!
//! let sensor = GaussianRange {
//!     mean: LaconteDevice::SickLms1xx.waveform(),
//!     sigma: ConstantSigma::new(0.01)?,
//! };
//! let grazing = Observation::at_angle(10.0, 1.4, 0.5);
//! let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
//! let n = 1000;
//! let mean_m = (0..n).map(|_| sensor.measure(&grazing, &mut rng)).sum::<f64>() / f64::from(n);
//! assert!((mean_m - 9.92).abs() < 0.01, "8 cm too short: {mean_m}");
//! # Ok::<(), nemoral_lidar_noise::ParamError>(())
//! ```
//!
//! # Model
//! A measured range is `R + mean_error(R, α, ρ) + sigma(R, α, ρ) · N(0, 1)`: the paper's Gaussian
//! whose mean is a device's error function. The two functions are separate traits, because its
//! sources are of two kinds: Laconte et al. measure a *bias* ([`LaconteWaveform`]), Soudarissanane
//! et al. a *spread* ([`IncidenceLaw`], which is both here). [`SnrSigma`] and [`RangeEquation`] add
//! what data sheets say: spread and greatest range by reflectance. [`DetectedRange`] puts any detection
//! before any measurement; errors of pointing are the scanner's, who knows directions. [`RangeNoise`]
//! names whole models for configurations, [`RangeSensor`] measures with them.
//!
//! Metres, cosines of incidence, reflectance 0..1. Transcendental functions go through libm and the
//! normal deviate is a quantile (Wichura's), so equal generators give equal ranges on every platform.

mod error;
mod gaussian;
mod laconte;
mod link;
mod observation;
mod preset;
mod soudarissanane;

pub use error::ParamError;
pub use gaussian::{
    ConstantSigma, DetectedRange, GaussianRange, LinearSigma, LinearSigmaParams, NoMeanError,
};
pub use laconte::{LaconteClosedForm, LaconteDevice, LaconteWaveform};
pub use link::{RangeEquation, RangeEquationParams, SnrSigma, SnrSigmaParams, SoftThreshold};
pub use observation::{Detection, MeanError, Observation, Sigma};
pub use preset::{LaconteForm, PaperMeanError, RangeNoise, RangeSensor};
pub use soudarissanane::{IncidenceLaw, IncidenceLawParams};
