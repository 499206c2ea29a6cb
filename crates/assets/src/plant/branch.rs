//! Branches on the ground: single ones, tops left after thinning, and brash.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use nemoral_scene::MaterialId;
use nemoral_seed::{Draw, Rng};

use super::shape::{Shape, around};
use super::undergrowth::scatter;
use crate::materials::DeadwoodMaterials;

/// Radius of a mat of brash, metres.
const BRASH_M: f32 = 1.25;

/// A branch of 0.9 to 2.6 m that a storm broke, or, every fourth variant, the top of a thinned
/// tree.
pub(crate) fn branch(variant: u32, materials: &DeadwoodMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let material = materials.branches[usize::from(rng.chance(0.6))];
    let heading = rng.range_f32(0.0, TAU);
    if variant % 4 == 3 {
        top(&mut shape, heading, material, rng);
    } else {
        let length = rng.range_f32(0.9, 2.6);
        let radius = length * rng.range_f32(0.006, 0.013);
        let start = -0.5 * length * around(heading) + Vec3::Z * radius;
        limb(
            &mut shape,
            (start, heading, length, radius),
            2,
            material,
            rng,
        );
    }
    shape
}

/// A mat of branches and tops that a harvester laid down to drive on: up to 0.35 m high.
pub(crate) fn brash(materials: &DeadwoodMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let main = rng.range_f32(0.0, TAU);
    for at in scatter(13 + rng.below(8), BRASH_M - 0.45, 0.05, rng) {
        let material = materials.branches[usize::from(rng.chance(0.25))];
        // Most lie across the machine's way.
        let heading = main + 0.5 * (rng.unit_f32() - rng.unit_f32()) * TAU * 0.4;
        let length = rng.range_f32(0.7, 1.7);
        let radius = length * rng.range_f32(0.006, 0.014);
        let middle = (1.0 - at.length() / BRASH_M).max(0.0);
        let height = radius + 0.22 * middle * rng.unit_f32();
        let start = at.extend(height) - 0.5 * length * around(heading);
        limb(
            &mut shape,
            (start, heading, length, radius),
            1,
            material,
            rng,
        );
    }
    shape
}

/// The top of a tree: a stem with whorls of twigs on the sides that the ground did not break off.
fn top(shape: &mut Shape, heading: f32, material: MaterialId, rng: &mut impl Rng) {
    let length = rng.range_f32(2.0, 3.4);
    let radius = rng.range_f32(0.022, 0.042);
    let along = around(heading);
    let rest = radius + 0.04;
    let line: Vec<Vec3> = (0..8)
        .map(|i| {
            let t = i as f32 / 7.0;
            along * length * (t - 0.5) + Vec3::Z * (rest + 0.10 * t)
        })
        .collect();
    let radii: Vec<f32> = (0..8)
        .map(|i| radius * (1.0 - 0.88 * i as f32 / 7.0))
        .collect();
    shape.tube(&line, &radii, 7, material);
    let side = Vec3::new(-along.y, along.x, 0.0);
    for whorl in 0..7 {
        let t = 0.08 + 0.125 * whorl as f32;
        let base = along * length * (t - 0.5) + Vec3::Z * (rest + 0.10 * t);
        for _ in 0..3 + rng.below(2) {
            let turn = rng.range_f32(-0.2, 0.7) * 0.5 * TAU;
            let out = side * libm::cosf(turn) + Vec3::Z * libm::sinf(turn).max(-0.1);
            let way = (out + along * rng.range_f32(0.3, 0.9)).normalize_or(out);
            let reach = (1.0 - t) * rng.range_f32(0.35, 0.8) + 0.10;
            let thin = radius * (0.32 - 0.22 * t);
            let mid = base + way * (0.5 * reach);
            // Twigs hang a little, but not into the ground.
            let mut end = base + way * reach - Vec3::Z * (0.10 * reach);
            end.z = end.z.max(thin);
            shape.tube(
                &[base, mid, end],
                &[thin, 0.7 * thin, 0.3 * thin],
                4,
                material,
            );
        }
    }
}

/// A crooked branch from a start along a heading, with side branches.
fn limb(
    shape: &mut Shape,
    (start, heading, length, radius): (Vec3, f32, f32, f32),
    orders: u32,
    material: MaterialId,
    rng: &mut impl Rng,
) {
    const JOINTS: usize = 6;
    let step = length / JOINTS as f32;
    let (mut at, mut turn) = (start, heading);
    let mut line = vec![start];
    let mut radii = vec![radius];
    for i in 1..=JOINTS {
        turn += rng.range_f32(-0.22, 0.22);
        at += step * around(turn);
        let thin = radius * (1.0 - 0.8 * i as f32 / JOINTS as f32);
        // It rests on its bows.
        at.z = (at.z + step * rng.range_f32(-0.20, 0.22)).clamp(0.8 * thin, start.z + 0.12);
        line.push(at);
        radii.push(thin);
    }
    shape.tube(&line, &radii, if radius > 0.012 { 6 } else { 4 }, material);
    if orders == 0 {
        return;
    }
    for _ in 0..2 + rng.below(3) {
        let from = 2 + rng.below(JOINTS as u32 - 2) as usize;
        let way = Vec2::new(
            line[from].x - line[from - 1].x,
            line[from].y - line[from - 1].y,
        );
        let ahead = libm::atan2f(way.y, way.x);
        let aside = ahead + if rng.chance(0.5) { 0.75 } else { -0.75 };
        let share = rng.range_f32(0.25, 0.5);
        let part = (line[from], aside, length * share, 0.75 * radii[from]);
        limb(shape, part, orders - 1, material, rng);
    }
}
