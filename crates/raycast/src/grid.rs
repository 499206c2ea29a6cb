//! Boxes on a grid: half the memory of those in f32, for shapes, whose nodes are many.
//!
//! A shape's own grid has 65,535 steps over its size: a fraction of a millimetre, outwards.

use glam::DVec3;
use nemoral_scene::Bounds;

use crate::node::{Boxes, Node};
use crate::simd::{Isa, U8};

/// Steps of a grid, per axis.
const STEPS: f64 = 65_535.0;

/// Planes at equal distances.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    /// Where the first planes are.
    pub(crate) origin: DVec3,
    /// From each to the next.
    pub(crate) step: [f32; 3],
}

impl Grid {
    /// For coordinates as they are.
    pub(crate) const NONE: Self = Self {
        origin: DVec3::ZERO,
        step: [1.0; 3],
    };

    /// Over a box.
    pub(crate) fn over(bounds: &Bounds) -> Self {
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        // More than its share, so that rounding does not bring the last plane inside.
        let step = (max - min) / (STEPS - 1.0);
        Self {
            origin: min,
            step: step.as_vec3().to_array().map(|s| s.max(1e-30)),
        }
    }

    /// The planes just below and above two coordinates of an axis.
    fn around(&self, axis: usize, low: f32, high: f32) -> [u16; 2] {
        let (origin, step) = (self.origin[axis], f64::from(self.step[axis]));
        let below = ((f64::from(low) - origin) / step).floor();
        let above = ((f64::from(high) - origin) / step).ceil();
        // `as` saturates.
        [below as u16, above as u16]
    }
}

/// Eight boxes on a grid and what is in them.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct GridNode {
    /// x low, x high, y low, y high, z low, z high. Lanes without a child are inside out.
    planes: [U8; 6],
    /// Where rays from very far take an empty lane for a box, they find no child there:
    /// `u32::MAX` is no block.
    children: [u32; 8],
}

impl GridNode {
    /// A node with its boxes on the grid, which is over all of them.
    pub(crate) fn new(node: &Node, grid: &Grid) -> Self {
        let mut planes = [0, 1, 2, 3, 4, 5].map(|k| U8([if k % 2 == 0 { u16::MAX } else { 0 }; 8]));
        let mut children = [u32::MAX; 8];
        for (lane, (bounds, child)) in node.children().enumerate() {
            for axis in 0..3 {
                let [low, high] = grid.around(axis, bounds.min[axis], bounds.max[axis]);
                planes[2 * axis].0[lane] = low;
                planes[2 * axis + 1].0[lane] = high;
            }
            children[lane] = child;
        }
        Self { planes, children }
    }

    /// The same in f32, for many rays.
    #[inline(always)]
    pub(crate) fn wide<I: Isa>(&self, isa: I) -> Node {
        let p = &self.planes;
        let wide = [
            isa.store(isa.widen(&p[0])),
            isa.store(isa.widen(&p[1])),
            isa.store(isa.widen(&p[2])),
            isa.store(isa.widen(&p[3])),
            isa.store(isa.widen(&p[4])),
            isa.store(isa.widen(&p[5])),
        ];
        Node::of(wide, self.children)
    }
}

impl Boxes for GridNode {
    #[inline(always)]
    fn plane<I: Isa>(&self, isa: I, axis: usize, side: usize) -> I::V {
        isa.widen(&self.planes[2 * axis + (side & 1)])
    }

    #[inline(always)]
    fn child(&self, lane: usize) -> u32 {
        self.children[lane & 7]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn boxes_on_the_grid_hold_those_that_they_are_made_of(
            points in prop::collection::vec(prop::array::uniform3(-1e6_f32..1e6), 2..20),
            flat in 0_usize..4,
            size in prop::sample::select(vec![1e-6_f32, 1.0, 1e6]),
        ) {
            let points = points.iter().map(|p| {
                let mut p = Vec3::from_array(*p) * 1e-6 * size + 3.0;
                if flat < 3 { p[flat] = 7.1; }
                p
            });
            let points: Vec<Vec3> = points.collect();
            let grid = Grid::over(&Bounds::of_points(points.iter().copied()));
            for pair in points.windows(2) {
                let b = Bounds::of_points(pair.iter().copied());
                for k in 0..3 {
                    let planes = grid.around(k, b.min[k], b.max[k]);
                    let [low, high] = planes.map(|p| grid.origin[k] + f64::from(p) * f64::from(grid.step[k]));
                    let (min, max) = (f64::from(b.min[k]), f64::from(b.max[k]));
                    // To the rounding of f64, which the slack of rays covers.
                    let tiny = 1e-12 * f64::from(size);
                    prop_assert!(low <= min + tiny && high >= max - tiny, "{low} {min} {max} {high}");
                    let step = 1.001 * f64::from(grid.step[k]) + tiny;
                    prop_assert!(min - low <= step && high - max <= step);
                }
            }
        }
    }
}
