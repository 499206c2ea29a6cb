//! Binary trees over boxes: built by the surface area heuristic, then improved by reinsertion.

mod reinsertion;

use glam::Vec3A;
use nemoral_scene::Bounds;

use crate::node::half_area;

pub(crate) use self::reinsertion::reinsert;

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
