//! The records of drives and of frames in `dataset.json`.

use std::collections::BTreeMap;

use nemoral_scene::{RigidTransform, Twist};
use serde::{Deserialize, Serialize};

use crate::formats::kitti;
use crate::{BalanceRecord, FileRecord, FrameChoice};

/// The drive of a sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackRecord {
    /// The sequence's number.
    pub sequence: u32,
    /// Number of frames of the whole drive, and of lines of `poses.txt` and `times.txt`.
    pub length: u64,
    /// The frames that exist here, as half-open ranges.
    pub frames: Vec<[u64; 2]>,
    /// The pose of the reference sensor (the first camera) at frame 0 in the world: 3 × 4,
    /// row-major, metres. `world_from_frame0 · poses.txt[k]` is its pose at frame k.
    pub world_from_frame0: [[f64; 4]; 3],
    /// How its poses were chosen among several; absent if they are a drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub balance: Option<BalanceRecord>,
    /// Whether the body stands still at each pose, as a tripod does; absent if it does not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stands: bool,
    /// The first frames of flight lines, from 0 on, between which the body turns; absent if it is
    /// no flight along lines.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<u64>,
}

/// A frame that exists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameRecord {
    /// The sequence's number.
    pub sequence: u32,
    /// The frame's number in its sequence, which is in the names of its files.
    pub index: u64,
    /// Seconds after the start of the sequence, the middle of the exposure.
    pub time_s: f64,
    /// The key of all that went into the frame, hexadecimal.
    pub key: String,
    /// The body's pose in the world: 3 × 4, row-major, metres.
    pub world_from_body: [[f64; 4]; 3],
    /// How the body moves at that time, in its own axes; absent if no camera has a shutter or the
    /// body stands still.
    #[serde(default, skip_serializing_if = "Twist::is_still")]
    pub body_motion: Twist,
    /// Which candidate it is; absent if its sequence is a drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub balance: Option<FrameChoice>,
    /// The chunk in which each LiDAR stood; the instances of `.label` files are relative to it.
    pub sensor_chunks: Vec<[i32; 2]>,
    /// LiDAR points by class id, over all LiDARs.
    pub point_classes: BTreeMap<u8, u64>,
    /// The frame's files, by path.
    pub files: Vec<FileRecord>,
}

impl TrackRecord {
    /// [`TrackRecord::world_from_frame0`] as a transform.
    #[must_use]
    pub fn world_from_frame0(&self) -> RigidTransform {
        kitti::from_rows(&self.world_from_frame0)
    }

    /// The number of the flight line that a frame is on, from 0; `None` if it is on none.
    #[must_use]
    pub fn line_of(&self, frame: u64) -> Option<u64> {
        let after = self.lines.partition_point(|first| *first <= frame);
        after.checked_sub(1).map(|line| line as u64)
    }

    /// Whether the body moves from frame to frame: they are neither single views nor stations.
    #[must_use]
    pub fn is_drive(&self) -> bool {
        self.balance.is_none() && !self.stands
    }

    /// Whether the body moves from a frame to the next one, which may not exist here: not after the
    /// last one of a drive, nor from one flight line to the next.
    #[must_use]
    pub fn goes_on_after(&self, frame: u64) -> bool {
        let next = frame.saturating_add(1);
        self.is_drive() && next < self.length && self.line_of(frame) == self.line_of(next)
    }
}

impl FrameRecord {
    /// [`FrameRecord::world_from_body`] as a transform.
    #[must_use]
    pub fn world_from_body(&self) -> RigidTransform {
        kitti::from_rows(&self.world_from_body)
    }

    /// Size of all its files.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.files.iter().map(|f| f.bytes).sum()
    }
}
