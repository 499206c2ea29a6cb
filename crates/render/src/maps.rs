//! The maps of a picture, and what only neighbouring pixels tell: smooth shadows and silhouettes.

use glam::Vec3;
use nemoral_scene::{Image, ObjectId, Semantic, TruthImages};
use rayon::prelude::*;

use crate::sunlit;
use crate::tone::LUMINANCE;

/// A picture in the making, row by row.
pub(crate) struct Maps {
    pub(crate) width: usize,
    pub(crate) semantic: Vec<Semantic>,
    pub(crate) object: Vec<ObjectId>,
    pub(crate) depth_m: Vec<f32>,
    pub(crate) normal: Vec<Vec3>,
    /// Radiance, at first without the sun's.
    pub(crate) linear: Vec<Vec3>,
    /// The sun's radiance as if nothing were between; zero where it does not count. Empty, as is what follows, if
    /// the picture's light is followed.
    pub(crate) sun: Vec<Vec3>,
    /// Is nothing between?
    pub(crate) lit: Vec<bool>,
}

const BINS: usize = 256;

impl Maps {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let n = width * height;
        Self {
            width,
            semantic: filled(Semantic::Sky, n),
            object: filled(ObjectId::NONE, n),
            depth_m: filled(0.0, n),
            normal: filled(Vec3::ZERO, n),
            linear: filled(Vec3::ZERO, n),
            sun: filled(Vec3::ZERO, n),
            lit: filled(false, n),
        }
    }

    /// Of a picture that is black as yet.
    pub(crate) fn of_truth(truth: TruthImages) -> Self {
        let n = truth.depth_m.pixels().len();
        Self {
            width: truth.depth_m.width(),
            semantic: truth.semantic.into_pixels(),
            object: truth.object.into_pixels(),
            depth_m: truth.depth_m.into_pixels(),
            normal: truth.normal.into_pixels(),
            linear: filled(Vec3::ZERO, n),
            sun: Vec::new(),
            lit: Vec::new(),
        }
    }

    pub(crate) fn into_images(self) -> (Image<Vec3>, TruthImages) {
        let (width, height) = (self.width, self.linear.len() / self.width);
        let truth = TruthImages {
            semantic: Image::new(width, height, self.semantic),
            object: Image::new(width, height, self.object),
            depth_m: Image::new(width, height, self.depth_m),
            normal: Image::new(width, height, self.normal),
        };
        (Image::new(width, height, self.linear), truth)
    }

    /// Adds the sun, as much of its disc as the pixels around see that lie on the same surface: see [`sunlit`].
    pub(crate) fn add_sun(&mut self) {
        let mut linear = std::mem::take(&mut self.linear);
        let width = self.width;
        linear
            .par_chunks_mut(width * sunlit::ROWS)
            .enumerate()
            .for_each(|(strip, rows)| {
                let first = strip * sunlit::ROWS;
                let share = sunlit::shares(self, first, rows.len() / width);
                let sun = &self.sun[first * width..];
                for ((out, sun), share) in rows.iter_mut().zip(sun).zip(share) {
                    *out += *sun * share;
                }
            });
        self.linear = linear;
    }

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

/// A map of one value. That its memory is touched for the first time costs more than to write it: all
/// threads share that.
pub(crate) fn filled<T: Copy + Send + Sync>(value: T, n: usize) -> Vec<T> {
    let mut map = Vec::new();
    rayon::iter::repeat_n(value, n)
        .with_min_len(1 << 16)
        .collect_into_vec(&mut map);
    map
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
            let drawn = Maps { semantic: semantic.clone(), linear, depth_m: vec![1.0; 400], ..Maps::new(20, 20) };
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
        let drawn = Maps {
            semantic: vec![Semantic::Leaf; 6],
            depth_m: depth_m.to_vec(),
            linear: linear.to_vec(),
            ..Maps::new(6, 1)
        };
        assert_eq!(drawn.edges(1.0, 2), [3, 4]);
        assert_eq!(drawn.edges(1.0, 9), [1, 2, 3, 4]);
        assert!(drawn.edges(1.0, 0).is_empty());
    }
}
