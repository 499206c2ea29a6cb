//! The link budget: how strong an echo is by the laser range equation, and whether it is seen.

use nemoral_scene::{EchoObservation, ParamError};

use crate::model::{Detection, Sigma};

/// Parameters of [`RangeEquation`]: one row of a data sheet, "range at reflectance".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeEquationParams {
    /// The farthest range at which the reference target is seen, metres, greater than 0.
    pub reference_range_m: f64,
    /// The diffuse reflectance of the reference target, greater than 0, at most 1.
    pub reference_reflectance: f64,
    /// Extinction of the air, per metre, at least 0: about 1e-4 in clear air, 3 / visibility in
    /// fog.
    pub extinction_per_m: f64,
}

impl Default for RangeEquationParams {
    /// Livox Mid-40 and Horizon: 90 m at 10 % in full sunlight, in clear air.
    fn default() -> Self {
        Self {
            reference_range_m: 90.0,
            reference_reflectance: 0.1,
            extinction_per_m: 0.0,
        }
    }
}

/// The range equation of a Lambertian surface that is wider than the beam.
///
/// Power is `P = ρ cos α e^(−2κR) / R²`; the signal-to-noise ratio is `P / P_min`, where `P_min` is
/// the power of the reference target at its range. With 90 m at 10 % this gives 127 m at 20 % and
/// 255 m at 80 %; Livox states 130 m and 260 m.
///
/// As a [`Detection`] it is a hard threshold: seen if and only if the ratio is at least 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeEquation {
    extinction_per_m: f64,
    power_min: f64,
}

impl RangeEquation {
    /// The range equation with these parameters.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: RangeEquationParams) -> Result<Self, ParamError> {
        ParamError::check_positive("reference_range_m", params.reference_range_m)?;
        ParamError::check(
            params.reference_reflectance > 0.0 && params.reference_reflectance <= 1.0,
            "reference_reflectance",
            params.reference_reflectance,
            "greater than 0 and at most 1",
        )?;
        ParamError::check_at_least_zero("extinction_per_m", params.extinction_per_m)?;
        let reference = EchoObservation {
            range_m: params.reference_range_m,
            incidence_cos: 1.0,
            reflectance: params.reference_reflectance,
        };
        Ok(Self {
            extinction_per_m: params.extinction_per_m,
            // Data sheets are measured in clear air, so the weather's extinction reduces the range.
            power_min: power(0.0, &reference),
        })
    }

    /// Received power over the weakest that is seen; at least 0, infinite at range 0.
    #[must_use]
    pub fn signal_to_noise(&self, o: &EchoObservation) -> f64 {
        power(self.extinction_per_m, o) / self.power_min
    }
}

impl Default for RangeEquation {
    fn default() -> Self {
        Self::new(RangeEquationParams::default()).expect("the default parameters are in range")
    }
}

fn power(extinction_per_m: f64, o: &EchoObservation) -> f64 {
    let sent_back = o.reflectance * o.incidence_cos.max(0.0);
    if sent_back <= 0.0 {
        return 0.0; // at range 0 too
    }
    sent_back * libm::exp(-2.0 * extinction_per_m * o.range_m) / (o.range_m * o.range_m)
}

impl Detection for RangeEquation {
    fn probability(&self, o: &EchoObservation) -> f64 {
        if self.signal_to_noise(o) >= 1.0 {
            1.0
        } else {
            0.0
        }
    }
}

/// Detection that fades around the threshold: `½ erfc(√(−ln P_fa) − √(SNR + ½))`.
///
/// The usual approximation of a receiver in Gaussian noise with a given probability of false alarm
/// (Skolnik, "Introduction to Radar Systems"). Its noise unit is chosen so that an echo at
/// [`RangeEquation`]'s threshold is seen with probability one half: the two agree on the range. An
/// echo without power is never seen, as false alarms are not its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftThreshold {
    range_equation: RangeEquation,
    /// `−ln P_fa`.
    threshold: f64,
}

impl SoftThreshold {
    /// Detection at a probability of false alarm per pulse, between 0 and 0.5 (both excluded);
    /// Livox states less than 1e-4.
    ///
    /// # Errors
    /// If the probability is out of its range.
    pub fn new(
        range_equation: RangeEquation,
        false_alarm_probability: f64,
    ) -> Result<Self, ParamError> {
        ParamError::check(
            false_alarm_probability > 0.0 && false_alarm_probability < 0.5,
            "false_alarm_probability",
            false_alarm_probability,
            "greater than 0 and below 0.5",
        )?;
        Ok(Self {
            range_equation,
            threshold: -libm::log(false_alarm_probability),
        })
    }
}

