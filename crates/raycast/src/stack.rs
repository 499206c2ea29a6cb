//! Depth-first search through the nodes, nearest child first.

use crate::nearest::Nearest;
use crate::node::{LEAF, LaneRay, Node};
use crate::simd::Isa;

/// Entries that the search of one tree may need at once. Builders keep to it.
pub(crate) const PER_TREE: usize = 84;

/// What is yet to be visited: distance bits above, child below. Three trees are nested: groups,
/// instances, primitives.
#[derive(Debug)]
pub(crate) struct Stack {
    entries: [u64; 3 * PER_TREE],
    len: usize,
}

impl Stack {
    pub(crate) fn new() -> Self {
        Self {
            entries: [0; 3 * PER_TREE],
            len: 0,
        }
    }

    /// Pushes the children in `mask`, the farthest first, and returns the nearest instead.
    #[inline(always)]
    fn push(&mut self, node: &Node, distances: &[f32; 8], mut mask: u32) -> Option<u32> {
        if mask == 0 {
            return None;
        }
        let mut lane = mask.trailing_zeros() as usize;
        mask &= mask - 1;
        if mask == 0 {
            return Some(node.child(lane));
        }
        let first = self.len;
        let mut nearest = key(node, distances, lane);
        while mask != 0 {
            lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            let candidate = key(node, distances, lane);
            let farther = nearest.max(candidate);
            nearest = nearest.min(candidate);
            // Insertion, descending towards the top.
            let mut at = self.len;
            while at > first && self.entries[at - 1] < farther {
                self.entries[at] = self.entries[at - 1];
                at -= 1;
            }
            self.entries[at] = farther;
            self.len += 1;
        }
        Some(nearest as u32)
    }

    /// The next child above `base` that is not beyond the nearest hit.
    #[inline(always)]
    fn pop(&mut self, base: usize, nearest: &Nearest) -> Option<u32> {
        while self.len > base {
            self.len -= 1;
            let entry = self.entries[self.len];
            if f32::from_bits((entry >> 32) as u32) <= nearest.t() {
                return Some(entry as u32);
            }
        }
        None
    }
}

/// Orders by distance (which is never negative where it matters), then by child.
#[inline(always)]
fn key(node: &Node, distances: &[f32; 8], lane: usize) -> u64 {
    u64::from(distances[lane & 7].to_bits()) << 32 | u64::from(node.child(lane))
}

/// What is done at the leaves of a tree.
///
/// A trait, not a closure: all code below a kernel must be inlined into it to be compiled for its
/// instruction set, and closures cannot be told to.
pub(crate) trait Leaves {
    fn visit<I: Isa>(&self, isa: I, leaf: u32, nearest: &mut Nearest, stack: &mut Stack);
}

/// Visits the leaves that a ray may meet, nearest first as far as boxes tell. With `ANY`, stops at
/// the first hit.
///
/// Boxes at exactly the distance of the best hit are visited too: there may be one of lower rank.
#[inline(always)]
pub(crate) fn walk<I: Isa, const ANY: bool>(
    isa: I,
    (nodes, root): (&[Node], u32),
    ray: &LaneRay,
    leaves: &impl Leaves,
    nearest: &mut Nearest,
    stack: &mut Stack,
) {
    let base = stack.len;
    let mut at = root;
    loop {
        let next = if at & LEAF == 0 {
            let node = &nodes[at as usize];
            let (distances, mask) = node.test(isa, ray, nearest);
            stack.push(node, &distances.0, mask)
        } else {
            leaves.visit(isa, at & !LEAF, nearest, stack);
            if ANY && nearest.found().is_some() {
                stack.len = base;
                return;
            }
            None
        };
        match next {
            Some(child) => at = child,
            None => match stack.pop(base, nearest) {
                Some(child) => at = child,
                None => return,
            },
        }
    }
}
