//! The sky's radiance: modelled from the air, or photographed.

use glam::{DVec3, Vec2, Vec3};

use crate::colour::LUMINANCE;
use crate::error::{ParamError, check};
use crate::sky::atmosphere::{Atmosphere, Scattered, mie_phase, rayleigh_phase};
use crate::sky::irradiance::Irradiance;
use crate::sky::twilight::{LOWEST_GLOW_DEG, twilight};
use crate::{Moon, SkyImage, Sun};

/// The air and the clouds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyParams {
    /// Turbidity: the optical thickness of the air over that of clean air, at 550 nm, 1..=10. 2 is
    /// very clear, 3 clear, 5 hazy, 10 fog.
    pub turbidity: f64,
    /// Cloud cover as an even veil, from 0 (clear) to 1 (overcast, without a sun).
    pub overcast: f64,
    /// Multiplies the strength of the sun above the atmosphere, and so that of the moon, 0..=100; 1
    /// is that of our sun.
    pub sun_intensity: f64,
    /// Multiplies its colour, linear sRGB, each 0..=10.
    pub sun_tint: Vec3,
    /// The moon, which shines once the sun has set; `None` for a night without one.
    pub moon: Option<Moon>,
    /// Mean albedo of the ground around, linear sRGB, each 0..=1.
    pub ground_albedo: Vec3,
    /// Share of the light on a leaf that it scatters to either side (reflectance + transmittance),
    /// linear sRGB, each 0..=0.99. It makes the light under crowns green.
    pub foliage_albedo: Vec3,
    /// Meteorological visibility at the camera's height, metres, 10..=1,000,000: the distance at
    /// which 2 % of the contrast is left. Mist is below 1000.
    pub visibility_m: f64,
    /// The height over which that haze decreases by a factor of e, metres, 1..=10,000.
    pub haze_height_m: f64,
    /// The extinction of ground fog at its base, 1/m, 0..=1, which is 3.912 / visibility
    /// (Koschmieder 1924); 0 for no fog.
    pub fog_per_m: f64,
    /// The height in the scene at which the fog has that extinction, metres, −10,000..=10,000.
    /// Below, it is denser.
    pub fog_base_m: f64,
    /// The height over which the fog decreases by a factor of e, metres, 0.5..=1000.
    pub fog_height_m: f64,
}

impl Default for SkyParams {
    /// A clear day; the leaves are beech (PROSPECT-D).
    fn default() -> Self {
        Self {
            turbidity: 2.2,
            overcast: 0.0,
            sun_intensity: 1.0,
            sun_tint: Vec3::ONE,
            moon: None,
            ground_albedo: Vec3::new(0.11, 0.10, 0.06),
            foliage_albedo: Vec3::new(0.13, 0.24, 0.034),
            visibility_m: 20_000.0,
            haze_height_m: 100.0,
            fog_per_m: 0.0,
            fog_base_m: 0.0,
            fog_height_m: 8.0,
        }
    }
}

impl SkyParams {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        check("sky.turbidity", self.turbidity, 1.0, 10.0, "1..=10")?;
        check("sky.overcast", self.overcast, 0.0, 1.0, "0..=1")?;
        check(
            "sky.sun_intensity",
            self.sun_intensity,
            0.0,
            100.0,
            "0..=100",
        )?;
        for c in self.sun_tint.to_array() {
            check("sky.sun_tint", c.into(), 0.0, 10.0, "0..=10 per channel")?;
        }
        for c in self.ground_albedo.to_array() {
            check("sky.ground_albedo", c.into(), 0.0, 1.0, "0..=1 per channel")?;
        }
        for c in self.foliage_albedo.to_array() {
            check(
                "sky.foliage_albedo",
                c.into(),
                0.0,
                0.99,
                "0..=0.99 per channel",
            )?;
        }
        check(
            "sky.visibility_m",
            self.visibility_m,
            10.0,
            1e6,
            "10..=1,000,000 m",
        )?;
        check(
            "sky.haze_height_m",
            self.haze_height_m,
            1.0,
            1e4,
            "1..=10,000 m",
        )?;
        check("sky.fog_per_m", self.fog_per_m, 0.0, 1.0, "0..=1 per metre")?;
        check(
            "sky.fog_base_m",
            self.fog_base_m,
            -1e4,
            1e4,
            "-10,000..=10,000 m",
        )?;
        check(
            "sky.fog_height_m",
            self.fog_height_m,
            0.5,
            1e3,
            "0.5..=1000 m",
        )
    }
}

/// Illuminance of the sun above the air, lux.
const SOLAR_CONSTANT_LX: f64 = 128_000.0;

