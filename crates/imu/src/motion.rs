//! The true motion of an inertial measurement unit.

use nemoral_scene::glam::DVec3;
use nemoral_scene::{RigidTransform, rotation_vector};

/// Standard gravity, m/s².
pub const GRAVITY_M_S2: f64 = 9.80665;

/// The motion of a unit over one of its intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuMotion {
    /// The middle of the interval, seconds after the first one's.
    pub time_s: f64,
    /// Its pose then. Of the two quaternions of its rotation it has the one nearer to that of the
    /// interval before.
    pub world_from_imu: RigidTransform,
    /// Its velocity in the world, m/s: the mean from the middle before to the next one.
    pub velocity_m_s: DVec3,
    /// Its mean angular rate over the interval, in its own frame, rad/s.
    pub angular_rate_rad_s: DVec3,
    /// Its specific force, acceleration less gravity, in its own frame, m/s².
    pub specific_force_m_s2: DVec3,
}

/// The motion of a unit at `count` intervals of 1 / `rate_hz`, the first of which has its middle at
/// time 0. `world_from_imu` gives its pose at any time, also an interval before the first and after
/// the last.
///
/// Rates are rotations over intervals, and accelerations changes of the mean velocity from middle
/// to middle. So nothing is lost between samples, as in a unit that integrates while it waits for
/// the next one: with an interval T, the mean velocity up to a middle plus T times the acceleration
/// there is exactly the mean velocity after it.
///
/// # Panics
/// If `rate_hz` is not above 0 and finite.
pub fn motions<E, F>(rate_hz: f64, count: u64, world_from_imu: F) -> Motions<F>
where
    F: FnMut(f64) -> Result<RigidTransform, E>,
{
    assert!(rate_hz > 0.0 && rate_hz.is_finite(), "{rate_hz} Hz");
    Motions {
        rate_hz,
        next: 0,
        count,
        last: None,
        pose: world_from_imu,
    }
}

/// The motions of a unit in the order of time; see [`motions`].
#[derive(Clone, Debug)]
pub struct Motions<F> {
    rate_hz: f64,
    next: u64,
    count: u64,
    last: Option<Last>,
    pose: F,
}

/// The last poses before an interval's end.
#[derive(Clone, Copy, Debug)]
struct Last {
    /// In the middle of the interval before.
    before: RigidTransform,
    /// Between that interval and this one.
    edge: RigidTransform,
    /// In the middle of this one.
    middle: RigidTransform,
}

impl<E, F: FnMut(f64) -> Result<RigidTransform, E>> Motions<F> {
    fn motion(&mut self) -> Result<ImuMotion, E> {
        let step_s = 1.0 / self.rate_hz;
        let at = |intervals: f64| (self.next as f64 + intervals) / self.rate_hz;
        let Last {
            before,
            edge,
            middle,
        } = match self.last.take() {
            Some(last) => last,
            None => Last {
                before: (self.pose)(at(-1.0))?,
                edge: (self.pose)(at(-0.5))?,
                middle: (self.pose)(at(0.0))?,
            },
        };
        let (next_edge, mut after) = ((self.pose)(at(0.5))?, (self.pose)(at(1.0))?);
        // Users interpolate quaternions, and between two of unlike signs lie quite other rotations.
        if after.rotation.dot(middle.rotation) < 0.0 {
            after.rotation = -after.rotation;
        }
        self.last = Some(Last {
            before: middle,
            edge: next_edge,
            middle: after,
        });
        let turned = rotation_vector(edge.rotation.inverse() * next_edge.rotation);
        let up_to = (middle.translation_m - before.translation_m) / step_s;
        let from = (after.translation_m - middle.translation_m) / step_s;
        let felt = (from - up_to) / step_s + DVec3::Z * GRAVITY_M_S2;
        Ok(ImuMotion {
            time_s: at(0.0),
            world_from_imu: middle,
            velocity_m_s: 0.5 * (up_to + from),
            angular_rate_rad_s: turned / step_s,
            specific_force_m_s2: middle.rotation.inverse() * felt,
        })
    }
}

impl<E, F: FnMut(f64) -> Result<RigidTransform, E>> Iterator for Motions<F> {
    type Item = Result<ImuMotion, E>;

