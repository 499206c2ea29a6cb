//! How copies of a tree are turned and sized: no two that stand near each other look alike.

use std::f64::consts::TAU;

use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};

const LOOKS: Domain = Domain::new("pipeline.looks");

/// What tells copies of one kind apart.
#[derive(Clone, Copy, Debug)]
struct Grid {
    /// Of the squares that the plane is cut into: nearer than its diagonal, two trees may share a look.
    square_m: f64,
    /// The pattern repeats after so many squares: two squares with the same look have 30 m between them.
    squares: i64,
    /// There are so many directions, each in its share of the circle, ...
    turns: u16,
    /// ... and so many sizes; together, as many as squares, or more.
    sizes: u16,
    /// What is left free between two directions and two sizes, of the share of each.
    free: [f64; 2],
}

/// Free are 2.1° and 0.56 % of trees a tenth larger or smaller.
const TREES: Grid = Grid {
    square_m: 0.75,
    squares: 41,
    turns: 120,
    sizes: 15,
    free: [0.7, 0.42],
};

/// Saplings stand 0.3 m apart in clusters, and are of many sizes. Free are 2.002° and, as [`SAPLING_SIZES`] has them, 0.504 %.
const SAPLINGS: Grid = Grid {
    square_m: 0.2,
    squares: 151,
    turns: 178,
    sizes: 129,
    free: [0.99, 0.985],
};

/// Logarithm of a sapling's scale by its place p among sizes, 0..1: -(a p + b p²), so that neither two places
/// a 129th apart nor any nearer to the largest are too much alike.
const SAPLING_SIZES: [f64; 2] = [0.66, 0.39];

/// The scale of a grown tree by its place among sizes, 0..1, as of all that is not a sapling: a tenth either way; more
/// would change a tree's proportions to its age.
pub(super) fn grown_scale(place: f64) -> f64 {
    0.9 + 0.2 * place
}

/// The scale of a sapling: small ones are many, as regeneration thins itself out while it grows (our choice).
pub(super) fn sapling_scale(place: f64) -> f64 {
    let [a, b] = SAPLING_SIZES;
    libm::exp(-(a * place + b * place * place))
}

/// Patterns of looks over the plane, of grown trees and of saplings.
///
/// A tree is recognised by its branches: its copy, equally large and turned alike, by anybody. Drawn by
/// chance, one pair in 2,000 is such a pair; here none is within 30 m.
#[derive(Debug)]
pub(super) struct Looks {
    pub(super) trees: Pattern,
    pub(super) saplings: Pattern,
}

impl Looks {
    pub(super) fn new(world: Key) -> Self {
        let key = world.domain(LOOKS);
        Self {
            trees: Pattern::new(TREES, key),
            saplings: Pattern::new(SAPLINGS, key.item(1)),
        }
    }
}

/// Which square has which look.
#[derive(Debug)]
pub(super) struct Pattern {
    grid: Grid,
    /// The look of each square of the pattern, row by row.
    of_square: Vec<u16>,
}

/// How a tree is turned, and its place among sizes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    pub(super) yaw_rad: f64,
    /// 0..1.
    pub(super) size: f64,
}

impl Pattern {
    fn new(grid: Grid, key: Key) -> Self {
        let mut of_square: Vec<u16> = (0..grid.turns * grid.sizes).collect();
        let mut rng = key.rng();
        // Fisher and Yates.
        for i in (1..of_square.len()).rev() {
            of_square.swap(i, rng.below(i as u32 + 1) as usize);
        }
        Self { grid, of_square }
    }

    /// The look of a tree that stands here; two numbers are drawn.
    pub(super) fn at(&self, position_m: DVec2, rng: &mut impl Draw) -> Look {
        let Grid {
            square_m,
            squares,
            turns,
            sizes,
            free,
        } = self.grid;
        let square = |m: f64| ((m / square_m).floor() as i64).rem_euclid(squares);
        let i = square(position_m.x) + squares * square(position_m.y);
        let look = self.of_square[i as usize];
        let place = |slot: u16, free: f64, within: f64, of: u16| {
            (f64::from(slot) + (1.0 - free) * within) / f64::from(of)
        };
        Look {
            yaw_rad: TAU * place(look % turns, free[0], rng.unit_f64(), turns),
            size: place(look / turns, free[1], rng.unit_f64(), sizes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Trees nearer than this are turned, or sized, differently.
    const APART_M: f64 = 30.0;

    /// Of any two within 30 m.
    fn alike(a: Look, b: Look, scale: fn(f64) -> f64) -> bool {
        let turned = (a.yaw_rad - b.yaw_rad).abs();
        let larger = scale(a.size) / scale(b.size);
        let size = (larger - 1.0).abs().min((1.0 / larger - 1.0).abs());
        turned.min(TAU - turned) < 2_f64.to_radians() && size < 0.005
    }

    fn check(
        pattern: &Pattern,
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
            seed: u64, x in -1e4..1e4, y in -1e4..1e4, turn in 0.0..TAU, r in 1.07..APART_M, near in 0.284..2.0,
        ) {
            let looks = Looks::new(Key::world(seed));
            let (at, way) = (DVec2::new(x, y), DVec2::from_angle(turn));
            check(&looks.trees, at, way * r, grown_scale)?;
            check(&looks.saplings, at, way * r, sapling_scale)?;
            check(&looks.saplings, at, way * near, sapling_scale)?;
        }
    }

    #[test]
    fn no_two_squares_within_30_m_share_a_look() {
        for grid in [TREES, SAPLINGS] {
            assert!((grid.squares - 1) as f64 * grid.square_m >= APART_M);
            assert!(i64::from(grid.turns) * i64::from(grid.sizes) >= grid.squares * grid.squares);
            assert!(360.0 / f64::from(grid.turns) * grid.free[0] > 2.0);
        }
        // Sizes that follow each other, at their nearest.
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
        let looks = Looks::new(Key::world(7));
        let mut rng = Key::world(8).rng();
        let all: Vec<Look> = (0..10_000)
            .map(|i| {
                let place = DVec2::new(f64::from(i % 100), f64::from(i / 100)) * 3.1;
                looks.trees.at(place, &mut rng)
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
        let looks = Looks::new(Key::world(7));
        let at = |pattern: &Pattern| {
            let look = pattern.at(DVec2::new(12.3, -45.6), &mut Key::world(9).rng());
            (look.yaw_rad, look.size)
        };
        assert_eq!(
            at(&looks.trees),
            (0.213_416_704_186_122_07, 0.672_406_710_321_870_8)
        );
        assert_eq!(
            at(&looks.saplings),
            (6.000_884_331_439_982, 0.860_482_377_837_776_4)
        );
    }
}
