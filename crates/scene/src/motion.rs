//! Motion while a picture is taken.

use glam::{DQuat, DVec2, DVec3};

use crate::{Intrinsics, RigidTransform};

/// How a frame moves around a time: its origin along a straight line and its axes about a fixed
/// one, both at a constant rate. This describes a robot well over the hundredth of a second that a
/// picture takes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Twist {
    /// Velocity of the origin, in the frame's own axes at that time, m/s.
    pub linear_m_s: DVec3,
    /// Angular velocity, in the same axes, right-handed, rad/s.
    pub angular_rad_s: DVec3,
}

impl Twist {
    /// No motion.
    pub const STILL: Self = Self {
        linear_m_s: DVec3::ZERO,
        angular_rad_s: DVec3::ZERO,
    };

    /// Whether nothing moves.
    #[must_use]
    pub fn is_still(&self) -> bool {
        *self == Self::STILL
    }

    /// The motion from one pose to another in `duration_s`, about the time halfway between. Less
    /// than half a turn lies between them.
    #[must_use]
    pub fn between(first: &RigidTransform, last: &RigidTransform, duration_s: f64) -> Self {
        if first == last {
            return Self::STILL;
        }
        let turn = rotation_vector(first.rotation.inverse() * last.rotation);
        let halfway = first.rotation * DQuat::from_scaled_axis(turn / 2.0);
        let way = last.translation_m - first.translation_m;
        Self {
            linear_m_s: halfway.inverse() * way / duration_s,
            angular_rad_s: turn / duration_s,
        }
    }

    /// The transform to the frame at that time from the same frame `time_s` later (or earlier).
    #[inline]
    #[must_use]
    pub fn after(&self, time_s: f64) -> RigidTransform {
        RigidTransform {
            rotation: DQuat::from_scaled_axis(self.angular_rad_s * time_s),
            translation_m: self.linear_m_s * time_s,
        }
    }

    /// The motion of something that is mounted on this frame. Its origin moves on a straight line,
    /// too, the tangent of the arc on which a rigid mount takes it: after t seconds these are half
    /// of m ω² t² apart, with m the distance from this origin and ω the angular velocity.
    #[must_use]
    pub fn of_mounted(&self, here_from_mounted: &RigidTransform) -> Self {
        let back = here_from_mounted.rotation.inverse();
        let swing = self.angular_rad_s.cross(here_from_mounted.translation_m);
        Self {
            linear_m_s: back * (self.linear_m_s + swing),
            angular_rad_s: back * self.angular_rad_s,
        }
    }
}

/// The axis of a rotation times its angle, radians, at most π: the shorter way around, whichever of
/// the two quaternions of a rotation it is. The smallest rotations count, too.
#[must_use]
pub fn rotation_vector(rotation: DQuat) -> DVec3 {
    // Below this, atan(x) is x to the last bit.
    const SMALL: f64 = 1e-9;
    let q = if rotation.w < 0.0 {
        -rotation
    } else {
        rotation
    };
    let axis = q.xyz();
    let sine = axis.length();
    if sine < SMALL {
        axis * (2.0 / q.w)
    } else {
        axis * (2.0 * libm::atan2(sine, q.w) / sine)
    }
}

/// When the rows of a picture are exposed: row by row from the first to the last, each for the
/// exposure time. The picture's time is the middle row's, in the middle of its exposure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Shutter {
    /// How long a row is exposed, seconds; 0 for an instant.
    pub exposure_s: f64,
    /// From the upper edge of the first row to the lower edge of the last one, seconds, which is
    /// the time between rows times their number; 0 if all rows are exposed together (a global
    /// shutter).
    pub readout_s: f64,
}

impl Shutter {
    /// All rows are exposed at one instant.
    pub const INSTANT: Self = Self {
        exposure_s: 0.0,
        readout_s: 0.0,
    };

    /// Whether all rows are exposed at one instant.
    #[must_use]
    pub fn is_instant(&self) -> bool {
        *self == Self::INSTANT
    }

    /// The middle of the exposure at an image position `y_px` from the top, after the picture's
    /// time.
    #[inline]
    #[must_use]
    pub fn row_time_s(&self, y_px: f64, height_px: u32) -> f64 {
        self.readout_s * (y_px / f64::from(height_px) - 0.5)
    }

    /// The time from the start of the first row's exposure to the end of the last one's, seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.exposure_s + self.readout_s
    }
}

impl Intrinsics {
    /// The image position of a point of the optical frame at the picture's time, if the camera
    /// moves while its rows are read: where the row that sees the point is exposed as the point
    /// passes. As [`Intrinsics::project`] if the shutter is global.
    ///
    /// `None` behind the camera. A point that crosses the picture faster than its rows are read, so
    /// that no row or several rows see it, is not found.
    #[must_use]
    pub fn project_moving(&self, point: DVec3, shutter: &Shutter, motion: &Twist) -> Option<DVec2> {
        /// The greatest number of steps. Each step reduces the error to the share of the picture
        /// that the point crosses meanwhile.
        const STEPS: u32 = 64;
        let mut at = self.project(point)?;
        if shutter.readout_s == 0.0 || *motion == Twist::STILL {
            return Some(at);
        }
        let height = f64::from(self.height);
        for _ in 0..STEPS {
            // Outside the picture the shutter is extended for a while; it need not be right there.
            let y = at.y.clamp(-height, 2.0 * height);
            let then = motion.after(shutter.row_time_s(y, self.height)).inverse();
            let next = self.project(then.transform_point(point))?;
            if next.distance(at) < 1e-7 {
                return Some(next);
            }
            at = next;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector(most: f64) -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-most..most).prop_map(DVec3::from_array)
    }

