//! Common reed (*Phragmites australis*).

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Rng};

use super::card_raster::CardDrawing;
use super::foliage::{heading, stalk, varied};
use super::sward::STRAW;
use crate::textures::canvas::Stroke;

/// Between a grass and the wax on it.
const GREEN: Vec3 = Vec3::new(0.092, 0.135, 0.058);
/// The plume in summer: purple, which fades to brown.
const PLUME: Vec3 = Vec3::new(0.135, 0.092, 0.078);
/// Length of a culm, metres.
const CULM_M: f32 = 1.85;

/// Draws a green culm with its leaves in two ranks, and a plume if it flowers.
pub(crate) fn culm(rng: &mut impl Rng, flowers: bool) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let stem = stalk(
        CULM_M,
        0.011,
        varied(GREEN, rng) * Vec3::new(1.25, 1.1, 0.9),
        rng,
    );
    drawing.stroke(stem);
    let leaves = 11;
    for i in 0..leaves {
        let t = 0.30 + 0.68 * i as f32 / leaves as f32;
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let length = rng.range_f32(0.34, 0.54) * (1.1 - 0.4 * t);
        let colour = varied(GREEN, rng) * rng.range_f32(0.78, 1.12);
        leaf(&mut drawing, stem.at(t), side, length, colour, rng);
    }
    if flowers {
        plume(&mut drawing, &stem, varied(PLUME, rng), rng);
    }
    drawing
}

/// Draws a culm of the last year: bleached, few leaves, and what is left of its plume.
pub(crate) fn dead_culm(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let straw = varied(STRAW, rng);
    let stem = stalk(CULM_M * rng.range_f32(0.8, 1.0), 0.010, straw * 0.95, rng);
    drawing.stroke(stem);
    for i in 0..5 {
        let t = rng.range_f32(0.2, 0.9);
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let length = rng.range_f32(0.18, 0.34);
        let colour = varied(STRAW, rng) * rng.range_f32(0.65, 1.0);
        leaf(&mut drawing, stem.at(t), side, length, colour, rng);
    }
    plume(
        &mut drawing,
        &stem,
        straw * Vec3::new(0.80, 0.72, 0.66),
        rng,
    );
    drawing
}

/// Draws leaves that spread from one place of a culm, as they are seen from above.
pub(crate) fn leaves(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    for turn in [-0.55, 0.02, 0.6] {
        let turn = turn + rng.range_f32(-0.12, 0.12);
        let length = rng.range_f32(0.34, 0.50);
        let colour = varied(GREEN, rng) * rng.range_f32(0.85, 1.12);
        let middle = 0.55 * length * heading(turn);
        drawing.stroke(Stroke {
            points: [
                Vec2::ZERO,
                middle,
                middle + 0.5 * length * heading(1.3 * turn),
            ],
            width_m: [rng.range_f32(0.022, 0.030), 0.004],
            colour: [colour * 0.85, colour * 1.08],
            level: 0.0,
        });
    }
    drawing
}

/// A leaf that rises, bends over and tapers to a point.
fn leaf(
    drawing: &mut CardDrawing,
    from: Vec2,
    side: f32,
    length: f32,
    colour: Vec3,
    rng: &mut impl Rng,
) {
    let rise = -side * rng.range_f32(0.25, 0.55);
    let middle = from + 0.55 * length * heading(rise);
    let droop = -side * rng.range_f32(0.7, 1.6);
    let tip = middle + 0.50 * length * heading(droop);
    drawing.stroke(Stroke {
        points: [from, middle, tip],
        width_m: [rng.range_f32(0.018, 0.026), 0.003],
        colour: [colour * 0.8, colour * 1.08],
        level: 0.0,
    });
}

/// A plume that nods to one side.
fn plume(drawing: &mut CardDrawing, stem: &Stroke, colour: Vec3, rng: &mut impl Rng) {
    let nods = if rng.chance(0.5) { 1.0 } else { -1.0 };
    for k in 0..46 {
        let t = 0.88 + 0.12 * k as f32 / 46.0;
        let from = stem.at(t);
        let turn = -nods * rng.range_f32(-0.25, 0.75);
        let reach = rng.range_f32(0.06, 0.13);
        let middle = from + 0.6 * reach * heading(turn);
        drawing.stroke(Stroke {
            points: [
                from,
                middle,
                middle + 0.5 * reach * heading(turn - 0.7 * nods),
            ],
            width_m: [0.0075, 0.004],
            colour: [
                colour * rng.range_f32(0.7, 1.1),
                colour * rng.range_f32(0.9, 1.2),
            ],
            level: 0.0,
        });
    }
}
