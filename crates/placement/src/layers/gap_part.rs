//! Layers that are denser in gaps have two patterns, and how uneven a layer's density is.

use super::open_land::EdgeProfile;
use super::params::{LayerParams, PlacementParams};

/// The part of the plane that a pattern is for. A layer that is denser in gaps has a dense pattern
/// for these and another for what is outside of them: one alone would be computed as densely
/// everywhere as it is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GapPart {
    /// All of it.
    Both,
    Inside,
    Outside,
}

impl GapPart {
    /// The parts of a layer. One that is also denser at the edges of woods has a single pattern,
    /// as those may be anywhere.
    pub(crate) fn of(params: &PlacementParams, layer: &LayerParams) -> &'static [Self] {
        let at_edges = layer.at_edges.as_ref().map_or(1.0, EdgeProfile::most);
        let is_split = params.gaps.is_some() && layer.in_gaps > 1.0 && at_edges <= 1.0;
        match is_split && layer.rows.is_none() {
            true => &[Self::Inside, Self::Outside],
            false => &[Self::Both],
        }
    }
}

/// How uneven the density of a part of a layer is, relative to that outside of gaps and inside of
/// clusters.
pub(crate) struct Unevenness {
    /// The mean of the whole layer over woods.
    pub(crate) mean: f64,
    /// The maximum of the part.
    pub(crate) most: f64,
    gap_share: f64,
    /// The means of the part inside of gaps and outside of them.
    inside: f64,
    outside: f64,
}

impl Unevenness {
    pub(crate) fn of(params: &PlacementParams, layer: &LayerParams, part: GapPart) -> Self {
        let gap_share = params.gaps.map_or(0.0, |g| g.share);
        let cluster_share = layer.clusters.map_or(1.0, |c| c.share);
        let in_gaps = params.gaps.map_or(1.0, |_| layer.in_gaps);
        let at_edges = layer.at_edges.as_ref().map_or(1.0, EdgeProfile::most);
        let whole = |inside, outside| Self {
            mean: (1.0 - gap_share + gap_share * in_gaps) * cluster_share,
            most: in_gaps.max(1.0).max(at_edges),
            gap_share,
            inside,
            outside,
        };
        let (inside, outside) = (in_gaps * cluster_share, cluster_share);
        match part {
            GapPart::Both => whole(inside, outside),
            GapPart::Inside => whole(inside, 0.0),
            GapPart::Outside => Self {
                most: 1.0,
                ..whole(0.0, outside)
            },
        }
    }

    /// The mean of the part in a part of the plane.
    pub(crate) fn mean_in(&self, place: GapPart) -> f64 {
        match place {
            GapPart::Both => (1.0 - self.gap_share) * self.outside + self.gap_share * self.inside,
            GapPart::Inside => self.inside,
            GapPart::Outside => self.outside,
        }
    }
}

/// The relative density of a layer in a gap at the edge of a wood: where it is light for both
/// reasons, the greater one counts.
pub(crate) fn together(in_gap: f64, at_edge: f64) -> f64 {
    if in_gap > 1.0 && at_edge > 1.0 {
        in_gap.max(at_edge)
    } else {
        in_gap * at_edge
    }
}
