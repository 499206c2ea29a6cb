//! The navigation system that a config describes.

use nemoral_scene::glam::DVec3;
use nemoral_trajectory::NavigationParams;

use super::{Config, Navigation};

impl Navigation {
    /// Its errors, with a reference point on the body.
    fn params(&self, reference_point_m: DVec3) -> NavigationParams {
        NavigationParams {
            horizontal_m: self.horizontal_m,
            vertical_m: self.vertical_m,
            roll_pitch_rad: self.roll_pitch_deg.to_radians(),
            heading_rad: self.heading_deg.to_radians(),
            correlation_s: self.correlation_s,
            drift_m: self.drift_m,
            heading_drift_rad: self.heading_drift_deg.to_radians(),
            loop_m: self.loop_m,
            reference_point_m,
            lever_m: DVec3::from(self.lever_m),
            boresight_rad: self.boresight_deg.map(f64::to_radians),
        }
    }
}

impl Config {
    /// The errors of the navigation system, whose reference point is the first LiDAR, or the first
    /// camera if there is none.
    #[must_use]
    pub fn navigation_params(&self) -> NavigationParams {
        let lidar = self.all_lidars().next().map(|(_, l)| l.body_from_lidar());
        let camera = self.all_cameras().next().map(|(_, c)| c.body_from_camera());
        let sensor = lidar.or(camera);
        let reference_point_m = sensor.map_or(DVec3::ZERO, |mount| mount.translation_m);
        self.navigation.params(reference_point_m)
    }

    /// What is impossible about the system of a data set: keys and messages.
    pub(super) fn navigation_problems(&self) -> Vec<(String, String)> {
        if !(self.navigation.enabled && self.balance.is_on()) {
            return Vec::new();
        }
        let message = "navigation.enabled = true: must be false with [balance.targets]: frames are \
                       chosen beside the path, and no system goes from one to the next";
        vec![("navigation.enabled".to_owned(), message.to_owned())]
    }
}
