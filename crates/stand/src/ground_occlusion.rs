//! The share of the light from all around that low plants, stems and stones leave to the ground.

use std::ops::Range;

use nemoral_scene::glam::{DVec2, Vec2};
use nemoral_scene::{AmbientOcclusion, Occluder};

/// The side of a cell, metres.
const CELL_M: f64 = 1.0 / 6.0;

/// The most layers, each as high as a cell is wide.
const MOST_LAYERS: usize = 9;

/// How far from the square what belongs to it may hide light, metres: as far as the flattest
/// direction goes before it has left all layers.
pub const OCCLUSION_MARGIN_M: f64 = 5.0;

/// Over so many cells from the rim of the margin on, shade becomes what it is.
const FADES_OVER: f64 = 6.0;

/// Cells beside the square on each side.
const MARGIN: usize = (OCCLUSION_MARGIN_M / CELL_M) as usize;

/// The cosines of the zenith angles of rings of directions that each light level ground as much as
/// any other ring. The flattest is lower than the middle of its ring, as little light passes lower
/// ones: the mean of a layer with an area index of 0.2 to 2 is right within 0.01.
const RINGS: [f64; 4] = [0.935, 0.791, 0.612, 0.31];
const IN_RING: usize = 6;

/// The share of the light from all around that what stands in a square leaves to the ground there
/// and close to it: a map of ambient occlusion.
///
/// Leaves are averaged over cubes, as if they hung there at random and with every orientation, and
/// light is followed through them in a few directions, as in a shape's own [`AmbientOcclusion`]
/// (Beer and Lambert; Ross 1981). Crowns are not part of it:
/// [`SkyViewFactor`](crate::SkyViewFactor) has them.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundOcclusion {
    /// The world position of the middle of the first cell.
    first_m: DVec2,
    /// Cells along a side.
    side: usize,
    /// The shares of rows of cells from the south, as [`AmbientOcclusion::encode`] has them.
    shares: Vec<u8>,
}

impl GroundOcclusion {
    /// The map of a square with sides of `side_m` metres whose south-western corner is at
    /// `origin_m`, or `None` if nothing hides light there.
    ///
    /// `occluders` are relative to the corner, and their heights are above the ground. What is
    /// farther from the square than [`OCCLUSION_MARGIN_M`], or higher than 1.5 m, does not count.
    #[must_use]
    pub fn measure(
        (origin_m, side_m): (DVec2, f64),
        occluders: impl Iterator<Item = Occluder>,
    ) -> Option<Self> {
        let side = (side_m / CELL_M).ceil() as usize + 2 * MARGIN;
        let first_m = DVec2::splat((0.5 - MARGIN as f64) * CELL_M);
        let mut leaves = Leaves {
            first_m: first_m.as_vec2(),
            side,
            layers: Vec::new(),
        };
        for occluder in occluders {
            leaves.add(occluder);
        }
        (!leaves.layers.is_empty()).then(|| Self {
            first_m: origin_m + first_m,
            side,
            shares: leaves.shares(),
        })
    }

    /// The share at a world position, 0..=1; 1 beyond the margin of the square.
    #[must_use]
    pub fn at(&self, world_m: DVec2) -> f32 {
        let cell = (world_m - self.first_m) / CELL_M;
        let last = DVec2::splat((self.side - 1) as f64);
        if !(cell.cmpge(DVec2::ZERO) & cell.cmplt(last)).all() {
            return 1.0;
        }
        let (x, y) = (cell.x as usize, cell.y as usize);
        let (fx, fy) = ((cell.x - x as f64) as f32, (cell.y - y as f64) as f32);
        let row = |y: usize| {
            let at = y * self.side + x;
            let [a, b] = [self.shares[at], self.shares[at + 1]].map(AmbientOcclusion::decode);
            a + (b - a) * fx
        };
        let (low, high) = (row(y), row(y + 1));
        let share = low + (high - low) * fy;
        // What lies across the border may be long, and its shade is not cut off at once.
        let to_rim = cell.min(last - cell).min_element() / FADES_OVER;
        1.0 - (1.0 - share) * to_rim.min(1.0) as f32
    }

    /// The share where the maps of several squares have these shares. Light from one side passes
    /// the plants of one square and seldom those of another as well, so that what they hide adds
    /// up: for a layer of leaves this is exact on borders and at corners.
    #[must_use]
    pub fn combined(shares: impl IntoIterator<Item = f32>) -> f32 {
        let hidden: f32 = shares.into_iter().map(|share| 1.0 - share).sum();
        (1.0 - hidden).max(0.0)
    }
}

