//! Recorded poses with times.

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::{DQuat, DVec3};

use crate::Error;
use crate::spline::NaturalSpline;

/// Poses with their times; frame k is at pose k.
///
/// Between poses the body moves smoothly, as a drive does: positions and rotations follow natural
/// cubic splines through the poses, so that velocities and accelerations are continuous. An
/// interval of more than three times the median one is a pause, as recordings have where a robot
/// stood or was not tracked: there the body moves straight and evenly from one pose to the other.
#[derive(Clone, Debug)]
pub struct RecordedTrajectory {
    times_s: Vec<f64>,
    /// The positions, and the rotations' quaternions, by the time since the first pose: a number of
    /// seconds since 1970 is too coarse for accelerations.
    curve: NaturalSpline<7>,
    on_ground: bool,
}

impl RecordedTrajectory {
    /// A recording of poses as [`read_poses`](crate::read_poses) gives them. Those without a time
    /// lie `step_s` apart, from 0. With `on_ground` only positions on the map and headings are
    /// used; height, pitch and roll come from the ground. Errors call the poses `origin`.
    ///
    /// # Errors
    /// If there is no pose, times are not finite or do not increase, or with `on_ground`, if the
    /// poses are those of a camera, whose z axis points forward.
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
        let before_s = |i: usize| i.checked_sub(1).map_or(f64::NEG_INFINITY, |i| times_s[i]);
        let is_wrong = |&i: &usize| !(times_s[i].is_finite() && times_s[i] > before_s(i));
        if let Some(i) = (0..times_s.len()).find(is_wrong) {
            return Err(Error::Times {
                origin: origin(),
                pose: i + 1,
                time_s: times_s[i],
                before_s: before_s(i),
            });
        }
        let poses: Vec<RigidTransform> = poses.into_iter().map(|(_, pose)| pose).collect();
        if on_ground && moves_along_z(&poses) {
            return Err(Error::CameraAxes { origin: origin() });
        }
        // Of the two quaternions of a rotation, the one nearer to that before.
        let mut last = poses[0].rotation;
        let values = poses.iter().map(|pose| {
            let q = pose.rotation;
            last = if last.dot(q) < 0.0 { -q } else { q };
            let ([x, y, z], [i, j, k, w]) = (pose.translation_m.to_array(), last.to_array());
            [x, y, z, i, j, k, w]
        });
        let values: Vec<[f64; 7]> = values.collect();
        let since_s: Vec<f64> = times_s.iter().map(|t| t - times_s[0]).collect();
        Ok(Self {
            curve: curve_through(&since_s, &values),
            times_s,
            on_ground,
        })
    }

    /// The number of poses.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.times_s.len() as u64
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

    /// The pose at a time; outside of the recording the body goes straight on at the speed that it
    /// has there.
    #[must_use]
    pub fn at(&self, time_s: f64) -> RigidTransform {
        self.since_first(time_s - self.times_s[0])
    }

    /// The pose at a time after that of a pose.
    ///
    /// # Panics
    /// If there is no such pose.
    #[must_use]
    pub fn after(&self, number: u64, offset_s: f64) -> RigidTransform {
        self.since_first(self.time_s(number) - self.times_s[0] + offset_s)
    }

    fn since_first(&self, time_s: f64) -> RigidTransform {
        let [x, y, z, i, j, k, w] = self.curve.at(time_s);
        let rotation = DQuat::from_xyzw(i, j, k, w);
        // From one pose to the next, a body turns by less than half a turn.
        let length = rotation.length();
        RigidTransform {
            rotation: if length > 1e-6 {
                rotation * (1.0 / length)
            } else {
                DQuat::IDENTITY
            },
            translation_m: DVec3::new(x, y, z),
        }
    }
}

/// An interval longer than so many median ones is a pause.
const PAUSE: f64 = 3.0;
/// The most poses that are added at either end of a pause. Each leaves 0.27 of the bend before it,
/// so that after these less than 1e-9 is left, however long the pause is.
const ADDED: u64 = 16;

