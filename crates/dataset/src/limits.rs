//! Limits of sizes, with which headers are compared before memory is allocated.
//!
//! The numbers are those of the config's schema, so that everything that can be made can be read.

use std::ops::RangeInclusive;

use nemoral_scene::Intrinsics;

/// Columns and rows of a picture.
pub(crate) const MAX_SIDE_PX: u32 = 8192;
/// Frames of a sequence.
pub(crate) const MAX_FRAMES: u64 = 10_000_000;
/// Sequences of a data set.
pub(crate) const MAX_SEQUENCES: usize = 100_000;
/// Cameras and LiDARs of a data set.
pub(crate) const MAX_SENSORS: usize = 256;
/// Things of which frames should show a certain share.
pub(crate) const MAX_TARGETS: usize = 64;
/// Points of one scan: ten million pulses with fifteen returns each.
pub(crate) const MAX_POINTS: u64 = 150_000_000;
/// The greatest distance of a pose from the origin, metres; all chunks that have a coordinate lie
/// within it.
pub(crate) const MAX_POSITION_M: f64 = 1e12;

/// Half of the longest scan, with the pause in which it may end, seconds: scanners take an hour at
/// most.
pub(crate) const MAX_HALF_SCAN_S: f64 = 3600.0;

/// The greatest coordinate of a world's origin on the earth, metres.
pub(crate) const MAX_SITE_M: f64 = 5e7;
/// The codes that EPSG gives.
pub(crate) const EPSG_CODES: RangeInclusive<u16> = 1024..=32_766;

/// A header of a data set that is being written, which has some 15 kB for each sequence.
pub(crate) const HEADER_BYTES: u64 = 512 << 20;
/// A frame's record while the data set is being written.
pub(crate) const RECORD_BYTES: u64 = 1 << 20;
/// `dataset.json`, which has some 2 kB for each frame and 15 kB for each sequence.
pub(crate) const MANIFEST_BYTES: u64 = 2 << 30;
/// A table of objects, some 200 bytes each.
pub(crate) const TABLE_BYTES: u64 = 2 << 30;
/// The boxes of a frame: some 200 bytes for each object in view.
pub(crate) const BOXES_BYTES: u64 = 256 << 20;
/// A file that a config names.
pub(crate) const INPUT_BYTES: u64 = 256 << 20;
/// Files that the config of a sequence names.
pub(crate) const MAX_INPUTS: usize = 1024;
/// Data card, class table, description of an inertial measurement unit.
pub(crate) const TEXT_BYTES: u64 = 16 << 20;
/// The config of the data set or of a sequence: the most that the reader of configs takes.
pub const CONFIG_BYTES: u64 = 4 << 20;

/// A line of `poses.txt` or `times.txt` has at most twelve numbers of 25 characters.
pub(crate) const fn lines_bytes(frames: u64) -> u64 {
    frames.saturating_mul(12 * 25)
}

/// `calib.txt`: five lines, and three for each further sensor, each of at most 400 bytes.
pub(crate) const fn calibration_bytes(sensors: usize) -> u64 {
    400 * (8 + 3 * sensors as u64)
}

/// A picture with `bytes_per_pixel` before compression, which may make it slightly longer.
pub(crate) fn image_bytes(size: &Intrinsics, bytes_per_pixel: u64) -> u64 {
    let raw = u64::from(size.width) * u64::from(size.height) * bytes_per_pixel;
    raw + raw / 8 + u64::from(size.height) * 64 + (1 << 20)
}

/// The file of a scan, with `bytes_per_point`.
pub(crate) const fn scan_bytes(bytes_per_point: u64) -> u64 {
    4096 + MAX_POINTS * bytes_per_point
}
