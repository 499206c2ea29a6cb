//! The sky after the sun has set.

use glam::{DVec3, Vec3};

use crate::Sun;
use crate::colour::LUMINANCE;
use crate::sky::atmosphere::Atmosphere;
use crate::sky::irradiance::Irradiance;
use crate::sky::model::{Table, clear_table};

/// The least elevation of sun or moon for which the glow is computed, degrees. Farther down, the
/// shape of the sun's is kept, and its strength alone decreases; the moon has none.
pub(super) const LOWEST_GLOW_DEG: f64 = -8.0;

/// The elevation of the sun below which the twilight is as bright as measured, degrees. From the
/// horizon on, it becomes so.
const FITTED_DEG: f64 = -3.0;

/// The light of a night without a moon, stars and airglow, on open level ground, lux: what is left
/// at the end of twilight.
const NIGHT_LX: f64 = 6.4e-4;

/// The clear sky of a sun below the horizon, whose light above the air is `share` times as bright
/// as our sun's.
///
/// The model above has the colours and the shape of the glow. Its strength is within a factor of
/// two of what is measured down to 10°, and is corrected to that; with `NIGHT_LX` from all around.
pub(super) fn twilight(air: &Atmosphere, sun: &Sun, light: DVec3, share: f64) -> Table {
    let elevation_deg = sun.elevation_deg();
    let computed_deg = elevation_deg.max(LOWEST_GLOW_DEG);
    let radiance = clear_table(air, computed_deg.to_radians(), light);
    let mut table = Table::new(sun.direction(), radiance);
    let given = f64::from(
        Irradiance::of_sky(|d| table.at(d))
            .at(Vec3::Z)
            .dot(LUMINANCE),
    );
    if given > 0.0 {
        let wanted = share * (clear_twilight_lx(elevation_deg) - NIGHT_LX).max(0.0);
        let ramp = (elevation_deg / FITTED_DEG).clamp(0.0, 1.0);
        let factor = 1.0 + (wanted / given - 1.0) * ramp;
        table.radiance.iter_mut().for_each(|l| *l *= factor as f32);
    }
    let night = Vec3::splat((NIGHT_LX / std::f64::consts::PI) as f32);
    table.radiance.iter_mut().for_each(|l| *l += night);
    table
}

