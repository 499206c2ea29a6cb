//! Cascaded shadow maps, and the part of the scene that each of them covers.

use bytemuck::Zeroable;
use glam::{DVec2, DVec3, Mat4, Vec3, Vec4};

use super::distortion_bounds::DistortionRecord;
use super::frame::FrameRecord;
use super::frustum::Frustum;
use crate::View;

/// How far towards the sun a caster may be from what it shades, metres.
const CASTERS_M: f64 = 200.0;

/// The volume of a shadow map: a square prism along the sun's light, relative to the frame's
/// origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cascade {
    /// Across, up the map, and towards the sun; unit.
    axes: [DVec3; 3],
    /// The centre in these axes.
    centre: DVec3,
    half_m: f64,
    pub(crate) end_m: f64,
    /// The number of texels of a side.
    side: u32,
}

impl Cascade {
    /// The cascades of a view, the nearest first.
    pub(crate) fn all(
        view: &View,
        origin_m: DVec3,
        range_m: f64,
        sun: Vec3,
        side: u32,
    ) -> Vec<Self> {
        let pose = &view.scene_from_camera;
        let (w, h) = (
            f64::from(view.intrinsics.width),
            f64::from(view.intrinsics.height),
        );
        let corners = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)]
            .map(|(x, y)| pose.transform_vector(view.intrinsics.direction(DVec2::new(x, y))));
        let forward = pose.transform_vector(DVec3::Z);
        let towards_sun = sun.as_dvec3() / sun.as_dvec3().length();
        let (across, up) = towards_sun.any_orthonormal_pair();
        let axes = [across, up, towards_sun];
        let ends = [0.0, 7.0, 24.0, 80.0, range_m].map(|e: f64| e.min(range_m));
        ends.windows(2)
            .map(|ends| {
                let middle = 0.5 * (ends[0] + ends[1]);
                let reach = |d: &DVec3| {
                    let far = |end: f64| (*d * end - forward * middle).length();
                    far(ends[0]).max(far(ends[1]))
                };
                let half_m = corners.iter().map(reach).fold(1.0, f64::max);
                // The centre is moved in whole texels, so that the shadow of a still object is
                // still.
                let texel = 2.0 * half_m / f64::from(side);
                let middle = pose.translation_m + forward * middle;
                let snap =
                    |axis: DVec3| (axis.dot(middle) / texel).round() * texel - axis.dot(origin_m);
                let depth = towards_sun.dot(middle - origin_m);
                Self {
                    axes,
                    centre: DVec3::new(snap(across), snap(up), depth),
                    half_m,
                    end_m: ends[1],
                    side,
                }
            })
            .collect()
    }

    /// The volume of everything that may cast a shadow on visible surfaces.
    pub(crate) fn frustum(&self) -> Frustum {
        let [x, y, z] = self.axes;
        let c = self.centre;
        let above = |n: DVec3, least: f64| n.extend(-least);
        Frustum::from_planes([
            above(x, c.x - self.half_m),
            above(-x, -c.x - self.half_m),
            above(y, c.y - self.half_m),
            above(-y, -c.y - self.half_m),
            above(z, c.z - self.half_m),
            above(-z, -c.z - self.half_m - CASTERS_M),
        ])
    }

    /// The side of a texel, metres.
    pub(crate) fn texel_m(&self) -> f64 {
        2.0 * self.half_m / f64::from(self.side)
    }

    /// The transform from scene axes around the origin to clip coordinates, in which z is greater
    /// nearer to the sun.
    pub(crate) fn clip(&self) -> Mat4 {
        let depth = 2.0 * self.half_m + CASTERS_M;
        let row = |axis: DVec3, at: f64, size: f64, plus: f64| -> Vec4 {
            (axis / size).extend(plus - at / size).as_vec4()
        };
        let [x, y, z] = self.axes;
        let c = self.centre;
        Mat4::from_cols(
            row(x, c.x, self.half_m, 0.0),
            row(y, c.y, self.half_m, 0.0),
            row(z, c.z - self.half_m, depth, 0.0),
            Vec4::W,
        )
        .transpose()
    }

    /// The record of the cascade for shaders; `origin` is the frame's origin relative to the
    /// instance buffer's.
    pub(crate) fn frame(&self, origin: DVec3) -> FrameRecord {
        let [x, y, z] = self.axes;
        let corner = x * (self.centre.x - self.half_m)
            + y * (self.centre.y + self.half_m)
            + z * (self.centre.z + self.half_m);
        let texel = self.texel_m();
        let side = self.side as f32;
        FrameRecord {
            clip: self.clip().to_cols_array_2d(),
            origin: origin.as_vec3().extend(0.0).to_array(),
            eye: corner.as_vec3().extend(0.0).to_array(),
            forward: (-z).as_vec3().extend(0.0).to_array(),
            right: (x * texel).as_vec3().extend(0.0).to_array(),
            down: (-y * texel).as_vec3().extend(0.0).to_array(),
            size: [side, side, 0.0, 0.0],
            distortion: DistortionRecord::zeroed(),
        }
    }
}
