//! The share of the sky that is visible past the crowns, which gives the light for cameras and for
//! undergrowth.

use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{Ray, RayCaster, Surface};

/// Heights above ground of a grid's layers, metres. Above the last the sky is taken as open.
const HEIGHTS_M: [f64; 5] = [0.3, 4.0, 9.0, 15.0, 24.0];

/// How many of them are needed for what grows on the ground, which is seldom far from the plane
/// through four columns.
const GROUND_LAYERS: usize = 2;

/// Length of the rays, metres; farther crowns do not count. Together with the widest crown it is
/// less than a chunk of the usual size, so that neighbouring chunks get the same values at places
/// that both have.
pub const REACH_M: f64 = 38.0;

/// Number of rays from each place.
const DIRECTIONS: usize = 64;

/// The greatest distance of two columns of the grid, metres.
const CELL_M: f64 = 5.0;

/// The square in which a [`SkyViewFactor`] is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyViewArea {
    /// World position of the south-western corner of the square, metres.
    pub origin_m: DVec2,
    /// Side of the square, metres; more than 0.
    pub side_m: f64,
    /// Mean height of the trees, metres. Above it, rays are taken to meet nothing more.
    pub canopy_height_m: f64,
}

/// The share of the sky hemisphere, weighted by the cosine, that is visible past the crowns: a grid
/// over a square of the plane, at several heights above its ground.
///
/// The [part near the ground](Self::measure_near_ground), by which plants grow, takes two fifths of
/// the rays.
#[derive(Clone, Debug, PartialEq)]
pub struct SkyViewFactor {
    origin_m: DVec2,
    cell_m: f64,
    /// Nodes along a side.
    side: usize,
    /// Ground height at each column of nodes.
    ground_m: Vec<f64>,
    canopy_height_m: f64,
    /// The number of layers, the lowest ones.
    layers: usize,
    /// As many values for each column.
    values: Vec<f32>,
}

impl SkyViewFactor {
    /// Casts rays from all places of the grid.
    ///
    /// `crowns` has the trees in the square and within [`REACH_M`] around it, in metres relative to
    /// the square's corner; `ground` is in world coordinates.
    ///
    /// # Panics
    /// If the side of the square is not finite or not above 0.
    #[must_use]
    pub fn measure(
        area: &SkyViewArea,
        ground: &(impl Surface + ?Sized),
        crowns: &(impl RayCaster + ?Sized),
    ) -> Self {
        Self::measure_near_ground(area, ground, crowns).completed(crowns)
    }

    /// The layers near the ground alone, of which the upper one counts everywhere above it.
    ///
    /// # Panics
    /// As [`measure`](Self::measure).
    #[must_use]
    pub fn measure_near_ground(
        area: &SkyViewArea,
        ground: &(impl Surface + ?Sized),
        crowns: &(impl RayCaster + ?Sized),
    ) -> Self {
        assert!(
            area.side_m > 0.0 && area.side_m.is_finite(),
            "side_m = {}: must be finite and greater than 0",
            area.side_m
        );
        let cells = (area.side_m / CELL_M).ceil() as usize;
        let (side, cell_m) = (cells + 1, area.side_m / cells as f64);
        let mut part = Self {
            origin_m: area.origin_m,
            cell_m,
            side,
            ground_m: Vec::new(),
            canopy_height_m: area.canopy_height_m,
            layers: GROUND_LAYERS,
            values: Vec::new(),
        };
        let columns = (0..side * side).map(|i| area.origin_m + part.column_m(i));
        part.ground_m = columns.map(|p| ground.height_m(p)).collect();
        part.values = part.open_shares(&HEIGHTS_M[..GROUND_LAYERS], crowns);
        part
    }

    /// All layers, of which those near the ground are these, measured with the same crowns.
    #[must_use]
    pub fn completed(&self, crowns: &(impl RayCaster + ?Sized)) -> Self {
        let heights_m = &HEIGHTS_M[self.layers..];
        if heights_m.is_empty() {
            return self.clone();
        }
        let high = self.open_shares(heights_m, crowns);
        let columns = (self.values.chunks(self.layers)).zip(high.chunks(heights_m.len()));
        let values = columns.flat_map(|(low, high)| [low, high].concat());
        Self {
            values: values.collect(),
            layers: HEIGHTS_M.len(),
            ground_m: self.ground_m.clone(),
            ..*self
        }
    }

    /// Where a column of nodes is, in metres relative to the square's corner.
    fn column_m(&self, column: usize) -> DVec2 {
        DVec2::new((column % self.side) as f64, (column / self.side) as f64) * self.cell_m
    }

