//! Baking: makes a texture with darkened hollows from a colour and a height at every texel.

use std::ops::Range;

use glam::{Vec2, Vec3};
use nemoral_scene::Texture;
use rayon::prelude::*;

use crate::lanes::{F32x16, Vec2x16, Vec3x16};

const LANES: usize = F32x16::LANES;

/// A colour and a height at one texel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Texel {
    /// Linear albedo.
    pub(crate) albedo: Vec3,
    /// Height above the base, in any unit that [`Tile::darken_hollows`] is told.
    pub(crate) height: f32,
}

/// Colours and heights of sixteen texels of a row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Texels {
    /// Linear albedo.
    pub(crate) albedo: Vec3x16,
    /// Heights above the base.
    pub(crate) height: F32x16,
}

impl Texels {
    /// Puts the first ones into `texels`, which are at most sixteen.
    fn write(self, texels: &mut [Texel]) {
        let Vec3x16 { x, y, z } = self.albedo;
        let [x, y, z, height] = [x, y, z, self.height].map(F32x16::to_array);
        for (i, texel) in texels.iter_mut().enumerate() {
            *texel = Texel {
                albedo: Vec3::new(x[i], y[i], z[i]),
                height: height[i],
            };
        }
    }

    /// The at most sixteen `texels`; further lanes are 0.
    fn read(texels: &[Texel]) -> Self {
        let lanes = |of: fn(&Texel) -> f32| {
            let mut lanes = [0.0; LANES];
            for (lane, texel) in lanes.iter_mut().zip(texels) {
                *lane = of(texel);
            }
            F32x16::new(lanes)
        };
        Self {
            albedo: Vec3x16 {
                x: lanes(|t| t.albedo.x),
                y: lanes(|t| t.albedo.y),
                z: lanes(|t| t.albedo.z),
            },
            height: lanes(|t| t.height),
        }
    }
}

/// A tile while it is being made; it repeats.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) texels: Vec<Texel>,
}

impl Tile {
    /// Evaluates `f` at every texel's centre, (u, v) in 0..1, sixteen of a row at once. Rows
    /// are independent, so the number of threads cannot matter.
    pub(crate) fn bake(width: usize, height: usize, f: impl Fn(Vec2x16) -> Texels + Sync) -> Self {
        let tile = Self {
            width,
            height,
            texels: vec![Texel::default(); width * height],
        };
        tile.changed(|p, _, _| f(p))
    }

    /// This tile with the texels that `f` makes of the centres, numbers and values of this one's.
    fn changed(mut self, f: impl Fn(Vec2x16, Range<usize>, Texels) -> Texels + Sync) -> Self {
        let (width, scale) = (
            self.width,
            Vec2::new(self.width as f32, self.height as f32).recip(),
        );
        let rows = self.texels.par_chunks_exact_mut(width).enumerate();
        rows.for_each(|(row, line)| {
            let y = (row as f32 + 0.5) * scale.y;
            for (i, texels) in line.chunks_mut(LANES).enumerate() {
                let columns = std::array::from_fn(|lane| (LANES * i + lane) as f32);
                let p = Vec2x16::new((F32x16::new(columns) + 0.5) * scale.x, y);
                let first = row * width + LANES * i;
                let numbers = first..first + texels.len();
                f(p, numbers, Texels::read(texels)).write(texels);
            }
        });
        self
    }

    /// Multiplies colours by a factor that depends on the height relative to the mean of a square
    /// of 2 `radius` + 1 texels: it is 1 at and above that mean and falls with the depth below it,
    /// to 1 / (1 + `strength`) at `depth`. It stands for the shadow in cracks, as there are neither
    /// normal maps nor ambient rays at that scale.
    pub(crate) fn darken_hollows(&mut self, radius: usize, depth: f32, strength: f32) {
        let around = self.blurred_heights(radius);
        let k = strength / depth;
        self.texels
            .par_iter_mut()
            .zip(around)
            .for_each(|(t, around)| {
                let below = around - t.height;
                // Crests are a little lighter than the mean: worn, dry, in the light.
                let factor = if below > 0.0 {
                    1.0 / (1.0 + k * below)
                } else {
                    1.0 + 0.12 * (-k * below).min(1.0)
                };
                t.albedo *= factor;
            });
    }

