//! Combinations of the keys of placement that are impossible, though each value alone is allowed,
//! and the most objects of a chunk.

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, ObjectId};
use nemoral_stand::most_outcropping_rocks;

use super::validate::Problems;
use super::{Config, InputFiles};

/// `.label` files number the objects of a chunk from 1 to this.
pub(super) const OBJECTS_OF_A_CHUNK_MAX: f64 = ObjectId::LABEL_ITEM_MAX as f64;

impl Config {
    pub(super) fn placement_problems(&self, inputs: &InputFiles, out: &mut Problems) {
        let p = &self.placement;
        out.ordered(
            ("placement.rocks_min", f64::from(p.rocks_min)),
            ("placement.rocks_max", f64::from(p.rocks_max)),
        );
        let (gaps, young) = (&p.gaps, &p.regeneration);
        out.ordered(
            ("placement.gaps.radius_min_m", gaps.radius_min_m),
            ("placement.gaps.radius_max_m", gaps.radius_max_m),
        );
        out.ordered(
            ("placement.regeneration.radius_min_m", young.radius_min_m),
            ("placement.regeneration.radius_max_m", young.radius_max_m),
        );
        let most = self.most_objects_of_a_chunk(inputs);
        if most > OBJECTS_OF_A_CHUNK_MAX {
            let message = format!(
                ": up to {most:.0} things in a chunk, and .label files number only \
                 {OBJECTS_OF_A_CHUNK_MAX}: lower trees, stumps, shrubs, regeneration.saplings, \
                 rocks_max, outcrops, trails.rocks_max, or mantle_* and open_* of meadows"
            );
            out.add("placement", &message);
        }
    }

    /// The most things with an id that are placed in a chunk, within six standard deviations.
    pub(super) fn most_objects_of_a_chunk(&self, inputs: &InputFiles) -> f64 {
        let (p, c) = (&self.placement, &self.chunks);
        let young = &p.regeneration;
        // Saplings grow in clusters, so the variance of their number in a chunk is that of
        // scattered points times the mean number of saplings in a cluster.
        let radius_m = f64::midpoint(young.radius_min_m, young.radius_max_m);
        let cluster_m2 = std::f64::consts::PI * radius_m * radius_m;
        let clusters = young.share * c.size_m * c.size_m / cluster_m2;
        // A chunk may lie along the edge of a meadow, which winds.
        let edge = if p.meadows.share > 0.0 {
            (2.8 * p.meadows.mantle_m / c.size_m).min(1.0)
        } else {
            0.0
        };
        let (m, open) = (&p.meadows, f64::from(u8::from(p.meadows.share > 0.0)));
        let raised = |number: f64, in_mantle: f64, in_open: f64| {
            number * (1.0 + edge * (in_mantle - 1.0).max(0.0)).max(open * in_open)
        };
        let saplings = raised(young.saplings, m.mantle_saplings, m.open_saplings);
        let mean = p.trees
            + raised(p.stumps, 1.0, m.open_stumps)
            + raised(p.shrubs, m.mantle_shrubs, m.open_shrubs)
            + saplings;
        // Six standard deviations of the number are left as a margin.
        let variance = mean + saplings * saplings / clusters.max(1.0);
        let born = 2 * usize::from(self.trails.enabled);
        // A file that cannot be read is refused elsewhere.
        let lines = self.site.trail_lines_m(inputs).unwrap_or_default();
        let given = most_lines_of_a_chunk(&lines, self.trails.width_m, c.size_m);
        let ways = self.trails.params().ways.into_iter();
        let stones = ways
            .filter(|w| w.1 > 0.0)
            .map(|w| w.0.rocks_max_per_trail)
            .max();
        let trail_rocks = born as f64 * f64::from(stones.unwrap_or(0))
            + given as f64 * f64::from(self.trails.rocks_max);
        let rocks = f64::from(p.rocks_max) + most_outcropping_rocks(p.outcrops, c.size_m);
        mean + 6.0 * variance.sqrt() + rocks + trail_rocks
    }
}

