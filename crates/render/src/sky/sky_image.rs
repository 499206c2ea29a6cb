//! A photographed sky.

use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::Image;

use crate::colour::LUMINANCE;
use crate::error::{ParamError, check};

/// The sun in a photograph is limited to this multiple of the sky's median luminance, because the
/// sun is modelled separately, and its disc would be noise in the nine coefficients of irradiance.
const BRIGHTEST: f32 = 50.0;

/// An equirectangular image of the sky: columns go once around, rows from the zenith to the nadir.
///
/// Only the upper half is used; directions below the horizon show the horizon, as with modelled
/// skies.
#[derive(Clone, Debug)]
pub struct SkyImage {
    width: usize,
    /// Rows from the zenith to the horizon.
    rows: usize,
    /// The mean of the whole image.
    height: usize,
    radiance: Arc<[Vec3]>,
    /// The compass direction of the left edge, clockwise from north.
    left_rad: f32,
}

impl SkyImage {
    /// A sky from linear sRGB in any unit. The middle column is in the direction `azimuth_deg`,
    /// clockwise from north, and columns to the right of it follow clockwise. Pixels more than 50
    /// times as bright as the median (the sun) are limited to that, in their own colour.
    ///
    /// # Errors
    /// If the image has fewer than 4 × 2 pixels or more than 16384 a side, a value that is negative
    /// or NaN, or no light at all in its upper half.
    pub fn new(image: &Image<Vec3>, azimuth_deg: f64) -> Result<Self, ParamError> {
        let (width, height) = (image.width(), image.height());
        let sides = "4..=16384 wide and 2..=16384 high";
        check("sky_image.width", width as f64, 4.0, 16384.0, sides)?;
        check("sky_image.height", height as f64, 2.0, 16384.0, sides)?;
        check(
            "sky_image.azimuth_deg",
            azimuth_deg,
            -360.0,
            360.0,
            "-360..=360",
        )?;
        let rows = height.div_ceil(2);
        let mut radiance = image.pixels()[..rows * width].to_vec();
        for c in radiance.iter().flat_map(|c| c.to_array()) {
            let most = f64::from(f32::MAX);
            check("sky_image", c.into(), 0.0, most, "numbers from 0 up")?;
        }
        let mut levels: Vec<f32> = radiance.iter().map(|c| c.dot(LUMINANCE)).collect();
        let middle = levels.len() / 2;
        let median = *levels.select_nth_unstable_by(middle, f32::total_cmp).1;
        let brightest = levels.iter().copied().fold(0.0, f32::max);
        check(
            "sky_image",
            brightest.into(),
            f64::from(f32::MIN_POSITIVE),
            f64::from(f32::MAX),
            "above 0 somewhere above the horizon",
        )?;
        if median > 0.0 {
            for c in &mut radiance {
                *c *= (BRIGHTEST * median / c.dot(LUMINANCE)).min(1.0);
            }
        }
        Ok(Self {
            width,
            rows,
            height,
            radiance: radiance.into(),
            left_rad: (azimuth_deg.to_radians() as f32) - PI,
        })
    }

    /// Multiplies all light.
    pub(crate) fn scaled(&self, by: f32) -> Self {
        Self {
            radiance: self.radiance.iter().map(|&c| c * by).collect(),
            ..self.clone()
        }
    }

    /// Adds light from all directions equally.
    pub(crate) fn veiled(&self, veil: Vec3) -> Self {
        Self {
            radiance: self.radiance.iter().map(|&c| c + veil).collect(),
            ..self.clone()
        }
    }

