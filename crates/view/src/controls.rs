//! What the page can change of a config.

use std::collections::BTreeMap;

use nemoral_pipeline::config::{Config, Preset, SunAngles, SunDate, SunPosition};
use nemoral_scene::excerpt;
use serde::{Deserialize, Serialize};

use crate::Error;

/// A value that the page sets.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// Of a slider.
    Number(f64),
    /// Of a choice, and a seed, which may be too large for a number.
    Text(String),
}

/// Values by the names of their controls.
pub type Values = BTreeMap<String, Value>;

/// A slider.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Control {
    /// Its name in requests.
    pub name: &'static str,
    /// The heading that it is under.
    pub group: &'static str,
    /// What the page calls it.
    pub label: &'static str,
    /// The unit that follows its value.
    pub unit: &'static str,
    /// The smallest value.
    pub min: f64,
    /// The largest value.
    pub max: f64,
    /// The step between values. With 0, the slider has equal ratios, from `min` to `max`.
    pub step: f64,
    #[serde(skip)]
    get: fn(&Config) -> f64,
    #[serde(skip)]
    set: fn(&mut Config, f64),
}

/// Every slider, in the order of the page.
pub const CONTROLS: &[Control] = &[
    Control {
        name: "hour",
        group: "Sun",
        label: "Time of day",
        unit: "h",
        min: 0.0,
        max: 24.0,
        step: 0.1,
        get: |c| match &c.sun.position {
            SunPosition::Date(date) => solar_hour(date),
            _ => 12.0 + (sun_angles(c).azimuth_deg - 180.0) / 15.0,
        },
        set: |c, hour| {
            let mut date = match &c.sun.position {
                SunPosition::Date(date) => date.clone(),
                _ => SunDate::default(),
            };
            date.later_h = rounded(date.later_h + hour - solar_hour(&date));
            c.sun.position = SunPosition::Date(date);
        },
    },
    Control {
        name: "elevation",
        group: "Sun",
        label: "Height of the sun",
        unit: "°",
        min: -20.0,
        max: 90.0,
        step: 0.5,
        get: |c| sun_angles(c).elevation_deg.clamp(-20.0, 90.0),
        set: |c, elevation_deg| turn_sun(c, |sun| sun.elevation_deg = elevation_deg),
    },
    Control {
        name: "azimuth",
        group: "Sun",
        label: "Direction of the sun",
        unit: "°",
        min: 0.0,
        max: 360.0,
        step: 1.0,
        get: |c| sun_angles(c).azimuth_deg,
        set: |c, azimuth_deg| turn_sun(c, |sun| sun.azimuth_deg = azimuth_deg),
    },
    Control {
        name: "moon",
        group: "Night",
        label: "Lit share of the moon",
        unit: "",
        min: 0.0,
        max: 1.0,
        step: 0.05,
        get: |c| c.moon.said(&c.sun).illuminated.max(0.0),
        set: |c, illuminated| {
            c.moon = c.moon.said(&c.sun);
            c.moon.illuminated = illuminated;
        },
    },
    Control {
        name: "moon_elevation",
        group: "Night",
        label: "Height of the moon",
        unit: "°",
        min: 0.0,
        max: 90.0,
        step: 1.0,
        get: |c| c.moon.said(&c.sun).elevation_deg.clamp(0.0, 90.0),
        set: |c, elevation_deg| {
            c.moon = c.moon.said(&c.sun);
            c.moon.elevation_deg = elevation_deg;
        },
    },
    Control {
        name: "lamp",
        group: "Night",
        label: "Lamp",
        unit: "lm",
        min: 0.0,
        max: 12_000.0,
        step: 100.0,
        get: |c| match c.lamp.enabled {
            true => c.lamp.lumen.min(12_000.0),
            false => 0.0,
        },
        set: |c, lumen| {
            c.lamp.enabled = lumen > 0.0;
            if c.lamp.enabled {
                c.lamp.lumen = lumen;
            } else {
                c.lamps.values_mut().for_each(|lamp| lamp.enabled = false);
            }
        },
    },
    Control {
        name: "least_ev",
        group: "Night",
        label: "Least exposure",
        unit: "EV",
        min: -10.0,
        max: 10.0,
        step: 0.5,
        get: |c| c.camera.exposure_least_ev.clamp(-10.0, 10.0),
        set: |c, least_ev| c.camera.exposure_least_ev = least_ev,
    },
    Control {
        name: "day",
        group: "Season",
        label: "Day of the year",
        unit: "day",
        min: 1.0,
        max: 366.0,
        step: 1.0,
        get: |c| c.season.day(&c.sun).map_or(HIGH_SUMMER, f64::from),
        set: |c, day| {
            c.season = c.season.said(&c.sun);
            c.season.day_of_year = day.round() as u32;
        },
    },
    Control {
        name: "overcast",
        group: "Weather",
        label: "Clouds",
        unit: "",
        min: 0.0,
        max: 1.0,
        step: 0.01,
        get: |c| c.sky.overcast,
        set: |c, v| c.sky.overcast = v,
    },
    Control {
        name: "turbidity",
        group: "Weather",
        label: "Haze of the sky",
        unit: "",
        min: 1.8,
        max: 10.0,
        step: 0.1,
        get: |c| c.sky.turbidity,
        set: |c, v| c.sky.turbidity = v,
    },
    Control {
        name: "visibility",
        group: "Weather",
        label: "Visibility",
        unit: "m",
        min: 50.0,
        max: 100_000.0,
        step: 0.0,
        get: |c| c.weather.visibility_m,
        set: |c, v| c.weather.visibility_m = v,
    },
    Control {
        name: "fog",
        group: "Weather",
        label: "Fog in hollows",
        unit: "/m",
        min: 0.0,
        max: 0.2,
        step: 0.002,
        get: |c| c.weather.fog_per_m,
        set: |c, v| c.weather.fog_per_m = v,
    },
    Control {
        name: "rain",
        group: "Weather",
        label: "Rain",
        unit: "mm/h",
        min: 0.0,
        max: 50.0,
        step: 0.5,
        get: |c| c.weather.rain_mm_per_h,
        set: |c, rain_mm_per_h| c.weather.rain_mm_per_h = rain_mm_per_h,
    },
    Control {
        name: "snowfall",
        group: "Weather",
        label: "Snowfall",
        unit: "mm/h",
        min: 0.0,
        max: 5.0,
        step: 0.1,
        get: |c| c.weather.snowfall_mm_per_h,
        set: |c, snowfall_mm_per_h| c.weather.snowfall_mm_per_h = snowfall_mm_per_h,
    },
    Control {
        name: "snow",
        group: "Weather",
        label: "Snow on the ground",
        unit: "cm",
        min: 0.0,
        max: 60.0,
        step: 1.0,
        get: |c| 100.0 * c.weather.snow_depth_m,
        set: |c, depth_cm| c.weather.snow_depth_m = rounded(0.01 * depth_cm),
    },
    Control {
        name: "snow_on_crowns",
        group: "Weather",
        label: "Snow on crowns",
        unit: "",
        min: 0.0,
        max: 1.0,
        step: 0.05,
        get: |c| c.weather.snow_on_crowns,
        set: |c, share| c.weather.snow_on_crowns = share,
    },
    Control {
        name: "wetness",
        group: "Weather",
        label: "Wetness",
        unit: "",
        min: 0.0,
        max: 1.0,
        step: 0.05,
        get: |c| c.weather.wetness(),
        set: |c, wetness| c.weather.wetness = wetness,
    },
    Control {
        name: "trees",
        group: "Stand",
        label: "Trees",
        unit: "/ha",
        min: 0.0,
        max: 1200.0,
        step: 10.0,
        get: |c| c.placement.trees / hectares(c),
        set: |c, v| c.placement.trees = v * hectares(c),
    },
    Control {
        name: "shrubs",
        group: "Stand",
        label: "Shrubs",
        unit: "/ha",
        min: 0.0,
        max: 1200.0,
        step: 10.0,
        get: |c| c.placement.shrubs / hectares(c),
        set: |c, v| c.placement.shrubs = v * hectares(c),
    },
    Control {
        name: "undergrowth",
        group: "Stand",
        label: "Undergrowth",
        unit: "",
        min: 0.0,
        max: 1.0,
        step: 0.01,
        get: |c| c.undergrowth.cover,
        set: |c, v| c.undergrowth.cover = v,
    },
];

