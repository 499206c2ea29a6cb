//! The sensors and lamps of a config by name.

use super::{Camera, Config, Lamp, Lidar};

/// Names that no further sensor may have, because the first sensors and their folders have them.
pub(super) const RESERVED: [&str; 16] = [
    "camera", "lidar", "image_2", "image_3", "semantic", "instance", "depth", "normals", "sky",
    "flow", "trunks", "boxes", "radiance", "velodyne", "labels", "points",
];

impl Config {
    /// Every enabled camera with the path of its table, the first one first.
    pub fn all_cameras(&self) -> impl Iterator<Item = (String, &Camera)> {
        let further = self
            .cameras
            .iter()
            .map(|(n, c)| (format!("cameras.{n}"), c));
        let all = std::iter::once(("camera".to_owned(), &self.camera)).chain(further);
        all.filter(|(_, camera)| camera.enabled)
    }

    /// Every lamp that shines, with the path of its table, the first one first.
    pub fn all_lamps(&self) -> impl Iterator<Item = (String, &Lamp)> {
        let further = self.lamps.iter().map(|(n, l)| (format!("lamps.{n}"), l));
        let all = std::iter::once(("lamp".to_owned(), &self.lamp)).chain(further);
        all.filter(|(_, lamp)| lamp.enabled)
    }

    /// Whether a lamp shines, for which pictures are taken on the CPU.
    #[must_use]
    pub fn has_lamps(&self) -> bool {
        self.all_lamps().next().is_some()
    }

    /// Every enabled LiDAR with the path of its table, the first one first.
    pub fn all_lidars(&self) -> impl Iterator<Item = (String, &Lidar)> {
        let further = self.lidars.iter().map(|(n, l)| (format!("lidars.{n}"), l));
        let all = std::iter::once(("lidar".to_owned(), &self.lidar)).chain(further);
        all.filter(|(_, lidar)| lidar.enabled)
    }
}
