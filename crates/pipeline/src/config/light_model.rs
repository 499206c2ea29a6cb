//! Turns the tables of the sun, the sky and the weather into the parameters of the renderer.

use nemoral_render::{SkyParams, UtcTime};
use nemoral_scene::glam::{DVec3, Vec3};

use super::{Sky, Sun, SunDate, SunPosition, Weather};
use crate::Error;

impl Sun {
    /// The position of the sun.
    ///
    /// # Errors
    /// If the date is none.
    pub fn place(&self) -> Result<nemoral_render::Sun, Error> {
        match &self.position {
            SunPosition::Angles(a) => {
                nemoral_render::Sun::from_angles(a.azimuth_deg, a.elevation_deg)
            }
            SunPosition::Date(d) => {
                nemoral_render::Sun::at(d.latitude_deg, d.longitude_deg, d.time()?)
            }
        }
        .map_err(|e| Error::request(format!("sun: {e}")))
    }
}

impl SunDate {
    /// The date and time of the sun's place.
    pub(crate) fn time(&self) -> Result<UtcTime, Error> {
        let refused = |why: &dyn std::fmt::Display| {
            Error::request(format!("sun.date.utc = \"{}\": {why}", self.utc))
        };
        let time = parse_utc(&self.utc)
            .ok_or_else(|| refused(&"must be a date and time, YYYY-MM-DDThh:mm:ss"))?;
        time.later(self.later_h).map_err(|e| refused(&e))
    }
}

/// `YYYY-MM-DDThh:mm:ss`, with or without a `Z`.
fn parse_utc(text: &str) -> Option<UtcTime> {
    let (date, time) = text.trim_end_matches('Z').split_once('T')?;
    let date: Vec<&str> = date.split('-').collect();
    let time: Vec<f64> = time
        .split(':')
        .map(|w| w.parse().ok())
        .collect::<Option<_>>()?;
    let (&[year, month, day], &[h, m, s]) = (date.as_slice(), time.as_slice()) else {
        return None;
    };
    let inside = (0.0..24.0).contains(&h) && (0.0..60.0).contains(&m) && (0.0..60.0).contains(&s);
    inside.then_some(UtcTime {
        year: year.parse().ok()?,
        month: month.parse().ok()?,
        day: day.parse().ok()?,
        hour: h + m / 60.0 + s / 3600.0,
    })
}

/// The parameters of sky and air; `foliage_albedo` is the share of the light on leaves that they
/// scatter, linear sRGB.
pub(crate) fn sky_params(
    sun: &Sun,
    sky: &Sky,
    weather: &Weather,
    foliage_albedo: Vec3,
) -> SkyParams {
    SkyParams {
        turbidity: sky.turbidity,
        overcast: sky.overcast,
        sun_intensity: sun.intensity,
        sun_tint: DVec3::from_array(sun.colour).as_vec3().max(Vec3::ZERO),
        visibility_m: weather.visibility_m,
        haze_height_m: weather.haze_height_m,
        fog_per_m: weather.fog_per_m,
        fog_base_m: weather.fog_base_m,
        fog_height_m: weather.fog_height_m,
        foliage_albedo,
        ..SkyParams::default()
    }
}