    /// The mean height of the square around each texel.
    fn blurred_heights(&self, radius: usize) -> Vec<f32> {
        let width = self.width;
        let mut rows = vec![0.0; self.texels.len()];
        let lines = rows.par_chunks_exact_mut(width);
        lines
            .zip(self.texels.par_chunks_exact(width))
            .for_each(|(out, line)| {
                let heights: Vec<f32> = line.iter().map(|t| t.height).collect();
                running_mean(&heights, radius, out);
            });
        running_mean_of_rows(&rows, width, radius)
    }

    /// Scales colours so that their mean has the luminance of `albedo`; hues do not change.
    pub(crate) fn with_luminance_of(mut self, albedo: Vec3) -> Self {
        let sum: f64 = self
            .texels
            .iter()
            .map(|t| f64::from(luminance(t.albedo)))
            .sum();
        let mean = (sum / self.texels.len() as f64) as f32;
        let factor = luminance(albedo) / mean.max(1e-6);
        self.texels
            .par_iter_mut()
            .for_each(|t| t.albedo = (t.albedo * factor).clamp(Vec3::ZERO, Vec3::splat(0.9)));
        self
    }

    /// Scales each channel so that the mean colour is `albedo`.
    pub(crate) fn with_mean(mut self, albedo: Vec3) -> Self {
        let mean = |texels: &[Texel]| {
            let sum = texels.iter().fold([0.0_f64; 3], |s, t| {
                let c = t.albedo.to_array();
                [0, 1, 2].map(|k| s[k] + f64::from(c[k]))
            });
            Vec3::from_array(sum.map(|s| (s / texels.len() as f64) as f32))
        };
        // The second round makes up for what the first one clamps.
        for _ in 0..2 {
            let factor = albedo / mean(&self.texels).max(Vec3::splat(1e-6));
            self.texels
                .par_iter_mut()
                .for_each(|t| t.albedo = (t.albedo * factor).clamp(Vec3::ZERO, Vec3::splat(0.9)));
        }
        self
    }

    /// This tile where `share` is 0, `other` where it is 1. Both have one size.
    pub(crate) fn blend(&self, other: &Self, share: impl Fn(Vec2x16) -> F32x16 + Sync) -> Self {
        self.clone().changed(|p, numbers, a| {
            let (b, t) = (Texels::read(&other.texels[numbers]), share(p));
            Texels {
                albedo: a.albedo.lerp(b.albedo, t),
                height: a.height + (b.height - a.height) * t,
            }
        })
    }

    /// The same tile with every colour changed by its position and height.
    pub(crate) fn recolour(&self, f: impl Fn(Vec2x16, Texels) -> Vec3x16 + Sync) -> Self {
        self.clone().changed(|p, _, texels| Texels {
            albedo: f(p, texels),
            ..texels
        })
    }

    /// The same at half the resolution: the mean of four texels each.
    pub(crate) fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mean = |i: usize| {
            let first = 2 * (i / width) * self.width + 2 * (i % width);
            let four = [first, first + 1, first + self.width, first + self.width + 1];
            let sum = four.map(|k| self.texels[k]).into_iter();
            sum.fold(Texel::default(), |sum, t| Texel {
                albedo: sum.albedo + 0.25 * t.albedo,
                height: sum.height + 0.25 * t.height,
            })
        };
        Self {
            width,
            height,
            texels: (0..width * height).into_par_iter().map(mean).collect(),
        }
    }

    /// The finished texture.
    pub(crate) fn texture(&self) -> Texture {
        let linear: Vec<Vec3> = self.texels.iter().map(|t| t.albedo).collect();
        Texture::from_linear(self.width, self.height, &linear)
            .expect("tiles have power-of-two sides")
    }
}

