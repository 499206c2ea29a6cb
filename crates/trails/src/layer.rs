//! The ways that are one piece of earthwork, near a chunk.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::ChunkCoord;

use crate::dual::Dual;
use crate::index::{Index, Stretch};
use crate::path::Foot;
use crate::profile::smoothstep;
use crate::{Section, TrailPath, Way};

/// Inner corners between the edges of two trails that meet have this radius, metres, or the width
/// of the wider one if that is less.
const FILLET_M: f64 = 1.5;

/// The distance beyond the edge over which the shape of the surface fades, metres.
const SHOULDER_M: f64 = 1.5;

/// The distance from the edge at which the slope above a ditch is where it would be without it,
/// metres.
const DITCH_REACH_M: f64 = 5.0;

/// The distance from edges within which the ground has shapes as small as ruts, metres.
const FINE_M: f64 = 1.0;

/// Slopes start with a round foot of about this size, metres.
const FOOT_M: f64 = 0.3;

/// The corner between a slope and the untouched ground is rounded by this, metres of height.
const ROUND_M: f64 = 0.2;

/// Beyond this distance from its edge a trail does not change the ground, metres.
pub(crate) const REACH_M: f64 = 12.0;

/// Ways of the same levelling, reach and slopes, which join at grade.
pub(crate) struct Layer {
    paths: Vec<Arc<TrailPath>>,
    section: Section,
    width_m: f64,
    has_ditch: bool,
    index: Index,
    /// An index of the knots that are close, which are few of many where trails are dense.
    close: Index,
}

/// A trail's nearest point, and the signed distance to its edge.
pub(crate) struct Strand<'a> {
    pub(crate) path: &'a TrailPath,
    pub(crate) foot: Foot,
    pub(crate) edge: Dual,
}

/// A run of ways that are one piece of earthwork.
#[derive(Debug)]
pub(crate) struct Earthwork {
    /// The numbers of the ways.
    pub(crate) numbers: Range<usize>,
    section: Section,
    width_m: f64,
    has_ditch: bool,
}

/// The pieces of earthwork of a world, and what they have in common.
#[derive(Debug)]
pub(crate) struct Earthworks {
    pub(crate) all: Vec<Earthwork>,
    /// The distance from a chunk within which trails must be known to carve its ground.
    pub(crate) reach_m: f64,
    /// The distance from edges within which the ground has shapes as small as ruts or ditches.
    pub(crate) fine_m: f64,
    /// Whether materials end raggedly, where they change and where kinds of way meet.
    pub(crate) ragged: bool,
}

impl Earthworks {
    /// The earthworks of ways, as far as they are used.
    pub(crate) fn new(ways: &[Arc<Way>], used: &[bool]) -> Self {
        let mut all: Vec<Earthwork> = Vec::new();
        let (mut width_m, mut ditch_m, mut ragged) = (0.0_f64, 0.0_f64, false);
        let ways_in_use = (ways.iter().enumerate()).filter(|(number, _)| used[*number]);
        for (number, way) in ways_in_use {
            let ditch = way.section.ditch;
            match all.last_mut() {
                Some(last) if ways[last.numbers.start].joins(way) => {
                    last.numbers.end = number + 1;
                    last.width_m = last.width_m.max(way.widest_m());
                    last.has_ditch |= ditch.is_some();
                }
                _ => all.push(Earthwork {
                    numbers: number..number + 1,
                    section: way.section.clone(),
                    width_m: way.widest_m(),
                    has_ditch: ditch.is_some(),
                }),
            }
            width_m = width_m.max(way.widest_m());
            ditch_m = ditch_m.max(ditch.map_or(0.0, |d| d.width_m));
            ragged |= way.change > 0.0;
        }
        Self {
            all,
            reach_m: reach_m(width_m),
            fine_m: FINE_M.max(ditch_m + 0.3),
            ragged,
        }
    }
}