/// The curve through poses at times, seconds. A cubic over a long interval would leave the straight
/// line by more than a tenth of what a body drives in that time at the speed it had before, so a
/// pause gets poses on the straight line, a median interval apart from its ends on.
fn curve_through(times_s: &[f64], poses: &[[f64; 7]]) -> NaturalSpline<7> {
    let mut intervals_s: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals_s.sort_by(f64::total_cmp);
    let median_s = intervals_s.get(intervals_s.len() / 2).copied();
    let median_s = median_s.unwrap_or(f64::INFINITY);
    let (mut all_s, mut all) = (vec![times_s[0]], vec![poses[0]]);
    for (ends_s, ends) in times_s.windows(2).zip(poses.windows(2)) {
        let interval_s = ends_s[1] - ends_s[0];
        if interval_s > PAUSE * median_s {
            let parts = (interval_s / median_s).ceil() as u64;
            let early = 1..=ADDED.min(parts - 1);
            let late = parts.saturating_sub(ADDED).max(ADDED + 1)..parts;
            for part in early.chain(late) {
                let share = part as f64 / parts as f64;
                let time_s = ends_s[0] + share * interval_s;
                // Times that cannot be told apart would have no slope between them.
                if all_s.last().is_some_and(|&last_s| last_s < time_s) && time_s < ends_s[1] {
                    all_s.push(time_s);
                    all.push(between(&ends[0], &ends[1], share));
                }
            }
        }
        all_s.push(ends_s[1]);
        all.push(ends[1]);
    }
    NaturalSpline::through(all_s, all)
}

