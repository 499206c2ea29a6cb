//! The sun's position, from angles or from place and time.

use glam::DVec3;

use crate::error::{ParamError, check};

/// The sun's place in the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    direction: DVec3,
}

/// A moment, in UTC of the Gregorian calendar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UtcTime {
    /// 1901..=2099, where the formulas hold.
    pub year: i32,
    /// 1..=12.
    pub month: u32,
    /// 1..=31.
    pub day: u32,
    /// Hours since midnight with their fraction, 0..=24 (12.5 is 12:30).
    pub hour: f64,
}

impl Sun {
    /// The sun's angular radius seen from the earth, radians (a disc of 0.53°).
    pub const ANGULAR_RADIUS_RAD: f64 = 0.004_65;

    /// The sun at an azimuth (clockwise from north: 90 is east) and an elevation over the horizon,
    /// degrees.
    ///
    /// # Errors
    /// If the azimuth is not −360..=360 or the elevation not −90..=90.
    pub fn from_angles(azimuth_deg: f64, elevation_deg: f64) -> Result<Self, ParamError> {
        check("sun.azimuth_deg", azimuth_deg, -360.0, 360.0, "-360..=360")?;
        check("sun.elevation_deg", elevation_deg, -90.0, 90.0, "-90..=90")?;
        let (sin_a, cos_a) = libm::sincos(azimuth_deg.to_radians());
        let (sin_e, cos_e) = libm::sincos(elevation_deg.to_radians());
        Ok(Self {
            direction: DVec3::new(cos_e * sin_a, cos_e * cos_a, sin_e),
        })
    }

    /// The sun at a place (degrees; north and east are positive) and a time, where it is seen: by
    /// the formulas of NOAA's solar calculator (after Meeus, "Astronomical Algorithms"), and with
    /// the refraction of air of 1010 hPa and 10 °C. It is within 0.02° of the NREL solar position
    /// algorithm. Refraction decreases to nothing from 1° to 2° below the horizon, as twilight goes
    /// by the true elevation.
    ///
    /// # Errors
    /// If the place is not on the earth or the time not in the calendar.
    pub fn at(latitude_deg: f64, longitude_deg: f64, time: UtcTime) -> Result<Self, ParamError> {
        let direction = true_direction(latitude_deg, longitude_deg, time)?;
        Ok(Self {
            direction: refracted(direction),
        })
    }

    /// The unit vector towards the sun: east, north, up.
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        self.direction
    }

    /// The azimuth clockwise from north, 0..360 degrees.
    #[must_use]
    pub fn azimuth_deg(&self) -> f64 {
        azimuth_deg(self.direction)
    }

    /// The elevation over the horizon, −90..=90 degrees.
    #[must_use]
    pub fn elevation_deg(&self) -> f64 {
        elevation_deg(self.direction)
    }
}

