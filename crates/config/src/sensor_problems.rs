//! Combinations of the keys of sensors and lamps that are impossible, and names that they cannot
//! have.

use nemoral_files::{DEVICE_NAMES, InnerPath};

use super::Config;
use super::lidar_problems::lidar_problems;
use super::sensors::RESERVED;
use super::validate::Problems;

/// The greatest number of lamps, each of which takes 21 bytes a pixel and a shadow ray.
const LAMPS_MAX: usize = 16;

impl Config {
    pub(super) fn sensor_problems(&self, out: &mut Problems) {
        for (path, camera) in self.all_cameras() {
            let lens = camera.tone_and_lens().1;
            let checked = match camera.intrinsics() {
                Ok(intrinsics) => lens.check_for(&intrinsics),
                Err(e) => {
                    let must = format!("be {}", e.allowed);
                    out.refuse(&format!("{path}.{}", e.field), e.value, &must);
                    lens.check()
                }
            };
            if let Err(e) = checked {
                out.add(&format!("{path}.vignetting"), &format!(": {e}"));
            }
        }
        for (path, lidar) in self.all_lidars() {
            lidar_problems(&path, lidar, out);
        }
        let lamps = self.all_lamps().count();
        if lamps > LAMPS_MAX {
            let message = format!(": at most {LAMPS_MAX} lamps may shine, and {lamps} do");
            out.add("lamps", &message);
        }
        for (name, camera) in &self.cameras {
            if camera.enabled && !self.camera.enabled {
                let must = "be false, as camera.enabled is: the first camera is what poses are \
                            about";
                out.refuse(&format!("cameras.{name}.enabled"), true, must);
            }
        }
        for (name, lidar) in &self.lidars {
            if lidar.enabled && !self.lidar.enabled {
                let must = "be false, as lidar.enabled is: the first LiDAR's files have the \
                            standard names";
                out.refuse(&format!("lidars.{name}.enabled"), true, must);
            }
        }
        if !self.camera.enabled && !self.lidar.enabled {
            let must = "be true, as camera.enabled is false: a robot needs a sensor";
            out.refuse("lidar.enabled", false, must);
        }
    }

    pub(super) fn sensor_name_problems(&self, out: &mut Problems) {
        let of_cameras = self.cameras.keys().map(|name| ("cameras", "camera", name));
        let of_lidars = self.lidars.keys().map(|name| ("lidars", "LiDAR", name));
        let of_lamps = self.lamps.keys().map(|name| ("lamps", "lamp", name));
        for (table, what, name) in of_cameras.chain(of_lidars).chain(of_lamps) {
            let path = format!("{table}.{name}");
            let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            // Lamps have no folders.
            let reserved: &[&str] = if table == "lamps" { &[] } else { &RESERVED };
            let has_folder = !reserved.is_empty();
            let taken = reserved.contains(&name.as_str())
                || has_folder && InnerPath::new(name.as_str()).is_err();
            if name.is_empty() || name.len() > 32 || !name.chars().all(plain) || taken {
                let mut message = format!(": a {what}'s name must be 1 to 32 of a-z, 0-9 and _");
                if has_folder {
                    let reserved = reserved.join(", ");
                    message += &format!(
                        ", and none of {reserved}, nor a device's name on Windows ({DEVICE_NAMES})"
                    );
                }
                out.add(&path, &message);
            }
            if table == "lidars" && self.cameras.contains_key(name) {
                let message = format!(": there is a camera of that name, cameras.{name}");
                out.add(&path, &message);
            }
        }
    }
}