/// The day that a config without a date shows.
const HIGH_SUMMER: f64 = 196.0;

/// The area of a chunk.
fn hectares(config: &Config) -> f64 {
    config.chunks.size_m * config.chunks.size_m / 10_000.0
}

/// Without digits that are errors of arithmetic.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// Where the sun is, of a date in tenths of a degree; the default if the date is none.
fn sun_angles(config: &Config) -> SunAngles {
    let mut angles = SunAngles::default();
    match (&config.sun.position, config.sun.place()) {
        (SunPosition::Angles(said), _) => {
            angles.azimuth_deg = said.azimuth_deg.rem_euclid(360.0);
            angles.elevation_deg = said.elevation_deg;
        }
        (_, Ok(sun)) => {
            let tenths = |degrees: f64| (10.0 * degrees).round() / 10.0;
            angles.azimuth_deg = tenths(sun.azimuth_deg());
            angles.elevation_deg = tenths(sun.elevation_deg());
        }
        (_, Err(_)) => {}
    }
    angles
}

/// Gives the sun angles, by which leaves and moon stay those of the date that it had.
fn turn_sun(c: &mut Config, turn: impl FnOnce(&mut SunAngles)) {
    (c.season, c.moon) = (c.season.said(&c.sun), c.moon.said(&c.sun));
    let mut angles = sun_angles(c);
    turn(&mut angles);
    c.sun.position = SunPosition::Angles(angles);
}