/// The sun's colour above the air (5900 K) in linear sRGB, luminance 1.
const SOLAR_COLOUR: DVec3 = DVec3::new(1.08, 0.98, 0.95);

/// The share of a clear day's light that an overcast sky lets through (Kasten and Czeplak 1980).
const OVERCAST_TRANSMITTANCE: f32 = 0.25;

/// The moon's colour above the air, luminance 1: its rock reflects red better than blue (Velikodsky
/// et al. 2011, its albedo at 615, 535 and 445 nm).
const LUNAR_COLOUR: DVec3 = DVec3::new(1.210, 0.963, 0.747);

/// The light that casts shadows: that of the sun, or of the moon once the sun has set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beam {
    /// The unit vector to where it comes from.
    pub(crate) direction: DVec3,
    /// The irradiance on a plane that faces it, linear sRGB, lux.
    pub(crate) irradiance: Vec3,
    /// If the moon shines: the share of its disc that is lit, and the direction to the sun.
    pub(crate) moon: Option<(f32, Vec3)>,
}

/// Radiance of the sky: linear sRGB with luminance in cd/m².
#[derive(Clone, Debug)]
pub(crate) enum Sky {
    /// A sky that is computed from the air: what it scatters of the sun's light, and at night of
    /// the moon's.
    Modelled(Table, Option<Table>),
    /// A sky from an image.
    Photographed(SkyImage),
}

/// What the air scatters of one source's light.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    /// The horizontal direction of the source, unit length (any direction, for one in the zenith).
    azimuth: Vec2,
    /// `ROWS` of `COLUMNS`. Row v has elevation v² · 90°, column u has sin(azimuth from the source
    /// / 2) = u: fine near the horizon and near the source.
    pub(super) radiance: Vec<Vec3>,
}

const ROWS: usize = 96;
const COLUMNS: usize = 96;
/// Scattering without phase functions is smooth, so only one in this number of rows and columns is
/// integrated.
const COARSE: usize = 4;

impl Sky {
    /// The sky, and the light that casts shadows.
    pub(crate) fn new(sun: &Sun, params: &SkyParams) -> (Self, Beam) {
        let air = Atmosphere::new(params.turbidity, params.ground_albedo.as_dvec3());
        let intensity = params.sun_intensity;
        let light = SOLAR_CONSTANT_LX * intensity * SOLAR_COLOUR * params.sun_tint.as_dvec3();
        let (full, luminance) = (SOLAR_CONSTANT_LX * SOLAR_COLOUR, LUMINANCE.as_dvec3());
        let elevation = sun.elevation_deg().to_radians();
        let mut beam = Beam {
            direction: sun.direction(),
            irradiance: (light * air.sun_transmittance(elevation)).as_vec3(),
            moon: None,
        };
        let table = match sun.elevation_deg() {
            0.0.. => Table::new(sun.direction(), clear_table(&air, elevation, light)),
            _ => twilight(&air, sun, light, light.dot(luminance) / full.dot(luminance)),
        };
        let has_set = sun.elevation_deg() < 0.0 && beam.irradiance == Vec3::ZERO;
        let moon = params.moon.filter(|moon| {
            has_set && moon.elevation_deg() > LOWEST_GLOW_DEG && moon.illuminance_lx() > 0.0
        });
        let moonlit = moon.map(|moon| {
            let sunlight = intensity * params.sun_tint.as_dvec3();
            let light = moon.illuminance_lx() * LUNAR_COLOUR * sunlight;
            let elevation = moon.elevation_deg().to_radians();
            beam = Beam {
                direction: moon.direction(),
                irradiance: (light * air.sun_transmittance(elevation)).as_vec3(),
                moon: Some((moon.illuminated() as f32, sun.direction().as_vec3())),
            };
            Table::new(moon.direction(), clear_table(&air, elevation, light))
        });
        let mut sky = Self::Modelled(table, moonlit);
        if params.overcast > 0.0 {
            // The veil transmits a share of the light that a clear sky and its beam would give the
            // ground. Droplets scatter all colours equally, so most of the blue becomes white.
            let global = Irradiance::of_sky(|d| sky.radiance(d)).at(Vec3::Z)
                + beam.irradiance * beam.direction.z.max(0.0) as f32;
            let white = Vec3::splat(global.dot(LUMINANCE));
            let overcast = params.overcast as f32;
            let ground = global.lerp(white, 0.7) * (overcast * OVERCAST_TRANSMITTANCE);
            // The CIE overcast sky is three times as bright overhead as at the horizon.
            let zenith = ground * (9.0 / (7.0 * std::f32::consts::PI));
            if let Self::Modelled(table, moonlit) = &mut sky {
                for (i, l) in table.radiance.iter_mut().enumerate() {
                    let v = (i / COLUMNS) as f32 / (ROWS - 1) as f32;
                    let sine = libm::sinf(v * v * std::f32::consts::FRAC_PI_2);
                    *l = *l * (1.0 - overcast) + zenith * ((1.0 + 2.0 * sine) / 3.0);
                }
                for l in moonlit.iter_mut().flat_map(|table| &mut table.radiance) {
                    *l *= 1.0 - overcast;
                }
            }
        }
        beam.irradiance *= (1.0 - params.overcast) as f32;
        (sky, beam)
    }

