//! The true motion of an inertial measurement unit.

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::{DQuat, DVec3};

/// Standard gravity, m/s².
pub const GRAVITY_M_S2: f64 = 9.80665;

/// The motion of a unit over one of its intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuMotion {
    /// The middle of the interval, seconds after the first one's.
    pub time_s: f64,
    /// Its pose then.
    pub world_from_imu: RigidTransform,
    /// Its mean velocity over the interval in the world, m/s.
    pub velocity_m_s: DVec3,
    /// Its mean angular rate over the interval, in its own frame, rad/s.
    pub angular_rate_rad_s: DVec3,
    /// Its specific force, acceleration less gravity, in its own frame, m/s².
    pub specific_force_m_s2: DVec3,
}

/// The motion of a unit at `count` intervals of 1 / `rate_hz`, the first of which has its middle at
/// time 0. `world_from_imu` gives its pose at any time, also half an interval before the first and
/// after the last.
///
/// Rates are the rotation over an interval, and accelerations the change of the mean velocities of
/// its halves, as a unit integrates both while it waits for the next sample.
pub fn motions<E, F>(rate_hz: f64, count: u64, world_from_imu: F) -> Motions<F>
where
    F: FnMut(f64) -> Result<RigidTransform, E>,
{
    Motions {
        rate_hz,
        next: 0,
        count,
        edge: None,
        pose: world_from_imu,
    }
}

/// The motions of a unit in the order of time; see [`motions`].
#[derive(Clone, Debug)]
pub struct Motions<F> {
    rate_hz: f64,
    next: u64,
    count: u64,
    /// The pose between the last interval and the next.
    edge: Option<RigidTransform>,
    pose: F,
}

impl<E, F: FnMut(f64) -> Result<RigidTransform, E>> Motions<F> {
    fn motion(&mut self) -> Result<ImuMotion, E> {
        let half_s = 0.5 / self.rate_hz;
        let time_s = self.next as f64 / self.rate_hz;
        let before = match self.edge {
            Some(pose) => pose,
            None => (self.pose)(time_s - half_s)?,
        };
        let middle = (self.pose)(time_s)?;
        let after = (self.pose)(time_s + half_s)?;
        self.edge = Some(after);
        let turned = rotation_vector(before.rotation.inverse() * after.rotation);
        let first = (middle.translation_m - before.translation_m) / half_s;
        let second = (after.translation_m - middle.translation_m) / half_s;
        let acceleration = (second - first) / half_s;
        let felt = acceleration + DVec3::Z * GRAVITY_M_S2;
        Ok(ImuMotion {
            time_s,
            world_from_imu: middle,
            velocity_m_s: 0.5 * (first + second),
            angular_rate_rad_s: turned * self.rate_hz,
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

/// The axis of a rotation times its angle, at most π.
fn rotation_vector(rotation: DQuat) -> DVec3 {
    let q = if rotation.w < 0.0 {
        -rotation
    } else {
        rotation
    };
    q.to_scaled_axis()
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

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
                prop_assert!((motion.velocity_m_s.length() - speed).abs() < 1e-4);
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
        // From the first interval's beginning, where velocity comes from a difference.
        let begin_s = -0.5 * step_s;
        let begin = pose(begin_s);
        let mut rotation = begin.rotation;
        let mut at = begin.translation_m;
        let near = 1e-6;
        let mut velocity = (pose(begin_s + near).translation_m
            - pose(begin_s - near).translation_m)
            / (2.0 * near);
        for motion in &motions {
            let half = DQuat::from_scaled_axis(0.5 * step_s * motion.angular_rate_rad_s);
            let middle = rotation * half;
            let felt = middle * motion.specific_force_m_s2;
            let acceleration = felt - DVec3::Z * GRAVITY_M_S2;
            at += velocity * step_s + 0.5 * step_s * step_s * acceleration;
            velocity += acceleration * step_s;
            rotation = middle * half;
        }
        let end = pose(motions.len() as f64 * step_s + begin_s);
        assert!(at.distance(end.translation_m) < 0.02, "{at} {end:?}");
        assert!(rotation.angle_between(end.rotation) < 1e-5);
    }
}