/// Luminance of linear sRGB (Rec. 709).
pub(crate) fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// The mean of the 2 `radius` + 1 values around each, on a ring.
fn running_mean(line: &[f32], radius: usize, out: &mut [f32]) {
    let n = line.len();
    let around = 2 * radius + 1;
    // The ring is unrolled: from `radius` before the first one to one beyond the last one's.
    let first = (n - radius % n) % n;
    let ring: Vec<f32> = line
        .iter()
        .cycle()
        .skip(first)
        .take(n + around)
        .copied()
        .collect();
    // Sums of f32 in f64 are exact enough that the ring closes without drift.
    let mut sum: f64 = ring[..around].iter().map(|&x| f64::from(x)).sum();
    let share = 1.0 / around as f64;
    for (mean, (&left, &entered)) in out.iter_mut().zip(ring.iter().zip(&ring[around..])) {
        *mean = (sum * share) as f32;
        sum += f64::from(entered) - f64::from(left);
    }
}

/// As [`running_mean`], of the columns of rows of `width`, many columns at once.
fn running_mean_of_rows(values: &[f32], width: usize, radius: usize) -> Vec<f32> {
    /// So many rows are computed one after the other.
    const STRIP: usize = 128;
    let height = values.len() / width;
    // The row that is `back` before another one, on the ring.
    let row = |number: usize, back: usize| {
        let number = (number + (back / height + 1) * height - back) % height;
        &values[number * width..(number + 1) * width]
    };
    let share = 1.0 / (2 * radius + 1) as f64;
    let mut means = vec![0.0; values.len()];
    let strips = means.par_chunks_mut(STRIP * width).enumerate();
    strips.for_each(|(strip, means)| {
        let first = strip * STRIP;
        let mut sums = vec![0.0_f64; width];
        for offset in 0..=2 * radius {
            let row = row(first + offset, radius);
            sums.iter_mut()
                .zip(row)
                .for_each(|(s, &x)| *s += f64::from(x));
        }
        for (i, means) in (first..).zip(means.chunks_exact_mut(width)) {
            let (left, entered) = (row(i, radius), row(i + radius + 1, 0));
            for (mean, sum) in means.iter_mut().zip(&sums) {
                *mean = (sum * share) as f32;
            }
            for ((sum, &left), &entered) in sums.iter_mut().zip(left).zip(entered) {
                *sum += f64::from(entered) - f64::from(left);
            }
        }
    });
    means
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_running_mean_is_the_brute_force_one() {
        let line: Vec<f32> = (0..17).map(|i| ((i * 7) % 5) as f32).collect();
        for radius in [0, 1, 4] {
            let mut got = vec![0.0; 17];
            running_mean(&line, radius, &mut got);
            for i in 0..17_usize {
                let want = (0..=2 * radius)
                    .map(|k| line[(i + 17 * 4 + k - radius) % 17])
                    .sum::<f32>()
                    / (2 * radius + 1) as f32;
                assert!((got[i] - want).abs() < 1e-5, "{i} of {radius}");
            }
        }
    }

    #[test]
    fn rows_have_the_running_mean_of_their_columns() {
        let (width, height) = (3, 300);
        let values: Vec<f32> = (0..width * height)
            .map(|i| ((i * 37) % 101) as f32)
            .collect();
        for radius in [0, 5, 149, 200] {
            let got = running_mean_of_rows(&values, width, radius);
            for x in 0..width {
                let of_column = |all: &[f32]| -> Vec<f32> {
                    all.iter().skip(x).step_by(width).copied().collect()
                };
                let mut want = vec![0.0; height];
                running_mean(&of_column(&values), radius, &mut want);
                assert_eq!(of_column(&got), want);
            }
        }
    }

    #[test]
    fn hollows_are_dark_and_the_mean_is_met() {
        let mut tile = Tile::bake(16, 16, |p| Texels {
            albedo: Vec3::splat(0.2).into(),
            height: (p.x - 0.5).abs().lt(0.1).select(-1.0, 0.0),
        });
        tile.darken_hollows(3, 1.0, 2.0);
        assert!(tile.texels[8].albedo.x < 0.6 * tile.texels[0].albedo.x);
        let target = Vec3::new(0.1, 0.2, 0.05);
        let texture = tile.with_luminance_of(target).texture();
        assert!((luminance(texture.mean()) - luminance(target)).abs() < 0.003);
    }
}
