//! Turns and sizes of copies of a tree, chosen so that no two near each other look alike.

use std::f64::consts::TAU;

use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};

const VARIATION: Domain = Domain::new("pipeline.looks");

/// How the plane is divided among the variations of one kind of plant.
#[derive(Clone, Copy, Debug)]
struct Grid {
    /// Side of the squares that the plane is cut into. Two trees that stand nearer to each other
    /// than its diagonal may share a variation.
    square_m: f64,
    /// The pattern repeats after this number of squares: two squares with the same variation have
    /// 30 m between them.
    squares: i64,
    /// The number of directions, each of which has its share of the circle.
    turns: u16,
    /// The number of sizes. Directions times sizes are at least as many as the pattern's squares.
    sizes: u16,
    /// The part of a direction's and of a size's share that is left free between two of them.
    free: [f64; 2],
}

/// Between two directions 2.1° are free, and between two sizes 0.56 % of trees that are a tenth
/// larger or smaller.
const TREES: Grid = Grid {
    square_m: 0.75,
    squares: 41,
    turns: 120,
    sizes: 15,
    free: [0.7, 0.42],
};

/// Saplings stand 0.3 m apart in clusters, and are of many sizes. Between two directions 2.002° are
/// free, and between two sizes, by the law of [`SAPLING_SIZES`], 0.504 %.
const SAPLINGS: Grid = Grid {
    square_m: 0.2,
    squares: 151,
    turns: 178,
    sizes: 129,
    free: [0.99, 0.985],
};

/// The logarithm of a sapling's scale by its place p among sizes, 0..1, is -(a p + b p²), so that
/// two places a 129th apart always differ enough, even near the largest.
const SAPLING_SIZES: [f64; 2] = [0.66, 0.39];

/// The scale of a plant that is no sapling by its place among sizes, 0..1: up to a tenth either
/// way. More would not fit the proportions of a tree to its age.
#[must_use]
pub fn grown_scale(place: f64) -> f64 {
    0.9 + 0.2 * place
}

/// The scale of a sapling by its place among sizes, 0..1. There are many small ones, as
/// regeneration thins itself out while it grows (an assumption).
#[must_use]
pub fn sapling_scale(place: f64) -> f64 {
    let [a, b] = SAPLING_SIZES;
    libm::exp(-(a * place + b * place * place))
}

/// Patterns of variations over the plane, of grown trees and of saplings.
///
/// A tree is recognised by its branches, and so is a copy of the same size and turn. By chance one
/// pair in 2,000 would be such a pair; here there is none within 30 m.
#[derive(Clone, Debug)]
pub struct InstanceVariation {
    /// The pattern of grown trees.
    pub trees: VariationPattern,
    /// The pattern of saplings, which stand nearer to each other and have more sizes.
    pub saplings: VariationPattern,
}

impl InstanceVariation {
    /// The patterns of a world.
    #[must_use]
    pub fn new(world: Key) -> Self {
        let key = world.domain(VARIATION);
        Self {
            trees: VariationPattern::new(TREES, key),
            saplings: VariationPattern::new(SAPLINGS, key.item(1)),
        }
    }
}

/// The variations of the squares of the plane.
#[derive(Clone, Debug)]
pub struct VariationPattern {
    grid: Grid,
    /// The variation of each square of the pattern, row by row.
    of_square: Vec<u16>,
}

/// The turn of a tree and its place among sizes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variation {
    /// The turn about the vertical, radians in `[0, 2π)`.
    pub yaw_rad: f64,
    /// The place among sizes, 0..1; see [`grown_scale`] and [`sapling_scale`].
    pub size: f64,
}

impl VariationPattern {
    fn new(grid: Grid, key: Key) -> Self {
        let mut of_square: Vec<u16> = (0..grid.turns * grid.sizes).collect();
        let mut rng = key.rng();
        // The shuffle of Fisher and Yates.
        for i in (1..of_square.len()).rev() {
            of_square.swap(i, rng.below(i as u32 + 1) as usize);
        }
        Self { grid, of_square }
    }

