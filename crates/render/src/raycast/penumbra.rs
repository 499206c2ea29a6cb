//! Penumbrae that are wider than a few pixels.
//!
//! Where sun comes through needles high above, its light is smooth over a hand's width, but one
//! shadow ray a pixel arrives or not, and the mean over 5 × 5 pixels leaves spots that are nowhere
//! in the forest and lie elsewhere in each frame. So the mean goes on over as many pixels as the
//! penumbra is wide: the sun's angle times the distance of what blocks its rays, as on a screen
//! (Fernando 2005, "Percentage-closer soft shadows").

use glam::Vec3;
use rayon::prelude::*;

use super::frame_buffer::{FrameBuffer, LATTICE};
use crate::Sun;

/// The weight of a pixel by its number of steps along a row or a column.
const WEIGHTS: [f32; 3] = [3.0, 2.0, 1.0];
/// The half steps by which the pixels of a row are farther right, and those of a column farther
/// down: side by side in all rows, they would pass on what differs between neighbours as a grid.
const STAGGER: [isize; 5] = [0, 1, 0, -1, 0];
/// The spread of these weights, steps.
const SPREAD: f32 = 1.155;
/// The widest step, pixels. Beyond, steps would be wider than the mean over 5 × 5 pixels.
const WIDEST: f32 = 5.0;

/// The share of the sun's disc for each pixel: the mean of the `shares` of surrounding pixels on
/// the same surface. Its spread is that of the sun's disc, seen through a pinhole in what blocks
/// the shadow rays around the pixel.
pub(super) fn penumbrae(frame: &FrameBuffer, shares: &[f32], focal_px: f32) -> Vec<f32> {
    let mut wide = vec![0.0; shares.len()];
    wide.par_chunks_mut(frame.width)
        .enumerate()
        .for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let i = y * frame.width + x;
                *out = shares[i];
                if frame.sun.radiance[i] == Vec3::ZERO {
                    continue;
                }
                // A uniform disc's spread along an axis is half of its radius.
                let radius_px = Sun::ANGULAR_RADIUS_RAD as f32 * blocker_m(frame, x, y) * focal_px
                    / frame.depth_m[i];
                let step = (0.5 * radius_px / SPREAD).min(WIDEST).round() as usize;
                if step > 0 {
                    *out = mean(frame, shares, (x, y), step);
                }
            }
        });
    wide
}