    fn close(a: &RigidTransform, b: &RigidTransform) -> bool {
        a.translation_m.distance(b.translation_m) < 1e-9
            && a.rotation.dot(b.rotation).abs() > 1.0 - 1e-12
    }

    #[test]
    fn a_mounted_origin_moves_on_the_tangent_of_its_arc() {
        let twist = Twist {
            linear_m_s: DVec3::ZERO,
            angular_rad_s: DVec3::Z,
        };
        let mount =
            RigidTransform::from_xyz_rpy(DVec3::X * 2.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2);
        let straight = mount * twist.of_mounted(&mount).after(0.05);
        assert!(straight.translation_m.distance(DVec3::new(2.0, 0.1, 0.0)) < 1e-12);
        let rigid = twist.after(0.05) * mount;
        let off_m = straight.translation_m.distance(rigid.translation_m);
        assert!((off_m - 0.002_5).abs() < 1e-5, "{off_m}");
        assert!(close(
            &RigidTransform {
                translation_m: rigid.translation_m,
                ..straight
            },
            &rigid
        ));
    }

    proptest! {
        #[test]
        fn a_twist_goes_from_the_first_pose_to_the_last(
            at in vector(100.0),
            rpy in vector(1.5),
            way in vector(2.0),
            turn in vector(1.0),
            duration in 0.001_f64..0.5,
        ) {
            let first = RigidTransform::from_xyz_rpy(at, rpy.x, rpy.y, rpy.z);
            let last = RigidTransform {
                rotation: first.rotation * DQuat::from_scaled_axis(turn),
                translation_m: at + way,
            };
            let twist = Twist::between(&first, &last, duration);
            // The same rotation has two quaternions.
            let other = RigidTransform {
                rotation: -last.rotation,
                ..last
            };
            prop_assert_eq!(Twist::between(&first, &other, duration), twist);
            // Half of the duration, from the middle in both directions.
            let middle = RigidTransform {
                rotation: first.rotation * DQuat::from_scaled_axis(turn / 2.0),
                translation_m: at + way / 2.0,
            };
            prop_assert!(close(&(middle * twist.after(duration / 2.0)), &last));
            prop_assert!(close(&(middle * twist.after(-duration / 2.0)), &first));
        }

        #[test]
        fn rotation_vectors_are_exact_at_any_size(turn in vector(1.0), exponent in -12_i32..1) {
            let turn = turn * 10_f64.powi(exponent);
            let found = rotation_vector(DQuat::from_scaled_axis(turn));
            prop_assert!(found.distance(turn) <= 4e-15 * turn.length(), "{found} {turn}");
        }

        /// What is mounted on a moving body follows the body, to the second order in time.
        #[test]
        fn what_is_mounted_moves_with_its_carrier(
            linear in vector(5.0),
            angular in vector(1.0),
            at in vector(1.0),
            rpy in vector(1.5),
        ) {
            let twist = Twist {
                linear_m_s: linear,
                angular_rad_s: angular,
            };
            let mount = RigidTransform::from_xyz_rpy(at, rpy.x, rpy.y, rpy.z);
            let mounted = twist.of_mounted(&mount);
            for time in [-0.01, 0.004] {
                let carried = mount.inverse() * twist.after(time) * mount;
                let (a, b) = (carried, mounted.after(time));
                prop_assert!(a.translation_m.distance(b.translation_m) < 6.0 * time * time);
                prop_assert!(a.rotation.dot(b.rotation).abs() > 1.0 - 1e-12);
            }
        }

        /// A point on the ray of an image position at the time of its row is projected to that
        /// position.
        #[test]
        fn moving_pictures_project_back(
            linear in vector(3.0),
            angular in vector(1.0),
            x in 0.0_f64..640.0,
            y in 0.0_f64..360.0,
            far in 1.0_f64..100.0,
            readout in 0.0_f64..0.05,
        ) {
            let k = Intrinsics::from_fov(640, 360, 1.4).expect("valid");
            let shutter = Shutter {
                exposure_s: 0.0,
                readout_s: readout,
            };
            let motion = Twist {
                linear_m_s: linear,
                angular_rad_s: angular,
            };
            let pixel = DVec2::new(x, y);
            let then = motion.after(shutter.row_time_s(y, k.height));
            let point = then.transform_point(k.direction(pixel) * far);
            let back = k
                .project_moving(point, &shutter, &motion)
                .expect("in front");
            prop_assert!(back.distance(pixel) < 1e-5, "{back} for {pixel}");
        }
    }

    /// Moving sideways at v past a wall at z shifts a row by f v t / z.
    #[test]
    fn the_skew_of_a_rolling_shutter() {
        let k = Intrinsics::from_fov(640, 480, 1.2).expect("valid");
        let shutter = Shutter {
            exposure_s: 0.01,
            readout_s: 0.03,
        };
        let motion = Twist {
            linear_m_s: DVec3::X * 2.0,
            angular_rad_s: DVec3::ZERO,
        };
        for row in [0.0, 100.0, 240.0, 480.0] {
            let y = (row - k.cy) / k.fy * 4.0;
            let at = k.project_moving(DVec3::new(0.0, y, 4.0), &shutter, &motion);
            let skew = -k.fx * 2.0 / 4.0 * 0.03 * (row / 480.0 - 0.5);
            let at = at.expect("in front");
            assert!((at - DVec2::new(k.cx + skew, row)).length() < 1e-6, "{at}");
        }
        assert_eq!(shutter.duration_s(), 0.04);
    }
}
