//! `dataset.json`.

use std::collections::BTreeMap;
use std::path::Path;

use nemoral_scene::{RigidTransform, Twist};
use serde::{Deserialize, Serialize};

use crate::{DatasetHeader, Error};

/// The version of the layout this crate writes; it reads no other.
pub const FORMAT_VERSION: u32 = 1;

/// `dataset.json`: everything about a data set but its content. It holds no clock, host name,
/// thread count or duration, so that equal requests give equal bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`FORMAT_VERSION`].
    pub format_version: u32,
    /// What decides the bytes.
    #[serde(flatten)]
    pub header: DatasetHeader,
    /// The sequences, by number.
    pub sequences: Vec<SequenceRecord>,
    /// The files that belong to no frame, by path; `dataset.json` itself is not among them.
    pub files: Vec<FileRecord>,
    /// The frames that exist here, by sequence and index: a shard lists its own.
    pub frames: Vec<FrameRecord>,
}

/// A drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequenceRecord {
    /// Its number, the NN of `sequences/NN`.
    pub number: u32,
    /// Frames of the whole drive: lines of `poses.txt` and `times.txt`.
    pub length: u64,
    /// The frames that exist here, as half-open ranges.
    pub frames: Vec<[u64; 2]>,
    /// The pose of the reference sensor (the first camera) at frame 0 in the world: 3 × 4,
    /// row-major, metres. `world_from_frame0 · poses.txt[k]` is its pose at frame k.
    pub world_from_frame0: [[f64; 4]; 3],
}

/// A file and its checksum.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Below the data set's folder, with forward slashes.
    pub path: String,
    /// Size.
    pub bytes: u64,
    /// BLAKE3, hexadecimal.
    pub blake3: String,
}

/// A frame that exists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameRecord {
    /// The sequence's number.
    pub sequence: u32,
    /// The frame's number in its sequence; its files are called by it.
    pub index: u64,
    /// Seconds after the start of the sequence, the middle of the exposure.
    pub time_s: f64,
    /// The key of all that went into the frame, hexadecimal.
    pub key: String,
    /// The body's pose in the world: 3 × 4, row-major, metres.
    pub world_from_body: [[f64; 4]; 3],
    /// How the body moves at that time, in its own axes, while pictures with a shutter are taken;
    /// absent if none is, or if it stands still.
    #[serde(default, skip_serializing_if = "Twist::is_still")]
    pub body_motion: Twist,
    /// The chunk each LiDAR stood in, by LiDAR: what the instances of `.label` files are
    /// relative to.
    pub sensor_chunks: Vec<[i32; 2]>,
    /// LiDAR points by class id, over all LiDARs.
    pub point_classes: BTreeMap<u8, u64>,
    /// The frame's files, by path.
    pub files: Vec<FileRecord>,
}

impl SequenceRecord {
    /// [`SequenceRecord::world_from_frame0`] as a transform.
    #[must_use]
    pub fn world_from_frame0(&self) -> RigidTransform {
        crate::text::from_rows(&self.world_from_frame0)
    }
}

impl FrameRecord {
    /// [`FrameRecord::world_from_body`] as a transform.
    #[must_use]
    pub fn world_from_body(&self) -> RigidTransform {
        crate::text::from_rows(&self.world_from_body)
    }

    /// Size of all its files.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.files.iter().map(|f| f.bytes).sum()
    }
}

impl Manifest {
    /// Pretty JSON, but a frame a line: a long drive has many.
    pub(crate) fn to_json(&self) -> String {
        let head = Self {
            frames: Vec::new(),
            ..self.clone()
        };
        let head = serde_json::to_string_pretty(&head).expect("a manifest has string keys");
        let head = head
            .strip_suffix("[]\n}")
            .expect("frames are the last field");
        let frames: Vec<String> = self
            .frames
            .iter()
            .map(|f| "    ".to_owned() + &serde_json::to_string(f).expect("string keys"))
            .collect();
        format!("{head}[\n{}\n  ]\n}}\n", frames.join(",\n"))
    }

    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let text = std::fs::read_to_string(path).map_err(Error::io(path))?;
        let version: Version =
            serde_json::from_str(&text).map_err(|e| Error::malformed(path, e))?;
        if version.format_version != FORMAT_VERSION {
            return Err(Error::malformed(
                path,
                format!(
                    "format_version is {}, this program reads {FORMAT_VERSION}",
                    version.format_version
                ),
            ));
        }
        serde_json::from_str(&text).map_err(|e| Error::malformed(path, e))
    }
}

#[derive(Deserialize)]
struct Version {
    format_version: u32,
}
