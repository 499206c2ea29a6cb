//! What has fallen from a stand's trees and is painted on the ground: their needles and leaves.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Rng};

use super::canvas::{Canvas, Leaf, Outline, Stroke};
use super::tile::luminance;
use crate::tree::{LeafLook, Species};

/// A unit vector in a uniform direction, by rejection: no trigonometry.
pub(crate) fn direction(rng: &mut impl Rng) -> Vec2 {
    loop {
        let p = Vec2::new(rng.range_f32(-1.0, 1.0), rng.range_f32(-1.0, 1.0));
        let l = p.length_squared();
        if (1e-4..=1.0).contains(&l) {
            return p / l.sqrt();
        }
    }
}

/// A uniform place on a square tile.
pub(super) fn anywhere(rng: &mut impl Rng, size_m: f32) -> Vec2 {
    Vec2::new(rng.range_f32(0.0, size_m), rng.range_f32(0.0, size_m))
}

/// The dead needles of a species.
#[derive(Clone, Copy, Debug)]
struct FallenNeedle {
    /// Least and greatest length, metres.
    length_m: [f32; 2],
    /// Mean width, metres.
    width_m: f32,
}

/// The dead leaves of a species.
#[derive(Clone, Debug)]
pub(crate) struct FallenLeaf {
    pub(crate) outline: Arc<Outline>,
    /// Least and greatest length, metres.
    pub(crate) length_m: [f32; 2],
    /// Least and greatest width over length, before they dried.
    pub(crate) width_ratio: [f32; 2],
}

/// Kinds, and how frequent each is.
#[derive(Clone, Debug)]
struct Shares<T> {
    kinds: Vec<T>,
    weights: Vec<f64>,
}

/// The fallen needles and leaves of a stand's trees, the more of a species the more trees of it
/// there are.
#[derive(Clone, Debug)]
pub(crate) struct FallenFoliage {
    needles: Shares<FallenNeedle>,
    leaves: Shares<FallenLeaf>,
    /// The share of the trees that have broad leaves.
    broadleaved: f32,
}

/// Fallen leaf colours, from just fallen to rotten.
const LEAVES: [Vec3; 6] = [
    Vec3::new(0.235, 0.150, 0.090),
    Vec3::new(0.190, 0.105, 0.058),
    Vec3::new(0.150, 0.089, 0.060),
    Vec3::new(0.215, 0.165, 0.115),
    Vec3::new(0.120, 0.072, 0.045),
    Vec3::new(0.085, 0.058, 0.040),
];

impl<T> Shares<T> {
    fn of(shares: impl Iterator<Item = (T, f64)>) -> Self {
        let (kinds, weights) = shares.unzip();
        Self { kinds, weights }
    }

    /// One of the kinds, by how frequent they are; there is at least one.
    fn draw(&self, rng: &mut impl Rng) -> &T {
        &self.kinds[rng.weighted(&self.weights).unwrap_or(0)]
    }

    /// The kind at this rank (0..=1) of all there is, where it lies in a row, kind by kind.
    fn at_rank(&self, rank: f64) -> &T {
        let mut left = rank * self.weights.iter().sum::<f64>();
        let found = self.weights.iter().position(|weight| {
            left -= weight;
            left < 0.0
        });
        &self.kinds[found.unwrap_or(self.kinds.len() - 1)]
    }

    fn mean(&self, of: impl Fn(&T) -> f32) -> f32 {
        let values = self.kinds.iter().zip(&self.weights);
        let sum: f64 = values.map(|(kind, w)| f64::from(of(kind)) * w).sum();
        (sum / self.weights.iter().sum::<f64>()) as f32
    }
}

impl FallenNeedle {
    /// Bits of twigs and stalks of leaves, which lie where there are no needles.
    const BIT: Self = Self {
        length_m: [0.015, 0.05],
        width_m: 0.0015,
    };

    fn of(look: &LeafLook) -> Self {
        let [a, b] = look.length_m.map(|m| m as f32);
        let ratio = look.width_ratio.map(|r| r as f32);
        Self {
            length_m: [a, b],
            width_m: 0.25 * (a + b) * (ratio[0] + ratio[1]),
        }
    }
}