impl Detection for SoftThreshold {
    fn probability(&self, o: &EchoObservation) -> f64 {
        let signal_to_noise = self.range_equation.signal_to_noise(o);
        if signal_to_noise <= 0.0 {
            return 0.0;
        }
        // erfc(0) = 1 where SNR + ½ = −ln P_fa, which is the threshold's own ratio in noise units.
        let in_noise_units = signal_to_noise * (self.threshold - 0.5);
        let margin = self.threshold.sqrt() - (in_noise_units + 0.5).sqrt();
        0.5 * libm::erfc(margin)
    }
}

/// Parameters of [`SnrSigma`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SnrSigmaParams {
    /// Spread of the strongest echoes (clock, electronics), metres, at least 0.
    pub floor_m: f64,
    /// Spread that noise adds to an echo at the threshold of detection, metres, at least 0.
    pub at_threshold_m: f64,
}

impl Default for SnrSigmaParams {
    /// Livox: 2.1 cm at 20 m and 10 %, 1.0 cm at 20 m and 80 %; the data sheets say "2 cm at 20 m".
    /// 0.09 m is also LISA's range resolution.
    fn default() -> Self {
        Self {
            floor_m: 0.007,
            at_threshold_m: 0.09,
        }
    }
}

/// `σ = √(floor² + k² / SNR)`: strong echoes are timed more precisely.
///
/// The `1/√SNR` law is that of LISA (Kilic et al. 2021) and fits the rows that Livox and Ouster
/// publish. An echo below the threshold of detection has no range; its spread is taken as that at
/// the threshold, so the value is always finite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SnrSigma {
    params: SnrSigmaParams,
    range_equation: RangeEquation,
}

impl SnrSigma {
    /// The law with these parameters.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: SnrSigmaParams, range_equation: RangeEquation) -> Result<Self, ParamError> {
        ParamError::check_at_least_zero("floor_m", params.floor_m)?;
        ParamError::check_at_least_zero("at_threshold_m", params.at_threshold_m)?;
        Ok(Self {
            params,
            range_equation,
        })
    }
}

impl Sigma for SnrSigma {
    fn sigma_m(&self, o: &EchoObservation) -> f64 {
        let SnrSigmaParams {
            floor_m,
            at_threshold_m,
        } = self.params;
        let snr = self.range_equation.signal_to_noise(o).max(1.0);
        (floor_m * floor_m + at_threshold_m * at_threshold_m / snr).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(range_m: f64, reflectance: f64) -> EchoObservation {
        EchoObservation {
            range_m,
            incidence_cos: 1.0,
            reflectance,
        }
    }

    #[test]
    fn the_range_ladder_of_the_data_sheet() {
        let receiver = RangeEquation::default();
        for (reflectance, range_m) in [(0.1, 90.0), (0.2, 127.279), (0.8, 254.558)] {
            assert_eq!(receiver.probability(&at(range_m - 0.01, reflectance)), 1.0);
            assert_eq!(receiver.probability(&at(range_m + 0.01, reflectance)), 0.0);
        }
    }

    #[test]
    fn the_soft_threshold_is_one_half_at_the_hard_one() {
        let soft = SoftThreshold::new(RangeEquation::default(), 1e-4).unwrap();
        assert!((soft.probability(&at(90.0, 0.1)) - 0.5).abs() < 1e-12);
        assert!(soft.probability(&at(45.0, 0.1)) > 0.999);
        // Noise alone raises false alarms with a probability of ½ erfc(√9.21 − √½) = 5e-4.
        assert!(soft.probability(&at(9e9, 0.1)) < 1e-3);
        // What sends nothing back is not seen, at whatever range.
        for range_m in [0.0, 5.0, 90.0] {
            assert_eq!(soft.probability(&at(range_m, 0.0)), 0.0);
        }
    }

    /// LiDAR data sheets state "2 cm at 20 m", and 1 cm for bright targets nearby.
    #[test]
    fn sigma_follows_the_data_sheets() {
        let sigma = SnrSigma::default();
        for (range_m, reflectance, sigma_m) in [
            (20.0, 0.1, 0.0212),
            (20.0, 0.8, 0.0099),
            (50.0, 0.5, 0.0234),
        ] {
            let got = sigma.sigma_m(&at(range_m, reflectance));
            assert!((got - sigma_m).abs() < 1e-4, "{range_m} {got} {sigma_m}");
        }
        assert!((sigma.sigma_m(&at(1e6, 0.0)) - 0.0903).abs() < 1e-4);
        assert_eq!(sigma.sigma_m(&at(0.0, 0.5)), 0.007);
    }

    #[test]
    fn fog_shortens_the_range() {
        let fog = RangeEquation::new(RangeEquationParams {
            extinction_per_m: 0.06,
            ..RangeEquationParams::default()
        })
        .unwrap();
        // By Koschmieder's law, 0.06 per metre is a visibility of 50 m.
        assert_eq!(fog.probability(&at(90.0, 0.1)), 0.0);
        assert_eq!(fog.probability(&at(20.0, 0.1)), 1.0);
        assert_eq!(fog.probability(&at(30.0, 0.1)), 0.0);
    }
}
