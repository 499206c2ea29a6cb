//! Binary trees over boxes: built by the surface area heuristic, then improved by reinsertion.

use glam::Vec3A;
use nemoral_scene::Bounds;

use crate::node::half_area;

/// How to split a set of boxes in two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Split {
    /// Where the surface area heuristic is least.
    Sah,
    /// Into two halves of equal numbers.
    Halves,
}

/// A node of a binary tree: an inner node with two children, or a leaf with some boxes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bvh2Node {
    pub(crate) bounds: Bounds,
    /// The number of boxes below.
    pub(crate) count: u32,
    pub(crate) inner: bool,
    /// The children of an inner node; for a leaf, twice the index at which its boxes start in the
    /// tree's order.
    pub(crate) below: [u32; 2],
}

/// A tree over boxes.
pub(crate) struct Bvh2 {
    /// Children after their parents.
    pub(crate) nodes: Vec<Bvh2Node>,
    /// The numbers of the boxes, those of a leaf beside each other.
    pub(crate) order: Vec<u32>,
}

/// Bins of the surface area heuristic, for many boxes and for few.
const BINS: usize = 16;
const FEW_BINS: usize = 8;

/// Up to this number of boxes get few bins, as sweeping more bins than boxes costs more than it
/// gains.
const FEW: usize = 32;

/// Beyond this depth sets are split into halves whatever their cost, which bounds the recursion.
const SAH_DEPTH: usize = 64;

/// Trees of fewer boxes are built by one thread.
const PARALLEL: usize = 4096;

/// A box on its way into a tree, with its number.
#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds,
    number: u32,
}

/// The bounds of the boxes below a node.
#[derive(Clone, Copy)]
struct Extent {
    boxes: BoundsA,
    /// Twice the centres of the boxes.
    centres: BoundsA,
}

impl Extent {
    const NONE: Self = Self {
        boxes: BoundsA::NONE,
        centres: BoundsA::NONE,
    };

    #[inline(always)]
    fn join(&mut self, b: &Bounds) {
        let b = BoundsA::of(b);
        self.boxes = self.boxes.union(b);
        let centre = b.min + b.max;
        self.centres = self.centres.union(BoundsA {
            min: centre,
            max: centre,
        });
    }

    fn of(items: &[Item]) -> Self {
        let mut all = Self::NONE;
        items.iter().for_each(|item| all.join(&item.bounds));
        all
    }
}

/// A box in SIMD registers.
#[derive(Clone, Copy)]
struct BoundsA {
    min: Vec3A,
    max: Vec3A,
}

impl BoundsA {
    const NONE: Self = Self {
        min: Vec3A::INFINITY,
        max: Vec3A::NEG_INFINITY,
    };

    #[inline(always)]
    fn of(b: &Bounds) -> Self {
        Self {
            min: b.min.into(),
            max: b.max.into(),
        }
    }

    #[inline(always)]
    fn union(self, b: Self) -> Self {
        Self {
            min: self.min.min(b.min),
            max: self.max.max(b.max),
        }
    }

    fn half_area(self) -> f32 {
        half_area(&self.into())
    }
}

impl From<BoundsA> for Bounds {
    fn from(b: BoundsA) -> Self {
        Self {
            min: b.min.into(),
            max: b.max.into(),
        }
    }
}

/// How a tree is built.
#[derive(Clone, Copy)]
pub(crate) struct BuildParams {
    pub(crate) split: Split,
    /// The most boxes in a leaf.
    pub(crate) leaf: usize,
}

/// Builds a tree over some of the boxes, at least one. Large trees are built on all threads of the
/// current rayon pool; the result is the same to the bit.
pub(crate) fn build(boxes: &[Bounds], numbers: &[u32], params: BuildParams) -> Bvh2 {
    // The boxes themselves are sorted, not their numbers, because they are read in order many
    // times.
    let item = |&number: &u32| Item {
        bounds: boxes[number as usize],
        number,
    };
    let mut items: Vec<Item> = numbers.iter().map(item).collect();
    let mut nodes = Vec::new();
    let all = Extent::of(&items);
    params.build(
        &mut items,
        all,
        SubtreeSlot { start: 0, depth: 0 },
        &mut nodes,
    );
    let order = items.into_iter().map(|item| item.number).collect();
    Bvh2 { nodes, order }
}

/// Where a subtree is stored.
#[derive(Clone, Copy)]
struct SubtreeSlot {
    /// The number of its first item among all items.
    start: u32,
    depth: usize,
}