    /// The sky of an image, `gain` times as bright as this one by its illuminance on level ground.
    pub(crate) fn replaced_by(&self, image: &SkyImage, gain: f32) -> Self {
        let level = |sky: &Self| {
            let e = Irradiance::of_sky(|d| sky.radiance(d)).at(Vec3::Z);
            e.dot(LUMINANCE)
        };
        let (wanted, given) = (level(self), level(&Self::Photographed(image.clone())));
        Self::Photographed(image.scaled(gain * wanted / given.max(f32::MIN_POSITIVE)))
    }

    /// The same radiance from every direction.
    pub(crate) fn uniform(radiance: Vec3) -> Self {
        Self::Modelled(Table::new(DVec3::X, vec![radiance; ROWS * COLUMNS]), None)
    }

    /// Adds an even veil that gives level ground this much light.
    pub(crate) fn add_veil(&mut self, irradiance: Vec3) {
        let veil = irradiance / std::f32::consts::PI;
        match self {
            Self::Modelled(sky, _) => sky.radiance.iter_mut().for_each(|l| *l += veil),
            Self::Photographed(image) => *image = image.veiled(veil),
        }
    }

    /// The radiance from a unit direction, without sun and moon; below the horizon it is that of
    /// the horizon's haze.
    #[inline]
    pub(crate) fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Modelled(sky, None) => sky.at(direction),
            Self::Modelled(sky, Some(moonlit)) => sky.at(direction) + moonlit.at(direction),
            Self::Photographed(image) => image.radiance(direction),
        }
    }
}

impl Table {
    pub(super) fn new(source: DVec3, radiance: Vec<Vec3>) -> Self {
        let flat = source.truncate().as_vec2();
        Self {
            azimuth: flat.try_normalize().unwrap_or(Vec2::X),
            radiance,
        }
    }

    #[inline]
    pub(super) fn at(&self, direction: Vec3) -> Vec3 {
        let flat = direction.truncate();
        // 1e-12 avoids a division by zero at the zenith.
        let cos_azimuth = flat.dot(self.azimuth) / (flat.length_squared() + 1e-12).sqrt();
        let u = (0.5 - 0.5 * cos_azimuth).clamp(0.0, 1.0).sqrt() * (COLUMNS - 1) as f32;
        // The zenith angle over 90°, to 5e-5 (Abramowitz and Stegun 4.4.45).
        let z = direction.z.clamp(0.0, 1.0);
        let polynomial = 0.999_957 + z * (-0.135_036 + z * (0.047_276 - z * 0.011_923));
        let elevation = 1.0 - (1.0 - z).sqrt() * polynomial;
        let v = elevation.max(0.0).sqrt() * (ROWS - 1) as f32;
        let (i, j) = ((v as usize).min(ROWS - 2), (u as usize).min(COLUMNS - 2));
        let (fv, fu) = (v - i as f32, u - j as f32);
        let (low, high) = (
            &self.radiance[i * COLUMNS + j..][..2],
            &self.radiance[(i + 1) * COLUMNS + j..][..2],
        );
        let (low, high) = (low[0].lerp(low[1], fu), high[0].lerp(high[1], fu));
        low.lerp(high, fv)
    }
}

