//! A ground from a grid of measured heights, which passes into another ground around it.

use glam::DVec2;
use nemoral_scene::{ParamError, Surface, SurfaceSample};

/// The most posts of a grid with its surroundings.
const MAX_POSTS: usize = 1 << 25;

/// Measured heights on a grid, row by row from the north, each row from the west.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightPosts {
    /// Posts in a row, at least 2.
    pub columns: usize,
    /// World position of the first post, the north-west one, metres.
    pub first_m: DVec2,
    /// Distance between posts, metres, 0.01 to 1000.
    pub spacing_m: f64,
    /// Height of each post, metres; NaN where nothing was measured.
    pub heights_m: Vec<f32>,
}

/// A ground that passes through measured heights, with another ground around them.
///
/// Between posts it is bicubic (Catmull and Rom's spline along both axes, which is Keys's cubic
/// convolution of 1981), so it has every post's height exactly and a continuous gradient. Posts
/// that were not measured have heights from ever coarser means of the posts around. In holes, which
/// measured posts enclose, these are the ground. Beyond the outermost posts, and in bays that are
/// open to there, they pass into the other ground within a distance, so that the ground is nowhere
/// above both or below both. The gradient is that of the whole function, exact.
///
/// ```
/// use nemoral_scene::{FlatSurface, Surface, glam::DVec2};
/// use nemoral_terrain::{HeightField, HeightPosts};
///
/// let posts = HeightPosts {
///     columns: 3,
///     first_m: DVec2::new(0.0, 20.0),
///     spacing_m: 10.0,
///     heights_m: vec![1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 1.0, 2.0, 3.0],
/// };
/// let ground = HeightField::new(&posts, 25.0, FlatSurface::default())?;
/// assert_eq!(ground.height_m(DVec2::new(10.0, 10.0)), 2.0);
/// assert_eq!(ground.height_m(DVec2::new(60.0, 10.0)), 0.0);
/// # Ok::<(), nemoral_terrain::ParamError>(())
/// ```
#[derive(Clone, Debug)]
pub struct HeightField<S> {
    around: S,
    columns: usize,
    rows: usize,
    /// World position of the first post of the surroundings.
    first_m: DVec2,
    spacing_m: f64,
    /// Heights with those of surroundings and holes.
    heights_m: Vec<f32>,
    /// The distance from the nearest measured post, in blending distances; 0 in holes.
    distances: Vec<f32>,
}

impl HeightPosts {
    /// What [`HeightField::new`] refuses; the result is the width of the surroundings in posts, and
    /// the numbers of columns and rows with them.
    fn check(&self, blend_m: f64) -> Result<(usize, [usize; 2]), ParamError> {
        ParamError::check_within("spacing_m", self.spacing_m, 0.01, 1000.0)?;
        ParamError::check_within("blend_m", blend_m, 0.1, 5000.0)?;
        let (columns, count) = (self.columns, self.heights_m.len());
        if columns < 2 || count < 2 * columns || count % columns != 0 {
            let allowed = "at least two rows of columns >= 2 posts";
            return Err(ParamError::new("heights_m.len()", count, allowed));
        }
        if !self.first_m.is_finite() {
            return Err(ParamError::new("first_m", self.first_m, "finite"));
        }
        if let Some(h) = self.heights_m.iter().find(|h| h.is_infinite()) {
            return Err(ParamError::new("heights_m", h, "finite, or NaN for none"));
        }
        if self.heights_m.iter().all(|h| h.is_nan()) {
            return Err(ParamError::new("heights_m", "NaN", "measured somewhere"));
        }
        // The outermost posts, which the spline needs, are beyond the blending distance.
        let margin = (blend_m / self.spacing_m).ceil() as usize + 2;
        let size = [columns, count / columns].map(|n| n + 2 * margin);
        if size[0].saturating_mul(size[1]) > MAX_POSTS {
            let value = format!("{} x {}", size[0], size[1]);
            let allowed = format!("at most {MAX_POSTS} posts; lower blend_m");
            return Err(ParamError::new(
                "posts with their surroundings",
                value,
                allowed,
            ));
        }
        Ok((margin, size))
    }