impl FallenLeaf {
    fn of(look: &LeafLook) -> Self {
        Self {
            outline: Arc::new(Outline::of(look)),
            length_m: look.length_m.map(|m| m as f32),
            width_ratio: look.width_ratio.map(|r| r as f32),
        }
    }

    /// Those of bramble, bilberry and herbs, which are all there is under conifers alone.
    pub(crate) fn of_undergrowth() -> Self {
        Self {
            outline: Arc::new(Outline::ovate(0.9, 0.8)),
            length_m: [0.03, 0.065],
            width_ratio: [0.5, 0.65],
        }
    }

    /// Length times width of a middling one, m².
    fn box_m2(&self) -> f32 {
        let [length_m, ratio] = [self.length_m, self.width_ratio].map(|[a, b]| 0.5 * (a + b));
        length_m * length_m * ratio
    }
}

impl FallenFoliage {
    /// That of species with so many trees each, relative to each other; equally many if there are
    /// none.
    pub(crate) fn of(species: &[Species], trees: &[f64]) -> Self {
        let any = trees.iter().any(|n| *n > 0.0);
        let stand: Vec<(&LeafLook, f64)> = (species.iter().zip(trees))
            .map(|(s, n)| (&s.leaves, if any { *n } else { 1.0 }))
            .filter(|(_, n)| *n > 0.0)
            .collect();
        let of_kind = |needles: bool| {
            let stand = stand.iter();
            stand.filter(move |(look, _)| look.kind.is_needle() == needles)
        };
        let broadleaved = of_kind(false).map(|(_, n)| n).sum::<f64>();
        let conifers = of_kind(true).map(|(_, n)| n).sum::<f64>();
        let mut needles = Shares::of(of_kind(true).map(|(look, n)| (FallenNeedle::of(look), *n)));
        if needles.kinds.is_empty() {
            needles = Shares::of(std::iter::once((FallenNeedle::BIT, 1.0)));
        }
        let mut leaves = Shares::of(of_kind(false).map(|(look, n)| (FallenLeaf::of(look), *n)));
        if leaves.kinds.is_empty() {
            leaves = Shares::of(std::iter::once((FallenLeaf::of_undergrowth(), 1.0)));
        }
        Self {
            needles,
            leaves,
            broadleaved: (broadleaved / (broadleaved + conifers).max(f64::MIN_POSITIVE)) as f32,
        }
    }

    /// The kind of leaf at this rank (0..=1) among all, species by species.
    pub(crate) fn leaf_at_rank(&self, rank: f64) -> &FallenLeaf {
        self.leaves.at_rank(rank)
    }

    /// How many leaves lie on ground that would have `leaves` under broadleaved trees alone: under
    /// conifers there are those of the undergrowth and what the wind brings.
    pub(super) fn scattered(&self, leaves: f32) -> f32 {
        leaves * self.broadleaved.max(0.1)
    }

    /// How many times as many of the needles cover the ground as of the long ones of maritime pine.
    pub(super) fn needle_density(&self) -> f32 {
        const LONG_M: f32 = 0.12;
        let mean_m = (self.needles).mean(|of| 0.5 * (of.length_m[0] + of.length_m[1]));
        (LONG_M / mean_m).clamp(1.0, 6.0)
    }

    /// How many times as many of the leaves cover the ground as of leaves between a beech's and an
    /// oak's.
    pub(super) fn leaf_density(&self) -> f32 {
        const MIDDLING_M2: f32 = 0.004;
        (MIDDLING_M2 / self.leaves.mean(FallenLeaf::box_m2)).clamp(0.6, 3.0)
    }

