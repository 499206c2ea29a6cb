//! Rays.

use glam::Vec3;

/// A ray in a frame's scene. `direction` has unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The start of the ray, metres.
    pub origin: Vec3,
    /// The direction; unit length.
    pub direction: Vec3,
    /// Hits nearer than this are ignored, metres.
    pub t_min_m: f32,
    /// Hits farther than this are ignored, metres.
    pub t_max_m: f32,
}

impl Ray {
    /// A ray from the origin to infinity.
    #[must_use]
    pub const fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            t_min_m: 0.0,
            t_max_m: f32::INFINITY,
        }
    }

    /// The point at a distance.
    #[inline]
    #[must_use]
    pub fn at(&self, distance_m: f32) -> Vec3 {
        self.origin + self.direction * distance_m
    }

    /// Whether a hit at this distance counts: `t_min_m <= distance_m <= t_max_m`, which is false
    /// for NaN.
    #[inline]
    #[must_use]
    pub fn reaches(&self, distance_m: f32) -> bool {
        distance_m >= self.t_min_m && distance_m <= self.t_max_m
    }
}
