//! Spinning scanners, defined by beam tables: Velodyne, Ouster, and any other.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use crate::pattern::sloped;
use crate::{ParamError, Pulse, ScanPattern};

/// One laser of a [`SpinningPattern`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laser {
    /// Angle above the horizon, radians, −π/2..=π/2.
    pub elevation_rad: f64,
    /// Angle to the left of the head's, radians, −π..=π.
    pub azimuth_rad: f64,
    /// When it fires after the start of the firing sequence, seconds, from 0 to the sequence's
    /// length.
    pub delay_s: f64,
    /// Its ring, as the maker counts: Velodyne from the lowest laser, Ouster from the highest.
    pub ring: u8,
}

/// A head of lasers that fire one after the other while it spins, clockwise from above as
/// Velodyne's and Ouster's do. It starts at the back, so that a turn's middle is straight ahead.
///
/// All lasers are at the sensor's origin; the centimetres between them on a real head are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct SpinningPattern {
    /// The lasers in order of the time at which they fire.
    lasers: Vec<Laser>,
    /// The sines and cosines of their elevations.
    slopes: Vec<(f64, f64)>,
    sequence_s: f64,
    rotation_hz: f64,
    /// Whether each laser is alone on its ring.
    rings_differ: bool,
    /// The ring of each laser as counted from the lowest one, however the head's maker counts.
    from_lowest: Vec<u8>,
}

impl SpinningPattern {
    /// A scanner by its lasers (1 to 255), the length of a firing sequence in seconds, and its
    /// turns per second.
    ///
    /// # Errors
    /// If there are too few or too many lasers, or one is out of its ranges, or a duration or rate
    /// is not positive.
    pub fn new(
        mut lasers: Vec<Laser>,
        sequence_s: f64,
        rotation_hz: f64,
    ) -> Result<Self, ParamError> {
        let count = lasers.len() as f64;
        ParamError::check(
            (1.0..=255.0).contains(&count),
            "lasers",
            count,
            "1..=255 of them",
        )?;
        ParamError::check_positive("sequence_s", sequence_s)?;
        ParamError::check_positive("rotation_hz", rotation_hz)?;
        for laser in &lasers {
            let (up, left, delay) = (laser.elevation_rad, laser.azimuth_rad, laser.delay_s);
            ParamError::check(
                (-PI / 2.0..=PI / 2.0).contains(&up),
                "elevation_rad",
                up,
                "−π/2..=π/2",
            )?;
            ParamError::check((-PI..=PI).contains(&left), "azimuth_rad", left, "−π..=π")?;
            ParamError::check(
                (0.0..sequence_s).contains(&delay),
                "delay_s",
                delay,
                "from 0 to below sequence_s",
            )?;
        }
        lasers.sort_by(|a, b| a.delay_s.total_cmp(&b.delay_s));
        let rings: BTreeSet<u8> = lasers.iter().map(|l| l.ring).collect();
        Ok(Self {
            rings_differ: rings.len() == lasers.len(),
            from_lowest: lasers.iter().map(|l| l.ring).collect(),
            slopes: lasers
                .iter()
                .map(|l| libm::sincos(l.elevation_rad))
                .collect(),
            lasers,
            sequence_s,
            rotation_hz,
        })
    }

    /// Velodyne VLP-16: ±15°, one laser each 2.304 µs in its interleaved order, 55.296 µs a
    /// sequence (elevations: ros-drivers/velodyne; timing: the user manual), so 289,352 pulses a
    /// second.
    ///
    /// # Errors
    /// If `rotation_hz` is not positive.
    pub fn vlp16(rotation_hz: f64) -> Result<Self, ParamError> {
        const ELEVATIONS_DEG: [i8; 16] =
            [-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15];
        let laser = |(i, deg): (usize, &i8)| Laser {
            elevation_rad: f64::from(*deg).to_radians(),
            azimuth_rad: 0.0,
            delay_s: 2.304e-6 * i as f64,
            ring: ((deg + 15) / 2) as u8,
        };
        let lasers = ELEVATIONS_DEG.iter().enumerate().map(laser).collect();
        Self::new(lasers, 55.296e-6, rotation_hz)
    }