    /// Strews `count` needles over a tile, the oldest first.
    pub(super) fn strew_needles(
        &self,
        canvas: &mut Canvas,
        size_m: f32,
        count: u32,
        rng: &mut impl Rng,
    ) {
        for i in 0..count {
            let FallenNeedle { length_m, width_m } = *self.needles.draw(rng);
            let from = anywhere(rng, size_m);
            let along = direction(rng);
            let length = rng.range_f32(length_m[0], length_m[1]);
            let side = along.perp() * length * rng.range_f32(-0.1, 0.1);
            let age = 1.0 - i as f32 / count as f32;
            let fresh =
                Vec3::new(0.225, 0.120, 0.062).lerp(Vec3::new(0.24, 0.165, 0.105), rng.unit_f32());
            let colour =
                fresh.lerp(Vec3::new(0.085, 0.055, 0.037), 0.75 * age) * rng.range_f32(0.7, 1.2);
            let width_m = width_m.clamp(0.0012, 0.0025);
            canvas.stroke(&Stroke {
                points: Stroke::bowed(from, length * along, side),
                width_m: [width_m, 0.6 * width_m],
                colour: [colour; 2],
                level: 0.012 * (1.0 - age),
            });
        }
    }

    /// Strews `count` leaves over a tile, the oldest first; they are `scale` times as long as whole
    /// ones.
    pub(super) fn strew_leaves(
        &self,
        canvas: &mut Canvas,
        (size_m, scale): (f32, f32),
        count: u32,
        rng: &mut impl Rng,
    ) {
        for i in 0..count {
            let age = 1.0 - i as f32 / count as f32;
            canvas.leaf(&self.lying_leaf((size_m, scale), age, rng));
        }
    }

    /// A leaf somewhere on a tile; `age` is from 0, on top, to 1. Leaves of one species differ by
    /// their size, their colour, the side that is up, and how they have rolled in as they dried.
    fn lying_leaf(&self, (size_m, scale): (f32, f32), age: f32, rng: &mut impl Rng) -> Leaf {
        let of = self.leaves.draw(rng);
        let length_m = scale * rng.range_f32(of.length_m[0], of.length_m[1]);
        let ratio = rng.range_f32(of.width_ratio[0], of.width_ratio[1]);
        let rolled = match rng.chance(0.15) {
            // Folded along its midrib, so that it lies on its edge.
            true => rng.range_f32(0.28, 0.45),
            false => rng.range_f32(0.55, 1.0),
        };
        let pick = LEAVES[rng.below(6) as usize];
        let upper = pick.lerp(LEAVES[5], 0.7 * age) * rng.range_f32(0.75, 1.25);
        // The lower side is paler, and its veins stand out.
        let (colour, veins) = match rng.chance(0.5) {
            true => (upper, 0.12),
            false => (1.1 * upper.lerp(Vec3::splat(luminance(upper)), 0.2), 0.24),
        };
        Leaf {
            outline: Arc::clone(&of.outline),
            base: anywhere(rng, size_m),
            direction: direction(rng),
            length_m,
            width_m: length_m * ratio * rolled,
            bend: rng.range_f32(-0.35, 0.35),
            colour,
            veins,
            browning: rng.range_f32(0.0, 0.4),
            level: 0.02 * (1.0 - age),
        }
    }
}

#[cfg(test)]
mod tests {
    use nemoral_seed::Key;

    use super::*;

    fn of(stand: &[(&str, f64)]) -> FallenFoliage {
        let species: Vec<Species> = stand
            .iter()
            .map(|(name, _)| Species::built_in(name).expect("is built in"))
            .collect();
        let trees: Vec<f64> = stand.iter().map(|(_, n)| *n).collect();
        FallenFoliage::of(&species, &trees)
    }

    /// 2,000 leaves of a stand.
    fn lying(stand: &[(&str, f64)]) -> Vec<Leaf> {
        let fallen = of(stand);
        let mut rng = Key::world(3).rng();
        (0..2000)
            .map(|_| fallen.lying_leaf((4.0, 1.0), 0.5, &mut rng))
            .collect()
    }

    fn own(name: &str) -> (Outline, [f32; 2]) {
        let look = Species::built_in(name).expect("is built in").leaves;
        (Outline::of(&look), look.length_m.map(|m| m as f32))
    }