    /// The shares of the sky that are visible at heights above the columns' ground, by column.
    fn open_shares(&self, heights_m: &[f64], crowns: &(impl RayCaster + ?Sized)) -> Vec<f32> {
        let directions = directions();
        let mut rays = Vec::with_capacity(self.ground_m.len() * heights_m.len() * DIRECTIONS);
        for (column, z) in self.ground_m.iter().enumerate() {
            for height in heights_m {
                let origin = self.column_m(column).extend(z + height).as_vec3();
                rays.extend(directions.map(|direction| Ray {
                    origin,
                    direction,
                    t_min_m: 0.0,
                    t_max_m: REACH_M as f32,
                }));
            }
        }
        let mut hidden = vec![false; rays.len()];
        crowns.are_occluded(&rays, &mut hidden);
        (hidden
            .chunks_exact(DIRECTIONS)
            .zip(heights_m.iter().cycle()))
        .map(|(hidden, height)| {
            let below_m = (self.canopy_height_m - height).max(0.0);
            open_share(&directions, hidden, below_m) as f32
        })
        .collect()
    }

    /// The sky view factor at a world point, trilinear; 0 is closed, 1 is open.
    #[must_use]
    pub fn at(&self, world_m: DVec3) -> f32 {
        let p = (world_m.truncate() - self.origin_m) / self.cell_m;
        let top = (self.side - 1) as f64;
        let (x, y) = (p.x.clamp(0.0, top), p.y.clamp(0.0, top));
        let (column, row) = (
            (x as usize).min(self.side - 2),
            (y as usize).min(self.side - 2),
        );
        let (fx, fy) = (x - column as f64, y - row as f64);
        let corners = [
            (0, 0, (1.0 - fx) * (1.0 - fy)),
            (1, 0, fx * (1.0 - fy)),
            (0, 1, (1.0 - fx) * fy),
            (1, 1, fx * fy),
        ];
        let node = |dx, dy| (row + dy) * self.side + column + dx;
        let ground: f64 = corners
            .iter()
            .map(|&(dx, dy, w)| w * self.ground_m[node(dx, dy)])
            .sum();
        let height = world_m.z - ground;
        let heights_m = &HEIGHTS_M[..self.layers];
        let top_m = heights_m[self.layers - 1];
        if height >= top_m && self.layers == HEIGHTS_M.len() {
            // Fades to open sky over the last ten metres.
            let fade = ((height - top_m) / 10.0).min(1.0) as f32;
            let last = self.blend(&corners, node, self.layers - 1);
            return last + (1.0 - last) * fade;
        }
        let upper = heights_m
            .iter()
            .position(|&h| height < h)
            .unwrap_or(self.layers - 1)
            .max(1);
        let (low, high) = (heights_m[upper - 1], heights_m[upper]);
        let t = ((height - low) / (high - low)).clamp(0.0, 1.0) as f32;
        let (below, above) = (
            self.blend(&corners, node, upper - 1),
            self.blend(&corners, node, upper),
        );
        below + (above - below) * t
    }

    fn blend(
        &self,
        corners: &[(usize, usize, f64); 4],
        node: impl Fn(usize, usize) -> usize,
        layer: usize,
    ) -> f32 {
        let value = |dx, dy| self.values[node(dx, dy) * self.layers + layer];
        corners
            .iter()
            .map(|&(dx, dy, w)| w as f32 * value(dx, dy))
            .sum()
    }
}

/// Directions towards the sky, each of which lights a horizontal surface as much as any other.
fn directions() -> [Vec3; DIRECTIONS] {
    std::array::from_fn(|i| {
        // A Fibonacci lattice of the unit disc, projected up to the hemisphere (Malley's method).
        let radius2 = (i as f64 + 0.5) / DIRECTIONS as f64;
        let (s, c) = libm::sincos(i as f64 * 2.399_963_229_728_653);
        let disc = DVec2::new(c, s) * radius2.sqrt();
        disc.extend((1.0 - radius2).sqrt()).as_vec3()
    })
}