    /// Checks what [`HeightField::new`] checks, without its work.
    ///
    /// # Errors
    /// As [`HeightField::new`].
    pub fn validate(&self, blend_m: f64) -> Result<(), ParamError> {
        self.check(blend_m).map(drop)
    }
}

impl<S: Surface> HeightField<S> {
    /// Lays measured heights over a ground, into which they pass within `blend_m`.
    ///
    /// # Errors
    /// If the grid is smaller than 2 × 2 posts or not a rectangle, has no measured post, or is too
    /// large with its surroundings (2²⁵ posts); if a height is infinite, or a length out of its
    /// range (`blend_m` is 0.1 to 5000).
    pub fn new(posts: &HeightPosts, blend_m: f64, around: S) -> Result<Self, ParamError> {
        let (margin, size) = posts.check(blend_m)?;
        let columns = posts.columns;
        let mut heights_m = vec![f32::NAN; size[0] * size[1]];
        for (row, heights) in posts.heights_m.chunks_exact(columns).enumerate() {
            let start = (row + margin) * size[0] + margin;
            heights_m[start..start + columns].copy_from_slice(heights);
        }
        let blend_posts = blend_m / posts.spacing_m;
        let distances = (distances(&outside(&heights_m, size[0]), size[0]).into_iter())
            .map(|d| (f64::from(d) / blend_posts) as f32)
            .collect();
        fill(&mut heights_m, size[0]);
        let out = DVec2::new(-1.0, 1.0) * margin as f64 * posts.spacing_m;
        Ok(Self {
            around,
            columns: size[0],
            rows: size[1],
            first_m: posts.first_m + out,
            spacing_m: posts.spacing_m,
            heights_m,
            distances,
        })
    }
}

impl<S: Surface> Surface for HeightField<S> {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        let at = (world_m - self.first_m) / self.spacing_m * DVec2::new(1.0, -1.0);
        let cell = at.floor();
        let last = DVec2::new(self.columns as f64, self.rows as f64) - 3.0;
        let is_outside = cell.cmplt(DVec2::ONE).any() || cell.cmpgt(last).any();
        if is_outside || !at.is_finite() {
            return self.around.sample(world_m);
        }
        let (x, y) = (spline(at.x - cell.x), spline(at.y - cell.y));
        let first = (cell.y as usize - 1) * self.columns + cell.x as usize - 1;
        // A value with its derivatives along the columns and down the rows.
        let value = |grid: &[f32]| {
            let mut sum = [0.0; 3];
            for (row, (value, rate)) in y[0].into_iter().zip(y[1]).enumerate() {
                let start = first + row * self.columns;
                let (mut across, mut slope) = (0.0, 0.0);
                for (column, post) in grid[start..start + 4].iter().enumerate() {
                    across += x[0][column] * f64::from(*post);
                    slope += x[1][column] * f64::from(*post);
                }
                sum[0] += value * across;
                sum[1] += value * slope;
                sum[2] += rate * across;
            }
            (sum[0], DVec2::new(sum[1], -sum[2]) / self.spacing_m)
        };
        let is_measured = (0..4).all(|row| {
            let start = first + row * self.columns;
            self.distances[start..start + 4].iter().all(|d| *d == 0.0)
        });
        if is_measured {
            let (height_m, gradient) = value(&self.heights_m);
            return SurfaceSample { height_m, gradient };
        }
        // The distance is interpolated and not its share, which would leave 0 to 1.
        let (distance, distance_gradient) = value(&self.distances);
        if distance >= 1.0 {
            return self.around.sample(world_m);
        }
        let (height_m, gradient) = value(&self.heights_m);
        if distance <= 0.0 {
            return SurfaceSample { height_m, gradient };
        }
        let (share, share_slope) = share_at(distance);
        let around = self.around.sample(world_m);
        let above_m = height_m - around.height_m;
        SurfaceSample {
            height_m: around.height_m + share * above_m,
            gradient: around.gradient
                + share * (gradient - around.gradient)
                + distance_gradient * (share_slope * above_m),
        }
    }
}