    #[test]
    fn needles_are_as_long_as_the_stands() {
        let spruce = of(&[("norway_spruce", 1.0), ("beech", 1.0)]);
        assert_eq!(spruce.needles.kinds.len(), 1);
        assert!(spruce.needles.kinds[0].length_m[1] < 0.03 && spruce.needle_density() > 5.0);
        let pine = of(&[("maritime_pine", 1.0)]);
        assert!(pine.needles.kinds[0].length_m[0] > 0.1 && pine.needle_density() < 1.2);
        let none = of(&[("beech", 1.0)]);
        assert!(none.needles.kinds[0].length_m[1] <= 0.05);
        // A few spruces among pines hardly shorten the needles.
        let mixed = of(&[("norway_spruce", 0.03), ("maritime_pine", 0.97)]);
        assert!(mixed.needle_density() < 1.2, "{}", mixed.needle_density());
    }

    #[test]
    fn a_beech_stand_sheds_no_lobed_leaf() {
        let (beech, length_m) = own("beech");
        for leaf in lying(&[("beech", 240.0)]) {
            assert_eq!(*leaf.outline, beech);
            assert!((length_m[0]..=length_m[1]).contains(&leaf.length_m));
        }
        // Four of a hundred trees are oaks.
        let (oak, _) = own("english_oak");
        let all = lying(&[("english_oak", 4.0), ("beech", 96.0)]);
        let oaks = all.iter().filter(|leaf| *leaf.outline == oak).count();
        let beeches = all.iter().filter(|leaf| *leaf.outline == beech).count();
        assert_eq!(oaks + beeches, all.len());
        assert!((50..120).contains(&oaks), "{oaks}");
    }

    /// The floor of a single species is not of one leaf.
    #[test]
    fn leaves_of_a_species_differ() {
        let all = lying(&[("beech", 1.0)]);
        let spread = |of: &dyn Fn(&Leaf) -> f32| {
            let mut values: Vec<f32> = all.iter().map(of).collect();
            values.sort_by(f32::total_cmp);
            values[values.len() * 95 / 100] / values[values.len() * 5 / 100]
        };
        let length = spread(&|leaf| leaf.length_m);
        let width = spread(&|leaf| leaf.width_m / leaf.length_m);
        let light = spread(&|leaf| luminance(leaf.colour));
        assert!(
            length > 1.5 && width > 2.0 && light > 2.0,
            "{length} {width} {light}"
        );
        let below = all.iter().filter(|leaf| leaf.veins > 0.2).count();
        assert!(
            (800..1200).contains(&below),
            "{below} lie on their upper side"
        );
    }

    #[test]
    fn small_leaves_are_many_and_conifers_leave_few() {
        let [beech, birch, gum] =
            ["beech", "silver_birch", "eucalyptus"].map(|name| of(&[(name, 1.0)]));
        assert!(birch.leaf_density() > 1.5 * beech.leaf_density());
        assert!((0.6..1.4).contains(&gum.leaf_density()));
        let spruce = of(&[("norway_spruce", 0.97), ("silver_birch", 0.03)]);
        assert!(spruce.scattered(100.0) < 0.2 * beech.scattered(100.0));
        let (outline, _) = own("silver_birch");
        assert_eq!(spruce.leaves.kinds.len(), 1);
        assert_eq!(*spruce.leaves.kinds[0].outline, outline);
        // Under pines alone there are neither oaks nor gums.
        let pine = of(&[("maritime_pine", 1.0)]);
        assert_eq!(*pine.leaves.kinds[0].outline, Outline::ovate(0.9, 0.8));
        assert!(pine.leaves.kinds[0].length_m[1] < 0.07);
    }

    #[test]
    fn species_without_trees_shed_nothing() {
        let fallen = of(&[("english_oak", 0.0), ("beech", 10.0)]);
        assert_eq!(fallen.leaves.kinds.len(), 1);
        // Without any number, all species are equal.
        let all = of(&[("english_oak", 0.0), ("beech", 0.0)]);
        assert_eq!(all.leaves.kinds.len(), 2);
        let (oak, _) = own("english_oak");
        let (beech, _) = own("beech");
        assert_eq!(*all.leaf_at_rank(0.2).outline, oak);
        assert_eq!(*all.leaf_at_rank(0.8).outline, beech);
        assert_eq!(*all.leaf_at_rank(1.0).outline, beech);
    }
}
