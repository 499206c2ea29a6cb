//! The ways that are one piece of earthwork, near a chunk.

mod carving;

use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::{ChunkCoord, Dual};

use crate::bends::{Firmness, View};
use crate::earthwork::{Earthwork, REACH_M, reach_m};
use crate::index::{Index, Stretch};
use crate::path::{Foot, Knot};
use crate::{CrossSection, TrailPath};

/// Inner corners between the edges of two trails that meet have this radius, metres, or the width
/// of the wider one if that is less.
const FILLET_M: f64 = 1.5;

/// The distance beyond the edge over which the shape of the surface fades, metres.
const SHOULDER_M: f64 = 1.5;

/// The distance from the edge at which the slope above a ditch is where it would be without it,
/// metres.
const DITCH_REACH_M: f64 = 5.0;

/// A knot is at most this much farther than the point of its trail that is nearest, metres.
const KNOT_M: f64 = 0.8;

/// Ways of the same levelling, reach and slopes, which join at grade.
pub(crate) struct Layer {
    paths: Vec<Arc<TrailPath>>,
    section: CrossSection,
    width_m: f64,
    has_ditch: bool,
    index: Index,
    /// An index of the knots that are close, which are few of many where trails are dense.
    close: Index,
    /// An index of the knots at tight bends, which are few.
    tight: Index,
}

/// A point of a trail that is nearer than those around it, and the signed distance to its edge.
pub(crate) struct Strand<'a> {
    pub(crate) path: &'a TrailPath,
    pub(crate) foot: Foot,
    pub(crate) edge: Dual,
    firmness: Firmness,
    /// Whether the edge may be that at another place of the trail.
    is_folded: bool,
}

/// The trails of a layer around a point.
pub(crate) struct Around<'a> {
    /// The nearest points of trails that are close, one for each passage, and that whose edge is
    /// nearest.
    pub(crate) strands: Vec<Strand<'a>>,
    /// The signed distance to the nearest edge, with sharp corners.
    nearest: Dual,
    /// The signed distance to the edge of all.
    pub(crate) edge: Dual,
}

/// A knot that is nearer than those before and after it.
struct Valley<'a> {
    path: &'a TrailPath,
    knot: usize,
    /// Its distance less half the greatest width, metres.
    edge_m: f64,
}

impl Layer {
    /// `paths`, sorted by id, must be all of this earthwork that come within reach of the square.
    pub(crate) fn new(
        earthwork: &Earthwork,
        paths: Vec<Arc<TrailPath>>,
        (low, high): (DVec2, DVec2),
        near: &dyn Fn(ChunkCoord) -> bool,
    ) -> Self {
        let Earthwork {
            numbers: _,
            section,
            width_m,
            has_ditch,
        } = earthwork;
        let reach = reach_m(*width_m);
        let close = close_m(*width_m, *has_ditch);
        let index = Index::new(&paths, low, high, reach, near, |_, _| true);
        let close = Index::new(&paths, low, high, close, near, |_, _| true);
        let reach = reach + KNOT_M;
        let is_tight = |path: &TrailPath, knot| path.bends().is_tight(knot, reach);
        let tight = Index::new(&paths, low, high, reach, near, is_tight);
        Self {
            paths,
            section: section.clone(),
            width_m: *width_m,
            has_ditch: *has_ditch,
            index,
            close,
            tight,
        }
    }

    /// The radius of the inner corners between these ways.
    pub(crate) fn fillet_m(&self) -> f64 {
        FILLET_M.min(self.width_m)
    }