/// The illuminance of a clear sky on level ground, measured for a sun below the horizon, lux
/// (Seidelmann 1992, "Explanatory Supplement to the Astronomical Almanac", table 9.2: the decimal
/// logarithm as a cubic of elevation / 90°).
fn clear_twilight_lx(elevation_deg: f64) -> f64 {
    let [a, b, c, d] = match elevation_deg {
        -0.8.. => [2.88, 22.26, -207.64, 1034.30],
        -5.0.. => [2.88, 21.81, -258.11, -858.36],
        -12.0.. => [2.70, 12.17, -431.69, -1899.83],
        _ => [13.84, 262.72, 1447.42, 2797.93],
    };
    let x = elevation_deg.max(-18.0) / 90.0;
    libm::exp10(a + x * (b + x * (c + x * d)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::model::Sky;
    use crate::{Moon, SkyParams};

    fn level_lx(sun_deg: f64, params: &SkyParams) -> f64 {
        let sun = Sun::from_angles(250.0, sun_deg).expect("valid");
        let (sky, beam) = Sky::new(&sun, params);
        let e = Irradiance::of_sky(|d| sky.radiance(d)).at(Vec3::Z)
            + beam.irradiance * beam.direction.z.max(0.0) as f32;
        e.dot(LUMINANCE).into()
    }

    /// The illuminances that Seidelmann's cubics give, rounded.
    #[test]
    fn dusk_is_as_bright_as_measured() {
        for (sun_deg, lx) in [(-4.0, 29.9), (-6.0, 3.41), (-8.0, 0.348), (-12.0, 0.0081)] {
            for turbidity in [2.0, 6.0] {
                let params = SkyParams {
                    turbidity,
                    ..SkyParams::default()
                };
                let got = level_lx(sun_deg, &params);
                assert!(
                    (got / lx - 1.0).abs() < 0.03,
                    "{sun_deg}°: {got} for {lx} lx"
                );
            }
        }
        let night = level_lx(-40.0, &SkyParams::default());
        assert!((night / NIGHT_LX - 1.0).abs() < 0.02, "{night}");
    }

    #[test]
    fn it_gets_darker_without_a_step() {
        let mut before = level_lx(1.0, &SkyParams::default());
        for tenths in -9..200 {
            let now = level_lx(-f64::from(tenths) / 10.0, &SkyParams::default());
            assert!(
                now < before * 1.001 && now > 0.8 * before,
                "{tenths}: {now}, {before}"
            );
            before = now;
        }
    }

    #[test]
    fn dusk_is_blue_and_glows_where_the_sun_set() {
        for sun_deg in [-5.0, -9.0, -14.0] {
            let sun = Sun::from_angles(0.0, sun_deg).expect("valid");
            let (sky, _) = Sky::new(&sun, &SkyParams::default());
            let at = |d: Vec3| sky.radiance(d.normalize_or(Vec3::Z));
            let (zenith, glow) = (at(Vec3::Z), at(Vec3::new(0.0, 1.0, 0.1)));
            assert!(
                zenith.is_finite() && zenith.z > zenith.x,
                "{sun_deg}: {zenith}"
            );
            assert!(
                glow.dot(LUMINANCE) > 2.0 * zenith.dot(LUMINANCE),
                "{sun_deg}: {glow}"
            );
        }
    }

    /// The full moon's illuminance by Seidelmann's cubic, with its sky's. His moon is a sixth
    /// darker than Allen's, and his air takes more from a low one.
    #[test]
    fn the_moon_shines_as_measured() {
        for (moon_deg, lx, range) in [
            (20.0, 0.0586, 1.2..1.4),
            (30.0, 0.0983, 1.2..1.35),
            (60.0, 0.2156, 1.05..1.2),
        ] {
            let params = SkyParams {
                moon: Some(Moon::from_angles(90.0, moon_deg, 1.0).expect("valid")),
                ..SkyParams::default()
            };
            let got = level_lx(-30.0, &params);
            let ratio = got / lx;
            assert!(range.contains(&ratio), "{moon_deg}°: {ratio} times {lx} lx");
            // By day it does not matter, however weak the sun.
            for sun_intensity in [1.0, 0.0] {
                let day = SkyParams {
                    sun_intensity,
                    ..SkyParams::default()
                };
                let with = SkyParams {
                    moon: params.moon,
                    ..day
                };
                assert_eq!(level_lx(10.0, &with), level_lx(10.0, &day));
            }
        }
    }

    #[test]
    fn the_moon_sets_without_a_step() {
        let lx = |moon_deg: f64| {
            let params = SkyParams {
                moon: Some(Moon::from_angles(90.0, moon_deg, 1.0).expect("valid")),
                ..SkyParams::default()
            };
            level_lx(-30.0, &params)
        };
        let mut before = lx(2.0);
        for tenths in -19..100 {
            let now = lx(-f64::from(tenths) / 10.0);
            assert!(
                now < before * 1.001 && now > 0.7 * before,
                "{tenths}: {now}, {before}"
            );
            before = now;
        }
        assert!((before / NIGHT_LX - 1.0).abs() < 0.02, "{before}");
    }

    #[test]
    fn a_dimmer_sun_makes_a_dimmer_dusk_and_moon() {
        let moon = Moon::from_angles(90.0, 40.0, 1.0).expect("valid");
        for sun_deg in [-0.5, -5.0, -30.0] {
            let lx = |sun_intensity: f64, tint: f32| {
                let params = SkyParams {
                    sun_intensity,
                    sun_tint: Vec3::splat(tint),
                    moon: Some(moon),
                    ..SkyParams::default()
                };
                level_lx(sun_deg, &params) - NIGHT_LX
            };
            let (full, dim, tinted) = (lx(1.0, 1.0), lx(0.1, 1.0), lx(1.0, 0.1));
            assert!((dim / full - 0.1).abs() < 2e-3, "{sun_deg}: {dim} {full}");
            assert!(
                (tinted / full - 0.1).abs() < 2e-3,
                "{sun_deg}: {tinted} {full}"
            );
            assert!(lx(0.0, 1.0).abs() < 0.02 * NIGHT_LX, "{sun_deg}");
        }
    }
}
