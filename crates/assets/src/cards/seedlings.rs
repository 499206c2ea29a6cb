//! Foliage of tree seedlings: single leaves, and shoots of young needles.

use glam::Vec2;
use nemoral_seed::{Draw, Rng};

use super::card_raster::CardDrawing;
use super::foliage::{Painter, heading, stalk, varied};
use crate::textures::canvas::Stroke;
use crate::tree::{LeafKind, LeafLook};

/// Number of images of each species. For conifers they are shoots of different lengths, so that
/// needles keep nearly the same size on a shoot of any length.
pub(crate) const VARIANTS: usize = 3;
const SHOOTS_M: [f32; VARIANTS] = [0.035, 0.065, 0.11];

/// The longest needle of a seedling, metres. Pines begin with needles of 2-5 cm, whatever length
/// they have as trees (this value is our choice in that range). Needles of other conifers, which
/// are shorter, are a fifth shorter than those of a tree.
const NEEDLE_M: f32 = 0.045;

/// Distance between two needles of a shoot, metres, for needles of the greatest length; shorter
/// needles are closer together.
const PITCH_M: f32 = 0.0016;
const PITCHED_M: f32 = 0.03;

/// The image of a leaf on its stalk, or of a shoot with needles, as large as they grow.
pub(crate) fn draw(look: &LeafLook, variant: usize, rng: &mut impl Rng) -> CardDrawing {
    let painter = Painter::new(look);
    match look.kind {
        LeafKind::NeedleTuft | LeafKind::NeedleSpray => {
            painter.young_shoot(SHOOTS_M[variant % VARIANTS], rng)
        }
        LeafKind::LeafSpray | LeafKind::LeafRosettes | LeafKind::HangingLeaves => {
            painter.single_leaf(rng)
        }
    }
}

impl Painter<'_> {
    /// A leaf in the open, with nothing before it.
    fn single_leaf(&self, rng: &mut impl Rng) -> CardDrawing {
        let mut drawing = CardDrawing::default();
        let leaf = self.leaf(Vec2::ZERO, Vec2::Y, 1.0, rng);
        drawing.stalked(leaf);
        drawing
    }

    /// Needles on all sides of a green shoot, that close over its bud.
    fn young_shoot(&self, shoot_m: f32, rng: &mut impl Rng) -> CardDrawing {
        let mut drawing = CardDrawing::default();
        let shoot = stalk(shoot_m, 0.0022, self.wood.lerp(self.green, 0.5), rng);
        let longest = self.look.length_m[1] as f32;
        let young = (NEEDLE_M / longest).min(0.8);
        let pitch_m = PITCH_M * (young * longest / PITCHED_M).clamp(0.5, 1.0);
        let needles = (shoot_m / pitch_m) as u32;
        for i in 0..needles {
            // The shoot is drawn once half of the needles are behind it.
            if i == needles / 2 {
                drawing.stroke(shoot);
            }
            let t = rng.unit_f32();
            let base = shoot.at(t);
            let angle = rng.range_f32(-1.0, 1.0) * (1.25 - 0.65 * t * t);
            let length = young * self.length_m(rng);
            // Young needles are as wide as old ones, but not wider than a millimetre and a half.
            let width = (self.ratio(rng) * self.length_m(rng)).min(0.0015);
            let shade = 0.72 + 0.28 * i as f32 / needles as f32;
            let green = varied(self.green, rng) * shade;
            drawing.stroke(Stroke {
                points: [
                    base,
                    base + 0.5 * length * heading(1.1 * angle),
                    base + length * heading(0.9 * angle),
                ],
                width_m: [width, 0.6 * width],
                colour: [0.8 * green, green],
                level: 0.0,
            });
        }
        drawing
    }
}
