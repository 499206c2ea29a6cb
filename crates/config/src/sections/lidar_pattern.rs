//! Keys of the LiDAR's scan pattern.

use serde::{Deserialize, Serialize};

use super::DATA;
use crate::schema::AllowedValues::{File, OneOf, Real, RealAbove, Whole};
use crate::schema::{encode_variants, section};
use crate::{InputPath, MirrorKind, SpinningHead};

/// The scan pattern.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LidarPattern {
    /// Repeating lines.
    Lines(LidarLines),
    /// Non-repeating, circular.
    Mid40(LidarMid40),
    /// Non-repeating, rectangular.
    Horizon(LidarHorizon),
    /// Non-repeating, circular and wide.
    Mid70(LidarMid70),
    /// Non-repeating, six beams.
    Avia(LidarAvia),
    /// A spinning head by its beam table.
    Spinning(LidarSpinning),
    /// A terrestrial scanner's turn.
    Panorama(LidarPanorama),
    /// An airborne scanner's mirror.
    Mirror(LidarMirror),
    /// From a file.
    Table(LidarTable),
}

encode_variants! { LidarPattern
    Lines: "lines";
    Mid40: "mid40";
    Horizon: "horizon";
    Mid70: "mid70";
    Avia: "avia";
    Spinning: "spinning";
    Panorama: "panorama";
    Mirror: "mirror";
    Table: "table";
}

impl Default for LidarPattern {
    fn default() -> Self {
        Self::Horizon(LidarHorizon::default())
    }
}

section! {
    /// Repeating lines: a spinning scanner.
    LidarLines at "lidar.lines", one of "the scan pattern" {
        /// Lines.
        lines: u32 = 32, Whole(1, 128), "a common spinning scanner";
        /// Lowest line, above the horizon.
        low_deg: f64 = -15.0, Real(-90.0, 90.0), "VLP-16 user manual";
        /// Highest line.
        high_deg: f64 = 15.0, Real(-90.0, 90.0), "VLP-16 user manual";
        /// Turns per second.
        rotation_hz: f64 = 10.0, RealAbove(0.0, 100.0), "VLP-16 user manual: 5-20 Hz";
    }
}

section! {
    /// Non-repeating, circular field of view: the Livox Mid-40's two prisms, 100,000 pulses a
    /// second.
    LidarMid40 at "lidar.mid40", one of "the scan pattern" {}
}

section! {
    /// Non-repeating, rectangular field of view: Horizon-like, 240,000 pulses a second.
    LidarHorizon at "lidar.horizon", one of "the scan pattern" {}
}

section! {
    /// Non-repeating, circular: the Livox Mid-70's stronger prisms, 100,000 pulses a second.
    LidarMid70 at "lidar.mid70", one of "the scan pattern" {}
}

section! {
    /// Non-repeating, 70° by 77°: the Livox Avia's three prisms and six beams, 240,000 pulses a
    /// second.
    LidarAvia at "lidar.avia", one of "the scan pattern" {}
}

section! {
    /// A spinning head, with its beam table and firing times.
    LidarSpinning at "lidar.spinning", one of "the scan pattern" {
        /// The scanner.
        head: SpinningHead = SpinningHead::Vlp16, OneOf(SpinningHead::WORDS),
            "Velodyne and Ouster manuals, ros-drivers/velodyne";
        /// Turns per second.
        rotation_hz: f64 = 10.0, RealAbove(0.0, 100.0), "VLP-16 user manual: 5-20 Hz";
        /// Beams of an `ouster`.
        beams: u32 = 64, Whole(1, 255), "OS1-64";
        /// Vertical field of view of an `ouster`.
        vertical_fov_deg: f64 = 45.0, RealAbove(0.0, 180.0), "OS1; an OS0 has 90";
        /// Columns per turn of an `ouster` and of `os1_64`, an OS-1-64 of the first generation.
        columns: u32 = 1024, Whole(1, 100_000), "OS1 at 10 Hz";
    }
}

section! {
    /// A terrestrial scanner: one turn of sweeps from below to the zenith, at equal angles; it has
    /// the number of pulses that is asked for.
    LidarPanorama at "lidar.panorama", one of "the scan pattern" {
        /// Lowest pulse, above the horizon.
        low_deg: f64 = -60.0, Real(-90.0, 90.0), "the tripod hides what is below";
        /// Highest pulse.
        high_deg: f64 = 90.0, Real(-90.0, 90.0), "the zenith";
        /// Pulses per second.
        rate_hz: f64 = 2e6, RealAbove(0.0, 1e8), "phase-shift scanners";
    }
}

section! {
    /// The mirror of an airborne scanner, which looks down by itself from a level mount: it moves
    /// the beam across the flight. Pulses that cannot be measured are not counted in
    /// `lidar.pulses`.
    LidarMirror at "lidar.mirror", one of "the scan pattern" {
        /// One facet that turns about the direction of flight, several facets, a mirror that swings
        /// like a sine or at a constant rate, a cone around straight down, or a mirror that wobbles
        /// and draws nearly an ellipse, whose width along the flight is 0.7 of that across.
        kind: MirrorKind = MirrorKind::Rotating, OneOf(MirrorKind::WORDS),
            "HELIOS++ (Winiwarter et al. 2022): VUX-1UAV; nutating: VQ-840-G";
        /// Pulses fired per second, measured or not.
        rate_hz: u32 = 550_000, Whole(1, 10_000_000), "VUX-1UAV, at its fastest";
        /// Lines per second: facets that pass, swings there and back, or turns; at most `rate_hz`.
        lines_hz: u32 = 100, Whole(1, 1000), "VUX-1UAV: 10 to 200";
        /// The greatest angle to straight down at which pulses are measured: at most 180 for
        /// `rotating`, 90 for the others.
        half_angle_deg: f64 = 45.0, RealAbove(0.0, 180.0), "common in surveys; a VUX-1UAV has 165";
        /// The part of a facet's sweep in which pulses of a `polygon` are measured.
        duty: f64 = 0.6667, RealAbove(0.0, 1.0), "VQ-1560i: 1.33 of 2 million";
    }
}

section! {
    /// A table of pulses that is replayed: rows of `time, azimuth, elevation[, ring]` in seconds,
    /// degrees to the left of forward and degrees up. A header may come first; times never
    /// decrease.
    LidarTable at "lidar.table", one of "the scan pattern" {
        /// The CSV file.
        path: InputPath = InputPath::default(), File(DATA), "none";
    }
}

section! {
    /// A motor that turns the scanner, as on handheld and backpack mappers, about the upright axis
    /// of the LiDAR's mount, counterclockwise from above. Points are in the frame of the mount.
    LidarMotor at "lidar.motor" {
        /// Turns per second; 0 for no motor.
        turns_hz: f64 = 0.0, Real(0.0, 100.0), "no motor; ZEB Horizon: 0.497";
        /// Angle from that axis to the scanner's own upright axis; 90 lays it on its side.
        tilt_deg: f64 = 90.0, Real(0.0, 180.0), "our choice: it sees in all directions";
    }
}
