//! Lamps that the carrier of a camera shines with.

use std::f64::consts::TAU;

use glam::{DVec3, Vec2, Vec3};
use nemoral_scene::Ray;

use crate::camera::white_balance::colour_of;
use crate::error::{ParamError, check};
use crate::light::shading::{RayOrigin, Reflected, Surface, SurfaceView, ray_from_hit, reflected};
use crate::sky::atmosphere::henyey_greenstein;
use crate::sky::haze::Haze;

/// A lamp with a beam around an axis, such as a headlight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    pub(crate) position_m: Vec3,
    axis: Vec3,
    /// On the axis: linear sRGB with its luminance in candela.
    intensity_cd: Vec3,
    /// The angle from the axis at which the intensity is 1/e of that on it.
    width_rad: f32,
    radius_m: f32,
}

/// The properties of a lamp, without its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampParams {
    /// All of its light, lumen, 1..=1,000,000.
    pub flux_lm: f64,
    /// The beam angle, degrees, 10..=170: the width of the cone at whose edge the intensity is half
    /// of that on the axis.
    pub beam_deg: f64,
    /// Its colour temperature, kelvin, 2000..=12,000.
    pub kelvin: f64,
    /// The radius of its disc, metres, 0..=1, which softens shadows.
    pub radius_m: f64,
}

impl Default for LampParams {
    /// A work light of white LEDs.
    fn default() -> Self {
        Self {
            flux_lm: 3000.0,
            beam_deg: 60.0,
            kelvin: 5700.0,
            radius_m: 0.03,
        }
    }
}

impl LampParams {
    /// # Errors
    /// If one is out of its range.
    pub fn check(&self) -> Result<(), ParamError> {
        check("lamp.flux_lm", self.flux_lm, 1.0, 1e6, "1..=1,000,000 lm")?;
        check("lamp.beam_deg", self.beam_deg, 10.0, 170.0, "10..=170")?;
        check(
            "lamp.kelvin",
            self.kelvin,
            2000.0,
            12_000.0,
            "2000..=12,000 K",
        )?;
        check("lamp.radius_m", self.radius_m, 0.0, 1.0, "0..=1 m")
    }

    /// The angle from the axis at which the intensity is 1/e of that on it.
    fn width_rad(&self) -> f64 {
        0.5 * self.beam_deg.to_radians() / libm::pow(std::f64::consts::LN_2, 0.25)
    }
}

/// The share of the intensity on the axis that is left at an angle from it: flat within the beam,
/// with an edge that is a fifth of it wide.
fn profile(angle_rad: f64, width_rad: f64) -> f64 {
    let x = (angle_rad / width_rad) * (angle_rad / width_rad);
    libm::exp(-x * x)
}

impl Lamp {
    /// A lamp at a place in a frame's scene that shines along a direction.
    ///
    /// # Errors
    /// If a parameter is out of its range, the place is not finite or the direction has no length.
    pub fn new(
        params: &LampParams,
        position_m: DVec3,
        direction: DVec3,
    ) -> Result<Self, ParamError> {
        params.check()?;
        for place_m in position_m.to_array() {
            check("lamp.position_m", place_m, -1e8, 1e8, "within 1e8 m of 0")?;
        }
        let length = direction.length();
        check("lamp.direction", length, 1e-6, 1e6, "a direction")?;
        // The flux is the integral of the intensity over all directions.
        const N: u32 = 2048;
        let width_rad = params.width_rad();
        let step = std::f64::consts::PI / f64::from(N);
        let whole: f64 = (0..N)
            .map(|i| (f64::from(i) + 0.5) * step)
            .map(|angle| profile(angle, width_rad) * libm::sin(angle) * step * TAU)
            .sum();
        Ok(Self {
            position_m: position_m.as_vec3(),
            axis: (direction / length).as_vec3(),
            intensity_cd: (colour_of(params.kelvin) * (params.flux_lm / whole)).as_vec3(),
            width_rad: width_rad as f32,
            radius_m: params.radius_m as f32,
        })
    }

    /// Its intensity in a unit direction, linear sRGB with its luminance in candela.
    #[must_use]
    pub fn intensity_cd(&self, direction: Vec3) -> Vec3 {
        let angle = libm::acosf(direction.dot(self.axis).clamp(-1.0, 1.0));
        let x = (angle / self.width_rad) * (angle / self.width_rad);
        if x > 4.0 {
            // Less than 10^-6 of the axis.
            return Vec3::ZERO;
        }
        self.intensity_cd * libm::expf(-x * x)
    }
}

/// A lamp in the air that a camera sees it through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LampInAir {
    lamp: Lamp,
    /// The air around the camera.
    at_camera: Haze,
    /// The same air around the lamp.
    at_lamp: Haze,
}

