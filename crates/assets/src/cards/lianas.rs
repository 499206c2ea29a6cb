//! Shoots of lianas, clematis and honeysuckle, and runs of resin.

use std::f32::consts::TAU;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Rng};

use super::card_raster::CardDrawing;
use super::foliage::{heading, stalk, varied};
use crate::textures::canvas::{Leaf, Outline, Stroke};

/// Reflectance of clematis leaves.
pub(crate) const CLEMATIS: Vec3 = Vec3::new(0.064, 0.116, 0.034);
/// Reflectance of honeysuckle leaves, which are a little blue.
pub(crate) const HONEYSUCKLE: Vec3 = Vec3::new(0.058, 0.108, 0.046);
/// Reflectance of resin that has dried on bark.
pub(crate) const RESIN: Vec3 = Vec3::new(0.36, 0.30, 0.19);

/// Petals of both, and silk of clematis' seeds.
const CREAM: Vec3 = Vec3::new(0.62, 0.58, 0.40);
const SILK: Vec3 = Vec3::new(0.50, 0.49, 0.44);

/// What a shoot of clematis bears besides leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bears {
    Leaves,
    Flowers,
    /// Seeds in balls of silk.
    Silk,
}

/// A shoot of traveller's joy (*Clematis vitalba*) some 0.4 m long: pairs of leaves of five
/// leaflets on long stalks, by which it holds on.
pub(crate) fn clematis(rng: &mut impl Rng, bears: Bears) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let outline = Arc::new(Outline::ovate(0.55, 0.95).toothed(5.0, 0.14));
    let wood = Vec3::new(0.105, 0.090, 0.045);
    let shoot = stalk(0.36, 0.004, wood, rng);
    drawing.stroke(shoot);
    for pair in 0..4 {
        let t = 0.10 + 0.27 * pair as f32 + rng.range_f32(-0.03, 0.03);
        let young = 1.0 - 0.12 * pair as f32;
        for side in [-1.0_f32, 1.0] {
            let angle = side * rng.range_f32(0.75, 1.35);
            let from = shoot.at(t);
            let length = young * rng.range_f32(0.11, 0.15);
            let rachis = Stroke::straight(
                from,
                from + length * heading(angle),
                [0.0022, 0.0014],
                wood * 1.2,
            );
            drawing.stroke(rachis);
            for (at, off) in [
                (0.48, 1.15),
                (0.48, -1.15),
                (0.80, 0.95),
                (0.80, -0.95),
                (1.0, 0.0),
            ] {
                let long =
                    young * rng.range_f32(0.046, 0.066) * if off == 0.0 { 1.15 } else { 1.0 };
                let direction = heading(angle + off + rng.range_f32(-0.25, 0.25));
                let foot = rachis.at(at);
                drawing.leaf(Leaf {
                    outline: outline.clone(),
                    base: foot + 0.008 * direction,
                    direction,
                    length_m: long,
                    width_m: long * rng.range_f32(0.58, 0.72),
                    bend: rng.range_f32(-0.12, 0.12),
                    colour: varied(CLEMATIS, rng) * rng.range_f32(0.75, 1.1),
                    veins: 0.26,
                    browning: rng.range_f32(0.0, 0.15),
                    level: 0.0,
                });
            }
        }
        if bears != Bears::Leaves && pair > 0 {
            for _ in 0..3 + rng.below(3) {
                let off = heading(rng.range_f32(-1.5, 1.5)) * rng.range_f32(0.03, 0.10);
                let at = shoot.at(t) + off;
                let stem = Stroke::straight(shoot.at(t), at, [0.0014; 2], wood * 1.2);
                drawing.stroke(stem);
                if bears == Bears::Flowers {
                    star(&mut drawing, at, rng);
                } else {
                    silk(&mut drawing, at, rng);
                }
            }
        }
    }
    drawing
}

/// A flower of clematis: four sepals and a brush of stamens, 2 cm wide.
fn star(drawing: &mut CardDrawing, at: Vec2, rng: &mut impl Rng) {
    let turn = rng.range_f32(0.0, TAU);
    for i in 0..4 {
        let way = heading(turn + 0.25 * TAU * i as f32);
        let colour = CREAM * rng.range_f32(0.85, 1.1);
        let sepal = Stroke::straight(at, at + 0.011 * way, [0.0065, 0.0035], colour);
        drawing.stroke(sepal);
    }
    for _ in 0..14 {
        let way = heading(rng.range_f32(0.0, TAU));
        let to = at + way * rng.range_f32(0.004, 0.009);
        drawing.stroke(Stroke::straight(at, to, [0.0012; 2], CREAM * 1.15));
    }
}

