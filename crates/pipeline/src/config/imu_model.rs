//! The inertial measurement unit that a config describes.

use nemoral_imu::{ImuErrors, ImuParams, SensorErrors};
use nemoral_scene::RigidTransform;

use super::Imu;
use super::mount::mount;

impl Imu {
    /// The position and direction of the unit on the body.
    #[must_use]
    pub fn body_from_imu(&self) -> RigidTransform {
        mount(
            [self.mount_x_m, self.mount_y_m, self.mount_z_m],
            [
                self.mount_roll_deg,
                self.mount_pitch_deg,
                self.mount_yaw_deg,
            ],
        )
    }

    /// The unit.
    #[must_use]
    pub fn params(&self) -> ImuParams {
        ImuParams {
            rate_hz: self.rate_hz,
            errors: ImuErrors {
                gyroscope: SensorErrors {
                    noise_density: self.gyroscope_noise_density,
                    random_walk: self.gyroscope_random_walk,
                    turn_on_bias: self.gyroscope_bias_rad_s,
                },
                accelerometer: SensorErrors {
                    noise_density: self.accelerometer_noise_density,
                    random_walk: self.accelerometer_random_walk,
                    turn_on_bias: self.accelerometer_bias_m_s2,
                },
            },
        }
    }
}
