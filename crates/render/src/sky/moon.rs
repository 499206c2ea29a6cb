//! The moon: where it is, how much of it is lit, and how bright it shines.

use glam::DVec3;

use crate::Sun;
use crate::UtcTime;
use crate::error::{ParamError, check};
use crate::sky::sun::{azimuth_deg, elevation_deg, refracted, true_direction};

/// The moon's place in the sky and its phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moon {
    direction: DVec3,
    illuminated: f64,
}

/// A periodic term of the moon's motion: multiples of the mean elongation, the sun's and the moon's
/// mean anomaly and the argument of latitude, then its size.
type Term = ([f64; 4], f64);

/// Ecliptic longitude, 10⁻⁶ degrees (Meeus 1998, table 47.A, terms above 0.003°).
const LONGITUDE: [Term; 27] = [
    ([0.0, 0.0, 1.0, 0.0], 6_288_774.0),
    ([2.0, 0.0, -1.0, 0.0], 1_274_027.0),
    ([2.0, 0.0, 0.0, 0.0], 658_314.0),
    ([0.0, 0.0, 2.0, 0.0], 213_618.0),
    ([0.0, 1.0, 0.0, 0.0], -185_116.0),
    ([0.0, 0.0, 0.0, 2.0], -114_332.0),
    ([2.0, 0.0, -2.0, 0.0], 58_793.0),
    ([2.0, -1.0, -1.0, 0.0], 57_066.0),
    ([2.0, 0.0, 1.0, 0.0], 53_322.0),
    ([2.0, -1.0, 0.0, 0.0], 45_758.0),
    ([0.0, 1.0, -1.0, 0.0], -40_923.0),
    ([1.0, 0.0, 0.0, 0.0], -34_720.0),
    ([0.0, 1.0, 1.0, 0.0], -30_383.0),
    ([2.0, 0.0, 0.0, -2.0], 15_327.0),
    ([0.0, 0.0, 1.0, 2.0], -12_528.0),
    ([0.0, 0.0, 1.0, -2.0], 10_980.0),
    ([4.0, 0.0, -1.0, 0.0], 10_675.0),
    ([0.0, 0.0, 3.0, 0.0], 10_034.0),
    ([4.0, 0.0, -2.0, 0.0], 8_548.0),
    ([2.0, 1.0, -1.0, 0.0], -7_888.0),
    ([2.0, 1.0, 0.0, 0.0], -6_766.0),
    ([1.0, 0.0, -1.0, 0.0], -5_163.0),
    ([1.0, 1.0, 0.0, 0.0], 4_987.0),
    ([2.0, -1.0, 1.0, 0.0], 4_036.0),
    ([2.0, 0.0, 2.0, 0.0], 3_994.0),
    ([4.0, 0.0, 0.0, 0.0], 3_861.0),
    ([2.0, 0.0, -3.0, 0.0], 3_665.0),
];

/// Ecliptic latitude, 10⁻⁶ degrees (table 47.B).
const LATITUDE: [Term; 13] = [
    ([0.0, 0.0, 0.0, 1.0], 5_128_122.0),
    ([0.0, 0.0, 1.0, 1.0], 280_602.0),
    ([0.0, 0.0, 1.0, -1.0], 277_693.0),
    ([2.0, 0.0, 0.0, -1.0], 173_237.0),
    ([2.0, 0.0, -1.0, 1.0], 55_413.0),
    ([2.0, 0.0, -1.0, -1.0], 46_271.0),
    ([2.0, 0.0, 0.0, 1.0], 32_573.0),
    ([0.0, 0.0, 2.0, 1.0], 17_198.0),
    ([2.0, 0.0, 1.0, -1.0], 9_266.0),
    ([0.0, 0.0, 2.0, -1.0], 8_822.0),
    ([2.0, -1.0, 0.0, -1.0], 8_216.0),
    ([2.0, 0.0, -2.0, -1.0], 4_324.0),
    ([2.0, 0.0, 1.0, 1.0], 4_200.0),
];

