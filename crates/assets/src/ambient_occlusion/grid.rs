//! The grid of cubes that light is followed through.

use glam::{I64Vec3, U64Vec3, Vec3};
use nemoral_scene::Prototype;

use super::pieces::for_each_piece;
use super::{FROM_BELOW, MaskCoverage};
use crate::lanes::{F32x8, U32x8, for_each_instruction_set};

/// A direction that is followed, with a step of a cell's side in parts of cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction {
    unit: Vec3,
    step: I64Vec3,
}

/// A Fibonacci lattice of the sphere.
pub(super) fn directions(count: u32) -> Vec<Direction> {
    let direction = |i: u32| {
        let z = 1.0 - f64::from(2 * i + 1) / f64::from(count);
        let (s, c) = libm::sincos(f64::from(i) * 2.399_963_229_728_653);
        let r = (1.0 - z * z).sqrt();
        let unit = Vec3::new((r * c) as f32, (r * s) as f32, z as f32);
        let step = fine(unit, 1.0);
        Direction { unit, step }
    };
    (0..count).map(direction).collect()
}

/// Parts of a cell's side, a power of two: whoever follows a direction counts in these, as
/// integers are rounded to cells by a shift.
const FINE_BITS: u32 = 16;

/// A place in parts of cells, whatever the bounds of the shape: where a part of a shape is removed,
/// the rest stays in the same cells.
#[inline(always)]
fn fine(at: Vec3, cell_m: f32) -> I64Vec3 {
    (at * ((1_u32 << FINE_BITS) as f32 / cell_m)).as_i64vec3()
}

/// The cell that a point lies in.
#[inline]
fn number(at: Vec3, cell_m: f32) -> I64Vec3 {
    fine(at, cell_m) >> FINE_BITS
}

/// The most cells along an axis: places in parts of cells are words of 32 bits, signed.
pub(super) const MOST_ALONG: u64 = 1 << 14;

/// The density of one-sided area over a grid of cubes.
pub(super) struct AreaDensityGrid {
    /// The cell of the lowest coordinates.
    low: I64Vec3,
    cell_m: f32,
    cells: U64Vec3,
    /// The optical depth of each cell along a path as long as its side; before them that of no
    /// cell, which is 0.
    depths: Vec<f32>,
}

impl AreaDensityGrid {
    pub(super) fn of(prototype: &Prototype, masks: &MaskCoverage, cell_m: f32) -> Self {
        let bounds = prototype.bounds();
        let low = number(bounds.min, cell_m);
        let cells = (number(bounds.max, cell_m) - low).as_u64vec3() + 1;
        debug_assert!(
            cells.max_element() <= MOST_ALONG + 1,
            "too many cells: {cells}"
        );
        let mut grid = Self {
            low,
            cell_m,
            cells,
            depths: vec![0.0; 1 + (cells.x * cells.y * cells.z) as usize],
        };
        for_each_piece(prototype, masks, (cell_m, f32::INFINITY), |piece| {
            grid.add(piece.at, grid.depth(piece.area_m2));
        });
        grid
    }

    /// The number of the cell at a place in parts of cells; 0 outside of the grid.
    #[inline]
    fn cell(&self, fine: I64Vec3) -> usize {
        let c = (fine >> FINE_BITS).wrapping_sub(self.low).as_u64vec3();
        let inside = c.x < self.cells.x && c.y < self.cells.y && c.z < self.cells.z;
        if inside {
            1 + ((c.z * self.cells.y + c.y) * self.cells.x + c.x) as usize
        } else {
            0
        }
    }

    /// The optical depth that a one-sided area adds to its cell.
    fn depth(&self, area_m2: f32) -> f32 {
        0.5 * area_m2 / (self.cell_m * self.cell_m)
    }

    /// Adds optical depth to a cell, if it is one of the grid's.
    fn add(&mut self, at: Vec3, depth: f32) {
        let cell = self.cell(fine(at, self.cell_m));
        if cell > 0 {
            self.depths[cell] += depth;
        }
    }

    /// The shares of light that reach points, followed over `steps` cells in these directions.
    pub(super) fn lights(
        &self,
        points: &[SurfacePoint],
        directions: &[Direction],
        steps: u32,
    ) -> Vec<f32> {
        lights(self, points, directions, steps)
    }

    /// The share of light that reaches a point, weighted by the cosine.
    #[inline(always)]
    fn light(&self, point: &SurfacePoint, directions: &[Direction], steps: u32) -> f32 {
        let &SurfacePoint { at, normal, both } = point;
        // At this distance from a plane, no cell contains a point of the plane.
        let off = normal * (1.01 * self.cell_m * normal.abs().element_sum());
        let mut light = WeightedLight::default();
        let mut bundle = Bundle::default();
        for &Direction { unit, step } in directions {
            let cosine = normal.dot(unit);
            if cosine <= 0.0 && !both {
                continue;
            }
            let weight = cosine.abs() * if unit.z > 0.0 { 1.0 } else { FROM_BELOW };
            let start = at + if cosine > 0.0 { off } else { -off };
            let middle = start + 0.5 * self.cell_m * unit;
            bundle.push(self.relative(middle), step, weight);
            if bundle.len == LANES {
                light.add(self, &bundle, steps);
                bundle.len = 0;
            }
        }
        bundle.repeat_first();
        light.add(self, &bundle, steps);
        light.share()
    }

    /// A place in parts of cells from the grid's lowest corner.
    #[inline(always)]
    fn relative(&self, at: Vec3) -> I64Vec3 {
        fine(at, self.cell_m) - (self.low << FINE_BITS)
    }
}

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    pub(super) at: Vec3,
    pub(super) normal: Vec3,
    /// Whether light reaches both sides, not the side of the normal alone.
    pub(super) both: bool,
}

