//! Drops and flakes that fall in front of a camera.

mod size_bin;
mod streak;

use glam::{DVec2, DVec3, Vec3};
use nemoral_scene::Hydrometeor;
use nemoral_seed::{Domain, Draw, Key};
use rayon::prelude::*;

use self::size_bin::SizeBin;
use self::streak::Streak;
use super::picture::Surroundings;
use super::view::View;
use crate::error::{ParamError, check};
use crate::light::lamp::LampInAir;

/// Rain and snowfall around a camera. They are in the picture alone, in front of what is there:
/// truth is that of the surfaces behind.
///
/// A particle has its place in the world and falls at its speed, so that all cameras see the same
/// ones, and a film shows them fall. It is drawn as the streak of its way during the exposure,
/// which covers as much of the picture as the particle does on average (Garg and Nayar 2007,
/// "Vision and Rain"), and shows the mean light from all around, as a drop is a lens of 165° and a
/// flake scatters. Those that would be narrower than a third of a pixel, or are farther than 12 m,
/// are left to the air's extinction, which is that of all of them: the drawn ones, which cover 1 to
/// 3 % of the picture in heavy rain or snowfall, take their light twice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precipitation {
    /// Rain, 0..=200.
    pub rain_mm_per_h: f64,
    /// Snowfall as water, 0..=20.
    pub snowfall_mm_per_h: f64,
    /// The world's time at the picture's.
    pub time_s: f64,
    /// The place of the scene's origin in the world, metres.
    pub scene_origin_m: DVec3,
    /// The world's key: equal keys have equal drops.
    pub key: Key,
}

const RAIN: Domain = Domain::new("render.rain");
const SNOW: Domain = Domain::new("render.snow");

/// Diameters between which particles fall equally fast, metres.
const RAIN_M: [f64; 8] = [0.5e-3, 1e-3, 1.5e-3, 2e-3, 2.5e-3, 3e-3, 4e-3, 5e-3];
const SNOW_M: [f64; 7] = [1e-3, 2e-3, 3e-3, 4e-3, 6e-3, 8e-3, 12e-3];
/// The narrowest particle that is drawn, pixels, and the farthest, metres.
const NARROWEST_PX: f64 = 0.33;
const FARTHEST_M: f64 = 12.0;
/// From the middle of a cubic metre to its corners, metres.
const HALF_DIAGONAL_M: f64 = 0.867;

