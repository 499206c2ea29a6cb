//! Depth-first traversal of a tree by one ray, nearest child first.

use crate::nearest::Nearest;
use crate::node::{Boxes, LEAF, LaneRay, Slabs};
use crate::simd::{F8, Isa, Keys};

/// The most levels that a tree may have. Builders keep to it.
pub(crate) const MAX_LEVELS: usize = 16;

/// A node that has been opened, and which of its children are yet to be visited.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Visit {
    /// Where the ray enters the children.
    distances: F8,
    keys: Keys,
    node: u32,
    /// How many children are left.
    left: u32,
}

/// The opened nodes from the root to the current node, through the three nested trees of groups,
/// instances and primitives.
#[derive(Debug)]
pub(crate) struct Stack {
    visits: [Visit; 3 * MAX_LEVELS],
    len: usize,
}

impl Stack {
    pub(crate) const fn new() -> Self {
        let none = Visit {
            distances: F8::splat(0.0),
            keys: Keys::NONE,
            node: 0,
            left: 0,
        };
        Self {
            visits: [none; 3 * MAX_LEVELS],
            len: 0,
        }
    }

    /// Abandons a search that owns the whole stack.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    /// Takes the nearest child that is left above `base`, skipping those beyond the nearest hit.
    #[inline(always)]
    fn take<I: Isa>(
        &mut self,
        isa: I,
        nodes: &[impl Boxes],
        base: usize,
        nearest: &Nearest,
    ) -> Option<u32> {
        while self.len > base {
            let visit = &mut self.visits[self.len - 1];
            let lane = isa.first(&visit.keys);
            let distance = visit.distances.0[lane & 7];
            if nearest.is_below_key(distance) {
                // The others are no nearer.
                self.len -= 1;
                continue;
            }
            visit.keys.remove(lane);
            visit.left -= 1;
            self.len -= usize::from(visit.left == 0);
            if distance <= nearest.t() {
                return Some(nodes[visit.node as usize].child(lane));
            }
        }
        None
    }
}

/// The action at the leaves of a tree during a traversal.
///
/// A trait, not a closure: all code below a kernel must be inlined into it to be compiled for its
/// instruction set, and closures cannot be told to.
pub(crate) trait LeafVisitor {
    fn visit<I: Isa>(&self, isa: I, leaf: u32, nearest: &mut Nearest, stack: &mut Stack);
}

/// Visits the leaves whose boxes a ray passes through, in order of the boxes' distances. With
/// `ANY`, stops at the first hit.
///
/// Boxes at exactly the distance of the best hit are visited too: there may be one of lower rank.
#[inline(always)]
pub(crate) fn traverse<I: Isa, B: Boxes, L: LeafVisitor, const ANY: bool>(
    isa: I,
    (nodes, root): (&[B], u32),
    ray: &LaneRay,
    leaves: &L,
    nearest: &mut Nearest,
    stack: &mut Stack,
) {
    let base = stack.len;
    let slabs = Slabs::new(isa, ray, nearest);
    let mut at = Some(root);
    while let Some(here) = at {
        at = step::<I, B, L, ANY>(isa, (nodes, here), &slabs, leaves, nearest, (stack, base));
    }
}

/// One step of a search that owns the stack above `base`: from a node or leaf to the next one, if
/// there is one.
#[inline(always)]
pub(crate) fn step<I: Isa, B: Boxes, L: LeafVisitor, const ANY: bool>(
    isa: I,
    (nodes, at): (&[B], u32),
    slabs: &Slabs<I>,
    leaves: &L,
    nearest: &mut Nearest,
    (stack, base): (&mut Stack, usize),
) -> Option<u32> {
    if at & LEAF == 0 {
        let node = &nodes[at as usize];
        let (distances, hit) = node.test(isa, slabs, nearest);
        let lanes = isa.signs(hit);
        if lanes != 0 {
            let mut keys = isa.keys(distances, hit);
            let lane = isa.first(&keys);
            keys.remove(lane);
            let left = lanes.count_ones() - 1;
            // The entry is always written and kept only if needed, which is faster than a branch.
            stack.visits[stack.len] = Visit {
                distances: isa.store(distances),
                keys,
                node: at,
                left,
            };
            stack.len += usize::from(left > 0);
            return Some(node.child(lane));
        }
    } else {
        leaves.visit(isa, at & !LEAF, nearest, stack);
        if ANY && nearest.found().is_some() {
            stack.len = base;
            return None;
        }
    }
    stack.take(isa, nodes, base, nearest)
}