/// The weights of four values in a row at `t` in 0..1 between the middle two by Catmull and Rom's
/// spline, and their derivatives.
fn spline(t: f64) -> [[f64; 4]; 2] {
    let (t2, t3) = (t * t, t * t * t);
    let values = [
        0.5 * (2.0 * t2 - t - t3),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (4.0 * t2 - 3.0 * t3 + t),
        0.5 * (t3 - t2),
    ];
    let slopes = [
        0.5 * (4.0 * t - 1.0 - 3.0 * t2),
        0.5 * (9.0 * t2 - 10.0 * t),
        0.5 * (8.0 * t - 9.0 * t2 + 1.0),
        0.5 * (3.0 * t2 - 2.0 * t),
    ];
    [values, slopes]
}

/// The share of the heights at a distance of 0 to 1 from the nearest measured post, in blending
/// distances, and its derivative.
fn share_at(distance: f64) -> (f64, f64) {
    let t = 1.0 - distance;
    (t * t * (3.0 - 2.0 * t), -6.0 * t * distance)
}

/// Which posts are outside of what was measured: those without a height from which a way along rows
/// and columns leads to the first post over others without one. The first post has none.
fn outside(heights_m: &[f32], columns: usize) -> Vec<bool> {
    let count = heights_m.len();
    let mut is_outside = vec![false; count];
    is_outside[0] = true;
    let mut open = vec![0];
    while let Some(post) = open.pop() {
        let column = post % columns;
        for (is_there, beside) in [
            (column > 0, post.wrapping_sub(1)),
            (column + 1 < columns, post + 1),
            (post >= columns, post.wrapping_sub(columns)),
            (post + columns < count, post + columns),
        ] {
            if is_there && heights_m[beside].is_nan() && !is_outside[beside] {
                is_outside[beside] = true;
                open.push(beside);
            }
        }
    }
    is_outside
}

/// The distance from each post to the nearest one that is not outside, in posts, by lower envelopes
/// of parabolas (Felzenszwalb and Huttenlocher 2012, "Distance transforms of sampled functions").
fn distances(is_outside: &[bool], columns: usize) -> Vec<f32> {
    let rows = is_outside.len() / columns;
    // Large, but its squares are finite.
    const FAR: f64 = 1e9;
    let square = |outside: &bool| if *outside { FAR * FAR } else { 0.0 };
    let mut squares: Vec<f64> = is_outside.iter().map(square).collect();
    let mut line = Vec::new();
    for row in squares.chunks_exact_mut(columns) {
        line.clear();
        line.extend_from_slice(row);
        envelope(&line, |i, square| row[i] = square);
    }
    for column in 0..columns {
        line.clear();
        line.extend((0..rows).map(|row| squares[row * columns + column]));
        envelope(&line, |row, square| {
            squares[row * columns + column] = square
        });
    }
    squares.into_iter().map(|s| s.sqrt() as f32).collect()
}

/// Of each place of a line, the least sum of a value and the square of the way to it.
fn envelope(values: &[f64], mut put: impl FnMut(usize, f64)) {
    // The parabolas of the envelope, each with the place from which on it is the lowest.
    let mut lowest: Vec<(usize, f64)> = Vec::with_capacity(values.len());
    for (i, &value) in values.iter().enumerate() {
        let from = loop {
            let Some(&(j, start)) = lowest.last() else {
                break f64::NEG_INFINITY;
            };
            let (a, b) = (i as f64, j as f64);
            let meet = ((value + a * a) - (values[j] + b * b)) / (2.0 * (a - b));
            if meet > start {
                break meet;
            }
            lowest.pop();
        };
        lowest.push((i, from));
    }
    let mut k = 0;
    for i in 0..values.len() {
        while lowest.get(k + 1).is_some_and(|&(_, from)| from < i as f64) {
            k += 1;
        }
        let off = i as f64 - lowest[k].0 as f64;
        put(i, values[lowest[k].0] + off * off);
    }
}