/// The optical depth of leaves over a grid of cubes above the ground.
struct Leaves {
    /// The middle of the first cell, relative to the square's corner.
    first_m: Vec2,
    /// Cells along a side.
    side: usize,
    /// The optical depth of each cell straight up, by layer, from the ground up to the highest one
    /// with leaves.
    layers: Vec<Vec<f32>>,
}

impl Leaves {
    /// Shares an area among the four cells around it.
    fn add(&mut self, occluder: Occluder) {
        let Occluder {
            position_m,
            area_m2,
        } = occluder;
        let cell = (position_m.truncate() - self.first_m) / CELL_M as f32;
        let last = Vec2::splat((self.side - 1) as f32);
        if !(cell.cmpge(Vec2::ZERO) & cell.cmplt(last)).all() {
            return;
        }
        let up = position_m.z / CELL_M as f32;
        if !(0.0..MOST_LAYERS as f32).contains(&up) {
            return;
        }
        let layer = up as usize;
        while self.layers.len() <= layer {
            self.layers.push(vec![0.0; self.side * self.side]);
        }
        let depth = 0.5 * area_m2 / (CELL_M * CELL_M) as f32;
        let (x, y) = (cell.x as usize, cell.y as usize);
        let (fx, fy) = (cell.x - x as f32, cell.y - y as f32);
        for (dy, wy) in [(0, 1.0 - fy), (1, fy)] {
            for (dx, wx) in [(0, 1.0 - fx), (1, fx)] {
                self.layers[layer][(y + dy) * self.side + x + dx] += depth * wx * wy;
            }
        }
    }

    /// The shares of light that reach the middles of the cells' ground.
    fn shares(mut self) -> Vec<u8> {
        let side = self.side;
        // A direction stands for a cone, which is wider the higher it is.
        for (number, layer) in self.layers.iter_mut().enumerate() {
            blur(layer, side, (2 * number + 1) / 5);
        }
        let paths: Vec<Path> = (0..RINGS.len() * IN_RING)
            .map(|i| Path::new(i, self.layers.len()))
            .collect();
        let spans: Vec<Vec<Range<usize>>> = (self.layers.iter())
            .map(|layer| layer.chunks_exact(side).map(span).collect())
            .collect();
        let mut shares = Vec::with_capacity(side * side);
        let (mut hidden, mut depths) = (vec![0.0_f32; side], vec![0.0_f32; side]);
        for y in 0..side {
            hidden.fill(0.0);
            for path in &paths {
                let mut dark = side..0;
                for (layer, &[dx, dy]) in path.cells.iter().enumerate() {
                    let from = y.wrapping_add_signed(dy);
                    if from < side {
                        let row = &self.layers[layer][from * side..][..side];
                        let added = add_shifted(&mut depths, row, &spans[layer][from], dx);
                        dark = dark.start.min(added.start)..dark.end.max(added.end);
                    }
                }
                if dark.is_empty() {
                    continue;
                }
                let depths = &mut depths[dark.clone()];
                for (hidden, depth) in hidden[dark].iter_mut().zip(depths) {
                    *hidden += 1.0 - transmittance(*depth * path.length);
                    *depth = 0.0;
                }
            }
            let share = |hidden: &f32| AmbientOcclusion::encode(1.0 - hidden / paths.len() as f32);
            shares.extend(hidden.iter().map(share));
        }
        shares
    }
}

/// Replaces each cell of a square by the mean of those that are at most `reach` cells away on both
/// axes. There is nothing beyond the sides.
fn blur(cells: &mut [f32], side: usize, reach: usize) {
    if reach == 0 {
        return;
    }
    let weight = 1.0 / (2 * reach + 1) as f32;
    let mean = |line: &[f32], at: usize| {
        let near = &line[at.saturating_sub(reach)..side.min(at + reach + 1)];
        near.iter().sum::<f32>() * weight
    };
    let mut line = vec![0.0; side];
    for row in cells.chunks_exact_mut(side) {
        line.copy_from_slice(row);
        row.iter_mut()
            .enumerate()
            .for_each(|(x, cell)| *cell = mean(&line, x));
    }
    let rows = cells.to_vec();
    for (y, to) in cells.chunks_exact_mut(side).enumerate() {
        to.fill(0.0);
        for from in y.saturating_sub(reach)..side.min(y + reach + 1) {
            let from = &rows[from * side..][..side];
            to.iter_mut()
                .zip(from)
                .for_each(|(to, from)| *to += from * weight);
        }
    }
}

/// From the first to the last of a row's cells that hold anything.
fn span(row: &[f32]) -> Range<usize> {
    let holds = |&depth: &f32| depth > 0.0;
    match row.iter().position(holds) {
        Some(first) => first..1 + row.iter().rposition(holds).unwrap_or(first),
        None => 0..0,
    }
}

