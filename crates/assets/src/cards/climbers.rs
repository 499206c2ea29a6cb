//! What grows on stems: ivy, and cushions of moss.

use std::f32::consts::TAU;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Rng};

use super::card_raster::CardDrawing;
use super::foliage::{heading, stalk, varied};
use crate::textures::canvas::{Leaf, Outline, Stroke};

/// Reflectance of ivy's leaves, whose wax makes them dark.
pub(crate) const IVY: Vec3 = Vec3::new(0.050, 0.088, 0.034);
/// Reflectance of moss on bark.
pub(crate) const MOSS: Vec3 = Vec3::new(0.060, 0.095, 0.028);

/// A shoot of ivy some 0.22 m long: leaves of five lobes at both sides, the lowest first, one over
/// the other.
pub(crate) fn ivy(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let outline = Arc::new(Outline::new(|t| {
        // A broad foot with two lobes, and a longer one ahead.
        let foot = libm::exp(-libm::pow((t - 0.20) / 0.13, 2.0));
        let side = 0.78 * libm::exp(-libm::pow((t - 0.46) / 0.12, 2.0));
        let ahead = 0.50 * libm::pow((1.0 - t).max(0.0), 0.75);
        let root = (t / 0.06).min(1.0);
        root * foot.max(side).max(ahead)
    }));
    let green = Vec3::new(0.075, 0.085, 0.040);
    let shoot = stalk(0.20, 0.004, green, rng);
    drawing.stroke(shoot);
    let count = 11 + rng.below(4);
    for i in 0..count {
        let t = 0.02 + 0.96 * i as f32 / count as f32;
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let from = shoot.at(t);
        let angle = side * rng.range_f32(0.45, 1.5);
        let reach = rng.range_f32(0.018, 0.038);
        let base = from + reach * heading(angle);
        drawing.stroke(Stroke::straight(from, base, [0.0018; 2], green));
        let length = rng.range_f32(0.040, 0.066) * (1.1 - 0.35 * t);
        let mut colour = varied(IVY, rng);
        if t > 0.8 {
            // The youngest leaves are light.
            colour *= 1.5;
        }
        drawing.leaf(Leaf {
            outline: outline.clone(),
            base,
            direction: heading(0.75 * angle + rng.range_f32(-0.3, 0.3)),
            length_m: length,
            width_m: length * rng.range_f32(0.95, 1.15),
            bend: rng.range_f32(-0.05, 0.05),
            colour,
            // Ivy is known by its pale veins.
            veins: 0.42,
            browning: 0.03,
            level: 0.0,
        });
    }
    drawing
}

/// Moss some 0.14 m wide: small cushions of shoots of half a centimetre, which merge in the middle
/// and stand apart at the border, and are longer up and down the stem than across.
pub(crate) fn moss(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let centre = Vec2::new(0.0, 0.07);
    for _ in 0..24 {
        let off = rng.unit_f32();
        let way = rng.range_f32(0.0, TAU);
        let middle = centre + 0.060 * off * Vec2::new(libm::cosf(way), libm::sinf(way));
        let size = rng.range_f32(0.006, 0.019) * (1.0 - 0.6 * off);
        let tone = rng.range_f32(0.75, 1.2);
        for _ in 0..(2.2e5 * size * size) as u32 + 5 {
            let r = size * rng.unit_f32().sqrt();
            let angle = rng.range_f32(0.0, TAU);
            let from = middle + r * Vec2::new(0.8 * libm::cosf(angle), 1.3 * libm::sinf(angle));
            let way = heading(rng.range_f32(-2.2, 2.2));
            let colour = varied(MOSS, rng) * (tone * rng.range_f32(0.6, 1.3));
            drawing.stroke(Stroke::straight(
                from,
                from + way * rng.range_f32(0.003, 0.007),
                [0.0034, 0.0014],
                colour,
            ));
        }
    }
    drawing
}
