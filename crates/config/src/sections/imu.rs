//! Keys of the inertial measurement unit.

use crate::schema::AllowedValues::{Flag, Real};
use crate::schema::section;

section! {
    /// The robot's inertial measurement unit. Densities are those of Kalibr's files.
    Imu at "imu" {
        /// Whether data sets have what it measures, which only a drive does: not stations and
        /// balanced frames. `nemoral imu` writes it in any case.
        enabled: bool = false, Flag, "who needs it asks for it";
        /// Samples per second.
        rate_hz: f64 = 200.0, Real(1.0, 4000.0), "EuRoC";
        /// Position in front of the body's origin.
        mount_x_m: f64 = 0.0, Real(-10.0, 10.0), "centred";
        /// Position to the left of it.
        mount_y_m: f64 = 0.0, Real(-10.0, 10.0), "centred";
        /// Height above the ground.
        mount_z_m: f64 = 0.5, Real(0.0, 50.0), "in the body of a small robot";
        /// Rotation to the left.
        mount_yaw_deg: f64 = 0.0, Real(-180.0, 180.0), "forward";
        /// Pitch, downwards.
        mount_pitch_deg: f64 = 0.0, Real(-90.0, 90.0), "level";
        /// Roll, about its own forward axis after yaw and pitch: the right side goes down.
        mount_roll_deg: f64 = 0.0, Real(-180.0, 180.0), "upright";
        /// Density of the gyroscope's white noise, rad/s/√Hz.
        gyroscope_noise_density: f64 = 1.6968e-4, Real(0.0, 10.0), "EuRoC's ADIS16448";
        /// Density of the noise whose integral is the gyroscope's bias, rad/s²/√Hz.
        gyroscope_random_walk: f64 = 1.9393e-5, Real(0.0, 10.0), "EuRoC's ADIS16448";
        /// Standard deviation of the gyroscope's bias at the start, rad/s.
        gyroscope_bias_rad_s: f64 = 1.7e-3, Real(0.0, 10.0), "our choice: 0.1 °/s";
        /// Density of the accelerometer's white noise, m/s²/√Hz.
        accelerometer_noise_density: f64 = 2.0e-3, Real(0.0, 10.0), "EuRoC's ADIS16448";
        /// Density of the noise whose integral is the accelerometer's bias, m/s³/√Hz.
        accelerometer_random_walk: f64 = 3.0e-3, Real(0.0, 10.0), "EuRoC's ADIS16448";
        /// Standard deviation of the accelerometer's bias at the start, m/s².
        accelerometer_bias_m_s2: f64 = 0.05, Real(0.0, 10.0), "our choice: 5 mg";
    }
}
