//! Sharpening, as cameras do it.

use glam::Vec3;
use rayon::prelude::*;

use super::luma::luma;

/// An unsharp mask of luma: each channel gets `amount` times the difference of the pixel's luma
/// from its Gaussian mean, so that colours do not gain fringes.
pub(super) fn sharpen(levels: &mut [Vec3], width: usize, amount: f64, radius_px: f64) {
    if amount == 0.0 {
        return;
    }
    let own: Vec<f32> = levels.par_iter().map(|c| luma(*c)).collect();
    let mean = gaussian(&own, width, &kernel(radius_px));
    let amount = amount as f32;
    (levels.par_iter_mut().zip(own.par_iter().zip(&mean)))
        .for_each(|(c, (own, mean))| *c += Vec3::splat(amount * (own - mean)));
}

/// Weights at distances of 0, 1, … pixels to three spreads; with both sides they add up to 1.
fn kernel(sigma: f64) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil() as usize;
    let weight = |d: usize| libm::exp(-0.5 * (d * d) as f64 / (sigma * sigma));
    let one_side: Vec<f64> = (0..=reach).map(weight).collect();
    let sum = one_side[0] + 2.0 * one_side[1..].iter().sum::<f64>();
    one_side.iter().map(|w| (w / sum) as f32).collect()
}

/// Beyond the border the picture is constant.
fn gaussian(values: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let height = values.len() / width;
    let mut rows = vec![0.0; values.len()];
    rows.par_chunks_mut(width)
        .zip(values.par_chunks(width))
        .for_each(|(out, row)| {
            for (x, out) in out.iter_mut().enumerate() {
                let at = |d: usize| row[x.saturating_sub(d)] + row[(x + d).min(width - 1)];
                *out =
                    row[x] * kernel[0] + (1..kernel.len()).map(|d| at(d) * kernel[d]).sum::<f32>();
            }
        });
    let mut both = vec![0.0; values.len()];
    both.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (d, weight) in kernel.iter().enumerate() {
            let (above, below) = (y.saturating_sub(d), (y + d).min(height - 1));
            let line = |y: usize| &rows[y * width..(y + 1) * width];
            for ((out, a), b) in out.iter_mut().zip(line(above)).zip(line(below)) {
                *out += weight * if d == 0 { *a } else { a + b };
            }
        }
    });
    both
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_wave_is_raised_by_the_filters_transfer_function() {
        for (period, radius, amount) in [(4.0, 0.8, 1.5), (8.0, 1.0, 0.7), (32.0, 2.5, 3.0)] {
            let (width, height) = (128, 24);
            let wave = |x: usize| (TAU * x as f64 / period).cos();
            let mut levels: Vec<Vec3> = (0..width * height)
                .map(|i| Vec3::splat((128.0 + 20.0 * wave(i % width)) as f32))
                .collect();
            sharpen(&mut levels, width, amount, radius);
            // The Fourier transform of a Gaussian, which the sampled one is near to.
            let blurred = (-0.5 * (TAU * radius / period).powi(2)).exp();
            let gain = 1.0 + amount * (1.0 - blurred);
            let row = &levels[12 * width..13 * width];
            for (x, c) in row.iter().enumerate().take(96).skip(32) {
                let exact = 128.0 + 20.0 * gain * wave(x);
                let off = (f64::from(c.y) - exact).abs();
                assert!(off < 0.35, "{period} {radius}: {} for {exact}", c.y);
            }
        }
    }

    #[test]
    fn even_areas_and_colours_stay() {
        let colour = Vec3::new(10.0, 120.0, 240.0);
        let mut levels = vec![colour; 40 * 30];
        levels[15 * 40 + 20] += Vec3::splat(30.0);
        sharpen(&mut levels, 40, 2.0, 1.0);
        assert!((levels[0] - colour).abs().max_element() < 1e-3);
        let differences = |c: Vec3| (c.y - c.x, c.z - c.y);
        for c in &levels {
            let (a, b) = (differences(*c), differences(colour));
            assert!((a.0 - b.0).abs() < 1e-3 && (a.1 - b.1).abs() < 1e-3);
        }
        assert!(levels[15 * 40 + 20].y > 150.0 && levels[15 * 40 + 21].y < 120.0);
    }
}
