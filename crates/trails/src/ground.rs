//! The ground with its trails carved in.

use std::fmt;
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface, SurfaceSample};

use crate::dual::Dual;
use crate::index::{Index, Stretch};
use crate::path::Foot;
use crate::profile::smoothstep;
use crate::section::Part;
use crate::zone::TrailZone;
use crate::{TrailParams, TrailPath, TrailSurfaceKind};

/// Inner corners between the edges of two trails that meet have this radius, metres.
const FILLET_M: f64 = 1.5;

/// The distance beyond the edge over which the shape of the surface fades, metres.
const SHOULDER_M: f64 = 1.5;

/// Slopes start with a round foot of about this size, metres.
const FOOT_M: f64 = 0.3;

/// The corner between a slope and the untouched ground is rounded by this, metres of height.
const ROUND_M: f64 = 0.2;

/// Beyond this distance from its edge a trail does not change the ground, metres.
const REACH_M: f64 = 12.0;

/// The least change of the ground that counts as a slope, metres.
const TOUCH_M: f64 = 0.02;

/// The ground near a chunk with its trails carved in.
///
/// With t the height of the ground, d the distance to the edge of a trail, f the formation (the
/// smoothed, grade-limited ground along the trails' middles) and p the section's height above it:
///
/// z = min(max(t, f + p − F(d)), f + p + C(d)), with rounded corners,
///
/// where F and C rise with the fill and the cut ratio, and without bounds towards 12 m, so that a
/// trail's influence ends there on any ground. Where trails meet, f is the mean of their formations
/// weighted smoothly by distance, and their outlines join with rounded inner corners, so there are
/// no steps. Every value depends only on the world position and on the trails within reach, so that
/// grounds made for neighbouring chunks agree to the bit.
pub struct TrailGround {
    params: Arc<TrailParams>,
    base: Arc<dyn Surface>,
    paths: Vec<Arc<TrailPath>>,
    index: Index,
    /// An index of the knots that are close, which are few of many where trails are dense.
    close: Index,
}

impl fmt::Debug for TrailGround {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TrailGround")
            .field("paths", &self.paths.len())
            .finish_non_exhaustive()
    }
}

/// A trail's nearest point, and the signed distance to its edge.
struct Strand<'a> {
    path: &'a TrailPath,
    foot: Foot,
    edge: Dual,
}

/// The distance within which a knot may belong to a trail that shapes the ground here.
fn close_m(params: &TrailParams) -> f64 {
    0.5 * params.width_m + SHOULDER_M.max(FILLET_M) + 0.5
}

/// The distance from a chunk within which trails must be known to carve its ground.
pub(crate) fn reach_m(params: &TrailParams) -> f64 {
    // There is a knot at every metre, so the nearest one is less than a metre farther than the
    // trail.
    REACH_M + 0.5 * params.width_m + 1.0
}

impl TrailGround {
    /// `paths`, sorted by id, must be all that come within [`reach_m`] of the square.
    pub(crate) fn new(
        params: Arc<TrailParams>,
        base: Arc<dyn Surface>,
        paths: Vec<Arc<TrailPath>>,
        (low, high): (DVec2, DVec2),
        near: &dyn Fn(ChunkCoord) -> bool,
    ) -> Self {
        let index = Index::new(&paths, low, high, reach_m(&params), near);
        let close = Index::new(&paths, low, high, close_m(&params), near);
        Self {
            params,
            base,
            paths,
            index,
            close,
        }
    }

    /// Signed distance to the edge of the union of trail surfaces, metres: negative on a trail,
    /// `f64::INFINITY` farther than 12 m from all.
    #[must_use]
    pub fn edge_m(&self, world_m: DVec2) -> f64 {
        match union(&self.strands(world_m)) {
            Some(edge) if edge.value < REACH_M => edge.value,
            _ => f64::INFINITY,
        }
    }

    /// The part of a trail at this position; where trails meet, that of the nearest one.
    #[must_use]
    pub fn zone(&self, world_m: DVec2) -> TrailZone {
        self.beside(world_m, self.part(world_m).map(|p| p.zone))
    }

