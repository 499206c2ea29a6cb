//! The errors of an inertial measurement unit.

use nemoral_scene::ParamError;
use nemoral_scene::glam::DVec3;
use nemoral_seed::{Draw, Key};

use crate::ImuMotion;

/// The errors of three equal axes, in the terms of IEEE Std 952-2020 and of Kalibr's files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorErrors {
    /// Density of the white noise, 0..=10: rad/s/√Hz, or m/s²/√Hz.
    pub noise_density: f64,
    /// Density of the noise whose integral is the bias, 0..=10: rad/s²/√Hz, or m/s³/√Hz.
    pub random_walk: f64,
    /// Standard deviation of the bias at the first sample, 0..=10: rad/s, or m/s².
    pub turn_on_bias: f64,
}

/// The errors of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuErrors {
    /// Of the angular rates.
    pub gyroscope: SensorErrors,
    /// Of the specific forces.
    pub accelerometer: SensorErrors,
}

impl ImuErrors {
    /// None.
    pub const NONE: Self = {
        let none = SensorErrors {
            noise_density: 0.0,
            random_walk: 0.0,
            turn_on_bias: 0.0,
        };
        Self {
            gyroscope: none,
            accelerometer: none,
        }
    };

    /// An industrial unit, Analog Devices' ADIS16448, with the densities of the EuRoC MAV data
    /// set's `sensor.yaml` (Burri et al. 2016). The biases at turn-on are those of a unit whose
    /// calibration is some months old: our choice, a tenth of a degree a second and 5 mg.
    pub const ADIS16448: Self = Self {
        gyroscope: SensorErrors {
            noise_density: 1.6968e-4,
            random_walk: 1.9393e-5,
            turn_on_bias: 1.7e-3,
        },
        accelerometer: SensorErrors {
            noise_density: 2.0e-3,
            random_walk: 3.0e-3,
            turn_on_bias: 0.05,
        },
    };
}

/// A unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuParams {
    /// Samples per second, 1..=4000.
    pub rate_hz: f64,
    /// Its errors.
    pub errors: ImuErrors,
}

impl ImuParams {
    /// Checks that all values are in their ranges.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), ParamError> {
        ParamError::check_range("rate_hz", self.rate_hz, 1.0..=4000.0, "1..=4000 Hz")?;
        let ImuErrors {
            gyroscope,
            accelerometer,
        } = &self.errors;
        for (sensor, errors) in [("gyroscope", gyroscope), ("accelerometer", accelerometer)] {
            for (field, value) in [
                ("noise_density", errors.noise_density),
                ("random_walk", errors.random_walk),
                ("turn_on_bias", errors.turn_on_bias),
            ] {
                let field = format!("errors.{sensor}.{field}");
                ParamError::check_range(&field, value, 0.0..=10.0, "0..=10")?;
            }
        }
        Ok(())
    }
}

/// What a unit says, and the biases in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// Seconds after the first sample.
    pub time_s: f64,
    /// The angular rate that it measures, rad/s.
    pub angular_rate_rad_s: DVec3,
    /// The specific force that it measures, m/s².
    pub specific_force_m_s2: DVec3,
    /// The gyroscope's bias, rad/s.
    pub gyroscope_bias_rad_s: DVec3,
    /// The accelerometer's bias, m/s².
    pub accelerometer_bias_m_s2: DVec3,
}

/// The errors of a unit from its first sample on.
///
/// A sample has white noise of density × √rate, and a bias that walks by density / √rate from one
/// sample to the next (Crassidis 2006; Nikolic et al. 2016).
#[derive(Clone, Debug)]
pub struct ImuNoise {
    params: ImuParams,
    key: Key,
    next: u64,
    biases: [DVec3; 2],
}

impl ImuNoise {
    /// The errors that a key decides.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: &ImuParams, key: Key) -> Result<Self, ParamError> {
        params.check()?;
        let mut rng = key.item(0).rng();
        let errors = [params.errors.gyroscope, params.errors.accelerometer];
        Ok(Self {
            params: *params,
            key: key.item(1),
            next: 0,
            biases: errors.map(|of| normals(&mut rng) * of.turn_on_bias),
        })
    }

    /// The next sample, of the motion over its interval.
    pub fn measure(&mut self, motion: &ImuMotion) -> ImuSample {
        let mut rng = self.key.item(self.next).rng();
        self.next += 1;
        let root = self.params.rate_hz.sqrt();
        let errors = self.params.errors;
        let [gyroscope, accelerometer] = self.biases;
        let mut noisy = |exact: DVec3, bias: DVec3, of: &SensorErrors| {
            exact + bias + normals(&mut rng) * (of.noise_density * root)
        };
        let (rate, force) = (motion.angular_rate_rad_s, motion.specific_force_m_s2);
        let sample = ImuSample {
            time_s: motion.time_s,
            angular_rate_rad_s: noisy(rate, gyroscope, &errors.gyroscope),
            specific_force_m_s2: noisy(force, accelerometer, &errors.accelerometer),
            gyroscope_bias_rad_s: gyroscope,
            accelerometer_bias_m_s2: accelerometer,
        };
        let walks = [
            errors.gyroscope.random_walk,
            errors.accelerometer.random_walk,
        ];
        for (bias, walk) in self.biases.iter_mut().zip(walks) {
            *bias += normals(&mut rng) * (walk / root);
        }
        sample
    }
}

