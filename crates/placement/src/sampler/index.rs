//! Search for disks that overlap a disk.

use std::ops::ControlFlow;

use glam::DVec2;

/// A collection of disks that can be searched for those that overlap another disk.
pub trait NeighbourIndex {
    /// Calls `visit` with the number (in order of insertion) of every stored disk q with
    /// `|p − q| < radius + r_q`, in no particular order, until it breaks.
    fn visit_overlaps(
        &self,
        p: DVec2,
        radius: f64,
        visit: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> ControlFlow<()>;

    /// Whether a disk would overlap none of the stored ones.
    fn is_free(&self, p: DVec2, radius: f64) -> bool {
        self.visit_overlaps(p, radius, &mut |_| ControlFlow::Break(()))
            .is_continue()
    }

    /// The numbers of all stored disks that a disk would overlap, ascending.
    fn overlaps(&self, p: DVec2, radius: f64) -> Vec<usize> {
        let mut found = Vec::new();
        let _ = self.visit_overlaps(p, radius, &mut |i| {
            found.push(i);
            ControlFlow::Continue(())
        });
        found.sort_unstable();
        found
    }
}

/// An index that looks at every disk. It is best for a few disks, and is the oracle of the
/// quadtree.
#[derive(Clone, Debug, Default)]
pub struct LinearScan {
    disks: Vec<(DVec2, f64)>,
}

impl LinearScan {
    /// Stores a disk and returns its number.
    pub fn insert(&mut self, p: DVec2, radius: f64) -> usize {
        self.disks.push((p, radius));
        self.disks.len() - 1
    }
}

impl NeighbourIndex for LinearScan {
    fn visit_overlaps(
        &self,
        p: DVec2,
        radius: f64,
        visit: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        for (i, &(q, r)) in self.disks.iter().enumerate() {
            if overlap(p, radius, q, r) {
                visit(i)?;
            }
        }
        ControlFlow::Continue(())
    }
}

/// The overlap rule. As both indexes use this expression, they agree to the bit.
#[inline]
pub(crate) fn overlap(p: DVec2, radius_p: f64, q: DVec2, radius_q: f64) -> bool {
    let reach = radius_p + radius_q;
    p.distance_squared(q) < reach * reach
}