/// Adds to each cell of a row the one that is `shift` farther on in a span of another one. Returns
/// where the sums are; it is empty and at the end of the row if there are none.
fn add_shifted(to: &mut [f32], from: &[f32], span: &Range<usize>, shift: isize) -> Range<usize> {
    let place = |at: usize| at.saturating_add_signed(-shift).min(to.len());
    let places = place(span.start)..place(span.end);
    if places.is_empty() {
        return to.len()..0;
    }
    let from = &from[places.start.wrapping_add_signed(shift)..][..places.len()];
    for (to, from) in to[places.clone()].iter_mut().zip(from) {
        *to += from;
    }
    places
}

/// A direction that light comes from.
struct Path {
    /// Its length in a layer, in heights of the layer.
    length: f32,
    /// How many cells east and north it is from the ground below when it is in the middle of each
    /// layer.
    cells: Vec<[isize; 2]>,
}

impl Path {
    /// The `i`-th direction.
    fn new(i: usize, layers: usize) -> Self {
        let (ring, turn) = (i / IN_RING, i % IN_RING);
        let cos_zenith = RINGS[ring];
        let azimuth = (turn as f64 + ring as f64 / RINGS.len() as f64) / IN_RING as f64;
        let (sin, cos) = libm::sincos(azimuth * std::f64::consts::TAU);
        let tan = (1.0 - cos_zenith * cos_zenith).sqrt() / cos_zenith;
        let cell = |layer: usize| {
            let out = (layer as f64 + 0.5) * tan;
            [cos, sin].map(|along| libm::round(out * along) as isize)
        };
        Self {
            length: cos_zenith.recip() as f32,
            cells: (0..layers).map(cell).collect(),
        }
    }
}

/// The transmittance of an optical depth within 0.005: exp(−x) as 1 / (1 + x / 64)⁶⁴, of which
/// processors compute several at once, with equal bits everywhere.
fn transmittance(depth: f32) -> f32 {
    let mut power = 1.0 + depth / 64.0;
    for _ in 0..6 {
        power *= power;
    }
    1.0 / power
}

#[cfg(test)]
mod tests {
    use nemoral_scene::glam::Vec3;
    use nemoral_seed::{Draw, Key};
    use proptest::prelude::*;

    use super::*;

    const SIDE_M: f64 = 4.0;

    fn measured(occluders: &[Occluder]) -> Option<GroundOcclusion> {
        GroundOcclusion::measure((DVec2::ZERO, SIDE_M), occluders.iter().copied())
    }

    /// Leaves of an area index of 1 in a layer, or in the part of it that `keep` has.
    fn layer(height_m: f32, keep: impl Fn(Vec2) -> bool) -> Vec<Occluder> {
        const STEP_M: f32 = 0.05;
        let number = ((SIDE_M + 2.0 * OCCLUSION_MARGIN_M) / f64::from(STEP_M)) as i32;
        let places = (0..number).flat_map(|y| (0..number).map(move |x| (x, y)));
        let place = |(x, y): (i32, i32)| {
            let at = (Vec2::new(x as f32, y as f32) + 0.5) * STEP_M;
            at - OCCLUSION_MARGIN_M as f32
        };
        (places.map(place).filter(|&at| keep(at)))
            .map(|at| Occluder {
                position_m: at.extend(height_m),
                area_m2: STEP_M * STEP_M,
            })
            .collect()
    }

    fn scattered(count: u64) -> Vec<Occluder> {
        let mut rng = Key::world(5).rng();
        let mut number = |low: f64, high: f64| rng.range_f64(low, high) as f32;
        (0..count)
            .map(|_| Occluder {
                position_m: Vec3::new(number(0.0, 4.0), number(0.0, 4.0), number(0.0, 0.9)),
                area_m2: number(0.0, 0.02),
            })
            .collect()
    }

    #[test]
    fn bare_ground_has_no_map() {
        assert_eq!(measured(&[]), None);
        let away = |x: f32, z: f32| Occluder {
            position_m: Vec3::new(x, 1.0, z),
            area_m2: 1.0,
        };
        assert_eq!(
            measured(&[away(9.1, 0.1), away(1.0, 1.6), away(1.0, -0.1)]),
            None
        );
    }

    #[test]
    fn a_layer_passes_what_it_does_by_beer_and_lambert() {
        // Twice the third exponential integral of a half.
        let all = measured(&layer(0.3, |_| true)).expect("leaves");
        for at in [DVec2::splat(2.0), DVec2::new(0.1, 3.8)] {
            assert!((all.at(at) - 0.443).abs() < 0.015, "{}", all.at(at));
        }
        // Under the edge of a half of it, the other half lets all light through.
        let half = measured(&layer(0.3, |at| at.x > 2.0)).expect("leaves");
        let [dark, edge, light] = [3.5, 2.0, 0.5].map(|x| half.at(DVec2::new(x, 2.0)));
        assert!((edge - 0.72).abs() < 0.04, "{edge}");
        assert!(
            (dark - 0.443).abs() < 0.03 && light > 0.97,
            "{dark} {light}"
        );
    }