/// The hour by the sun's mean course: noon is when it crosses the south of the date's place.
fn solar_hour(date: &SunDate) -> f64 {
    let time = date.utc.split_once('T').map_or("", |(_, time)| time);
    let parts = time.trim_end_matches('Z').split(':');
    let hours: f64 = parts
        .zip([1.0, 60.0, 3600.0])
        .filter_map(|(text, per_hour)| Some(text.parse::<f64>().ok()? / per_hour))
        .sum();
    (hours + date.later_h + date.longitude_deg / 15.0).rem_euclid(24.0)
}

/// The presets that are stands: they differ from the default in nothing else.
pub(crate) fn stands() -> impl Iterator<Item = Preset> {
    let default = Config::default();
    let is_stand = move |preset: &Preset| {
        let mut config = preset.config();
        plant(&mut config, &default);
        config == default
    };
    Preset::ALL.iter().copied().filter(is_stand)
}

/// Gives a config the stand of another one. What is not about the stand stays, such as how many
/// individuals are grown.
fn plant(config: &mut Config, stand: &Config) {
    config.terrain = stand.terrain.clone();
    config.trails = stand.trails.clone();
    config.placement = stand.placement.clone();
    config.litter = stand.litter.clone();
    config.undergrowth = stand.undergrowth.clone();
    config.deadwood = stand.deadwood.clone();
    config.climbers = stand.climbers.clone();
    let mut assets = stand.assets.clone();
    assets.seed = config.assets.seed;
    assets.individuals = config.assets.individuals;
    assets.trunk_radius_m = config.assets.trunk_radius_m;
    config.assets = assets;
}

/// The name of the stand that a config has, unless it is one of its own.
pub(crate) fn stand_of(config: &Config) -> Option<&'static str> {
    let is_it = |preset: &Preset| {
        let mut planted = config.clone();
        plant(&mut planted, &preset.config());
        // The number of trees and the like may differ.
        planted.placement = config.placement.clone();
        planted.undergrowth.cover = config.undergrowth.cover;
        planted == *config
    };
    stands().find(is_it).map(|preset| preset.name)
}