fn normals(rng: &mut impl Draw) -> DVec3 {
    DVec3::new(rng.normal(), rng.normal(), rng.normal())
}

#[cfg(test)]
mod tests {
    use nemoral_scene::RigidTransform;

    use super::*;

    const STILL: ImuMotion = ImuMotion {
        time_s: 0.0,
        world_from_imu: RigidTransform::IDENTITY,
        velocity_m_s: DVec3::ZERO,
        angular_rate_rad_s: DVec3::ZERO,
        specific_force_m_s2: DVec3::ZERO,
    };

    fn params(errors: ImuErrors) -> ImuParams {
        ImuParams {
            rate_hz: 100.0,
            errors,
        }
    }

    fn samples(errors: ImuErrors, key: u64, count: usize) -> Vec<ImuSample> {
        let mut noise = ImuNoise::new(&params(errors), Key::world(key)).expect("valid");
        (0..count).map(|_| noise.measure(&STILL)).collect()
    }

    fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
        let n = values.clone().count() as f64;
        (values.map(|x| x * x).sum::<f64>() / n).sqrt()
    }

    #[test]
    fn white_noise_has_its_density_whatever_the_rate() {
        let mut errors = ImuErrors::NONE;
        errors.gyroscope.noise_density = 1e-3;
        let all = samples(errors, 1, 20_000);
        // A density of 1e-3 at 100 Hz is a deviation of 1e-2 of single samples, and of 1e-3 of
        // the means over a second.
        let single = spread(all.iter().map(|s| s.angular_rate_rad_s.x));
        assert!((single / 1e-2 - 1.0).abs() < 0.03, "{single}");
        let means = all
            .chunks(100)
            .map(|second| second.iter().map(|s| s.angular_rate_rad_s.y).sum::<f64>() / 100.0);
        let means = spread(means);
        assert!((means / 1e-3 - 1.0).abs() < 0.15, "{means}");
        assert!(all.iter().all(|s| s.specific_force_m_s2 == DVec3::ZERO));
    }

    #[test]
    fn biases_walk_from_where_they_turned_on() {
        let mut errors = ImuErrors::NONE;
        errors.accelerometer.random_walk = 0.02;
        errors.accelerometer.turn_on_bias = 0.3;
        let ends = (0..400).map(|key| {
            let all = samples(errors, key, 901);
            let bias = |i: usize| all[i].accelerometer_bias_m_s2.z;
            assert_eq!(all[5].specific_force_m_s2, all[5].accelerometer_bias_m_s2);
            (bias(0), bias(900) - bias(0))
        });
        let (begins, walked): (Vec<_>, Vec<_>) = ends.unzip();
        let begin = spread(begins.iter().copied());
        assert!((begin / 0.3 - 1.0).abs() < 0.12, "{begin}");
        // In 9 seconds by 0.02 √9.
        let walk = spread(walked.iter().copied());
        assert!((walk / 0.06 - 1.0).abs() < 0.12, "{walk}");
    }

    #[test]
    fn wrong_parameters_are_named() {
        let mut wrong = params(ImuErrors::NONE);
        wrong.rate_hz = 0.0;
        let text = ImuNoise::new(&wrong, Key::world(1))
            .expect_err("no rate")
            .to_string();
        assert!(text.contains("rate_hz"), "{text}");
        let mut wrong = params(ImuErrors::NONE);
        wrong.errors.accelerometer.random_walk = f64::NAN;
        let text = ImuNoise::new(&wrong, Key::world(1))
            .expect_err("no walk")
            .to_string();
        assert!(text.contains("errors.accelerometer.random_walk"), "{text}");
    }

    #[test]
    fn value_stability() {
        let last = samples(ImuErrors::ADIS16448, 7, 3)[2];
        let rate = [
            0.0033206551557133967,
            0.004877126538280782,
            -8.230430736661442e-5,
        ];
        assert_eq!(last.angular_rate_rad_s.to_array(), rate);
        let bias = [
            -0.07946876108850175,
            -0.09561073800964218,
            -0.02104115212166716,
        ];
        assert_eq!(last.accelerometer_bias_m_s2.to_array(), bias);
    }
}
