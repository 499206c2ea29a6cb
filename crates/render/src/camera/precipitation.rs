//! Drops and flakes that fall in front of a camera.

use std::f32::consts::FRAC_1_PI;

use glam::{DVec2, DVec3, Vec2, Vec3};
use nemoral_scene::{Hydrometeor, SizeDistribution};
use nemoral_seed::{Domain, Draw, Key, PhiloxRng};
use rayon::prelude::*;

use super::picture::Surroundings;
use super::view::View;
use crate::error::{ParamError, check};
use crate::light::lamp::{LampInAir, droplet_phase};

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
/// The light of its surroundings that a drop lets through (Garg and Nayar 2007), and that a flake
/// scatters.
const DROP_ALBEDO: f32 = 0.94;
const FLAKE_ALBEDO: f32 = 0.9;
/// The narrowest particle that is drawn, pixels, and the farthest, metres.
const NARROWEST_PX: f64 = 0.33;
const FARTHEST_M: f64 = 12.0;
/// The nearest particle, metres: nearer ones meet the lens and its hood.
const NEAREST_M: f64 = 0.2;
/// The width of the aperture of a camera that is focused far away, metres.
const APERTURE_M: f64 = 0.002;
/// The exposure of a picture of an instant, seconds.
const INSTANT_S: f64 = 0.005;
/// From the middle of a cubic metre to its corners, metres.
const HALF_DIAGONAL_M: f64 = 0.867;

/// The way of a particle in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Streak {
    from_px: Vec2,
    to_px: Vec2,
    /// From its middle line to where it ends, pixels.
    reach_px: f32,
    /// The area of the particle, which its streak covers on average, square pixels.
    area_px2: f32,
    depth_m: f32,
    of: Hydrometeor,
    /// Where it is in the scene.
    place_m: Vec3,
}

/// Particles that fall equally fast.
struct SizeBin {
    of: Hydrometeor,
    sizes: SizeDistribution,
    from_m: f64,
    to_m: f64,
    key: Key,
}

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
                bin.streak(view, at, fall, diameter_m, reach_m)
            })
        });
        streaks.collect()
    }
}

impl SizeBin {
    fn rng(&self, cube: [i64; 3]) -> PhiloxRng {
        let key = |key: Key, place: i64| key.item(place as u64);
        cube.into_iter().fold(self.key, key).rng()
    }

    /// How many there are in a cubic metre: the mean, rounded up or down.
    fn count(&self, rng: &mut PhiloxRng) -> u32 {
        let mean =
            self.sizes.per_m3_wider_than(self.from_m) - self.sizes.per_m3_wider_than(self.to_m);
        (mean + rng.unit_f64()).floor() as u32
    }

    /// The diameter below which this share of them is.
    fn diameter_m(&self, share: f64) -> f64 {
        let slope = self.sizes.slope_per_m;
        let (least, most) = (
            libm::exp(-slope * self.from_m),
            libm::exp(-slope * self.to_m),
        );
        -libm::log(least + share * (most - least)) / slope
    }

    /// The streak of a particle that is at a place in the scene at the picture's time.
    fn streak(
        &self,
        view: &View,
        at: DVec3,
        fall: DVec3,
        diameter_m: f64,
        reach_m: f64,
    ) -> Option<Streak> {
        let k = &view.intrinsics;
        let in_camera = view.scene_from_camera.inverse().transform_point(at);
        if !(NEAREST_M..reach_m).contains(&in_camera.length()) {
            return None;
        }
        let middle_px = k.project(in_camera)?;
        let exposure_s = match view.shutter.exposure_s {
            0.0 => INSTANT_S,
            exposure_s => exposure_s,
        };
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
        let reach_px = (0.25 * (diameter_px * diameter_px + blur_px * blur_px) + 1.0).sqrt() as f32;
        let margin = Vec2::splat(reach_px);
        let (low, high) = (from_px.min(to_px) - margin, from_px.max(to_px) + margin);
        let inside = high.cmpgt(Vec2::ZERO).all()
            && low.cmplt(Vec2::new(k.width as f32, k.height as f32)).all();
        inside.then_some(Streak {
            from_px,
            to_px,
            reach_px,
            area_px2: (std::f64::consts::FRAC_PI_4 * diameter_px * diameter_px) as f32,
            depth_m: in_camera.z as f32,
            of: self.of,
            place_m: at.as_vec3(),
        })
    }
}

impl Streak {
    /// Its radiance over the mean radiance of its surroundings.
    fn albedo(&self) -> f32 {
        match self.of {
            Hydrometeor::Raindrop => DROP_ALBEDO,
            Hydrometeor::Snowflake => FLAKE_ALBEDO,
        }
    }