/// Distance beyond its mean, metres (table 47.A).
const DISTANCE: [Term; 12] = [
    ([0.0, 0.0, 1.0, 0.0], -20_905_355.0),
    ([2.0, 0.0, -1.0, 0.0], -3_699_111.0),
    ([2.0, 0.0, 0.0, 0.0], -2_955_968.0),
    ([0.0, 0.0, 2.0, 0.0], -569_925.0),
    ([2.0, 0.0, -2.0, 0.0], 246_158.0),
    ([2.0, -1.0, 0.0, 0.0], -204_586.0),
    ([2.0, 0.0, 1.0, 0.0], -170_733.0),
    ([2.0, -1.0, -1.0, 0.0], -152_138.0),
    ([0.0, 1.0, -1.0, 0.0], -129_620.0),
    ([1.0, 0.0, 0.0, 0.0], 108_743.0),
    ([0.0, 1.0, 1.0, 0.0], 104_755.0),
    ([0.0, 1.0, 0.0, 0.0], 48_888.0),
];
const MEAN_DISTANCE_M: f64 = 385_000_560.0;

const EARTH_RADIUS_M: f64 = 6_378_137.0;
const EARTH_FLATTENING: f64 = 1.0 / 298.257;
const SUN_DISTANCE_M: f64 = 1.496e11;
/// Dynamical time is ahead of UTC by so much, seconds: 64 in the year 2000 and 69 in 2020.
const DYNAMICAL_AHEAD_S: f64 = 69.0;
const CENTURY_S: f64 = 36_525.0 * 86_400.0;

impl Moon {
    /// The moon at an azimuth (clockwise from north) and an elevation, degrees, with this share of
    /// its disc in sunlight, 0..=1: 0 is new moon, 0.5 half and 1 full.
    ///
    /// # Errors
    /// If the azimuth is not −360..=360, the elevation not −90..=90, or the share not 0..=1.
    pub fn from_angles(
        azimuth_deg: f64,
        elevation_deg: f64,
        illuminated: f64,
    ) -> Result<Self, ParamError> {
        check("moon.azimuth_deg", azimuth_deg, -360.0, 360.0, "-360..=360")?;
        check("moon.elevation_deg", elevation_deg, -90.0, 90.0, "-90..=90")?;
        check("moon.illuminated", illuminated, 0.0, 1.0, "0..=1")?;
        let place = Sun::from_angles(azimuth_deg, elevation_deg)?;
        Ok(Self {
            direction: place.direction(),
            illuminated,
        })
    }

