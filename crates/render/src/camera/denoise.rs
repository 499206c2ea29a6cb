//! Noise reduction, as cameras do it.

use glam::Vec3;
use rayon::prelude::*;

/// Pixels on each side that are looked at.
const REACH: usize = 3;
/// The spatial spread, pixels.
const SPATIAL: f64 = 1.5;
/// The spread of code values at full strength.
const STRONGEST: f32 = 40.0;
/// Weights beyond this multiple of the spread's square are zero.
const FAR: f32 = 8.0;
/// Entries of the table of weights in a unit of the squared difference over that of the spread.
const STEPS: f32 = 64.0;

/// A bilateral filter (Tomasi and Manduchi 1998) of code values, row by row: a Gaussian of 1.5
/// pixels over 7 × 7, times one of the difference in colour, whose spread is 40 codes at
/// strength 1.
pub(super) fn denoise(levels: &mut [Vec3], width: usize, strength: f64) {
    if strength == 0.0 {
        return;
    }
    let spread = STRONGEST * strength as f32;
    let (spatial, similar) = (spatial_weights(), similarity_weights());
    let unit = STEPS / (spread * spread);
    let before = levels.to_vec();
    let height = levels.len() / width;
    levels
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, row)| {
            let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(height);
            for (x, out) in row.iter_mut().enumerate() {
                let here = before[y * width + x];
                let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(width);
                let (mut sum, mut total) = (Vec3::ZERO, 0.0);
                for v in rows.clone() {
                    for u in columns.clone() {
                        let there = before[v * width + u];
                        let cell = ((there - here).length_squared() * unit) as usize;
                        let Some(similar) = similar.get(cell) else {
                            continue;
                        };
                        let weight = spatial[v.abs_diff(y)] * spatial[u.abs_diff(x)] * similar;
                        sum += there * weight;
                        total += weight;
                    }
                }
                *out = sum / total;
            }
        });
}

/// exp(-d² / 2σ²) of distances of 0 to [`REACH`] pixels.
fn spatial_weights() -> [f32; REACH + 1] {
    let weight = |d: f64| libm::exp(-d * d / (2.0 * SPATIAL * SPATIAL)) as f32;
    std::array::from_fn(|d| weight(d as f64))
}

/// exp(-x / 2) of x = d² / σ², in steps of 1 / [`STEPS`].
fn similarity_weights() -> Vec<f32> {
    let weight = |i: usize| libm::exp(-0.5 * i as f64 / f64::from(STEPS)) as f32;
    (0..=(FAR * STEPS) as usize).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use nemoral_seed::{Draw, Key};

    use super::*;

    #[test]
    fn weak_noise_is_reduced_as_by_a_gaussian_and_edges_stay() {
        let mut rng = Key::world(3).rng();
        let (width, height) = (128, 128);
        let mut levels: Vec<Vec3> = (0..width * height)
            .map(|i| {
                let step = if i % width < width / 2 { 40.0 } else { 200.0 };
                Vec3::splat(step + rng.normal() as f32)
            })
            .collect();
        denoise(&mut levels, width, 1.0);
        let w: Vec<f64> = (0..=6_usize)
            .map(|i| spatial_weights()[i.abs_diff(REACH)].into())
            .collect();
        let (sum, squares): (f64, f64) = (w.iter().sum(), w.iter().map(|w| w * w).sum());
        // The variance of a mean with these weights along both axes.
        let exact = (squares / (sum * sum)).powi(2);
        for (columns, mean) in [(8..56, 40.0), (72..120, 200.0)] {
            let off = |i: usize| f64::from(levels[i].y) - mean;
            let inside: Vec<f64> = (0..width * height)
                .filter(|i| columns.contains(&(i % width)) && (8..120).contains(&(i / width)))
                .map(off)
                .collect();
            let variance = inside.iter().map(|d| d * d).sum::<f64>() / inside.len() as f64;
            assert!(
                (variance / exact - 1.0).abs() < 0.25,
                "{variance} for {exact}"
            );
        }
        // The step is still between the same two columns.
        for y in 0..height {
            let (left, right) = (levels[y * width + 63].y, levels[y * width + 64].y);
            assert!((left - 40.0).abs() < 3.0 && (right - 200.0).abs() < 3.0);
        }
    }

    #[test]
    fn without_strength_nothing_changes() {
        let before: Vec<Vec3> = (0..60)
            .map(|i| Vec3::splat((i * 37 % 200) as f32))
            .collect();
        let mut after = before.clone();
        denoise(&mut after, 10, 0.0);
        assert_eq!(before, after);
    }
}
