//! All light of a scene: sun and sky, and what crowns and the ground scatter of it.

use std::f32::consts::PI;

use glam::{DVec2, DVec3, Vec3};
use nemoral_scene::extinction_per_m;

use crate::error::{ParamError, check};
use crate::sky::atmosphere::mie_phase;
use crate::sky::haze::{Haze, Layer};
use crate::sky::irradiance::Irradiance;
use crate::sky::model::{Beam, Sky};
use crate::{SkyImage, SkyParams, Sun, View};

/// The haze of the sky's own aerosols, 1/m, for a visibility of 20 km.
const CLEAR_EXTINCTION: f32 = extinction_per_m(20_000.0) as f32;

/// The light of a scene: linear sRGB, scaled so that luminance is in cd/m² and illuminance in lux.
#[derive(Clone, Debug)]
pub struct Lighting {
    sun_direction: Vec3,
    sun_irradiance: Vec3,
    /// If these two are the moon's: the share of its disc that is lit, and the direction to the
    /// sun.
    moon: Option<(f32, Vec3)>,
    sky: Sky,
    /// The irradiance of the sky alone, by normal.
    sky_irradiance: Irradiance,
    ground_albedo: Vec3,
    /// Irradiance of sky and sun on open level ground.
    global: Vec3,
    /// Irradiance of the sky alone on open level ground.
    diffuse: Vec3,
    /// The share of light that passes crowns with a sky view factor of i / 256.
    through_crowns: Vec<Vec3>,
    haze: Layer,
    /// The fog at `fog_base_m`.
    fog: Layer,
    fog_base_m: f32,
}