/// The distance from its middle within which a way of this width is looked for.
fn reach_m(width_m: f64) -> f64 {
    // There is a knot at every metre, so the nearest one is less than a metre farther than the
    // trail.
    REACH_M + 0.5 * width_m + 1.0
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
        let index = Index::new(&paths, low, high, reach_m(*width_m), near);
        let close = Index::new(&paths, low, high, close_m(*width_m, *has_ditch), near);
        Self {
            paths,
            section: section.clone(),
            width_m: *width_m,
            has_ditch: *has_ditch,
            index,
            close,
        }
    }

    /// The radius of the inner corners between these ways.
    pub(crate) fn fillet_m(&self) -> f64 {
        FILLET_M.min(self.width_m)
    }

    /// The nearest points of all stretches of trails that are close, or that of the nearest
    /// stretch.
    pub(crate) fn strands(&self, p: DVec2) -> Vec<Strand<'_>> {
        let mut strands = Vec::new();
        for &Stretch { path, first, end } in self.close.at(p) {
            let path = &*self.paths[path as usize];
            let close = close_m(path.way().widest_m(), self.has_ditch);
            // Each run of knots that are close is a strand of its own.
            let mut run = (close * close, None);
            for (i, knot) in path.knots()[first as usize..end as usize]
                .iter()
                .enumerate()
            {
                let square = knot.position.distance_squared(p);
                if square < run.0 {
                    run = (square, Some(first as usize + i));
                } else if square >= close * close {
                    strands.extend(run.1.take().map(|i| Strand::new(path, p, i)));
                    run.0 = close * close;
                }
            }
            strands.extend(run.1.map(|i| Strand::new(path, p, i)));
        }
        if strands.is_empty() {
            strands.extend(self.nearest_strand(p));
        }
        strands
    }

    /// The point of all trails within reach whose edge is nearest: of each kind of way, whose
    /// trails are equally wide, that of the nearest trail.
    fn nearest_strand(&self, p: DVec2) -> Option<Strand<'_>> {
        let mut of_kinds: Vec<(usize, f64, &TrailPath, usize)> = Vec::new();
        for &Stretch { path, first, end } in self.index.at(p) {
            let path = &*self.paths[path as usize];
            let number = path.way_number();
            for i in first as usize..end as usize {
                let square = path.knots()[i].position.distance_squared(p);
                match of_kinds.iter_mut().find(|of| of.0 == number) {
                    Some(of) if square >= of.1 => {}
                    Some(of) => *of = (number, square, path, i),
                    None => of_kinds.push((number, square, path, i)),
                }
            }
        }
        let edge_m =
            |of: &(usize, f64, &TrailPath, usize)| libm::sqrt(of.1) - 0.5 * of.2.way().widest_m();
        let nearest = of_kinds
            .into_iter()
            .min_by(|a, b| edge_m(a).total_cmp(&edge_m(b)));
        nearest.map(|(_, _, path, i)| Strand::new(path, p, i))
    }

    /// Height of the formation; `None` beyond reach. Each knot continues its height along its
    /// direction with its grade (Shepard's interpolation, with slopes).
    fn formation(&self, p: DVec2) -> Option<Dual> {
        let reach = self.section.reach_m + 0.5 * self.width_m + 1.0;
        let scale = 1.0 / (reach * reach);
        let (mut total, mut d_total) = (0.0, DVec2::ZERO);
        let (mut sum, mut d_sum) = (0.0, DVec2::ZERO);
        for &Stretch { path, first, end } in self.index.at(p) {
            for knot in &self.paths[path as usize].knots()[first as usize..end as usize] {
                let away = p - knot.position;
                let inside = 1.0 - away.length_squared() * scale;
                if inside <= 0.0 {
                    continue;
                }
                let weight = inside * inside * inside;
                let d_weight = (-6.0 * scale * inside * inside) * away;
                let height = knot.height + knot.grade * knot.tangent.dot(away);
                total += weight;
                d_total += d_weight;
                sum += weight * height;
                d_sum += height * d_weight + (weight * knot.grade) * knot.tangent;
            }
        }
        if total <= 0.0 {
            return None;
        }
        let height = sum / total;
        Some(Dual::new(height, (d_sum - height * d_total) / total))
    }

    /// The section's height above the formation, by all trails that are close.
    fn profile(&self, strands: &[Strand<'_>], edge: Dual) -> Dual {
        if edge.value >= SHOULDER_M {
            return Dual::constant(0.0);
        }
        let mut close = strands.iter().filter(|s| s.edge.value < SHOULDER_M);
        let height = match (close.next(), close.clone().next()) {
            (Some(only), None) => only.path.way().profile(&only.foot),
            (first, _) => {
                let (mut total, mut sum) = (Dual::constant(0.0), Dual::constant(0.0));
                for strand in first.into_iter().chain(close) {
                    let left = SHOULDER_M - strand.edge.value;
                    let weight = strand.edge.chain((left * left * left, -3.0 * left * left));
                    total = total + weight;
                    sum = sum + weight * strand.path.way().profile(&strand.foot);
                }
                // Where no trail is close, the divisor would be 0.
                let inverse = 1.0 / total.value.max(f64::MIN_POSITIVE);
                sum * total.chain((inverse, -inverse * inverse))
            }
        };
        let t = (edge.value / SHOULDER_M).clamp(0.0, 1.0);
        height * edge.chain((1.0 - smoothstep(t), -6.0 * t * (1.0 - t) / SHOULDER_M))
    }

    /// The depth of the ditch, and how far it moves the foot of the slope, at a distance from the
    /// edge; `None` where there is no ditch.
    fn ditch(&self, strands: &[Strand<'_>], edge: Dual) -> Option<(Dual, Dual)> {
        if !self.has_ditch || edge.value >= DITCH_REACH_M {
            return None;
        }
        let zero = Dual::constant(0.0);
        let (mut total, mut depth, mut width) = (zero, zero, zero);
        for strand in strands.iter().filter(|s| s.edge.value < DITCH_REACH_M) {
            let left = DITCH_REACH_M - strand.edge.value;
            let weight = strand.edge.chain((left * left * left, -3.0 * left * left));
            total = total + weight;
            if let Some((ditch, share)) = strand.path.way().ditch(&strand.foot) {
                let x = (edge.value / ditch.width_m).clamp(0.0, 1.0);
                let bell = x * (1.0 - x);
                let d_bell = (1.0 - 2.0 * x) / ditch.width_m;
                let form = edge.chain((16.0 * bell * bell, 32.0 * bell * d_bell));
                depth = depth + weight * share * form.scale(ditch.depth_m);
                width = width + weight * share.scale(ditch.width_m);
            }
        }
        if total.value <= 0.0 {
            return None;
        }
        let inverse = total.chain((1.0 / total.value, -1.0 / (total.value * total.value)));
        let span = DITCH_REACH_M - SHOULDER_M;
        let t = ((edge.value - SHOULDER_M) / span).clamp(0.0, 1.0);
        let near = edge.chain((1.0 - smoothstep(t), -6.0 * t * (1.0 - t) / span));
        Some((depth * inverse, width * inverse * near))
    }

    /// The carved ground; `None` where it is the natural one.
    pub(crate) fn carved(
        &self,
        p: DVec2,
        strands: &[Strand<'_>],
        edge: Dual,
        natural: &dyn Fn() -> Dual,
    ) -> Option<Dual> {
        if edge.value >= self.section.reach_m {
            return None;
        }
        let mut formation = self.formation(p)?;
        let levelling = self.section.levelling;
        if levelling < 1.0 {
            formation = formation.scale(levelling) + natural().scale(1.0 - levelling);
        }
        let surface = formation + self.profile(strands, edge);
        if edge.value <= 0.0 {
            return Some(surface);
        }
        let ground = natural();
        let reach_m = self.section.reach_m;
        let rise = edge.chain(slope(edge.value, reach_m));
        let (cut, fill) = (
            rise.scale(1.0 / self.section.cut_ratio),
            rise.scale(1.0 / self.section.fill_ratio),
        );
        // The rounding is limited, so that the two corners do not meet.
        let gap = cut + fill;
        let whole = gap.value + 2.0 * ROUND_M;
        let k = gap.chain((
            ROUND_M * gap.value / whole,
            2.0 * ROUND_M * ROUND_M / (whole * whole),
        ));
        if k.value <= 0.0 {
            return Some(surface);
        }
        let cut = match self.ditch(strands, edge) {
            None => cut,
            Some((depth, moved)) => {
                let rise = moved_slope(edge, moved, reach_m);
                rise.scale(1.0 / self.section.cut_ratio) - depth
            }
        };
        Some(
            ground
                .smooth_max(surface - fill, k)
                .smooth_min(surface + cut, k),
        )
    }
}

/// The distance within which a knot may belong to a trail that shapes the ground here.
fn close_m(width_m: f64, has_ditch: bool) -> f64 {
    let shaped_m = if has_ditch { DITCH_REACH_M } else { SHOULDER_M };
    0.5 * width_m + shaped_m.max(FILLET_M) + 0.5
}

impl<'a> Strand<'a> {
    fn new(path: &'a TrailPath, p: DVec2, nearest_knot: usize) -> Self {
        let foot = path.foot(p, nearest_knot);
        let edge = Dual::new(
            foot.distance - foot.lane.half_width,
            foot.outward - foot.lane_rate.half_width * foot.along,
        );
        Self { path, foot, edge }
    }
}

/// The trail whose edge is nearest.
pub(crate) fn nearest<'a>(strands: &'a [Strand<'a>]) -> Option<&'a Strand<'a>> {
    strands
        .iter()
        .min_by(|a, b| a.edge.value.total_cmp(&b.edge.value))
}

/// Signed distance to the union of outlines, its inner corners rounded with a radius.
pub(crate) fn union(edges: impl Iterator<Item = Dual> + Clone, fillet_m: f64) -> Option<Dual> {
    let nearest = edges.clone().min_by(|a, b| a.value.total_cmp(&b.value))?;
    let mut close = edges.clone().filter(|e| e.value < fillet_m);
    if close.next().is_none() || close.next().is_none() {
        return Some(nearest);
    }
    // The arc of a circle of the fillet's radius (Quilez' and Mercury's round union).
    let (mut square, mut gradient) = (0.0, DVec2::ZERO);
    for edge in edges.filter(|e| e.value < fillet_m) {
        let depth = fillet_m - edge.value;
        square += depth * depth;
        gradient += depth * edge.gradient;
    }
    let root = libm::sqrt(square);
    Some(Dual::new(fillet_m - root, gradient / root))
}

/// The height of a slope of 1:1 at a distance from the edge, and its derivative: a round foot, then
/// a straight slope, then steeper and steeper without bounds towards the reach.
fn slope(d: f64, reach_m: f64) -> (f64, f64) {
    let (foot, d_foot) = foot(d);
    let (bound, d_bound) = bound(d, reach_m);
    (foot * bound, d_foot * bound + foot * d_bound)
}

/// The height of a slope whose foot is moved away from the edge.
fn moved_slope(edge: Dual, moved: Dual, reach_m: f64) -> Dual {
    let from = edge - moved;
    if from.value <= 0.0 {
        return Dual::constant(0.0);
    }
    from.chain(foot(from.value)) * edge.chain(bound(edge.value, reach_m))
}

/// The round foot of a slope and its straight part.
fn foot(d: f64) -> (f64, f64) {
    let foot = d * d / (d + FOOT_M);
    let d_foot = (d * d + 2.0 * d * FOOT_M) / ((d + FOOT_M) * (d + FOOT_M));
    (foot, d_foot)
}

/// The factor by which a slope gets steeper towards the reach.
fn bound(d: f64, reach_m: f64) -> (f64, f64) {
    let x = d / reach_m;
    let x5 = x * x * x * x * x;
    let bound = 1.0 / (1.0 - x5 * x);
    let d_bound = 6.0 * x5 / reach_m * bound * bound;
    (bound, d_bound)
}
