//! What a run will take, before it starts.

use std::fmt;

use crate::config::Config;

/// Bytes of the five images, per pixel: measured on preset `medium`.
const BYTES_PER_PIXEL: f64 = 7.0;
/// Bytes of `.bin`, `.label` and PLY, per point.
const BYTES_PER_POINT: f64 = 16.0 + 4.0 + 80.0;
/// Share of pulses that return in a forest.
const RETURNS: f64 = 0.97;

/// Seconds of one core for a megapixel and for a million pulses at 96 trees a chunk: measured as
/// `docs/benchmarks.md` says, on the machine named there.
const CORE_S_PER_MEGAPIXEL: f64 = 2.8;
const CORE_S_PER_MEGAPULSE: f64 = 1.6;

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
    let pixels = f64::from(config.camera.width_px) * f64::from(config.camera.height_px);
    let pulses = f64::from(config.lidar.pulses);
    let frames = config.frames as f64;
    let bytes = pixels * BYTES_PER_PIXEL + pulses * RETURNS * BYTES_PER_POINT;
    let seconds = pixels / 1e6 * CORE_S_PER_MEGAPIXEL + pulses / 1e6 * CORE_S_PER_MEGAPULSE;
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
