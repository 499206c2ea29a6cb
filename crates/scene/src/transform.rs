//! Rigid transforms in f64.

use glam::{DMat3, DQuat, DVec2, DVec3};

/// A rotation followed by a translation: poses and mounts.
///
/// Named `target_from_source`, so that `world_from_body * body_from_lidar` is `world_from_lidar`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidTransform {
    /// The rotation; unit length.
    pub rotation: DQuat,
    /// The source's origin in the target frame, metres.
    pub translation_m: DVec3,
}

impl RigidTransform {
    /// The identity.
    pub const IDENTITY: Self = Self {
        rotation: DQuat::IDENTITY,
        translation_m: DVec3::ZERO,
    };

    /// `optical_from_body`-style axes: the rotation that takes a camera's optical frame (x right,
    /// y down, z forward) to a body frame (x forward, y left, z up): `body_from_optical`.
    #[must_use]
    pub fn body_from_optical() -> Self {
        let axes = DMat3::from_cols(-DVec3::Y, -DVec3::Z, DVec3::X);
        Self {
            rotation: DQuat::from_mat3(&axes),
            translation_m: DVec3::ZERO,
        }
    }

    /// A pose by position and roll, pitch, yaw in radians (yaw about z, then pitch about the new y,
    /// then roll about the new x; positive pitch points the nose down, as in REP-103).
    #[must_use]
    pub fn from_xyz_rpy(translation_m: DVec3, roll_rad: f64, pitch_rad: f64, yaw_rad: f64) -> Self {
        let rotation = DQuat::from_rotation_z(yaw_rad)
            * DQuat::from_rotation_y(pitch_rad)
            * DQuat::from_rotation_x(roll_rad);
        Self {
            rotation,
            translation_m,
        }
    }

    /// The transform from the target frame to the source frame.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self {
            rotation,
            translation_m: -(rotation * self.translation_m),
        }
    }

    /// Transforms a point from the source frame to the target frame.
    #[inline]
    #[must_use]
    pub fn transform_point(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.translation_m
    }

    /// Transforms a direction from the source frame to the target frame.
    #[inline]
    #[must_use]
    pub fn transform_vector(&self, vector: DVec3) -> DVec3 {
        self.rotation * vector
    }

    /// The level direction to the left of where a body heads, of length 1 in the target frame,
    /// however the body rolls and pitches. Of one that looks straight up or down, it is that to
    /// which its own left points.
    #[must_use]
    pub fn level_left(&self) -> DVec3 {
        // Shorter ones are roundings of a vertical direction.
        const SHORTEST: f64 = 1e-9;
        let heading = self.transform_vector(DVec3::X).truncate();
        let left = if heading.length() > SHORTEST {
            heading.perp()
        } else {
            self.transform_vector(DVec3::Y).truncate()
        };
        left.normalize_or(DVec2::Y).extend(0.0)
    }

    /// The 3 × 4 matrix, row-major, as KITTI writes it.
    #[must_use]
    pub fn to_rows(&self) -> [[f64; 4]; 3] {
        let m = DMat3::from_quat(self.rotation);
        let t = self.translation_m;
        [
            [m.x_axis.x, m.y_axis.x, m.z_axis.x, t.x],
            [m.x_axis.y, m.y_axis.y, m.z_axis.y, t.y],
            [m.x_axis.z, m.y_axis.z, m.z_axis.z, t.z],
        ]
    }
}

impl std::ops::Mul for RigidTransform {
    type Output = Self;

    fn mul(self, inner: Self) -> Self {
        Self {
            rotation: (self.rotation * inner.rotation).normalize(),
            translation_m: self.transform_point(inner.translation_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_optical_axes_are_right_down_forward() {
        let t = RigidTransform::body_from_optical();
        for (optical, body) in [
            (DVec3::Z, DVec3::X),
            (DVec3::X, -DVec3::Y),
            (DVec3::Y, -DVec3::Z),
        ] {
            assert!(t.transform_vector(optical).distance(body) < 1e-12);
        }
    }

    #[test]
    fn inverse_and_product() {
        let a = RigidTransform::from_xyz_rpy(DVec3::new(1.0, 2.0, 3.0), 0.1, -0.2, 2.0);
        let b = RigidTransform::from_xyz_rpy(DVec3::new(-4.0, 0.5, 1.0), -0.3, 0.2, -1.0);
        let p = DVec3::new(0.3, -7.0, 2.0);
        assert!(
            (a * b)
                .transform_point(p)
                .distance(a.transform_point(b.transform_point(p)))
                < 1e-12
        );
        assert!((a.inverse() * a).transform_point(p).distance(p) < 1e-12);
        let rows = a.to_rows();
        let by_rows = DVec3::from_array(std::array::from_fn(|i| {
            rows[i][0] * p.x + rows[i][1] * p.y + rows[i][2] * p.z + rows[i][3]
        }));
        assert!(by_rows.distance(a.transform_point(p)) < 1e-12);
    }

    #[test]
    fn the_level_left_is_that_of_the_heading_alone() {
        for yaw in [0.0, 0.7, 2.5, -1.9] {
            let left = DVec3::new(-libm::sin(yaw), libm::cos(yaw), 0.0);
            for (roll, pitch) in [(0.0, 0.0), (0.05, 0.0), (-1.2, 0.4), (0.3, -1.3)] {
                let pose = RigidTransform::from_xyz_rpy(DVec3::X, roll, pitch, yaw);
                let found = pose.level_left();
                assert!(found.distance(left) < 1e-12, "{found}, not {left}");
            }
        }
        // It looks straight down, and its left is south.
        let down = DMat3::from_cols(-DVec3::Z, -DVec3::Y, -DVec3::X);
        let down = RigidTransform {
            rotation: DQuat::from_mat3(&down),
            ..RigidTransform::IDENTITY
        };
        assert!(down.level_left().distance(-DVec3::Y) < 1e-9);
    }

    #[test]
    fn positive_pitch_points_the_nose_down() {
        let t = RigidTransform::from_xyz_rpy(DVec3::ZERO, 0.0, 0.3, 0.0);
        assert!(t.transform_vector(DVec3::X).z < 0.0);
    }
}