    /// The moon at a place (degrees; north and east are positive) and a time, by the largest terms
    /// of Meeus ("Astronomical Algorithms", chapter 47), where it is seen from the ground, with the
    /// refraction of [`Sun::at`]; within 0.1°.
    ///
    /// # Errors
    /// If the place is not on the earth or the time not in the calendar.
    pub fn at(latitude_deg: f64, longitude_deg: f64, time: UtcTime) -> Result<Self, ParamError> {
        let sun = true_direction(latitude_deg, longitude_deg, time)?;
        let t = time.julian_centuries()?;
        let (longitude, latitude, distance_m) = ecliptic(t + DYNAMICAL_AHEAD_S / CENTURY_S);
        let (sin_l, cos_l) = libm::sincos(longitude);
        let (sin_b, cos_b) = libm::sincos(latitude);
        let (sin_e, cos_e) = libm::sincos((23.439_291 - 0.013_004 * t).to_radians());
        // From the ecliptic to the equator.
        let from_earth = distance_m
            * DVec3::new(
                cos_b * cos_l,
                cos_b * sin_l * cos_e - sin_b * sin_e,
                cos_b * sin_l * sin_e + sin_b * cos_e,
            );
        // The observer, by local sidereal time (Meeus 12.4).
        let days = t * 36_525.0;
        let sidereal_deg = 280.460_618_37 + 360.985_647_366_29 * days + longitude_deg;
        let (sin_s, cos_s) = libm::sincos(sidereal_deg.rem_euclid(360.0).to_radians());
        let (sin_lat, cos_lat) = libm::sincos(latitude_deg.to_radians());
        let polar = 1.0 - EARTH_FLATTENING;
        let curvature_m =
            EARTH_RADIUS_M / libm::sqrt(cos_lat * cos_lat + (polar * sin_lat) * (polar * sin_lat));
        let observer =
            curvature_m * DVec3::new(cos_lat * cos_s, cos_lat * sin_s, polar * polar * sin_lat);
        let seen = from_earth - observer;
        // From the equatorial frame to east, north, up.
        let (east, north, up) = (
            DVec3::new(-sin_s, cos_s, 0.0),
            DVec3::new(-sin_lat * cos_s, -sin_lat * sin_s, cos_lat),
            DVec3::new(cos_lat * cos_s, cos_lat * sin_s, sin_lat),
        );
        let seen_m = seen.length();
        let direction = DVec3::new(seen.dot(east), seen.dot(north), seen.dot(up)) / seen_m;
        // The angle at the moon between the sun and the observer.
        let to_sun = sun * SUN_DISTANCE_M - direction * seen_m;
        let cos_phase = -to_sun.dot(direction) / to_sun.length();
        Ok(Self {
            direction: refracted(direction),
            illuminated: (0.5 + 0.5 * cos_phase).clamp(0.0, 1.0),
        })
    }

    /// The unit vector towards the moon: east, north, up.
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

    /// The share of its disc that is in sunlight, 0..=1.
    #[must_use]
    pub fn illuminated(&self) -> f64 {
        self.illuminated
    }

    /// Its illuminance above the air on a plane that faces it, lux, at the mean distance: Allen's
    /// law of magnitudes (Krisciunas and Schaefer 1991, equation 9), in which a half moon has an
    /// eleventh of the full moon's light, as its shadows are long. A new moon, of less than a
    /// thousandth, has none.
    pub(crate) fn illuminance_lx(&self) -> f64 {
        if self.illuminated < 1e-3 {
            return 0.0;
        }
        let phase_deg = libm::acos(2.0 * self.illuminated - 1.0).to_degrees();
        let squared = phase_deg * phase_deg;
        let magnitude = -12.73 + 0.026 * phase_deg + 4e-9 * squared * squared;
        // A star of magnitude −13.98 gives one lux (Allen, "Astrophysical Quantities").
        libm::exp10(-0.4 * (magnitude + 13.98))
    }
}

