//! Named noise models for configurations.

use nemoral_scene::{EchoObservation, ParamError};
use rand::Rng;

use crate::gaussian::{
    ConstantSigma, DetectedRange, GaussianRange, LinearSigma, LinearSigmaParams, NoMeanError,
};
use crate::laconte::{LaconteClosedForm, LaconteDevice, LaconteWaveform};
use crate::link_budget::{
    RangeEquation, RangeEquationParams, SnrSigma, SnrSigmaParams, SoftThreshold,
};
use crate::model::MeanError;
use crate::soudarissanane::{IncidenceLaw, IncidenceLawParams};

/// A noise model as plain data, so that a configuration can name it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RangeNoise {
    /// The true range; every echo is seen.
    Off,
    /// The paper's: a Gaussian whose mean is the error function of its three sources combined
    /// ([`CombinedMeanError`]), with a configurable sigma. Every echo is seen.
    Paper {
        /// Standard deviation, metres, at least 0.
        sigma_m: f64,
    },
    /// Laconte's bias of one device and a constant sigma. Every echo is seen.
    Laconte {
        /// The device.
        device: LaconteDevice,
        /// Whether the bias is that of the published waveform or of its closed form.
        form: LaconteForm,
        /// Standard deviation, metres, at least 0.
        sigma_m: f64,
    },
    /// Soudarissanane's law as its authors define it: a spread that grows as 1 / cos of the
    /// incidence. There is no bias, and every echo is seen.
    Incidence(IncidenceLawParams),
    /// A spread that grows with range alone. There is no bias, and every echo is seen.
    Linear(LinearSigmaParams),
    /// A spread by signal-to-noise ratio without bias, and a threshold of detection: the behaviour
    /// that Livox's data sheets describe.
    SignalToNoise {
        /// The row of the data sheet.
        range: RangeEquationParams,
        /// The spread.
        sigma: SnrSigmaParams,
        /// The probability of a false alarm per pulse of a receiver whose detection fades around
        /// the threshold ([`SoftThreshold`]), below 0.5; 0 for one that sees every echo above it
        /// and none below.
        false_alarm_probability: f64,
    },
}

/// How [`RangeNoise::Laconte`] computes the bias.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LaconteForm {
    /// [`LaconteWaveform`].
    #[default]
    Waveform,
    /// [`LaconteClosedForm`]: within 2 % of it for narrow beams, and several times as fast.
    Closed,
}

impl RangeNoise {
    /// Livox Mid-40 and Horizon, with a hard threshold.
    #[must_use]
    pub fn livox() -> Self {
        Self::SignalToNoise {
            range: RangeEquationParams::default(),
            sigma: SnrSigmaParams::default(),
            false_alarm_probability: 0.0,
        }
    }
}

impl Default for RangeNoise {
    /// [`RangeNoise::Paper`] with 2 cm, the range precision of the Livox Mid-40 and Horizon.
    fn default() -> Self {
        Self::Paper { sigma_m: 0.02 }
    }
}

/// The paper's error function: the sum of Laconte's bias and Soudarissanane's incidence law.
///
/// The paper combines functions from \[18\], \[19\] and \[20\] without printing the result; this
/// is the plain reading. Laconte's part is negative (too short at grazing incidence), the other
/// positive (weak echoes are late).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CombinedMeanError {
    bias: LaconteWaveform,
    law: IncidenceLaw,
}

impl Default for CombinedMeanError {
    /// The bias of the HDL-32E and the default incidence law.
    fn default() -> Self {
        Self {
            bias: LaconteDevice::VelodyneHdl32e.waveform(),
            law: IncidenceLaw::default(),
        }
    }
}

impl MeanError for CombinedMeanError {
    fn mean_error_m(&self, o: &EchoObservation) -> f64 {
        self.bias.mean_error_m(o) + self.law.mean_error_m(o)
    }
}

