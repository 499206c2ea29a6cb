//! The sky and the air of a config, as the renderer knows them.

use nemoral_render::SkyParams;
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{Hydrometeor, extinction_per_m, visibility_m};

use crate::config::{Sky, Sun, Weather};

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
    moon: Option<nemoral_render::Moon>,
    sky: &Sky,
    weather: &Weather,
    foliage_albedo: Vec3,
) -> SkyParams {
    SkyParams {
        moon,
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
        ground_albedo: ground_albedo(weather),
    }
}

/// The mean albedo of the ground, which lights what faces down: dry, wet, or under snow that has
/// some litter on it and gaps in it.
fn ground_albedo(weather: &Weather) -> Vec3 {
    const SNOW: Vec3 = Vec3::new(0.76, 0.775, 0.80);
    /// A film of water leaves so much of what soil and litter reflect.
    const WET: f32 = 0.55;
    /// So much snow in the open hides the ground of a wood, metres.
    const HIDES_M: f64 = 0.05;
    let dry = SkyParams::default().ground_albedo;
    let bare = dry * (1.0 + (WET - 1.0) * weather.wetness() as f32);
    bare.lerp(SNOW, (weather.snow_depth_m / HIDES_M).min(1.0) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snow_brightens_what_faces_down_and_rain_darkens_it() {
        let of = |snow_depth_m, wetness| {
            let mut weather = Weather::default();
            (weather.snow_depth_m, weather.wetness) = (snow_depth_m, wetness);
            ground_albedo(&weather)
        };
        assert_eq!(of(0.0, -1.0), SkyParams::default().ground_albedo);
        assert!(of(0.0, 1.0).y < 0.6 * of(0.0, 0.0).y);
        assert!(of(0.2, 1.0).y > 0.7 && of(0.02, 0.0).y < 0.5);
    }

    #[test]
    fn what_falls_takes_visibility_away() {
        let visibility = |visibility_m, rain_mm_per_h, snowfall_mm_per_h| {
            let mut weather = Weather::default();
            weather.visibility_m = visibility_m;
            weather.rain_mm_per_h = rain_mm_per_h;
            weather.snowfall_mm_per_h = snowfall_mm_per_h;
            visibility_through(&weather)
        };
        assert_eq!(visibility(20_000.0, 0.0, 0.0), 20_000.0);
        // 3.912 / (3.912 / 20,000 + 0.001556) and the same with 0.00333.
        assert!((visibility(20_000.0, 10.0, 0.0) - 2233.5).abs() < 5.0);
        assert!((visibility(20_000.0, 0.0, 1.0) - 1109.6).abs() < 15.0);
        assert_eq!(visibility(10.0, 200.0, 20.0), 10.0);
    }
}
