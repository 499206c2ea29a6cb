//! What is the same for the whole data set and decides its bytes.

use std::collections::BTreeMap;
use std::sync::Arc;

use nemoral_files::{DEVICE_NAMES, InnerPath};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{AnnotationKinds, Intrinsics, Ontology, RigidTransform, Shutter};
use serde::{Deserialize, Serialize};

use crate::error::shown;
use crate::{Error, FileRecord, SequenceSpec, Split, layout, limits, serde_scene};

/// The name of the further camera that is KITTI's right one: its pictures are in `image_3`, its
/// projection is `P3`.
pub(crate) const RIGHT: &str = "right";

/// How depth images are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum DepthFormat {
    /// 16-bit grey PNG, metres × 256 rounded to nearest; 0 = nothing hit, 65535 = 255.996 m or
    /// more. A surface is never 0 (KITTI's convention).
    #[default]
    Png16,
    /// NumPy `.npy`, little-endian float32, metres, shape (height, width); 0 = nothing hit.
    Npy,
}

impl DepthFormat {
    /// The greatest depth of a file, metres, which stands for anything beyond, too; `None` if files
    /// hold any depth.
    #[must_use]
    pub const fn farthest_m(self) -> Option<f32> {
        match self {
            Self::Png16 => Some(65_535.0 / 256.0),
            Self::Npy => None,
        }
    }
}

/// A camera of the data set. The first one writes `image_2`, `semantic`, `instance`, `depth` and
/// `normals`, further ones the same folders inside a folder of their name, except that the pictures
/// of a further one called `right` are in `image_3`, as those of KITTI's right camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraSpec {
    /// `snake_case`, unique among all sensors.
    pub name: String,
    /// The pinhole.
    pub intrinsics: Intrinsics,
    /// The mount, from the camera's optical frame.
    #[serde(with = "serde_scene::rigid_transform")]
    pub body_from_camera: RigidTransform,
    /// What it writes in addition: `sky`, `flow`, `trunks`, `boxes`, `radiance`.
    #[serde(rename = "extra")]
    pub annotations: AnnotationKinds,
    /// When its rows are exposed; absent from `dataset.json` if all are exposed at one instant.
    #[serde(default, skip_serializing_if = "Shutter::is_instant")]
    pub shutter: Shutter,
    /// Whether its pictures have a sensor's noise; absent from `dataset.json` if not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub noisy: bool,
    /// Whether its pictures are more than a tone curve of the light at each pixel, equal for all
    /// colours: white balance, noise reduction, saturation, sharpening or JPEG. Absent from
    /// `dataset.json` if not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub processed: bool,
}

/// A LiDAR of the data set. The first one writes `velodyne`, `labels` and `points`, further ones
/// the same folders inside a folder of their name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LidarSpec {
    /// `snake_case`, unique among all sensors.
    pub name: String,
    /// The mount.
    #[serde(with = "serde_scene::rigid_transform")]
    pub body_from_lidar: RigidTransform,
    /// Whether points are in the LiDAR's frame at the frame's time; if not, each is in that of its
    /// pulse's time.
    pub deskewed: bool,
    /// Whether points are written in the direction that the scanner believes, rather than in the
    /// true one.
    pub pointing_errors: bool,
    /// Whether the PLY with every field is written besides `.bin` and `.label`.
    pub ply: bool,
}

impl LidarSpec {
    /// Whether points lie where their pulses went. If not, images cannot agree with them, and
    /// `check` reports the agreement without judging it.
    #[must_use]
    pub fn well_placed(&self) -> bool {
        self.deskewed && !self.pointing_errors
    }
}

/// Everything that decides a data set's bytes, and how to read them. Resume and merge refuse data
/// sets whose headers differ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DatasetHeader {
    /// The program, `nemoral`.
    pub generator: String,
    /// Its version.
    pub version: String,
    /// The seed from which the sequences' seeds come.
    pub seed: u64,
    /// The resolved backend: `cpu`, or the GPU path's name. Never `auto`.
    pub backend: String,
    /// The licence the user gives the data, for the data card (an SPDX id, or words).
    pub licence: String,
    /// The class table.
    #[serde(with = "serde_scene::ontology")]
    pub ontology: Ontology,
    /// All sequences of the data set, by number, whether or not a shard has frames of them.
    pub sequences: Vec<SequenceSpec>,
    /// The request, from which all sequences can be made again, written to `config.toml`: at most
    /// 4 MiB, as such files are read. It is not compared.
    #[serde(skip)]
    pub config_toml: String,
    /// The content of the sequences' [`inputs`](SequenceSpec::inputs), by path, which a writer puts
    /// into the data set.
    #[serde(skip)]
    pub input_files: BTreeMap<InnerPath, Arc<[u8]>>,
}

