//! The beams of lamps in the air before a camera.

use glam::{DVec2, Vec3};
use nemoral_scene::Ray;
use rayon::prelude::*;

use crate::View;
use crate::light::lamp::LampInAir;

/// The light of lamps that the air scatters into a camera, as a function of the place in the
/// picture and of the distance.
///
/// It is smooth, so it is computed for one ray in each [`PITCH_PX`] columns and rows, out to
/// [`SLICES`] distances, and interpolated (Wronski 2014, "Volumetric fog").
#[derive(Debug, Default)]
pub(crate) struct LampGlow {
    columns: usize,
    /// Width and height of the picture, pixels.
    size_px: DVec2,
    /// The distances, of which the first is 0, and the logarithm of one over the one before.
    distances_m: Vec<f32>,
    log_ratio: f32,
    /// For each ray, the light of the air up to each distance but the first, which is 0.
    radiance: Vec<[Vec3; SLICES]>,
}

/// Pixels from one ray to the next.
const PITCH_PX: f64 = 8.0;
/// Distances, in a geometric series that begins here, as beams are brightest near their lamps.
const SLICES: usize = 48;
const FIRST_M: f32 = 0.1;

impl LampGlow {
    /// The beams of lamps before a view, as far as `range_m`.
    pub(crate) fn new(lamps: &[LampInAir], view: &View, range_m: f32) -> Self {
        if lamps.is_empty() {
            return Self::default();
        }
        let k = &view.intrinsics;
        let size_px = DVec2::new(k.width.into(), k.height.into());
        let nodes = |pixels: u32| (f64::from(pixels) / PITCH_PX).ceil() as usize + 1;
        let (columns, rows) = (nodes(k.width), nodes(k.height));
        let log_ratio = libm::logf(range_m / FIRST_M) / (SLICES - 1) as f32;
        let to_m = |k: usize| FIRST_M * libm::expf(log_ratio * k as f32);
        let distances_m: Vec<f32> = std::iter::once(0.0).chain((0..SLICES).map(to_m)).collect();
        let along = |number: usize| {
            let (x, y) = ((number % columns) as f64, (number / columns) as f64);
            let ray = view.ray((DVec2::new(x, y) * PITCH_PX).min(size_px), range_m);
            up_to_each_distance(lamps, &ray, &distances_m)
        };
        Self {
            columns,
            size_px,
            log_ratio,
            radiance: (0..columns * rows).into_par_iter().map(along).collect(),
            distances_m,
        }
    }

    /// The light of the air before what is seen at an image position, at this distance.
    pub(crate) fn before(&self, pixel: DVec2, distance_m: f32) -> Vec3 {
        if self.radiance.is_empty() {
            return Vec3::ZERO;
        }
        let rows = self.radiance.len() / self.columns;
        // The last row and column of rays are at the picture's border.
        let split = |at: f64, nodes: usize, border: f64| {
            let low = ((at / PITCH_PX).max(0.0) as usize).min(nodes - 2);
            let from = low as f64 * PITCH_PX;
            let width = (border - from).min(PITCH_PX);
            (low, ((at - from) / width).clamp(0.0, 1.0) as f32)
        };
        let (x, fx) = split(pixel.x, self.columns, self.size_px.x);
        let (y, fy) = split(pixel.y, rows, self.size_px.y);
        // Between two distances, by the distance itself.
        let steps = libm::logf((distance_m / FIRST_M).max(1e-6)) / self.log_ratio;
        let slice = ((steps + 1.0).max(0.0) as usize).min(SLICES - 1);
        let (from_m, to_m) = (self.distances_m[slice], self.distances_m[slice + 1]);
        let f = ((distance_m - from_m) / (to_m - from_m)).clamp(0.0, 1.0);
        let at = |column: usize, row: usize| {
            let along = &self.radiance[row * self.columns + column];
            let low = slice.checked_sub(1).map_or(Vec3::ZERO, |k| along[k]);
            low.lerp(along[slice], f)
        };
        let (low, high) = (
            at(x, y).lerp(at(x + 1, y), fx),
            at(x, y + 1).lerp(at(x + 1, y + 1), fx),
        );
        low.lerp(high, fy)
    }
}