impl Precipitation {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        check(
            "view.rain_mm_per_h",
            self.rain_mm_per_h,
            0.0,
            200.0,
            "0..=200",
        )?;
        check(
            "view.snowfall_mm_per_h",
            self.snowfall_mm_per_h,
            0.0,
            20.0,
            "0..=20",
        )?;
        check("view.time_s", self.time_s, -1e9, 1e9, "within 1e9 s of 0")?;
        for place_m in self.scene_origin_m.to_array() {
            check(
                "view.scene_origin_m",
                place_m,
                -1e8,
                1e8,
                "within 1e8 m of 0",
            )?;
        }
        Ok(())
    }

    /// Draws what falls before what is at these depths, in the light around.
    pub(crate) fn apply(
        &self,
        pixels: &mut [Vec3],
        depth_m: &[f32],
        view: &View,
        around: &Surroundings<'_>,
    ) {
        let width = view.intrinsics.width as usize;
        let eye = view.scene_from_camera.translation_m.as_vec3();
        for streak in self.streaks(view) {
            let towards = (eye - streak.place_m).normalize_or_zero();
            let shone = |lamp: &LampInAir| {
                let (from_lamp, irradiance) = lamp.irradiance(streak.place_m);
                irradiance * streak.glow(from_lamp.dot(towards))
            };
            let lamplight: Vec3 = around.lamps.iter().map(shone).sum();
            let radiance = around.ambient * streak.albedo() + lamplight;
            streak.draw(pixels, depth_m, width, radiance);
        }
    }

    fn streaks(&self, view: &View) -> Vec<Streak> {
        let rain = (Hydrometeor::Raindrop, self.rain_mm_per_h, RAIN, &RAIN_M[..]);
        let snow = (
            Hydrometeor::Snowflake,
            self.snowfall_mm_per_h,
            SNOW,
            &SNOW_M[..],
        );
        let mut streaks = Vec::new();
        for (of, mm_per_h, domain, bounds_m) in [rain, snow] {
            if mm_per_h <= 0.0 {
                continue;
            }
            let sizes = of.sizes(mm_per_h);
            for (number, bounds_m) in bounds_m.windows(2).enumerate() {
                let bin = SizeBin {
                    of,
                    sizes,
                    from_m: bounds_m[0],
                    to_m: bounds_m[1],
                    key: self.key.domain(domain).item(number as u64),
                };
                streaks.extend(self.of_bin(&bin, view));
            }
        }
        streaks
    }

    /// The streaks of a bin, cube by cube of the air that falls with it.
    fn of_bin(&self, bin: &SizeBin, view: &View) -> Vec<Streak> {
        let k = &view.intrinsics;
        let diameter_m = 0.5 * (bin.from_m + bin.to_m);
        let fall = DVec3::new(0.0, 0.0, bin.of.speed_m_s(diameter_m));
        let reach_m = (k.fy * diameter_m / NARROWEST_PX).min(FARTHEST_M);
        let camera_from_scene = view.scene_from_camera.inverse();
        let eye = view.scene_from_camera.translation_m;
        // The corners of the picture, and so all of it, are within this angle of the axis.
        let (w, h) = (f64::from(k.width), f64::from(k.height));
        let corners = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)];
        let cosine = |(x, y)| k.direction(DVec2::new(x, y)).z;
        let least = corners.map(cosine).into_iter().fold(1.0, f64::min);
        let widest_rad = libm::acos(least.clamp(-1.0, 1.0));
        // The scene at the picture's time from the air that falls.
        let to_scene = -self.scene_origin_m - fall * self.time_s;
        let middle = eye - to_scene;
        let (first, last) = (
            (middle - reach_m).floor().as_i64vec3(),
            (middle + reach_m).floor().as_i64vec3(),
        );
        let side = last - first + 1;
        let seen = |cube: i64| {
            let (x, rest) = (cube % side.x, cube / side.x);
            let cube = first + glam::I64Vec3::new(x, rest % side.y, rest / side.y);
            let centre = cube.as_dvec3() + 0.5 + to_scene;
            let at = camera_from_scene.transform_point(centre);
            let distance_m = at.length();
            let half_rad = libm::asin((HALF_DIAGONAL_M / distance_m).min(1.0));
            let inside = distance_m < HALF_DIAGONAL_M
                || libm::acos((at.z / distance_m).clamp(-1.0, 1.0)) < widest_rad + half_rad;
            (inside && distance_m < reach_m + HALF_DIAGONAL_M).then_some(cube)
        };
        let cubes = (0..side.x * side.y * side.z).into_par_iter();
        let streaks = cubes.filter_map(seen).flat_map_iter(|cube| {
            let mut rng = bin.rng(cube.to_array());
            let count = bin.count(&mut rng);
            (0..count).filter_map(move |_| {
                let corner = cube.as_dvec3() + to_scene;
                let at = corner + DVec3::from_array([0; 3].map(|_| rng.unit_f64()));
                let diameter_m = bin.diameter_m(rng.unit_f64());
                bin.streak(view, at, fall, diameter_m, (reach_m, widest_rad))
            })
        });
        streaks.collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use nemoral_scene::{Distortion, Intrinsics, RigidTransform, Shutter};

    use super::size_bin::NEAREST_M;
    use super::streak::{DROP_ALBEDO, FLAKE_ALBEDO};
    use super::*;

    fn falling(rain_mm_per_h: f64, snowfall_mm_per_h: f64) -> Precipitation {
        Precipitation {
            rain_mm_per_h,
            snowfall_mm_per_h,
            time_s: 12.5,
            scene_origin_m: DVec3::new(400.0, -150.0, 0.0),
            key: Key::world(9),
        }
    }

    fn view(at: DVec3) -> View {
        let k = Intrinsics::from_fov(320, 180, 1.4).expect("a camera");
        let level = RigidTransform::from_xyz_rpy(at, 0.0, 0.0, 0.4);
        View {
            shutter: Shutter {
                exposure_s: 0.004,
                ..Shutter::INSTANT
            },
            ..View::new(k, level * RigidTransform::body_from_optical())
        }
    }

    fn drawn(p: &Precipitation, view: &View, depth_m: f32) -> Vec<Vec3> {
        let n = (view.intrinsics.width * view.intrinsics.height) as usize;
        let mut pixels = vec![Vec3::ZERO; n];
        let around = Surroundings {
            ambient: Vec3::ONE,
            lamps: &[],
        };
        p.apply(&mut pixels, &vec![depth_m; n], view, &around);
        pixels
    }

    /// A way through the air is covered by half its extinction, as that counts twice the particles'
    /// sections.
    #[test]
    fn particles_cover_their_share_of_the_picture() {
        // A near flake covers as much as a thousandth of a picture, and there are few.
        const MOMENTS: u32 = 500;
        let pinhole = view(DVec3::new(20.0, 30.0, 1.5));
        let (k1, k2, k3, k4) = (0.0, 0.0, 0.0, 0.0);
        let lens = Distortion::Fisheye { k1, k2, k3, k4 };
        let fisheye = View {
            intrinsics: Intrinsics::through_lens(320, 180, 2.6, lens).expect("a camera"),
            ..pinhole
        };
        let rain = (falling(30.0, 0.0), Hydrometeor::Raindrop, &RAIN_M[..]);
        let snow = (falling(0.0, 2.0), Hydrometeor::Snowflake, &SNOW_M[..]);
        for (view, (p, of, bounds_m)) in [
            (pinhole, rain),
            (pinhole, snow),
            (fisheye, rain),
            (fisheye, snow),
        ] {
            let albedo = match of {
                Hydrometeor::Raindrop => DROP_ALBEDO,
                Hydrometeor::Snowflake => FLAKE_ALBEDO,
            };
            let mut got = 0.0;
            for moment in 0..MOMENTS {
                let time_s = 3.0 * f64::from(moment);
                let drawn = drawn(&Precipitation { time_s, ..p }, &view, 0.0);
                got +=
                    drawn.iter().map(|p| f64::from(p.x / albedo)).sum::<f64>() / f64::from(MOMENTS);
            }
            let sizes = of.sizes(p.rain_mm_per_h + p.snowfall_mm_per_h);
            let mut expected = 0.0;
            for bounds_m in bounds_m.windows(2) {
                let middle_m = 0.5 * (bounds_m[0] + bounds_m[1]);
                let reach_m = (view.intrinsics.fy * middle_m / NARROWEST_PX).min(FARTHEST_M);
                for step in 0..1000 {
                    let d = bounds_m[0]
                        + (f64::from(step) + 0.5) / 1000.0 * (bounds_m[1] - bounds_m[0]);
                    let share = (bounds_m[1] - bounds_m[0]) / 1000.0;
                    let count = sizes.intercept_per_m4 * libm::exp(-sizes.slope_per_m * d) * share;
                    expected += count * std::f64::consts::FRAC_PI_4 * d * d * (reach_m - NEAREST_M);
                }
            }
            expected *= 320.0 * 180.0;
            assert!((got / expected - 1.0).abs() < 0.05, "{got} for {expected}");
        }
    }

    #[test]
    fn nothing_falls_behind_a_wall() {
        let view = view(DVec3::new(20.0, 30.0, 1.5));
        let p = falling(10.0, 1.0);
        assert!(drawn(&p, &view, 0.1).iter().all(|p| *p == Vec3::ZERO));
        let all = drawn(&p, &view, 0.0).iter().filter(|p| p.x > 0.0).count();
        let near = drawn(&p, &view, 2.0).iter().filter(|p| p.x > 0.0).count();
        assert!(0 < near && near < all, "{near} of {all}");
    }

    #[test]
    fn all_cameras_see_the_same_particles_where_they_are() {
        let p = falling(0.0, 0.5);
        let (left, mut right) = (view(DVec3::new(20.0, 30.0, 1.5)), view(DVec3::ZERO));
        // To the right by 0.1 m.
        right.scene_from_camera = left.scene_from_camera
            * RigidTransform {
                translation_m: DVec3::new(0.1, 0.0, 0.0),
                rotation: glam::DQuat::IDENTITY,
            };
        let (seen, others) = (p.streaks(&left), p.streaks(&right));
        let mut pairs = 0;
        for s in &seen {
            let disparity_px = left.intrinsics.fx as f32 * 0.1 / s.depth_m;
            let expected = s.to_px - Vec2::new(disparity_px, 0.0);
            pairs += usize::from(others.iter().any(|o| o.to_px.distance(expected) < 0.01));
        }
        assert!(
            pairs as f64 > 0.8 * seen.len() as f64,
            "{pairs} of {}",
            seen.len()
        );
        // A tenth of a second later a flake is 0.1 m lower, for a camera that falls with it, too.
        let later = Precipitation {
            time_s: p.time_s + 0.1,
            ..p
        };
        let lower = view(DVec3::new(20.0, 30.0, 1.4));
        let then = later.streaks(&lower);
        assert_eq!(then.len(), seen.len());
        assert!(
            then.iter()
                .zip(&seen)
                .all(|(a, b)| a.to_px.distance(b.to_px) < 0.01)
        );
    }

    #[test]
    fn particles_are_stable() {
        let streaks = falling(5.0, 0.5).streaks(&view(DVec3::new(20.0, 30.0, 1.5)));
        let sum: Vec2 = streaks.iter().map(|s| s.from_px).sum();
        assert_eq!(
            (streaks.len(), sum.round().as_ivec2().to_array()),
            (235, [38_371, 20_582])
        );
    }
}
