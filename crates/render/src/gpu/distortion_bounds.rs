//! Bounds on the positions of primitives in pictures with lenses and rolling shutters, for a
//! rasteriser.
//!
//! A rasteriser keeps straight lines straight, and draws an instant. A distorted picture is drawn
//! by boxes around the images of primitives; each fragment then intersects the primitive with its
//! pixel's own ray from its row's own position, so that the truth is as exact as with a pinhole. A
//! box may be too large, but never too small: it contains the images of the corners, enlarged by
//! how far the surface between them may bulge. If D projects directions and |D″| ≤ K along great
//! circles, points between corners that are δ apart are at most K δ² / 6 from their hull (the
//! remainder of linear interpolation in a triangle whose circumcircle has the radius δ / √3).

use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3};
use nemoral_scene::{Distortion, Intrinsics};

use crate::View;

/// The last fields of `Frame` in `surface.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct DistortionRecord {
    lens: [f32; 4],
    radial: [f32; 4],
    widest: [f32; 4],
    linear: [f32; 4],
    angular: [f32; 4],
    curvature: [f32; STEPS],
}

/// The number of steps of the angle to the axis that the curvature is tabulated in. It must equal
/// that in `surface.wgsl`.
const STEPS: usize = 16;
/// Primitives with a larger angular width are drawn everywhere; as in `surface.wgsl`.
const LARGE_RAD: f64 = 0.5;

/// The error of the GPU's arithmetic, pixels: its arctangent is exact to at least 12 bits (Vulkan's
/// "Precision of GLSL.std.450 instructions"), and a picture's radius is some thousand pixels.
const ARITHMETIC_PX: f64 = 0.75;

/// The radial part of a lens's projection of directions, continued beyond the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DistortionBounds {
    intrinsics: Intrinsics,
    /// The angle to the axis of the widest ray in the picture; beyond it, radii grow linearly.
    pub(crate) widest_rad: f64,
    radius: f64,
    slope: f64,
    /// The greatest distance of a pixel from the position where this model projects its ray,
    /// pixels.
    beside_px: f64,
    curvature: [f64; STEPS],
}

impl DistortionBounds {
    /// The bounds of a view; `None` if its picture is not distorted.
    pub(crate) fn of(view: &View) -> Option<Self> {
        let straight = view.intrinsics.distortion == Distortion::None;
        (!straight || view.rolls()).then(|| Self::new(view.intrinsics))
    }

    fn new(k: Intrinsics) -> Self {
        const H: f64 = 1e-6;
        let widest_rad = widest_rad(&k);
        let radius = k.distortion.radius(widest_rad);
        let mut bounds = Self {
            intrinsics: k,
            widest_rad,
            radius,
            slope: (radius - k.distortion.radius(widest_rad - H)) / H,
            beside_px: 0.0,
            curvature: [0.0; STEPS],
        };
        let beside = rays(&k).map(|(pixel, ray)| bounds.draw(ray).distance(pixel));
        // Between the sampled places it may be slightly more.
        bounds.beside_px = 1.25 * beside.fold(0.0, f64::max);
        bounds.curvature = bounds.curvature();
        bounds
    }

    /// Where a ray is projected, pixels.
    fn draw(&self, ray: DVec3) -> DVec2 {
        let k = &self.intrinsics;
        let angle = angle(ray);
        let radius = if angle < self.widest_rad {
            k.distortion.radius(angle)
        } else {
            self.radius + self.slope * (angle - self.widest_rad)
        };
        let across = ray.truncate();
        let way = across / across.length().max(1e-20);
        DVec2::new(k.cx, k.cy) + DVec2::new(k.fx, k.fy) * way * radius
    }

