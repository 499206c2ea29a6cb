//! How the ways of a layer carve the ground: formation, section, ditches and slopes.

use glam::DVec2;
use nemoral_scene::Dual;

use super::{Around, DITCH_REACH_M, Layer, SHOULDER_M, Strand};
use crate::curve::smoothstep;
use crate::index::Stretch;

/// Slopes start with a round foot of about this size, metres.
const FOOT_M: f64 = 0.3;

/// The corner between a slope and the untouched ground is rounded by this, metres of height.
const ROUND_M: f64 = 0.2;

impl Layer {
    /// The carved ground; `None` where it is the natural one.
    pub(crate) fn carved(
        &self,
        p: DVec2,
        around: &Around<'_>,
        natural: &dyn Fn() -> Dual,
    ) -> Option<Dual> {
        let edge = around.edge;
        if edge.value >= self.section.reach_m {
            return None;
        }
        let mut formation = self.formation(p)?;
        let levelling = self.section.levelling;
        if levelling < 1.0 {
            formation = formation.scale(levelling) + natural().scale(1.0 - levelling);
        }
        let surface = formation + self.profile(around);
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
        let cut = match self.ditch(around) {
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
    fn profile(&self, around: &Around<'_>) -> Dual {
        let edge = around.edge;
        if edge.value >= SHOULDER_M {
            return Dual::constant(0.0);
        }
        let mut close = (around.strands.iter()).filter(|s| s.edge.value < SHOULDER_M);
        let height = match (close.next(), close.clone().next()) {
            (Some(only), None) if only.is_firm() => only.path.way().profile(&only.foot),
            (first, _) => {
                let all = first.into_iter().chain(close);
                around.mean(all, SHOULDER_M, |s, weight| {
                    weight * s.path.way().profile(&s.foot)
                })
            }
        };
        let t = (edge.value / SHOULDER_M).clamp(0.0, 1.0);
        height * edge.chain((1.0 - smoothstep(t), -6.0 * t * (1.0 - t) / SHOULDER_M))
    }

    /// The depth of the ditch, and how far it moves the foot of the slope, at a distance from the
    /// edge; `None` where there is no ditch.
    fn ditch(&self, around: &Around<'_>) -> Option<(Dual, Dual)> {
        let edge = around.edge;
        if !self.has_ditch || edge.value >= DITCH_REACH_M {
            return None;
        }
        let close = || (around.strands.iter()).filter(|s| s.edge.value < DITCH_REACH_M);
        close().next()?;
        let depth = around.mean(close(), DITCH_REACH_M, |strand, weight| {
            let Some((ditch, share)) = strand.path.way().ditch(&strand.foot) else {
                return Dual::constant(0.0);
            };
            let x = (edge.value / ditch.width_m).clamp(0.0, 1.0);
            let bell = x * (1.0 - x);
            let d_bell = (1.0 - 2.0 * x) / ditch.width_m;
            let form = edge.chain((16.0 * bell * bell, 32.0 * bell * d_bell));
            weight * share * form.scale(ditch.depth_m)
        });
        let width = around.mean(close(), DITCH_REACH_M, |strand, weight| {
            match strand.path.way().ditch(&strand.foot) {
                Some((ditch, share)) => weight * share.scale(ditch.width_m),
                None => Dual::constant(0.0),
            }
        });
        let span = DITCH_REACH_M - SHOULDER_M;
        let t = ((edge.value - SHOULDER_M) / span).clamp(0.0, 1.0);
        let near = edge.chain((1.0 - smoothstep(t), -6.0 * t * (1.0 - t) / span));
        Some((depth, width * near))
    }
}

impl<'a> Around<'a> {
    /// The mean of a value over strands, which count less towards a distance from their edges and
    /// where their feet may leap. It falls to 0 where all may.
    fn mean<'s>(
        &self,
        strands: impl Iterator<Item = &'s Strand<'a>>,
        reach_m: f64,
        weighted: impl Fn(&Strand<'a>, Dual) -> Dual,
    ) -> Dual
    where
        'a: 's,
    {
        let weight_at = |edge: Dual| {
            let left = reach_m - edge.value;
            edge.chain((left * left * left, -3.0 * left * left))
        };
        let (mut total, mut sum) = (Dual::constant(0.0), Dual::constant(0.0));
        for strand in strands {
            let mut weight = weight_at(strand.edge);
            if !strand.is_firm() {
                weight = weight * strand.firmness.shape;
            }
            total = total + weight;
            sum = sum + weighted(strand, weight);
        }
        let least = weight_at(self.nearest);
        if total.value < least.value {
            total = least;
        }
        if total.value <= 0.0 {
            return Dual::constant(0.0);
        }
        sum * total.chain((1.0 / total.value, -1.0 / (total.value * total.value)))
    }
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