    /// Velodyne HDL-64E S2: 32 lasers each ⅓° from +2° down and 32 each ½° below, 1.333 million
    /// pulses a second (rate: HELIOS++; blocks: the data sheet). They fire one after the other,
    /// upper and lower in turn.
    ///
    /// # Errors
    /// If `rotation_hz` is not positive.
    pub fn hdl64e(rotation_hz: f64) -> Result<Self, ParamError> {
        let sequence_s = 48e-6;
        let laser = |i: u8| {
            let (upper, row) = (i.is_multiple_of(2), f64::from(i / 2));
            let elevation_deg = if upper {
                2.0 - row / 3.0
            } else {
                -8.83 - row / 2.0
            };
            Laser {
                elevation_rad: elevation_deg.to_radians(),
                azimuth_rad: 0.0,
                delay_s: sequence_s * f64::from(i) / 64.0,
                ring: if upper { 63 - i / 2 } else { 31 - i / 2 },
            }
        };
        Self::new((0..64).map(laser).collect(), sequence_s, rotation_hz)
    }

    /// An Ouster with evenly spaced beams over its vertical field of view (OS0: 90°, OS1: 45°),
    /// which all fire together in each of so many columns a turn. Ring 0 is the highest beam, as in
    /// the maker's tables of beams and drivers.
    ///
    /// # Errors
    /// If there are no beams or more than 255, or a value is not positive.
    pub fn ouster(
        vertical_fov_rad: f64,
        beams: u8,
        columns: u32,
        rotation_hz: f64,
    ) -> Result<Self, ParamError> {
        ParamError::check(
            vertical_fov_rad > 0.0 && vertical_fov_rad <= PI,
            "vertical_fov_rad",
            vertical_fov_rad,
            "greater than 0 and at most π",
        )?;
        ParamError::check(columns >= 1, "columns", columns, "at least 1")?;
        ParamError::check_positive("rotation_hz", rotation_hz)?;
        let step = vertical_fov_rad / f64::from(beams.max(2) - 1);
        let laser = |from_bottom: u8| Laser {
            elevation_rad: if beams == 1 {
                0.0
            } else {
                // Rounded, the uppermost of π may be above π/2.
                (step * f64::from(from_bottom) - 0.5 * vertical_fov_rad).min(PI / 2.0)
            },
            azimuth_rad: 0.0,
            delay_s: 0.0,
            ring: beams - 1 - from_bottom,
        };
        let sequence_s = 1.0 / (f64::from(columns) * rotation_hz);
        let head = Self::new((0..beams).map(laser).collect(), sequence_s, rotation_hz)?;
        Ok(Self {
            from_lowest: (head.lasers.iter()).map(|l| beams - 1 - l.ring).collect(),
            ..head
        })
    }
}

impl SpinningPattern {
    /// An Ouster OS-1-64 of the first generation: 64 beams over ±16.611°, which in turns of four
    /// look 3.164° and 1.055° to the right and as much to the left of the head (the tables
    /// `gen1_altitude_angles` and `gen1_azimuth_angles` of the maker's SDK).
    ///
    /// # Errors
    /// If a value is not positive.
    pub fn os1_64(columns: u32, rotation_hz: f64) -> Result<Self, ParamError> {
        const TO_THE_RIGHT_DEG: [f64; 4] = [3.164, 1.055, -1.055, -3.164];
        let vertical_fov_rad = 2.0 * f64::to_radians(16.611);
        let mut head = Self::ouster(vertical_fov_rad, 64, columns, rotation_hz)?;
        for laser in &mut head.lasers {
            let to_the_right_deg = TO_THE_RIGHT_DEG[usize::from(laser.ring % 4)];
            laser.azimuth_rad = -to_the_right_deg.to_radians();
        }
        Ok(head)
    }
}

impl ScanPattern for SpinningPattern {
    fn pulse(&self, number: u64) -> Pulse {
        let count = self.lasers.len() as u64;
        let index = (number % count) as usize;
        let (laser, slope) = (&self.lasers[index], self.slopes[index]);
        let time_s = (number / count) as f64 * self.sequence_s + laser.delay_s;
        // The rounding error is a millionth of a turn after a year at 20 Hz.
        let turned = (time_s * self.rotation_hz).fract();
        Pulse {
            time_s,
            direction: sloped(PI - TAU * turned + laser.azimuth_rad, slope),
            ring: laser.ring,
        }
    }

    /// The identity is made of firing sequence and ring, or of the laser's number where lasers
    /// share a ring. Rings count from the lowest laser here, so that the noise of a pulse does not
    /// depend on the maker's numbers.
    fn identity(&self, number: u64) -> u64 {
        if !self.rings_differ {
            return number;
        }
        let count = self.lasers.len() as u64;
        let ring = self.from_lowest[(number % count) as usize];
        (number / count) << 8 | u64::from(ring)
    }

    fn rate_hz(&self) -> f64 {
        self.lasers.len() as f64 / self.sequence_s
    }
}
