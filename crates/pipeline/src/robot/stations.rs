//! Fixed stations, as of terrestrial scanning.

use std::f64::consts::TAU;

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::{DQuat, DVec2};

use super::wander::Obstacle;

/// A tripod is moved in steps of this, metres.
const STEP_M: f64 = 0.25;

/// A grid of places, rows from the west, columns from the south.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stations {
    pub(super) middle_m: DVec2,
    pub(super) forward: DVec2,
    pub(super) columns: u32,
    pub(super) rows: u32,
    pub(super) distance_m: f64,
}

impl Stations {
    pub(super) fn count(&self) -> u64 {
        u64::from(self.columns) * u64::from(self.rows)
    }

    /// Where a station stands: its place of the grid, or the nearest around it, up to a third of the
    /// stations' distance away, that is clear of everything.
    pub(super) fn place<E>(
        &self,
        number: u64,
        clearance_m: f64,
        obstacles: &dyn Fn(DVec2, f64) -> Result<Vec<Obstacle>, E>,
    ) -> Result<DVec2, E> {
        let columns = u64::from(self.columns);
        let of_middle = |i: u64, n: u32| i as f64 - f64::from(n - 1) / 2.0;
        let cell = DVec2::new(
            of_middle(number % columns, self.columns),
            of_middle(number / columns, self.rows),
        );
        let wanted = self.middle_m + cell * self.distance_m;
        let reach = self.distance_m / 3.0;
        let near = obstacles(wanted, reach + clearance_m)?;
        let clear = |p: DVec2| near.iter().all(|(q, r)| q.distance(p) >= r + clearance_m);
        let rings = (reach / STEP_M) as u32;
        let places = (0..=rings).flat_map(|ring| {
            let count = (6 * ring).max(1);
            (0..count).map(move |i| {
                let angle = TAU * f64::from(i) / f64::from(count);
                wanted + DVec2::from_angle(angle) * (STEP_M * f64::from(ring))
            })
        });
        Ok(places.into_iter().find(|p| clear(*p)).unwrap_or(wanted))
    }

    /// A level body on the ground.
    pub(super) fn stand(&self, position_m: DVec2, height_m: f64) -> RigidTransform {
        RigidTransform {
            rotation: DQuat::from_rotation_z(self.forward.to_angle()),
            translation_m: position_m.extend(height_m),
        }
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
    };

    fn place(number: u64, stems: &[Obstacle]) -> DVec2 {
        let near = |_, _| -> Result<Vec<Obstacle>, ()> { Ok(stems.to_vec()) };
        GRID.place(number, 1.0, &near).expect("no land to fail")
    }

    #[test]
    fn stations_stand_in_a_grid_about_the_start() {
        assert_eq!(GRID.count(), 6);
        assert_eq!(place(0, &[]), DVec2::new(-2.0, 14.0));
        assert_eq!(place(4, &[]), DVec2::new(10.0, 26.0));
        assert_eq!(place(5, &[]), DVec2::new(22.0, 26.0));
    }

    #[test]
    fn stations_keep_clear_of_stems() {
        let stems = [(DVec2::new(10.0, 26.0), 0.2), (DVec2::new(11.0, 26.5), 0.3)];
        let p = place(4, &stems);
        for (q, r) in stems {
            assert!(p.distance(q) >= r + 1.0);
        }
        assert!(p.distance(DVec2::new(10.0, 26.0)) < 1.6);
        // Where nothing is clear the station stands where it was asked to.
        let thicket: Vec<Obstacle> = (-9..=9)
            .flat_map(|x| {
                (-9..=9).map(move |y| (DVec2::new(10.0 + f64::from(x), 26.0 + f64::from(y)), 0.5))
            })
            .collect();
        assert_eq!(place(4, &thicket), DVec2::new(10.0, 26.0));
    }

    #[test]
    fn a_tripod_is_level() {
        let pose = GRID.stand(DVec2::new(1.0, 2.0), 3.0);
        let up = pose.transform_vector(nemoral_scene::glam::DVec3::Z);
        assert!(up.distance(nemoral_scene::glam::DVec3::Z) < 1e-15);
        let ahead = pose.transform_vector(nemoral_scene::glam::DVec3::X);
        assert!(ahead.distance(nemoral_scene::glam::DVec3::Y) < 1e-12);
    }
}
