//! Which pixels deserve more samples.

use glam::Vec3;
use nemoral_scene::{ObjectId, Semantic};
use rayon::prelude::*;

use crate::tone::LUMINANCE;

/// The truth and the first samples of a picture, row by row.
pub(crate) struct Drawn<'a> {
    pub(crate) width: usize,
    pub(crate) semantic: &'a [Semantic],
    pub(crate) object: &'a [ObjectId],
    pub(crate) depth_m: &'a [f32],
    pub(crate) linear: &'a [Vec3],
}

const BINS: usize = 256;

impl Drawn<'_> {
    /// The pixels on silhouettes, at most `limit`, in index order: where a neighbour belongs to
    /// another thing, another class or another depth. If there are too many, those with the strongest
    /// contrast on the screen (`log_mean` is the picture's log-mean luminance).
    pub(crate) fn edges(&self, log_mean: f64, limit: usize) -> Vec<u32> {
        let per_log_mean = 1.0 / log_mean as f32;
        let scores: Vec<u8> = (0..self.linear.len())
            .into_par_iter()
            .map(|i| self.score(i, per_log_mean))
            .collect();
        let mut counts = [0_usize; BINS];
        for &s in &scores {
            counts[usize::from(s)] += 1;
        }
        // The weakest score for which all pixels above it still fit; of those that have it, an
        // evenly spread share.
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

    /// 0 inside a thing, else 1..=255 by contrast.
    fn score(&self, i: usize, per_log_mean: f32) -> u8 {
        let column = i % self.width;
        let mut contrast = -1.0_f32;
        let neighbours = [
            (column > 0).then(|| i - 1),
            (column + 1 < self.width).then_some(i + 1),
            i.checked_sub(self.width),
            (i + self.width < self.linear.len()).then_some(i + self.width),
        ];
        for j in neighbours.into_iter().flatten() {
            if self.differ(i, j) {
                // Brightness as the screen shows it, about.
                let shown = |i: usize| {
                    let y = self.linear[i].dot(LUMINANCE) * per_log_mean;
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

    fn differ(&self, i: usize, j: usize) -> bool {
        let (a, b) = (self.depth_m[i], self.depth_m[j]);
        self.object[i] != self.object[j]
            || self.semantic[i] != self.semantic[j]
            || (a - b).abs() > 0.1 * a.min(b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_budget_is_kept_and_used(bits in prop::collection::vec(0_u8..4, 400), limit in 0_usize..500) {
            let semantic: Vec<_> = bits.iter().map(|b| if b & 1 == 0 { Semantic::Leaf } else { Semantic::Sky }).collect();
            let linear: Vec<_> = bits.iter().map(|b| Vec3::splat(f32::from(*b) * 10.0)).collect();
            let drawn = Drawn { width: 20, semantic: &semantic, object: &[ObjectId::NONE; 400], depth_m: &[1.0; 400], linear: &linear };
            let all = drawn.edges(10.0, 400);
            // The oracle: some of four neighbours has another class.
            let edge = |i: usize| {
                let (x, y) = (i as i32 % 20, i as i32 / 20);
                [(-1, 0), (1, 0), (0, -1), (0, 1)].iter().any(|(dx, dy)| {
                    let (x, y) = (x + dx, y + dy);
                    (0..20).contains(&x) && (0..20).contains(&y) && semantic[(y * 20 + x) as usize] != semantic[i]
                })
            };
            let expected: Vec<u32> = (0..400).filter(|&i| edge(i)).map(|i| i as u32).collect();
            prop_assert_eq!(&all, &expected);
            let some = drawn.edges(10.0, limit);
            prop_assert_eq!(some.len(), limit.min(all.len()));
            prop_assert!(some.windows(2).all(|w| w[0] < w[1]));
        }
    }

    #[test]
    fn strong_edges_come_first() {
        // Two steps of depth, one faint, one strong.
        let depth_m = [1.0, 1.0, 2.0, 2.0, 4.0, 4.0];
        let linear = [1.0, 1.0, 1.1, 1.1, 60.0, 60.0].map(Vec3::splat);
        let drawn = Drawn {
            width: 6,
            semantic: &[Semantic::Leaf; 6],
            object: &[ObjectId::NONE; 6],
            depth_m: &depth_m,
            linear: &linear,
        };
        assert_eq!(drawn.edges(1.0, 2), [3, 4]);
        assert_eq!(drawn.edges(1.0, 9), [1, 2, 3, 4]);
        assert!(drawn.edges(1.0, 0).is_empty());
    }
}
