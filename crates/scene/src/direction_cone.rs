//! Cones that bound directions.

use glam::DVec3;

/// All directions within an angle of an axis: what a sensor sees, at most (pbrt-v4's
/// `DirectionCone`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionCone {
    /// The axis, a unit vector.
    pub axis: DVec3,
    /// The greatest angle to the axis, radians, 0 to π.
    pub half_angle_rad: f64,
}

impl DirectionCone {
    /// All directions there are.
    pub const ALL: Self = Self {
        axis: DVec3::X,
        half_angle_rad: std::f64::consts::PI,
    };

    /// The smallest cone around an axis that contains these unit vectors.
    #[must_use]
    pub fn around(axis: DVec3, directions: impl IntoIterator<Item = DVec3>) -> Self {
        let angles = directions.into_iter().map(|d| axis.angle_between(d));
        Self {
            axis,
            half_angle_rad: angles.fold(0.0, f64::max),
        }
    }

    /// Whether it contains a unit vector.
    #[must_use]
    pub fn contains(&self, direction: DVec3) -> bool {
        self.axis.angle_between(direction) <= self.half_angle_rad
    }
}
