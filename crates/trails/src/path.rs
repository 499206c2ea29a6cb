//! The run of one trail.

mod lay;

use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::{ChunkCoord, Dual};

use crate::bends::Bends;
use crate::curve::{Cubic, smoothstep, stiffness};
use crate::dressing::{DressingKind, TrailDressing};
use crate::layout::Course;
use crate::surface_kinds::SurfaceKinds;
use crate::trail_id::TrailId;
use crate::value_noise::ValueNoise1d;
use crate::{TrailSurfaceKind, WayKind};

/// Approximate distance between knots, metres.
pub(crate) const STEP_M: f64 = 1.0;

/// The distance from an end at which another trail goes on within which corners are rounded less,
/// metres.
const JOINT_M: f64 = 3.0;

/// The run of one trail: a smooth curve by arc length, with the properties that vary along it.
///
/// Its tangent is continuous everywhere. Arc lengths are within 0.1 % of true ones.
#[derive(Debug)]
pub struct TrailPath {
    id: TrailId,
    way: Arc<WayKind>,
    /// The number of the way among the parameters' ways.
    number: usize,
    /// At least two knots.
    knots: Vec<Knot>,
    bends: Bends,
    /// Chunks in order, each with the number of its first knot.
    transits: Vec<(ChunkCoord, usize)>,
    /// Whether it fades at its start and at its end.
    free: [bool; 2],
    kinds: SurfaceKinds,
    /// By which grass and stones vary along a way that changes.
    growth: Option<[ValueNoise1d; 2]>,
    stones: Vec<TrailDressing>,
}

/// A point of a trail, with the trail's properties there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Knot {
    pub(crate) position: DVec2,
    pub(crate) tangent: DVec2,
    /// Arc length from the trail's start, metres.
    pub(crate) arc: f64,
    /// Formation: height of the middle, and its slope along the trail.
    pub(crate) height: f64,
    pub(crate) grade: f64,
    pub(crate) attributes: KnotAttributes,
}

/// Properties that are interpolated linearly between knots.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KnotAttributes {
    /// Half the width, metres.
    pub(crate) half_width: f64,
    /// Rise per metre to the left.
    pub(crate) tilt: f64,
    /// Rut depth relative to the mean.
    pub(crate) rut: f64,
    /// Offset of the ruts' middle to the left, metres.
    pub(crate) wander: f64,
    /// Depth of the surface below the formation, metres.
    pub(crate) sink: f64,
    /// The share of their depth that the ditches on the left and the right have.
    pub(crate) ditches: [f64; 2],
}

impl KnotAttributes {
    const COUNT: usize = 7;

    pub(crate) fn to_array(self) -> [f64; Self::COUNT] {
        let [left, right] = self.ditches;
        let Self {
            half_width,
            tilt,
            rut,
            wander,
            sink,
            ..
        } = self;
        [half_width, tilt, rut, wander, sink, left, right]
    }

    pub(crate) fn from_array(values: [f64; Self::COUNT]) -> Self {
        let [half_width, tilt, rut, wander, sink, left, right] = values;
        Self {
            half_width,
            tilt,
            rut,
            wander,
            sink,
            ditches: [left, right],
        }
    }
}

/// The point of a trail's middle that is nearest to some point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Foot {
    /// Arc length, metres.
    pub(crate) arc: f64,
    /// The vector from the foot to the point.
    pub(crate) away: DVec2,
    pub(crate) distance: f64,
    /// Gradient of the distance.
    pub(crate) outward: DVec2,
    /// Unit normal of the trail, to the left.
    pub(crate) left: DVec2,
    /// Gradient of the arc length; zero beyond the trail's ends.
    pub(crate) along: DVec2,
    pub(crate) attributes: KnotAttributes,
    /// Derivative of `attributes` by arc length.
    pub(crate) attribute_rates: KnotAttributes,
    /// The number of the knot before it.
    pub(crate) interval: usize,
}

impl TrailPath {
    /// Its course, to lay it again with other ends.
    pub(crate) fn course(&self, free: [bool; 2]) -> Course {
        let points = self.knots.iter().map(|k| (k.position, k.tangent, k.arc));
        Course {
            id: self.id,
            points: points.collect(),
            transits: self.transits.clone(),
            free,
        }
    }

