//! What the tables of sun, moon, season, weather and lamps mean.

use nemoral_render::{LampParams, UtcTime};
use nemoral_scene::RigidTransform;
use nemoral_stand::Hemisphere;

use super::mount::mount;
use super::{Error, Lamp, Moon, Season, Sun, SunDate, SunPosition, Weather};

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

impl Moon {
    /// The moon's place and phase, if there is one.
    ///
    /// # Errors
    /// If the date of the sun is none.
    pub fn place(&self, sun: &Sun) -> Result<Option<nemoral_render::Moon>, Error> {
        let moon = match &sun.position {
            _ if self.illuminated >= 0.0 => nemoral_render::Moon::from_angles(
                self.azimuth_deg,
                self.elevation_deg,
                self.illuminated,
            ),
            SunPosition::Date(d) => {
                nemoral_render::Moon::at(d.latitude_deg, d.longitude_deg, d.time()?)
            }
            SunPosition::Angles(_) => return Ok(None),
        };
        moon.map(Some)
            .map_err(|e| Error::request(format!("moon: {e}")))
    }

    /// The same moon with its place and phase said, so that it no longer depends on the sun's date.
    #[must_use]
    pub fn said(&self, sun: &Sun) -> Self {
        let place = self.place(sun).ok().flatten();
        place.map_or_else(
            || self.clone(),
            |moon| Self {
                illuminated: moon.illuminated(),
                azimuth_deg: moon.azimuth_deg(),
                elevation_deg: moon.elevation_deg(),
            },
        )
    }
}

impl Lamp {
    /// Its light.
    #[must_use]
    pub fn params(&self) -> LampParams {
        LampParams {
            flux_lm: self.lumen,
            beam_deg: self.beam_deg,
            kelvin: self.kelvin,
            radius_m: self.radius_m,
        }
    }

    /// Its position on the body, whose forward direction it shines along.
    #[must_use]
    pub fn body_from_lamp(&self) -> RigidTransform {
        mount(
            [self.mount_x_m, self.mount_y_m, self.mount_z_m],
            [0.0, self.mount_pitch_deg, self.mount_yaw_deg],
        )
    }
}

impl Season {
    /// The day of the year, said or of the sun's date; `None` for high summer, where neither is.
    #[must_use]
    pub fn day(&self, sun: &Sun) -> Option<u32> {
        match &sun.position {
            _ if self.day_of_year > 0 => Some(self.day_of_year),
            SunPosition::Date(date) => Some(day_of_year(&date.time().ok()?)),
            SunPosition::Angles(_) => None,
        }
    }

    /// The same season with its day and latitude said, so that it no longer depends on the sun.
    #[must_use]
    pub fn said(&self, sun: &Sun) -> Self {
        self.place(sun).map_or_else(
            || self.clone(),
            |place| Self {
                day_of_year: place.day_of_year as u32,
                latitude_deg: place.latitude_deg,
            },
        )
    }

    /// The side of the equator that the world is on, by the latitude of the sun's date or, if the
    /// sun has angles, by that of the season.
    #[must_use]
    pub fn hemisphere(&self, sun: &Sun) -> Hemisphere {
        Hemisphere::of_latitude(match &sun.position {
            SunPosition::Date(date) => date.latitude_deg,
            SunPosition::Angles(_) => self.latitude_deg,
        })
    }

    /// The day and the latitude by which leaves unfold and fall; `None` in high summer.
    #[must_use]
    pub fn place(&self, sun: &Sun) -> Option<nemoral_assets::Season> {
        let latitude_deg = match &sun.position {
            SunPosition::Date(date) if self.day_of_year == 0 => date.latitude_deg,
            _ => self.latitude_deg,
        };
        Some(nemoral_assets::Season {
            day_of_year: f64::from(self.day(sun)?),
            latitude_deg: latitude_deg.clamp(-70.0, 70.0),
        })
    }
}

