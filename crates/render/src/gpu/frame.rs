//! The record of a view for shaders.

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3, Mat4, Vec4};

use super::distortion_bounds::{DistortionBounds, DistortionRecord};
use crate::View;

/// Surfaces nearer than this are not drawn.
const NEAR_M: f64 = 0.01;

/// A frame's origin lies on a grid with this number of steps per metre, so that positions of chunks
/// are exact in f32.
pub(crate) const GRID_PER_M: f64 = 1024.0;

/// `Frame` in `surface.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct FrameRecord {
    /// Column by column.
    pub(crate) clip: [[f32; 4]; 4],
    pub(crate) origin: [f32; 4],
    pub(crate) eye: [f32; 4],
    pub(crate) forward: [f32; 4],
    pub(crate) right: [f32; 4],
    pub(crate) down: [f32; 4],
    pub(crate) size: [f32; 4],
    pub(crate) distortion: DistortionRecord,
}

impl FrameRecord {
    /// The record of a view around `origin_m`, which lies at `origin` from the instance buffer's
    /// origin.
    pub(crate) fn new(
        view: &View,
        distortion: Option<&DistortionBounds>,
        origin_m: DVec3,
        origin: DVec3,
        max_range_m: f32,
    ) -> Self {
        let k = &view.intrinsics;
        let (w, h) = (f64::from(k.width), f64::from(k.height));
        let axes = DMat3::from_quat(view.scene_from_camera.rotation);
        let eye = view.scene_from_camera.translation_m - origin_m;
        let (x, y, z) = (axes.x_axis, axes.y_axis, axes.z_axis);
        // Rows of the clip matrix, in scene axes about the eye.
        let rows = [
            (x * (2.0 * k.fx) + z * (2.0 * k.cx - w)) / w,
            -(y * (2.0 * k.fy) + z * (2.0 * k.cy - h)) / h,
            DVec3::ZERO,
            z,
        ];
        let constants = [0.0, 0.0, NEAR_M, 0.0];
        let row = |i: usize| -> Vec4 {
            let moved = constants[i] - rows[i].dot(eye);
            rows[i].extend(moved).as_vec4()
        };
        Self {
            clip: Mat4::from_cols(row(0), row(1), row(2), row(3))
                .transpose()
                .to_cols_array_2d(),
            origin: origin.as_vec3().extend(origin_m.z as f32).to_array(),
            eye: eye.as_vec3().extend(0.0).to_array(),
            forward: z.as_vec3().extend(max_range_m).to_array(),
            right: (x / k.fx).as_vec3().extend(k.cx as f32).to_array(),
            down: (y / k.fy).as_vec3().extend(k.cy as f32).to_array(),
            size: [w as f32, h as f32, NEAR_M as f32, 0.0],
            distortion: distortion.map_or_else(DistortionRecord::zeroed, |distortion| {
                distortion.record(view)
            }),
        }
    }
}

/// The point of the grid that is nearest to the camera.
pub(crate) fn origin_of(view: &View) -> DVec3 {
    (view.scene_from_camera.translation_m * GRID_PER_M).round() / GRID_PER_M
}
