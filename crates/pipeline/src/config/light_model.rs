//! Turns the tables of the sun, the sky and the weather into the parameters of the renderer.

use nemoral_render::{SkyParams, UtcTime};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{Hydrometeor, extinction_per_m, visibility_m};

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

/// The visibility through haze and through what falls.
fn visibility_through(weather: &Weather) -> f64 {
    let rain = Hydrometeor::Raindrop.sizes(weather.rain_mm_per_h);
    let snow = Hydrometeor::Snowflake.sizes(weather.snowfall_mm_per_h);
    let falling_per_m = rain.extinction_per_m() + snow.extinction_per_m();
    if falling_per_m == 0.0 {
        return weather.visibility_m;
    }
    visibility_m(extinction_per_m(weather.visibility_m) + falling_per_m).max(10.0)
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
        visibility_m: visibility_through(weather),
        haze_height_m: weather.haze_height_m,
        fog_per_m: weather.fog_per_m,
        fog_base_m: weather.fog_base_m,
        fog_height_m: weather.fog_height_m,
        foliage_albedo,
        ..SkyParams::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_falls_takes_visibility_away() {
        let weather = |visibility_m, rain_mm_per_h, snowfall_mm_per_h| Weather {
            visibility_m,
            rain_mm_per_h,
            snowfall_mm_per_h,
            ..Weather::default()
        };
        assert_eq!(visibility_through(&weather(20_000.0, 0.0, 0.0)), 20_000.0);
        // 3.912 / (3.912 / 20,000 + 0.001556) and the same with 0.00333.
        assert!((visibility_through(&weather(20_000.0, 10.0, 0.0)) - 2233.5).abs() < 5.0);
        assert!((visibility_through(&weather(20_000.0, 0.0, 1.0)) - 1109.6).abs() < 15.0);
        assert_eq!(visibility_through(&weather(10.0, 200.0, 20.0)), 10.0);
    }
}