    /// The greatest second derivative along great circles, pixels per radian squared, of directions
    /// up to each of the steps from the axis.
    fn curvature(&self) -> [f64; STEPS] {
        const H: f64 = 1e-3;
        const FINER: usize = 8;
        const WAYS: usize = 8;
        let reach = self.widest_rad + LARGE_RAD;
        // It is rotationally symmetric if the longer focal length is used for both axes.
        let mut even = *self;
        even.intrinsics.fx = self.intrinsics.fx.max(self.intrinsics.fy);
        even.intrinsics.fy = even.intrinsics.fx;
        let mut most = 0.0_f64;
        std::array::from_fn(|step| {
            for i in 0..=FINER {
                let part = (step * FINER + i) as f64 / (STEPS * FINER) as f64;
                let (sin, cos) = libm::sincos(reach * part);
                let ray = DVec3::new(sin, 0.0, cos);
                let (outwards, around) = (DVec3::new(cos, 0.0, -sin), DVec3::Y);
                for way in 0..WAYS {
                    let turn = way as f64 * std::f64::consts::PI / WAYS as f64;
                    let (s, c) = libm::sincos(turn);
                    let aside = (outwards * c + around * s) * libm::tan(H);
                    let [before, here, after] =
                        [ray - aside, ray, ray + aside].map(|ray| even.draw(ray));
                    let bent = (before + after - here * 2.0).length() / (H * H);
                    most = most.max(bent);
                }
            }
            1.1 * most
        })
    }

    /// The record for the shader; `view` is the one that these bounds were made for.
    pub(crate) fn record(&self, view: &View) -> DistortionRecord {
        let k = &self.intrinsics;
        let readout_s = if view.rolls() {
            view.shutter.readout_s
        } else {
            0.0
        };
        let (radial, by_angle) = match k.distortion {
            Distortion::Fisheye { k1, k2, k3, k4 } => ([k1, k2, k3, k4], 1.0),
            Distortion::BrownConrady { k1, k2, k3, .. } => ([k1, k2, k3, 0.0], 0.0),
            _ => ([0.0; 4], 0.0),
        };
        DistortionRecord {
            lens: [k.fx, k.fy, k.cx, k.cy].map(|x| x as f32),
            radial: radial.map(|x| x as f32),
            widest: [self.widest_rad, self.radius, self.slope, by_angle].map(|x| x as f32),
            linear: (view.motion.linear_m_s * readout_s)
                .as_vec3()
                .extend((self.beside_px + ARITHMETIC_PX) as f32)
                .to_array(),
            angular: (view.motion.angular_rad_s * readout_s)
                .as_vec3()
                .extend(0.0)
                .to_array(),
            curvature: self.curvature.map(|x| x as f32),
        }
    }
}

/// The angle to the axis of the widest ray in a picture.
pub(crate) fn widest_rad(k: &Intrinsics) -> f64 {
    rays(k).map(|(_, ray)| angle(ray)).fold(0.0, f64::max)
}

/// Places all over a picture, including its corners, and their rays.
fn rays(k: &Intrinsics) -> impl Iterator<Item = (DVec2, DVec3)> {
    const SIDE: u32 = 48;
    let size = DVec2::new(f64::from(k.width), f64::from(k.height));
    let places = (0..=SIDE).flat_map(|row| (0..=SIDE).map(move |column| (column, row)));
    places.map(move |(column, row)| {
        let pixel = size * DVec2::new(column.into(), row.into()) / f64::from(SIDE);
        (pixel, k.direction(pixel))
    })
}

