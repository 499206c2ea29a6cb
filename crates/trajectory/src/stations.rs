//! Fixed stations, as in terrestrial scanning.

use std::f64::consts::TAU;

use nemoral_scene::ParamError;
use nemoral_scene::glam::DVec2;

use crate::{Obstacle, Obstacles};

/// The steps in which a tripod is moved, metres.
const STEP_M: f64 = 0.25;

/// A grid of places, numbered from west to east and then from south to north.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stations {
    /// The middle of the grid on the map, metres.
    pub middle_m: DVec2,
    /// The direction that bodies face, of any length above 0.
    pub forward: DVec2,
    /// Stations from west to east, at least 1.
    pub columns: u32,
    /// Stations from south to north, at least 1.
    pub rows: u32,
    /// Distance between neighbours, metres, 0 to 1000.
    pub distance_m: f64,
    /// Distance that is kept from obstacles, metres, at least 0.
    pub clearance_m: f64,
}

impl Stations {
    /// Checks the values.
    ///
    /// # Errors
    /// If one is out of its range.
    pub fn check(&self) -> Result<(), ParamError> {
        let (middle_m, forward) = (self.middle_m, self.forward);
        ParamError::check(
            middle_m.is_finite(),
            "stations.middle_m",
            middle_m,
            "finite",
        )?;
        ParamError::check(
            forward.is_finite() && forward.length() > 0.0,
            "stations.forward",
            forward,
            "finite and longer than 0",
        )?;
        for (field, count) in [
            ("stations.columns", self.columns),
            ("stations.rows", self.rows),
        ] {
            ParamError::check(count > 0, field, count, "at least 1")?;
        }
        // Places around a station are looked at up to a third of the distance away.
        ParamError::check_within("stations.distance_m", self.distance_m, 0.0, 1000.0)?;
        ParamError::check_at_least_zero("stations.clearance_m", self.clearance_m)
    }

    /// The number of stations.
    #[must_use]
    pub fn count(&self) -> u64 {
        u64::from(self.columns) * u64::from(self.rows)
    }

    /// The place of a station: its place on the grid, or the nearest one around it, up to a third
    /// of the stations' distance away, that is clear of everything. Where none is, it is the one
    /// farthest from all surfaces, which is inside of something only if all these places are.
    ///
    /// # Errors
    /// The error of `obstacles`.
    ///
    /// # Panics
    /// If there are no columns or no rows, which [`check`](Self::check) refuses.
    pub fn place<O: Obstacles + ?Sized>(
        &self,
        number: u64,
        obstacles: &O,
    ) -> Result<DVec2, O::Error> {
        let clearance_m = self.clearance_m;
        let columns = u64::from(self.columns);
        let of_middle = |i: u64, n: u32| i as f64 - f64::from(n - 1) / 2.0;
        let cell = DVec2::new(
            of_middle(number % columns, self.columns),
            of_middle(number / columns, self.rows),
        );
        let wanted = self.middle_m + cell * self.distance_m;
        let reach = self.distance_m / 3.0;
        let near = obstacles.near(wanted, reach + clearance_m)?;
        let gap_m = |p: DVec2| {
            let gaps_m = near
                .iter()
                .map(|o: &Obstacle| o.position_m.distance(p) - o.radius_m);
            gaps_m.fold(f64::INFINITY, f64::min)
        };
        let rings = (reach / STEP_M) as u32;
        let places = (0..=rings).flat_map(|ring| {
            let count = (6 * ring).max(1);
            (0..count).map(move |i| {
                let angle = TAU * f64::from(i) / f64::from(count);
                wanted + DVec2::from_angle(angle) * (STEP_M * f64::from(ring))
            })
        });
        // Of equally good places, the nearest: the first.
        let (mut best_m, mut best) = (f64::NEG_INFINITY, wanted);
        for place in places {
            let gap_m = gap_m(place);
            if gap_m >= clearance_m {
                return Ok(place);
            }
            if gap_m > best_m {
                (best_m, best) = (gap_m, place);
            }
        }
        Ok(best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Stations = Stations {
        middle_m: DVec2::new(10.0, 20.0),
        forward: DVec2::Y,
        columns: 3,
        rows: 2,
        distance_m: 12.0,
        clearance_m: 1.0,
    };

    fn stem(x_m: f64, y_m: f64, radius_m: f64) -> Obstacle {
        Obstacle {
            position_m: DVec2::new(x_m, y_m),
            radius_m,
        }
    }

    fn place(number: u64, stems: &[Obstacle]) -> DVec2 {
        let near = |_: DVec2, _: f64| -> Result<Vec<Obstacle>, ()> { Ok(stems.to_vec()) };
        GRID.place(number, &near).expect("no land to fail")
    }

    #[test]
    fn stations_stand_in_a_grid_about_the_start() {
        assert_eq!(GRID.count(), 6);
        assert_eq!(place(0, &[]), DVec2::new(-2.0, 14.0));
        assert_eq!(place(4, &[]), DVec2::new(10.0, 26.0));
        assert_eq!(place(5, &[]), DVec2::new(22.0, 26.0));
    }

    #[test]
    fn wrong_values_are_named() {
        assert_eq!(GRID.check(), Ok(()));
        for (wrong, field) in [
            (Stations { columns: 0, ..GRID }, "stations.columns"),
            (Stations { rows: 0, ..GRID }, "stations.rows"),
            (
                Stations {
                    middle_m: DVec2::NAN,
                    ..GRID
                },
                "stations.middle_m",
            ),
            (
                Stations {
                    forward: DVec2::ZERO,
                    ..GRID
                },
                "stations.forward",
            ),
            (
                Stations {
                    distance_m: 1001.0,
                    ..GRID
                },
                "stations.distance_m",
            ),
            (
                Stations {
                    clearance_m: -1.0,
                    ..GRID
                },
                "stations.clearance_m",
            ),
        ] {
            assert_eq!(wrong.check().expect_err("is refused").field, field);
        }
    }

    #[test]
    fn stations_keep_clear_of_stems() {
        let stems = [stem(10.0, 26.0, 0.2), stem(11.0, 26.5, 0.3)];
        let p = place(4, &stems);
        for stem in stems {
            assert!(p.distance(stem.position_m) >= stem.radius_m + 1.0);
        }
        assert!(p.distance(DVec2::new(10.0, 26.0)) < 1.6);
        // Where no place is clear, the station is where there is most room, and in no stem: here,
        // almost in the middle of four.
        let thicket: Vec<Obstacle> = (-9..=9)
            .flat_map(|x| {
                (-9..=9).map(move |y| stem(10.0 + f64::from(x), 26.0 + f64::from(y), 0.5))
            })
            .collect();
        let p = place(4, &thicket);
        let gap_m = |stem: &Obstacle| p.distance(stem.position_m) - stem.radius_m;
        assert!(thicket.iter().all(|stem| gap_m(stem) > 0.1), "{p}");
        // Inside one rock that reaches beyond all places, it is nearest to its border.
        let p = place(4, &[stem(9.0, 26.0, 9.0)]);
        assert!(p.distance(DVec2::new(14.0, 26.0)) < 1e-9, "{p}");
    }
}
