//! The pose of a body on the ground, and its motion while a scan is taken.

use nemoral_scene::glam::{DMat3, DQuat, DVec2, DVec3};
use nemoral_scene::{ParamError, RigidTransform, Surface};

/// The footprint of a body on wheels or tracks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Distance between axles, metres.
    pub wheelbase_m: f64,
    /// Distance between tracks, metres.
    pub track_m: f64,
}

impl Body {
    /// Checks the values.
    ///
    /// # Errors
    /// If one is not above 0.
    pub fn check(&self) -> Result<(), ParamError> {
        ParamError::check_positive("body.wheelbase_m", self.wheelbase_m)?;
        ParamError::check_positive("body.track_m", self.track_m)
    }

    /// The pose of a body at `world_m` that faces `forward`; four wheels on the ground give height,
    /// pitch and roll.
    #[must_use]
    pub fn pose_on_ground(
        &self,
        world_m: DVec2,
        forward: DVec2,
        ground: &dyn Surface,
    ) -> RigidTransform {
        let forward = forward.normalize_or(DVec2::X);
        let left = forward.perp();
        let (f, l) = (
            forward * (self.wheelbase_m / 2.0),
            left * (self.track_m / 2.0),
        );
        let wheel = |offset: DVec2| ground.height_m(world_m + offset);
        let (front_left, front_right) = (wheel(f + l), wheel(f - l));
        let (back_left, back_right) = (wheel(l - f), wheel(-f - l));
        // The least-squares plane through four corners of a rectangle.
        let along = (front_left + front_right - back_left - back_right) / (2.0 * self.wheelbase_m);
        let across = (front_left + back_left - front_right - back_right) / (2.0 * self.track_m);
        let height = (front_left + front_right + back_left + back_right) / 4.0;
        let x = forward.extend(along);
        let z = x.cross(left.extend(across));
        let (x, z) = (x / x.length(), z / z.length());
        let rotation = DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z)).normalize();
        RigidTransform {
            rotation,
            translation_m: world_m.extend(height),
        }
    }
}

/// World poses of the body around a frame's time, evenly spaced.
#[derive(Clone, Debug)]
pub struct PoseTrack {
    half_s: f64,
    poses: Vec<RigidTransform>,
}

impl PoseTrack {
    /// Samples `pose_at` (seconds from the frame's time) from `-half_s` to `half_s`: at most
    /// 1/160 s apart in up to 12.8 s, and 2,049 times in more. Poses in between are interpolated.
    ///
    /// # Errors
    /// The first error of `pose_at`.
    pub fn sample<E>(
        half_s: f64,
        mut pose_at: impl FnMut(f64) -> Result<RigidTransform, E>,
    ) -> Result<Self, E> {
        const PER_S: f64 = 160.0;
        let half_s = half_s.max(1e-9);
        let half = (half_s * PER_S).ceil().clamp(8.0, 1024.0) as i32;
        let poses = (-half..=half)
            .map(|i| pose_at(f64::from(i) / f64::from(half) * half_s))
            .collect::<Result<_, E>>()?;
        Ok(Self { half_s, poses })
    }

    /// The pose at a time relative to the frame's, clamped to the track.
    #[must_use]
    pub fn at(&self, time_s: f64) -> RigidTransform {
        let last = (self.poses.len() - 1) as f64;
        let x = ((time_s / self.half_s + 1.0) / 2.0 * last).clamp(0.0, last);
        let i = (x as usize).min(self.poses.len() - 2);
        let t = x - i as f64;
        let (a, b) = (&self.poses[i], &self.poses[i + 1]);
        RigidTransform {
            // This is called for every pulse. Between samples a body turns by at most a hundredth
            // of a radian, for which linear interpolation differs from the arc by 1e-8.
            rotation: a.rotation.lerp(b.rotation, t),
            translation_m: a.translation_m.lerp(b.translation_m, t),
        }
    }

    /// All samples, in the order of time.
    #[must_use]
    pub fn poses(&self) -> &[RigidTransform] {
        &self.poses
    }

    /// The pose at the frame's time.
    #[must_use]
    pub fn middle(&self) -> RigidTransform {
        self.poses[self.poses.len() / 2]
    }

    /// The same track seen from a point: poses relative to `origin_m`.
    #[must_use]
    pub fn relative_to(&self, origin_m: DVec3) -> Self {
        let poses = self.poses.iter().map(|p| RigidTransform {
            translation_m: p.translation_m - origin_m,
            ..*p
        });
        Self {
            half_s: self.half_s,
            poses: poses.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::FlatSurface;
    use proptest::prelude::*;

    const BODY: Body = Body {
        wheelbase_m: 0.8,
        track_m: 0.6,
    };

    proptest! {
        #[test]
        fn a_body_lies_flat_on_a_slope(
            gx in -0.6_f64..0.6,
            gy in -0.6_f64..0.6,
            yaw in -3.1_f64..3.1,
        ) {
            let slope = FlatSurface {
                height_m: 3.0,
                gradient: DVec2::new(gx, gy),
            };
            let p = DVec2::new(12.0, -7.0);
            let pose = BODY.pose_on_ground(p, DVec2::from_angle(yaw), &slope);
            let up = pose.transform_vector(DVec3::Z);
            prop_assert!(up.distance(DVec3::new(-gx, -gy, 1.0).normalize()) < 1e-12);
            prop_assert!((pose.translation_m.z - slope.height_m(p)).abs() < 1e-12);
            let (forward, heading) = (
                pose.transform_vector(DVec3::X).truncate(),
                DVec2::from_angle(yaw),
            );
            prop_assert!(forward.dot(heading) > 0.0 && forward.perp_dot(heading).abs() < 1e-12);
        }
    }

    #[test]
    fn a_track_passes_through_its_samples() {
        let pose = |t: f64| -> Result<RigidTransform, ()> {
            Ok(RigidTransform::from_xyz_rpy(
                DVec3::new(t, t * t, 0.0),
                0.0,
                0.1 * t,
                t,
            ))
        };
        let track = PoseTrack::sample(0.1, pose).expect("no error");
        for t in [-0.1, -0.05, 0.0, 0.1] {
            let (a, b) = (track.at(t), pose(t).expect("no error"));
            assert!(
                a.translation_m.distance(b.translation_m) < 1e-12
                    && a.rotation.angle_between(b.rotation) < 1e-7
            );
        }
        assert_eq!(track.at(9.0), track.at(0.1));
        assert!(
            track
                .at(0.013)
                .translation_m
                .distance(pose(0.013).expect("no error").translation_m)
                < 1e-4
        );
    }
}