    fn next(&mut self) -> Option<Self::Item> {
        (self.next < self.count).then(|| {
            let motion = self.motion();
            self.next += 1;
            motion
        })
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use nemoral_scene::glam::DQuat;
    use proptest::prelude::*;

    use super::*;

    fn all(rate_hz: f64, count: u64, pose: impl Fn(f64) -> RigidTransform) -> Vec<ImuMotion> {
        motions(rate_hz, count, |t| Ok::<_, Infallible>(pose(t)))
            .map(|motion| motion.unwrap_or_else(|never| match never {}))
            .collect()
    }

    proptest! {
        /// Closed form: on a banked circle, with a lever.
        #[test]
        fn a_circle_gives_its_rate_and_its_pull(
            radius_m in 1.0_f64..30.0,
            rate in -1.0_f64..1.0,
            roll in -0.3_f64..0.3,
            lever_m in -0.5_f64..0.5,
        ) {
            let lever = RigidTransform::from_xyz_rpy(DVec3::X * lever_m, 0.0, 0.0, 0.0);
            let pose = |t: f64| {
                let turn = rate * t;
                let at = DVec3::new(radius_m * turn.sin(), -radius_m * turn.cos(), 2.0);
                RigidTransform::from_xyz_rpy(at, roll, 0.0, turn) * lever
            };
            for motion in all(200.0, 50, pose) {
                let level = DQuat::from_rotation_x(roll).inverse();
                let wanted_rate = level * (DVec3::Z * rate);
                prop_assert!(motion.angular_rate_rad_s.distance(wanted_rate) < 1e-9);
                // Towards the middle, and back along the lever.
                let pull = DVec3::new(-lever_m, radius_m, 0.0) * rate * rate;
                let wanted = level * (pull + DVec3::Z * GRAVITY_M_S2);
                prop_assert!(motion.specific_force_m_s2.distance(wanted) < 2e-4);
                let speed = rate.abs() * radius_m.hypot(lever_m);
                prop_assert!((motion.velocity_m_s.length() - speed).abs() < 2e-4);
            }
        }
    }

    /// Headings are from -180 to 180 degrees, as those of bodies are.
    #[test]
    fn quaternions_of_a_turn_keep_their_signs() {
        use std::f64::consts::{PI, TAU};

        let pose = |t: f64| RigidTransform {
            rotation: DQuat::from_rotation_z((2.0 * t).rem_euclid(TAU) - PI),
            ..RigidTransform::IDENTITY
        };
        // A whole turn and a half.
        let motions = all(100.0, 471, pose);
        for pair in motions.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|motion| motion.world_from_imu.rotation);
            assert!(a.dot(b) > 0.99, "{a} {b}");
        }
        for motion in &motions {
            let wanted = pose(motion.time_s).rotation;
            assert!(motion.world_from_imu.rotation.angle_between(wanted) < 1e-6);
            assert!((motion.angular_rate_rad_s - DVec3::Z * 2.0).length() < 1e-6);
        }
    }

    #[test]
    fn the_slowest_turns_are_measured() {
        // The rate of the earth, and a thousandth of it.
        for (rate_hz, rate) in [(4000.0, 7.29e-5), (1000.0, 7.29e-5), (200.0, 7.29e-8)] {
            let pose = |t: f64| RigidTransform::from_xyz_rpy(DVec3::ZERO, 0.0, 0.0, rate * t);
            for motion in all(rate_hz, 5, pose) {
                assert!((motion.angular_rate_rad_s.z / rate - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn integrated_it_is_the_drive() {
        let pose = |t: f64| {
            let at = DVec3::new(1.4 * t, (0.7 * t).sin(), 0.05 * (3.0 * t).sin());
            RigidTransform::from_xyz_rpy(at, 0.04 * (2.0 * t).sin(), 0.03 * t.cos(), 0.5 * t.sin())
        };
        let rate_hz = 200.0;
        let motions = all(rate_hz, 6000, pose);
        let step_s = 1.0 / rate_hz;
        // What an odometry does with them, from the first state on.
        let first = motions[0];
        let acceleration = |rotation: DQuat, motion: &ImuMotion| {
            rotation * motion.specific_force_m_s2 - DVec3::Z * GRAVITY_M_S2
        };
        let half =
            |motion: &ImuMotion| DQuat::from_scaled_axis(0.5 * step_s * motion.angular_rate_rad_s);
        let mut at = first.world_from_imu.translation_m;
        let mut rotation = first.world_from_imu.rotation * half(&first).inverse();
        let begins = acceleration(first.world_from_imu.rotation, &first);
        let mut velocity = first.velocity_m_s - 0.5 * step_s * begins;
        for motion in &motions {
            let middle = rotation * half(motion);
            velocity += step_s * acceleration(middle, motion);
            at += step_s * velocity;
            rotation = middle * half(motion);
        }
        // In 30 seconds and 42 metres.
        let [end, edge] = [0.0, -0.5].map(|off| pose((motions.len() as f64 + off) * step_s));
        assert!(at.distance(end.translation_m) < 0.01, "{at} {end:?}");
        assert!(rotation.angle_between(edge.rotation) < 1e-6);
    }
}
