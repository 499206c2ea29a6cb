//! Livox Mid-40, Mid-70 and Avia: rotating wedge prisms.

use nemoral_scene::DirectionCone;
use nemoral_scene::glam::DVec3;

use crate::pattern::{rotor, together};
use crate::{Pulse, ScanPattern};

/// Livox Mid-40: the paper's "non-repeating, circular field of view", 38.3° wide.
///
/// Two equal 18° wedges of N-BK7 at +7294 and −4664 turns per minute, Snell's law at each of their
/// four faces, 100,000 pulses per second. This reproduces the 400,000 directions of the table in
/// Livox's own simulator to 1.1e-5°. The figure closes after exactly 30 s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mid40;

/// Livox Mid-70: the Mid-40's motion through stronger prisms, 70.4° wide.
///
/// Reproduces the table in Livox's own simulator to 1.4e-5°.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mid70;

/// Livox Avia: non-repeating, 70.4° × 77.2°; six beams through three prisms, 240,000 pulses a
/// second.
///
/// The prisms are those of its model in HELIOS++, which was fitted to the published pattern: wedges
/// of 30.8856°, 29.7735° and 3.1351° in glass of index 1.51, each entered through its tilted face,
/// at −131.5463, 40.8032 and 213.1611 turns a second; six beams above each other fire together
/// 40,000 times a second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Avia;

const RATE_HZ: u64 = 100_000;
/// Turns per minute; the second rotor turns the other way.
const ROTORS_RPM: [u64; 2] = [7294, 4664];

/// After so many seconds both rotors have made whole numbers of turns.
const MID_CYCLE_S: u64 = 30;

/// The greatest angles of pulses to x forward, degrees, rounded up.
const MID40_HALF_ANGLE_DEG: f64 = 19.3;
const MID70_HALF_ANGLE_DEG: f64 = 35.3;
const AVIA_HALF_ANGLE_DEG: f64 = 38.7;

fn ahead(half_angle_deg: f64) -> DirectionCone {
    DirectionCone {
        axis: DVec3::X,
        half_angle_rad: half_angle_deg.to_radians(),
    }
}

impl ScanPattern for Mid40 {
    fn pulse(&self, number: u64) -> Pulse {
        let [first, second] = wedge_normals(number);
        let faces = [FLAT, first, second, FLAT];
        pulse(number, faces, 1.5089)
    }

    fn field_of_view(&self) -> DirectionCone {
        ahead(MID40_HALF_ANGLE_DEG)
    }

    fn rate_hz(&self) -> f64 {
        RATE_HZ as f64
    }

    fn cycle(&self) -> u64 {
        MID_CYCLE_S * RATE_HZ
    }
}

/// The upward direction cosines of the Avia's beams when they reach the first prism.
const AVIA_BEAMS: [f64; 6] = [
    -0.052_160_7,
    -0.032_376_35,
    -0.010_796_72,
    0.010_796_72,
    0.032_376_35,
    0.053_007_85,
];
const AVIA_SHOTS_HZ: u64 = 40_000;

/// A prism of the Avia: turns per 10,000 s, and the sign and the angle of its wedge.
const AVIA_PRISMS: [(u64, f64, f64); 3] = [
    (1_315_463, -1.0, 30.8856),
    (408_032, 1.0, 29.7735),
    (2_131_611, 1.0, 3.1351),
];

/// The normals of its prisms' tilted faces.
fn avia_faces(shot: u64) -> [DVec3; 3] {
    AVIA_PRISMS.map(|(turns, sense, wedge_deg)| {
        let (sin, cos) = rotor(shot, turns, 10_000 * AVIA_SHOTS_HZ, 0.0);
        let (tilt, along) = libm::sincos(wedge_deg.to_radians());
        DVec3::new(-along, tilt * cos, tilt * sense * sin)
    })
}

