//! What the season makes of a drawing.

use glam::Vec3;
use nemoral_seed::{Draw, Key};

use super::card_raster::{CardDrawing, Mark};
use crate::textures::canvas::{Leaf, Stroke};
use crate::textures::tile::luminance;
use crate::tree::SeasonalLeaves;

/// How much narrower a withered leaf is, as it has rolled in from its sides.
const ROLLED_IN: f32 = 0.3;

impl CardDrawing {
    /// The drawing with its leaves as they are in their season, where `green` is the mean colour
    /// that they are drawn in. Twigs stay. Each leaf has a draw of its own from the key.
    pub(crate) fn in_season(&self, leaves: &SeasonalLeaves, green: Vec3, key: Key) -> Self {
        let in_season = |(i, mark): (usize, &Mark)| match mark {
            Mark::Stalked(stalk, leaf) => {
                let mut rng = key.item(i as u64).rng();
                let now = leaves.leaf(rng.unit_f64(), rng.normal())?;
                let albedo = Vec3::from(now.albedo.map(|c| c as f32));
                // Leaves differ in shade as they did, and in hue the less the more they turn.
                let shade = luminance(leaf.colour) / luminance(green);
                let colour = leaf.colour + (albedo - green) * shade;
                let leaf = Leaf {
                    length_m: leaf.length_m * now.size,
                    width_m: leaf.width_m * now.size * (1.0 - ROLLED_IN * now.withered),
                    colour: colour.max(Vec3::splat(0.01)),
                    ..leaf.clone()
                };
                Some(Mark::Stalked(*stalk, leaf))
            }
            twig => Some(twig.clone()),
        };
        let marks: Vec<Mark> = self
            .marks
            .iter()
            .enumerate()
            .filter_map(in_season)
            .collect();
        if marks.is_empty() {
            // A leaf without a twig leaves its stalk.
            return Self {
                marks: self.stalks().map(Mark::Stroke).collect(),
            };
        }
        Self { marks }
    }

    fn stalks(&self) -> impl Iterator<Item = Stroke> {
        self.marks.iter().filter_map(|mark| match mark {
            Mark::Stalked(stalk, _) => Some(*stalk),
            _ => None,
        })
    }

    /// Whether any leaf is there.
    pub(crate) fn has_leaves(&self) -> bool {
        let is_leaf = |mark: &Mark| matches!(mark, Mark::Stalked(..) | Mark::Leaf(_));
        self.marks.iter().any(is_leaf)
    }
}
