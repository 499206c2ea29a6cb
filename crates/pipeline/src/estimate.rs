//! What a run will take, before it starts.

use std::fmt;

use crate::config::Config;

/// Bytes of the five images, per pixel: measured on preset `medium`.
const BYTES_PER_PIXEL: f64 = 5.0;
/// Bytes of `.bin` and `.label`, per point.
const BYTES_PER_POINT: f64 = 16.0 + 4.0;
/// Bytes of the PLY, per point.
const BYTES_PER_PLY_POINT: f64 = 67.0;
/// Share of pulses that return in a forest.
const RETURNS: f64 = 0.97;

/// Seconds of one core for a megapixel and for a million rays of pulses at 96 trees a chunk: measured as
/// `docs/benchmarks.md` says, on the machine named there.
const CORE_S_PER_MEGAPIXEL: f64 = 2.8;
const CORE_S_PER_MEGARAY: f64 = 2.0;

/// What a run will take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Frames of the sequence.
    pub frames: u64,
    /// Gigabytes on disk.
    pub gigabytes: f64,
    /// Minutes on one core; more cores share them.
    pub core_minutes: f64,
}

/// Estimates a run from what was measured on the presets.
#[must_use]
pub fn estimate(config: &Config) -> Estimate {
    let pixels: f64 = config
        .all_cameras()
        .map(|(_, c)| f64::from(c.width_px) * f64::from(c.height_px))
        .sum();
    let (mut pulses, mut rays) = (0.0, 0.0);
    for (_, lidar) in config.all_lidars() {
        let rings = f64::from(lidar.beam.rings);
        pulses += f64::from(lidar.pulses);
        rays += f64::from(lidar.pulses) * (1.0 + 3.0 * rings * (rings + 1.0));
    }
    let per_point = if config.output.ply {
        BYTES_PER_POINT + BYTES_PER_PLY_POINT
    } else {
        BYTES_PER_POINT
    };
    let frames = config.frames as f64;
    let bytes = pixels * BYTES_PER_PIXEL + pulses * RETURNS * per_point;
    let seconds = pixels / 1e6 * CORE_S_PER_MEGAPIXEL + rays / 1e6 * CORE_S_PER_MEGARAY;
    Estimate {
        frames: config.frames,
        gigabytes: frames * bytes / 1e9,
        core_minutes: frames * seconds / 60.0,
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "about {} frames, {:.2} GB, {:.1} minutes of one core",
            self.frames, self.gigabytes, self.core_minutes
        )
    }
}
