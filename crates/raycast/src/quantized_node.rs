//! Nodes whose boxes are stored on a grid.
//!
//! They take half the memory of boxes in f32, which counts for shapes, whose nodes are many. The
//! grid of a shape has 65,535 steps over its size, a fraction of a millimetre, and boxes are
//! rounded outwards.

use crate::node::{Boxes, Node};
use crate::quantization_grid::QuantizationGrid;
use crate::simd::{Isa, U8};

/// Eight boxes on a grid and the child in each of them.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct QuantizedNode {
    /// x low, x high, y low, y high, z low, z high. Lanes without a child are inside out.
    planes: [U8; 6],
    /// Rays from very far may take an empty lane for a box; they find no child there, because no
    /// block has the number `u32::MAX`.
    children: [u32; 8],
}

impl QuantizedNode {
    /// A node with its boxes on the grid, which is over all of them.
    pub(crate) fn new(node: &Node, grid: &QuantizationGrid) -> Self {
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

    /// The same node with its boxes in f32, for many rays.
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

impl Boxes for QuantizedNode {
    #[inline(always)]
    fn plane<I: Isa>(&self, isa: I, axis: usize, side: usize) -> I::V {
        isa.widen(&self.planes[2 * axis + (side & 1)])
    }

    #[inline(always)]
    fn child(&self, lane: usize) -> u32 {
        self.children[lane & 7]
    }
}