const LANES: usize = F32x8::LANES;

/// Directions that are followed side by side. Numbers are those of parts of cells from the grid's
/// lowest corner, which wrap around.
#[derive(Clone, Copy, Debug, Default)]
struct Bundle {
    at: [[u32; LANES]; 3],
    step: [[u32; LANES]; 3],
    weights: [f32; LANES],
    len: usize,
}

impl Bundle {
    #[inline(always)]
    fn push(&mut self, at: I64Vec3, step: I64Vec3, weight: f32) {
        for axis in 0..3 {
            self.at[axis][self.len] = at[axis] as u32;
            self.step[axis][self.len] = step[axis] as u32;
        }
        self.weights[self.len] = weight;
        self.len += 1;
    }

    /// Fills lanes that have no direction with the first one.
    #[inline(always)]
    fn repeat_first(&mut self) {
        for lanes in self.at.iter_mut().chain(&mut self.step) {
            let first = lanes[0];
            lanes[self.len..].fill(first);
        }
    }
}

/// The light of the directions so far, and what it would be if nothing were there.
#[derive(Clone, Copy, Debug, Default)]
struct WeightedLight {
    sum: f32,
    all: f32,
}

impl WeightedLight {
    #[inline(always)]
    fn add(&mut self, grid: &AreaDensityGrid, bundle: &Bundle, steps: u32) {
        if bundle.len == 0 {
            return;
        }
        let depths = optical_depths(grid, bundle, steps).to_array();
        for (&depth, &weight) in depths.iter().zip(&bundle.weights[..bundle.len]) {
            self.all += weight;
            self.sum += if depth > 0.0 {
                weight * libm::expf(-depth)
            } else {
                weight
            };
        }
    }

    #[inline(always)]
    fn share(self) -> f32 {
        if self.all > 0.0 {
            self.sum / self.all
        } else {
            1.0
        }
    }
}

/// The optical depths along `steps` steps of eight directions. It stops where all have left the
/// grid, a box, to which steps in one direction never come back.
#[inline(always)]
fn optical_depths(grid: &AreaDensityGrid, bundle: &Bundle, steps: u32) -> F32x8 {
    let [mut x, mut y, mut z] = bundle.at.map(U32x8::new);
    let [dx, dy, dz] = bundle.step.map(U32x8::new);
    let [nx, ny, nz] = grid.cells.to_array().map(|n| n as u32);
    let mut depth = F32x8::splat(0.0);
    for _ in 0..steps {
        // Negative coordinates become large ones.
        let (cx, cy, cz) = (x >> FINE_BITS, y >> FINE_BITS, z >> FINE_BITS);
        let inside = cx.lt(nx) & cy.lt(ny) & cz.lt(nz);
        let cell = (((cz * ny + cy) * nx + cx) + 1).only(inside);
        depth += cell.gather(&grid.depths);
        // Whatever is outside on an axis, and goes away from the grid or along it, has left it.
        let comes = (cx.lt(nx) | (x ^ dx).is_negative())
            & (cy.lt(ny) | (y ^ dy).is_negative())
            & (cz.lt(nz) | (z ^ dz).is_negative());
        if !comes.any() {
            break;
        }
        (x, y, z) = (x + dx, y + dy, z + dz);
    }
    depth
}

for_each_instruction_set! {
    fn lights<'a>(
        grid: &'a AreaDensityGrid,
        points: &'a [SurfacePoint],
        directions: &'a [Direction],
        steps: u32,
    ) -> Vec<f32> {
        let mut shares = Vec::with_capacity(points.len());
        for point in points {
            shares.push(grid.light(point, directions, steps));
        }
        shares
    }
}

#[cfg(test)]
mod tests {
    use nemoral_seed::{Draw, Key};

    use super::*;

    /// The oracle takes all steps of one direction after the other.
    #[test]
    fn depths_are_those_of_all_steps() {
        let cell_m = 0.1;
        let low = number(Vec3::new(-0.4, -0.2, 0.0), cell_m);
        let mut rng = Key::world(5).rng();
        let mut random = |most: f64| rng.range_f64(-most, most) as f32;
        let mut depths: Vec<f32> = (0..9 * 5 * 12).map(|_| random(1.0).abs()).collect();
        depths.insert(0, 0.0);
        let grid = AreaDensityGrid {
            low,
            cell_m,
            cells: U64Vec3::new(9, 5, 12),
            depths,
        };
        let (mut crossing, mut missing) = (0, 0);
        for k in 0..1500 {
            let mut bundle = Bundle::default();
            let mut expected = [0.0_f32; LANES];
            for sum in expected.iter_mut().take(1 + k % LANES) {
                let at = Vec3::new(random(0.8), random(0.6), random(0.8) + 0.6);
                let mut way = Vec3::new(random(1.0), random(1.0), random(1.0));
                if k % 4 < 3 {
                    way[k % 4] = 0.0;
                }
                let step = fine(way.normalize_or(Vec3::Z), 1.0);
                bundle.push(grid.relative(at), step, 1.0);
                let mut place = fine(at, cell_m);
                for _ in 0..60 {
                    *sum += grid.depths[grid.cell(place)];
                    place += step;
                }
                crossing += usize::from(*sum > 0.0);
                missing += usize::from(*sum == 0.0);
            }
            bundle.repeat_first();
            let got = optical_depths(&grid, &bundle, 60).to_array();
            assert_eq!(got[..bundle.len], expected[..bundle.len]);
        }
        assert!(crossing > 500 && missing > 500, "{crossing} {missing}");
    }
}