    /// The radiance from a unit direction (x east, y north, z up), interpolated between four
    /// pixels.
    pub(crate) fn radiance(&self, direction: Vec3) -> Vec3 {
        let azimuth = libm::atan2f(direction.x, direction.y);
        let turn = (azimuth - self.left_rad) / TAU;
        let x = (turn - turn.floor()) * self.width as f32 - 0.5;
        let from_zenith = FRAC_PI_2 - libm::asinf(direction.z.clamp(0.0, 1.0));
        let y = from_zenith / PI * self.height as f32 - 0.5;
        let y = y.clamp(0.0, (self.rows - 1) as f32);
        let (left, top) = (x.floor(), y.floor());
        let (u, v) = (x - left, y - top);
        let column = |i: i64| i.rem_euclid(self.width as i64) as usize;
        let (a, b) = (column(left as i64), column(left as i64 + 1));
        let (top, below) = (top as usize, (top as usize + 1).min(self.rows - 1));
        let row = |r: usize| {
            let row = &self.radiance[r * self.width..][..self.width];
            row[a].lerp(row[b], u)
        };
        row(top).lerp(row(below), v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sun;

    fn towards(azimuth: f64, elevation: f64) -> Vec3 {
        let sun = Sun::from_angles(azimuth, elevation).expect("valid");
        sun.direction().as_vec3()
    }

    /// Red grows to the right, green downwards.
    fn chart(width: usize, height: usize) -> Image<Vec3> {
        let pixel = |i: usize| {
            let (x, y) = ((i % width) as f32, (i / width) as f32);
            Vec3::new((x + 0.5) / width as f32, (y + 0.5) / height as f32, 1.0)
        };
        Image::new(width, height, (0..width * height).map(pixel).collect())
    }

    #[test]
    fn columns_run_clockwise_and_rows_down() {
        let sky = SkyImage::new(&chart(64, 32), 90.0).expect("valid");
        for (azimuth, elevation) in [(90.0, 40.0), (135.0, 10.0), (10.0, 70.0), (260.0, 55.0)] {
            let c = sky.radiance(towards(azimuth, elevation));
            let turn = (azimuth - 90.0) / 360.0 + 0.5;
            assert!((f64::from(c.x) - turn).abs() < 1e-3, "{azimuth}: {c}");
            let down = (90.0 - elevation) / 180.0;
            assert!((f64::from(c.y) - down).abs() < 1e-3, "{elevation}: {c}");
        }
        // Across the seam, and below the horizon.
        let seam = sky.radiance(towards(270.0, 20.0));
        assert!((seam.x - 0.5).abs() < 0.01, "{seam}");
        let (at, below) = (towards(120.0, 0.0), towards(120.0, -50.0));
        let (at, below) = (sky.radiance(at), sky.radiance(below));
        assert!((at - below).length() < 1e-3, "{at} {below}");
    }

    #[test]
    fn the_sun_in_it_is_cut_in_its_colour() {
        let mut pixels = vec![Vec3::ONE; 64 * 32];
        pixels[5 * 64 + 7] = Vec3::new(4e5, 2e5, 1e5);
        let sky = SkyImage::new(&Image::new(64, 32, pixels), 0.0).expect("valid");
        let most = sky.radiance.iter().fold(Vec3::ZERO, |a, &c| a.max(c));
        assert!((most.dot(LUMINANCE) - 50.0).abs() < 0.01, "{most}");
        assert!((most.x / most.y - 2.0).abs() < 1e-3 && (most.y / most.z - 2.0).abs() < 1e-3);
    }

    #[test]
    fn no_sky_is_refused() {
        let flat = |w, h, c| SkyImage::new(&Image::new(w, h, vec![Vec3::splat(c); w * h]), 0.0);
        assert!(flat(4, 2, 1.0).is_ok());
        for (image, field) in [
            (flat(2, 2, 1.0), "sky_image.width"),
            (flat(4, 1, 1.0), "sky_image.height"),
            (flat(8, 4, 0.0), "sky_image"),
            (flat(8, 4, -1.0), "sky_image"),
            (flat(8, 4, f32::NAN), "sky_image"),
        ] {
            assert_eq!(image.expect_err("no sky").field, field);
        }
    }
}