    /// Signed distance to the nearest border between parts of trails, slopes counting as untouched
    /// ground, metres: negative on surface and strip, positive in ruts and off the trails,
    /// `f64::INFINITY` farther than 12 m from all. Parts that touch differ in sign, so a mesh that
    /// is cut along its zeros follows every border.
    #[must_use]
    pub fn border_m(&self, world_m: DVec2) -> f64 {
        match self.part(world_m) {
            Some(p) if is_negative(p.zone) => -p.border_m,
            Some(p) if p.border_m < REACH_M => p.border_m,
            _ => f64::INFINITY,
        }
    }

    /// [`zone`](Self::zone) for a piece of a mesh that is cut along the borders: the nearest part
    /// on its side of them, whatever the rounding of its middle.
    #[must_use]
    pub fn zone_on_side(&self, world_m: DVec2, negative: bool) -> TrailZone {
        let zone = self.part(world_m).map(|p| {
            if is_negative(p.zone) == negative {
                p.zone
            } else {
                p.beyond
            }
        });
        self.beside(world_m, zone)
    }

    fn part(&self, world_m: DVec2) -> Option<Part> {
        let strands = self.strands(world_m);
        let edge = union(&strands)?.value;
        if edge < 0.0 {
            return nearest(&strands).map(|s| self.params.part(&s.foot, edge));
        }
        Some(Part {
            zone: TrailZone::Off,
            border_m: edge,
            beyond: TrailZone::Surface,
        })
    }

    /// Distinguishes slopes from untouched ground beside the surfaces of trails.
    fn beside(&self, world_m: DVec2, zone: Option<TrailZone>) -> TrailZone {
        match zone {
            Some(TrailZone::Off) => {
                let touched = self.height_m(world_m) - self.base.height_m(world_m);
                if touched.abs() > TOUCH_M {
                    TrailZone::CutSlope
                } else {
                    TrailZone::Off
                }
            }
            Some(zone) => zone,
            None => TrailZone::Off,
        }
    }

    /// The material of the trail here; `None` farther than 5 cm outside.
    #[must_use]
    pub fn kind(&self, world_m: DVec2) -> Option<TrailSurfaceKind> {
        let strands = self.strands(world_m);
        union(&strands).filter(|e| e.value <= 0.05)?;
        nearest(&strands).map(|s| s.path.kind(s.foot.arc))
    }

    /// Signed offset from the middle of the nearest trail, metres, positive to the left of its
    /// direction; `None` farther than 12 m from all edges.
    #[must_use]
    pub fn offset_m(&self, world_m: DVec2) -> Option<f64> {
        let strands = self.strands(world_m);
        let strand = nearest(&strands).filter(|s| s.edge.value < REACH_M)?;
        let side = strand.foot.away.dot(strand.foot.left);
        Some(strand.foot.distance.copysign(side))
    }

    /// The nearest points of all stretches of trails that are close, or that of the nearest
    /// stretch.
    fn strands(&self, p: DVec2) -> Vec<Strand<'_>> {
        let mut strands = Vec::new();
        let close = close_m(&self.params);
        for &Stretch { path, first, end } in self.close.at(p) {
            let path = &*self.paths[path as usize];
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

    /// The nearest point of all trails within reach.
    fn nearest_strand(&self, p: DVec2) -> Option<Strand<'_>> {
        let mut nearest = (f64::INFINITY, None);
        for &Stretch { path, first, end } in self.index.at(p) {
            let path = &*self.paths[path as usize];
            for i in first as usize..end as usize {
                let square = path.knots()[i].position.distance_squared(p);
                if square < nearest.0 {
                    nearest = (square, Some((path, i)));
                }
            }
        }
        nearest.1.map(|(path, i)| Strand::new(path, p, i))
    }

