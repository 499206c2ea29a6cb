//! Bounding volume hierarchies, eight wide.

use nemoral_scene::Bounds;

use crate::bvh2_build::{self, BuildParams, Bvh2, Bvh2Node, Split};
use crate::node::{LEAF, Node, half_area};
use crate::traversal::MAX_LEVELS;

/// The cost of a leaf relative to that of visiting one binary node.
const LEAF_COST: f32 = 1.0;

/// How much is done to improve a tree by reinsertion: in each pass this share of all subtrees is
/// moved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BuildEffort {
    pub(crate) passes: usize,
    pub(crate) share: f32,
}

/// Builds an eight-wide tree over boxes into `nodes` and returns its root: a node or, with [`LEAF`]
/// set, a leaf. `leaf` turns up to `max_leaf` box numbers into a leaf number.
///
/// # Panics
/// If there are no boxes.
pub(crate) fn build(
    boxes: &[Bounds],
    max_leaf: usize,
    effort: BuildEffort,
    nodes: &mut Vec<Node>,
    leaf: impl FnMut(&[u32]) -> u32,
) -> u32 {
    let all: Vec<u32> = (0..boxes.len() as u32).collect();
    Bvh8::over(boxes, &all, max_leaf, effort).write(nodes, Node::new, leaf)
}

/// An eight-wide tree before it is written as nodes and leaves.
pub(crate) struct Bvh8 {
    /// Children after their parents.
    nodes: Vec<Bvh2Node>,
    /// The boxes' numbers, those of a leaf beside each other.
    order: Vec<u32>,
    is_leaf: Vec<bool>,
    split: Split,
}

impl Bvh8 {
    /// Builds a tree over the boxes with these numbers, with at most `max_leaf` in a leaf.
    ///
    /// # Panics
    /// If there are no numbers.
    pub(crate) fn over(
        boxes: &[Bounds],
        numbers: &[u32],
        max_leaf: usize,
        effort: BuildEffort,
    ) -> Self {
        assert!(!numbers.is_empty(), "a tree has at least one box");
        let build2 = |split, leaf| bvh2_build::build(boxes, numbers, BuildParams { split, leaf });
        let binary = if effort.passes > 0 {
            // Reinsertion moves each box on its own.
            bvh2_build::reinsert(build2(Split::Sah, 1), effort.passes, effort.share)
        } else {
            build2(Split::Sah, max_leaf)
        };
        let wide = Self::collapse(binary, max_leaf, Split::Sah);
        if wide.levels(0) <= MAX_LEVELS {
            return wide;
        }
        // A tree of halves is at most 11 wide levels deep.
        Self::collapse(build2(Split::Halves, max_leaf), max_leaf, Split::Halves)
    }

    /// How many leaves there are.
    pub(crate) fn leaves(&self) -> usize {
        let mut below = vec![0];
        let mut leaves = 0;
        while let Some(node) = below.pop() {
            if self.is_leaf[node as usize] {
                leaves += 1;
            } else {
                below.extend(self.nodes[node as usize].below);
            }
        }
        leaves
    }

    /// The box around everything.
    pub(crate) fn bounds(&self) -> Bounds {
        self.nodes[0].bounds
    }

    /// At most 64 boxes that together contain everything: those of two levels of wide nodes.
    pub(crate) fn cover(&self) -> Vec<Bounds> {
        let below = |node: u32| match self.is_leaf[node as usize] {
            true => vec![node],
            false => self.children(node),
        };
        let cover = below(0).into_iter().flat_map(below);
        cover.map(|node| self.nodes[node as usize].bounds).collect()
    }

    /// Writes the tree and returns its root: a node or, with [`LEAF`] set, a leaf. `node` makes a
    /// node of up to eight boxes and their children, `leaf` turns box numbers into a leaf number.
    pub(crate) fn write<N>(
        &self,
        nodes: &mut Vec<N>,
        node: impl Fn(&[(Bounds, u32)]) -> N,
        mut leaf: impl FnMut(&[u32]) -> u32,
    ) -> u32 {
        self.emit(0, nodes, &node, &mut leaf)
    }

    fn collapse(Bvh2 { nodes, order }: Bvh2, max_leaf: usize, split: Split) -> Self {
        // Bottom-up: a subtree becomes one leaf where that is cheaper.
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
            order,
            is_leaf,
            split,
        }
    }

    /// The up to eight children of a wide node, found by opening the largest binary node first.
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

    /// The number of levels of wide nodes from one node down.
    fn levels(&self, root: u32) -> usize {
        if self.is_leaf[root as usize] {
            return 0;
        }
        let below = self.children(root).into_iter().map(|c| self.levels(c));
        1 + below.max().unwrap_or(0)
    }

    fn boxes_below(&self, root: u32, out: &mut Vec<u32>) {
        let node = &self.nodes[root as usize];
        if node.inner {
            node.below.iter().for_each(|&c| self.boxes_below(c, out));
        } else {
            let start = node.below[0] as usize;
            out.extend(&self.order[start..start + node.count as usize]);
        }
    }

    fn emit<N>(
        &self,
        root: u32,
        nodes: &mut Vec<N>,
        node: &impl Fn(&[(Bounds, u32)]) -> N,
        leaf: &mut impl FnMut(&[u32]) -> u32,
    ) -> u32 {
        if self.is_leaf[root as usize] {
            let mut boxes = Vec::new();
            self.boxes_below(root, &mut boxes);
            return leaf(&boxes) | LEAF;
        }
        let at = nodes.len();
        nodes.push(node(&[]));
        let below = self.children(root).into_iter().map(|child| {
            let bounds = self.nodes[child as usize].bounds;
            (bounds, self.emit(child, nodes, node, leaf))
        });
        let below: Vec<(Bounds, u32)> = below.collect();
        nodes[at] = node(&below);
        at as u32
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// The levels of nodes below one, and the boxes found there.
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
        1 + below.max().unwrap_or(0)
    }

    fn check(boxes: &[Bounds]) {
        let mut nodes = Vec::new();
        let root = build(
            boxes,
            1,
            BuildEffort {
                passes: 2,
                share: 1.0,
            },
            &mut nodes,
            |b| b[0],
        );
        let mut found = Vec::new();
        assert!(walk(&nodes, root, &mut found) <= MAX_LEVELS);
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
        // Each box is as large as all before it, so that areas, and sums of areas, overflow.
        let growing = |k: i32| cube(Vec3::splat(2.0_f32.powi(k)), 2.0_f32.powi(k - 1));
        check(&(-126..127).map(growing).collect::<Vec<_>>());
    }

    #[test]
    fn a_lopsided_tree_needs_halves() {
        let growing = |k: i32| cube(Vec3::splat(2.0_f32.powi(k)), 2.0_f32.powi(k - 1));
        let boxes: Vec<_> = (-60..60).flat_map(|k| [growing(k); 4]).collect();
        let all: Vec<u32> = (0..boxes.len() as u32).collect();
        let build2 = |split| bvh2_build::build(&boxes, &all, BuildParams { split, leaf: 1 });
        let levels = |split| Bvh8::collapse(build2(split), 1, split).levels(0);
        assert!(levels(Split::Sah) > MAX_LEVELS);
        assert!(levels(Split::Halves) <= MAX_LEVELS);
        check(&boxes);
    }
}
