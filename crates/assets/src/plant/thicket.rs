//! Tiles of thickets that interlock: brambles, bracken, heather, bilberry, nettles, reeds.

use std::f32::consts::TAU;

use glam::Vec3;
use nemoral_seed::{Draw, Rng};

use super::shape::{Shape, around, leaning};
use super::shrub::cane;
use super::undergrowth::{SUNK_M, arched, bracken_frond, on_line, scatter};
use crate::materials::{CommunityMaterials, WorldMaterials};

/// Canes that root and arch all over a tile, `height` metres high.
pub(crate) fn bramble(height: f32, materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    // Long canes hide as much as more short ones.
    let canes = (16.0 / height).clamp(11.0, 18.0) as u32;
    for root in scatter(canes, 0.75, 0.10, rng) {
        let azimuth = rng.range_f32(0.0, TAU);
        let length = height * rng.range_f32(1.1, 1.9);
        let root = root.extend(-SUNK_M);
        cane(&mut shape, root, azimuth, length, materials, rng);
    }
    shape
}

/// Fronds beside each other, whose tips make one canopy.
pub(crate) fn bracken(height: f32, materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    for foot in scatter(20 + rng.below(5), 0.85, 0.16, rng) {
        let dead = rng.chance(0.10);
        // Younger fronds are shorter, and fewer.
        let late = rng.unit_f32();
        let length = height * (1.45 - 0.75 * late * late);
        let azimuth = rng.range_f32(0.0, TAU);
        let arch = rng.range_f32(1.15, 1.65) + if dead { 0.5 } else { 0.0 };
        bracken_frond(
            &mut shape, foot, azimuth, length, arch, dead, materials, rng,
        );
    }
    shape
}

/// Bushes of heather, shoot beside shoot.
pub(crate) fn heath(height: f32, materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    for foot in scatter(26, 0.88, 0.13, rng) {
        let tall = height * rng.range_f32(0.75, 1.15);
        for i in 0..6 {
            let azimuth = 2.4 * i as f32 + rng.range_f32(-0.4, 0.4);
            let tilt = 0.85 * (i as f32 / 6.0).sqrt() + rng.range_f32(-0.1, 0.1);
            let line = arched(
                foot.extend(-SUNK_M),
                azimuth,
                tall,
                1.1 * tilt,
                0.6 * tilt,
                3,
            );
            shape.tube(&line, &[0.0042, 0.0032, 0.0016], 3, materials.shrub_wood);
            for k in 0..5 {
                let t = 0.20 + 0.75 * (k as f32 + rng.unit_f32()) / 5.0;
                let (at, along) = on_line(&line, t);
                let way = along + 0.6 * around(rng.range_f32(0.0, TAU)) + 0.2 * Vec3::Z;
                let across = around(rng.range_f32(0.0, TAU));
                let size = rng.range_f32(0.75, 1.1) * (tall / 0.5).clamp(0.8, 1.2);
                shape.card(rng.choose(&materials.heather), at, way, across, size);
            }
        }
    }
    shape
}

/// Low bushes of bilberry, leaf beside leaf.
pub(crate) fn bilberry(height: f32, materials: &CommunityMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    for foot in scatter(250, 0.90, 0.04, rng) {
        let azimuth = rng.range_f32(0.0, TAU);
        let along = leaning(azimuth, rng.range_f32(0.10, 0.80));
        let across = around(azimuth + rng.range_f32(0.8, 2.3));
        let size = height / 0.26 * rng.range_f32(0.75, 1.15);
        let card = rng.choose(&materials.bilberry);
        shape.card(card, foot.extend(-SUNK_M), along, across, size);
    }
    shape
}

/// Nettles, stem beside stem.
pub(crate) fn nettles(height: f32, materials: &CommunityMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    for foot in scatter(75, 0.85, 0.07, rng) {
        let along = leaning(rng.range_f32(0.0, TAU), rng.range_f32(0.0, 0.28));
        let across = around(rng.range_f32(0.0, TAU));
        let size = height / 0.80 * rng.range_f32(0.65, 1.1);
        let card = rng.choose(&materials.nettle);
        let base = foot.extend(-SUNK_M);
        // Pairs of leaves are crossed.
        shape.card(card, base, along, across, size);
        shape.card(card, base, along, across.cross(along), 0.94 * size);
        // From above, their tops are rosettes.
        for t in [0.80, 0.96] {
            let azimuth = rng.range_f32(0.0, TAU);
            let out = leaning(azimuth, rng.range_f32(1.25, 1.50));
            let at = base + along * (t * size * card.height_m);
            let half = 0.16 * card.height_m * size * out;
            let level = around(azimuth + 0.25 * TAU);
            shape.card(
                card,
                at - half,
                out,
                level,
                rng.range_f32(0.34, 0.48) * size,
            );
        }
    }
    shape
}

/// Reeds, culm beside culm, those of the last year among them.
pub(crate) fn reeds(height: f32, materials: &CommunityMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    // Wind has turned the leaves of all the same way.
    let wind = rng.range_f32(0.0, TAU);
    for foot in scatter(96, 0.85, 0.05, rng) {
        let dead = usize::from(rng.chance(0.32));
        let card = rng.choose(&materials.reed[dead]);
        // Dead ones are bent, some of them broken down.
        let lean = if dead == 1 {
            rng.range_f32(0.02, 0.50)
        } else {
            rng.range_f32(0.0, 0.16)
        };
        let along = leaning(wind + rng.range_f32(-1.4, 1.4), lean);
        let across = around(wind + rng.range_f32(-1.0, 1.0));
        let size = height / 2.0 * rng.range_f32(0.72, 1.08);
        let base = foot.extend(-SUNK_M);
        shape.card(card, base, along, across, size);
        if rng.chance(0.5) {
            let lower = rng.range_f32(0.7, 0.9) * size;
            shape.card(card, base, along, across.cross(along), lower);
        }
        // From above, leaves spread to all sides.
        for _ in 0..3 - 2 * dead {
            let t = rng.range_f32(0.40, 0.95);
            let at = base + along * (t * size * card.height_m);
            let azimuth = rng.range_f32(0.0, TAU);
            let out = leaning(azimuth, rng.range_f32(0.6, 1.35));
            let level = around(azimuth + 0.25 * TAU);
            let size = size * rng.range_f32(0.8, 1.15);
            shape.card(rng.choose(&materials.reed_leaves), at, out, level, size);
        }
    }
    shape
}