    /// Height of the formation; `None` beyond reach. Each knot continues its height along its
    /// direction with its grade (Shepard's interpolation, with slopes).
    fn formation(&self, p: DVec2) -> Option<Dual> {
        let reach = reach_m(&self.params);
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
            (Some(only), None) => self.params.profile(&only.foot),
            (first, _) => {
                let (mut total, mut sum) = (Dual::constant(0.0), Dual::constant(0.0));
                for strand in first.into_iter().chain(close) {
                    let left = SHOULDER_M - strand.edge.value;
                    let weight = strand.edge.chain((left * left * left, -3.0 * left * left));
                    total = total + weight;
                    sum = sum + weight * self.params.profile(&strand.foot);
                }
                // Where no trail is close, the divisor would be 0.
                let inverse = 1.0 / total.value.max(f64::MIN_POSITIVE);
                sum * total.chain((inverse, -inverse * inverse))
            }
        };
        let t = (edge.value / SHOULDER_M).clamp(0.0, 1.0);
        height * edge.chain((1.0 - smoothstep(t), -6.0 * t * (1.0 - t) / SHOULDER_M))
    }

    /// The carved ground; `None` where it is the base.
    fn carved(&self, p: DVec2) -> Option<Dual> {
        let strands = self.strands(p);
        let edge = union(&strands).filter(|e| e.value < REACH_M)?;
        let surface = self.formation(p)? + self.profile(&strands, edge);
        if edge.value <= 0.0 {
            return Some(surface);
        }
        let base = self.base.sample(p);
        let ground = Dual::new(base.height_m, base.gradient);
        let rise = edge.chain(slope(edge.value));
        let (cut, fill) = (
            rise.scale(1.0 / self.params.section.cut_ratio),
            rise.scale(1.0 / self.params.section.fill_ratio),
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
        Some(
            ground
                .smooth_max(surface - fill, k)
                .smooth_min(surface + cut, k),
        )
    }
}

impl Surface for TrailGround {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        match self.carved(world_m) {
            Some(z) => SurfaceSample {
                height_m: z.value,
                gradient: z.gradient,
            },
            None => self.base.sample(world_m),
        }
    }
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

/// The side of [`TrailGround::border_m`] that a part is on.
fn is_negative(zone: TrailZone) -> bool {
    matches!(zone, TrailZone::Surface | TrailZone::Strip)
}

fn nearest<'a>(strands: &'a [Strand<'a>]) -> Option<&'a Strand<'a>> {
    strands
        .iter()
        .min_by(|a, b| a.edge.value.total_cmp(&b.edge.value))
}

/// Signed distance to the union of the trails, its inner corners rounded.
fn union(strands: &[Strand<'_>]) -> Option<Dual> {
    let nearest = nearest(strands)?.edge;
    let mut close = strands.iter().filter(|s| s.edge.value < FILLET_M);
    if close.next().is_none() || close.next().is_none() {
        return Some(nearest);
    }
    // The arc of a circle of the fillet's radius (Quilez' and Mercury's round union).
    let (mut square, mut gradient) = (0.0, DVec2::ZERO);
    for strand in strands.iter().filter(|s| s.edge.value < FILLET_M) {
        let depth = FILLET_M - strand.edge.value;
        square += depth * depth;
        gradient += depth * strand.edge.gradient;
    }
    let root = libm::sqrt(square);
    Some(Dual::new(FILLET_M - root, gradient / root))
}

/// The height of a slope of 1:1 at a distance from the edge, and its derivative: a round foot, then
/// a straight slope, then steeper and steeper without bounds towards the reach.
fn slope(d: f64) -> (f64, f64) {
    let foot = d * d / (d + FOOT_M);
    let d_foot = (d * d + 2.0 * d * FOOT_M) / ((d + FOOT_M) * (d + FOOT_M));
    let x = d / REACH_M;
    let x5 = x * x * x * x * x;
    let bound = 1.0 / (1.0 - x5 * x);
    let d_bound = 6.0 * x5 / REACH_M * bound * bound;
    (foot * bound, d_foot * bound + foot * d_bound)
}