    /// The trails around a point; `None` where none is near.
    pub(crate) fn around(&self, p: DVec2) -> Option<Around<'_>> {
        let mut strands = self.close_strands(p);
        let sure = |s: &&Strand<'_>| !s.is_folded;
        let mut nearest = nearest(strands.iter().filter(sure)).map(|s| s.edge);
        // Others are not as near as that.
        if nearest.is_none_or(|edge| edge.value >= shaped_m(self.has_ditch))
            && let Some(far) = self.far_strand(p, nearest)
        {
            if !far.is_folded {
                nearest = Some(far.edge);
            }
            if !far.is_folded || strands.is_empty() {
                strands.push(far);
            }
        }
        let nearest = self.folded_edge(p, nearest).or(nearest)?;
        let edge = self.rounded(nearest, &strands);
        Some(Around {
            strands,
            nearest,
            edge,
        })
    }

    /// Signed distance to the union of outlines: the nearest of what each two strands are together.
    fn rounded(&self, nearest: Dual, strands: &[Strand<'_>]) -> Dual {
        let fillet_m = self.fillet_m();
        let close = |s: &&Strand<'_>| s.edge.value < fillet_m;
        let mut best = nearest;
        for (i, a) in strands.iter().enumerate().filter(|(_, s)| close(s)) {
            for b in strands[i + 1..].iter().filter(close) {
                let share = a.firmness.corner * b.firmness.corner;
                let edge = union(a.edge, b.edge, share, fillet_m);
                if edge.value < best.value {
                    best = edge;
                }
            }
        }
        best
    }

    fn close_strands(&self, p: DVec2) -> Vec<Strand<'_>> {
        let mut strands = Vec::new();
        for &Stretch { path, first, end } in self.close.at(p) {
            let path = &*self.paths[path as usize];
            let close = close_m(path.way().widest_m(), self.has_ditch);
            let knots = &path.knots()[first as usize..end as usize];
            valleys(knots, p, |i, square| {
                if square < close * close {
                    strands.push(Strand::new(path, p, first as usize + i));
                }
            });
        }
        strands
    }

    /// Of the trails that are not close, the point whose edge is nearest, if it is nearer.
    fn far_strand(&self, p: DVec2, nearest: Option<Dual>) -> Option<Strand<'_>> {
        let mut all: Vec<Valley<'_>> = Vec::new();
        for &Stretch { path, first, end } in self.index.at(p) {
            let path = &*self.paths[path as usize];
            let width = path.way().widest_m();
            let close = close_m(width, self.has_ditch);
            let knots = &path.knots()[first as usize..end as usize];
            valleys(knots, p, |i, square| {
                if square >= close * close {
                    all.push(Valley {
                        path,
                        knot: first as usize + i,
                        edge_m: libm::sqrt(square) - 0.5 * width,
                    });
                }
            });
        }
        // The edge of the nearest knot bounds what others are worth a look.
        let first = (all.iter()).min_by(|a, b| a.edge_m.total_cmp(&b.edge_m))?;
        let known_m = nearest.map_or(f64::INFINITY, |edge| edge.value);
        if first.edge_m - KNOT_M >= known_m {
            return None;
        }
        let mut best = Strand::new(first.path, p, first.knot);
        for valley in all.iter().filter(|v| !std::ptr::eq(*v, first)) {
            let bound_m = if best.is_folded {
                known_m
            } else {
                known_m.min(best.edge.value)
            };
            if valley.edge_m - KNOT_M <= bound_m {
                let strand = Strand::new(valley.path, p, valley.knot);
                if strand.precedes(&best) {
                    best = strand;
                }
            }
        }
        (best.is_folded || best.edge.value < known_m).then_some(best)
    }

    /// The least distance to an edge in bends whose inside a point is in, if it is less than that
    /// to the `nearest` one.
    fn folded_edge(&self, p: DVec2, nearest: Option<Dual>) -> Option<Dual> {
        let stretches = self.tight.at(p);
        let views = || {
            stretches.iter().flat_map(|stretch| {
                let path = &*self.paths[stretch.path as usize];
                (stretch.first as usize..stretch.end as usize).map(move |i| (path, i))
            })
        };
        let nearest_m = nearest.map_or(REACH_M, |edge| edge.value.min(REACH_M));
        // Each knot is a place of its trail, so that its edge bounds the least one.
        let mut bound_m = views().fold(nearest_m, |least, (path, i)| {
            least.min(View::edge_at_knot_m(path.knots(), i, p))
        });
        let mut best: Option<Dual> = None;
        for (path, i) in views() {
            let (knots, bends) = (path.knots(), path.bends());
            if bends.least_edge_m(knots, i, p) <= bound_m && bends.is_folded(knots, i, p) {
                let edge = View::new(knots, i, p).edge();
                bound_m = bound_m.min(edge.value);
                if edge.value < best.map_or(nearest_m, |best| best.value) {
                    best = Some(edge);
                }
            }
        }
        best
    }
}

