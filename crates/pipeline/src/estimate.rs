//! The estimated cost of a run.

use std::fmt;

use nemoral_dataset::PlyPoint;

use crate::config::{Camera, Config};
use crate::world::balance::rays_of_choice;

/// Bytes of the five images, per pixel: measured on preset `medium`.
const BYTES_PER_PIXEL: f64 = 5.0;
/// Bytes of `.bin` and `.label`, per point.
const BYTES_PER_POINT: f64 = 16.0 + 4.0;
/// Bytes of the PLY, per point.
const BYTES_PER_PLY_POINT: f64 = PlyPoint::BYTES as f64;
/// Share of pulses that return in a forest.
const RETURNS: f64 = 0.97;

/// Seconds of one core for a megapixel and for a million rays of pulses with 96 trees per chunk,
/// measured as described in `docs/measurements/speed.md`, on the machine named there.
const CORE_S_PER_MEGAPIXEL: f64 = 2.8;
const CORE_S_PER_MEGARAY: f64 = 2.0;

/// Whether a camera is asked for a further file.
type Asked = fn(&Camera) -> bool;

/// Bytes per pixel and further seconds of one core for a megapixel, for each further file of a
/// camera, measured in the same way.
const FURTHER: [(Asked, f64, f64); 6] = [
    (|c| c.sky, 0.1, 0.0),
    (|c| c.flow, 2.9, 0.6),
    (|c| c.trunks, 0.15, 0.35),
    (|c| c.boxes, 0.05, 5.2),
    (|c| c.radiance, 11.7, 0.1),
    (|c| c.noise.enabled, 0.0, 1.4),
];
/// Seconds of one core for a megapixel, for casting each further sample of all pixels.
const CORE_S_PER_MEGASAMPLE: f64 = 1.8;
/// The same for each surface over which a sample's light is followed.
const CORE_S_PER_MEGABOUNCE: f64 = 3.0;

/// The same for the light of each lamp in a megapixel.
const CORE_S_PER_MEGALAMP: f64 = 0.9;

/// Seconds of one core to grow the plants that all sequences share, with eight trees of each
/// species (splits, and sequences with an `assets.seed` of their own, grow theirs); and
/// to grow a world of its own around its first frame, at least and with trees to 300 m.
const CORE_S_PER_LIBRARY: f64 = 5.0;
const CORE_S_PER_WORLD: [f64; 2] = [2.0, 10.0];

/// The estimated cost of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Frames of all sequences.
    pub frames: u64,
    /// Gigabytes on disk.
    pub gigabytes: f64,
    /// Minutes on one core; more cores share them.
    pub core_minutes: f64,
}

/// Estimates the cost of a run of so many sequences like this one from measurements of the presets.
#[must_use]
pub fn estimate(config: &Config, sequences: u32) -> Estimate {
    let (mut bytes, mut seconds) = (0.0, 0.0);
    for (_, camera) in config.all_cameras() {
        let (mut per_pixel, mut per_megapixel) = (BYTES_PER_PIXEL, CORE_S_PER_MEGAPIXEL);
        for (_, more_bytes, more_s) in FURTHER.iter().filter(|(asked, ..)| asked(camera)) {
            per_pixel += more_bytes;
            per_megapixel += more_s;
        }
        let blurs = camera.shutter.exposure_ms > 0.0;
        let samples = match camera.samples {
            every if blurs => every.max(camera.shutter.samples),
            every => every,
        };
        per_megapixel += f64::from(samples - 1) * CORE_S_PER_MEGASAMPLE;
        per_megapixel += f64::from(samples * camera.bounces) * CORE_S_PER_MEGABOUNCE;
        per_megapixel += config.all_lamps().count() as f64 * CORE_S_PER_MEGALAMP;
        let pixels = f64::from(camera.width_px) * f64::from(camera.height_px);
        bytes += pixels * per_pixel;
        seconds += pixels / 1e6 * per_megapixel;
    }
    let (mut pulses, mut rays) = (0.0, 0.0);
    for (_, lidar) in config.all_lidars() {
        let rings = f64::from(lidar.beam.rings);
        pulses += f64::from(lidar.pulses);
        rays += f64::from(lidar.pulses) * (1.0 + 3.0 * rings * (rings + 1.0));
    }
    if config.balance.is_on() {
        seconds += rays_of_choice(&config.balance) / 1e6 * CORE_S_PER_MEGASAMPLE;
    }
    let per_point = if config.output.ply {
        BYTES_PER_POINT + BYTES_PER_PLY_POINT
    } else {
        BYTES_PER_POINT
    };
    let library = CORE_S_PER_LIBRARY * f64::from(config.assets.individuals) / 8.0;
    let [least, most] = CORE_S_PER_WORLD;
    let far = (config.chunks.visible_radius_m / 300.0).powi(2);
    let growing = library + f64::from(sequences) * (least + (most - least) * far);
    let frames = config.frames as f64 * f64::from(sequences);
    bytes += pulses * RETURNS * per_point;
    seconds += rays / 1e6 * CORE_S_PER_MEGARAY;
    Estimate {
        frames: config.frames.saturating_mul(sequences.into()),
        gigabytes: frames * bytes / 1e9,
        core_minutes: (growing + frames * seconds) / 60.0,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ConfigLayers;

    #[test]
    fn what_is_asked_for_besides_counts() {
        let of = |settings: &[&str]| {
            let layers = ConfigLayers {
                preset: Some("medium".to_owned()),
                file: None,
                settings: settings.iter().map(|s| (*s).to_owned()).collect(),
            };
            estimate(&layers.load().expect("valid"), 1)
        };
        let plain = of(&[]);
        assert!(
            (0.004..0.015).contains(&(plain.gigabytes / plain.frames as f64)),
            "{plain}"
        );
        let with_light = of(&["camera.radiance=true"]);
        assert!(with_light.gigabytes > 1.8 * plain.gigabytes, "{with_light}");
        let with_boxes = of(&["camera.boxes=true"]);
        assert!(
            with_boxes.core_minutes > 2.0 * plain.core_minutes,
            "{with_boxes}"
        );
        let standard = of(&["camera.samples=4"]);
        let followed = of(&["camera.samples=4", "camera.bounces=2"]);
        assert!(followed.core_minutes > 2.0 * standard.core_minutes);
        assert!(
            standard.core_minutes > 2.0 * plain.core_minutes,
            "{standard}"
        );
        let blurred = of(&["camera.shutter.exposure_ms=10"]);
        assert!(blurred.core_minutes > 4.0 * plain.core_minutes, "{blurred}");
    }
}
