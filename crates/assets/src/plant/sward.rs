//! Tiles of grass that leave no gaps: strips of blades beside each other, over dead blades that
//! lie on the ground. Tiles overlap, so that none is seen to end.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use nemoral_scene::PlantCommunity;
use nemoral_seed::{Draw, Rng};

use super::shape::{Shape, around, leaning};
use super::undergrowth::{SUNK_M, scatter};
use crate::materials::{CommunityMaterials, Hue};
use crate::tree::FoliageCard;

/// How a sward grows.
struct Habit {
    /// Strips of tall blades on a square metre of a tile.
    tall_per_m2: f32,
    /// Their size, relative to blades of a third of a metre: the least and the most.
    size: [f32; 2],
    /// How far they lean, radians: the least and the most.
    lean: [f32; 2],
    /// Whether all of them lean the same way, towards +x.
    is_lodged: bool,
    /// Strips of short blades on a square metre.
    short_per_m2: f32,
    /// Images of dead blades that lie on a square metre.
    thatch_per_m2: f32,
    /// Images of flowering stalks on a square metre.
    heads_per_m2: f32,
    /// The share of straw among the strips.
    straw: f32,
}

fn habit(of: PlantCommunity) -> Habit {
    match of {
        PlantCommunity::GrazedGrass => Habit {
            tall_per_m2: 2.0,
            size: [0.35, 0.6],
            lean: [0.1, 0.7],
            is_lodged: false,
            short_per_m2: 105.0,
            thatch_per_m2: 9.0,
            heads_per_m2: 0.3,
            straw: 0.10,
        },
        PlantCommunity::Tussocks => Habit {
            tall_per_m2: 14.0,
            size: [0.5, 0.9],
            lean: [0.1, 0.6],
            is_lodged: false,
            short_per_m2: 30.0,
            thatch_per_m2: 22.0,
            heads_per_m2: 2.5,
            straw: 0.40,
        },
        PlantCommunity::DryGrass => Habit {
            tall_per_m2: 68.0,
            size: [0.6, 1.25],
            lean: [0.05, 0.75],
            is_lodged: false,
            short_per_m2: 12.0,
            thatch_per_m2: 20.0,
            heads_per_m2: 7.0,
            straw: 0.72,
        },
        PlantCommunity::LodgedGrass => Habit {
            tall_per_m2: 80.0,
            size: [0.9, 1.4],
            lean: [0.85, 1.35],
            is_lodged: true,
            short_per_m2: 10.0,
            thatch_per_m2: 16.0,
            heads_per_m2: 2.0,
            straw: 0.22,
        },
        PlantCommunity::RankGrass => Habit {
            tall_per_m2: 80.0,
            size: [0.8, 1.55],
            lean: [0.05, 0.60],
            is_lodged: false,
            short_per_m2: 10.0,
            thatch_per_m2: 16.0,
            heads_per_m2: 5.0,
            straw: 0.08,
        },
        _ => unreachable!("only grass has a habit"),
    }
}

/// A tile of a sward. `variant` 0..1 runs from yellow-green through green to blue-grey.
pub(crate) fn tile(
    of: PlantCommunity,
    radius_m: f32,
    variant: f32,
    materials: &CommunityMaterials,
    rng: &mut impl Rng,
) -> Shape {
    let mut shape = Shape::default();
    let habit = habit(of);
    let area_m2 = 0.5 * TAU * radius_m * radius_m;
    let count = |per_m2: f32| (per_m2 * area_m2).round() as u32;
    // Tiles differ in height.
    let height = rng.range_f32(0.85, 1.15);
    let glaucous = (1.6 * variant - 0.55).clamp(0.0, 0.85);
    let hue = |rng: &mut _| {
        if Draw::chance(rng, f64::from(habit.straw)) {
            Hue::Straw
        } else if Draw::chance(rng, f64::from(glaucous)) {
            Hue::Glaucous
        } else {
            Hue::Green
        }
    };
    for _ in 0..count(habit.thatch_per_m2) {
        let at = within(radius_m, rng);
        let card = rng.choose(&materials.thatch);
        lie(&mut shape, card, at, [0.004, 0.03], rng);
    }
    for _ in 0..count(habit.short_per_m2) {
        let at = within(radius_m, rng);
        let dry = usize::from(hue(rng) == Hue::Straw);
        let card = rng.choose(&materials.short[dry]);
        let size = rng.range_f32(0.6, 1.25) * height;
        stand(
            &mut shape,
            card,
            at,
            habit_lean(&[0.05, 0.75], rng),
            size,
            rng,
        );
    }
    if of == PlantCommunity::Tussocks {
        for foot in scatter(count(2.6), radius_m - 0.1, 0.26, rng) {
            tussock(&mut shape, foot, height, glaucous, materials, rng);
        }
    }
    for _ in 0..count(habit.tall_per_m2) {
        let at = within(radius_m, rng);
        let card = {
            let hue = hue(rng);
            rng.choose(&materials.tall[hue.index()])
        };
        let size = rng.range_f32(habit.size[0], habit.size[1]) * height * rim(at, radius_m);
        let lean = habit_lean(&habit.lean, rng);
        if habit.is_lodged {
            // Blades lie over each other along the wind.
            let azimuth = rng.range_f32(-0.55, 0.55);
            let base = at.extend(-SUNK_M + 0.05 * rng.unit_f32());
            let across = around(azimuth + 0.25 * TAU) + Vec3::Z * rng.range_f32(-0.5, 0.5);
            shape.card(card, base, leaning(azimuth, lean), across, size);
        } else {
            stand(&mut shape, card, at, lean, size, rng);
        }
    }
    for _ in 0..count(habit.heads_per_m2) {
        let at = within(radius_m, rng);
        let card = rng.choose(&materials.heads);
        let lean = if habit.is_lodged { 0.9 } else { 0.25 } * rng.unit_f32();
        let size = rng.range_f32(0.55, 1.0) * height * rim(at, radius_m);
        stand(&mut shape, card, at, lean, size, rng);
    }
    shape
}