/// A ball of plumed seeds, 4 cm wide: old man's beard.
fn silk(drawing: &mut CardDrawing, at: Vec2, rng: &mut impl Rng) {
    for _ in 0..34 {
        let angle = rng.range_f32(0.0, TAU);
        let length = rng.range_f32(0.010, 0.022);
        let tip = at + length * heading(angle);
        let side = rng.range_f32(-0.35, 0.35);
        let colour = SILK * rng.range_f32(0.7, 1.15);
        drawing.stroke(Stroke {
            points: [at, at + 0.6 * length * heading(angle + side), tip],
            width_m: [0.0016, 0.0010],
            colour: [colour * 0.7, colour],
            level: 0.0,
        });
    }
}

/// A shoot of honeysuckle (*Lonicera periclymenum*) some 0.3 m long: pairs of oval leaves almost
/// without stalks, and flowers in a head at its end.
pub(crate) fn honeysuckle(rng: &mut impl Rng, flowers: bool) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let outline = Arc::new(Outline::ovate(0.60, 0.72));
    let wood = Vec3::new(0.130, 0.085, 0.058);
    let shoot = stalk(0.27, 0.0034, wood, rng);
    drawing.stroke(shoot);
    for pair in 0..6 {
        let t = 0.06 + 0.165 * pair as f32;
        let length = rng.range_f32(0.046, 0.064) * (1.05 - 0.6 * t);
        for side in [-1.0_f32, 1.0] {
            let direction = heading(side * rng.range_f32(0.95, 1.45));
            drawing.leaf(Leaf {
                outline: outline.clone(),
                base: shoot.at(t) + 0.003 * direction,
                direction,
                length_m: length * rng.range_f32(0.9, 1.1),
                width_m: length * rng.range_f32(0.54, 0.66),
                bend: rng.range_f32(-0.10, 0.10),
                colour: varied(HONEYSUCKLE, rng) * if t > 0.8 { 1.25 } else { 1.0 },
                veins: 0.20,
                browning: rng.range_f32(0.0, 0.12),
                level: 0.0,
            });
        }
    }
    if flowers {
        let centre = shoot.at(1.0);
        for _ in 0..9 + rng.below(5) {
            let angle = rng.range_f32(-1.9, 1.9);
            let tip = centre + rng.range_f32(0.032, 0.046) * heading(angle);
            let bend = 0.6 * (tip - centre) + 0.004 * heading(angle + 1.6);
            // Flushed with red in the bud, cream when open, then yellow.
            let age = rng.unit_f32();
            let colour = CREAM.lerp(Vec3::new(0.56, 0.42, 0.13), age);
            drawing.stroke(Stroke {
                points: [centre, centre + bend, tip],
                width_m: [0.0022, 0.0055],
                colour: [Vec3::new(0.40, 0.20, 0.15), colour],
                level: 0.0,
            });
        }
    }
    drawing
}

/// Resin that ran from a wound in the bark and dried, some 0.2 m long; the wound is at its foot.
/// The bark shows between the grains of the crust and between the runs.
pub(crate) fn resin(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let amber = Vec3::new(0.22, 0.115, 0.035);
    for _ in 0..34 {
        let spread = Vec2::new(rng.range_f32(-1.0, 1.0), rng.range_f32(-1.0, 1.0));
        let from = Vec2::new(0.0, 0.016) + spread * spread.length() * Vec2::new(0.009, 0.012);
        let to = from + Vec2::new(rng.range_f32(-0.002, 0.002), rng.range_f32(0.002, 0.006));
        let colour = RESIN.lerp(amber, 0.6 * rng.unit_f32()) * rng.range_f32(0.6, 1.25);
        drawing.stroke(Stroke::straight(from, to, [0.0035, 0.002], colour));
    }
    for _ in 0..2 + rng.below(3) {
        let from = Vec2::new(rng.range_f32(-0.008, 0.008), 0.018);
        let length = 0.03 + 0.17 * rng.unit_f32() * rng.unit_f32();
        let tip = from + Vec2::new(rng.range_f32(-0.008, 0.008), length);
        let colour = RESIN.lerp(amber, rng.unit_f32()) * rng.range_f32(0.7, 1.1);
        let sway = Vec2::new(rng.range_f32(-0.004, 0.004), 0.5 * length);
        drawing.stroke(Stroke {
            points: [from, from + sway, tip],
            width_m: [0.0045, 0.0022],
            colour: [RESIN, colour],
            level: 0.0,
        });
        // It ends in a drop.
        let drop = tip + Vec2::new(0.0, 0.003);
        drawing.stroke(Stroke::straight(tip, drop, [0.005, 0.004], colour * 0.8));
    }
    drawing
}
