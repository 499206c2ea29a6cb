//! The target's colours as radiance, with the sky behind them.

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use crate::sky::haze::Haze;
use crate::{Lighting, View};

/// The scale of the target's colours, and the sky behind them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Backdrop {
    pub(super) range_m: f32,
    /// The factor from radiance to the target's colours.
    pub(super) scale: f32,
}

impl Backdrop {
    /// Adds the radiance from the target's rows, with the sky behind.
    pub(crate) fn compose(
        &self,
        rows: &mut dyn Iterator<Item = &[u8]>,
        view: &View,
        lighting: &Lighting,
        linear: &mut [Vec3],
    ) {
        let width = view.intrinsics.width as usize;
        let haze = self.haze(lighting, view);
        let rows: Vec<&[u8]> = rows.collect();
        linear
            .par_chunks_mut(width)
            .zip(rows)
            .enumerate()
            .for_each(|(y, (out, row))| {
                for (x, (out, texel)) in out.iter_mut().zip(row.chunks_exact(8)).enumerate() {
                    let half =
                        |i: usize| from_half(u16::from_le_bytes([texel[2 * i], texel[2 * i + 1]]));
                    let covered = half(3).clamp(0.0, 1.0);
                    *out += Vec3::new(half(0), half(1), half(2)) / self.scale;
                    if covered < 1.0 {
                        let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                        let d = view.ray(centre, 1.0).direction;
                        let sky = lighting.background(&haze, d)
                            + lighting.sun_in_pixel(&haze, view, centre, d);
                        *out += sky * (1.0 - covered);
                    }
                }
            });
    }

    /// The air around the camera.
    pub(super) fn haze(&self, lighting: &Lighting, view: &View) -> Haze {
        let height = view.scene_from_camera.translation_m.z as f32;
        lighting.haze(height, self.range_m)
    }
}

/// The value of an IEEE 754 binary16 number.
fn from_half(bits: u16) -> f32 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023) / 1024.0);
    let size = match exponent {
        0 => fraction * 2.0_f32.powi(-14),
        31 => f32::INFINITY,
        e => (1.0 + fraction) * 2.0_f32.powi(e - 15),
    };
    sign * size
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves() {
        for (bits, value) in [
            (0x0000, 0.0),
            (0x3C00, 1.0),
            (0xC000, -2.0),
            (0x7BFF, 65504.0),
            (0x0001, 5.960_464_5e-8),
            (0x3555, 0.333_251_95),
        ] {
            assert_eq!(from_half(bits), value, "{bits:#x}");
        }
    }
}
