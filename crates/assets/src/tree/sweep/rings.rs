//! The rings of vertices along an axis.

use nemoral_scene::glam::DVec3;

use super::Tessellation;
use crate::tree::radii::at_param;
use crate::tree::skeleton::{Axis, BREAST_M};

/// Thinner branches have no collar, as it would not be visible.
const COLLAR_RADIUS_M: f64 = 0.008;

/// A ring of vertices that is still to be made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    pub(super) centre: DVec3,
    pub(super) radius: f64,
}

/// Radius of the parent where an axis leaves it.
pub(super) fn parent_radius(axis: &Axis, radii: &[Vec<f64>]) -> Option<f64> {
    axis.parent.map(|(p, s)| at_param(&radii[p], s))
}

/// The rings of an axis: a collar where it leaves its parent, no ring that bend and taper do not
/// need, and one exactly where the trunk threshold is crossed.
pub(super) fn rings(
    axis: &Axis,
    radii: &[f64],
    parent_radius: Option<f64>,
    tessellation: Tessellation,
) -> Vec<Ring> {
    let trunk_radius_m = tessellation.trunk_radius_m;
    let all: Vec<Ring> = axis
        .points
        .iter()
        .zip(radii)
        .map(|(&centre, &radius)| Ring { centre, radius })
        .collect();
    let mut kept = simplify(&all, axis.order == 0, tessellation.tolerance);
    let thick = kept[0].radius > COLLAR_RADIUS_M * tessellation.tolerance;
    if let Some(parent_radius) = parent_radius.filter(|_| axis.order == 1 && thick) {
        collar(&mut kept, parent_radius);
    }
    let mut out: Vec<Ring> = Vec::with_capacity(kept.len() + 1);
    for ring in kept {
        if let Some(&last) = out.last() {
            let (a, b) = (last.radius - trunk_radius_m, ring.radius - trunk_radius_m);
            if a * b < 0.0 {
                let t = a / (a - b);
                if t > 1e-3 && t < 1.0 - 1e-3 {
                    out.push(Ring {
                        centre: last.centre.lerp(ring.centre, t),
                        radius: trunk_radius_m,
                    });
                }
            }
        }
        out.push(ring);
    }
    out
}

/// Widens a branch where it comes out of its parent's bark.
fn collar(rings: &mut Vec<Ring>, parent_radius: f64) {
    let Ring {
        centre: base,
        radius,
    } = rings[0];
    let along = rings[1].centre - base;
    let length = along.length();
    let (bark, end) = (parent_radius, parent_radius + 2.5 * radius);
    if end < 0.8 * length {
        let at = |s: f64| base + along * (s / length);
        let r = |s: f64| radius + (rings[1].radius - radius) * (s / length);
        let new = [
            Ring {
                centre: at(bark),
                radius: 1.3 * r(bark),
            },
            Ring {
                centre: at(end),
                radius: r(end),
            },
        ];
        rings[0].radius *= 1.3;
        rings.splice(1..1, new);
    }
}

/// Drops points that a straight, evenly tapering piece replaces within a fraction of the radius.
fn simplify(all: &[Ring], is_stem: bool, tolerance: f64) -> Vec<Ring> {
    let last = all.len() - 1;
    let mut kept = vec![all[0]];
    let mut from = 0;
    while from < last {
        let mut to = from + 1;
        while to < last
            && fits(&all[from..=to + 1], is_stem, tolerance)
            && !(is_stem && all[from].centre.z < 1.5 * BREAST_M)
        {
            to += 1;
        }
        kept.push(all[to]);
        from = to;
    }
    kept
}

fn fits(piece: &[Ring], is_stem: bool, tolerance: f64) -> bool {
    // The limit keeps leaves from hanging visibly beside their twigs.
    let most_m = (0.02 * tolerance).min(0.03);
    // The taper of stems is measured by foresters, that of branches is not.
    let thinner = if is_stem { 0.01 } else { 0.12 * tolerance };
    let (a, b) = (piece[0], piece[piece.len() - 1]);
    let chord = b.centre - a.centre;
    let length_squared = chord.length_squared().max(1e-12);
    piece[1..piece.len() - 1].iter().all(|p| {
        let t = ((p.centre - a.centre).dot(chord) / length_squared).clamp(0.0, 1.0);
        let off = p.centre.distance(a.centre + chord * t);
        let radius = a.radius + (b.radius - a.radius) * t;
        off < (0.25 * tolerance * p.radius).clamp(0.008, most_m)
            && (p.radius - radius).abs() < (thinner * p.radius).max(0.001)
    })
}

/// The direction of a ring's axis: the mean of the pieces that meet in it.
pub(super) fn tangent(rings: &[Ring], i: usize) -> DVec3 {
    let piece = |k: usize| (rings[k + 1].centre - rings[k].centre).normalize_or(DVec3::Z);
    match i {
        0 => piece(0),
        i if i == rings.len() - 1 => piece(i - 1),
        i => (piece(i - 1) + piece(i)).normalize_or(DVec3::Z),
    }
}
