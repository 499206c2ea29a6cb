//! Bounding volume hierarchies: binary by the surface area heuristic, then eight wide.

use glam::Vec3;
use nemoral_scene::Bounds;

use crate::node::{LEAF, Node, half_area};
use crate::stack::PER_TREE;

const BINS: usize = 16;

/// Beyond this depth halves are taken, whatever they cost: it bounds the recursion.
const SAH_DEPTH: usize = 64;

/// Cost of a leaf relative to that of visiting one binary node.
const LEAF_COST: f32 = 1.0;

/// Builds an eight-wide tree over boxes into `nodes` and returns its root: a node or, with [`LEAF`]
/// set, a leaf. `leaf` turns up to `max_leaf` box numbers into a leaf number.
///
/// # Panics
/// If there are no boxes.
pub(crate) fn build(
    boxes: &[Bounds],
    max_leaf: usize,
    nodes: &mut Vec<Node>,
    mut leaf: impl FnMut(&[u32]) -> u32,
) -> u32 {
    assert!(!boxes.is_empty(), "a tree has at least one box");
    let mut wide = Wide::plan(boxes, max_leaf, Split::Sah);
    if wide.stack_need(0) > PER_TREE {
        // Halves of halves are at most 11 wide levels deep: 77 entries.
        wide = Wide::plan(boxes, max_leaf, Split::Halves);
    }
    wide.emit(0, nodes, &mut leaf)
}

/// At most 64 boxes that together hold those of a tree: two levels of its nodes.
pub(crate) fn cover(boxes: &[Bounds], nodes: &[Node], root: u32) -> Vec<Bounds> {
    if root & LEAF != 0 {
        return vec![boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(*b))];
    }
    let mut cover = Vec::new();
    for (bounds, child) in nodes[root as usize].children() {
        match nodes.get(child as usize) {
            Some(node) => cover.extend(node.children().map(|(bounds, _)| bounds)),
            None => cover.push(bounds),
        }
    }
    cover
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Split {
    Sah,
    Halves,
}

/// A binary node: an inner one has two children, a leaf one box.
#[derive(Clone, Copy, Debug)]
struct Binary {
    bounds: Bounds,
    /// Boxes below.
    count: u32,
    inner: bool,
    /// Children of an inner node; for a leaf the number of its box, twice.
    below: [u32; 2],
}

struct Wide {
    /// Children after their parents.
    nodes: Vec<Binary>,
    is_leaf: Vec<bool>,
    split: Split,
}

impl Wide {
    fn plan(boxes: &[Bounds], max_leaf: usize, split: Split) -> Self {
        let mut nodes = Vec::with_capacity(2 * boxes.len());
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        grow(boxes, &mut order, split, 0, &mut nodes);
        // Bottom-up: is one leaf cheaper than what is below?
        let mut cost = vec![0.0_f32; nodes.len()];
        let mut is_leaf = vec![true; nodes.len()];
        for (i, node) in nodes.iter().enumerate().rev() {
            let area = half_area(&node.bounds);
            cost[i] = area * LEAF_COST;
            if node.inner {
                let [l, r] = node.below.map(|c| cost[c as usize]);
                let below = area + l + r;
                is_leaf[i] = node.count as usize <= max_leaf && cost[i] <= below;
                if !is_leaf[i] {
                    cost[i] = below;
                }
            }
        }
        Self {
            nodes,
            is_leaf,
            split,
        }
    }

    /// The up to eight children of a wide node: the binary node's, the largest opened first.
    fn children(&self, root: u32) -> Vec<u32> {
        let mut children = self.nodes[root as usize].below.to_vec();
        while children.len() < 8 {
            let size = |&c: &u32| {
                let node = &self.nodes[c as usize];
                match self.split {
                    Split::Sah => half_area(&node.bounds),
                    Split::Halves => node.count as f32,
                }
            };
            let open = (0..children.len())
                .filter(|&i| !self.is_leaf[children[i] as usize])
                .max_by(|&a, &b| size(&children[a]).total_cmp(&size(&children[b])));
            let Some(i) = open else { break };
            let [l, r] = self.nodes[children[i] as usize].below;
            children[i] = l;
            children.push(r);
        }
        children
    }

    /// Entries that the search below a node may leave on its stack.
    fn stack_need(&self, root: u32) -> usize {
        if self.is_leaf[root as usize] {
            return 0;
        }
        let children = self.children(root);
        let below = children.iter().map(|&c| self.stack_need(c)).max();
        children.len() - 1 + below.unwrap_or(0)
    }

    fn boxes_below(&self, root: u32, out: &mut Vec<u32>) {
        let node = &self.nodes[root as usize];
        if node.inner {
            node.below.iter().for_each(|&c| self.boxes_below(c, out));
        } else {
            out.push(node.below[0]);
        }
    }

    fn emit(&self, root: u32, nodes: &mut Vec<Node>, leaf: &mut impl FnMut(&[u32]) -> u32) -> u32 {
        if self.is_leaf[root as usize] {
            let mut boxes = Vec::new();
            self.boxes_below(root, &mut boxes);
            return leaf(&boxes) | LEAF;
        }
        let at = nodes.len();
        nodes.push(Node::new(&[]));
        let children: Vec<(Bounds, u32)> = self
            .children(root)
            .into_iter()
            .map(|c| (self.nodes[c as usize].bounds, self.emit(c, nodes, leaf)))
            .collect();
        nodes[at] = Node::new(&children);
        at as u32
    }
}

