//! The channels that sensors become. Programs ask for `LIDAR_TOP` and `CAM_FRONT`, so the first
//! LiDAR and the first camera have these names whatever ours are.

use nemoral_dataset::{CameraSpec, LidarSpec};
use nemoral_scene::{Intrinsics, RigidTransform};

use super::{LIDAR_TOP, unsuitable};
use crate::{Error, FrameRef};

/// What a sensor is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Camera(Intrinsics),
    Lidar,
}

/// A sensor with its channel.
#[derive(Clone, Debug)]
pub(super) struct Sensor {
    pub(super) channel: String,
    /// Where it stands among the cameras or the LiDARs of its sequence.
    pub(super) index: usize,
    pub(super) kind: Kind,
    pub(super) body_from_sensor: RigidTransform,
}

impl Sensor {
    pub(super) fn is_camera(&self) -> bool {
        matches!(self.kind, Kind::Camera(_))
    }

    /// `camera` or `lidar`.
    pub(super) fn modality(&self) -> &'static str {
        match self.kind {
            Kind::Camera(_) => "camera",
            Kind::Lidar => "lidar",
        }
    }

    /// The place of its file of a frame.
    pub(super) fn file(&self, frame: &FrameRef<'_>) -> String {
        let (channel, name) = (&self.channel, frame.name());
        let extension = match self.kind {
            Kind::Camera(_) => "png",
            Kind::Lidar => "pcd.bin",
        };
        format!("samples/{channel}/{name}__{channel}.{extension}")
    }
}

/// The sensors of a sequence, cameras first; two that would have the same channel are refused.
pub(super) fn of(
    sequence: u32,
    cameras: &[CameraSpec],
    lidars: &[LidarSpec],
) -> Result<Vec<Sensor>, Error> {
    let channel = |prefix: &str, first: &str, index: usize, name: &str| match index {
        0 => first.to_owned(),
        _ => format!("{prefix}_{}", name.to_ascii_uppercase().replace('-', "_")),
    };
    let camera = |(index, c): (usize, &CameraSpec)| Sensor {
        channel: channel("CAM", "CAM_FRONT", index, &c.name),
        index,
        kind: Kind::Camera(c.intrinsics),
        body_from_sensor: c.body_from_camera,
    };
    let lidar = |(index, l): (usize, &LidarSpec)| Sensor {
        channel: channel("LIDAR", LIDAR_TOP, index, &l.name),
        index,
        kind: Kind::Lidar,
        body_from_sensor: l.body_from_lidar,
    };
    let cameras = cameras.iter().enumerate().map(camera);
    let sensors: Vec<_> = cameras
        .chain(lidars.iter().enumerate().map(lidar))
        .collect();
    for (i, sensor) in sensors.iter().enumerate() {
        if sensors[..i].iter().any(|s| s.channel == sensor.channel) {
            return Err(unsuitable(format!(
                "two sensors of sequence {sequence:02} would be the channel {}, which the first \
                 camera (CAM_FRONT) or LiDAR (LIDAR_TOP) may have already; name the further one \
                 otherwise",
                sensor.channel
            )));
        }
    }
    Ok(sensors)
}