impl BuildParams {
    /// Adds the tree over the items, which it permutes; children are numbered from the start of
    /// `nodes`.
    fn build(self, items: &mut [Item], all: Extent, slot: SubtreeSlot, nodes: &mut Vec<Bvh2Node>) {
        let (n, at) = (items.len(), nodes.len());
        nodes.push(Bvh2Node {
            bounds: all.boxes.into(),
            count: n as u32,
            inner: n > self.leaf,
            below: [slot.start; 2],
        });
        if n <= self.leaf {
            return;
        }
        let cut = match self.split {
            Split::Sah if slot.depth < SAH_DEPTH => {
                sah_cut(items, &all.centres.into(), self.leaf as u32)
            }
            _ => None,
        };
        let (cut, extents) = cut.unwrap_or_else(|| {
            let (left, right) = items.split_at(n / 2);
            (n / 2, [left, right].map(Extent::of))
        });
        let depth = slot.depth + 1;
        let start = slot.start + cut as u32;
        let spots = [SubtreeSlot { depth, ..slot }, SubtreeSlot { start, depth }];
        let (left, right) = items.split_at_mut(cut);
        if n < PARALLEL {
            nodes[at].below[0] = nodes.len() as u32;
            self.build(left, extents[0], spots[0], nodes);
            nodes[at].below[1] = nodes.len() as u32;
            self.build(right, extents[1], spots[1], nodes);
            return;
        }
        nodes[at].below[0] = nodes.len() as u32;
        let mut of_right = Vec::new();
        rayon::join(
            || self.build(left, extents[0], spots[0], nodes),
            || self.build(right, extents[1], spots[1], &mut of_right),
        );
        let first = nodes.len() as u32;
        nodes[at].below[1] = first;
        nodes.extend(of_right.into_iter().map(|mut node| {
            if node.inner {
                node.below = node.below.map(|c| c + first);
            }
            node
        }));
    }
}

/// Partitions the items where the surface area heuristic (Wald 2007, binned) is least; returns the
/// number of those on the left and the extents of both sides, or `None` if all centres, which
/// `centres` bounds, fall together.
///
/// The cost counts leaves, not items: a ray tests all items of a leaf at once, and full leaves are
/// fewer to fetch.
fn sah_cut(items: &mut [Item], centres: &Bounds, leaf: u32) -> Option<(usize, [Extent; 2])> {
    if items.len() <= FEW {
        binned_cut::<FEW_BINS>(items, centres, leaf)
    } else {
        binned_cut::<BINS>(items, centres, leaf)
    }
}

fn binned_cut<const BINS: usize>(
    items: &mut [Item],
    centres: &Bounds,
    leaf: u32,
) -> Option<(usize, [Extent; 2])> {
    let size = centres.max - centres.min;
    let (scale, low) = (
        Vec3A::splat(BINS as f32) / Vec3A::from(size),
        Vec3A::from(centres.min),
    );
    // The scale of an axis without extent is infinite or NaN; whatever its bins are, it is not
    // split. `as` saturates.
    let bin = |place: f32| (place as i32).clamp(0, BINS as i32 - 1) as usize;
    let mut bins = [[(BoundsA::NONE, 0_u32); BINS]; 3];
    for item in &*items {
        let b = BoundsA::of(&item.bounds);
        let places = ((b.min + b.max - low) * scale).to_array();
        for (bins, place) in bins.iter_mut().zip(places) {
            let (bounds, count) = &mut bins[bin(place)];
            *bounds = bounds.union(b);
            *count += 1;
        }
    }
    let cost_of = |bounds: &BoundsA, count: u32| bounds.half_area() * count.div_ceil(leaf) as f32;
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&k| size[k] > 0.0 && scale[k].is_finite()) {
        let bins = &bins[axis];
        // Sweep from the right, then from the left.
        let mut right = [0.0_f32; BINS];
        let (mut bounds, mut count) = (BoundsA::NONE, 0);
        for k in (1..BINS).rev() {
            bounds = bounds.union(bins[k].0);
            count += bins[k].1;
            right[k] = if count == 0 {
                f32::INFINITY
            } else {
                cost_of(&bounds, count)
            };
        }
        (bounds, count) = (BoundsA::NONE, 0);
        for k in 1..BINS {
            bounds = bounds.union(bins[k - 1].0);
            count += bins[k - 1].1;
            let cost = cost_of(&bounds, count) + right[k];
            if count > 0 && best.is_none_or(|(least, ..)| cost < least) && cost.is_finite() {
                best = Some((cost, axis, k));
            }
        }
    }
    let (_, axis, at) = best?;
    let (low, scale) = (low[axis], scale[axis]);
    let mut left = 0;
    for i in 0..items.len() {
        let Bounds { min, max } = items[i].bounds;
        if bin((min[axis] + max[axis] - low) * scale) < at {
            items.swap(left, i);
            left += 1;
        }
    }
    let (of_left, of_right) = items.split_at(left);
    Some((left, [of_left, of_right].map(Extent::of)))
}

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
