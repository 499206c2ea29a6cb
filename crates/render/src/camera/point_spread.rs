//! How far a lens and a sensor spread the light of a point.

use glam::Vec3;
use rayon::prelude::*;

/// Rows that are processed together.
const ROWS: usize = 16;

/// Spreads the light of each pixel by a Gaussian of `sigma_px`, which is cut where it is below a
/// hundredth of its peak. Beyond the border the picture goes on as at the border.
pub(super) fn spread(light: &mut [Vec3], width: usize, sigma_px: f32) {
    let weights = weights(sigma_px);
    if weights.len() == 1 {
        return;
    }
    let reach = weights.len() - 1;
    light.par_chunks_mut(width * ROWS).for_each(|rows| {
        let mut padded = vec![Vec3::ZERO; width + 2 * reach];
        for row in rows.chunks_exact_mut(width) {
            padded[..reach].fill(row[0]);
            padded[reach..reach + width].copy_from_slice(row);
            padded[reach + width..].fill(row[width - 1]);
            for (x, out) in row.iter_mut().enumerate() {
                let mut sum = padded[x + reach] * weights[0];
                for (k, weight) in weights.iter().enumerate().skip(1) {
                    sum += (padded[x + reach - k] + padded[x + reach + k]) * *weight;
                }
                *out = sum;
            }
        }
    });
    let height = light.len() / width;
    let along_rows = light.to_vec();
    let row = |y: usize| &along_rows[y * width..][..width];
    light
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, out)| {
            for (c, here) in out.iter_mut().zip(row(y)) {
                *c = *here * weights[0];
            }
            for (k, weight) in weights.iter().enumerate().skip(1) {
                let (above, below) = (row(y.saturating_sub(k)), row((y + k).min(height - 1)));
                for ((c, a), b) in out.iter_mut().zip(above).zip(below) {
                    *c += (*a + *b) * *weight;
                }
            }
        });
}

/// The weights of a pixel and of those 1, 2, ... pixels beside it; with those on both sides their
/// sum is 1.
fn weights(sigma_px: f32) -> Vec<f32> {
    let sigma = f64::from(sigma_px);
    let peak = |k: f64| libm::exp(-0.5 * (k / sigma) * (k / sigma));
    let beside: Vec<f64> = (1..)
        .map(|k| peak(f64::from(k)))
        .take_while(|&weight| weight > 0.01)
        .collect();
    let sum = 1.0 + 2.0 * beside.iter().sum::<f64>();
    std::iter::once(1.0)
        .chain(beside)
        .map(|weight| (weight / sum) as f32)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_point_is_spread_by_a_gaussian(
            sigma in 0.5_f32..3.0,
            x in 12_usize..20,
            y in 12_usize..20,
        ) {
            let mut light = vec![Vec3::ZERO; 32 * 32];
            light[y * 32 + x] = Vec3::new(1.0, 2.0, 4.0);
            spread(&mut light, 32, sigma);
            let sum: Vec3 = light.iter().sum();
            prop_assert!((sum / Vec3::new(1.0, 2.0, 4.0) - 1.0).abs().max_element() < 1e-5);
            let variance: f32 = light
                .iter()
                .enumerate()
                .map(|(i, c)| c.x * ((i % 32) as f32 - x as f32).powi(2))
                .sum();
            prop_assert!((variance.sqrt() / sigma - 1.0).abs() < 0.1, "{}", variance.sqrt());
            // It is the same along columns.
            for k in 0..12 {
                let (right, down) = (light[y * 32 + x + k], light[(y + k) * 32 + x]);
                prop_assert!((right - down).abs().max_element() < 1e-6);
            }
        }

        #[test]
        fn an_even_picture_stays_even(
            sigma in 0.0_f32..4.0,
            width in 1_usize..40,
            height in 1_usize..40,
        ) {
            let colour = Vec3::new(3.0, 2.0, 1.0);
            let mut light = vec![colour; width * height];
            spread(&mut light, width, sigma);
            let even = |c: &Vec3| (*c / colour - 1.0).abs().max_element() < 1e-5;
            prop_assert!(light.iter().all(even));
        }
    }

    #[test]
    fn a_lens_without_spread_changes_nothing() {
        let light: Vec<Vec3> = (0..64).map(|i| Vec3::splat(i as f32)).collect();
        for sigma in [0.0, 0.3] {
            let mut spread_out = light.clone();
            spread(&mut spread_out, 8, sigma);
            assert_eq!(spread_out, light);
        }
    }
}
