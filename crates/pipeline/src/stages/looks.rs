//! How copies of a tree are turned and sized: no two that stand near each other look alike.

use std::f64::consts::TAU;

use nemoral_scene::glam::DVec2;
use nemoral_seed::{Draw, Key, Stage};

const LOOKS: Stage = Stage::new("pipeline.looks");

/// Trees nearer than this are turned, or sized, differently.
const APART_M: f64 = 30.0;

/// Of the squares that the plane is cut into: nearer than its diagonal, two trees may share a look.
const SQUARE_M: f64 = 0.75;

/// The pattern repeats after so many squares: two squares with the same look have 30 m between them.
const SQUARES: i64 = (APART_M / SQUARE_M) as i64 + 1;

/// There are so many directions, each in its 3°, ...
const TURNS: u16 = 120;

/// ... and so many sizes; together, more than squares.
const SIZES: u16 = 15;

/// What is left free between two directions and two sizes: 2.1° and 0.56 % of trees a tenth larger or smaller.
const FREE_TURN: f64 = 0.7;
const FREE_SIZE: f64 = 0.42;

/// A pattern of looks over the plane.
///
/// A tree is recognised by its branches: its copy, equally large and turned alike, by anybody. Drawn by
/// chance, one pair in 2,000 is such a pair; here none is within 30 m.
#[derive(Debug)]
pub(super) struct Looks {
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

impl Looks {
    pub(super) fn new(world: Key) -> Self {
        let mut of_square: Vec<u16> = (0..TURNS * SIZES).collect();
        let mut rng = world.stage(LOOKS).rng();
        // Fisher and Yates.
        for i in (1..of_square.len()).rev() {
            of_square.swap(i, rng.below(i as u32 + 1) as usize);
        }
        Self { of_square }
    }

    /// The look of a tree that stands here; two numbers are drawn.
    pub(super) fn at(&self, position_m: DVec2, rng: &mut impl Draw) -> Look {
        let square = |m: f64| ((m / SQUARE_M).floor() as i64).rem_euclid(SQUARES);
        let i = square(position_m.x) + SQUARES * square(position_m.y);
        let look = self.of_square[i as usize];
        let place = |slot: u16, free: f64, within: f64, of: u16| {
            (f64::from(slot) + (1.0 - free) * within) / f64::from(of)
        };
        Look {
            yaw_rad: TAU * place(look % TURNS, FREE_TURN, rng.unit_f64(), TURNS),
            size: place(look / TURNS, FREE_SIZE, rng.unit_f64(), SIZES),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Tenths either way, as grown trees are scaled.
    fn alike(a: Look, b: Look) -> bool {
        let turned = (a.yaw_rad - b.yaw_rad).abs();
        let larger = (0.9 + 0.2 * a.size) / (0.9 + 0.2 * b.size);
        turned.min(TAU - turned) < 2_f64.to_radians() && (larger - 1.0).abs() < 0.005
    }

    proptest! {
        #[test]
        fn none_within_30_m_are_alike(
            seed: u64, x in -1e4..1e4, y in -1e4..1e4, turn in 0.0..TAU, r in 1.07..APART_M,
        ) {
            let looks = Looks::new(Key::world(seed));
            let at = DVec2::new(x, y);
            let mut rng = Key::world(seed ^ 1).rng();
            let a = looks.at(at, &mut rng);
            let b = looks.at(at + DVec2::from_angle(turn) * r, &mut rng);
            prop_assert!(!alike(a, b), "{a:?} {b:?}");
        }
    }

    #[test]
    fn all_directions_and_sizes_are_there() {
        let looks = Looks::new(Key::world(7));
        let mut rng = Key::world(8).rng();
        let all: Vec<Look> = (0..10_000)
            .map(|i| {
                let place = DVec2::new(f64::from(i % 100), f64::from(i / 100)) * 3.1;
                looks.at(place, &mut rng)
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
        let look = looks.at(DVec2::new(12.3, -45.6), &mut Key::world(9).rng());
        assert_eq!(
            (look.yaw_rad, look.size),
            (0.213_416_704_186_122_07, 0.672_406_710_321_870_8)
        );
    }
}