/// The angle to the optical axis, radians.
fn angle(ray: DVec3) -> f64 {
    libm::atan2(ray.truncate().length(), ray.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::{RigidTransform, Shutter, Twist};
    use proptest::prelude::*;
    use std::sync::LazyLock;

    fn lenses() -> [Intrinsics; 5] {
        let brown = |k1, k2, p1, p2| Distortion::BrownConrady {
            k1,
            k2,
            k3: 0.0,
            p1,
            p2,
        };
        let fisheye = |k1, k2| Distortion::Fisheye {
            k1,
            k2,
            k3: 0.0,
            k4: 0.0,
        };
        [
            (1.3, Distortion::None),
            (1.7, brown(-0.2, 0.03, 0.002, -0.001)),
            (1.2, brown(0.3, 0.1, 0.0, 0.003)),
            (2.3, fisheye(-0.01, 0.0)),
            (0.8, fisheye(0.1, -0.05)),
        ]
        .map(|(fov_rad, lens)| {
            Intrinsics::through_lens(640, 480, fov_rad, lens).expect("a sound lens")
        })
    }

    static LENSES: LazyLock<[DistortionBounds; 5]> =
        LazyLock::new(|| lenses().map(DistortionBounds::new));

    proptest! {
        /// This tests the margin of `box` in `surface.wgsl`.
        #[test]
        fn what_lies_between_corners_is_drawn_near_their_hull(
            lens in 0_usize..5,
            at in prop::array::uniform2(-60.0..700.0_f64),
            range_m in 0.3_f64..50.0,
            size in 0.001_f64..0.3,
            corners in prop::array::uniform3(prop::array::uniform3(-1.0_f64..1.0)),
            inwards in 0.0_f64..0.02,
        ) {
            let bounds = &LENSES[lens];
            let k = bounds.intrinsics;
            let pixel = DVec2::from_array(at).clamp(DVec2::ZERO, DVec2::new(640.0, 480.0));
            let middle = k.direction(pixel) * range_m;
            let corners = corners.map(|c| middle + DVec3::from_array(c) * size * range_m);
            let rays = corners.map(DVec3::normalize);
            let width = 1.02
                * (rays[0].distance(rays[1]))
                    .max(rays[1].distance(rays[2]))
                    .max(rays[2].distance(rays[0]));
            prop_assume!(width < LARGE_RAD);
            let front = rays.map(angle).into_iter().fold(9.0, f64::min);
            let step = ((front + width) / (bounds.widest_rad + LARGE_RAD) * STEPS as f64) as usize;
            let margin =
                bounds.beside_px + bounds.curvature[step.min(STEPS - 1)] * width * width * 0.25;
            let drawn = rays.map(|ray| bounds.draw(ray));

            // Points in the middles of sides are farthest out.
            let point = (corners[0] + corners[1]) * 0.5 + (corners[2] - corners[0]) * inwards;
            let place = k
                .project(point)
                .filter(|p| p.cmpge(DVec2::ZERO).all() && p.cmple(DVec2::new(640.0, 480.0)).all());
            let across = (drawn[1] - drawn[0]).perp().normalize_or(DVec2::X);
            for way in [across, -across] {
                let reach = drawn
                    .map(|d| d.dot(way))
                    .into_iter()
                    .fold(f64::MIN, f64::max);
                if let Some(place) = place {
                    prop_assert!(
                        place.dot(way) <= reach + margin,
                        "{place} beside {drawn:?} by {}",
                        place.dot(way) - reach
                    );
                }
            }
        }

        #[test]
        fn an_instant_later_has_the_rays_of_that_time(
            x in 0.0_f64..640.0,
            y in 0.0_f64..480.0,
            offset_s in -0.05_f64..0.05,
            linear in prop::array::uniform3(-3.0_f64..3.0),
            angular in prop::array::uniform3(-3.0_f64..3.0),
        ) {
            let pose = RigidTransform::from_xyz_rpy(DVec3::new(3.0, -2.0, 1.0), 0.1, 0.2, 2.0)
                * RigidTransform::body_from_optical();
            let view = View {
                shutter: Shutter {
                    exposure_s: 0.1,
                    readout_s: 0.04,
                },
                motion: Twist {
                    linear_m_s: DVec3::from_array(linear),
                    angular_rad_s: DVec3::from_array(angular),
                },
                ..View::new(lenses()[0], pose)
            };
            let (then, asked) = (view.later(offset_s), DVec2::new(x, y));
            let (a, b) = (then.ray(asked, 9.0), view.ray_at(asked, offset_s, 9.0));
            prop_assert!(
                a.origin.distance(b.origin) < 1e-6 && a.direction.distance(b.direction) < 1e-6,
                "{a:?} {b:?}"
            );
            prop_assert!(!then.blurs());
        }
    }
}
