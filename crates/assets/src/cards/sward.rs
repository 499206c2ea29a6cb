//! Grass that grows blade beside blade, bilberry and nettles.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Rng};

use super::card_raster::CardDrawing;
use super::foliage::{heading, stalk, varied};
use super::understory::plain_leaf;
use crate::materials::optics::{BILBERRY, HERB};
use crate::textures::canvas::{Outline, Stroke};

/// Blades that died on their stalks, bleached: paler than freshly cured ones.
pub(crate) const STRAW: Vec3 = Vec3::new(0.225, 0.180, 0.104);
/// Dead blades on the ground, weathered.
pub(crate) const THATCH: Vec3 = Vec3::new(0.165, 0.130, 0.082);

/// A strip of a sward: blades that rise from a line `width_m` long, the longest `height_m`.
pub(crate) struct Strip {
    pub(crate) width_m: f32,
    pub(crate) height_m: f32,
    pub(crate) blades: u32,
    /// The share of dead blades.
    pub(crate) cured: f64,
}

/// Draws a strip of blades. Their images run to the border, so that strips join.
pub(crate) fn strip(rng: &mut impl Rng, of: &Strip) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    for i in 0..of.blades {
        let front = i as f32 / of.blades as f32;
        let base = Vec2::new(of.width_m * rng.range_f32(-0.5, 0.5), -0.004);
        let length = of.height_m * (0.35 + 0.65 * rng.unit_f32().sqrt());
        let lean = rng.range_f32(-0.42, 0.42);
        let droop = lean * rng.range_f32(1.3, 3.2);
        let middle = base + 0.55 * length * heading(-lean);
        let tip = middle + 0.48 * length * heading(-droop);
        let colour = if rng.chance(of.cured) {
            varied(STRAW, rng)
        } else {
            varied(HERB.albedo, rng)
        } * (0.66 + 0.38 * front);
        let width = rng.range_f32(0.0035, 0.0066);
        drawing.stroke(Stroke {
            points: [base, middle, tip],
            width_m: [width, 0.0011],
            colour: [colour * 0.6, colour * 1.05],
            level: 0.0,
        });
    }
    rooted(&mut drawing, of.width_m);
    drawing
}

/// Dead blades and old straw that lie on the ground in all directions.
pub(crate) fn thatch(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    for _ in 0..130 {
        let middle = Vec2::new(rng.range_f32(-0.15, 0.15), rng.range_f32(0.0, 0.30));
        let way = heading(rng.range_f32(-1.6, 1.6));
        let half = 0.5 * rng.range_f32(0.06, 0.20);
        let bend = way.perp() * half * rng.range_f32(-0.35, 0.35);
        let colour = varied(THATCH, rng) * rng.range_f32(0.55, 1.15);
        let width = rng.range_f32(0.0022, 0.0045);
        drawing.stroke(Stroke {
            points: [middle - half * way, middle + bend, middle + half * way],
            width_m: [width, 0.6 * width],
            colour: [colour * 0.8, colour],
            level: 0.0,
        });
    }
    drawing
}

/// Flowering stalks with loose panicles.
pub(crate) fn heads(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    for _ in 0..7 {
        let base = Vec2::new(rng.range_f32(-0.08, 0.08), 0.0);
        let lean = rng.range_f32(-0.16, 0.16);
        let length = rng.range_f32(0.48, 0.80);
        let straw = varied(STRAW, rng);
        let middle = base + 0.6 * length * heading(-0.6 * lean);
        let stem = Stroke {
            points: [base, middle, base + length * heading(-lean)],
            width_m: [0.0036, 0.0030],
            colour: [straw * 0.55, straw],
            level: 0.0,
        };
        drawing.stroke(stem);
        for k in 0..30 {
            let t = 0.70 + 0.30 * k as f32 / 30.0;
            let side = if k % 2 == 0 { 1.0 } else { -1.0 };
            let out = heading(-lean - side * rng.range_f32(0.3, 0.8));
            let from = stem.at(t);
            let reach = 0.045 * (1.15 - (t - 0.70) / 0.30) * rng.range_f32(0.6, 1.1);
            drawing.stroke(Stroke::straight(
                from,
                from + reach * out,
                [0.0034, 0.0026],
                straw * rng.range_f32(0.7, 1.15),
            ));
        }
    }
    rooted(&mut drawing, 0.16);
    drawing
}

/// A bush of bilberry: green, angular shoots with small leaves left and right.
pub(crate) fn bilberry(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let outline = Arc::new(Outline::ovate(0.7, 0.7).toothed(9.0, 0.05));
    let green = BILBERRY.albedo * Vec3::new(1.0, 0.92, 1.0);
    for i in 0..9 {
        let angle = rng.range_f32(-0.60, 0.60);
        let length = rng.range_f32(0.14, 0.26);
        let base = Vec2::new(rng.range_f32(-0.02, 0.02), 0.0);
        let shade = 0.68 + 0.32 * i as f32 / 9.0;
        let shoot = Stroke {
            points: [
                base,
                base + 0.5 * length * heading(1.15 * angle),
                base + length * heading(angle),
            ],
            width_m: [0.0034, 0.0020],
            colour: [Vec3::new(0.085, 0.085, 0.038) * shade, green * shade],
            level: 0.0,
        };
        drawing.stroke(shoot);
        let leaves = 17;
        for k in 0..leaves {
            let t = 0.18 + 0.82 * k as f32 / leaves as f32;
            let side = if k % 2 == 0 { 1.0 } else { -1.0 };
            let turn = angle + side * rng.range_f32(0.5, 1.0);
            let mut leaf = plain_leaf(
                &outline,
                shoot.at(t),
                turn,
                rng.range_f32(0.017, 0.027),
                0.58,
            );
            leaf.colour = varied(BILBERRY.albedo, rng) * shade;
            leaf.browning = rng.range_f32(0.0, 0.10);
            drawing.leaf(leaf);
        }
    }
    drawing
}

/// A stem of the nettle: pairs of drooping, coarsely toothed leaves.
pub(crate) fn nettle(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let outline = Arc::new(Outline::ovate(0.55, 0.95).toothed(13.0, 0.20));
    let green = HERB.albedo * Vec3::new(0.78, 0.86, 0.95);
    let stem = stalk(0.80, 0.0055, Vec3::new(0.085, 0.105, 0.045), rng);
    drawing.stroke(stem);
    let pairs = 10;
    for i in 0..pairs {
        let t = 0.16 + 0.82 * i as f32 / pairs as f32;
        for side in [-1.0, 1.0] {
            // Lower leaves hang, upper ones rise.
            let angle = side * (1.75 - 0.85 * t + rng.range_f32(-0.2, 0.2));
            let length = rng.range_f32(0.080, 0.125) * (1.2 - 0.75 * t);
            let mut leaf = plain_leaf(&outline, stem.at(t), angle, length, 0.55);
            leaf.colour = varied(green, rng) * (0.72 + 0.32 * t);
            leaf.bend = side * rng.range_f32(0.0, 0.25);
            leaf.veins = 0.34;
            leaf.browning = rng.range_f32(0.0, 0.25);
            drawing.leaf(leaf);
        }
    }
    drawing
}

/// A low line of dead bases that holds all blades together, so that the image is attached.
fn rooted(drawing: &mut CardDrawing, width_m: f32) {
    let half = Vec2::new(0.5 * width_m, 0.0);
    drawing.stroke(Stroke::straight(
        -half,
        half,
        [0.010, 0.010],
        HERB.albedo * 0.45,
    ));
}