    /// Whether it fades at its start and at its end.
    pub(crate) fn free(&self) -> [bool; 2] {
        self.free
    }

    /// The identity of the trail.
    #[must_use]
    pub fn id(&self) -> TrailId {
        self.id
    }

    /// The kind of way that the trail is.
    #[must_use]
    pub fn way(&self) -> &WayKind {
        &self.way
    }

    /// The number of its kind among the parameters' ways.
    #[must_use]
    pub fn way_number(&self) -> usize {
        self.number
    }

    /// Length along the middle, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.knots[self.knots.len() - 1].arc
    }

    /// World position of the middle at arc length `s_m` (clamped to the trail).
    #[must_use]
    pub fn position_m(&self, s_m: f64) -> DVec2 {
        let (i, t) = self.locate(s_m);
        self.cubic(i).at(t)[0]
    }

    /// Unit direction of travel at arc length `s_m` (clamped to the trail).
    #[must_use]
    pub fn tangent(&self, s_m: f64) -> DVec2 {
        let (i, t) = self.locate(s_m);
        let d = self.cubic(i).at(t)[1];
        d / d.length().max(f64::MIN_POSITIVE)
    }

    /// Curvature at arc length `s_m` (clamped to the trail), 1/m, positive to the left.
    #[must_use]
    pub fn curvature(&self, s_m: f64) -> f64 {
        let (i, t) = self.locate(s_m);
        let [_, d1, d2] = self.cubic(i).at(t);
        let speed = d1.length().max(f64::MIN_POSITIVE);
        d1.perp_dot(d2) / (speed * speed * speed)
    }

    /// Width of the surface at arc length `s_m` (clamped to the trail), metres.
    #[must_use]
    pub fn width_m(&self, s_m: f64) -> f64 {
        let (i, t) = self.locate(s_m);
        2.0 * self.attributes(i, t).0.half_width
    }

    /// The material at arc length `s_m` (clamped to the trail).
    #[must_use]
    pub fn kind(&self, s_m: f64) -> TrailSurfaceKind {
        self.kinds.at(s_m)
    }

    /// The share of their depth that the ditches on the left and the right have at an arc length.
    pub(crate) fn ditches(&self, s_m: f64) -> [f64; 2] {
        let (i, t) = self.locate(s_m);
        self.attributes(i, t).0.ditches
    }

    /// How far left of the middle the ruts' middle is at an arc length, metres.
    pub(crate) fn wander_m(&self, s_m: f64) -> f64 {
        let (i, t) = self.locate(s_m);
        self.attributes(i, t).0.wander
    }

    /// Whether a tuft, stone or root with this draw in 0..1 is there at an arc length: on a way
    /// that changes, half of them are, in patches.
    pub(crate) fn has(&self, dressing: DressingKind, s_m: f64, draw: f64) -> bool {
        self.growth.as_ref().is_none_or(|growth| {
            let noise = growth[usize::from(dressing != DressingKind::Grass)].at(s_m);
            draw < 0.5 + 1.5 * self.way.change * noise
        })
    }

    /// The chunks that the trail goes through, in order; a chunk occurs as often as it is entered.
    pub fn chunks(&self) -> impl Iterator<Item = ChunkCoord> + '_ {
        self.transits.iter().map(|t| t.0)
    }

    /// Adds the stones that lie on the trail.
    pub(crate) fn with_stones(mut self, stones: Vec<TrailDressing>) -> Self {
        self.stones = stones;
        self
    }

    pub(crate) fn stones(&self) -> &[TrailDressing] {
        &self.stones
    }

    pub(crate) fn knots(&self) -> &[Knot] {
        &self.knots
    }

    /// Each transit's number, chunk and range of knots. The knot on the border between two transits
    /// belongs to the later one, the very last knot to the last one. Where a trail along a given
    /// line touches a chunk between two knots, the range is empty and begins with the second one.
    pub(crate) fn transits(
        &self,
    ) -> impl Iterator<Item = (usize, ChunkCoord, std::ops::Range<usize>)> + '_ {
        (0..self.transits.len()).map(|i| {
            let (chunk, first) = self.transits[i];
            let end = self.transits.get(i + 1).map_or(self.knots.len(), |t| t.1);
            (i, chunk, first..end)
        })
    }

    /// The foot of a point, given the nearest knot in some stretch of the trail.
    pub(crate) fn foot(&self, p: DVec2, nearest_knot: usize) -> Foot {
        let knot = &self.knots[nearest_knot];
        let ahead = (p - knot.position).dot(knot.tangent) > 0.0;
        let last = self.knots.len() - 1;
        let (i, t, end) = match (ahead, nearest_knot) {
            (false, 0) => (0, 0.0, true),
            (true, n) if n == last => (n - 1, 1.0, true),
            (true, n) => (n, self.cubic(n).nearest(p), false),
            (false, n) => (n - 1, self.cubic(n - 1).nearest(p), false),
        };
        let [q, d1, d2] = self.cubic(i).at(t);
        let step = self.step(i);
        let away = p - q;
        let distance = away.length();
        let left = d1.perp() / d1.length().max(f64::MIN_POSITIVE);
        let along = if end {
            DVec2::ZERO
        } else {
            d1 * (step / stiffness(away, d1, d2))
        };
        let outward = if end && distance > 0.0 {
            away / distance
        } else {
            left * away.dot(left).signum()
        };
        let (attributes, attribute_rates) = self.attributes(i, t);
        Foot {
            arc: self.knots[i].arc + t * step,
            away,
            distance,
            outward,
            left,
            along,
            attributes,
            attribute_rates,
            interval: i,
        }
    }

    /// The share of the rounding of corners with other trails, which is less than 1 near an end at
    /// which another one goes on, as there is no corner; `None` for all of it.
    pub(crate) fn corner(&self, foot: &Foot) -> Option<Dual> {
        let ends = [(foot.arc, 1.0), (self.length_m() - foot.arc, -1.0)];
        let joints = ends.into_iter().zip(self.free).filter(|(_, free)| !free);
        let nearest = joints.min_by(|(a, _), (b, _)| a.0.total_cmp(&b.0));
        let ((away_m, sign), _) = nearest.filter(|((away_m, _), _)| *away_m < JOINT_M)?;
        let t = (away_m / JOINT_M).clamp(0.0, 1.0);
        let rate = sign * 6.0 * t * (1.0 - t) / JOINT_M;
        Some(Dual::new(smoothstep(t), rate * foot.along))
    }

    pub(crate) fn bends(&self) -> &Bends {
        &self.bends
    }

    /// The interval of knots that holds an arc length, and the share of it.
    fn locate(&self, s_m: f64) -> (usize, f64) {
        let s = s_m.clamp(0.0, self.length_m());
        let i = self.knots.partition_point(|k| k.arc <= s).saturating_sub(1);
        let i = i.min(self.knots.len() - 2);
        (i, (s - self.knots[i].arc) / self.step(i))
    }

    fn step(&self, i: usize) -> f64 {
        self.knots[i + 1].arc - self.knots[i].arc
    }

    fn cubic(&self, i: usize) -> Cubic {
        cubic(&self.knots[i], &self.knots[i + 1])
    }

    fn attributes(&self, i: usize, t: f64) -> (KnotAttributes, KnotAttributes) {
        let (a, b) = (
            self.knots[i].attributes.to_array(),
            self.knots[i + 1].attributes.to_array(),
        );
        let step = self.step(i);
        let mix = std::array::from_fn(|k| a[k] + t * (b[k] - a[k]));
        let rate = std::array::from_fn(|k| (b[k] - a[k]) / step);
        (
            KnotAttributes::from_array(mix),
            KnotAttributes::from_array(rate),
        )
    }
}

/// The curve between two knots.
pub(crate) fn cubic(a: &Knot, b: &Knot) -> Cubic {
    let step = b.arc - a.arc;
    Cubic {
        ends: [a.position, b.position],
        slopes: [a.tangent * step, b.tangent * step],
    }
}
