//! The shape of a trail across its run.

use glam::DVec2;
use nemoral_scene::Dual;

use crate::curve::smoothstep;
use crate::path::{Foot, KnotAttributes};
use crate::zone::TrailZone;
use crate::{CrossSection, Ditch, Ruts, WayKind};

/// Trails narrower than this have no wheel ruts, metres.
const RUT_WIDTH_M: f64 = 2.0;

/// The share of the ruts' depth by which the ridge between them is higher than the rest.
const RIDGE: f64 = 0.25;

/// Half of the width that counts as a rut, in standard deviations.
const RUT_EDGE: f64 = 1.25;

/// The least width of ruts, strip and edges that are told apart: the diagonal of a fine cell of the
/// ground's mesh, which might miss narrower parts.
const BAND_M: f64 = 0.36;

impl WayKind {
    /// The ruts, where the trail is wide enough for a vehicle.
    pub(crate) fn ruts(&self) -> Option<Ruts> {
        let wide = self.width_m >= RUT_WIDTH_M;
        self.section.ruts.filter(|r| wide && r.depth_m > 0.0)
    }

    /// Height of the section above the formation at a point, by its foot; constant beyond the
    /// edges, but for the user's curve, which goes on.
    pub(crate) fn profile(&self, foot: &Foot) -> Dual {
        let dual = |value: f64, rate: f64| Dual::new(value, rate * foot.along);
        let KnotAttributes {
            half_width,
            tilt,
            rut,
            wander,
            sink,
            ditches: _,
        } = foot.attributes;
        let rate = foot.attribute_rates;
        let offset = foot.away.dot(foot.left);
        let s = if offset.abs() < half_width {
            Dual::new(offset, foot.left)
        } else {
            dual(half_width, rate.half_width).scale(offset.signum())
        };
        let mut height = dual(tilt, rate.tilt) * s;
        // A parabola from 0 in the middle to -crown · w / 2 at the edges.
        height = height - (s * s).scale(2.0 * self.section.crown / self.width_m);
        if let Some(ruts) = self.ruts() {
            let depth = dual(rut, rate.rut).scale(ruts.depth_m);
            let s = s - dual(wander, rate.wander);
            let bell = |centre: f64, sigma: f64| {
                let x = (s.value - centre) / sigma;
                let value = libm::exp(-0.5 * x * x);
                s.chain((value, -x / sigma * value))
            };
            let half = 0.5 * ruts.gauge_m;
            let shape = bell(0.0, 0.4 * half).scale(RIDGE)
                - bell(half, ruts.sigma_m)
                - bell(-half, ruts.sigma_m);
            height = height + depth * shape;
        }
        if sink != 0.0 || rate.sink != 0.0 {
            height = height - dual(sink, rate.sink);
        }
        let across = Dual::new(offset, foot.left);
        height + across.chain(polyline(&self.section.curve, offset))
    }

    /// Depth of the ditch on a point's side of the trail, by its foot; `None` where there is none.
    pub(crate) fn ditch(&self, foot: &Foot) -> Option<(Ditch, Dual)> {
        let ditch = self.section.ditch?;
        let side = usize::from(foot.away.dot(foot.left) < 0.0);
        let (share, rate) = (
            foot.attributes.ditches[side],
            foot.attribute_rates.ditches[side],
        );
        Some((ditch, Dual::new(share, rate * foot.along)))
    }

    /// The part of a trail that a point is on, by its foot and its signed distances to the edge and
    /// to what bounds its ruts, the edge or another trail.
    pub(crate) fn part(&self, foot: &Foot, edge_m: f64, bound_m: f64) -> Part {
        let edge = Part {
            zone: TrailZone::Surface,
            border_m: -edge_m,
            beyond: TrailZone::Off,
        };
        let Some(ruts) = self.ruts() else {
            return edge;
        };
        let offset = (foot.away.dot(foot.left) - foot.attributes.wander).abs();
        let half = (RUT_EDGE * ruts.sigma_m).max(0.5 * BAND_M);
        let inner = 0.5 * ruts.gauge_m - half;
        // Distances from the ruts, towards the edge and towards the middle.
        let out = (offset - inner - 2.0 * half).max(bound_m + BAND_M);
        let within = if inner < 0.5 * BAND_M {
            f64::NEG_INFINITY
        } else {
            inner - offset
        };
        if out.max(within) <= 0.0 {
            return Part {
                zone: TrailZone::Rut,
                border_m: -out.max(within),
                beyond: if within > out {
                    TrailZone::Strip
                } else {
                    TrailZone::Surface
                },
            };
        }
        let (zone, to_rut) = if within > 0.0 && out <= 0.0 {
            (TrailZone::Strip, within)
        } else {
            (TrailZone::Surface, out.max(within))
        };
        if zone == TrailZone::Surface && edge.border_m < to_rut {
            return edge;
        }
        Part {
            zone,
            border_m: to_rut,
            beyond: TrailZone::Rut,
        }
    }
}

/// A part of a trail's surface.
pub(crate) struct Part {
    pub(crate) zone: TrailZone,
    /// Distance to the nearest border of the part, metres.
    pub(crate) border_m: f64,
    /// The part on the other side of that border.
    pub(crate) beyond: TrailZone,
}

impl CrossSection {
    /// The share of the ditch's depth on the left and the right of a trail on a ground with this
    /// slope to the left: all of it uphill and on level ground, none downhill of slopes of 6 %.
    pub(crate) fn ditches(&self, side_slope: f64) -> [f64; 2] {
        if self.ditch.is_none() {
            return [0.0; 2];
        }
        [side_slope, -side_slope].map(|rise| smoothstep((rise + 0.06) / 0.05))
    }

    /// Depth of the surface below the formation on a run with this grade, metres.
    pub(crate) fn sink_m(&self, grade: f64) -> f64 {
        self.sink_m + self.hollow_m * smoothstep(grade.abs() / 0.2)
    }

    /// Rise per metre to the left on a ground with this slope to the left; it falls downhill, fully
    /// from slopes of 10 % on.
    pub(crate) fn tilt(&self, side_slope: f64) -> f64 {
        self.crossfall * (side_slope / 0.1).clamp(-1.0, 1.0)
    }
}

/// Height and slope of a polyline, constant beyond its ends; 0 for an empty one.
fn polyline(points: &[DVec2], x: f64) -> (f64, f64) {
    let i = points.partition_point(|p| p.x <= x);
    match (i.checked_sub(1).map(|i| points[i]), points.get(i)) {
        (Some(a), Some(b)) => {
            let slope = (b.y - a.y) / (b.x - a.x);
            (a.y + slope * (x - a.x), slope)
        }
        (Some(end), None) => (end.y, 0.0),
        (None, Some(end)) => (end.y, 0.0),
        (None, None) => (0.0, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polylines_are_linear_between_and_constant_beyond() {
        let curve = [DVec2::new(-1.0, 0.1), DVec2::new(1.0, 0.3)];
        assert_eq!(polyline(&curve, -2.0), (0.1, 0.0));
        assert!((polyline(&curve, 0.0).0 - 0.2).abs() < 1e-12);
        assert_eq!(polyline(&curve, 2.0), (0.3, 0.0));
        assert_eq!(polyline(&[], 0.0), (0.0, 0.0));
    }
}