/// The unit vector towards the sun (east, north, up) at a place and a time, without refraction.
pub(super) fn true_direction(
    latitude_deg: f64,
    longitude_deg: f64,
    time: UtcTime,
) -> Result<DVec3, ParamError> {
    check("sun.latitude_deg", latitude_deg, -90.0, 90.0, "-90..=90")?;
    check(
        "sun.longitude_deg",
        longitude_deg,
        -180.0,
        180.0,
        "-180..=180",
    )?;
    let t = time.julian_centuries()?;
    let sin = |deg: f64| libm::sin(deg.to_radians());
    let cos = |deg: f64| libm::cos(deg.to_radians());

    // Mean longitude, mean anomaly, eccentricity, equation of the centre.
    let l0 = (280.466_46 + t * (36_000.769_83 + t * 0.000_303_2)).rem_euclid(360.0);
    let m = 357.529_11 + t * (35_999.050_29 - t * 0.000_153_7);
    let e = 0.016_708_634 - t * (0.000_042_037 + t * 0.000_000_126_7);
    let centre = sin(m) * (1.914_602 - t * (0.004_817 + t * 0.000_014))
        + sin(2.0 * m) * (0.019_993 - t * 0.000_101)
        + sin(3.0 * m) * 0.000_289;
    // Apparent longitude and obliquity, with nutation.
    let node = 125.04 - 1_934.136 * t;
    let longitude = l0 + centre - 0.005_69 - 0.004_78 * sin(node);
    let obliquity = 23.0
        + (26.0 + (21.448 - t * (46.815 + t * (0.000_59 - t * 0.001_813))) / 60.0) / 60.0
        + 0.002_56 * cos(node);
    let sin_dec = sin(obliquity) * sin(longitude);
    let cos_dec = libm::sqrt(1.0 - sin_dec * sin_dec);

    // Equation of time (minutes) and hour angle (degrees, 0 at noon).
    let y = libm::tan((obliquity / 2.0).to_radians()).powi(2);
    let equation_min = 4.0
        * (y * sin(2.0 * l0) - 2.0 * e * sin(m) + 4.0 * e * y * sin(m) * cos(2.0 * l0)
            - 0.5 * y * y * sin(4.0 * l0)
            - 1.25 * e * e * sin(2.0 * m))
        .to_degrees();
    let hour_angle = (time.hour * 60.0 + equation_min + 4.0 * longitude_deg) / 4.0 - 180.0;

    // From the equatorial frame to east, north, up.
    let (sin_lat, cos_lat) = (sin(latitude_deg), cos(latitude_deg));
    let direction = DVec3::new(
        -cos_dec * sin(hour_angle),
        cos_lat * sin_dec - sin_lat * cos_dec * cos(hour_angle),
        sin_lat * sin_dec + cos_lat * cos_dec * cos(hour_angle),
    );
    Ok(direction / direction.length())
}

/// Where what is in a direction outside of the air is seen from the ground: unit vectors, east,
/// north, up.
pub(super) fn refracted(direction: DVec3) -> DVec3 {
    let elevation_deg = elevation_deg(direction);
    let raised_deg = refraction_deg(elevation_deg);
    if raised_deg == 0.0 {
        return direction;
    }
    let (sin, cos) = libm::sincos((elevation_deg + raised_deg).to_radians());
    // It is not in the zenith, where nothing is raised.
    let level = direction.truncate() / direction.truncate().length();
    (level * cos).extend(sin)
}

/// How much higher than at this true elevation something is seen, degrees (Saemundsson 1986, by
/// Meeus 1998, equation 16.4: air of 1010 hPa and 10 °C). It decreases to nothing from 1 to 2
/// degrees below the horizon.
fn refraction_deg(elevation_deg: f64) -> f64 {
    let e = elevation_deg.max(-1.0);
    let minutes = 1.02 / libm::tan((e + 10.3 / (e + 5.11)).to_radians());
    // Close to the zenith the formula is a little below 0.
    minutes.max(0.0) / 60.0 * (elevation_deg + 2.0).clamp(0.0, 1.0)
}

/// The azimuth of a unit vector (east, north, up) clockwise from north, 0..360 degrees.
pub(super) fn azimuth_deg(direction: DVec3) -> f64 {
    let azimuth_rad = libm::atan2(direction.x, direction.y);
    azimuth_rad.to_degrees().rem_euclid(360.0)
}

/// Its elevation over the horizon, −90..=90 degrees.
pub(super) fn elevation_deg(direction: DVec3) -> f64 {
    libm::asin(direction.z.clamp(-1.0, 1.0)).to_degrees()
}

impl UtcTime {
    /// The time this number of hours later; negative is earlier.
    ///
    /// # Errors
    /// If this is not in the calendar or the hours are more than 200 years.
    pub fn later(self, hours: f64) -> Result<Self, ParamError> {
        let most = 200.0 * 366.0 * 24.0;
        check("time.later_h", hours, -most, most, "200 years at most")?;
        let hour = self.hour + hours;
        let days = (hour / 24.0).floor();
        // The inverse by Fliegel and Van Flandern (1968).
        let mut l = self.day_number()? + days as i32 + 68_569;
        let n = 4 * l / 146_097;
        l -= (146_097 * n + 3) / 4;
        let i = 4000 * (l + 1) / 1_461_001;
        l -= 1461 * i / 4 - 31;
        let j = 80 * l / 2447;
        let day = l - 2447 * j / 80;
        l = j / 11;
        Ok(Self {
            year: 100 * (n - 49) + i + l,
            month: (j + 2 - 12 * l) as u32,
            day: day as u32,
            // Just before midnight the difference may round up to 24.
            hour: (hour - 24.0 * days).clamp(0.0, 24.0_f64.next_down()),
        })
    }

