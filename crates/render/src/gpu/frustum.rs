//! Frustum culling with bounding spheres for views and shadow maps: by the CPU for chunks, by the
//! GPU for instances.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, DVec4};
use nemoral_scene::Intrinsics;

use super::distortion_bounds::{DistortionBounds, widest_rad};
use crate::View;

/// A sphere relative to an origin, metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoundingSphere {
    pub(crate) centre: DVec3,
    pub(crate) radius: f64,
}

/// The space inside of all planes, within range of the eye, and within an angle of an axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frustum {
    /// Unit normals that point inwards; w is how far inside the origin is.
    planes: [DVec4; 6],
    eye: DVec3,
    range_m: f64,
    axis: DVec3,
    half_angle_rad: f64,
    /// The greatest distance of the eye from `eye` while the picture is taken.
    eye_travel_m: f64,
}

/// `Frustum` in `cull.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct FrustumRecord {
    planes: [[f32; 4]; 6],
    eye_and_range: [f32; 4],
    axis_and_travel: [f32; 4],
    /// Cosine and sine of the half angle.
    half_angle: [f32; 2],
    unused: [f32; 2],
}

/// A plane with everything inside.
pub(crate) const NO_PLANE: DVec4 = DVec4::new(0.0, 0.0, 0.0, 1e9);
/// A range that reaches everything, metres.
const FAR_M: f64 = 1e9;

impl Frustum {
    /// The frustum of a camera relative to `origin_m`; `distortion` is the view's.
    pub(crate) fn of_view(
        view: &View,
        distortion: Option<&DistortionBounds>,
        origin_m: DVec3,
        range_m: f64,
    ) -> Self {
        let pose = &view.scene_from_camera;
        let eye = pose.translation_m - origin_m;
        let mut frustum = Self {
            planes: [NO_PLANE; 6],
            eye,
            range_m,
            axis: pose.transform_vector(DVec3::Z),
            half_angle_rad: std::f64::consts::PI,
            eye_travel_m: 0.0,
        };
        if distortion.is_none() && !view.blurs() {
            for (plane, n) in frustum.planes.iter_mut().zip(pyramid(&view.intrinsics)) {
                let n = pose.transform_vector(n);
                *plane = n.extend(-n.dot(eye));
            }
        } else {
            let half_s = 0.5 * view.shutter.duration_s();
            let turn_rad = view.motion.angular_rad_s.length() * half_s;
            let widest = distortion.map_or_else(|| widest_rad(&view.intrinsics), |b| b.widest_rad);
            frustum.half_angle_rad = (widest + turn_rad + 1e-3).min(std::f64::consts::PI);
            frustum.eye_travel_m = view.motion.linear_m_s.length() * half_s;
        }
        frustum
    }

    /// The space between planes.
    pub(crate) fn from_planes(planes: [DVec4; 6]) -> Self {
        Self {
            planes,
            eye: DVec3::ZERO,
            range_m: FAR_M,
            axis: DVec3::Z,
            half_angle_rad: std::f64::consts::PI,
            eye_travel_m: 0.0,
        }
    }

    /// Whether any part of a sphere may be visible.
    pub(crate) fn may_see(&self, sphere: &BoundingSphere) -> bool {
        let inside = |plane: &DVec4| plane.dot(sphere.centre.extend(1.0)) >= -sphere.radius;
        let at = sphere.centre - self.eye;
        let (distance_m, radius) = (at.length(), sphere.radius + self.eye_travel_m);
        if !self.planes.iter().all(inside) || distance_m - radius > self.range_m {
            return false;
        }
        if distance_m <= radius {
            return true;
        }
        let seen_rad = libm::asin(radius / distance_m);
        at.angle_between(self.axis) <= self.half_angle_rad + seen_rad
    }

    /// The same for the GPU, relative to another origin, which lies at `origin` from this one.
    pub(crate) fn record(&self, origin: DVec3) -> FrustumRecord {
        let (sin, cos) = libm::sincos(self.half_angle_rad);
        let moved = |plane: DVec4| {
            let inside = plane.dot(origin.extend(1.0));
            plane.truncate().extend(inside).as_vec4().to_array()
        };
        let four = |v: DVec3, w: f64| v.extend(w).as_vec4().to_array();
        FrustumRecord {
            planes: self.planes.map(moved),
            eye_and_range: four(self.eye - origin, self.range_m),
            axis_and_travel: four(self.axis, self.eye_travel_m),
            half_angle: [cos as f32, sin as f32],
            unused: [0.0; 2],
        }
    }
}