/// The share of the sky that is visible from `below_m` under the tops of the trees. Rays that end
/// below the tops are taken to meet as much, per length, on the rest of their way up as such rays
/// met so far.
fn open_share(directions: &[Vec3], hidden: &[bool], below_m: f64) -> f64 {
    let up_m = |d: Vec3| REACH_M * f64::from(d.z);
    let (mut free, mut all) = (0.0, 0.0);
    for (&d, hidden) in directions.iter().zip(hidden) {
        if up_m(d) < below_m {
            all += 1.0;
            free += if *hidden { 0.0 } else { 1.0 };
        }
    }
    let passes = |(&d, hidden): (&Vec3, &bool)| match hidden {
        true => 0.0,
        false if up_m(d) >= below_m => 1.0,
        false => libm::pow(free / all, below_m / up_m(d) - 1.0),
    };
    directions.iter().zip(hidden).map(passes).sum::<f64>() / directions.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::{FlatSurface, Hit, MaterialId};

    #[test]
    fn far_crowns_are_guessed_from_near_ones() {
        let all = directions();
        let clear = [false; DIRECTIONS];
        assert!((open_share(&all, &clear, 20.0) - 1.0).abs() < 1e-12);
        assert_eq!(open_share(&all, &[true; DIRECTIONS], 20.0), 0.0);
        // Every second ray is hidden, so half of the sky is visible just under the tops, and less
        // from lower down.
        let half: Vec<bool> = (0..DIRECTIONS).map(|i| i % 2 == 1).collect();
        assert!((open_share(&all, &half, 0.0) - 0.5).abs() < 1e-12);
        let (low, lower) = (open_share(&all, &half, 20.0), open_share(&all, &half, 30.0));
        assert!(lower < low && low < 0.48 && lower > 0.25, "{low} {lower}");
        // These values must not change.
        assert!((low - 0.458_499_128_6).abs() < 1e-9, "{low}");
    }

    #[test]
    fn directions_share_the_hemisphere() {
        let all = directions();
        assert!(
            all.iter()
                .all(|d| (d.length() - 1.0).abs() < 1e-6 && d.z > 0.0)
        );
        // Weighted by the cosine, the mean height is 2 / 3, and no side is preferred.
        let mean = all.iter().sum::<Vec3>() / DIRECTIONS as f32;
        assert!(
            (mean - Vec3::new(0.0, 0.0, 2.0 / 3.0)).length() < 0.02,
            "{mean}"
        );
    }

    #[test]
    fn a_square_without_a_side_is_refused() {
        for side_m in [0.0, -5.0, f64::NAN, f64::INFINITY] {
            let area = SkyViewArea {
                origin_m: DVec2::ZERO,
                side_m,
                canopy_height_m: 12.0,
            };
            let measure = || SkyViewFactor::measure(&area, &FlatSurface::default(), &Roof);
            let panic = std::panic::catch_unwind(measure).expect_err("no side");
            let said = panic.downcast_ref::<String>().expect("a message");
            assert!(said.contains("must be finite and greater than 0"), "{said}");
        }
    }

    /// A roof over the east, 30 m above the ground and as wide as rays reach.
    struct Roof;

    impl RayCaster for Roof {
        fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
            let distance_m = (30.0 - ray.origin.z) / ray.direction.z;
            let x = ray.origin.x + distance_m * ray.direction.x;
            let hits = x > 5.0 && ray.reaches(distance_m);
            hits.then(|| Hit::new(distance_m, Vec3::NEG_Z, MaterialId(0)))
        }
    }

    #[test]
    fn a_grid_knows_where_the_sky_is_hidden() {
        let area = SkyViewArea {
            origin_m: DVec2::new(100.0, -50.0),
            side_m: 10.0,
            canopy_height_m: 0.0,
        };
        let sky = SkyViewFactor::measure(&area, &FlatSurface::default(), &Roof);
        let at = |x: f64, z: f64| sky.at(DVec3::new(100.0 + x, -45.0, z));
        assert!(at(0.0, 24.0) > at(5.0, 24.0) && at(5.0, 24.0) > at(10.0, 24.0));
        assert!(at(10.0, 24.0) < 0.25, "{}", at(10.0, 24.0));
        // High above everything the sky is taken as open.
        assert_eq!(at(10.0, 40.0), 1.0);
        // The part near the ground is the same as far up as it reaches.
        let near = SkyViewFactor::measure_near_ground(&area, &FlatSurface::default(), &Roof);
        for (x, z) in [(3.0, -1.0), (5.0, 0.3), (8.0, 2.0), (9.5, 3.9)] {
            let p = DVec3::new(100.0 + x, -45.0, z);
            assert_eq!(near.at(p), sky.at(p));
        }
        assert_eq!(near.at(DVec3::new(105.0, -45.0, 30.0)), at(5.0, 4.0));
        assert_eq!(near.completed(&Roof), sky);
        assert_eq!(sky.completed(&Roof), sky);
    }
}
