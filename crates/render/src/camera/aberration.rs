//! Lateral chromatic aberration: colours are imaged at different sizes.

use glam::{DVec2, Vec3};
use nemoral_scene::Intrinsics;
use rayon::prelude::*;

use crate::error::{ParamError, check};

/// Lateral chromatic aberration. The red and the blue image are larger or smaller than the green
/// one, about the principal point, so that edges far from it have coloured fringes. It is in the
/// picture alone; the truth is that of green.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChromaticAberration {
    /// How far red is shifted outwards half a diagonal from the principal point, pixels, −50..=50;
    /// elsewhere in proportion to the distance.
    pub red_px: f32,
    /// The same for blue.
    pub blue_px: f32,
}

impl ChromaticAberration {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        let allowed = "-50..=50 pixels";
        for (field, shift) in [("lens.red_px", self.red_px), ("lens.blue_px", self.blue_px)] {
            check(field, shift.into(), -50.0, 50.0, allowed)?;
        }
        Ok(())
    }

    /// Shifts red and blue, with linear interpolation, which blurs them a little, as such lenses
    /// do. Beyond the border the picture is constant.
    pub(crate) fn apply(&self, light: &mut [Vec3], intrinsics: &Intrinsics) {
        if *self == Self::default() {
            return;
        }
        let width = intrinsics.width as usize;
        let height = light.len() / width;
        let half_diagonal = 0.5 * DVec2::new(width as f64, height as f64).length();
        let centre = DVec2::new(intrinsics.cx, intrinsics.cy);
        let shrink = |shift: f32| 1.0 / (1.0 + f64::from(shift) / half_diagonal);
        let (red, blue) = (shrink(self.red_px), shrink(self.blue_px));
        let before = light.to_vec();
        let sample = |pixel: DVec2, shrink: f64, channel: usize| {
            let at = centre + (pixel - centre) * shrink - 0.5;
            let x = at.x.clamp(0.0, (width - 1) as f64);
            let y = at.y.clamp(0.0, (height - 1) as f64);
            let (left, top) = (x as usize, y as usize);
            let (right, bottom) = ((left + 1).min(width - 1), (top + 1).min(height - 1));
            let (u, v) = ((x - left as f64) as f32, (y - top as f64) as f32);
            let of = |x: usize, y: usize| before[y * width + x][channel];
            let row = |y: usize| of(left, y) * (1.0 - u) + of(right, y) * u;
            row(top) * (1.0 - v) + row(bottom) * v
        };
        let rows = light.par_chunks_mut(width).enumerate();
        rows.for_each(|(y, row)| {
            for (x, c) in row.iter_mut().enumerate() {
                let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                c.x = sample(pixel, red, 0);
                c.z = sample(pixel, blue, 2);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fringes_are_as_wide_as_asked_for() {
        let optics = Intrinsics::from_fov(320, 240, 1.2).expect("valid");
        let aberration = ChromaticAberration {
            red_px: 4.0,
            blue_px: -2.5,
        };
        // Points on a diagonal, 200 pixels from corner to centre.
        for (x, y) in [(20, 15), (100, 75), (260, 195), (300, 225)] {
            let mut light = vec![Vec3::ZERO; 320 * 240];
            light[y * 320 + x] = Vec3::splat(1000.0);
            aberration.apply(&mut light, &optics);
            let centroid = |channel: usize| {
                let (mut sum, mut total) = (DVec2::ZERO, 0.0);
                for (i, c) in light.iter().enumerate() {
                    let weight = f64::from(c[channel]);
                    let at = DVec2::new((i % 320) as f64, (i / 320) as f64) + 0.5;
                    sum += at * weight;
                    total += weight;
                }
                sum / total
            };
            let green = centroid(1);
            let outwards = (green - DVec2::new(160.0, 120.0)) / 200.0;
            for (channel, shift) in [(0, 4.0), (2, -2.5)] {
                let got = centroid(channel) - green;
                let off = (got - outwards * shift).length();
                // A point between pixels is found where they are.
                assert!(
                    off < 0.12,
                    "{x} {y} {channel}: {got} for {}",
                    outwards * shift
                );
            }
        }
    }

    #[test]
    fn an_even_picture_and_green_stay_as_they_are() {
        let optics = Intrinsics::from_fov(32, 20, 1.0).expect("valid");
        let aberration = ChromaticAberration {
            red_px: -3.0,
            blue_px: 7.0,
        };
        let even = vec![Vec3::new(0.5, 2.0, 7.0); 32 * 20];
        let mut light = even.clone();
        aberration.apply(&mut light, &optics);
        let off = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element();
        assert!(light.iter().zip(&even).map(off).all(|off| off < 1e-5));
        let mut ramp: Vec<Vec3> = (0..640).map(|i| Vec3::splat(i as f32)).collect();
        aberration.apply(&mut ramp, &optics);
        assert!(ramp.iter().enumerate().all(|(i, c)| c.y == i as f32));
    }
}