/// A [`RangeNoise`] whose parameters have been checked, ready to measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeNoiseSampler {
    model: Model,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Model {
    Off,
    Paper(GaussianRange<CombinedMeanError, ConstantSigma>),
    Laconte(GaussianRange<LaconteWaveform, ConstantSigma>),
    LaconteClosed(GaussianRange<LaconteClosedForm, ConstantSigma>),
    Incidence(GaussianRange<NoMeanError, IncidenceLaw>),
    Linear(GaussianRange<NoMeanError, LinearSigma>),
    SignalToNoise(DetectedRange<RangeEquation, NoMeanError, SnrSigma>),
    FadingSignal(DetectedRange<SoftThreshold, NoMeanError, SnrSigma>),
}

impl RangeNoiseSampler {
    /// The sampler of a noise model.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(noise: RangeNoise) -> Result<Self, ParamError> {
        let model = match noise {
            RangeNoise::Off => Model::Off,
            RangeNoise::Paper { sigma_m } => Model::Paper(GaussianRange {
                mean: CombinedMeanError::default(),
                sigma: ConstantSigma::new(sigma_m)?,
            }),
            RangeNoise::Laconte {
                device,
                form,
                sigma_m,
            } => {
                let sigma = ConstantSigma::new(sigma_m)?;
                match form {
                    LaconteForm::Waveform => Model::Laconte(GaussianRange {
                        mean: device.waveform(),
                        sigma,
                    }),
                    LaconteForm::Closed => Model::LaconteClosed(GaussianRange {
                        mean: device.closed_form(),
                        sigma,
                    }),
                }
            }
            RangeNoise::Incidence(params) => Model::Incidence(GaussianRange {
                mean: NoMeanError,
                sigma: IncidenceLaw::new(params)?,
            }),
            RangeNoise::Linear(params) => Model::Linear(GaussianRange {
                mean: NoMeanError,
                sigma: LinearSigma::new(params)?,
            }),
            RangeNoise::SignalToNoise {
                range,
                sigma,
                false_alarm_probability,
            } => {
                let equation = RangeEquation::new(range)?;
                let range = GaussianRange {
                    mean: NoMeanError,
                    sigma: SnrSigma::new(sigma, equation)?,
                };
                if false_alarm_probability == 0.0 {
                    let detection = equation;
                    Model::SignalToNoise(DetectedRange { detection, range })
                } else {
                    let detection = SoftThreshold::new(equation, false_alarm_probability)?;
                    Model::FadingSignal(DetectedRange { detection, range })
                }
            }
        };
        Ok(Self { model })
    }

    /// One measurement: the range in metres, at least 0, or `None` if the echo is not seen.
    pub fn measure(&self, o: &EchoObservation, rng: &mut (impl Rng + ?Sized)) -> Option<f64> {
        match &self.model {
            Model::Off => Some(o.range_m),
            Model::Paper(range) => Some(range.measure(o, rng)),
            Model::Laconte(range) => Some(range.measure(o, rng)),
            Model::LaconteClosed(range) => Some(range.measure(o, rng)),
            Model::Incidence(range) => Some(range.measure(o, rng)),
            Model::Linear(range) => Some(range.measure(o, rng)),
            Model::SignalToNoise(range) => range.measure(o, rng),
            Model::FadingSignal(range) => range.measure(o, rng),
        }
    }

    /// Measures many echoes, each with its generator. Each range is what [`measure`](Self::measure)
    /// returns, to the bit, in less time.
    pub fn measure_each(
        &self,
        os: &[EchoObservation],
        rngs: impl Iterator<Item = impl Rng>,
        ranges_m: &mut [Option<f64>],
    ) {
        match &self.model {
            Model::Paper(range) => range.measure_each(os, rngs, ranges_m),
            Model::Laconte(range) => range.measure_each(os, rngs, ranges_m),
            Model::LaconteClosed(range) => range.measure_each(os, rngs, ranges_m),
            Model::Incidence(range) => range.measure_each(os, rngs, ranges_m),
            Model::Linear(range) => range.measure_each(os, rngs, ranges_m),
            Model::Off | Model::SignalToNoise(_) | Model::FadingSignal(_) => {
                for ((o, mut rng), range_m) in os.iter().zip(rngs).zip(ranges_m) {
                    *range_m = self.measure(o, &mut rng);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand::rngs::Xoshiro256PlusPlus;

    #[test]
    fn value_stability() {
        let laconte = |form| RangeNoise::Laconte {
            device: LaconteDevice::SickLms1xx,
            form,
            sigma_m: 0.01,
        };
        let o = EchoObservation::at_angle(12.0, 1.0, 0.4);
        let got = [
            RangeNoise::Off,
            RangeNoise::default(),
            laconte(LaconteForm::Waveform),
            laconte(LaconteForm::Closed),
            RangeNoise::Incidence(IncidenceLawParams::default()),
            RangeNoise::Linear(LinearSigmaParams::HOKUYO_UTM30LX),
            RangeNoise::livox(),
        ]
        .map(|noise| {
            let rng = || Xoshiro256PlusPlus::seed_from_u64(7);
            let sampler = RangeNoiseSampler::new(noise).unwrap();
            let alone = sampler.measure(&o, &mut rng());
            let mut each = [None; 3];
            sampler.measure_each(&[o; 3], std::iter::repeat_with(rng), &mut each);
            assert_eq!(each, [alone; 3]);
            alone
        });
        assert_eq!(format!("{got:?}"), VALUES);
    }
    const VALUES: &str = "[Some(12.0), Some(11.96391482888432), Some(11.9755549739297), \
        Some(11.97556514660983), Some(11.996457624497248), Some(11.971290695214185), \
        Some(11.989829310629043)]";

    #[test]
    fn only_signal_to_noise_loses_echoes() {
        let far = EchoObservation {
            range_m: 91.0,
            incidence_cos: 1.0,
            reflectance: 0.1,
        };
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        for (noise, seen) in [
            (RangeNoise::Off, true),
            (RangeNoise::default(), true),
            (RangeNoise::livox(), false),
        ] {
            let range_m = RangeNoiseSampler::new(noise)
                .unwrap()
                .measure(&far, &mut rng);
            assert_eq!(range_m.is_some(), seen, "{noise:?}");
        }
    }

    /// A model whose detection fades.
    fn fading(false_alarm_probability: f64) -> RangeNoise {
        RangeNoise::SignalToNoise {
            range: RangeEquationParams::default(),
            sigma: SnrSigmaParams::default(),
            false_alarm_probability,
        }
    }

    /// Of a target of 10 %, nine tenths are seen at 68 m, half at 90 m and a tenth at 131 m. The
    /// ranges of those that a hard threshold sees, too, are the same to the bit.
    #[test]
    fn detection_fades_with_range() {
        let soft = RangeNoiseSampler::new(fading(1e-4)).unwrap();
        let hard = RangeNoiseSampler::new(RangeNoise::livox()).unwrap();
        let n = 20_000;
        for (range_m, share) in [(30.0, 1.0), (68.0, 0.9), (90.0, 0.5), (131.0, 0.1)] {
            let o = EchoObservation {
                range_m,
                incidence_cos: 1.0,
                reflectance: 0.1,
            };
            let rng = Xoshiro256PlusPlus::seed_from_u64;
            let mut seen = 0;
            for seed in 0..n {
                let (a, b) = (
                    soft.measure(&o, &mut rng(seed)),
                    hard.measure(&o, &mut rng(seed)),
                );
                assert!(a.is_none() || b.is_none() || a == b);
                seen += u32::from(a.is_some());
            }
            let found = f64::from(seen) / n as f64;
            assert!((found - share).abs() < 0.016, "{range_m}: {found}");
        }
    }

    #[test]
    fn bad_parameters_are_refused_by_name() {
        let error = RangeNoiseSampler::new(RangeNoise::Paper { sigma_m: -0.5 }).unwrap_err();
        assert_eq!(
            error.to_string(),
            "sigma_m = -0.5: must be finite and at least 0"
        );
        assert!(RangeNoiseSampler::new(RangeNoise::Paper { sigma_m: f64::NAN }).is_err());
        for bad in [-1e-4, 0.5, f64::NAN] {
            let error = RangeNoiseSampler::new(fading(bad)).unwrap_err();
            assert_eq!(error.field, "false_alarm_probability");
        }
    }
}
