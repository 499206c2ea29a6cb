//! Every key of a config, one file for each part of it.

mod assets;
mod balance;
mod camera;
mod camera_effects;
mod camera_optics;
mod floor;
mod ground;
mod imu;
mod lidar;
mod lidar_pattern;
mod light;
mod litter;
mod models;
mod navigation;
mod placement;
mod robot;
mod site;
mod water;
mod ways;

use std::collections::BTreeMap;

use crate::choices::{FORMATS, OntologyName};
use crate::schema::AllowedValues::{Flag, OneOf, Real, SomeOf, Text, Whole};
use crate::schema::{SectionSpec, section};

use self::balance::TARGETS;
use self::camera::FURTHER_CAMERAS;
use self::lidar::FURTHER_LIDARS;
use self::light::FURTHER_LAMPS;
use self::models::MODELS;

pub use assets::*;
pub use balance::*;
pub use camera::*;
pub use camera_effects::*;
pub use camera_optics::*;
pub use floor::*;
pub use ground::*;
pub use imu::*;
pub use lidar::*;
pub use lidar_pattern::*;
pub use light::*;
pub use litter::*;
pub use models::*;
pub use navigation::*;
pub use placement::*;
pub use robot::*;
pub use site::*;
pub use water::*;
pub use ways::*;

/// The largest text file that a config may name.
const TEXT: u64 = 1 << 20;
/// The largest file of trail lines, some 200,000 vertices.
const LINES: u64 = 8 << 20;
/// The largest stem map, some 200,000 trees.
const STEMS: u64 = 16 << 20;
/// The largest table, list of poses or image.
const DATA: u64 = 256 << 20;

section! {
    /// A whole request: the world, the robot, and what is recorded.
    Config at "" {
        /// The world's seed. The same seed, config and program give the same bytes.
        seed: u64 = 7, Whole(0, i64::MAX), "any number; TOML allows up to 2^63 - 1";
        /// How many sequences the data set has, each a drive through a world of its own. Sequence 0
        /// has the seed above, and the others' seeds are drawn from it.
        sequences: u32 = 1, Whole(1, 10_000), "one world";
        /// How many frames each sequence has; 0 for all of stations, lanes, flight lines or a file.
        frames: u64 = 10, Whole(0, 10_000_000), "enough to look at, made in a minute";
    }
    plus {
        /// Splits.
        splits: Splits;
        /// Chunks and visible distances.
        chunks: Chunks;
        /// Your own site.
        site: Site;
        /// Terrain.
        terrain: Terrain;
        /// Trails.
        trails: Trails;
        /// Streams, ponds and puddles.
        water: Water;
        /// Rocks, trees, stumps and shrubs.
        placement: Placement;
        /// Logs, thrown trees and branches.
        deadwood: Deadwood;
        /// Ivy and moss on trees.
        climbers: Climbers;
        /// Leaves, twigs and cones on the ground.
        litter: Litter;
        /// Grass, herbs and ferns.
        undergrowth: Undergrowth;
        /// What is grown.
        assets: Assets;
        /// Your own models.
        models: BTreeMap<String, Model>;
        /// The time of the year.
        season: Season;
        /// Sun.
        sun: Sun;
        /// Moon.
        moon: Moon;
        /// Sky.
        sky: Sky;
        /// Weather.
        weather: Weather;
        /// Lamp.
        lamp: Lamp;
        /// Further lamps.
        lamps: BTreeMap<String, Lamp>;
        /// Camera.
        camera: Camera;
        /// Further cameras.
        cameras: BTreeMap<String, Camera>;
        /// LiDAR.
        lidar: Lidar;
        /// Further LiDARs.
        lidars: BTreeMap<String, Lidar>;
        /// Robot.
        robot: Robot;
        /// Inertial measurement unit.
        imu: Imu;
        /// Navigation system.
        navigation: Navigation;
        /// Balance.
        balance: Balance;
        /// Files.
        output: Output;
    }
}

section! {
    /// Which sequences are for training, validation and testing, in shares; without shares the data
    /// set is not split. Sequences of different splits have no tree, no chunk, no grown plant and
    /// no texture in common, so `assets.seed` and the files of `[site]` may not be the same in two
    /// splits. Your own models and a photographed sky are in all splits.
    Splits at "splits" {
        /// Share of sequences to learn from. The three shares add up to 1, or all are 0.
        train: f64 = 0.0, Real(0.0, 1.0), "not split";
        /// Share of sequences to choose a model by.
        val: f64 = 0.0, Real(0.0, 1.0), "not split";
        /// Share of sequences to measure the chosen model.
        test: f64 = 0.0, Real(0.0, 1.0), "not split";
        /// The choice or group in `[vary]` whose alternatives are each split in these shares, such
        /// as `preset`; empty for none.
        by: String = String::new(), Text, "not stratified";
    }
}

