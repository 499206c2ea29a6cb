//! A quadtree over disks of different radii.

use std::ops::ControlFlow;

use glam::DVec2;

use super::index::{NeighbourIndex, overlap};

/// A leaf is split when it holds more than this.
const LEAF: u32 = 12;
/// Coincident points cannot be separated, so a leaf at this depth grows instead of being split.
const MAX_DEPTH: u32 = 16;
const NONE: u32 = u32::MAX;

/// A region quadtree of disks (the paper's neighbour search, section IV-D).
///
/// Every node knows the tight box of its centres and its largest radius, so that a query descends
/// only where an overlap is possible, whatever the mix of radii. Disks outside of the bounds given
/// to [`new`](Self::new) are found as well, only more slowly.
#[derive(Clone, Debug)]
pub struct QuadTree {
    disks: Vec<Disk>,
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Disk {
    p: DVec2,
    radius: f64,
    /// The next disk of the same leaf.
    next: u32,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    /// The box of the centres below, and the largest radius among them.
    low: DVec2,
    high: DVec2,
    max_radius: f64,
    /// The cell: where it is split.
    centre: DVec2,
    half: f64,
    /// The first of four consecutive children, [`NONE`] for a leaf.
    children: u32,
    /// The first disk of a leaf.
    first: u32,
    len: u32,
    depth: u32,
}

impl Node {
    fn empty(centre: DVec2, half: f64, depth: u32) -> Self {
        Self {
            low: DVec2::INFINITY,
            high: DVec2::NEG_INFINITY,
            max_radius: 0.0,
            centre,
            half,
            children: NONE,
            first: NONE,
            len: 0,
            depth,
        }
    }

    fn quadrant(&self, p: DVec2) -> u32 {
        u32::from(p.x >= self.centre.x) + 2 * u32::from(p.y >= self.centre.y)
    }
}

impl QuadTree {
    /// An empty tree for disks in the square of edge `size` whose lower corner is `low`.
    #[must_use]
    pub fn new(low: DVec2, size: f64) -> Self {
        let half = size / 2.0;
        Self {
            disks: Vec::new(),
            nodes: vec![Node::empty(low + DVec2::splat(half), half, 0)],
        }
    }

    /// The number of disks.
    #[must_use]
    pub fn len(&self) -> usize {
        self.disks.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.disks.is_empty()
    }

    /// The centre and radius of a disk by its number.
    #[must_use]
    pub fn get(&self, number: usize) -> Option<(DVec2, f64)> {
        self.disks.get(number).map(|d| (d.p, d.radius))
    }

    /// Stores a disk and returns its number: disks are numbered from 0 as they come.
    pub fn insert(&mut self, p: DVec2, radius: f64) -> usize {
        let number = self.disks.len();
        self.disks.push(Disk {
            p,
            radius,
            next: NONE,
        });
        self.descend(0, number as u32);
        number
    }

    /// Puts a stored disk into the leaf below a node where it belongs.
    fn descend(&mut self, mut at: u32, disk: u32) {
        let Disk { p, radius, .. } = self.disks[disk as usize];
        loop {
            let node = &mut self.nodes[at as usize];
            node.low = node.low.min(p);
            node.high = node.high.max(p);
            node.max_radius = node.max_radius.max(radius);
            if node.children == NONE {
                self.disks[disk as usize].next = node.first;
                node.first = disk;
                node.len += 1;
                if node.len > LEAF && node.depth < MAX_DEPTH {
                    self.split(at);
                }
                return;
            }
            at = node.children + node.quadrant(p);
        }
    }

    fn split(&mut self, at: u32) {
        let children = self.nodes.len() as u32;
        let node = &mut self.nodes[at as usize];
        let mut disk = node.first;
        node.children = children;
        node.first = NONE;
        let (centre, half, depth) = (node.centre, node.half / 2.0, node.depth + 1);
        for (x, y) in [(-half, -half), (half, -half), (-half, half), (half, half)] {
            self.nodes
                .push(Node::empty(centre + DVec2::new(x, y), half, depth));
        }
        while disk != NONE {
            let next = self.disks[disk as usize].next;
            self.descend(at, disk);
            disk = next;
        }
    }

