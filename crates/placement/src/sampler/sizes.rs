//! The sizes of disks: their varieties, radii and hard cores.

use nemoral_seed::Rng;

use crate::variety::DiskKind;

/// The distribution of disk sizes; lengths are in tile edges.
#[derive(Clone, Debug)]
pub(crate) struct DiskSizes {
    /// For each variety, the running sum of the weights, normalised to end at 1.
    cumulative: Vec<f64>,
    /// The varieties with a positive weight, small ones first, each with the share of all smaller
    /// ones and its own share.
    by_size: Vec<(usize, f64, f64)>,
    /// For each variety, the least radius of the hard core.
    core: Vec<f64>,
    /// For each variety, the range of the occupancy radius.
    radius: Vec<(f64, f64)>,
    /// The distance rule's factor on occupancy radii.
    factor: f64,
    pub(super) mean_core: f64,
    pub(super) max_core: f64,
}

impl DiskSizes {
    /// Sizes of varieties whose radii are in metres. `core[i]` is a lower bound in tile edges: the
    /// hard core of a disk is that or `factor` times its occupancy radius, whichever is larger.
    pub(crate) fn new(varieties: &[DiskKind], core: Vec<f64>, tile_m: f64, factor: f64) -> Self {
        let total: f64 = varieties.iter().map(|v| v.weight).sum();
        let mut sum = 0.0;
        let cumulative = varieties.iter().map(|v| {
            sum += v.weight / total;
            sum
        });
        let cumulative: Vec<f64> = cumulative.collect();
        let radius: Vec<_> = varieties
            .iter()
            .map(|v| (v.radius_m.0 / tile_m, v.radius_m.1 / tile_m))
            .collect();
        let mut sizes = Self {
            cumulative,
            by_size: by_size(varieties, total),
            core,
            radius,
            factor,
            mean_core: 0.0,
            max_core: 0.0,
        };
        for (i, v) in varieties.iter().enumerate().filter(|(_, v)| v.weight > 0.0) {
            sizes.mean_core += v.weight / total * sizes.typical_core(i);
            let largest = sizes.core[i].max(factor * sizes.radius[i].1);
            sizes.max_core = sizes.max_core.max(largest);
        }
        sizes
    }

    /// The hard core of a variety's typical member.
    pub(crate) fn typical_core(&self, variety: usize) -> f64 {
        let (low, high) = self.radius[variety];
        self.core[variety].max(self.factor * (low + high) / 2.0)
    }

    pub(crate) fn mean_core(&self) -> f64 {
        self.mean_core
    }

    /// Draws the variety of a dart, its occupancy radius and its hard core.
    pub(crate) fn draw(&self, rng: &mut impl Rng) -> (u16, f64, f64) {
        let u = unit(rng);
        let last = self.cumulative.len() - 1;
        let variety = self.cumulative.partition_point(|c| *c <= u).min(last);
        self.member(variety, unit(rng))
    }

    /// The variety, radius and core of the disk that a share `quantile` (0..1) of all disks is
    /// smaller than; distributed as by [`draw`](Self::draw) if the quantile is uniform.
    pub(crate) fn of_quantile(&self, quantile: f64) -> (u16, f64, f64) {
        let above = self.by_size.partition_point(|(_, low, _)| *low <= quantile);
        let (variety, low, share) = self.by_size[above.saturating_sub(1)];
        self.member(variety, ((quantile - low) / share).clamp(0.0, 1.0))
    }

    /// A member of a variety, `within` (0..1) the range of its radius.
    fn member(&self, variety: usize, within: f64) -> (u16, f64, f64) {
        let (low, high) = self.radius[variety];
        let radius = low + (high - low) * within;
        let core = self.core[variety].max(self.factor * radius);
        (variety as u16, radius, core)
    }
}

fn by_size(varieties: &[DiskKind], total: f64) -> Vec<(usize, f64, f64)> {
    let weighted = varieties.iter().enumerate().filter(|(_, v)| v.weight > 0.0);
    let mut order: Vec<(usize, &DiskKind)> = weighted.collect();
    // The sort is stable, so that varieties of equal size keep their order.
    order.sort_by(|(_, a), (_, b)| {
        let middle = |v: &DiskKind| v.radius_m.0 + v.radius_m.1;
        middle(a).total_cmp(&middle(b))
    });
    let mut below = 0.0;
    let with_shares = order.into_iter().map(|(i, v)| {
        let share = v.weight / total;
        below += share;
        (i, below - share, share)
    });
    with_shares.collect()
}

/// A uniform number in `[0, 1)` of 32 bits. Positions keep no more bits, and there are many darts.
#[inline]
pub(super) fn unit(rng: &mut impl Rng) -> f64 {
    f64::from(rng.next_u32()) * (1.0 / 4_294_967_296.0)
}