/// A pose at a share of the straight way from one to the next, whose quaternions are at most a
/// right angle apart.
fn between(from: &[f64; 7], to: &[f64; 7], share: f64) -> [f64; 7] {
    let blend = |n: usize| from[n] + share * (to[n] - from[n]);
    let turn = DQuat::from_xyzw(blend(3), blend(4), blend(5), blend(6)).normalize();
    [blend(0), blend(1), blend(2), turn.x, turn.y, turn.z, turn.w]
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
    fn it_meets_its_poses_and_goes_straight_on_outside() {
        let poses = vec![(Some(1.0), at(0.0)), (Some(3.0), at(1.0))];
        let recording = RecordedTrajectory::new(poses, 9.0, true, "poses").expect("increasing");
        assert_eq!((recording.count(), recording.time_s(1)), (2, 3.0));
        for (time_s, x_m) in [(0.0, -0.5), (1.0, 0.0), (1.5, 0.25), (3.0, 1.0), (4.0, 1.5)] {
            let (is, expected) = (recording.at(time_s), at(x_m));
            assert!(is.translation_m.distance(expected.translation_m) < 1e-12);
            // Quaternions that are blended evenly do not turn quite evenly: here by a radian.
            assert!(
                is.rotation.angle_between(expected.rotation) < 0.1,
                "{time_s}"
            );
        }
        let alone =
            RecordedTrajectory::new(vec![(None, at(0.3))], 1.0, true, "poses").expect("a pose");
        assert!(alone.at(77.0).rotation.angle_between(at(0.3).rotation) < 1e-7);
        assert_eq!(alone.at(77.0).translation_m.x, 0.3);
    }

    /// A drive around a circle, recorded twice a second through more than a whole turn.
    #[test]
    fn a_drive_is_found_again_between_its_poses() {
        let drive = |t: f64| {
            let (sin, cos) = libm::sincos(0.4 * t);
            let at = DVec3::new(5.0 * sin, -5.0 * cos, 0.2 * sin);
            RigidTransform::from_xyz_rpy(at, 0.05 * sin, 0.03 * cos, 0.4 * t)
        };
        let poses = (0..60)
            .map(|i| 0.5 * f64::from(i))
            .map(|t| (Some(t), drive(t)));
        let recording =
            RecordedTrajectory::new(poses.collect(), 1.0, false, "poses").expect("increasing");
        for i in 300..2700 {
            let t = 0.01 * f64::from(i);
            let (is, wanted) = (recording.at(t), drive(t));
            assert!(
                is.translation_m.distance(wanted.translation_m) < 1e-4,
                "at {t}"
            );
            assert!(is.rotation.angle_between(wanted.rotation) < 1e-4, "at {t}");
        }
        // Seconds since 1970 do not make its accelerations coarser.
        let later = (0..60)
            .map(|i| 0.5 * f64::from(i))
            .map(|t| (Some(1.3e9 + t), drive(t)));
        let later =
            RecordedTrajectory::new(later.collect(), 1.0, false, "poses").expect("increasing");
        for i in 1000..2000 {
            let t = 0.01 * f64::from(i);
            let pull = |at: &dyn Fn(f64) -> DVec3| at(t + 1e-3) - 2.0 * at(t) + at(t - 1e-3);
            let [a, b] = [&recording, &later].map(|r| pull(&|t| r.after(0, t).translation_m));
            assert!(a.distance(b) < 1e-12, "{a} {b}");
        }
        for frame in 0..60 {
            let (is, wanted) = (
                recording.at(recording.time_s(frame)),
                drive(0.5 * frame as f64),
            );
            assert!(is.translation_m.distance(wanted.translation_m) < 1e-14);
            assert!(is.rotation.dot(wanted.rotation).abs() > 1.0 - 1e-15);
        }
    }

    /// Ten metres at 1 m/s, a rest, and ten more: keyframes of a robot that stood.
    #[test]
    fn between_poses_far_apart_in_time_a_robot_rests() {
        for rest_s in [5.0, 60.0, 1e6] {
            let pose = |i: u32| {
                let driven = 0.1 * f64::from(if i > 100 { i - 1 } else { i });
                let rested_s = if i > 100 { rest_s } else { 0.0 };
                let pose = RigidTransform {
                    translation_m: DVec3::X * driven,
                    ..RigidTransform::IDENTITY
                };
                (Some(driven + rested_s), pose)
            };
            let poses = (0..202).map(pose).collect();
            let recording =
                RecordedTrajectory::new(poses, 1.0, false, "poses").expect("increasing");
            assert_eq!(recording.count(), 202);
            assert!((recording.time_s(101) - (10.0 + rest_s)).abs() < 1e-9);
            let x_m = |time_s: f64| recording.at(time_s).translation_m.x;
            for i in 0..=1000 {
                let x_m = x_m(10.0 + rest_s * f64::from(i) / 1000.0);
                assert!((x_m - 10.0).abs() < 0.02, "{rest_s}: {x_m}");
            }
            assert!((x_m(5.0) - 5.0).abs() < 1e-6 && (x_m(rest_s + 15.0) - 15.0).abs() < 1e-6);
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
            let refused =
                RecordedTrajectory::new(poses(), 1.0, true, "poses.txt").expect_err("a camera's");
            assert!(refused.to_string().contains("z axis up"), "{refused}");
            assert!(RecordedTrajectory::new(poses(), 1.0, false, "poses.txt").is_ok());
        }
    }

    #[test]
    fn times_are_made_up_where_there_are_none_and_must_increase() {
        let poses = vec![(None, at(0.0)), (None, at(1.0))];
        let recording = RecordedTrajectory::new(poses, 0.5, true, "poses").expect("increasing");
        assert_eq!(recording.time_s(1), 0.5);
        let poses = vec![(Some(1.0), at(0.0)), (Some(1.0), at(1.0))];
        let error =
            RecordedTrajectory::new(poses, 0.5, true, "a.txt").expect_err("they stand still");
        assert_eq!(
            error.to_string(),
            "a.txt: time 1 of pose 2 is not after 1: times must increase"
        );
        assert!(RecordedTrajectory::new(Vec::new(), 0.5, true, "a.txt").is_err());
        assert!(
            RecordedTrajectory::new(vec![(Some(f64::NAN), at(0.0))], 0.5, true, "a.txt").is_err()
        );
        for time_s in [f64::NAN, f64::INFINITY, -5.0] {
            let poses = vec![(Some(0.0), at(0.0)), (Some(time_s), at(1.0))];
            assert!(
                RecordedTrajectory::new(poses, 0.5, true, "a.txt").is_err(),
                "{time_s}"
            );
        }
    }
}