/// The greatest number of lines whose bounding boxes touch the same chunk. Boxes are wider by what
/// a trail may swing out between two vertices, and by its width.
fn most_lines_of_a_chunk(lines_m: &[Vec<DVec2>], width_m: f64, chunk_size_m: f64) -> usize {
    let of_line = |line: &Vec<DVec2>| {
        let longest_m = line
            .windows(2)
            .map(|v| v[0].distance(v[1]))
            .fold(0.0, f64::max);
        let around = DVec2::splat(0.25 * longest_m + width_m);
        let low = line.iter().copied().fold(DVec2::INFINITY, DVec2::min) - around;
        let high = line.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max) + around;
        [low, high].map(|corner| ChunkCoord::containing(corner, chunk_size_m))
    };
    let boxes: Vec<[ChunkCoord; 2]> = lines_m.iter().map(of_line).collect();
    // Along y a box begins at its first chunk and has ended one after its last; those that end come
    // first.
    let mut ends: Vec<(i64, i8, usize)> = (0..boxes.len())
        .flat_map(|i| {
            let [low, high] = boxes[i].map(|c| i64::from(c.y));
            [(low, 1, i), (high + 1, -1, i)]
        })
        .collect();
    ends.sort_unstable();
    let mut columns: Vec<i32> = boxes.iter().map(|b| b[0].x).collect();
    columns.sort_unstable();
    columns.dedup();
    // Where most boxes meet, one begins.
    let most_of_column = |&x: &i32| {
        let here = |i: usize| (boxes[i][0].x..=boxes[i][1].x).contains(&x);
        let (mut open, mut most) = (0_isize, 0);
        for &(_, step, _) in ends.iter().filter(|end| here(end.2)) {
            open += isize::from(step);
            most = most.max(open);
        }
        most.unsigned_abs()
    };
    columns.iter().map(most_of_column).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_meet_in_a_chunk_are_counted() {
        let line = |x: f64, y: f64| vec![DVec2::new(x, y), DVec2::new(x + 10.0, y + 10.0)];
        let most = |lines: &[Vec<DVec2>]| most_lines_of_a_chunk(lines, 2.0, 50.0);
        assert_eq!(most(&[]), 0);
        // Each in a chunk of its own.
        let apart: Vec<_> = (0..30)
            .map(|i| line(20.0 + 50.0 * f64::from(i), 20.0))
            .collect();
        assert_eq!(most(&apart), 1);
        // Five that cross one chunk, which none of them begins in together with another.
        let mut star: Vec<_> = (0..5)
            .map(|i| {
                vec![
                    DVec2::splat(-60.0 * f64::from(i) - 10.0),
                    DVec2::splat(20.0),
                ]
            })
            .collect();
        assert_eq!(most(&star), 5);
        star.extend(apart);
        assert_eq!(most(&star), 6);
        // By all chunks, for lines anywhere.
        let at = |i: i32, k: i32| f64::from((i * k) % 997);
        let lines: Vec<_> = (0..60)
            .map(|i| {
                vec![
                    DVec2::new(at(i, 331), at(i, 577)),
                    DVec2::new(at(i, 151), at(i, 83)),
                ]
            })
            .collect();
        let boxes = lines.iter().map(|l| {
            let around = DVec2::splat(0.25 * l[0].distance(l[1]) + 2.0);
            let chunk = |p| ChunkCoord::containing(p, 50.0);
            [
                chunk(l[0].min(l[1]) - around),
                chunk(l[0].max(l[1]) + around),
            ]
        });
        let boxes: Vec<_> = boxes.collect();
        let of_chunk = |x: i32, y: i32| {
            let here =
                |[a, b]: &&[ChunkCoord; 2]| (a.x..=b.x).contains(&x) && (a.y..=b.y).contains(&y);
            boxes.iter().filter(here).count()
        };
        let all = (-10..40).flat_map(|x| (-10..40).map(move |y| of_chunk(x, y)));
        assert_eq!(Some(most(&lines)), all.max());
    }
}
