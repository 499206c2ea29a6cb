//! This crate owns data sets on disk: it writes them, reads every file of them back, resumes and
//! merges them, and checks them from their files alone.
//!
//! # Layout
//! The layout is SemanticKITTI's, so that existing loaders read it unchanged, with images beside
//! the scans:
//! ```text
//! OUT/README.md  dataset.json  config.toml  ontology.yaml
//! OUT/sequences/NN/{image_2,semantic,instance,depth,normals}/000000.png
//!                  velodyne/000000.bin  labels/000000.label  points/000000.ply
//!                  poses.txt  calib.txt  times.txt  config.toml  trees.csv  instances.csv
//! OUT/poses/NN.txt
//! ```
//! A data set has one or more sequences, each a drive through a world of its own, with sensors of
//! its own. A further camera or LiDAR has the same folders inside a folder of its name, except that
//! the pictures of a further camera called `right` are in `image_3`. While a data set is
//! unfinished, `OUT/.nemoral/` holds its header and a record for each whole frame.
//!
//! | file | content |
//! |---|---|
//! | `semantic` | 8-bit palette PNG: the [ontology](nemoral_scene::Ontology)'s class ids when read, its colours when looked at |
//! | `instance` | 8-bit RGB PNG, [`to_image_id`](nemoral_scene::ObjectId::to_image_id) = R + 256 G + 65536 B; 0 = none |
//! | `depth` | planar z; 16-bit PNG, metres × 256 to nearest, or float32 `.npy` ([`DepthFormat`]); 0 = none |
//! | `normals` | optical frame, round(127.5 (n + 1)); (0, 0, 0), which no unit vector gives, = none |
//! | `sky`, if asked for | 8-bit grey PNG, 255 where nothing was hit, else 0 |
//! | `flow`, if asked for | to the next frame, KITTI's: 16-bit RGB PNG, u and v × 64 + 32768; blue 0 = none, 1 = seen there, 2 = hidden or outside there |
//! | `trunks`, if asked for | as `instance`: the nearest trunk's if all but trunks and the ground is taken away |
//! | `boxes`, if asked for | CSV: things in the picture, with visible and whole pixels, boxes in the image and in the camera's space |
//! | `.bin` | little-endian f32 x, y, z, intensity |
//! | `.label` | little-endian u32: class in the lower, [`to_label_id`](nemoral_scene::ObjectId::to_label_id) in the upper 16 bits |
//! | `.ply` | binary little-endian, every field of a [`LidarPoint`](nemoral_scene::LidarPoint) |
//! | `poses.txt`, `calib.txt`, `times.txt` | KITTI odometry's; line k is frame k of the whole sequence, made here or not; `poses/NN.txt` is a copy |
//! | `imu0`, `state_groundtruth_estimate0`, if asked for | what an inertial measurement unit measures, and how it truly moves, as the EuRoC MAV data set has them |
//! | `ontology.yaml` | the class table for semantic-kitti-api (the paper's classes are section V-A's) |
//!
//! # Promises
//! - A file appears under its final name only when it is whole. A frame's record is written after
//!   its files, and `dataset.json` after everything, once all files that it names are on the
//!   medium. What a power cut damages before that is found by checksums and made again on resume.
//! - Equal input gives equal bytes, whatever the order of frames, the number of threads, or the
//!   division into shards.
//! - Files that a data set does not own are neither changed nor removed, and nothing outside its
//!   folder is read or written: names in a data set are [`InnerPath`]s, and links below the folder
//!   are not followed.
//! - Nothing that a file declares is trusted before it is checked: sizes are compared with
//!   `dataset.json`, and those in `dataset.json` with the limits of what can be made, before memory
//!   is allocated. Every file that is read is compared with its checksum.
//!
//! # Example
//! ```
//! use nemoral_dataset::*;
//! use nemoral_scene::{ChunkCoord, Ontology, RigidTransform, Twist};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let out = folder.path();
//! let mount = RigidTransform::IDENTITY;
//! let mut header = DatasetHeader::new("nemoral", "0.1.0", 7, Ontology::paper());
//! header.sequences[0].lidars = vec![LidarSpec {
//!     name: "top".into(),
//!     body_from_lidar: mount,
//!     deskewed: true,
//!     pointing_errors: false,
//!     ply: true,
//! }];
//! let writer = Writer::create(out, OpenMode::Fresh, header)?;
//! writer.write_frame(&FrameData {
//!     sequence: 0,
//!     index: 0,
//!     time_s: 0.0,
//!     world_from_body: mount,
//!     body_motion: Twist::STILL,
//!     balance: None,
//!     cameras: vec![],
//!     lidars: vec![LidarData { name: "top", points: &[], sensor_chunk: ChunkCoord::new(0, 0) }],
//!     frame_key: [0; 32],
//! })?;
//! let (poses, estimated, lines) = (vec![(0.0, mount)], vec![], vec![]);
//! let (balance, imu, stands) = (None, None, false);
//! let track = Track { sequence: 0, poses, estimated, balance, stands, lines, imu };
//! writer.write_sequence(&track, &WorldTables::default())?;
//! writer.finish()?;
//!
//! assert_eq!(Dataset::open(out)?.read_frame(0)?.lidars[0].points.len(), 0);
//! assert!(check(out)?.passed());
//! # Ok(())
//! # }
//! ```

mod balance;
mod camera_file;
mod check;
mod cloud;
mod error;
mod file_record;
mod formats;
mod frame;
#[cfg(feature = "fuzz")]
#[doc(hidden)]
pub mod fuzz;
mod header;
mod imu;
mod json;
mod layout;
mod limits;
mod manifest;
mod merge;
mod output;
mod overlap;
mod progress;
mod reader;
mod seal;
mod sequence_spec;
mod serde_scene;
mod site;
mod stats;
mod writer;

pub use balance::{BalanceRecord, BalanceTarget, FrameChoice};
pub use camera_file::CameraFile;
pub use check::{Agreement, ClassAgreement, JudgedAgreement, Residual};
pub use check::{CheckReport, Problem, check, check_with_progress};
pub use cloud::{Cloud, CloudFormat, CloudParams, CloudPoint, CloudPoses, Crop, SeenTree, cloud};
pub use error::Error;
pub use file_record::FileRecord;
pub use formats::images::write_png;
pub use formats::kitti::{Calibration, CameraCalibration, LidarCalibration};
pub use formats::npy::encode as encode_npy;
pub use formats::ontology_yaml::{ClassTable, TableRow};
pub use formats::ply::PlyPoint;
pub use formats::tables::{deadwood_csv, trees_csv};
pub use frame::{CameraData, FrameData, LidarData, Track, WorldTables};
pub use header::{CameraSpec, DatasetHeader, DepthFormat, LidarSpec};
pub use imu::{EurocFiles, ImuReading, ImuSpec};
pub use json::Json;
pub use layout::input_path;
pub use limits::CONFIG_BYTES;
pub use manifest::{FORMAT_VERSION, FrameRecord, Manifest, TrackRecord};
pub use merge::{MergeParams, merge, merge_with_progress};
pub use nemoral_files::InnerPath;
pub use progress::{FrameProgress, ProgressMonitor};
pub use reader::{CameraFrame, Dataset, Frame, LidarFrame};
pub use sequence_spec::{SequenceSpec, Split};
pub use site::SiteSpec;
pub use stats::{BalancedShare, ClassShare, Quantiles, Stats, stats, stats_with_progress};
pub use writer::{OpenMode, Writer};