/// The planes of a pinhole camera in its optical frame: left, right, top, bottom, front.
fn pyramid(k: &Intrinsics) -> [DVec3; 5] {
    let (w, h) = (f64::from(k.width), f64::from(k.height));
    [
        DVec3::new(k.fx, 0.0, k.cx),
        DVec3::new(-k.fx, 0.0, w - k.cx),
        DVec3::new(0.0, k.fy, k.cy),
        DVec3::new(0.0, -k.fy, h - k.cy),
        DVec3::Z,
    ]
    .map(|n| n / n.length())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec2};
    use nemoral_scene::{Distortion, RigidTransform, Shutter, Twist};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_a_bent_and_moving_picture_shows_is_seen(
            x in -30.0_f64..94.0,
            y in -20.0_f64..56.0,
            range_m in 0.05_f64..60.0,
            linear in prop::array::uniform3(-3.0_f64..3.0),
            angular in prop::array::uniform3(-2.0_f64..2.0),
        ) {
            let fisheye = Distortion::Fisheye {
                k1: -0.01,
                k2: 0.0,
                k3: 0.0,
                k4: 0.0,
            };
            let k = Intrinsics::through_lens(64, 36, 2.3, fisheye).expect("valid");
            let pose = RigidTransform {
                rotation: DQuat::from_rotation_z(0.7),
                translation_m: DVec3::new(3.0, -2.0, 1.0),
            };
            let view = View {
                shutter: Shutter {
                    exposure_s: 0.02,
                    readout_s: 0.04,
                },
                motion: Twist {
                    linear_m_s: DVec3::from_array(linear),
                    angular_rad_s: DVec3::from_array(angular),
                },
                ..View::new(k, pose)
            };
            let origin = DVec3::new(2.0, -2.0, 0.0);
            let frustum =
                Frustum::of_view(&view, DistortionBounds::of(&view).as_ref(), origin, 60.0);
            // Corners and borders are tested often.
            let pixel = DVec2::new(x, y).clamp(DVec2::ZERO, DVec2::new(64.0, 36.0));
            let ray = view.ray(pixel, 60.0);
            let place = ray.origin.as_dvec3() + ray.direction.as_dvec3() * range_m;
            let sphere = BoundingSphere {
                centre: place - origin,
                radius: 0.0,
            };
            prop_assert!(frustum.may_see(&sphere) || place.distance(pose.translation_m) > 60.0);
            // A sphere behind the camera is not visible.
            let behind = BoundingSphere {
                centre: pose.transform_point(DVec3::new(0.1 * x, 0.1 * y, -range_m - 10.0))
                    - origin,
                radius: 0.5,
            };
            prop_assert!(!frustum.may_see(&behind));
        }

        #[test]
        fn what_projects_into_the_picture_is_seen(
            x in -50.0_f64..50.0,
            y in -50.0_f64..50.0,
            z in -20.0_f64..80.0,
            radius in 0.0_f64..9.0,
            yaw in 0.0_f64..6.3,
        ) {
            let k = Intrinsics::from_fov(64, 36, 1.2).expect("valid");
            let pose = RigidTransform {
                rotation: DQuat::from_rotation_z(yaw),
                translation_m: DVec3::new(3.0, -2.0, 1.0),
            };
            let origin = DVec3::new(2.0, -2.0, 0.0);
            let frustum = Frustum::of_view(&View::new(k, pose), None, origin, 60.0);
            let optical = DVec3::new(x, y, z);
            let inside = k
                .project(optical)
                .is_some_and(|p| (0.0..=64.0).contains(&p.x) && (0.0..=36.0).contains(&p.y));
            let sphere = BoundingSphere {
                centre: pose.transform_point(optical) - origin,
                radius,
            };
            if inside && optical.length() <= 60.0 {
                prop_assert!(frustum.may_see(&sphere));
            }
            // A sphere far outside is not visible.
            if optical.z < -radius - 1e-6 || optical.length() > 60.0 + radius + 1e-6 {
                prop_assert!(!frustum.may_see(&sphere));
            }
        }
    }
}