/// The distance within which a knot may belong to a trail that shapes the ground here.
fn close_m(width_m: f64, has_ditch: bool) -> f64 {
    0.5 * width_m + shaped_m(has_ditch).max(FILLET_M) + 0.5
}

/// The distance from its edge within which a trail shapes the ground in more ways than by that
/// distance.
fn shaped_m(has_ditch: bool) -> f64 {
    if has_ditch { DITCH_REACH_M } else { SHOULDER_M }
}

/// Hands over the knots that are nearer than those before and after them, and the squares of their
/// distances.
#[inline]
fn valleys(knots: &[Knot], p: DVec2, mut found: impl FnMut(usize, f64)) {
    let (mut last, mut falls) = (f64::INFINITY, true);
    for (i, knot) in knots.iter().enumerate() {
        let square = knot.position.distance_squared(p);
        if square < last {
            falls = true;
        } else if falls {
            found(i - 1, last);
            falls = false;
        }
        last = square;
    }
    if falls && !knots.is_empty() {
        found(knots.len() - 1, last);
    }
}

impl<'a> Strand<'a> {
    fn new(path: &'a TrailPath, p: DVec2, nearest_knot: usize) -> Self {
        let foot = path.foot(p, nearest_knot);
        let edge = Dual::new(
            foot.distance - foot.attributes.half_width,
            foot.outward - foot.attribute_rates.half_width * foot.along,
        );
        let bends = path.bends();
        let mut firmness = bends.firmness(&foot, path.knots());
        if let Some(share) = path.corner(&foot) {
            firmness.corner = firmness.corner * share;
        }
        Self {
            path,
            edge,
            firmness,
            is_folded: bends.is_folded(path.knots(), foot.interval, p),
            foot,
        }
    }

    /// Whether its foot is known.
    fn is_firm(&self) -> bool {
        self.firmness.shape.value >= 1.0
    }

    /// Whether its edge is nearer, and sure; of two that are equally near, the one that is listed
    /// before.
    fn precedes(&self, other: &Self) -> bool {
        let place = |s: &Self| (s.path.id(), s.foot.interval);
        let order = self.is_folded.cmp(&other.is_folded);
        let order = order.then_with(|| self.edge.value.total_cmp(&other.edge.value));
        order.then_with(|| place(self).cmp(&place(other))).is_lt()
    }
}

/// The trail whose edge is nearest.
pub(crate) fn nearest<'a, 's>(
    strands: impl Iterator<Item = &'s Strand<'a>>,
) -> Option<&'s Strand<'a>>
where
    'a: 's,
{
    strands.min_by(|a, b| a.edge.value.total_cmp(&b.edge.value))
}

/// Signed distance to the union of two outlines, a share of its inner corners rounded with a
/// radius.
pub(crate) fn union(a: Dual, b: Dual, share: Dual, fillet_m: f64) -> Dual {
    let (near, far) = if b.value < a.value { (b, a) } else { (a, b) };
    if far.value >= fillet_m || share.value <= 0.0 {
        return near;
    }
    // The arc of a circle of the fillet's radius (Quilez' and Mercury's round union).
    let [near_depth, far_depth] = [near, far].map(|edge| fillet_m - edge.value);
    let part = share.value * far_depth;
    let root = libm::sqrt(near_depth * near_depth + part * far_depth);
    let gradient = near_depth * near.gradient + part * far.gradient
        - (0.5 * far_depth * far_depth) * share.gradient;
    Dual::new(fillet_m - root, gradient / root)
}