/// The mean distance of what blocks the shadow rays of pixels around one on the same surface,
/// metres; 0 if nothing does.
fn blocker_m(frame: &FrameBuffer, x: usize, y: usize) -> f32 {
    let (width, height) = (frame.width, frame.depth_m.len() / frame.width);
    let (columns, rows) = (width.div_ceil(LATTICE), height.div_ceil(LATTICE));
    let (left, top) = (x / LATTICE, y / LATTICE);
    let i = y * width + x;
    let (mut sum, mut count) = (0.0, 0.0);
    for v in top.saturating_sub(1)..(top + 2).min(rows) {
        for u in left.saturating_sub(1)..(left + 2).min(columns) {
            let distance_m = frame.blocker_m[v * columns + u];
            if distance_m == 0.0 {
                continue;
            }
            let j = (v * LATTICE + LATTICE / 2) * width + u * LATTICE + LATTICE / 2;
            if frame.sun.radiance[j] != Vec3::ZERO
                && frame.shows(j, frame.object[i], frame.depth_m[i], frame.normal[i])
            {
                sum += distance_m;
                count += 1.0;
            }
        }
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

/// The weighted mean of 5 × 5 shares, `step` pixels apart, on the same surface.
fn mean(frame: &FrameBuffer, shares: &[f32], (x, y): (usize, usize), step: usize) -> f32 {
    let (width, height) = (frame.width, frame.depth_m.len() / frame.width);
    let i = y * width + x;
    let (object, depth_m, normal) = (frame.object[i], frame.depth_m[i], frame.normal[i]);
    let (mut sum, mut all) = (0.0, 0.0);
    for down in 0..5 {
        for right in 0..5 {
            let at = |middle: usize, steps: usize, other: usize| {
                let half = STAGGER[other] * (step / 2) as isize;
                (middle + steps * step)
                    .checked_add_signed(half)?
                    .checked_sub(2 * step)
            };
            let (v, u) = (at(y, down, right), at(x, right, down));
            let (Some(v), Some(u)) = (v.filter(|v| *v < height), u.filter(|u| *u < width)) else {
                continue;
            };
            let j = v * width + u;
            if frame.sun.radiance[j] != Vec3::ZERO && frame.shows(j, object, depth_m, normal) {
                let weight = WEIGHTS[down.abs_diff(2)] * WEIGHTS[right.abs_diff(2)];
                sum += weight * shares[j];
                all += weight;
            }
        }
    }
    sum / all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall 10 m away, of which every seventh pixel sees the sun.
    fn speckled(blocker_m: f32) -> (FrameBuffer, Vec<f32>) {
        let mut frame = FrameBuffer::new(96, 64);
        frame.depth_m.fill(10.0);
        frame.normal.fill(Vec3::Z);
        frame.sun.radiance.fill(Vec3::ONE);
        frame.blocker_m.fill(blocker_m);
        let shares = (0..96 * 64).map(|i| f32::from(u8::from(i * 31 % 7 == 0)));
        let shares = shares.collect();
        (frame, shares)
    }

    #[test]
    fn distant_leaves_cast_smooth_shadows_and_near_ones_sharp() {
        let (frame, shares) = speckled(0.0);
        assert_eq!(penumbrae(&frame, &shares, 700.0), shares);
        // 0.1 m before the wall the disc is a fifteenth of a pixel wide.
        let (frame, shares) = speckled(0.1);
        assert_eq!(penumbrae(&frame, &shares, 700.0), shares);
        let (frame, shares) = speckled(20.0);
        let wide = penumbrae(&frame, &shares, 700.0);
        let spread = |shares: &[f32]| {
            let mean = shares.iter().sum::<f32>() / shares.len() as f32;
            let squares = shares.iter().map(|s| (s - mean).powi(2)).sum::<f32>();
            (mean, (squares / shares.len() as f32).sqrt())
        };
        let ((mean, rough), (kept, smooth)) = (spread(&shares), spread(&wide));
        assert!((mean - kept).abs() < 0.01, "{mean} {kept}");
        assert!(smooth < 0.5 * rough, "{rough} {smooth}");
    }

    #[test]
    fn no_grid_is_left() {
        let (frame, _) = speckled(20.0);
        for step in 2..=5 {
            // What differs between columns with a period of one step: a mean side by side would
            // keep all of it.
            let wave = |x: usize| libm::cos(std::f64::consts::TAU * x as f64 / step as f64) as f32;
            let shares: Vec<f32> = (0..96 * 64).map(|i| 0.5 + 0.1 * wave(i % 96)).collect();
            let row: Vec<f32> = (30..60)
                .map(|x| mean(&frame, &shares, (x, 32), step))
                .collect();
            let (low, high) = (row.iter()).fold((1.0_f32, 0.0_f32), |(low, high), v| {
                (low.min(*v), high.max(*v))
            });
            assert!(high - low < 0.4 * 0.2, "{step}: {low} {high}");
        }
    }

    #[test]
    fn other_surfaces_do_not_count() {
        let (mut frame, mut shares) = speckled(20.0);
        for (i, (share, depth_m)) in shares.iter_mut().zip(&mut frame.depth_m).enumerate() {
            let far = i % 96 >= 48;
            *depth_m = if far { 20.0 } else { 10.0 };
            *share = f32::from(u8::from(far));
        }
        assert_eq!(penumbrae(&frame, &shares, 700.0), shares);
    }
}