fn up_to_each_distance(lamps: &[LampInAir], ray: &Ray, distances_m: &[f32]) -> [Vec3; SLICES] {
    let mut sum = Vec3::ZERO;
    std::array::from_fn(|k| {
        let part = (distances_m[k], distances_m[k + 1]);
        let lamps = lamps.iter();
        sum += lamps.map(|lamp| lamp.scattered(ray, part)).sum::<Vec3>();
        sum
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use nemoral_scene::{Intrinsics, RigidTransform};
    use proptest::prelude::*;

    use super::*;
    use crate::colour::LUMINANCE;
    use crate::light::lamp::droplet_phase;
    use crate::{Lamp, LampParams, Lighting, SkyParams, Sun};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        /// 4000 equal steps along the rays of places in the picture, and 40 along the lamp's.
        #[test]
        fn beams_are_the_integral_along_the_ray(
            fog in 1e-3_f64..0.1,
            (x, y, z) in (-0.5_f64..0.2, 0.3_f64..1.0, -0.5_f64..0.5),
            (yaw, pitch) in (-0.3_f64..0.3, -0.2_f64..0.2),
            beam_deg in 10.0_f64..120.0,
            places in prop::collection::vec((0.0..640.0, 0.0..360.0, 0.4_f32..120.0), 8),
        ) {
            let params = SkyParams {
                fog_per_m: fog,
                fog_height_m: 1.5,
                ..SkyParams::default()
            };
            let sun = Sun::from_angles(0.0, 30.0).expect("valid");
            let haze = Lighting::new(&sun, &params).expect("valid").haze(1.2, 1e6);
            let pose = RigidTransform::from_xyz_rpy(DVec3::new(0.0, 0.0, 1.2), 0.0, pitch, yaw);
            let intrinsics = Intrinsics::from_fov(640, 360, 1.2).expect("a pinhole");
            let view = View::new(intrinsics, pose * RigidTransform::body_from_optical());
            let lamp_params = LampParams { beam_deg, ..LampParams::default() };
            let lamp = Lamp::new(&lamp_params, DVec3::new(x, y, 1.2 + z), DVec3::X);
            let lamp = lamp.expect("valid");
            let beams = LampGlow::new(&LampInAir::all(&[lamp], 1.2, &haze), &view, 300.0);
            let brightest = beams.before(DVec2::new(320.0, 180.0), 300.0).dot(LUMINANCE);
            for (column, row, length) in places {
                let pixel = DVec2::new(column, row);
                let ray = view.ray(pixel, 300.0);
                let got = beams.before(pixel, length).dot(LUMINANCE);
                let n = 4000;
                let step = length / n as f32;
                let exact: f32 = (0..n).map(|i| {
                    let t = (i as f32 + 0.5) * step;
                    let way = ray.at(t) - lamp.position_m;
                    let d = way.length();
                    let light = lamp.intensity_cd(way / d).dot(LUMINANCE) / (d * d);
                    let rise = ray.direction.z * t;
                    // The lamp's way begins as high as the lamp is.
                    let up = lamp.position_m.z - 1.2;
                    let from_lamp: f32 = (0..40)
                        .map(|k| (k as f32 + 0.5) / 40.0)
                        .map(|s| haze.extinction_per_m(up + s * way.z) * d / 40.0)
                        .sum();
                    let through = haze.transmittance(t, rise).0 * (-from_lamp).exp();
                    let phase = droplet_phase(-(way / d).dot(ray.direction));
                    f64::from(light * through * haze.extinction_per_m(rise) * phase * step)
                }).sum::<f64>() as f32;
                prop_assert!(
                    (got - exact).abs() <= 0.05 * exact + 0.03 * brightest,
                    "{got} for {exact}, {brightest} in the middle"
                );
            }
        }
    }

    #[test]
    fn without_lamps_there_is_nothing() {
        let intrinsics = Intrinsics::from_fov(160, 90, 1.2).expect("a pinhole");
        let view = View::new(intrinsics, RigidTransform::body_from_optical());
        let beams = LampGlow::new(&[], &view, 300.0);
        assert_eq!(beams.before(DVec2::new(80.0, 45.0), 100.0), Vec3::ZERO);
    }
}