    /// The Julian day number at noon.
    fn day_number(&self) -> Result<i32, ParamError> {
        check(
            "time.year",
            f64::from(self.year),
            1901.0,
            2099.0,
            "1901..=2099",
        )?;
        check("time.month", f64::from(self.month), 1.0, 12.0, "1..=12")?;
        let leap = self.year % 4 == 0; // Holds for 1901..=2099.
        let days = match self.month {
            2 => 28 + u32::from(leap),
            4 | 6 | 9 | 11 => 30,
            _ => 31,
        };
        check(
            "time.day",
            f64::from(self.day),
            1.0,
            f64::from(days),
            "a day of that month",
        )?;
        check("time.hour", self.hour, 0.0, 24.0, "0..=24")?;
        // Fliegel and Van Flandern (1968).
        let (y, m, d) = (self.year, self.month as i32, self.day as i32);
        let a = (m - 14) / 12;
        Ok((1461 * (y + 4800 + a)) / 4 + (367 * (m - 2 - 12 * a)) / 12
            - (3 * ((y + 4900 + a) / 100)) / 4
            + d
            - 32_075)
    }

    /// Julian centuries since J2000.0.
    pub(crate) fn julian_centuries(&self) -> Result<f64, ParamError> {
        let noon = f64::from(self.day_number()?);
        Ok((noon - 0.5 + self.hour / 24.0 - 2_451_545.0) / 36_525.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(lat: f64, lon: f64, (year, month, day): (i32, u32, u32), hour: f64) -> Sun {
        Sun::at(
            lat,
            lon,
            UtcTime {
                year,
                month,
                day,
                hour,
            },
        )
        .expect("on earth")
    }

    /// The results of the NREL algorithm (computed with pvlib; apparent elevation at 1010 hPa and
    /// 10 °C). The last sun is too far below the horizon to be raised.
    #[test]
    fn agrees_with_the_nrel_algorithm() {
        let coimbra = (40.2033, -8.4103);
        for (sun, azimuth, elevation) in [
            (
                at(coimbra.0, coimbra.1, (2022, 3, 20), 12.0),
                164.331,
                48.677,
            ),
            (
                at(coimbra.0, coimbra.1, (2022, 6, 21), 12.0 + 35.0 / 60.0),
                179.630,
                73.239,
            ),
            (at(coimbra.0, coimbra.1, (2022, 6, 21), 6.5), 70.892, 13.963),
            (
                at(coimbra.0, coimbra.1, (2022, 12, 21), 12.5),
                179.570,
                26.390,
            ),
            (at(60.1699, 24.9384, (2024, 5, 1), 18.0), 299.648, 1.611),
            (at(60.1699, 24.9384, (2024, 5, 1), 18.15), 301.593, 0.753),
            (at(60.1699, 24.9384, (2024, 5, 1), 18.25), 302.895, 0.214),
            (at(46.95, 7.44, (2024, 10, 10), 9.25), 144.490, 29.765),
            (at(-37.8, 145.0, (2025, 1, 15), 1.0), 55.420, 64.507),
            (at(44.56, -123.26, (2025, 8, 1), 23.75), 254.989, 39.600),
            (at(60.1699, 24.9384, (2024, 5, 1), 18.6), 307.489, -2.447),
        ] {
            assert!(
                (sun.azimuth_deg() - azimuth).abs() < 0.02,
                "{} for {azimuth}",
                sun.azimuth_deg()
            );
            assert!(
                (sun.elevation_deg() - elevation).abs() < 0.02,
                "{} for {elevation}",
                sun.elevation_deg()
            );
        }
    }

    /// Meeus, example 16.a: the sun's upper rim, truly 33.246' over the horizon, is raised by
    /// 24.618'. The inverse, Bennett's formula for apparent elevations (16.3), agrees within 0.1'.
    #[test]
    fn air_raises_what_is_low() {
        assert!((60.0 * refraction_deg(33.246 / 60.0) - 24.618).abs() < 1e-3);
        for elevation_deg in [-0.5, 0.0, 2.0, 10.0, 45.0, 80.0] {
            let raised_deg = refraction_deg(elevation_deg);
            let seen_deg: f64 = elevation_deg + raised_deg;
            let inverse = 1.0 / (seen_deg + 7.31 / (seen_deg + 4.4)).to_radians().tan();
            assert!((60.0 * raised_deg - inverse).abs() < 0.1, "{elevation_deg}");
        }
        assert_eq!([refraction_deg(-2.0), refraction_deg(90.0)], [0.0; 2]);
        // Higher is higher, without steps.
        let mut before_deg = -3.0;
        for hundredths in -299..=9000 {
            let sun = Sun::from_angles(70.0, f64::from(hundredths) / 100.0).expect("valid");
            let seen = refracted(sun.direction());
            let seen_deg = elevation_deg(seen);
            assert!(
                seen_deg > before_deg && seen_deg < before_deg + 0.02,
                "{hundredths}: {before_deg} {seen_deg}"
            );
            assert!((seen.length() - 1.0).abs() < 1e-12);
            assert!(hundredths == 9000 || (azimuth_deg(seen) - 70.0).abs() < 1e-6);
            before_deg = seen_deg;
        }
    }

    #[test]
    fn angles_are_clockwise_from_north() {
        let east = Sun::from_angles(90.0, 0.0).expect("valid").direction();
        assert!(east.distance(DVec3::X) < 1e-12);
        let north = Sun::from_angles(0.0, 45.0).expect("valid").direction();
        assert!(north.distance(DVec3::new(0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt())) < 1e-12);
        let sun = Sun::from_angles(217.5, 33.25).expect("valid");
        assert!(
            (sun.azimuth_deg() - 217.5).abs() < 1e-9 && (sun.elevation_deg() - 33.25).abs() < 1e-9
        );
    }

    #[test]
    fn impossible_places_and_times_are_refused() {
        assert!(Sun::from_angles(0.0, 91.0).is_err() && Sun::from_angles(f64::NAN, 1.0).is_err());
        let time = UtcTime {
            year: 2023,
            month: 2,
            day: 29,
            hour: 12.0,
        };
        assert_eq!(
            Sun::at(1.0, 1.0, time).expect_err("no such day").field,
            "time.day"
        );
        assert!(Sun::at(1.0, 1.0, UtcTime { year: 2024, ..time }).is_ok());
        assert!(Sun::at(95.0, 1.0, UtcTime { day: 1, ..time }).is_err());
    }

    #[test]
    fn days_follow_each_other() {
        let mut day = UtcTime {
            year: 1901,
            month: 1,
            day: 1,
            hour: 6.5,
        };
        let first = day;
        let mut count = 0;
        while day.year < 2100 {
            let mut last = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
            last[1] += u32::from(day.year % 4 == 0);
            let next = match (day.month, day.day) {
                (12, 31) => (day.year + 1, 1, 1),
                (m, d) if d == last[m as usize - 1] => (day.year, m + 1, 1),
                (m, d) => (day.year, m, d + 1),
            };
            assert_eq!(first.later(24.0 * f64::from(count)).expect("fine"), day);
            (day.year, day.month, day.day) = next;
            count += 1;
        }
        let eve = UtcTime {
            year: 2023,
            month: 12,
            day: 31,
            hour: 22.25,
        };
        let later = eve.later(4.0).expect("fine");
        assert_eq!(
            (later.year, later.month, later.day, later.hour),
            (2024, 1, 1, 2.25)
        );
        assert_eq!(later.later(-4.0).expect("fine"), eve);
        // Half a day later the sun is on the other side, at any time of the year.
        let sun = Sun::at(0.0, 0.0, eve).expect("fine");
        let other = Sun::at(0.0, 0.0, eve.later(12.0).expect("fine")).expect("fine");
        assert!((sun.elevation_deg() + other.elevation_deg()).abs() < 1.0);
        let no_day = UtcTime { day: 32, ..eve };
        assert!(no_day.later(0.0).is_err() && eve.later(f64::NAN).is_err());
    }
}