/// Gives posts without a height that of the coarsest means around them, from a pyramid of means of
/// 2 × 2 (Gortler et al. 1996, "The lumigraph": push and pull).
fn fill(heights_m: &mut [f32], columns: usize) {
    let rows = heights_m.len() / columns;
    if !heights_m.iter().any(|h| h.is_nan()) || heights_m.len() == 1 {
        return;
    }
    let half = [columns.div_ceil(2), rows.div_ceil(2)];
    let mut coarse = vec![f32::NAN; half[0] * half[1]];
    for (i, mean) in coarse.iter_mut().enumerate() {
        let (x, y) = (2 * (i % half[0]), 2 * (i / half[0]));
        let (mut sum, mut count) = (0.0, 0.0);
        for (x, y) in [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)] {
            if x < columns && y < rows && !heights_m[y * columns + x].is_nan() {
                sum += f64::from(heights_m[y * columns + x]);
                count += 1.0;
            }
        }
        if count > 0.0 {
            *mean = (sum / count) as f32;
        }
    }
    fill(&mut coarse, half[0]);
    for (i, height) in heights_m.iter_mut().enumerate().filter(|(_, h)| h.is_nan()) {
        // Linear between the middles of the coarse cells.
        let place = |at: usize, count: usize| {
            let at = (0.5 * at as f64 - 0.25).clamp(0.0, (count - 1) as f64);
            let cell = (at as usize).min(count.saturating_sub(2));
            (cell, (cell + 1).min(count - 1), at - cell as f64)
        };
        let (x0, x1, tx) = place(i % columns, half[0]);
        let (y0, y1, ty) = place(i / columns, half[1]);
        let at = |x: usize, y: usize| f64::from(coarse[y * half[0] + x]);
        let upper = at(x0, y0) * (1.0 - tx) + at(x1, y0) * tx;
        let lower = at(x0, y1) * (1.0 - tx) + at(x1, y1) * tx;
        *height = (upper * (1.0 - ty) + lower * ty) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::FlatSurface;
    use proptest::prelude::*;

    /// Hills with a hole, over a sloping plane.
    fn hills(blend_m: f64) -> (HeightPosts, HeightField<FlatSurface>) {
        let (columns, rows) = (23, 17);
        let height = |i: usize| {
            let (x, y) = ((i % columns) as f64, (i / columns) as f64);
            if (5.0..9.0).contains(&x) && (6.0..11.0).contains(&y) {
                return f32::NAN;
            }
            (100.0 + 2.0 * libm::sin(0.7 * x) * libm::cos(0.5 * y) + 0.3 * y) as f32
        };
        let posts = HeightPosts {
            columns,
            first_m: DVec2::new(-7.0, 1000.0),
            spacing_m: 0.8,
            heights_m: (0..columns * rows).map(height).collect(),
        };
        let around = FlatSurface {
            height_m: 60.0,
            gradient: DVec2::new(0.05, 0.04),
        };
        let field = HeightField::new(&posts, blend_m, around).expect("in range");
        (posts, field)
    }

    #[test]
    fn every_measured_post_has_its_height() {
        let (posts, field) = hills(6.0);
        let mut measured = 0;
        for (i, h) in posts
            .heights_m
            .iter()
            .enumerate()
            .filter(|(_, h)| !h.is_nan())
        {
            let off = DVec2::new((i % posts.columns) as f64, -((i / posts.columns) as f64));
            let at = posts.first_m + off * posts.spacing_m;
            assert!(
                (field.height_m(at) - f64::from(*h)).abs() < 1e-6,
                "post {i}"
            );
            measured += 1;
        }
        assert_eq!(measured, 23 * 17 - 20);
        // Far away there is the other ground, to the bit.
        for at in [
            DVec2::new(-20.0, 995.0),
            DVec2::new(0.0, 1010.0),
            DVec2::splat(f64::NAN),
        ] {
            let (a, b) = (field.sample(at), field.around.sample(at));
            assert_eq!(a.height_m.to_bits(), b.height_m.to_bits(), "{at}");
        }
    }

    #[test]
    fn holes_and_edges_pass_smoothly() {
        let (_, field) = hills(6.0);
        // Over the edge to the plane no step is steeper than the difference of the two grounds over
        // the blending distance, and a half; across the hole there is none to speak of.
        let steepest = 1.5 * (105.0 - 60.0) / 6.0 * 1.6;
        for (from, to) in [
            (DVec2::new(-6.0, 993.0), DVec2::new(10.0, 993.0)),
            (DVec2::new(3.0, 1000.0), DVec2::new(3.0, 1010.0)),
            (DVec2::new(-7.0, 990.0), DVec2::new(-20.0, 980.0)),
        ] {
            let step = (to - from) / 4000.0;
            let heights: Vec<f64> = (0..=4000)
                .map(|i| field.height_m(from + step * f64::from(i)))
                .collect();
            for pair in heights.windows(2) {
                assert!(
                    (pair[1] - pair[0]).abs() < steepest * step.length(),
                    "{from} {to}"
                );
            }
        }
        let hole = field.height_m(DVec2::new(-1.4, 993.6));
        assert!((98.0..107.0).contains(&hole), "{hole}");
    }

    #[test]
    fn holes_are_no_pits_and_bays_are_open_to_the_ground_around() {
        let columns = 17;
        let at = |posts: &HeightPosts, column: f64, row: f64| {
            posts.first_m + DVec2::new(column, -row) * posts.spacing_m
        };
        let flat = |is_void: &dyn Fn(usize, usize) -> bool| HeightPosts {
            columns,
            first_m: DVec2::new(3.0, 40.0),
            spacing_m: 2.0,
            heights_m: (0..columns * columns)
                .map(|i| {
                    let is_void = is_void(i % columns, i / columns);
                    if is_void { f32::NAN } else { 100.0 }
                })
                .collect(),
        };
        let ground = |posts: &HeightPosts| {
            HeightField::new(posts, 4.0, FlatSurface::default()).expect("in range")
        };
        // One post, and a square of 7 posts.
        let is_square = |x: usize, y: usize| (6..13).contains(&x) && (5..12).contains(&y);
        let holes = flat(&|x, y| (x, y) == (2, 3) || is_square(x, y));
        let field = ground(&holes);
        for i in 0..=160 {
            for j in 0..=160 {
                let place = at(&holes, f64::from(i) * 0.1, f64::from(j) * 0.1);
                let height_m = field.height_m(place);
                assert!((height_m - 100.0).abs() < 1e-9, "{place}: {height_m}");
            }
        }
        // The same square with a way out to the north.
        let bay = flat(&|x, y| (6..13).contains(&x) && (0..12).contains(&y));
        let field = ground(&bay);
        assert_eq!(field.height_m(at(&bay, 9.0, 8.0)), 0.0);
        assert!((field.height_m(at(&bay, 3.0, 8.0)) - 100.0).abs() < 1e-9);
    }

    /// Heights of 0 to 100 m on 9 by 8 posts, of which some were not measured.
    fn posts_of(heights_m: Vec<Option<f32>>) -> HeightPosts {
        let mut heights_m: Vec<f32> = heights_m
            .into_iter()
            .map(|h| h.unwrap_or(f32::NAN))
            .collect();
        heights_m[0] = 50.0;
        HeightPosts {
            columns: 9,
            first_m: DVec2::new(-4.0, 4.0),
            spacing_m: 1.0,
            heights_m,
        }
    }

    proptest! {
        /// The ground is linear in that around: over two levels it tells the share of the heights.
        #[test]
        fn the_ground_lies_between_the_heights_and_the_ground_around(
            heights_m in proptest::collection::vec(proptest::option::of(0.0_f32..100.0), 72),
            blend_m in 0.1_f64..6.0,
            places in proptest::collection::vec((-12.0_f64..12.0, -12.0_f64..12.0), 32),
        ) {
            let posts = posts_of(heights_m);
            let [low, high] = [0.0, 100.0].map(|height_m| {
                let around = FlatSurface { height_m, gradient: DVec2::ZERO };
                HeightField::new(&posts, blend_m, around).expect("in range")
            });
            for (x, y) in places {
                let at = DVec2::new(x, y);
                let share = 1.0 - (high.height_m(at) - low.height_m(at)) / 100.0;
                prop_assert!((-1e-9..=1.0 + 1e-9).contains(&share), "{at}: {share}");
            }
        }

        #[test]
        fn the_gradient_is_that_of_the_heights(x in -16.0..20.0_f64, y in 978.0..1008.0_f64) {
            let (_, field) = hills(6.0);
            let at = DVec2::new(x, y);
            const STEP: f64 = 1e-4;
            let slope = |axis: DVec2| {
                (field.height_m(at + axis * STEP) - field.height_m(at - axis * STEP)) / (2.0 * STEP)
            };
            let found = field.sample(at).gradient;
            let expected = DVec2::new(slope(DVec2::X), slope(DVec2::Y));
            prop_assert!((found - expected).length() < 2e-3 * (1.0 + expected.length()));
        }

        #[test]
        fn distances_are_those_to_the_nearest(seed in any::<u64>(), columns in 2_usize..9) {
            let mut state = seed | 1;
            let mut measured = || {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                state % 5 == 0
            };
            let mut grid: Vec<f32> =
                (0..columns * 7).map(|_| if measured() { 1.0 } else { f32::NAN }).collect();
            grid[3] = 1.0;
            let place = |i: usize| DVec2::new((i % columns) as f64, (i / columns) as f64);
            let is_outside: Vec<bool> = grid.iter().map(|h| h.is_nan()).collect();
            for (i, found) in distances(&is_outside, columns).into_iter().enumerate() {
                let to = |j: usize| place(i).distance(place(j));
                let nearest = (0..grid.len()).filter(|&j| !grid[j].is_nan()).map(to);
                let nearest = nearest.fold(f64::INFINITY, f64::min);
                prop_assert!((f64::from(found) - nearest).abs() < 1e-5);
            }
            fill(&mut grid, columns);
            prop_assert!(grid.iter().all(|h| *h == 1.0));
        }
    }

    #[test]
    fn impossible_grids_are_refused() {
        let (posts, _) = hills(6.0);
        let refused = |change: &dyn Fn(&mut HeightPosts), blend_m: f64| {
            let mut posts = posts.clone();
            change(&mut posts);
            let field = HeightField::new(&posts, blend_m, FlatSurface::default());
            field.expect_err("it is refused").to_string()
        };
        assert!(refused(&|p| p.columns = 1, 6.0).contains("two rows"));
        assert!(refused(&|p| p.columns = 22, 6.0).contains("two rows"));
        assert!(refused(&|p| p.heights_m.fill(f32::NAN), 6.0).contains("measured somewhere"));
        assert!(refused(&|p| p.heights_m[0] = f32::INFINITY, 6.0).contains("finite"));
        assert!(refused(&|p| p.spacing_m = 0.0, 6.0).contains("spacing_m"));
        assert!(refused(&|p| p.first_m.x = f64::NAN, 6.0).contains("first_m"));
        assert!(refused(&|p| p.spacing_m = 0.01, 5000.0).contains("lower blend_m"));
        assert!(refused(&|_| {}, 0.0).contains("blend_m"));
    }
}