    /// Its radiance over a lamp's irradiance, 1/sr, where the light turns by an angle of this
    /// cosine. Drops scatter by the phase function of droplets, and flakes as matt balls
    /// (Lambert's law over the part of a ball that is lit and seen). Nothing shades them.
    fn glow(&self, cos: f32) -> f32 {
        match self.of {
            Hydrometeor::Raindrop => droplet_phase(cos),
            Hydrometeor::Snowflake => {
                let cos = cos.clamp(-1.0, 1.0);
                let (turn, sin) = (libm::acosf(cos), (1.0 - cos * cos).max(0.0).sqrt());
                FLAKE_ALBEDO * (2.0 / 3.0) * (sin - turn * cos) * (FRAC_1_PI * FRAC_1_PI)
            }
        }
    }

    /// The share of a pixel that it covers on average, by the distance from its middle line: a tent
    /// whose volume over the picture is what it covers.
    fn coverage(&self, at: Vec2) -> f32 {
        let way = self.to_px - self.from_px;
        let along = (at - self.from_px).dot(way) / way.length_squared().max(1e-12);
        let nearest = self.from_px + way * along.clamp(0.0, 1.0);
        let height = (1.0 - at.distance(nearest) / self.reach_px).max(0.0);
        let r = self.reach_px;
        let volume = r * way.length() + std::f32::consts::FRAC_PI_3 * r * r;
        (self.area_px2 * height / volume).min(1.0)
    }

    fn draw(&self, pixels: &mut [Vec3], depth_m: &[f32], width: usize, radiance: Vec3) {
        let height = pixels.len() / width;
        let low = self.from_px.min(self.to_px) - self.reach_px;
        let high = self.from_px.max(self.to_px) + self.reach_px;
        let range = |low: f32, high: f32, n: usize| {
            (low.floor().max(0.0) as usize)..(high.ceil().max(0.0) as usize).min(n)
        };
        let way = self.to_px - self.from_px;
        for y in range(low.y, high.y, height) {
            // Only the part of the way that is near this row, as a long slanting one would visit
            // all pixels of its rectangle.
            let shares = if way.y.abs() > 1.0 {
                [-self.reach_px, self.reach_px].map(|reach_px| {
                    let share = (y as f32 + 0.5 + reach_px - self.from_px.y) / way.y;
                    share.clamp(0.0, 1.0)
                })
            } else {
                [0.0, 1.0]
            };
            let [a, b] = shares.map(|share| self.from_px.x + share * way.x);
            let (low, high) = (a.min(b) - self.reach_px, a.max(b) + self.reach_px);
            for x in range(low, high, width) {
                let i = y * width + x;
                if depth_m[i] > 0.0 && depth_m[i] < self.depth_m {
                    continue;
                }
                let share = self.coverage(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                pixels[i] = pixels[i].lerp(radiance, share);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::{Distortion, Intrinsics, RigidTransform, Shutter};

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

    #[test]
    fn a_streak_covers_as_much_as_its_particle() {
        for (to, reach_px) in [
            ((60.0, 60.0), 3.0),
            ((71.5, 90.25), 2.0),
            ((60.0, 110.0), 8.0),
            ((140.0, 20.0), 1.5),
            ((20.0, 60.5), 2.0),
        ] {
            let streak = Streak {
                from_px: Vec2::new(60.0, 60.0),
                to_px: Vec2::from(to),
                reach_px,
                area_px2: 2.5,
                depth_m: 1.0,
                of: Hydrometeor::Snowflake,
                place_m: Vec3::ZERO,
            };
            let mut pixels = vec![Vec3::ZERO; 160 * 160];
            streak.draw(&mut pixels, &vec![0.0; 160 * 160], 160, Vec3::ONE);
            let sum: f32 = pixels.iter().map(|p| p.x).sum();
            assert!((sum / 2.5 - 1.0).abs() < 0.03, "{sum}");
        }
    }

    /// A way through the air is covered by half its extinction, as that counts twice the particles'
    /// sections.
    #[test]
    fn particles_cover_their_share_of_the_picture() {
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
            for moment in 0..20 {
                let time_s = 3.0 * f64::from(moment);
                let drawn = drawn(&Precipitation { time_s, ..p }, &view, 0.0);
                got += drawn.iter().map(|p| f64::from(p.x / albedo)).sum::<f64>() / 20.0;
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
            (234, [38_318, 20_400])
        );
    }

    /// A matt ball reflects all that falls on it, its albedo, over all directions.
    #[test]
    fn what_a_lamp_shines_on_scatters_its_light() {
        for (of, share) in [
            (Hydrometeor::Raindrop, 1.0),
            (Hydrometeor::Snowflake, FLAKE_ALBEDO),
        ] {
            let streak = Streak {
                from_px: Vec2::ZERO,
                to_px: Vec2::ONE,
                reach_px: 1.0,
                area_px2: 1.0,
                depth_m: 1.0,
                of,
                place_m: Vec3::ZERO,
            };
            let n = 100_000;
            let cos = |i: i32| (i as f32 + 0.5) / n as f32 * 2.0 - 1.0;
            let sum: f64 = (0..n).map(|i| f64::from(streak.glow(cos(i)))).sum();
            // Radiance times the area that is seen, over all directions.
            let whole = sum * 2.0 / f64::from(n) * std::f64::consts::TAU;
            assert!((whole - f64::from(share)).abs() < 2e-3, "{of:?}: {whole}");
        }
    }
}
