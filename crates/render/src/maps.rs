//! The maps of a picture, and what only neighbouring pixels tell: smooth shadows and silhouettes.

use glam::Vec3;
use nemoral_scene::{Image, ObjectId, Semantic, TruthImages};
use rayon::prelude::*;

use crate::tone::LUMINANCE;

/// A picture in the making, row by row.
pub(crate) struct Maps {
    width: usize,
    pub(crate) semantic: Vec<Semantic>,
    pub(crate) object: Vec<ObjectId>,
    pub(crate) depth_m: Vec<f32>,
    pub(crate) normal: Vec<Vec3>,
    /// Radiance, at first without the sun's.
    pub(crate) linear: Vec<Vec3>,
    /// The sun's radiance as if nothing were between; zero where it does not count.
    pub(crate) sun: Vec<Vec3>,
    /// Is nothing between?
    pub(crate) lit: Vec<bool>,
}

const BINS: usize = 256;
/// How many pixels away others tell of a pixel's shadow.
const REACH: usize = 2;

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

    /// Adds the sun, as much of its disc as the pixels around see that lie on the same surface: 5 × 5 of
    /// them, the nearer the more, as if the mean of 3 × 3 were taken twice.
    ///
    /// The shadow rays of any 3 × 3 go to nine different parts of the disc (see `SunDisc`), which so all
    /// weigh the same: one ray per pixel gives smooth penumbrae. A mean of 3 × 3 would, too, but where
    /// light comes through needles it shows each ray that arrives as a square.
    pub(crate) fn add_sun(&mut self) {
        let mut linear = std::mem::take(&mut self.linear);
        let (width, height) = (self.width, linear.len() / self.width);
        linear
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, row)| {
                let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(height);
                let mut lit_above = vec![0_u8; width];
                for v in rows.clone() {
                    for (n, &lit) in lit_above.iter_mut().zip(&self.lit[v * width..]) {
                        *n += u8::from(lit);
                    }
                }
                for (x, out) in row.iter_mut().enumerate() {
                    let i = y * width + x;
                    let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(width);
                    // Mostly all agree, and whose they are does not matter.
                    let lit: u8 = lit_above[columns.clone()].iter().sum();
                    if usize::from(lit) == rows.len() * columns.len() {
                        *out += self.sun[i];
                        continue;
                    }
                    if lit == 0 || self.sun[i] == Vec3::ZERO {
                        continue;
                    }
                    let (mut seen, mut all) = (0.0, 0.0);
                    for v in rows.clone() {
                        for u in columns.clone() {
                            let j = v * width + u;
                            if j == i || self.same_surface(i, j) {
                                let near = |d: usize| (REACH + 1 - d) as f32;
                                let weight = near(u.abs_diff(x)) * near(v.abs_diff(y));
                                all += weight;
                                seen += weight * f32::from(u8::from(self.lit[j]));
                            }
                        }
                    }
                    *out += self.sun[i] * (seen / all);
                }
            });
        self.linear = linear;
    }

    fn same_surface(&self, i: usize, j: usize) -> bool {
        self.object[i] == self.object[j]
            && self.sun[j] != Vec3::ZERO
            && (self.depth_m[i] - self.depth_m[j]).abs() < 0.03 * self.depth_m[i]
            && self.normal[i].dot(self.normal[j]) > 0.8
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
fn filled<T: Copy + Send + Sync>(value: T, n: usize) -> Vec<T> {
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

    #[test]
    fn a_ray_that_arrives_alone_is_a_soft_spot() {
        let mut maps = Maps::new(9, 9);
        maps.depth_m.fill(3.0);
        maps.normal.fill(Vec3::Z);
        maps.sun.fill(Vec3::ONE);
        maps.lit[4 * 9 + 4] = true;
        maps.add_sun();
        let at = |x: usize, y: usize| maps.linear[y * 9 + x].x * 81.0;
        let along: Vec<f32> = (0..9).map(|x| at(x, 4).round()).collect();
        assert_eq!(along, [0.0, 0.0, 3.0, 6.0, 9.0, 6.0, 3.0, 0.0, 0.0]);
        assert!((at(2, 2) - 1.0).abs() < 1e-5 && (at(3, 5) - 4.0).abs() < 1e-5);
        // No light is lost.
        let sum: Vec3 = maps.linear.iter().sum();
        assert!((sum - Vec3::ONE).length() < 1e-5, "{sum}");
    }

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
