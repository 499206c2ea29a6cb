//! Improves a binary tree by moving its subtrees.

use nemoral_scene::Bounds;

use super::{Bvh2, Bvh2Node};
use crate::node::half_area;

/// Where a subtree can be inserted (beside a node), and by how much that lessens the tree's area.
#[derive(Clone, Copy, Debug)]
struct InsertPosition {
    gain: f32,
    beside: u32,
}

/// A tree whose subtrees are being moved.
struct Reinsertion {
    nodes: Vec<Bvh2Node>,
    parents: Vec<u32>,
}

/// Moves subtrees to where they cost least, the largest first: `share` of all nodes, `passes` times
/// (Meister and Bittner 2018, "Parallel reinsertion for bounding volume hierarchy optimization",
/// one after the other). Children come after their parents again.
pub(crate) fn reinsert(tree: Bvh2, passes: usize, share: f32) -> Bvh2 {
    let Bvh2 { nodes, order } = tree;
    let mut parents = vec![0; nodes.len()];
    for (i, node) in (0..).zip(&nodes).filter(|(_, node)| node.inner) {
        node.below.iter().for_each(|&c| parents[c as usize] = i);
    }
    let mut tree = Reinsertion { nodes, parents };
    let mut stack = Vec::new();
    for _ in 0..passes {
        let mut largest: Vec<(f32, u32)> = (0..)
            .zip(&tree.nodes)
            .map(|(i, node)| (half_area(&node.bounds), i))
            .collect();
        largest.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        largest.truncate((largest.len() as f32 * share).ceil() as usize);
        for (_, node) in largest {
            // The root cannot be moved, and its children's parent must stay the root.
            if node != 0
                && tree.parents[node as usize] != 0
                && let Some(place) = tree.best_place(node, &mut stack)
            {
                tree.move_beside(node, place.beside);
            }
        }
    }
    let nodes = tree.in_order();
    Bvh2 { nodes, order }
}

impl Reinsertion {
    fn area(&self, node: u32) -> f32 {
        half_area(&self.nodes[node as usize].bounds)
    }

    fn sibling(&self, node: u32) -> u32 {
        let [l, r] = self.nodes[self.parents[node as usize] as usize].below;
        if l == node { r } else { l }
    }

    /// The insert position that lessens the tree's area most; `None` if there is none.
    fn best_place(&self, node: u32, stack: &mut Vec<InsertPosition>) -> Option<InsertPosition> {
        let bounds = self.nodes[node as usize].bounds;
        let area = half_area(&bounds);
        let parent = self.parents[node as usize];
        let mut best = InsertPosition {
            gain: 1e-5 * area,
            beside: 0,
        };
        // The gain from removing the node from everything below `pivot`, and the box that is left
        // there.
        let mut gain = self.area(parent);
        let mut left = Bounds::EMPTY;
        let (mut pivot, mut sibling) = (parent, self.sibling(node));
        loop {
            stack.push(InsertPosition {
                gain,
                beside: sibling,
            });
            while let Some(place) = stack.pop() {
                if place.gain - area <= best.gain {
                    continue;
                }
                let there = &self.nodes[place.beside as usize];
                let gain = place.gain - half_area(&there.bounds.union(bounds));
                if gain > best.gain {
                    best = InsertPosition { gain, ..place };
                }
                let below = gain + half_area(&there.bounds);
                if there.inner && below - area > best.gain {
                    stack.extend(there.below.map(|beside| InsertPosition {
                        gain: below,
                        beside,
                    }));
                }
            }
            left = left.union(self.nodes[sibling as usize].bounds);
            if pivot != parent {
                gain += self.area(pivot) - half_area(&left);
            }
            if pivot == 0 {
                break;
            }
            sibling = self.sibling(pivot);
            pivot = self.parents[pivot as usize];
        }
        (best.beside != 0).then_some(best)
    }

