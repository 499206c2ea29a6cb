//! A point of a registered cloud.

use nemoral_scene::glam::DVec3;

use crate::PlyPoint;

/// A point of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoint {
    /// The measured position in the world, by the scanner's true pose, or by another one
    /// ([`CloudParams::poses`](crate::CloudParams::poses)).
    pub world_m: DVec3,
    /// The surface's normal in the world.
    pub normal: DVec3,
    /// The vector to it from where the scanner was at the frame's time, in the world.
    pub from_scanner_m: DVec3,
    /// How far it is to the left of the scanner at that time, level and across the body's heading
    /// ([`RigidTransform::level_left`](nemoral_scene::RigidTransform::level_left)), metres.
    pub left_m: f64,
    /// The number of the scan among those of the sequence, from 0: all scans of a frame follow each
    /// other.
    pub scan: u64,
    /// The number of the flight line, from 0; `None` if the scanner was not flown along lines.
    pub line: Option<u64>,
    /// The frame's number in its sequence.
    pub frame: u64,
    /// The frame's time, seconds after the start of the sequence.
    pub time_s: f64,
    /// The number of the LiDAR.
    pub lidar: u8,
    /// The point as it was recorded, in the LiDAR's frame.
    pub recorded: PlyPoint,
}

impl CloudPoint {
    /// When its pulse was fired, seconds after the start of the sequence: negative in the first
    /// half of the first scan.
    #[must_use]
    pub fn fired_s(&self) -> f64 {
        self.time_s + self.recorded.point.time_ns as f64 / 1e9
    }

    /// LAS's `point_source_id`: the number, from 1, of the flight line or, without lines, of the
    /// scan; 0 if it is beyond 65,535.
    #[must_use]
    pub fn source_id(&self) -> u16 {
        source_id(self.line, self.scan)
    }
}

/// LAS's `point_source_id` of the points of a scan.
pub(super) fn source_id(line: Option<u64>, scan: u64) -> u16 {
    u16::try_from(line.unwrap_or(scan).saturating_add(1)).unwrap_or(0)
}