/// The day of the year, from 1.
fn day_of_year(time: &UtcTime) -> u32 {
    let is_leap = time.year % 4 == 0 && (time.year % 100 != 0 || time.year % 400 == 0);
    let february = 28 + u32::from(is_leap);
    let months = [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30];
    let before = months.iter().take(time.month.saturating_sub(1) as usize);
    before.sum::<u32>() + time.day
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

/// Rain of so many millimetres wets all but a third of what it can wet.
const WETTING_MM: f64 = 2.0;

impl Weather {
    /// How wet the forest is, from 0, dry, to 1, soaked.
    #[must_use]
    pub fn wetness(&self) -> f64 {
        if self.wetness >= 0.0 {
            return self.wetness;
        }
        // What an hour of the rain leaves.
        1.0 - libm::exp(-self.rain_mm_per_h / WETTING_MM)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_moon_is_that_of_the_date_unless_it_is_said() {
        let moon = |moon: &Moon, sun: &Sun| moon.place(sun).expect("a date");
        let follows = Moon::default();
        assert_eq!(moon(&follows, &Sun::default()), None);
        // A full moon, which rises as the sun sets.
        let night = Sun {
            position: SunPosition::Date(SunDate {
                utc: "2024-11-15T20:00:00".to_owned(),
                ..SunDate::default()
            }),
            ..Sun::default()
        };
        let full = moon(&follows, &night).expect("a moon");
        assert!(
            full.illuminated() > 0.98 && full.elevation_deg() > 20.0,
            "{full:?}"
        );
        let said = follows.said(&night);
        let still = moon(&said, &Sun::default()).expect("a moon");
        assert!(still.direction().distance(full.direction()) < 1e-9);
        let half = Moon {
            illuminated: 0.5,
            ..Moon::default()
        };
        for sun in [&Sun::default(), &night] {
            let place = moon(&half, sun).expect("a moon");
            assert!((place.azimuth_deg() - half.azimuth_deg).abs() < 1e-9);
        }
        let none = Moon {
            illuminated: 0.0,
            ..half
        };
        assert_eq!(moon(&none, &night).map(|m| m.illuminated()), Some(0.0));
    }

    #[test]
    fn the_date_of_the_sun_says_the_season_unless_a_day_does() {
        let date = |utc: &str, later_h| Sun {
            position: SunPosition::Date(SunDate {
                utc: utc.to_owned(),
                later_h,
                ..SunDate::default()
            }),
            ..Sun::default()
        };
        let day = |of: &Sun| Season::default().place(of).map(|s| s.day_of_year);
        assert_eq!(day(&Sun::default()), None);
        assert_eq!(day(&date("2023-12-31T12:00:00", 0.0)), Some(365.0));
        assert_eq!(day(&date("2024-12-31T12:00:00", 0.0)), Some(366.0));
        assert_eq!(day(&date("2024-02-29T23:00:00", 2.0)), Some(61.0));
        // Who moves the sun by hand keeps the leaves.
        let said = Season::default().said(&date("2023-10-31T12:00:00", 0.0));
        assert_eq!((said.day_of_year, said.latitude_deg), (304, 40.2033));
        let given = Season {
            day_of_year: 20,
            latitude_deg: 60.0,
        };
        let place = given.place(&date("2023-06-21T12:00:00", 0.0));
        assert_eq!(
            place.map(|s| (s.day_of_year, s.latitude_deg)),
            Some((20.0, 60.0))
        );
    }

    #[test]
    fn the_hemisphere_is_that_of_the_suns_date_or_of_the_season() {
        let date = |latitude_deg| Sun {
            position: SunPosition::Date(SunDate {
                latitude_deg,
                ..SunDate::default()
            }),
            ..Sun::default()
        };
        let season = |latitude_deg| Season {
            latitude_deg,
            ..Season::default()
        };
        let of = |season: &Season, sun: &Sun| season.hemisphere(sun);
        let (north, south) = (Hemisphere::Northern, Hemisphere::Southern);
        assert_eq!(of(&Season::default(), &Sun::default()), north);
        assert_eq!(of(&season(-38.0), &Sun::default()), south);
        assert_eq!(of(&season(50.0), &date(-38.0)), south);
        assert_eq!(of(&season(-38.0), &date(50.0)), north);
        // Who moves the sun by hand stays on that side.
        let said = Season::default().said(&date(-38.0));
        assert_eq!(of(&said, &Sun::default()), south);
    }

    #[test]
    fn rain_wets_unless_it_is_said_how_wet_it_is() {
        let wetness = |rain_mm_per_h, wetness| {
            let weather = Weather {
                rain_mm_per_h,
                wetness,
                ..Weather::default()
            };
            weather.wetness()
        };
        assert_eq!(Weather::default().wetness(), 0.0);
        assert!((wetness(2.0, -1.0) - 0.632).abs() < 0.001);
        assert_eq!([wetness(20.0, 0.0), wetness(0.0, 1.0)], [0.0, 1.0]);
    }
}