fn avia_pulse(faces: &[DVec3; 3], shot: u64, beam: u64) -> Pulse {
    let side = AVIA_BEAMS[beam as usize];
    let mut direction = DVec3::new((1.0 - side * side).sqrt(), 0.0, side);
    for &normal in faces {
        direction = refract(direction, normal, 1.51_f64.recip());
        direction = refract(direction, FLAT, 1.51);
    }
    Pulse {
        time_s: shot as f64 / AVIA_SHOTS_HZ as f64,
        direction,
        ring: beam as u8,
    }
}

const AVIA_LASERS: u64 = AVIA_BEAMS.len() as u64;

impl ScanPattern for Avia {
    fn pulse(&self, number: u64) -> Pulse {
        let shot = number / AVIA_LASERS;
        avia_pulse(&avia_faces(shot), shot, number % AVIA_LASERS)
    }

    fn pulses(&self, first: u64, count: u32) -> Vec<Pulse> {
        together((first, count), AVIA_LASERS, avia_faces, avia_pulse)
    }

    fn field_of_view(&self) -> DirectionCone {
        ahead(AVIA_HALF_ANGLE_DEG)
    }

    fn rate_hz(&self) -> f64 {
        (AVIA_LASERS * AVIA_SHOTS_HZ) as f64
    }

    /// The shots of 10,000 s, in which all prisms make whole numbers of turns that have no common
    /// divisor.
    fn cycle(&self) -> u64 {
        10_000 * AVIA_SHOTS_HZ * AVIA_LASERS
    }
}

impl ScanPattern for Mid70 {
    fn pulse(&self, number: u64) -> Pulse {
        let [first, second] = wedge_normals(number);
        let faces = [first, FLAT, FLAT, second];
        pulse(number, faces, 1.8144)
    }

    fn field_of_view(&self) -> DirectionCone {
        ahead(MID70_HALF_ANGLE_DEG)
    }

    fn rate_hz(&self) -> f64 {
        RATE_HZ as f64
    }

    fn cycle(&self) -> u64 {
        MID_CYCLE_S * RATE_HZ
    }
}

/// The normal of a flat face, towards the beam that comes along x.
const FLAT: DVec3 = DVec3::NEG_X;
/// Sine and cosine of the wedge angle, 18°.
const WEDGE: (f64, f64) = (0.309_016_994_374_947_4, 0.951_056_516_295_153_5);

/// The normals of the two tilted faces; the second wedge is mounted the other way round.
fn wedge_normals(number: u64) -> [DVec3; 2] {
    let (tilt, along) = WEDGE;
    let (sin1, cos1) = rotor(number, ROTORS_RPM[0], 60 * RATE_HZ, 0.0);
    let (sin2, cos2) = rotor(number, ROTORS_RPM[1], 60 * RATE_HZ, 0.0);
    [
        DVec3::new(-along, tilt * cos1, tilt * sin1),
        // Turning backwards negates the sine, and the mounting negates the tilt.
        DVec3::new(-along, -tilt * cos2, tilt * sin2),
    ]
}

/// The beam along x through four faces, into glass at the first and third, out at the others.
fn pulse(number: u64, faces: [DVec3; 4], refractive_index: f64) -> Pulse {
    let mut direction = DVec3::X;
    for (i, normal) in faces.into_iter().enumerate() {
        let into_glass = i % 2 == 0;
        let ratio = if into_glass {
            refractive_index.recip()
        } else {
            refractive_index
        };
        direction = refract(direction, normal, ratio);
    }
    Pulse {
        time_s: number as f64 / RATE_HZ as f64,
        direction,
        ring: 0,
    }
}

/// Snell's law for unit vectors; `normal` faces the beam, `ratio` is the refractive index before
/// over the one behind. The Mid prisms are far from total reflection, the Avia's just short of it.
fn refract(direction: DVec3, normal: DVec3, ratio: f64) -> DVec3 {
    let cos = -direction.dot(normal);
    let cos_behind = (1.0 - ratio * ratio * (1.0 - cos * cos)).sqrt();
    ratio * direction + (ratio * cos - cos_behind) * normal
}