/// A clump of blades that arch out from one foot, dead ones hanging around it.
fn tussock(
    shape: &mut Shape,
    foot: Vec2,
    height: f32,
    glaucous: f32,
    materials: &CommunityMaterials,
    rng: &mut impl Rng,
) {
    let size = rng.range_f32(0.9, 1.5) * height;
    let blades = 22 + rng.below(8);
    for i in 0..blades {
        let azimuth = 2.4 * i as f32 + rng.range_f32(-0.3, 0.3);
        let outer = (i as f32 / blades as f32).sqrt();
        let hue = if outer > 0.8 || rng.chance(0.12) {
            Hue::Straw
        } else if rng.chance(f64::from(glaucous)) {
            Hue::Glaucous
        } else {
            Hue::Green
        };
        let card = rng.choose(&materials.tall[hue.index()]);
        let lean = 0.10 + 1.05 * outer * outer + rng.range_f32(-0.08, 0.12);
        let base = foot.extend(-SUNK_M) + around(azimuth) * (0.08 * outer);
        let across = around(azimuth + rng.range_f32(1.1, 2.0));
        let scale = size * rng.range_f32(0.75, 1.1) * (1.0 - 0.25 * outer);
        shape.card(card, base, leaning(azimuth, lean), across, scale);
    }
}

fn habit_lean(lean: &[f32; 2], rng: &mut impl Rng) -> f32 {
    rng.range_f32(lean[0], lean[1])
}

/// A point of a disc.
fn within(radius_m: f32, rng: &mut impl Rng) -> Vec2 {
    let r = radius_m * rng.unit_f32().sqrt();
    around(rng.range_f32(0.0, TAU)).truncate() * r
}

/// Blades are lower towards the rim of a tile, where the next one's stand among them.
fn rim(at: Vec2, radius_m: f32) -> f32 {
    let share = at.length() / radius_m;
    1.0 - 0.3 * share * share * share
}

/// A strip that rises from the ground, however turned.
fn stand(
    shape: &mut Shape,
    card: &FoliageCard,
    at: Vec2,
    lean: f32,
    size: f32,
    rng: &mut impl Rng,
) {
    let azimuth = rng.range_f32(0.0, TAU);
    let across = around(azimuth + rng.range_f32(0.9, 2.2));
    // What is short is not sunk as deep.
    let sunk = SUNK_M.min(0.2 * card.height_m * size);
    let base = at.extend(-sunk);
    shape.card(card, base, leaning(azimuth, lean), across, size);
}

/// An image that lies on the ground.
fn lie(shape: &mut Shape, card: &FoliageCard, at: Vec2, high: [f32; 2], rng: &mut impl Rng) {
    let azimuth = rng.range_f32(0.0, TAU);
    let along = around(azimuth) + Vec3::Z * rng.range_f32(-0.05, 0.12);
    let across = around(azimuth + 0.25 * TAU) + Vec3::Z * rng.range_f32(-0.10, 0.10);
    let size = rng.range_f32(0.75, 1.2);
    let half = around(azimuth) * (0.5 * card.height_m * size);
    let base = at.extend(rng.range_f32(high[0], high[1])) - half;
    shape.card(card, base, along, across, size);
}