impl LampInAir {
    /// The lamps of a scene in the air around a camera at a height.
    pub(crate) fn all(lamps: &[Lamp], camera_z_m: f32, at_camera: &Haze) -> Vec<Self> {
        let in_air = |lamp: &Lamp| Self {
            lamp: *lamp,
            at_camera: *at_camera,
            at_lamp: at_camera.raised(lamp.position_m.z - camera_z_m),
        };
        lamps.iter().map(in_air).collect()
    }

    /// The unit vector from the lamp to a place, and the irradiance there without anything before
    /// it, on a plane that faces the lamp: linear sRGB, lux.
    pub(crate) fn irradiance(&self, place_m: Vec3) -> (Vec3, Vec3) {
        let way = place_m - self.lamp.position_m;
        let distance_m = way.length().max(NEAREST_M);
        let direction = way / distance_m;
        let intensity = self.lamp.intensity_cd(direction);
        if intensity == Vec3::ZERO {
            return (direction, Vec3::ZERO);
        }
        let (through, _) = self.at_lamp.transmittance(distance_m, way.z);
        (direction, intensity * (through / (distance_m * distance_m)))
    }

    /// The ray from what is seen to a point of the lamp's disc, whose place in the unit disc is
    /// `on_disc`.
    pub(crate) fn shadow(&self, seen: &SurfaceView<'_>, origin: RayOrigin, on_disc: Vec2) -> Ray {
        let (direction, distance_m) = self.towards(seen, on_disc);
        // The lamp's own housing is in no scene.
        ray_from_hit(seen, origin, direction, distance_m - NEAREST_M)
    }

    fn towards(&self, seen: &SurfaceView<'_>, on_disc: Vec2) -> (Vec3, f32) {
        let point = seen.ray.at(seen.hit.surface.distance_m);
        let (right, up) = self.lamp.axis.any_orthonormal_pair();
        let on_disc = on_disc * self.lamp.radius_m;
        let way = self.lamp.position_m + right * on_disc.x + up * on_disc.y - point;
        let distance_m = way.length().max(NEAREST_M);
        (way / distance_m, distance_m)
    }

    /// What a surface sends towards the viewer of the lamp's light if nothing is before it, and
    /// where a ray to the lamp leaves the surface; `None` if it shines on no side that matters.
    pub(crate) fn on(
        &self,
        surface: &Surface,
        seen: &SurfaceView<'_>,
        on_disc: Vec2,
    ) -> Option<(Reflected, RayOrigin)> {
        let point = seen.ray.at(seen.hit.surface.distance_m);
        let (_, irradiance) = self.irradiance(point);
        if irradiance == Vec3::ZERO {
            return None;
        }
        let (radiance, origin) = reflected(surface, seen, self.towards(seen, on_disc).0)?;
        Some((radiance * irradiance, origin))
    }

    /// The light of the lamp that the air along a part of a ray from the camera scatters to it; the
    /// part is so short that two places stand for it. Nothing shades the air.
    ///
    /// The places have equal angles at the lamp (Kulla and Fajardo 2012, "Importance sampling
    /// techniques for path tracing in participating media"), so the square of the distance cancels.
    pub(crate) fn scattered(&self, ray: &Ray, (from_m, to_m): (f32, f32)) -> Vec3 {
        const PLACES: u32 = 2;
        let to_lamp = self.lamp.position_m - ray.origin;
        // The point of the ray that is nearest to the lamp, and how near it is.
        let middle_m = to_lamp.dot(ray.direction);
        let apart_m = (to_lamp - ray.direction * middle_m).length().max(NEAREST_M);
        let angle = |along_m: f32| libm::atanf((along_m - middle_m) / apart_m);
        let (first, last) = (angle(from_m), angle(to_m));
        let step = (last - first) / PLACES as f32;
        let mut sum = Vec3::ZERO;
        for i in 0..PLACES {
            let along_m = middle_m + apart_m * libm::tanf(first + (i as f32 + 0.5) * step);
            let way = ray.at(along_m) - self.lamp.position_m;
            let distance_m = way.length().max(NEAREST_M);
            let from_lamp = way / distance_m;
            let intensity = self.lamp.intensity_cd(from_lamp);
            if intensity == Vec3::ZERO {
                continue;
            }
            let rise_m = ray.direction.z * along_m;
            let (to_eye, _) = self.at_camera.transmittance(along_m, rise_m);
            let (to_place, _) = self.at_lamp.transmittance(distance_m, way.z);
            // The light goes on along `-direction`.
            let phase = droplet_phase(-from_lamp.dot(ray.direction));
            let extinction_per_m = self.at_camera.extinction_per_m(rise_m);
            sum += intensity * (extinction_per_m * phase * to_eye * to_place);
        }
        sum * (step / apart_m)
    }
}

