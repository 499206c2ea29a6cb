//! What decides the bytes of one sequence, and how to read them.

use std::collections::BTreeMap;
use std::fmt;

use nemoral_scene::RigidTransform;
use serde::{Deserialize, Serialize};

use crate::header::{check_sensor_name, is_place, validate_camera};
use crate::{
    CameraSpec, DepthFormat, Error, FileRecord, ImuSpec, Json, LidarSpec, SiteSpec, layout, limits,
};

/// The part of a data set that a sequence is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// To learn from.
    Train,
    /// To choose a model by.
    Val,
    /// To measure the chosen model.
    Test,
}

impl Split {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Train, Self::Val, Self::Test];

    /// `train`, `val` or `test`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Val => "val",
            Self::Test => "test",
        }
    }
}

impl fmt::Display for Split {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A sequence: a drive through a world of its own, with sensors of its own. What holds for a whole
/// sequence and decides its bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequenceSpec {
    /// Its number, the NN of `sequences/NN`.
    pub number: u32,
    /// Its world's seed.
    pub seed: u64,
    /// What it is for; absent from `dataset.json` if the data set is not split.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub split: Option<Split>,
    /// What was drawn for this sequence, by key of the configuration; absent from `dataset.json`
    /// if nothing was.
    #[serde(default, skip_serializing_if = "Json::is_empty")]
    pub drawn: Json,
    /// Where its world lies on the earth; absent from `dataset.json` if it is invented.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub site: Option<SiteSpec>,
    /// Side of a chunk, metres.
    pub chunk_size_m: f64,
    /// Whether it has a `deadwood.csv`; absent from `dataset.json` if it has none.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub has_deadwood: bool,
    /// Whether it has a `poses_estimated.txt`; absent from `dataset.json` if it has none.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub has_estimated_poses: bool,
    /// How depth is stored.
    pub depth_format: DepthFormat,
    /// All cameras, the reference camera first.
    pub cameras: Vec<CameraSpec>,
    /// All LiDARs, the reference LiDAR first.
    pub lidars: Vec<LidarSpec>,
    /// How long before and after a frame's time its LiDARs may fire, seconds, 0 to 3600; absent
    /// from `dataset.json` if it is not known, or if there is no LiDAR.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub half_scan_s: Option<f64>,
    /// The inertial measurement unit; absent from `dataset.json` if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imu: Option<ImuSpec>,
    /// Key of each world stage: name to hexadecimal.
    pub stage_keys: BTreeMap<String, String>,
    /// The files that the configuration names, in order of their paths, which are
    /// [`input_path`](crate::input_path)s; absent from `dataset.json` if there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<FileRecord>,
    /// The resolved configuration. It has what decides the content and nothing else (no threads, no
    /// output folder, no frame range), because a resumed run compares it.
    pub config: Json,
    /// The same for human readers, written to the sequence's `config.toml`: at most 4 MiB. It is
    /// not compared, and empty in a data set that was opened, of which
    /// [`Dataset::sequence_config`](crate::Dataset::sequence_config) reads it.
    #[serde(skip)]
    pub config_toml: String,
}

impl SequenceSpec {
    /// A sequence without sensors: an invented world, chunks of 50 m, 16-bit depth, of no split, an
    /// empty configuration.
    #[must_use]
    pub fn new(number: u32, seed: u64) -> Self {
        Self {
            number,
            seed,
            split: None,
            drawn: Json::default(),
            site: None,
            chunk_size_m: 50.0,
            has_deadwood: false,
            has_estimated_poses: false,
            depth_format: DepthFormat::default(),
            cameras: Vec::new(),
            lidars: Vec::new(),
            half_scan_s: None,
            imu: None,
            stage_keys: BTreeMap::new(),
            inputs: Vec::new(),
            config: Json::default(),
            config_toml: String::new(),
        }
    }

    /// The mount of the reference sensor, whose poses `poses.txt` has: the first camera, or the
    /// first LiDAR if there is no camera.
    #[must_use]
    pub fn body_from_reference(&self) -> RigidTransform {
        let camera = self.cameras.first().map(|c| c.body_from_camera);
        let lidar = self.lidars.first().map(|l| l.body_from_lidar);
        camera.or(lidar).unwrap_or(RigidTransform::IDENTITY)
    }

