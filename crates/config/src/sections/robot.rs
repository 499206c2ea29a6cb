//! Keys of the robot's path.

use serde::{Deserialize, Serialize};

use super::{DATA, PathTrail};
use crate::schema::AllowedValues::{File, Flag, OneOf, Real, RealAbove, Whole};
use crate::schema::{encode_variants, section};
use crate::{FlightFollow, InputPath, PathFormat};

section! {
    /// The robot: its path, and the interval of frames.
    Robot at "robot" {
        /// Distance between frames at full speed.
        spacing_m: f64 = 1.0, Real(0.0, 1000.0), "new views, overlapping";
        /// Time between frames; 0 to use the distance instead.
        spacing_s: f64 = 0.0, Real(0.0, 3600.0), "by metres";
        /// Speed, which gives times and the motion during a scan.
        speed_m_s: f64 = 1.0, RealAbove(0.0, 30.0), "walking pace";
        /// Time at rest before a drive along a trail, a wander, lanes or a straight line, as
        /// inertial estimators begin; it then speeds up by at most 1 m/s². 0 for full speed from
        /// the start.
        rest_s: f64 = 0.0, Real(0.0, 3600.0), "in full motion";
        /// Start of the path, metres east.
        start_x_m: f64 = 0.0, Real(-1e8, 1e8), "the origin";
        /// Start of the path, metres north.
        start_y_m: f64 = 0.0, Real(-1e8, 1e8), "the origin";
        /// Heading of `straight`, of a wander, and of the first lane or flight line, clockwise from
        /// north.
        heading_deg: f64 = 45.0, Real(-360.0, 360.0), "north-east";
        /// Distance between axles, over which the body's pitch follows the ground.
        wheelbase_m: f64 = 0.8, Real(0.1, 10.0), "a small tracked robot";
        /// Distance between tracks, over which the body's roll follows the ground.
        track_m: f64 = 0.6, Real(0.1, 10.0), "a small tracked robot";
        /// Clearance from stems and rocks on a wander, in lanes and at stations.
        clearance_m: f64 = 0.8, Real(0.0, 10.0), "half the robot's width and a margin";
    }
    plus {
        /// The path.
        #[serde(flatten)]
        path: RobotPath;
        /// A walker's sway.
        gait: RobotGait;
    }
}

/// The path of the robot.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RobotPath {
    /// Along the nearest trail, there and back.
    Trail(PathTrail),
    /// A smooth wander through the forest.
    Wander(PathWander),
    /// Lanes through the forest, up and down an area.
    Lanes(PathLanes),
    /// A straight line.
    Straight(PathStraight),
    /// A grid of fixed stations.
    Stations(PathStations),
    /// Flight lines above an area.
    Flight(PathFlight),
    /// Poses from a file.
    File(PathFile),
}

encode_variants! { RobotPath
    Trail: "trail";
    Wander: "wander";
    Lanes: "lanes";
    Straight: "straight";
    Stations: "stations";
    Flight: "flight";
    File: "file";
}

impl Default for RobotPath {
    fn default() -> Self {
        Self::Trail(PathTrail::default())
    }
}

section! {
    /// The sway of a walker who carries the sensors along a trail, a wander, lanes or a straight
    /// line: up and down and a pitch once a step, from side to side and a roll once in two steps. A
    /// walker is upright on any slope; `robot.wheelbase_m` and `robot.track_m` then only smooth the
    /// height.
    RobotGait at "robot.gait" {
        /// Length of a step, at least 0.1; 0 for a robot that rolls.
        step_m: f64 = 0.0, Real(0.0, 3.0), "wheels or tracks; walkers with a scanner: 0.65";
        /// Amplitude of up and down.
        bob_m: f64 = 0.025, Real(0.0, 1.0), "our choice: 2 to 3 cm";
        /// Amplitude of side to side.
        sway_m: f64 = 0.025, Real(0.0, 1.0), "our choice: 2 to 3 cm";
        /// Amplitude of the pitch.
        pitch_deg: f64 = 2.5, Real(0.0, 45.0), "our choice: 2 to 3 degrees";
        /// Amplitude of the roll.
        roll_deg: f64 = 2.5, Real(0.0, 45.0), "our choice: 2 to 3 degrees";
        /// Height of the point about which the body pitches and rolls.
        hip_m: f64 = 1.0, Real(0.0, 10.0), "a walker's hips";
    }
}