/// What the controls show of a config.
pub(crate) fn values(config: &Config) -> Values {
    let sliders = CONTROLS.iter().map(|c| {
        let value = Value::Number((c.get)(config).clamp(c.min, c.max));
        (c.name.to_owned(), value)
    });
    let texts = [
        ("seed", config.seed.to_string()),
        ("stand", stand_of(config).unwrap_or_default().to_owned()),
    ];
    let texts = texts.map(|(name, text)| (name.to_owned(), Value::Text(text)));
    sliders.chain(texts).collect()
}

/// The config with these values.
///
/// # Errors
/// [`Error::Value`] for a name or a value that is not allowed.
pub(crate) fn changed(config: &Config, values: &Values) -> Result<Config, Error> {
    let mut config = config.clone();
    // A stand comes first, as others are about it.
    let ordered = values.iter().filter(|(name, _)| *name == "stand");
    let ordered = ordered.chain(values.iter().filter(|(name, _)| *name != "stand"));
    for (name, value) in ordered {
        match &**name {
            "stand" => set_stand(&mut config, value)?,
            "seed" => set_seed(&mut config, value)?,
            _ => set_slider(&mut config, name, value)?,
        }
    }
    Ok(config)
}

fn shown(value: &Value) -> String {
    // With quotes it is shorter than what errors show.
    const SHOWN: usize = 36;
    match value {
        Value::Number(number) => number.to_string(),
        Value::Text(text) => format!("\"{}\"", excerpt(text, SHOWN)),
    }
}

fn set_stand(config: &mut Config, value: &Value) -> Result<(), Error> {
    let found = stands().find(|p| matches!(value, Value::Text(name) if name == p.name));
    let Some(preset) = found else {
        let names: Vec<&str> = stands().map(|p| p.name).collect();
        let allowed = format!("one of {}", names.join(", "));
        return Err(Error::value("stand", shown(value), allowed));
    };
    plant(config, &preset.config());
    Ok(())
}

fn set_seed(config: &mut Config, value: &Value) -> Result<(), Error> {
    let seed = match value {
        Value::Text(text) => text.trim().parse().ok(),
        Value::Number(n) => (n.fract() == 0.0 && (0.0..9e15).contains(n)).then_some(*n as u64),
    };
    let Some(seed) = seed.filter(|&seed| i64::try_from(seed).is_ok()) else {
        return Err(Error::value(
            "seed",
            shown(value),
            "a whole number, 0 to 2^63 - 1",
        ));
    };
    if config.assets.seed == 0 {
        // The plants are those of the seed before, which are grown already. (0 means the world's.)
        config.assets.seed = config.seed;
    }
    config.seed = seed;
    Ok(())
}