/// The clear sky's table for a source of this light above the air.
pub(super) fn clear_table(air: &Atmosphere, elevation_rad: f64, light: DVec3) -> Vec<Vec3> {
    // The frame's x axis lies below the source.
    let (sin, cos) = libm::sincos(elevation_rad);
    let source = DVec3::new(cos, 0.0, sin);
    let direction = |u: f64, v: f64| {
        let (z, flat) = libm::sincos(v * v * std::f64::consts::FRAC_PI_2);
        let (sin_half, cos_half) = (u, libm::sqrt(1.0 - u * u));
        DVec3::new(
            flat * (1.0 - 2.0 * u * u),
            flat * 2.0 * sin_half * cos_half,
            z,
        )
    };
    let multiple = air.multiple_scattering(elevation_rad);
    let (rows, columns) = (ROWS / COARSE, COLUMNS / COARSE);
    let coarse: Vec<Scattered> = (0..rows * columns)
        .map(|i| {
            let v = (i / columns) as f64 / (rows - 1) as f64;
            let u = (i % columns) as f64 / (columns - 1) as f64;
            air.scattered(direction(u, v), source, &multiple)
        })
        .collect();
    (0..ROWS * COLUMNS)
        .map(|i| {
            let v = (i / COLUMNS) as f64 / (ROWS - 1) as f64;
            let u = (i % COLUMNS) as f64 / (COLUMNS - 1) as f64;
            let (y, x) = (v * (rows - 1) as f64, u * (columns - 1) as f64);
            let (r, c) = ((y as usize).min(rows - 2), (x as usize).min(columns - 2));
            let (fy, fx) = (y - r as f64, x - c as f64);
            let blend = |part: fn(&Scattered) -> DVec3| {
                let at = |dr: usize, dc: usize| part(&coarse[(r + dr) * columns + c + dc]);
                let (low, high) = (at(0, 0).lerp(at(0, 1), fx), at(1, 0).lerp(at(1, 1), fx));
                low.lerp(high, fy)
            };
            let cos = direction(u, v).dot(source).clamp(-1.0, 1.0) as f32;
            let radiance = blend(|s| s.rayleigh) * f64::from(rayleigh_phase(cos))
                + blend(|s| s.mie) * f64::from(mie_phase(cos))
                + blend(|s| s.multiple);
            (radiance * light).as_vec3()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(elevation: f64, overcast: f64) -> (Sky, Vec3) {
        let sun = Sun::from_angles(180.0, elevation).expect("valid");
        let params = SkyParams {
            overcast,
            ..SkyParams::default()
        };
        let (sky, beam) = Sky::new(&sun, &params);
        (sky, beam.irradiance)
    }

    fn luminance(c: Vec3) -> f32 {
        c.dot(LUMINANCE)
    }

    fn towards(azimuth_deg: f64, elevation_deg: f64) -> Vec3 {
        Sun::from_angles(azimuth_deg, elevation_deg)
            .expect("valid")
            .direction()
            .as_vec3()
    }

    #[test]
    fn a_clear_sky_has_daylight_levels() {
        let (s, sun) = sky(60.0, 0.0);
        assert!((70e3..110e3).contains(&luminance(sun)), "{sun}");
        let diffuse =
            luminance(crate::sky::irradiance::Irradiance::of_sky(|d| s.radiance(d)).at(Vec3::Z));
        assert!((9e3..25e3).contains(&diffuse), "{diffuse}");
    }

    #[test]
    fn the_zenith_is_blue_and_the_horizon_bright_and_pale() {
        let (s, _) = sky(40.0, 0.0);
        let (zenith, horizon) = (s.radiance(Vec3::Z), s.radiance(towards(90.0, 1.0)));
        assert!(zenith.z > 1.5 * zenith.x, "{zenith}");
        assert!(
            luminance(horizon) > 1.5 * luminance(zenith),
            "{horizon} {zenith}"
        );
        assert!(horizon.z / horizon.x < zenith.z / zenith.x);
        // The aureole, and the half towards the sun against the other one.
        assert!(luminance(s.radiance(towards(180.0, 36.0))) > 4.0 * luminance(zenith));
        // There is nothing but haze below the horizon.
        let (at, below) = (
            s.radiance(towards(10.0, 0.0)),
            s.radiance(towards(10.0, -30.0)),
        );
        assert!((below / at - Vec3::ONE).length() < 1e-3, "{at} {below}");
    }

    #[test]
    fn the_evening_glows_and_the_dusk_is_blue() {
        let (s, _) = sky(1.0, 0.0);
        let glow = s.radiance(towards(180.0, 2.0));
        assert!(glow.x > 1.5 * glow.z, "{glow}");
        let (dusk, sun) = sky(-4.0, 0.0);
        assert_eq!(sun, Vec3::ZERO);
        let zenith = dusk.radiance(Vec3::Z);
        assert!(zenith.z > zenith.x && luminance(zenith) > 0.0, "{zenith}");
        assert!(luminance(zenith) < 0.1 * luminance(s.radiance(Vec3::Z)));
    }

    #[test]
    fn an_overcast_sky_is_three_times_brighter_overhead() {
        let (s, sun) = sky(45.0, 1.0);
        assert_eq!(sun, Vec3::ZERO);
        let ratio = luminance(s.radiance(Vec3::Z)) / luminance(s.radiance(towards(77.0, 0.0)));
        assert!((ratio - 3.0).abs() < 1e-3, "{ratio}");
        let e =
            luminance(crate::sky::irradiance::Irradiance::of_sky(|d| s.radiance(d)).at(Vec3::Z));
        assert!((8e3..25e3).contains(&e), "{e}");
    }
}