    /// [`NeighbourIndex::visit_overlaps`] without the virtual call.
    pub(crate) fn search<F: FnMut(usize) -> ControlFlow<()>>(
        &self,
        p: DVec2,
        radius: f64,
        visit: &mut F,
    ) -> ControlFlow<()> {
        // Depth first: at most three siblings wait on each level.
        let mut stack = [0_u32; 3 * MAX_DEPTH as usize + 4];
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let node = &self.nodes[stack[waiting] as usize];
            let reach = radius + node.max_radius;
            // The box of an empty node is infinitely far away, and the clamp below gives no NaN for
            // it.
            let gap = (node.low - p).max(p - node.high).max(DVec2::ZERO);
            if gap.length_squared() >= reach * reach {
                continue;
            }
            if node.children != NONE {
                // The quadrant of p is visited first, as a search for any overlap usually ends
                // there.
                let nearest = node.quadrant(p);
                for flip in [3, 2, 1, 0] {
                    stack[waiting] = node.children + (nearest ^ flip);
                    waiting += 1;
                }
                continue;
            }
            let mut i = node.first;
            while i != NONE {
                let disk = &self.disks[i as usize];
                if overlap(p, radius, disk.p, disk.radius) {
                    visit(i as usize)?;
                }
                i = disk.next;
            }
        }
        ControlFlow::Continue(())
    }
}

impl NeighbourIndex for QuadTree {
    fn visit_overlaps(
        &self,
        p: DVec2,
        radius: f64,
        mut visit: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.search(p, radius, &mut visit)
    }
}

/// Whether a disk would overlap none of those stored.
pub(crate) fn is_free(index: &QuadTree, p: DVec2, radius: f64) -> bool {
    index
        .search(p, radius, &mut |_| ControlFlow::Break(()))
        .is_continue()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearScan;
    use proptest::prelude::*;

    fn disk() -> impl Strategy<Value = (f64, f64, f64)> {
        // Coarse coordinates make coincident points and exact touches common; some are out of
        // bounds.
        let coordinate = prop_oneof![(-40..140_i32).prop_map(|i| f64::from(i) / 100.0), -0.5..1.5];
        let radius = prop_oneof![Just(0.0), 0.0..0.02, 0.0..0.5];
        (coordinate.clone(), coordinate, radius)
    }

    proptest! {
        #[test]
        fn finds_what_a_scan_finds(
            disks in prop::collection::vec(disk(), 0..200),
            queries in prop::collection::vec(disk(), 1..20),
        ) {
            let mut tree = QuadTree::new(DVec2::ZERO, 1.0);
            let mut scan = LinearScan::default();
            for &(x, y, r) in &disks {
                prop_assert_eq!(tree.insert(DVec2::new(x, y), r), scan.insert(DVec2::new(x, y), r));
            }
            prop_assert_eq!(tree.len(), disks.len());
            for (x, y, r) in queries {
                let p = DVec2::new(x, y);
                prop_assert_eq!(tree.overlaps(p, r), scan.overlaps(p, r));
                prop_assert_eq!(tree.is_free(p, r), scan.is_free(p, r));
            }
        }
    }

    #[test]
    fn many_coincident_discs_are_all_found() {
        let mut tree = QuadTree::new(DVec2::ZERO, 1.0);
        for _ in 0..1000 {
            tree.insert(DVec2::splat(0.3), 0.0);
        }
        assert_eq!(tree.overlaps(DVec2::splat(0.3), 0.1).len(), 1000);
        assert!(tree.is_free(DVec2::splat(0.5), 0.1));
        assert_eq!(tree.get(999), Some((DVec2::splat(0.3), 0.0)));
        assert_eq!(tree.get(1000), None);
    }

    #[test]
    fn touching_is_not_overlapping() {
        let mut tree = QuadTree::new(DVec2::ZERO, 4.0);
        tree.insert(DVec2::new(1.0, 1.0), 0.5);
        assert!(tree.is_free(DVec2::new(2.0, 1.0), 0.5));
        assert!(!tree.is_free(DVec2::new(2.0, 1.0), 0.500_001));
    }
}
