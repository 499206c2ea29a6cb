//! Silhouettes, where further colour samples are worth most.

use rayon::prelude::*;

use super::frame_buffer::FrameBuffer;
use crate::colour::LUMINANCE;

/// The number of scores that a pixel may have.
const BINS: usize = 256;

/// The pixels on silhouettes, at most `limit`, in index order: where a neighbour has another
/// object, class or depth. If there are too many, those with the strongest contrast on the screen
/// (`log_mean` is the picture's log-mean luminance).
pub(super) fn silhouettes(frame: &FrameBuffer, log_mean: f64, limit: usize) -> Vec<u32> {
    let per_log_mean = 1.0 / log_mean as f32;
    let scores: Vec<u8> = (0..frame.linear.len())
        .into_par_iter()
        .map(|i| score(frame, i, per_log_mean))
        .collect();
    let mut counts = [0_usize; BINS];
    for &s in &scores {
        counts[usize::from(s)] += 1;
    }
    // The weakest score for which all pixels above it still fit; of the pixels with that score, an
    // evenly spread share is taken.
    let (mut weakest, mut above) = (BINS - 1, 0);
    while weakest > 1 && above + counts[weakest] <= limit {
        above += counts[weakest];
        weakest -= 1;
    }
    let (of, share) = (counts[weakest], (limit - above).min(counts[weakest]));
    let mut seen = 0;
    (0..scores.len())
        .filter(|&i| {
            let score = usize::from(scores[i]);
            if score == 0 || score < weakest {
                return false;
            }
            if score > weakest {
                return true;
            }
            seen += 1;
            seen * share / of != (seen - 1) * share / of
        })
        .map(|i| i as u32)
        .collect()
}

/// The score of a pixel: 0 inside of an object, else 1..=255 by contrast.
fn score(frame: &FrameBuffer, i: usize, per_log_mean: f32) -> u8 {
    let column = i % frame.width;
    let mut contrast = -1.0_f32;
    let neighbours = [
        (column > 0).then(|| i - 1),
        (column + 1 < frame.width).then_some(i + 1),
        i.checked_sub(frame.width),
        (i + frame.width < frame.linear.len()).then_some(i + frame.width),
    ];
    for j in neighbours.into_iter().flatten() {
        if differ(frame, i, j) {
            // The approximate brightness on the screen.
            let shown = |i: usize| {
                let y = frame.linear[i].dot(LUMINANCE) * per_log_mean;
                y / (y + 1.0)
            };
            contrast = contrast.max((shown(i) - shown(j)).abs());
        }
    }
    if contrast < 0.0 {
        0
    } else {
        1 + (contrast * 254.0) as u8
    }
}

fn differ(frame: &FrameBuffer, i: usize, j: usize) -> bool {
    let (a, b) = (frame.depth_m[i], frame.depth_m[j]);
    frame.object[i] != frame.object[j]
        || frame.semantic[i] != frame.semantic[j]
        || (a - b).abs() > 0.1 * a.min(b)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use nemoral_scene::Semantic;

    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_budget_is_kept_and_used(
            bits in prop::collection::vec(0_u8..4, 400),
            limit in 0_usize..500,
        ) {
            let semantic: Vec<_> = bits
                .iter()
                .map(|b| {
                    if b & 1 == 0 {
                        Semantic::Leaf
                    } else {
                        Semantic::Sky
                    }
                })
                .collect();
            let linear: Vec<_> = bits
                .iter()
                .map(|b| Vec3::splat(f32::from(*b) * 10.0))
                .collect();
            let drawn = FrameBuffer {
                semantic: semantic.clone(),
                linear,
                depth_m: vec![1.0; 400],
                ..FrameBuffer::new(20, 20)
            };
            let all = silhouettes(&drawn, 10.0, 400);
            // The oracle: at least one of four neighbours has another class.
            let edge = |i: usize| {
                let (x, y) = (i as i32 % 20, i as i32 / 20);
                [(-1, 0), (1, 0), (0, -1), (0, 1)].iter().any(|(dx, dy)| {
                    let (x, y) = (x + dx, y + dy);
                    (0..20).contains(&x)
                        && (0..20).contains(&y)
                        && semantic[(y * 20 + x) as usize] != semantic[i]
                })
            };
            let expected: Vec<u32> = (0..400).filter(|&i| edge(i)).map(|i| i as u32).collect();
            prop_assert_eq!(&all, &expected);
            let some = silhouettes(&drawn, 10.0, limit);
            prop_assert_eq!(some.len(), limit.min(all.len()));
            prop_assert!(some.windows(2).all(|w| w[0] < w[1]));
        }
    }

    #[test]
    fn strong_edges_come_first() {
        // Two steps of depth, one faint, one strong.
        let depth_m = [1.0, 1.0, 2.0, 2.0, 4.0, 4.0];
        let linear = [1.0, 1.0, 1.1, 1.1, 60.0, 60.0].map(Vec3::splat);
        let drawn = FrameBuffer {
            semantic: vec![Semantic::Leaf; 6],
            depth_m: depth_m.to_vec(),
            linear: linear.to_vec(),
            ..FrameBuffer::new(6, 1)
        };
        assert_eq!(silhouettes(&drawn, 1.0, 2), [3, 4]);
        assert_eq!(silhouettes(&drawn, 1.0, 9), [1, 2, 3, 4]);
        assert!(silhouettes(&drawn, 1.0, 0).is_empty());
    }
}