/// The moon's ecliptic longitude and latitude, radians, and its distance from the earth's centre,
/// metres, at a dynamical time in Julian centuries from J2000.0.
fn ecliptic(t: f64) -> (f64, f64, f64) {
    let mean = 218.316_447_7 + 481_267.881_234_21 * t - 0.001_578_6 * t * t;
    let arguments = [
        297.850_192_1 + 445_267.111_403_4 * t - 0.001_881_9 * t * t,
        357.529_109_2 + 35_999.050_290_9 * t - 0.000_153_6 * t * t,
        134.963_396_4 + 477_198.867_505_5 * t + 0.008_741_4 * t * t,
        93.272_095_0 + 483_202.017_523_3 * t - 0.003_653_9 * t * t,
    ]
    .map(|deg: f64| deg.rem_euclid(360.0).to_radians());
    // The earth's orbit becomes rounder.
    let eccentricity = 1.0 - 0.002_516 * t;
    let angle = |of: &[f64; 4]| of.iter().zip(arguments).map(|(n, a)| n * a).sum::<f64>();
    let size = |(of, size): &Term| {
        if of[1] == 0.0 {
            *size
        } else {
            size * eccentricity
        }
    };
    let sines = |terms: &[Term]| -> f64 {
        let term = |term: &Term| size(term) * libm::sin(angle(&term.0));
        terms.iter().map(term).sum()
    };
    let cosines: f64 = (DISTANCE.iter())
        .map(|term| size(term) * libm::cos(angle(&term.0)))
        .sum();
    (
        (mean + 1e-6 * sines(&LONGITUDE))
            .rem_euclid(360.0)
            .to_radians(),
        (1e-6 * sines(&LATITUDE)).to_radians(),
        MEAN_DISTANCE_M + cosines,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Meeus, example 47.a: 1992 April 12, 0h dynamical time.
    #[test]
    fn the_textbooks_example_is_met() {
        let (longitude, latitude, distance_m) = ecliptic(-0.077_221_081_451);
        assert!(
            (longitude.to_degrees() - 133.162_655).abs() < 0.015,
            "{}",
            longitude.to_degrees()
        );
        assert!(
            (latitude.to_degrees() + 3.229_126).abs() < 0.01,
            "{}",
            latitude.to_degrees()
        );
        assert!((distance_m - 368_409.7e3).abs() < 200e3, "{distance_m}");
    }

    /// Places on the ground by the program Astronomy Engine 2.1: azimuth, elevation (with
    /// refraction, but below the horizon), lit share.
    #[test]
    fn agrees_with_an_astronomers_program() {
        for (latitude, longitude, (year, month, day), hour, azimuth, elevation, lit) in [
            (
                40.2033,
                -8.4103,
                (2022, 6, 14),
                23.5,
                157.708,
                18.690,
                0.9956,
            ),
            (
                60.1699,
                24.9384,
                (2024, 1, 25),
                20.0,
                124.524,
                43.073,
                0.9982,
            ),
            (46.95, 7.44, (2024, 10, 10), 19.25, 203.155, 11.334, 0.5027),
            (-37.8, 145.0, (2025, 1, 8), 11.0, 332.951, 29.957, 0.6647),
            (44.56, -123.26, (2025, 8, 2), 5.75, 226.271, 9.036, 0.5685),
            (51.5, 0.0, (2019, 12, 26), 17.0, 239.167, -6.560, 0.0027),
            // During an eclipse of the sun, and one of the moon.
            (32.78, -96.8, (2024, 4, 8), 18.7, 187.632, 64.632, 0.0),
            (40.2, -8.41, (2025, 3, 14), 3.0, 230.885, 40.600, 0.9997),
        ] {
            let time = UtcTime {
                year,
                month,
                day,
                hour,
            };
            let moon = Moon::at(latitude, longitude, time).expect("on earth");
            let exact = Moon::from_angles(azimuth, elevation, lit).expect("valid");
            let apart = moon.direction().distance(exact.direction()).to_degrees();
            assert!(apart < 0.1, "{year}: {apart}° from {azimuth} {elevation}");
            assert!(
                (moon.illuminated() - lit).abs() < 0.01,
                "{year}: {}",
                moon.illuminated()
            );
        }
    }

    #[test]
    fn the_moon_covers_the_sun_in_an_eclipse() {
        let time = UtcTime {
            year: 2024,
            month: 4,
            day: 8,
            hour: 18.7,
        };
        let (moon, sun) = (Moon::at(32.78, -96.8, time), Sun::at(32.78, -96.8, time));
        let apart = (moon.expect("fine").direction()).distance(sun.expect("fine").direction());
        assert!(apart.to_degrees() < 0.1, "{}", apart.to_degrees());
    }

    #[test]
    fn a_half_moon_has_a_tenth_of_the_light() {
        let of = |lit| {
            Moon::from_angles(0.0, 45.0, lit)
                .expect("valid")
                .illuminance_lx()
        };
        assert!((0.28..0.36).contains(&of(1.0)), "{}", of(1.0));
        assert!(
            (of(0.5) / of(1.0) - 0.091).abs() < 0.002,
            "{}",
            of(0.5) / of(1.0)
        );
        assert_eq!(of(0.0), 0.0);
        let bad = Moon::from_angles(0.0, 45.0, 1.5).expect_err("more than all");
        assert_eq!(bad.field, "moon.illuminated");
    }
}
