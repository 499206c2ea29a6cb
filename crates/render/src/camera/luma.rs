//! Brightness of code values.

use glam::Vec3;

/// The luma of code values (ITU-R BT.601, as in JFIF).
pub(super) fn luma(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.299, 0.587, 0.114))
}