    #[test]
    fn squares_side_by_side_are_as_dark_as_one() {
        let all = measured(&layer(0.3, |_| true)).expect("leaves");
        let quarter = |east: bool, north: bool| {
            let here = move |at: Vec2| (at.x > 2.0) == east && (at.y > 2.0) == north;
            measured(&layer(0.3, here)).expect("leaves")
        };
        let quarters = [[false, false], [true, false], [false, true], [true, true]]
            .map(|[east, north]| quarter(east, north));
        for i in 0..40 {
            // Along a border, across a corner, and away from both.
            let along = 0.5 + 0.07 * f64::from(i);
            for at in [
                DVec2::new(2.0, along),
                DVec2::splat(along),
                DVec2::new(1.3, along),
            ] {
                let share = GroundOcclusion::combined(quarters.iter().map(|map| map.at(at)));
                let off = share - all.at(at);
                assert!(off.abs() < 0.07, "{at}: {off}");
            }
        }
    }

    /// The oracle casts rays at balls, whose shadows are as large as those of their area.
    #[test]
    fn scattered_leaves_hide_what_balls_of_their_area_do() {
        let occluders = scattered(600);
        let map = measured(&occluders).expect("leaves");
        let mut rng = Key::world(6).rng();
        let (mut sum, mut expected, mut off) = (0.0, 0.0, 0.0);
        const PLACES: u32 = 150;
        for _ in 0..PLACES {
            let at = Vec3::new(rng.range_f32(0.5, 3.5), rng.range_f32(0.5, 3.5), 0.0);
            let rays = 400;
            let free = (0..rays).filter(|_| {
                let (radius, turn) = (
                    rng.unit_f64().sqrt(),
                    rng.range_f64(0.0, std::f64::consts::TAU),
                );
                let (sin, cos) = libm::sincos(turn);
                let up = (1.0 - radius * radius).sqrt();
                let way = Vec3::new((radius * cos) as f32, (radius * sin) as f32, up as f32);
                !occluders.iter().any(|occluder| {
                    let to = occluder.position_m - at;
                    let along = to.dot(way);
                    // A half of the area of leaves with every orientation is seen.
                    let disc = 0.5 * occluder.area_m2 / std::f32::consts::PI;
                    along > 0.0 && to.length_squared() - along * along < disc
                })
            });
            let free = free.count() as f32 / rays as f32;
            let share = map.at(at.truncate().as_dvec2());
            sum += share;
            expected += free;
            off += (share - free).abs();
        }
        let n = PLACES as f32;
        assert!(
            (sum - expected).abs() < 0.02 * n,
            "{} {}",
            sum / n,
            expected / n
        );
        assert!(
            off < 0.06 * n && expected < 0.8 * n,
            "{} {}",
            off / n,
            expected / n
        );
    }

    #[test]
    fn it_is_dark_under_a_plant_and_light_beyond_the_margin() {
        let bush = Occluder {
            position_m: Vec3::new(0.2, 2.0, 0.2),
            area_m2: 0.3,
        };
        let map = measured(&[bush]).expect("a leaf");
        let at = |x: f64| map.at(DVec2::new(x, 2.0));
        assert!(
            at(0.2) < 0.8 && at(0.2) < at(0.6) && at(0.6) < 1.0,
            "{} {}",
            at(0.2),
            at(0.6)
        );
        // It leans over the border, and its shade does so, too.
        assert!(at(-0.1) < 1.0);
        assert_eq!([at(-4.7), at(-9.0), at(40.0), at(f64::NAN)], [1.0; 4]);
    }

    #[test]
    fn value_stability() {
        let map = measured(&scattered(300)).expect("leaves");
        let sum: u32 = map.shares.iter().map(|&share| u32::from(share)).sum();
        assert_eq!((map.side, sum), (84, 1_776_757));
    }

    proptest! {
        #[test]
        fn more_leaves_never_let_more_light_through(count in 1_u64..300, fewer in 0_u64..300) {
            let all = measured(&scattered(count)).expect("leaves");
            let Some(some) = measured(&scattered(count.min(fewer))) else {
                return Ok(());
            };
            let mut darker = all.shares.iter().zip(&some.shares);
            prop_assert!(darker.all(|(all, some)| all <= some));
        }
    }
}