impl Lighting {
    /// The light of a sun and a sky. It takes some 20 ms, so use one for many pictures.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(sun: &Sun, sky: &SkyParams) -> Result<Self, ParamError> {
        Self::under(sun, sky, None)
    }

    /// The same with the sky of an image, which is visible in gaps and lights the scene. The sun is
    /// still that of the angles (and dimmed by `overcast`). The image's own unit does not matter:
    /// its sky gives level ground the light of the modelled one, times `gain` (0.001..=1000).
    ///
    /// # Errors
    /// As [`new`](Self::new), and if `gain` is out of its range.
    pub fn photographed(
        sun: &Sun,
        sky: &SkyParams,
        image: &SkyImage,
        gain: f64,
    ) -> Result<Self, ParamError> {
        check("sky_image.gain", gain, 1e-3, 1e3, "0.001..=1000")?;
        Self::under(sun, sky, Some((image, gain)))
    }

    fn under(
        sun: &Sun,
        sky: &SkyParams,
        image: Option<(&SkyImage, f64)>,
    ) -> Result<Self, ParamError> {
        sky.check()?;
        let (mut table, mut beam) = Sky::new(sun, sky);
        if let Some((image, gain)) = image {
            table = table.replaced_by(image, gain as f32);
        }
        // Mist and fog scatter the beam: droplets scatter 70 % of it within a few degrees, and the
        // ground gets most of the rest from the whole sky.
        let z = beam.direction.z.max(0.02);
        let mist = (extinction_per_m(sky.visibility_m) - f64::from(CLEAR_EXTINCTION)).max(0.0);
        let depth = 0.3 * (mist * sky.haze_height_m + sky.fog_per_m * sky.fog_height_m) / z;
        let through = libm::exp(-depth) as f32;
        table.add_veil(beam.irradiance * ((1.0 - through) * 0.8 * z as f32));
        beam.irradiance *= through;
        Ok(Self::assemble(beam, table, sky))
    }

    /// Equal radiance from every direction, above and below, without a sun, as inside of an
    /// integrating sphere, for calibration and tests.
    #[must_use]
    pub fn uniform(radiance: Vec3) -> Self {
        let params = SkyParams {
            ground_albedo: Vec3::ONE,
            foliage_albedo: Vec3::ZERO,
            ..SkyParams::default()
        };
        let dark = Beam {
            direction: DVec3::Z,
            irradiance: Vec3::ZERO,
            moon: None,
        };
        Self::assemble(dark, Sky::uniform(radiance), &params)
    }

    fn assemble(beam: Beam, sky: Sky, params: &SkyParams) -> Self {
        let (sun_direction, sun_irradiance) = (beam.direction.as_vec3(), beam.irradiance);
        let sky_irradiance = Irradiance::of_sky(|d| sky.radiance(d));
        let diffuse = sky_irradiance.at(Vec3::Z);
        // With all orders of scattering, leaves that scatter a share w of the light act like leaves
        // whose extinction is sqrt(1 - w) as large (Goudriaan 1977). Of the light on clumped
        // foliage, whose optical depth has a gamma distribution around its mean d, (1 + d / k)^-k
        // passes (Nilson 1971, negative binomial), most of it through gaps and so without a colour.
        // Path tracing (`RayCastParams::bounces`) gives k = 1/2.
        let exponent = params.foliage_albedo.map(|w| (1.0 - w).sqrt());
        let through_crowns = (0..=256)
            .map(|i| {
                let open = i as f32 / 256.0;
                let squared = open * open;
                exponent.map(|e| open / (squared + e * (1.0 - squared)).sqrt())
            })
            .collect();
        Self {
            sun_direction,
            sun_irradiance,
            moon: beam.moon,
            sky,
            sky_irradiance,
            ground_albedo: params.ground_albedo,
            global: diffuse + sun_irradiance * sun_direction.z.max(0.0),
            diffuse,
            through_crowns,
            haze: Layer {
                extinction: extinction_per_m(params.visibility_m) as f32,
                height_m: params.haze_height_m as f32,
            },
            fog: Layer {
                extinction: params.fog_per_m as f32,
                height_m: params.fog_height_m as f32,
            },
            fog_base_m: params.fog_base_m as f32,
        }
    }

    /// The unit vector towards the centre of the sun, or of the moon if it shines at night.
    #[must_use]
    pub fn sun_direction(&self) -> Vec3 {
        self.sun_direction
    }

    /// The irradiance of the sun, or of the moon that shines at night, on a plane that faces it:
    /// linear sRGB, lux.
    #[must_use]
    pub fn sun_irradiance(&self) -> Vec3 {
        self.sun_irradiance
    }

    /// The radiance of the sky from a unit direction, without sun and moon; below the horizon it
    /// is that of the horizon's haze. Linear sRGB, cd/m².
    #[must_use]
    pub fn sky_radiance(&self, direction: Vec3) -> Vec3 {
        self.sky.radiance(direction)
    }

    /// The irradiance of the open sky on a surface with this unit normal: linear sRGB, lux.
    #[must_use]
    pub fn sky_irradiance(&self, normal: Vec3) -> Vec3 {
        self.sky_irradiance.at(normal)
    }

    /// The radiance of dense mist from a unit direction: the sun's light by the droplets' phase
    /// function, and that of sky and ground from all sides.
    pub(crate) fn mist_radiance(&self, direction: Vec3) -> Vec3 {
        let cos = direction.dot(self.sun_direction).clamp(-1.0, 1.0);
        self.sun_irradiance * mie_phase(cos)
            + self.diffuse * (0.5 / PI)
            + self.global * self.ground_albedo * (0.5 / PI)
    }

    /// The background: the sky, as far as mist lets it through.
    pub(crate) fn background(&self, haze: &Haze, direction: Vec3) -> Vec3 {
        let through = haze.sky_transmittance(direction.z);
        let sky = self.sky_radiance(direction);
        if through < 1.0 {
            sky.lerp(self.mist_radiance(direction), 1.0 - through)
        } else {
            sky
        }
    }

    /// The radiance of the disc of the sun or the moon in a direction; black beside it.
    pub(crate) fn sun_disc(&self, haze: &Haze, direction: Vec3) -> Vec3 {
        let r = Sun::ANGULAR_RADIUS_RAD as f32;
        // The difference of the unit vectors is the angle, with a relative error of 10^-6 here.
        let offset = direction - self.sun_direction;
        if offset.length() >= r {
            return Vec3::ZERO;
        }
        let mut lit = 1.0;
        if let Some((share, to_sun)) = self.moon {
            // The terminator is half of an ellipse whose axis is along the disc's diameter.
            let along = to_sun - self.sun_direction * to_sun.dot(self.sun_direction);
            let x = offset.dot(along.normalize_or_zero()) / r;
            let chord = (1.0 - (offset.length_squared() / (r * r) - x * x))
                .max(0.0)
                .sqrt();
            if x < (1.0 - 2.0 * share) * chord {
                return Vec3::ZERO;
            }
            lit = share;
        }
        self.sun_irradiance / (PI * r * r * lit) * haze.sky_transmittance(direction.z)
    }

    /// The mean radiance of that disc over the pixel around an image position, which is seen in a
    /// direction. A disc may be smaller than a pixel and is far brighter than the sky: by single
    /// rays its light would be too much in one picture and too little in the next one, and with it
    /// the lens' glare.
    pub(crate) fn sun_in_pixel(
        &self,
        haze: &Haze,
        view: &View,
        pixel: DVec2,
        direction: Vec3,
    ) -> Vec3 {
        const SIDE: u32 = 8;
        let pixel_rad = (1.0 / view.intrinsics.fx.min(view.intrinsics.fy)) as f32;
        let reach = 2.0 * Sun::ANGULAR_RADIUS_RAD as f32 + 2.0 * pixel_rad;
        if (direction - self.sun_direction).length_squared() > reach * reach {
            return Vec3::ZERO;
        }
        let part = |i: u32| (f64::from(i) + 0.5) / f64::from(SIDE);
        let corner = pixel.floor();
        let places = (0..SIDE * SIDE).map(|i| corner + DVec2::new(part(i % SIDE), part(i / SIDE)));
        let disc = |at: DVec2| self.sun_disc(haze, view.ray(at, 1.0).direction);
        places.map(disc).sum::<Vec3>() / (SIDE * SIDE) as f32
    }

    /// The air around a camera at a height, in a world that ends at `range_m`.
    pub(crate) fn haze(&self, camera_z_m: f32, range_m: f32) -> Haze {
        let air = self.haze;
        // Far below its base the fog would overflow; e^20 times the extinction is opaque already.
        let above = (camera_z_m - self.fog_base_m) / self.fog.height_m;
        Haze {
            air,
            mist: (1.0 - CLEAR_EXTINCTION / air.extinction).max(0.0),
            fog: Layer {
                extinction: self.fog.extinction * libm::expf(-above.max(-20.0)),
                ..self.fog
            },
            range_m,
        }
    }

    /// The share of daylight under crowns of this sky view factor.
    fn through_crowns(&self, sky_view_factor: f32) -> Vec3 {
        let x = sky_view_factor.clamp(0.0, 1.0) * 256.0;
        let i = (x as usize).min(255);
        self.through_crowns[i].lerp(self.through_crowns[i + 1], x - i as f32)
    }

    /// The indirect light where crowns leave `sky_view_factor` of the sky.
    pub(crate) fn ambient(&self, sky_view_factor: f32) -> Ambient<'_> {
        let open = sky_view_factor.clamp(0.0, 1.0);
        let through = self.through_crowns(open);
        Ambient {
            lighting: self,
            open,
            scattered: (through - Vec3::splat(open)).max(Vec3::ZERO) * self.global,
            bounced: through * self.global * self.ground_albedo,
        }
    }
}

