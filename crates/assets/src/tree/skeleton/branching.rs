//! Where branches spring from their parent, and how they run.

use std::f64::consts::TAU;

use nemoral_scene::glam::DVec3;
use nemoral_seed::{Domain, Draw, Key};

use super::{beside, turn};
use crate::tree::BranchLevel;

const SHAPE: Domain = Domain::new("assets.tree.shape");

/// The branches of a parent's zone of length `span_m`: (number, distance from the zone's start,
/// azimuth).
pub(super) fn nodes(
    level: &BranchLevel,
    span_m: f64,
    density: f64,
    key: Key,
) -> Vec<(u64, f64, f64)> {
    let mut rng = key.domain(SHAPE).rng();
    let spacing = level.node_spacing_m / density;
    let mut azimuth = rng.range_f64(0.0, TAU);
    if level.planar {
        azimuth = if azimuth < 0.5 * TAU { 0.0 } else { 0.5 * TAU };
    }
    let jitter = if level.planar { 0.12 } else { 0.25 };
    let mut at = rng.range_f64(0.1, 0.9) * spacing;
    let mut out = Vec::new();
    while at <= span_m {
        let n = rng.between(level.per_node[0], level.per_node[1]);
        for k in 0..n {
            let whorl = TAU * f64::from(k) / f64::from(n) + rng.range_f64(-jitter, jitter);
            // Branches of a whorl spring from slightly different heights.
            let offset = if n > 1 {
                rng.range_f64(-0.08, 0.08) * spacing
            } else {
                0.0
            };
            out.push((
                out.len() as u64,
                (at + offset).clamp(0.0, span_m),
                azimuth + whorl,
            ));
        }
        azimuth += level.divergence_deg.to_radians();
        at += spacing * rng.range_f64(0.75, 1.25);
    }
    out
}

/// The direction in which a branch leaves its parent at relative position `t` of the zone.
pub(super) fn insertion(
    level: &BranchLevel,
    along: DVec3,
    t: f64,
    azimuth: f64,
    rng: &mut impl Draw,
) -> DVec3 {
    let [base, tip] = level.insertion_deg;
    let scatter = level.angle_sd_deg * rng.normal().clamp(-2.0, 2.0);
    let angle = (base + (tip - base) * t + scatter)
        .clamp(5.0, 120.0)
        .to_radians();
    let side = turn(beside(along), along, azimuth);
    turn(along, side.cross(along).normalize_or(DVec3::X), -angle)
}

/// A direction bent towards the vertical by an angle (downwards if negative), never beyond it.
pub(super) fn bent_up(direction: DVec3, angle: f64) -> DVec3 {
    let from_up = libm::acos(direction.z.clamp(-1.0, 1.0));
    let angle = angle.clamp(from_up - std::f64::consts::PI, from_up);
    turn(direction, beside(direction), angle)
}

/// The points of a branch: joints of equal length, bent, gnarled and zig-zagging.
pub(super) fn walk(
    level: &BranchLevel,
    start: DVec3,
    direction: DVec3,
    length: f64,
    key: Key,
) -> Vec<DVec3> {
    let mut rng = key.domain(SHAPE).item(1).rng();
    let joints = (length / level.joint_m).round().clamp(2.0, 14.0);
    let mut direction = direction;
    let mut position = start;
    let mut points = vec![start];
    let mut side = rng.range_f64(0.0, TAU);
    for joint in 0..joints as u32 {
        if joint > 0 {
            let half = usize::from(2.0 * f64::from(joint) > joints);
            let curve_deg = 2.0 * level.curve_deg[half] / (joints - 1.0);
            direction = bent_up(direction, curve_deg.to_radians());
            let gnarl = level.gnarl_deg.to_radians() * rng.normal().clamp(-2.0, 2.0);
            let about = turn(beside(direction), direction, rng.range_f64(0.0, TAU));
            direction = turn(direction, about, gnarl);
            side += rng.range_f64(-0.5, 0.5);
            let zigzag = level.zigzag_deg.to_radians() * if joint == 1 { 0.5 } else { 1.0 };
            let sign = if joint % 2 == 0 { 1.0 } else { -1.0 };
            direction = turn(
                direction,
                turn(beside(direction), direction, side),
                sign * zigzag,
            );
            direction = direction.normalize_or(DVec3::Z);
        }
        position += direction * (length / joints);
        points.push(position);
    }
    points
}
