//! Places beside a path, for single views instead of a drive.

use nemoral_scene::glam::DVec2;
use nemoral_seed::{Draw, Key};

use crate::{Obstacle, Pose2d};

/// How often a place is drawn anew if it is not clear.
const TRIES: u32 = 8;

/// Draws where a body may stand beside a path: within a distance of a place on it, clear of
/// obstacles, facing elsewhere than along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseSampler {
    /// The greatest distance from the place on the path, metres.
    pub reach_m: f64,
    /// The greatest angle from the path's direction, to either side, radians.
    pub turn_rad: f64,
    /// Distance that is kept from obstacles, metres.
    pub clearance_m: f64,
}

impl PoseSampler {
    /// How far from the place on the path an obstacle may matter, metres.
    #[must_use]
    pub fn obstacles_m(&self) -> f64 {
        self.reach_m + self.clearance_m
    }

    /// A place and a direction, drawn by `key`: uniform over the disk about the place on the path,
    /// and over the directions. `near` has all obstacles within [`PoseSampler::obstacles_m`]; where
    /// eight places in a row are not clear of them, there is none.
    #[must_use]
    pub fn draw(&self, (place_m, forward): Pose2d, near: &[Obstacle], key: Key) -> Option<Pose2d> {
        let mut rng = key.rng();
        // The direction comes first, so that it does not depend on obstacles.
        let (sin, cos) = libm::sincos(rng.range_f64(-self.turn_rad, self.turn_rad));
        let turned = forward.normalize_or(DVec2::X).rotate(DVec2::new(cos, sin));
        let is_clear = |p: DVec2| {
            let keeps = |o: &Obstacle| o.position_m.distance(p) >= o.radius_m + self.clearance_m;
            near.iter().all(keeps)
        };
        let mut place = || {
            let radius_m = self.reach_m * libm::sqrt(rng.unit_f64());
            let (sin, cos) = libm::sincos(rng.range_f64(0.0, std::f64::consts::TAU));
            place_m + DVec2::new(cos, sin) * radius_m
        };
        let clear = (0..TRIES).map(|_| place()).find(|p| is_clear(*p));
        Some((clear?, turned))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nemoral_seed::Domain;
    use proptest::prelude::*;

    use super::*;

    const SAMPLER: PoseSampler = PoseSampler {
        reach_m: 10.0,
        turn_rad: PI,
        clearance_m: 0.8,
    };
    const PATH: Pose2d = (DVec2::new(100.0, -50.0), DVec2::X);

    fn key(number: u64) -> Key {
        Key::world(7)
            .domain(Domain::new("beside.test"))
            .item(number)
    }

    #[test]
    fn value_stability() {
        let stem = Obstacle {
            position_m: DVec2::new(103.0, -48.0),
            radius_m: 4.0,
        };
        let (place, forward) = SAMPLER.draw(PATH, &[stem], key(0)).expect("there is room");
        assert_eq!(format!("{place:?} {forward:?}"), VALUES);
    }
    const VALUES: &str = "DVec2(105.18203437685106, -57.996349391980516) \
        DVec2(0.29989376048388683, 0.9539726056983152)";

    proptest! {
        #[test]
        fn places_are_near_clear_and_turned(
            number: u64,
            turn_rad in 0.0_f64..PI,
            stems in prop::collection::vec((-12.0_f64..12.0, -12.0_f64..12.0, 0.1_f64..3.0), 0..9),
        ) {
            let sampler = PoseSampler { turn_rad, ..SAMPLER };
            let stems: Vec<Obstacle> = stems.into_iter().map(|(x, y, radius_m)| Obstacle {
                position_m: PATH.0 + DVec2::new(x, y),
                radius_m,
            }).collect();
            if let Some((place, forward)) = sampler.draw(PATH, &stems, key(number)) {
                prop_assert!(place.distance(PATH.0) <= SAMPLER.reach_m + 1e-9);
                prop_assert!((forward.length() - 1.0).abs() < 1e-12);
                prop_assert!(forward.dot(PATH.1) >= libm::cos(turn_rad) - 1e-9);
                for stem in &stems {
                    prop_assert!(stem.position_m.distance(place) >= stem.radius_m + 0.8);
                }
            }
        }
    }

    #[test]
    fn places_are_uniform_over_the_disk() {
        let n = 20_000;
        let drawn: Vec<Pose2d> = (0..n)
            .filter_map(|i| SAMPLER.draw(PATH, &[], key(i)))
            .collect();
        assert_eq!(drawn.len() as u64, n);
        let share = |inside: &dyn Fn(&Pose2d) -> bool| {
            drawn.iter().filter(|pose| inside(pose)).count() as f64 / n as f64
        };
        // Half of a disk's area is within 0.7071 of its radius; 4 standard deviations are 0.014.
        let inner = share(&|(p, _)| p.distance(PATH.0) < 10.0 * 0.5_f64.sqrt());
        assert!((inner - 0.5).abs() < 0.0142, "{inner}");
        let ahead = share(&|(_, forward)| forward.x > 0.0);
        let east = share(&|(p, _)| p.x > PATH.0.x);
        assert!((ahead - 0.5).abs() < 0.0142 && (east - 0.5).abs() < 0.0142);
    }

    #[test]
    fn where_nothing_is_clear_there_is_no_place() {
        let everywhere = Obstacle {
            position_m: PATH.0,
            radius_m: 20.0,
        };
        assert_eq!(SAMPLER.draw(PATH, &[everywhere], key(1)), None);
    }
}
