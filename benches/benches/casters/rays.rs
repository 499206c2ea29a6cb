//! Rays in the patterns of sensors.

use std::f32::consts::{FRAC_PI_4, PI, TAU};

use nemoral_lidar::{LivoxHorizonLike, ScanPattern};
use nemoral_scene::Ray;
use nemoral_scene::glam::{Mat3, Vec3};

/// Rays in firing order, scan by scan, and the same sorted by direction within each scan.
pub(crate) struct Work {
    pub(crate) name: &'static str,
    pub(crate) fired: Vec<Vec<Ray>>,
    pub(crate) sorted: Vec<Vec<Ray>>,
}

/// The pose of a sensor: its position, and axes with x forward and z up.
pub(crate) type Eye = (Vec3, Mat3);

impl Work {
    fn new(name: &'static str, fired: Vec<Vec<Ray>>) -> Self {
        let sorted = fired.iter().map(|scan| by_direction(scan)).collect();
        Self {
            name,
            fired,
            sorted,
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.fired.iter().map(Vec::len).sum()
    }
}

/// The measured rays: eight scans of 50,000 pulses by a scanner like the Livox Horizon, eight full
/// turns of 64 rings, and a picture.
pub(crate) fn all(eyes: &[Eye]) -> Vec<Work> {
    vec![
        Work::new("horizon", eyes.iter().map(horizon).collect()),
        Work::new("spinning", eyes.iter().map(spinning).collect()),
        Work::new("camera", vec![camera(&eyes[0])]),
    ]
}

fn ray((origin, axes): &Eye, direction: Vec3) -> Ray {
    Ray {
        t_max_m: 300.0,
        ..Ray::new(*origin, (*axes * direction).normalize_or(Vec3::X))
    }
}

fn horizon(eye: &Eye) -> Vec<Ray> {
    let pulse = |i| LivoxHorizonLike.pulse(i).direction.as_vec3();
    (0..50_000).map(|i| ray(eye, pulse(i))).collect()
}

/// A full turn of rings at -15 to 15 degrees, ring by ring within a column.
fn spinning(eye: &Eye) -> Vec<Ray> {
    let direction = |i: u32| {
        let elevation = (-15.0 + 30.0 * (i % 64) as f32 / 63.0).to_radians();
        let azimuth = TAU * (i / 64) as f32 / (50_000 / 64) as f32;
        let (sin, cos) = azimuth.sin_cos();
        Vec3::new(
            cos * elevation.cos(),
            sin * elevation.cos(),
            elevation.sin(),
        )
    };
    (0..50_000).map(|i| ray(eye, direction(i))).collect()
}

/// The rays of a picture of 1280 x 720 pixels, 90 degrees wide, in tiles of 4 x 4 pixels.
fn camera(eye: &Eye) -> Vec<Ray> {
    let (width, height) = (1280_u32, 720_u32);
    let focal = width as f32 / 2.0 / FRAC_PI_4.tan();
    let direction = |i: u32| {
        let (tile, in_tile) = (i / 16, i % 16);
        let x = tile % (width / 4) * 4 + in_tile % 4;
        let y = tile / (width / 4) * 4 + in_tile / 4;
        let right = x as f32 + 0.5 - width as f32 / 2.0;
        let down = y as f32 + 0.5 - height as f32 / 2.0;
        Vec3::new(focal, -right, -down)
    };
    (0..width * height)
        .map(|i| ray(eye, direction(i)))
        .collect()
}

/// The rays sorted along a Z-order curve over azimuth and elevation.
fn by_direction(rays: &[Ray]) -> Vec<Ray> {
    let spread = |share: f32| {
        let cell = (share * 4095.0) as u32;
        (0..12).fold(0, |key, bit| key | (cell >> bit & 1) << (2 * bit))
    };
    let key = |r: &Ray| {
        let d = r.direction;
        let azimuth = d.y.atan2(d.x) / TAU + 0.5;
        let elevation = d.z.clamp(-1.0, 1.0).asin() / PI + 0.5;
        spread(azimuth) | spread(elevation) << 1
    };
    let mut rays = rays.to_vec();
    rays.sort_by_key(key);
    rays
}