/// Grows the binary tree over the boxes in `order`, which it permutes; returns its root.
fn grow(
    boxes: &[Bounds],
    order: &mut [u32],
    split: Split,
    depth: usize,
    nodes: &mut Vec<Binary>,
) -> u32 {
    let me = nodes.len();
    let bounds = order
        .iter()
        .fold(Bounds::EMPTY, |b, &i| b.union(boxes[i as usize]));
    nodes.push(Binary {
        bounds,
        count: order.len() as u32,
        inner: order.len() > 1,
        below: [order[0]; 2],
    });
    if order.len() > 1 {
        let cut = match split {
            Split::Sah if depth < SAH_DEPTH => sah_cut(boxes, order),
            _ => None,
        };
        let (left, right) = order.split_at_mut(cut.unwrap_or(order.len() / 2));
        let left = grow(boxes, left, split, depth + 1, nodes);
        let right = grow(boxes, right, split, depth + 1, nodes);
        nodes[me].below = [left, right];
    }
    me as u32
}

/// Twice the centre.
#[inline(always)]
fn centre(b: &Bounds) -> Vec3 {
    b.min + b.max
}

/// Partitions `order` where the surface area heuristic (Wald 2007, binned) is least; returns the
/// number of boxes on the left, or `None` if all centres fall together.
fn sah_cut(boxes: &[Bounds], order: &mut [u32]) -> Option<usize> {
    let centres = Bounds::of_points(order.iter().map(|&i| centre(&boxes[i as usize])));
    let size = centres.max - centres.min;
    let scale = Vec3::splat(BINS as f32) / size;
    let bin = |b: &Bounds, axis: usize| {
        (((centre(b) - centres.min)[axis] * scale[axis]) as usize).min(BINS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&k| size[k] > 0.0 && scale[k].is_finite()) {
        let mut bins = [(Bounds::EMPTY, 0_u32); BINS];
        for &i in order.iter() {
            let b = &boxes[i as usize];
            let (bounds, count) = &mut bins[bin(b, axis)];
            *bounds = bounds.union(*b);
            *count += 1;
        }
        // Sweep from the right, then from the left.
        let mut right = [0.0_f32; BINS];
        let (mut bounds, mut count) = (Bounds::EMPTY, 0);
        for k in (1..BINS).rev() {
            bounds = bounds.union(bins[k].0);
            count += bins[k].1;
            right[k] = if count == 0 {
                f32::INFINITY
            } else {
                half_area(&bounds) * count as f32
            };
        }
        (bounds, count) = (Bounds::EMPTY, 0);
        for k in 1..BINS {
            bounds = bounds.union(bins[k - 1].0);
            count += bins[k - 1].1;
            let cost = half_area(&bounds) * count as f32 + right[k];
            if count > 0 && best.is_none_or(|(least, ..)| cost < least) && cost.is_finite() {
                best = Some((cost, axis, k));
            }
        }
    }
    let (_, axis, at) = best?;
    let mut left = 0;
    for i in 0..order.len() {
        if bin(&boxes[order[i] as usize], axis) < at {
            order.swap(left, i);
            left += 1;
        }
    }
    Some(left)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Entries that the search below a node may leave on its stack, and the boxes found there.
    fn walk(nodes: &[Node], at: u32, found: &mut Vec<u32>) -> usize {
        if at & LEAF != 0 {
            found.push(at & !LEAF);
            return 0;
        }
        let children: Vec<_> = nodes[at as usize].children().collect();
        let below = children.iter().map(|&(bounds, child)| {
            if child & LEAF == 0 {
                for (inner, _) in nodes[child as usize].children() {
                    assert_eq!(bounds.union(inner), bounds, "a box holds those below");
                }
            }
            walk(nodes, child, found)
        });
        children.len() - 1 + below.max().unwrap_or(0)
    }

    fn check(boxes: &[Bounds]) {
        let mut nodes = Vec::new();
        let root = build(boxes, 1, &mut nodes, |b| b[0]);
        let mut found = Vec::new();
        assert!(walk(&nodes, root, &mut found) <= PER_TREE);
        found.sort_unstable();
        assert!(found.into_iter().eq(0..boxes.len() as u32));
    }

    fn cube(at: Vec3, half: f32) -> Bounds {
        let (min, max) = (at - half, at + half);
        Bounds { min, max }
    }

    #[test]
    fn every_box_is_found_within_the_stack() {
        check(&[cube(Vec3::ONE, 0.0)]);
        check(&[cube(Vec3::ONE, 1.0); 3000]);
        let grid = |i: u32| cube(Vec3::new((i % 61) as f32, (i / 61) as f32, 0.0), 0.4);
        check(&(0..3000).map(grid).collect::<Vec<_>>());
        // Each as large as all before: areas, even sums of areas, overflow.
        let growing = |k: i32| cube(Vec3::splat(2.0_f32.powi(k)), 2.0_f32.powi(k - 1));
        check(&(-126..127).map(growing).collect::<Vec<_>>());
    }

    #[test]
    fn a_lopsided_tree_needs_halves() {
        let growing = |k: i32| cube(Vec3::splat(2.0_f32.powi(k)), 2.0_f32.powi(k - 1));
        let boxes: Vec<_> = (-60..60).flat_map(|k| [growing(k); 4]).collect();
        assert!(Wide::plan(&boxes, 1, Split::Sah).stack_need(0) > PER_TREE);
        assert!(Wide::plan(&boxes, 1, Split::Halves).stack_need(0) <= PER_TREE);
        check(&boxes);
    }
}