impl DatasetHeader {
    /// A header of sequence 0 without sensors: backend `cpu`, no licence given.
    #[must_use]
    pub fn new(generator: &str, version: &str, seed: u64, ontology: Ontology) -> Self {
        Self {
            generator: generator.to_owned(),
            version: version.to_owned(),
            seed,
            backend: "cpu".to_owned(),
            licence: "unspecified".to_owned(),
            ontology,
            sequences: vec![SequenceSpec::new(0, seed)],
            config_toml: String::new(),
            input_files: BTreeMap::new(),
        }
    }

    /// A sequence by its number.
    #[must_use]
    pub fn sequence(&self, number: u32) -> Option<&SequenceSpec> {
        let at = self.sequences.binary_search_by_key(&number, |s| s.number);
        at.ok().map(|i| &self.sequences[i])
    }

    /// The files that the sequences' configurations name, each once.
    pub(crate) fn inputs(&self) -> BTreeMap<&InnerPath, &FileRecord> {
        let all = self.sequences.iter().flat_map(|s| &s.inputs);
        all.map(|file| (&file.path, file)).collect()
    }

    /// The numbers of the sequences of a split.
    #[must_use]
    pub fn numbers(&self, split: Option<Split>) -> Vec<u32> {
        let of_split = self.sequences.iter().filter(|s| s.split == split);
        of_split.map(|s| s.number).collect()
    }

    /// Checks all sequences, before writing and after reading.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        if !(1..=limits::MAX_SEQUENCES).contains(&self.sequences.len()) {
            let allowed = format!("1 to {}", limits::MAX_SEQUENCES);
            let found = self.sequences.len();
            return Err(Error::invalid("number of sequences", found, allowed));
        }
        if !self.sequences.is_sorted_by(|a, b| a.number < b.number) {
            let allowed = "in order of their numbers, each once";
            return Err(Error::invalid("sequences", "…", allowed));
        }
        check_config(layout::CONFIG, &self.config_toml)?;
        for sequence in &self.sequences {
            let name = layout::sequence_file(sequence.number, layout::CONFIG);
            check_config(&name, &sequence.config_toml)?;
        }
        self.sequences.iter().try_for_each(SequenceSpec::validate)
    }
}

/// Refuses a config that is longer than those that are read.
fn check_config(name: &str, config_toml: &str) -> Result<(), Error> {
    let bytes = config_toml.len();
    if bytes as u64 > limits::CONFIG_BYTES {
        let allowed = format!("at most {}", limits::CONFIG_BYTES);
        return Err(Error::invalid(format!("bytes of {name}"), bytes, allowed));
    }
    Ok(())
}

/// Checks a picture's size and the numbers by which points are projected.
pub(crate) fn validate_camera(camera: &CameraSpec) -> Result<(), Error> {
    let k = &camera.intrinsics;
    let field = |what| format!("{}.{what}", camera.name);
    for (what, side) in [("width", k.width), ("height", k.height)] {
        if !(1..=limits::MAX_SIDE_PX).contains(&side) {
            let allowed = format!("1 to {} pixels", limits::MAX_SIDE_PX);
            return Err(Error::invalid(field(what), side, allowed));
        }
    }
    for (what, focal) in [("fx", k.fx), ("fy", k.fy)] {
        if !(focal.is_finite() && focal > 0.0) {
            return Err(Error::invalid(field(what), focal, "positive"));
        }
    }
    for (what, centre) in [("cx", k.cx), ("cy", k.cy)] {
        if !centre.is_finite() {
            return Err(Error::invalid(field(what), centre, "finite"));
        }
    }
    if !(camera.shutter.readout_s.is_finite() && camera.shutter.readout_s.abs() <= 10.0) {
        let value = camera.shutter.readout_s;
        return Err(Error::invalid(
            field("shutter.readout_s"),
            value,
            "-10 to 10 s",
        ));
    }
    Ok(())
}

/// Whether it lies in a chunk of the world.
pub(crate) fn is_place(position_m: DVec3) -> bool {
    position_m.is_finite() && position_m.abs().max_element() <= limits::MAX_POSITION_M
}

/// Refuses names that could be mistaken for a folder of the layout, or that some file systems do
/// not allow.
pub(crate) fn check_sensor_name(name: &str) -> Result<(), Error> {
    const RESERVED: [&str; 14] = [
        "image_2", "image_3", "semantic", "instance", "depth", "normals", "sky", "flow", "trunks",
        "boxes", "radiance", "velodyne", "labels", "points",
    ];
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-';
    let is_plain = (1..=64).contains(&name.len()) && name.chars().all(plain);
    if !is_plain || RESERVED.contains(&name) || InnerPath::new(name).is_err() {
        let allowed = format!(
            "1 to 64 of a-z, 0-9, '_' and '-', none of the layout's own folders, and no device's \
             name on Windows ({DEVICE_NAMES})"
        );
        let found = format!("'{}'", shown(name));
        return Err(Error::invalid("sensor name", found, allowed));
    }
    Ok(())
}