    /// What LAZ adds to the times of a sequence, whole seconds: as LAS counts from the start of a
    /// week, no time is negative there, and the first scan begins earlier than the sequence, whose
    /// start is the time of its first frame. It is the least whole number above
    /// [`half_scan_s`](Self::half_scan_s), so at least 1, and the same for all files of a sequence
    /// and all of its parts.
    #[must_use]
    pub fn las_time_shift_s(&self) -> f64 {
        self.half_scan_s.unwrap_or(0.0).floor() + 1.0
    }

    /// Checks names, mounts, sizes and places.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        if self.cameras.is_empty() && self.lidars.is_empty() {
            return Err(Error::invalid(
                "cameras",
                "[]",
                "at least one camera or LiDAR",
            ));
        }
        if !self.drawn.value().is_object() {
            return Err(Error::invalid("drawn", "no object", "an object of keys"));
        }
        let sensors = self.cameras.len() + self.lidars.len();
        if sensors > limits::MAX_SENSORS {
            let allowed = format!("at most {}", limits::MAX_SENSORS);
            return Err(Error::invalid("number of sensors", sensors, allowed));
        }
        let names = self.cameras.iter().map(|c| &c.name);
        for name in names.chain(self.lidars.iter().map(|l| &l.name)) {
            check_sensor_name(name)?;
        }
        for camera in &self.cameras {
            validate_camera(camera)?;
        }
        if let Some(site) = &self.site {
            site.validate()?;
        }
        if !(self.chunk_size_m.is_finite() && self.chunk_size_m > 0.0) {
            return Err(Error::invalid(
                "chunk_size_m",
                self.chunk_size_m,
                "positive",
            ));
        }
        if self.inputs.len() > limits::MAX_INPUTS {
            let allowed = format!("at most {}", limits::MAX_INPUTS);
            return Err(Error::invalid("inputs", self.inputs.len(), allowed));
        }
        if !self.inputs.is_sorted_by(|a, b| a.path < b.path) {
            let allowed = "in order of their paths, each once";
            return Err(Error::invalid("inputs", "…", allowed));
        }
        for file in &self.inputs {
            if !layout::is_input(file) {
                let allowed = "inputs/DIGEST-NAME, where DIGEST begins the file's checksum";
                return Err(Error::invalid(
                    "inputs",
                    format!("'{}'", file.path),
                    allowed,
                ));
            }
        }
        let cameras = self.cameras.iter().map(|c| (&c.name, &c.body_from_camera));
        let lidars = self.lidars.iter().map(|l| (&l.name, &l.body_from_lidar));
        let mut names = Vec::new();
        for (name, mount) in cameras.chain(lidars) {
            if names.contains(&name) {
                return Err(Error::invalid(
                    "sensor name",
                    name,
                    "unique among all sensors",
                ));
            }
            names.push(name);
            check_mount(name, mount)?;
        }
        if let Some(half) = self.half_scan_s
            && !(0.0..=limits::MAX_HALF_SCAN_S).contains(&half)
        {
            let allowed = format!("0 to {} s", limits::MAX_HALF_SCAN_S);
            return Err(Error::invalid("half_scan_s", half, allowed));
        }
        if let Some(imu) = &self.imu {
            if names.iter().any(|name| *name == "imu") {
                return Err(Error::invalid("sensor name", "imu", "not that of the imu"));
            }
            check_mount("imu", &imu.body_from_imu)?;
            if !(imu.rate_hz.is_finite() && imu.rate_hz > 0.0) {
                return Err(Error::invalid("imu.rate_hz", imu.rate_hz, "positive"));
            }
            let noise = [imu.angular_rate_noise_rad_s, imu.specific_force_noise_m_s2];
            if let Some(wrong) = noise.iter().find(|n| !(n.is_finite() && **n >= 0.0)) {
                return Err(Error::invalid("imu noise", wrong, "at least 0"));
            }
        }
        Ok(())
    }
}

/// Refuses a mount that is no rotation and place.
fn check_mount(name: &str, mount: &RigidTransform) -> Result<(), Error> {
    if is_place(mount.translation_m) && mount.rotation.is_normalized() {
        return Ok(());
    }
    Err(Error::invalid(
        format!("{name}.mount"),
        format!("{mount:?}"),
        "finite, with a unit rotation",
    ))
}