    /// Moves a node beside another. Its parent moves with it, and its sibling takes the parent's
    /// place.
    fn move_beside(&mut self, node: u32, beside: u32) {
        let parent = self.parents[node as usize];
        let sibling = self.sibling(node);
        if beside == sibling {
            return;
        }
        self.replace(parent, sibling);
        self.refit(self.parents[sibling as usize]);
        self.replace(beside, parent);
        self.nodes[parent as usize].below = [node, beside];
        self.parents[beside as usize] = parent;
        self.refit(parent);
    }

    /// Makes `new` the child of the parent of `old`.
    fn replace(&mut self, old: u32, new: u32) {
        let above = self.parents[old as usize];
        let below = &mut self.nodes[above as usize].below;
        below[usize::from(below[1] == old)] = new;
        self.parents[new as usize] = above;
    }

    /// Recomputes the boxes of a node and of those above it.
    fn refit(&mut self, mut node: u32) {
        loop {
            let [l, r] = self.nodes[node as usize].below;
            let [l, r] = [l, r].map(|c| &self.nodes[c as usize]);
            let (bounds, count) = (l.bounds.union(r.bounds), l.count + r.count);
            let me = &mut self.nodes[node as usize];
            (me.bounds, me.count) = (bounds, count);
            if node == 0 {
                return;
            }
            node = self.parents[node as usize];
        }
    }

    fn in_order(self) -> Vec<Bvh2Node> {
        let mut sorted = Vec::with_capacity(self.nodes.len());
        // Each entry is a node and the place where its new number has to be written.
        let mut stack = vec![(0, 0, 0)];
        while let Some((old, above, side)) = stack.pop() {
            let me = sorted.len() as u32;
            let node: Bvh2Node = self.nodes[old as usize];
            sorted.push(node);
            if me != 0 {
                let above: &mut Bvh2Node = &mut sorted[above as usize];
                above.below[side] = me;
            }
            if node.inner {
                stack.extend([(node.below[1], me, 1), (node.below[0], me, 0)]);
            }
        }
        sorted
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bvh2_build::{BuildParams, Split, build};

    /// The area of the inner nodes, and the numbers of the boxes found.
    fn measure(Bvh2 { nodes, order }: &Bvh2) -> (f32, Vec<u32>) {
        let mut found = Vec::new();
        let mut area = 0.0;
        for (i, node) in nodes.iter().enumerate() {
            if !node.inner {
                let start = node.below[0] as usize;
                found.extend(&order[start..start + node.count as usize]);
                continue;
            }
            let below = node.below.map(|c| &nodes[c as usize]);
            assert!(
                node.below.iter().all(|&c| c as usize > i),
                "children after parents"
            );
            assert_eq!(node.bounds, below[0].bounds.union(below[1].bounds));
            assert_eq!(node.count, below[0].count + below[1].count);
            area += half_area(&node.bounds);
        }
        found.sort_unstable();
        (area, found)
    }

    #[test]
    fn reinsertion_keeps_all_and_lessens_area() {
        for n in [1, 2, 3, 4, 7, 500] {
            let boxes: Vec<Bounds> = (0..n)
                .map(|i| {
                    let [x, y, z] = [7919, 104_729, 1_299_709].map(|p: u32| (i * p % 1009) as f32);
                    let size = Vec3::new(1.0 + x % 90.0, 1.0 + y % 7.0, 1.0 + z % 30.0);
                    let min = Vec3::new(x, y, z);
                    Bounds {
                        min,
                        max: min + size,
                    }
                })
                .collect();
            let split = Split::Halves;
            let numbers: Vec<u32> = (0..n).collect();
            let tree = build(&boxes, &numbers, BuildParams { split, leaf: 1 });
            let (before, all) = measure(&tree);
            let (_, in_fives) = measure(&build(&boxes, &numbers, BuildParams { split, leaf: 5 }));
            assert_eq!(in_fives, all);
            let (after, kept) = measure(&reinsert(tree, 2, 1.0));
            assert_eq!(kept, all);
            assert_eq!(kept.len(), n as usize);
            // Splitting an unordered list into halves gives a bad tree.
            let most = before * if n > 7 { 0.8 } else { 1.000_01 };
            assert!(after <= most, "{n}: {after} of {before}");
        }
    }
}