fn set_slider(config: &mut Config, name: &str, value: &Value) -> Result<(), Error> {
    let Some(control) = CONTROLS.iter().find(|c| c.name == name) else {
        let names: Vec<&str> = CONTROLS.iter().map(|c| c.name).collect();
        let allowed = format!("of stand, seed, {}", names.join(", "));
        return Err(Error::value(name, shown(value), allowed));
    };
    let (min, max) = (control.min, control.max);
    match value {
        Value::Number(number) if (min..=max).contains(number) => {
            (control.set)(config, *number);
            Ok(())
        }
        _ => Err(Error::value(name, shown(value), format!("{min} to {max}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_set_is_shown() {
        let config = Config::default();
        for control in CONTROLS {
            for share in [0.0, 0.3, 1.0] {
                let mut value = control.min + share * (control.max - control.min);
                if control.unit == "day" {
                    value = value.round();
                }
                let set = Values::from([(control.name.to_owned(), Value::Number(value))]);
                let config = changed(&config, &set).unwrap();
                let Value::Number(shown) = values(&config)[control.name] else {
                    panic!("a number");
                };
                // Hours and directions begin again after a turn.
                let off = (shown - value).abs();
                let off = off.min(control.max - control.min - off);
                assert!(off < 1e-4, "{} = {value}: {shown}", control.name);
            }
        }
    }

    #[test]
    fn hours_and_angles_are_of_one_sun() {
        let at = |hour| {
            let set = Values::from([("hour".to_owned(), Value::Number(hour))]);
            sun_angles(&changed(&Config::default(), &set).unwrap())
        };
        let noon = at(12.0);
        assert!((noon.azimuth_deg - 180.0).abs() < 3.0, "{noon:?}");
        assert!(
            (noon.elevation_deg - 73.2).abs() < 0.5,
            "midsummer in Coimbra: {noon:?}"
        );
        assert!(at(6.0).azimuth_deg < 90.0 && at(18.0).azimuth_deg > 270.0);
        let midnight = at(0.0).elevation_deg;
        assert!((-27.0..-26.0).contains(&midnight), "{midnight}");
    }

    #[test]
    fn stands_are_the_presets_that_plant_alone() {
        let names: Vec<&str> = stands().map(|p| p.name).collect();
        assert!(
            names.contains(&"default") && names.contains(&"beech"),
            "{names:?}"
        );
        assert!(
            !names.contains(&"demo") && !names.contains(&"low"),
            "{names:?}"
        );
        let config = Preset::by_name("demo").unwrap().config();
        let beech = Values::from([("stand".to_owned(), Value::Text("beech".to_owned()))]);
        let beech = changed(&config, &beech).unwrap();
        assert_eq!(stand_of(&beech), Some("beech"));
        assert_eq!(beech.assets.individuals, 1);
        assert_eq!(beech.chunks, config.chunks);
        let thinned = Values::from([("trees".to_owned(), Value::Number(100.0))]);
        let thinned = changed(&beech, &thinned).unwrap();
        assert_eq!(thinned.placement.trees, 25.0);
        assert_eq!(stand_of(&thinned), Some("beech"));
    }

    #[test]
    fn a_new_seed_keeps_the_plants() {
        let seed = |text: &str| Values::from([("seed".to_owned(), Value::Text(text.to_owned()))]);
        let first = Config::default();
        let second = changed(&first, &seed("9223372036854775807")).unwrap();
        assert_eq!(
            (second.seed, second.assets.seed),
            (i64::MAX as u64, first.seed)
        );
        let third = changed(&second, &seed("3")).unwrap();
        assert_eq!((third.seed, third.assets.seed), (3, first.seed));
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let refused = |name: &str, value: Value| {
            let values = Values::from([(name.to_owned(), value)]);
            changed(&Config::default(), &values)
                .expect_err("nonsense")
                .to_string()
        };
        let number = Value::Number;
        let text = |t: &str| Value::Text(t.to_owned());
        assert_eq!(
            refused("overcast", number(1.5)),
            "overcast = 1.5: must be 0 to 1"
        );
        assert_eq!(
            refused("overcast", text("1")),
            "overcast = \"1\": must be 0 to 1"
        );
        assert!(refused("overcast", number(f64::NAN)).contains("NaN"));
        assert!(refused("sky.image", text("/etc/passwd")).contains("of stand, seed, hour"));
        assert!(refused("stand", text("demo")).contains("one of default, maritime-pine"));
        for seed in ["-1", "1.5", "9223372036854775808", ""] {
            assert!(
                refused("seed", text(seed)).contains("a whole number"),
                "{seed}"
            );
        }
        assert!(refused(&"x".repeat(500), number(0.0)).len() < 300);
        let long = refused("stand", text(&"x".repeat(1 << 20)));
        let shown = "x".repeat(36);
        assert!(
            long.starts_with(&format!("stand = \"{shown}…\": ")),
            "{long}"
        );
        let lines = refused("seed", text("1\n\u{1b}[2J"));
        assert!(lines.starts_with("seed = \"1\\n\\u{1b}[2J\": "), "{lines}");
    }
}