/// The indirect light at a place.
pub(crate) struct Ambient<'a> {
    lighting: &'a Lighting,
    open: f32,
    /// The irradiance on level ground from all leaves above.
    scattered: Vec3,
    /// The irradiance from the ground on a surface that faces down.
    bounced: Vec3,
}

impl Ambient<'_> {
    /// Irradiance on a surface with this unit normal.
    ///
    /// The gaps of a canopy are mostly overhead, because a slanting ray passes more leaves. So the
    /// more closed the canopy is, the steeper the light of the sky comes down, which is modelled as
    /// a lobe ((n.z + 0.65) / 1.65)².
    pub(crate) fn irradiance(&self, n: Vec3) -> Vec3 {
        let l = self.lighting;
        let lobe = ((n.z + 0.65) * (1.0 / 1.65)).max(0.0);
        let sky =
            l.sky_irradiance.at(n) * self.open + l.diffuse * (lobe * lobe * (1.0 - self.open));
        let up = 0.5 + 0.5 * n.z;
        sky * self.open + self.scattered * up + self.bounced * (1.0 - up)
    }

    /// The mean radiance from all around.
    pub(crate) fn mean_radiance(&self) -> Vec3 {
        (self.irradiance(Vec3::Z) + self.irradiance(-Vec3::Z)) * (0.5 / PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Moon;

    #[test]
    fn light_under_crowns_is_dim_and_green() {
        let sun = Sun::from_angles(180.0, 50.0).expect("valid");
        let l = Lighting::new(&sun, &SkyParams::default()).expect("valid");
        let open = l.ambient(1.0).irradiance(Vec3::Z);
        assert!((open - l.sky_irradiance(Vec3::Z)).length() < 1e-3 * open.length());
        let closed = l.ambient(0.05).irradiance(Vec3::Z);
        assert!(
            closed.y < 0.3 * open.y && closed.y > 0.05 * open.y,
            "{closed} of {open}"
        );
        assert!(closed.y / closed.x > open.y / open.x && closed.y / closed.z > open.y / open.z);
        // Energy is conserved: no more comes through than falls on top.
        for i in 0..=20 {
            let o = i as f32 / 20.0;
            assert!(l.through_crowns(o).max_element() <= 1.0);
        }
    }

    #[test]
    fn a_uniform_world_is_uniform() {
        let l = Lighting::uniform(Vec3::splat(3.0));
        for n in [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(0.0, 0.6, -0.8)] {
            let e = l.ambient(1.0).irradiance(n);
            assert!((e / (3.0 * PI) - Vec3::ONE).length() < 2e-3, "{n}: {e}");
        }
        assert_eq!(l.sky_radiance(-Vec3::Z), Vec3::splat(3.0));
    }

    #[test]
    fn the_moon_shines_at_night_by_its_phase() {
        let sun = Sun::from_angles(270.0, -20.0).expect("valid");
        let haze = Haze {
            mist: 0.0,
            ..Lighting::uniform(Vec3::ONE).haze(0.0, 300.0)
        };
        for share in [0.1, 0.5, 0.9, 1.0] {
            let params = SkyParams {
                moon: Some(Moon::from_angles(180.0, 30.0, share).expect("valid")),
                ..SkyParams::default()
            };
            let l = Lighting::new(&sun, &params).expect("valid");
            let moon = l.sun_direction();
            assert!((moon.z - 0.5).abs() < 1e-6, "{moon}");
            // The lit part of the disc, by counting, and its light.
            let (right, up) = (Vec3::X, Vec3::X.cross(moon));
            let (side, n) = (1.05 * Sun::ANGULAR_RADIUS_RAD as f32, 200);
            let (mut lit, mut light) = ((0, 0), Vec3::ZERO);
            for i in 0..n * n {
                let at = |i: i32| (2.0 * (i as f32 + 0.5) / n as f32 - 1.0) * side;
                let radiance = l.sun_disc(&haze, moon + right * at(i % n) + up * at(i / n));
                light += radiance * (2.0 * side / n as f32).powi(2);
                if radiance != Vec3::ZERO {
                    // The sun is in the west, at the left.
                    let left = i % n < n / 2;
                    lit = (lit.0 + i32::from(left), lit.1 + i32::from(!left));
                }
            }
            let whole = PI * (n as f32 / 2.1).powi(2);
            let seen = (lit.0 + lit.1) as f32 / whole;
            assert!((f64::from(seen) - share).abs() < 0.02, "{seen} for {share}");
            assert!(share == 1.0 || lit.0 > lit.1, "{lit:?}");
            assert!(
                (light / l.sun_irradiance() - Vec3::ONE).length() < 0.05,
                "{light}"
            );
        }
    }

    #[test]
    fn impossible_air_is_refused() {
        let sun = Sun::from_angles(0.0, 7.0).expect("valid");
        let sky = SkyParams {
            turbidity: 0.5,
            ..SkyParams::default()
        };
        assert!(Lighting::new(&sun, &sky).is_err());
    }
}