section! {
    /// The chunk manager: the world is made, kept and dropped in square chunks (paper, IV-A).
    Chunks at "chunks" {
        /// Side of a chunk.
        size_m: f64 = 50.0, Real(20.0, 100.0), "paper, VI";
        /// Trees, rocks and ground are visible in chunks that come this near.
        visible_radius_m: f64 = 300.0, Real(10.0, 600.0), "far enough that haze closes the view";
        /// Undergrowth is visible in chunks that come this near, and all that stands on their
        /// ground shades it.
        undergrowth_radius_m: f64 = 100.0, Real(0.0, 300.0), "the paper's visible radius, VI";
        /// Litter in relief is visible in chunks that come this near, if undergrowth is.
        litter_radius_m: f64 = 50.0, Real(0.0, 300.0),
            "our choice: seen from a robot, leaves farther off are flatter than a pixel";
        /// Chunks farther than this are deleted; between the radii they are disabled.
        delete_radius_m: f64 = 400.0, Real(10.0, 2000.0), "two chunks beyond the visible radius";
    }
}

section! {
    /// What is written.
    Output at "output" {
        /// The class table: the paper's eight classes, its fuel, or each semantic as a class.
        ontology: OntologyName = OntologyName::Paper, OneOf(OntologyName::WORDS),
            "paper, V-A and VII";
        /// Formats of other people's programs that are written besides the data set's own, each
        /// into a folder beside it, `OUT-FORMAT`. Shards write none; `nemoral merge` does.
        formats: Vec<String> = Vec::new(), SomeOf(&FORMATS), "none";
        /// Write a PLY with every field of every point, besides `.bin` and `.label`.
        ply: bool = true, Flag, "true range, true id, time, normal and more";
        /// Write depth as float32 `.npy` instead of 16-bit PNG.
        depth_npy: bool = false, Flag, "every loader reads PNG, which is exact to 2 mm";
    }
}

/// Every section, in the order of the reference page.
pub const SECTIONS: &[SectionSpec] = &[
    Config::SPEC,
    Splits::SPEC,
    Chunks::SPEC,
    Site::SPEC,
    SiteStems::SPEC,
    SiteTerrain::SPEC,
    SiteTrails::SPEC,
    Terrain::SPEC,
    Trails::SPEC,
    TrailKinds::SPEC,
    TrailSection::SPEC,
    ForestRoad::SPEC,
    SkidTrail::SPEC,
    Firebreak::SPEC,
    Footpath::SPEC,
    DeerPath::SPEC,
    Water::SPEC,
    Placement::SPEC,
    PlacementRows::SPEC,
    PlacementGaps::SPEC,
    Meadows::SPEC,
    Regeneration::SPEC,
    Deadwood::SPEC,
    Climbers::SPEC,
    Litter::SPEC,
    Undergrowth::SPEC,
    Floor::SPEC,
    GroundEffects::SPEC,
    Sward::SPEC,
    Thickets::SPEC,
    Assets::SPEC,
    MODELS,
    Model::SPEC,
    Season::SPEC,
    Sun::SPEC,
    SunAngles::SPEC,
    SunDate::SPEC,
    Moon::SPEC,
    Sky::SPEC,
    Weather::SPEC,
    Lamp::SPEC,
    FURTHER_LAMPS,
    Camera::SPEC,
    CameraFov::SPEC,
    CameraSensor::SPEC,
    CameraCalibration::SPEC,
    CameraPinhole::SPEC,
    CameraBrownConrady::SPEC,
    CameraFisheye::SPEC,
    CameraShutter::SPEC,
    CameraNoise::SPEC,
    CameraWhiteBalance::SPEC,
    CameraTone::SPEC,
    CameraVignetting::SPEC,
    CameraAberration::SPEC,
    CameraProcessing::SPEC,
    CameraSoiling::SPEC,
    FURTHER_CAMERAS,
    Lidar::SPEC,
    LidarLines::SPEC,
    LidarMid40::SPEC,
    LidarHorizon::SPEC,
    LidarMid70::SPEC,
    LidarAvia::SPEC,
    LidarSpinning::SPEC,
    LidarPanorama::SPEC,
    LidarMirror::SPEC,
    LidarTable::SPEC,
    LidarMotor::SPEC,
    LidarBeam::SPEC,
    LidarAir::SPEC,
    LidarErrors::SPEC,
    Noise::SPEC,
    FURTHER_LIDARS,
    Robot::SPEC,
    RobotGait::SPEC,
    PathTrail::SPEC,
    PathWander::SPEC,
    PathLanes::SPEC,
    PathStraight::SPEC,
    PathStations::SPEC,
    PathFlight::SPEC,
    PathFile::SPEC,
    Imu::SPEC,
    Navigation::SPEC,
    Balance::SPEC,
    TARGETS,
    Output::SPEC,
    super::vary::VARY,
    super::vary::RANGES,
];