section! {
    /// A smooth wander that avoids stems and rocks.
    PathWander at "robot.wander", one of "the robot's path" {
        /// The greatest deviation from the line of its heading.
        amplitude_m: f64 = 8.0, Real(0.0, 30.0), "a few trees wide";
    }
}

section! {
    /// Lanes up and down an area and back to near where they began, as one walks a plot with a
    /// handheld or backpack scanner, past stems and rocks. The middle of the area is the start, its
    /// length is along the heading.
    PathLanes at "robot.lanes", one of "the robot's path" {
        /// Length of the area, along the lanes.
        length_m: f64 = 30.0, Real(1.0, 1000.0), "a plot of 30 m";
        /// Width of the area, across the lanes. There are as many as cover it, and one more where
        /// they would be odd, so that the last leads back.
        width_m: f64 = 30.0, Real(1.0, 1000.0), "a plot of 30 m";
        /// Distance between neighbouring lanes.
        spacing_m: f64 = 10.0, Real(4.0, 100.0), "usual with handheld scanners";
        /// The greatest deviation from a lane; at most a fifth of their distance.
        amplitude_m: f64 = 1.5, Real(0.0, 20.0), "past a tree";
    }
}

section! {
    /// A straight line, which does not avoid anything.
    PathStraight at "robot.straight", one of "the robot's path" {}
}

section! {
    /// Fixed stations, as in terrestrial scanning: a grid around the start. Each station is level
    /// and still, and is moved to the nearest clear place up to a third of their distance away, or
    /// where none is clear, to the one with most room.
    PathStations at "robot.stations", one of "the robot's path" {
        /// Stations from west to east.
        columns: u32 = 3, Whole(1, 1000), "a plot of 30 m";
        /// Stations from south to north.
        rows: u32 = 3, Whole(1, 1000), "a plot of 30 m";
        /// Distance between neighbouring stations.
        distance_m: f64 = 12.0, RealAbove(0.0, 1000.0), "10 to 15 m are usual";
    }
}

section! {
    /// Parallel flight lines above an area, as a drone surveys it, flown to and fro. The middle of
    /// the area is the start, its length is along the heading. Frames are on the lines alone, one
    /// after the other without gaps, and the robot's speed and interval of frames are those on the
    /// lines. A scan that takes as long as a frame covers each line once.
    PathFlight at "robot.flight", one of "the robot's path" {
        /// Height above what is followed, where the sensors' mounts are measured from.
        height_m: f64 = 60.0, RealAbove(0.0, 500.0), "drones: 40-120 m";
        /// What the height is above: the highest ground near the drone, smoothly, or that of all
        /// lines, as one level.
        follow: FlightFollow = FlightFollow::Ground, OneOf(FlightFollow::WORDS), "our choice: \
            terrain following";
        /// Length of the area, along the lines.
        length_m: f64 = 100.0, Real(1.0, 5000.0), "a hectare";
        /// Width of the area, across the lines; 0 for a single line.
        width_m: f64 = 100.0, Real(0.0, 5000.0), "a hectare";
        /// How far lines go on beyond the area at both ends.
        margin_m: f64 = 20.0, Real(0.0, 500.0), "our choice: the border is seen from all sides";
        /// Distance between neighbouring lines. There are as many as cover the width, so that the
        /// outermost may lie outside of the area.
        line_spacing_m: f64 = 20.0, Real(1.0, 1000.0), "CAMP3D; drones: 20-60 m";
        /// Whether a second set of lines crosses the first at right angles.
        crossed: bool = false, Flag, "CAMP3D crosses them";
        /// Time for the turn from one line to the next, in which nothing is recorded.
        turn_s: f64 = 40.0, Real(0.0, 3600.0), "lidR tells lines apart by gaps of 30 s";
        /// Standard deviation of roll and pitch, at 0.1 to 2 Hz; that of the heading is twice as
        /// large.
        sway_deg: f64 = 1.0, Real(0.0, 10.0), "our choice: a multirotor in light wind";
    }
}

section! {
    /// Poses from a file; frame k takes pose k.
    PathFile at "robot.file", one of "the robot's path" {
        /// The file.
        path: InputPath = InputPath::default(), File(DATA), "none";
        /// Its format: TUM (`t x y z qx qy qz qw`) or KITTI (a 3 x 4 matrix), one pose on each
        /// line.
        format: PathFormat = PathFormat::Tum, OneOf(PathFormat::WORDS), "TUM contains times";
        /// Take height, pitch and roll from the ground instead of the file.
        on_ground: bool = true, Flag, "the file does not know this ground";
    }
}
