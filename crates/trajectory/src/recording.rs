//! Recorded poses with times.

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;

use crate::Error;

/// Poses with their times; frame k is at pose k.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The times, which increase.
    times_s: Vec<f64>,
    poses: Vec<RigidTransform>,
    on_ground: bool,
}

impl Recording {
    /// A recording of poses as [`read_poses`](crate::read_poses) gives them. Those without a time
    /// lie `step_s` apart, from 0. With `on_ground` only positions on the map and headings are
    /// used; height, pitch and roll come from the ground. Errors call the poses `origin`.
    ///
    /// # Errors
    /// If there is no pose, times do not increase, or with `on_ground`, if the poses are those of a
    /// camera, whose z axis points forward.
    pub fn new(
        poses: Vec<(Option<f64>, RigidTransform)>,
        step_s: f64,
        on_ground: bool,
        origin: &str,
    ) -> Result<Self, Error> {
        let origin = || origin.to_owned();
        if poses.is_empty() {
            return Err(Error::Empty { origin: origin() });
        }
        let times_s: Vec<f64> = poses
            .iter()
            .enumerate()
            .map(|(i, (t, _))| t.unwrap_or(i as f64 * step_s))
            .collect();
        if let Some(i) = times_s.windows(2).position(|w| w[1] <= w[0]) {
            return Err(Error::Times {
                origin: origin(),
                pose: i + 2,
                time_s: times_s[i + 1],
                before_s: times_s[i],
            });
        }
        let poses: Vec<RigidTransform> = poses.into_iter().map(|(_, pose)| pose).collect();
        if on_ground && moves_along_z(&poses) {
            return Err(Error::CameraAxes { origin: origin() });
        }
        Ok(Self {
            times_s,
            poses,
            on_ground,
        })
    }

    /// The number of poses.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.poses.len() as u64
    }

    /// Whether only positions on the map and headings are used.
    #[must_use]
    pub fn is_on_ground(&self) -> bool {
        self.on_ground
    }

    /// The time of a pose, seconds.
    ///
    /// # Panics
    /// If there is no such pose.
    #[must_use]
    pub fn time_s(&self, number: u64) -> f64 {
        self.times_s[number as usize]
    }

    /// The pose at a time: between two poses it is on the arc from one to the other; outside of the
    /// recording it is the nearest pose.
    #[must_use]
    pub fn at(&self, time_s: f64) -> RigidTransform {
        let (times_s, poses) = (&self.times_s, &self.poses);
        let after = times_s.partition_point(|&t| t <= time_s);
        if after == 0 || poses.len() == 1 {
            return poses[0];
        }
        if after == poses.len() {
            return poses[poses.len() - 1];
        }
        let (a, b) = (&poses[after - 1], &poses[after]);
        let t = (time_s - times_s[after - 1]) / (times_s[after] - times_s[after - 1]);
        RigidTransform {
            rotation: a.rotation.slerp(b.rotation, t),
            translation_m: a.translation_m.lerp(b.translation_m, t),
        }
    }
}

/// Whether poses move along their own z axes: on nine tenths of at least a metre.
fn moves_along_z(poses: &[RigidTransform]) -> bool {
    let (mut way_m, mut along_z_m) = (0.0, 0.0);
    for pair in poses.windows(2) {
        let step = pair[1].translation_m - pair[0].translation_m;
        way_m += step.length();
        along_z_m += step.dot(pair[0].rotation * DVec3::Z);
    }
    way_m >= 1.0 && along_z_m > 0.9 * way_m
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64) -> RigidTransform {
        RigidTransform::from_xyz_rpy(DVec3::new(x_m, 0.0, 0.0), 0.0, 0.0, x_m)
    }

    #[test]
    fn between_poses_they_are_blended_and_outside_they_are_held() {
        let poses = vec![(Some(1.0), at(0.0)), (Some(3.0), at(1.0))];
        let recording = Recording::new(poses, 9.0, true, "poses").expect("increasing");
        assert_eq!((recording.count(), recording.time_s(1)), (2, 3.0));
        for (time_s, x_m) in [(0.0, 0.0), (1.0, 0.0), (1.5, 0.25), (3.0, 1.0), (9.0, 1.0)] {
            let (is, expected) = (recording.at(time_s), at(x_m));
            assert!(is.translation_m.distance(expected.translation_m) < 1e-12);
            assert!(is.rotation.angle_between(expected.rotation) < 1e-7);
        }
    }

    #[test]
    fn poses_of_a_camera_are_refused_on_the_ground() {
        // A camera's poses relative to its first one, and absolute ones.
        let mount = RigidTransform::body_from_optical();
        let relative = |x_m: f64| RigidTransform {
            translation_m: DVec3::Z * x_m,
            ..RigidTransform::IDENTITY
        };
        let absolute = |x_m: f64| RigidTransform {
            translation_m: DVec3::X * x_m,
            ..mount
        };
        for pose in [&relative as &dyn Fn(f64) -> _, &absolute] {
            let poses = || (0..20).map(|i| (None, pose(0.1 * f64::from(i)))).collect();
            let refused = Recording::new(poses(), 1.0, true, "poses.txt").expect_err("a camera's");
            assert!(refused.to_string().contains("z axis up"), "{refused}");
            assert!(Recording::new(poses(), 1.0, false, "poses.txt").is_ok());
        }
    }

    #[test]
    fn times_are_made_up_where_there_are_none_and_must_increase() {
        let poses = vec![(None, at(0.0)), (None, at(1.0))];
        let recording = Recording::new(poses, 0.5, true, "poses").expect("increasing");
        assert_eq!(recording.time_s(1), 0.5);
        let poses = vec![(Some(1.0), at(0.0)), (Some(1.0), at(1.0))];
        let error = Recording::new(poses, 0.5, true, "a.txt").expect_err("they stand still");
        assert_eq!(
            error.to_string(),
            "a.txt: time 1 of pose 2 is not after 1: times must increase"
        );
        assert!(Recording::new(Vec::new(), 0.5, true, "a.txt").is_err());
    }
}
