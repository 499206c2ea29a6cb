//! A ground from a grid of measured heights, which passes into another ground around it.

mod posts;
mod unmeasured;

use glam::DVec2;
use nemoral_scene::{ParamError, Surface, SurfaceSample};

pub use self::posts::HeightPosts;

use self::unmeasured::{distances, fill, outside};

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

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::FlatSurface;
    use proptest::prelude::*;

    /// Hills with a hole, over a sloping plane.
    pub(super) fn hills(blend_m: f64) -> (HeightPosts, HeightField<FlatSurface>) {
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
    }
}
