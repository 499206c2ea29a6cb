//! Turns a LiDAR's table into its errors: those of ranges, and those of pulses.

use nemoral_lidar::PulseErrors;
use nemoral_lidar_noise::{
    IncidenceLawParams, LaconteDevice, LaconteForm, LinearSigmaParams, RangeEquationParams,
    RangeNoise, SnrSigmaParams,
};

use super::{LaconteSensor, Lidar, RangeNoiseModel};

impl Lidar {
    /// Errors of pointing, detection and intensity. A receiver without noise measures intensities
    /// exactly, too.
    #[must_use]
    pub fn pulse_errors(&self) -> PulseErrors {
        let (errors, noise) = (&self.errors, &self.noise);
        let [intensity_at_threshold, reflectance_spread] = match noise.model {
            RangeNoiseModel::Off => [0.0; 2],
            _ => [noise.intensity_at_threshold, noise.reflectance_spread],
        };
        PulseErrors {
            angular_sigma_rad: errors.angular_deg.to_radians(),
            range_step_m: errors.range_step_m,
            dropout: errors.dropout,
            false_alarm: errors.false_alarm,
            intensity_at_threshold,
            reflectance_spread,
        }
    }

    /// The model of range errors.
    #[must_use]
    pub fn range_noise(&self) -> RangeNoise {
        let n = &self.noise;
        match n.model {
            RangeNoiseModel::Off => RangeNoise::Off,
            RangeNoiseModel::Paper => RangeNoise::Paper { sigma_m: n.sigma_m },
            RangeNoiseModel::Laconte => RangeNoise::Laconte {
                device: match n.laconte_device {
                    LaconteSensor::Lms1xx => LaconteDevice::SickLms1xx,
                    LaconteSensor::Hdl32e => LaconteDevice::VelodyneHdl32e,
                },
                form: if n.laconte_closed {
                    LaconteForm::Closed
                } else {
                    LaconteForm::Waveform
                },
                sigma_m: n.sigma_m,
            },
            RangeNoiseModel::Incidence => RangeNoise::Incidence(IncidenceLawParams {
                error_m: n.floor_m,
                ..IncidenceLawParams::default()
            }),
            RangeNoiseModel::Linear => RangeNoise::Linear(LinearSigmaParams {
                min_m: n.floor_m,
                base_m: 0.0,
                per_metre: n.per_metre,
            }),
            RangeNoiseModel::SignalToNoise => RangeNoise::SignalToNoise {
                range: RangeEquationParams {
                    reference_range_m: n.reference_range_m,
                    reference_reflectance: n.reference_reflectance,
                    extinction_per_m: n.extinction_per_m,
                },
                sigma: SnrSigmaParams {
                    floor_m: n.floor_m,
                    at_threshold_m: n.at_threshold_m,
                },
                false_alarm_probability: n.false_alarm_probability,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Weather;
    use super::*;

    #[test]
    fn intensities_are_exact_where_ranges_are() {
        let mut lidar = Lidar::default();
        lidar.noise.intensity_at_threshold = 0.3;
        lidar.noise.reflectance_spread = 0.2;
        let spreads = |lidar: &Lidar| {
            let errors = lidar.scanner_params(300.0, &Weather::default()).errors;
            (errors.intensity_at_threshold, errors.reflectance_spread)
        };
        assert_eq!(spreads(&lidar), (0.3, 0.2));
        lidar.noise.model = RangeNoiseModel::Off;
        assert_eq!(spreads(&lidar), (0.0, 0.0));
        // Who asks for nothing has none either.
        assert_eq!(spreads(&Lidar::default()), (0.0, 0.0));
    }

    #[test]
    fn detection_fades_by_the_probability_of_false_alarm() {
        let mut lidar = Lidar::default();
        lidar.noise.model = RangeNoiseModel::SignalToNoise;
        lidar.noise.false_alarm_probability = 1e-4;
        let RangeNoise::SignalToNoise {
            false_alarm_probability,
            ..
        } = lidar.range_noise()
        else {
            panic!("another model");
        };
        assert_eq!(false_alarm_probability, 1e-4);
    }
}
