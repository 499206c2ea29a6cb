//! Particles of about one size: how many there are in the air, and their streaks.

use glam::{DVec3, Vec2};
use nemoral_scene::{Hydrometeor, SizeDistribution};
use nemoral_seed::{Draw, Key, PhiloxRng};

use super::streak::Streak;
use crate::camera::view::View;

/// The nearest particle, metres: nearer ones meet the lens and its hood.
pub(super) const NEAREST_M: f64 = 0.2;
/// The width of the aperture of a camera that is focused far away, metres.
const APERTURE_M: f64 = 0.002;
/// The exposure of a picture of an instant, seconds.
const INSTANT_S: f64 = 0.005;
/// The greatest angle from the axis at which particles beside a narrower picture are drawn: a
/// streak is everywhere as wide as in its middle, and through a pinhole that grows without bound
/// towards a right angle.
const GRAZING_RAD: f64 = 1.5;

/// Particles that fall equally fast.
pub(super) struct SizeBin {
    pub(super) of: Hydrometeor,
    pub(super) sizes: SizeDistribution,
    pub(super) from_m: f64,
    pub(super) to_m: f64,
    pub(super) key: Key,
}

impl SizeBin {
    pub(super) fn rng(&self, cube: [i64; 3]) -> PhiloxRng {
        let key = |key: Key, place: i64| key.item(place as u64);
        cube.into_iter().fold(self.key, key).rng()
    }

    /// How many there are in a cubic metre: the mean, rounded up or down.
    pub(super) fn count(&self, rng: &mut PhiloxRng) -> u32 {
        let mean =
            self.sizes.per_m3_wider_than(self.from_m) - self.sizes.per_m3_wider_than(self.to_m);
        (mean + rng.unit_f64()).floor() as u32
    }

    /// The diameter below which this share of them is.
    pub(super) fn diameter_m(&self, share: f64) -> f64 {
        let slope = self.sizes.slope_per_m;
        let (least, most) = (
            libm::exp(-slope * self.from_m),
            libm::exp(-slope * self.to_m),
        );
        -libm::log(least + share * (most - least)) / slope
    }

    /// The streak of a particle that is at a place in the scene at the picture's time; none if it
    /// is too near, farther away than `reach_m`, or too far beside the picture, all of which is
    /// within `widest_rad` of the axis.
    pub(super) fn streak(
        &self,
        view: &View,
        at: DVec3,
        fall: DVec3,
        diameter_m: f64,
        (reach_m, widest_rad): (f64, f64),
    ) -> Option<Streak> {
        let k = &view.intrinsics;
        let in_camera = view.scene_from_camera.inverse().transform_point(at);
        let distance_m = in_camera.length();
        if !(NEAREST_M..reach_m).contains(&distance_m) {
            return None;
        }
        let exposure_s = match view.shutter.exposure_s {
            0.0 => INSTANT_S,
            exposure_s => exposure_s,
        };
        // Neither its way, nor its width, nor its blur reaches into the picture from farther beside
        // it.
        let around_m = diameter_m + APERTURE_M + fall.length() * exposure_s;
        let farthest_rad = (widest_rad + around_m / distance_m).min(widest_rad.max(GRAZING_RAD));
        if libm::acos((in_camera.z / distance_m).clamp(-1.0, 1.0)) > farthest_rad {
            return None;
        }
        let middle_px = k.project(in_camera)?;
        let row_s = view.shutter.row_time_s(middle_px.y, k.height);
        let pixel_at = |offset_s: f64| {
            let then = at - fall * (row_s + offset_s);
            let pose = view.pose_at(middle_px.y, offset_s);
            k.project(pose.inverse().transform_point(then))
        };
        let from_px = pixel_at(-0.5 * exposure_s)?.as_vec2();
        let to_px = pixel_at(0.5 * exposure_s)?.as_vec2();
        // The square around it in the picture, through whatever lens.
        let across = in_camera.cross(DVec3::Y).normalize_or(DVec3::X);
        let upwards = in_camera.cross(across).normalize_or(DVec3::Y);
        let side_px = |side: DVec3| Some(k.project(in_camera + side * diameter_m)? - middle_px);
        let diameter_px = side_px(across)?.perp_dot(side_px(upwards)?).abs().sqrt();
        let blur_px = diameter_px * APERTURE_M / diameter_m;
        // An edge narrower than two pixels would be jagged.
        let soft_px = (blur_px * blur_px + 4.0).sqrt();
        let reach_px = 0.5 * (diameter_px + soft_px);
        let (soft_px, reach_px) = (soft_px.min(reach_px) as f32, reach_px as f32);
        let margin = Vec2::splat(reach_px);
        let (low, high) = (from_px.min(to_px) - margin, from_px.max(to_px) + margin);
        let inside = high.cmpgt(Vec2::ZERO).all()
            && low.cmplt(Vec2::new(k.width as f32, k.height as f32)).all();
        inside.then_some(Streak {
            from_px,
            to_px,
            reach_px,
            soft_px,
            area_px2: (std::f64::consts::FRAC_PI_4 * diameter_px * diameter_px) as f32,
            depth_m: in_camera.z as f32,
            of: self.of,
            place_m: at.as_vec3(),
        })
    }
}