    /// The variation of a tree that stands at a world position, metres; two numbers are drawn.
    pub fn at(&self, position_m: DVec2, rng: &mut impl Draw) -> Variation {
        let Grid {
            square_m,
            squares,
            turns,
            sizes,
            free,
        } = self.grid;
        let square = |m: f64| ((m / square_m).floor() as i64).rem_euclid(squares);
        let i = square(position_m.x) + squares * square(position_m.y);
        let slot = self.of_square[i as usize];
        let place = |slot: u16, free: f64, within: f64, of: u16| {
            (f64::from(slot) + (1.0 - free) * within) / f64::from(of)
        };
        Variation {
            yaw_rad: TAU * place(slot % turns, free[0], rng.unit_f64(), turns),
            size: place(slot / turns, free[1], rng.unit_f64(), sizes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Trees nearer than this are turned, or sized, differently.
    const APART_M: f64 = 30.0;

    /// Whether two trees are recognised as copies of each other.
    fn alike(a: Variation, b: Variation, scale: fn(f64) -> f64) -> bool {
        let turned = (a.yaw_rad - b.yaw_rad).abs();
        let larger = scale(a.size) / scale(b.size);
        let size = (larger - 1.0).abs().min((1.0 / larger - 1.0).abs());
        turned.min(TAU - turned) < 2_f64.to_radians() && size < 0.005
    }

    fn check(
        pattern: &VariationPattern,
        at: DVec2,
        to: DVec2,
        scale: fn(f64) -> f64,
    ) -> Result<(), TestCaseError> {
        let mut rng = Key::world(1).rng();
        let [a, b] = [at, at + to].map(|p| pattern.at(p, &mut rng));
        prop_assert!(!alike(a, b, scale), "{a:?} {b:?}");
        Ok(())
    }

    proptest! {
        #[test]
        fn none_within_30_m_are_alike(
            seed: u64, x in -1e4..1e4, y in -1e4..1e4, turn in 0.0..TAU, r in 1.07..APART_M,
            near in 0.284..2.0,
        ) {
            let variation = InstanceVariation::new(Key::world(seed));
            let (at, way) = (DVec2::new(x, y), DVec2::from_angle(turn));
            check(&variation.trees, at, way * r, grown_scale)?;
            check(&variation.saplings, at, way * r, sapling_scale)?;
            check(&variation.saplings, at, way * near, sapling_scale)?;
        }
    }

    #[test]
    fn no_two_squares_within_30_m_share_a_variation() {
        for grid in [TREES, SAPLINGS] {
            assert!((grid.squares - 1) as f64 * grid.square_m >= APART_M);
            assert!(i64::from(grid.turns) * i64::from(grid.sizes) >= grid.squares * grid.squares);
            assert!(360.0 / f64::from(grid.turns) * grid.free[0] > 2.0);
        }
        // The least difference of consecutive sizes.
        let nearest = |grid: Grid, scale: fn(f64) -> f64| {
            let (n, free) = (f64::from(grid.sizes), grid.free[1]);
            (1..grid.sizes)
                .map(|k| scale((f64::from(k) - free) / n) / scale(f64::from(k) / n))
                .fold(f64::INFINITY, |m, r| m.min((r - 1.0).abs()))
        };
        let found = [
            nearest(TREES, grown_scale),
            nearest(SAPLINGS, sapling_scale),
        ];
        assert!(found.iter().all(|&r| r > 0.005), "{found:?}");
    }

    #[test]
    fn all_directions_and_sizes_are_there() {
        let variation = InstanceVariation::new(Key::world(7));
        let mut rng = Key::world(8).rng();
        let all: Vec<Variation> = (0..10_000)
            .map(|i| {
                let place = DVec2::new(f64::from(i % 100), f64::from(i / 100)) * 3.1;
                variation.trees.at(place, &mut rng)
            })
            .collect();
        for part in 0..8 {
            let within = |v: f64| (8.0 * v) as usize == part;
            let turned = all.iter().filter(|l| within(l.yaw_rad / TAU)).count();
            let sized = all.iter().filter(|l| within(l.size)).count();
            assert!((1050..1450).contains(&turned) && (1050..1450).contains(&sized));
        }
    }

    #[test]
    fn value_stability() {
        let variation = InstanceVariation::new(Key::world(7));
        let at = |pattern: &VariationPattern| {
            let found = pattern.at(DVec2::new(12.3, -45.6), &mut Key::world(9).rng());
            (found.yaw_rad, found.size)
        };
        assert_eq!(
            at(&variation.trees),
            (0.213_416_704_186_122_07, 0.672_406_710_321_870_8)
        );
        assert_eq!(
            at(&variation.saplings),
            (6.000_884_331_439_982, 0.860_482_377_837_776_4)
        );
    }
}
