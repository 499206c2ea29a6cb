//! What trees shed, as it lies on the ground: single dead leaves, and mats of dead needles.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Rng};

use super::card_raster::{CardDrawing, TWIG_TEXELS};
use super::foliage::{Painter, heading, varied};
use crate::textures::canvas::Stroke;
use crate::tree::{LeafKind, LeafLook, LitterLook};

/// Images of each species.
pub(crate) const VARIANTS: usize = 5;

/// The colours of the images relative to a species' mean: just fallen, dull, bleached, browned,
/// damp and rotting.
pub(crate) const TINTS: [Vec3; VARIANTS] = [
    Vec3::new(1.22, 1.10, 0.88),
    Vec3::new(0.98, 0.98, 1.0),
    Vec3::new(1.18, 1.24, 1.36),
    Vec3::new(0.82, 0.76, 0.70),
    Vec3::new(0.56, 0.53, 0.52),
];

/// The share of the area of a mat that its needles cover.
const NEEDLES: f32 = 0.36;

/// The pieces that an image is cut into, so that it can be bent: two of a leaf, one of a mat.
pub(crate) fn slices(look: &LeafLook) -> usize {
    match look.kind {
        LeafKind::NeedleTuft | LeafKind::NeedleSpray => 1,
        _ => 2,
    }
}

/// Texels along the longer side of a piece: half a millimetre each, or one of a mat.
pub(crate) fn texels(look: &LeafLook) -> usize {
    match look.kind {
        LeafKind::NeedleTuft | LeafKind::NeedleSpray => TWIG_TEXELS,
        _ => TWIG_TEXELS / 2,
    }
}

/// The image of a leaf on its stalk, or of a mat of needles.
pub(crate) fn draw(look: &LeafLook, litter: &LitterLook, rng: &mut impl Rng) -> CardDrawing {
    let dead = LeafLook {
        albedo: litter.albedo,
        glaucous: 0.0,
        ..*look
    };
    let painter = Painter::new(&dead);
    match look.kind {
        LeafKind::NeedleTuft => painter.mat(0.15, 2, rng),
        LeafKind::NeedleSpray => painter.mat(0.10, 1, rng),
        _ => painter.dead_leaf(rng),
    }
}

impl Painter<'_> {
    fn dead_leaf(&self, rng: &mut impl Rng) -> CardDrawing {
        let mut drawing = CardDrawing::default();
        let mut leaf = self.leaf(Vec2::ZERO, Vec2::Y, 1.0, rng);
        leaf.leaf.colour = varied(self.green, rng);
        // What has dried is rolled in from its sides.
        leaf.leaf.width_m *= rng.range_f32(0.66, 1.0);
        leaf.leaf.bend += rng.range_f32(-0.16, 0.16);
        leaf.leaf.browning = rng.range_f32(0.2, 0.7);
        leaf.leaf.veins = 0.28;
        drawing.stalked(leaf);
        drawing
    }

    /// Needles that lie in all directions in a disc of a radius, so many from one sheath.
    fn mat(&self, radius_m: f32, of_sheath: u32, rng: &mut impl Rng) -> CardDrawing {
        let mut drawing = CardDrawing::default();
        let longest = self.look.length_m[1] as f32;
        let radius_m = radius_m.max(0.75 * longest);
        let centre = Vec2::new(0.0, radius_m);
        let mean_m2 = {
            let [a, b] = self.look.length_m.map(|l| l as f32);
            let length = 0.5 * (a + b);
            length * length * self.look.width_ratio[0] as f32
        };
        let wanted = NEEDLES * 0.5 * TAU * radius_m * radius_m / mean_m2;
        let count = (wanted as u32).clamp(30, 700) / of_sheath;
        for _ in 0..count {
            let reach = radius_m * rng.unit_f32().sqrt();
            let middle = centre + reach * heading(rng.range_f32(0.0, TAU));
            let angle = rng.range_f32(0.0, TAU);
            let length = self.length_m(rng) * rng.range_f32(0.7, 1.0);
            let width = self.ratio(rng) * length;
            let tone = rng.range_f32(0.55, 1.3);
            let colour = varied(self.green, rng) * tone;
            let foot = middle - 0.5 * length * heading(angle);
            for _ in 0..of_sheath {
                let turn = angle + rng.range_f32(-0.16, 0.16);
                let tip = foot + length * heading(turn);
                let sag = heading(turn).perp() * length * rng.range_f32(-0.07, 0.07);
                // A border that is cut straight would show.
                let is_inside = |p: Vec2| p.y > 0.0 && p.distance(centre) < radius_m;
                if is_inside(foot) && is_inside(tip) {
                    drawing.stroke(Stroke {
                        points: [foot, 0.5 * (foot + tip) + sag, tip],
                        width_m: [width, 0.7 * width],
                        colour: [colour, 0.9 * colour],
                        level: 0.0,
                    });
                }
            }
        }
        drawing
    }
}
