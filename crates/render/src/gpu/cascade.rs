//! Cascaded shadow maps, and the part of the scene that each of them covers.

use bytemuck::Zeroable;
use glam::{DVec2, DVec3, Mat4, Vec3, Vec4};

use super::distortion_bounds::DistortionRecord;
use super::frame::FrameRecord;
use super::frustum::Frustum;
use crate::View;

/// How far towards the sun a caster may be from what it shades at least, metres.
const LEAST_CASTERS_M: f64 = 200.0;

/// The volume of a shadow map: a square prism along the sun's light, relative to the frame's
/// origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cascade {
    /// Across, up the map, and towards the sun; unit.
    axes: [DVec3; 3],
    /// The centre in these axes.
    centre: DVec3,
    half_m: f64,
    /// How far towards the sun beyond the prism what casts shadows into it may be, metres: as far
    /// from the camera as anything is visible.
    casters_m: f64,
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
                    casters_m: (range_m + half_m).max(LEAST_CASTERS_M),
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
            above(-z, -c.z - self.half_m - self.casters_m),
        ])
    }

    /// The side of a texel, metres.
    pub(crate) fn texel_m(&self) -> f64 {
        2.0 * self.half_m / f64::from(self.side)
    }

    /// The transform from scene axes around the origin to clip coordinates, in which z is greater
    /// nearer to the sun.
    pub(crate) fn clip(&self) -> Mat4 {
        let depth = 2.0 * self.half_m + self.casters_m;
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

#[cfg(test)]
mod tests {
    use super::super::frustum::BoundingSphere;
    use super::*;
    use nemoral_scene::{Intrinsics, RigidTransform};

    #[test]
    fn whatever_is_visible_may_cast_a_shadow_on_what_is_near() {
        let at_m = DVec3::new(3.0, -2.0, 1.0);
        let pose =
            RigidTransform::from_xyz_rpy(at_m, 0.0, 0.1, 0.7) * RigidTransform::body_from_optical();
        let view = View::new(Intrinsics::from_fov(96, 64, 1.2).expect("valid"), pose);
        let forward = pose.transform_vector(DVec3::Z);
        let sun = Vec3::new(0.8, 0.5, 0.3);
        let towards_sun = sun.as_dvec3() / sun.as_dvec3().length();
        for range_m in [60.0, 300.0, 800.0] {
            let cascades = Cascade::all(&view, at_m, range_m, sun, 512);
            let mut start_m = 0.0;
            for cascade in &cascades {
                let seen = forward * (0.5 * (start_m + cascade.end_m));
                start_m = cascade.end_m;
                for percent in 0..200 {
                    let caster = seen + towards_sun * (0.01 * f64::from(percent) * range_m);
                    if caster.length() > range_m {
                        continue;
                    }
                    let sphere = BoundingSphere {
                        centre: caster,
                        radius: 0.0,
                    };
                    assert!(cascade.frustum().may_see(&sphere), "{range_m}: {caster}");
                    let height = cascade.clip().project_point3(caster.as_vec3()).z;
                    assert!((0.0..=1.0).contains(&height), "{range_m}: {height}");
                }
            }
        }
    }
}