/// No surface and no air is nearer to a lamp, metres.
const NEAREST_M: f32 = 0.05;

/// The phase function of droplets with their peak backwards, which the light of a lamp beside the
/// camera comes from: that of the sky's aerosols, and a narrow lobe that makes the lidar ratio
/// 18.8 sr (O'Connor et al. 2004).
pub(crate) fn droplet_phase(cos: f32) -> f32 {
    const BACKWARDS: f32 = 0.0313;
    henyey_greenstein(0.76, cos) * (1.0 - BACKWARDS) + henyey_greenstein(-0.7, cos) * BACKWARDS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lighting;
    use crate::colour::LUMINANCE;

    fn lamp(beam_deg: f64) -> Lamp {
        let params = LampParams {
            beam_deg,
            ..LampParams::default()
        };
        Lamp::new(&params, DVec3::ZERO, DVec3::X).expect("valid")
    }

    fn clear() -> Haze {
        Lighting::uniform(Vec3::ONE).haze(0.0, 1e6)
    }

    #[test]
    fn the_beam_has_its_flux_and_its_width() {
        for beam_deg in [10.0, 60.0, 120.0] {
            let lamp = lamp(beam_deg);
            let at = |deg: f64| {
                let (sin, cos) = libm::sincos(deg.to_radians());
                f64::from(
                    lamp.intensity_cd(DVec3::new(cos, sin, 0.0).as_vec3())
                        .dot(LUMINANCE),
                )
            };
            let flux: f64 = (0..18_000)
                .map(|i| (f64::from(i) + 0.5) / 100.0)
                .map(|deg| at(deg) * libm::sin(deg.to_radians()) * TAU * 0.01_f64.to_radians())
                .sum();
            assert!((flux / 3000.0 - 1.0).abs() < 2e-3, "{beam_deg}: {flux} lm");
            let half = at(0.5 * beam_deg) / at(0.0);
            assert!((half - 0.5).abs() < 1e-3, "{beam_deg}: {half}");
        }
    }

    #[test]
    fn illuminance_falls_with_the_square_of_the_distance() {
        let lamp = lamp(60.0);
        let in_air = LampInAir::all(&[lamp], 0.0, &clear())[0];
        let lx = |x: f32| in_air.irradiance(Vec3::X * x).1.dot(LUMINANCE);
        let candela = lamp.intensity_cd(Vec3::X).dot(LUMINANCE);
        assert!((lx(5.0) * 25.0 / candela - 1.0).abs() < 2e-3);
        assert!((lx(20.0) * 400.0 / candela - 1.0).abs() < 6e-3);
        assert_eq!(in_air.irradiance(-Vec3::X).1, Vec3::ZERO);
    }

    #[test]
    fn the_phase_function_is_normalised_and_has_its_lidar_ratio() {
        let n = 100_000;
        let sum: f64 = (0..n)
            .map(|i| {
                f64::from(droplet_phase(
                    (f64::from(i) + 0.5) as f32 / n as f32 * 2.0 - 1.0,
                ))
            })
            .sum::<f64>()
            * 2.0
            * TAU
            / f64::from(n);
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
        assert!(
            (1.0 / droplet_phase(-1.0) - 18.8).abs() < 0.1,
            "{}",
            1.0 / droplet_phase(-1.0)
        );
    }

    #[test]
    fn impossible_lamps_are_refused() {
        let params = LampParams::default();
        let refused = |params: LampParams| {
            let error = Lamp::new(&params, DVec3::ZERO, DVec3::X).expect_err("refused");
            error.field
        };
        assert_eq!(
            refused(LampParams {
                flux_lm: 0.0,
                ..params
            }),
            "lamp.flux_lm"
        );
        assert_eq!(
            refused(LampParams {
                beam_deg: 9.0,
                ..params
            }),
            "lamp.beam_deg"
        );
        assert_eq!(
            refused(LampParams {
                kelvin: 900.0,
                ..params
            }),
            "lamp.kelvin"
        );
        assert_eq!(
            refused(LampParams {
                radius_m: -0.1,
                ..params
            }),
            "lamp.radius_m"
        );
        let nowhere = Lamp::new(&params, DVec3::NAN, DVec3::X).expect_err("no place");
        assert_eq!(nowhere.field, "lamp.position_m");
        let nowhere = Lamp::new(&params, DVec3::ZERO, DVec3::ZERO).expect_err("no direction");
        assert_eq!(nowhere.field, "lamp.direction");
    }
}
