//! The inertial measurement unit that a config describes.

use nemoral_imu::{ImuErrors, ImuParams, SensorErrors};
use nemoral_scene::RigidTransform;

use super::mount::mount;
use super::{Config, Imu, RobotPath};

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

impl Config {
    /// Why the robot's inertial measurement unit has no motion to measure: the key that asks for
    /// something else, and the reason.
    #[must_use]
    pub fn motion_is_unknown(&self) -> Option<(&'static str, &'static str)> {
        match &self.robot.path {
            RobotPath::Stations(_) => Some(("robot.stations", "the robot stands still")),
            RobotPath::Flight(_) => Some(("robot.flight", "turns between lines are not flown")),
            _ if self.balance.is_on() => {
                Some(("balance.targets", "frames are chosen beside the path"))
            }
            _ => None,
        }
    }

    /// What is impossible about the unit of a data set: keys and messages.
    pub(super) fn imu_problems(&self) -> Vec<(String, String)> {
        let mut out = Vec::new();
        if !self.imu.enabled {
            return out;
        }
        if let Some((key, why)) = self.motion_is_unknown() {
            let message = format!(
                "imu.enabled = true: must be false with [{key}]: {why}; a drive along a trail, a \
                 wander, lanes, a straight line or a file's poses has a motion to measure"
            );
            out.push(("imu.enabled".to_owned(), message));
        }
        out
    }
}
