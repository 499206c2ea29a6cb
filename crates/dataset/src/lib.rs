//! This crate is what lands on disk.

mod check;
mod error;
mod frame;
mod header;
mod layout;
mod manifest;
mod reader;
mod serde_scene;
mod stats;
mod text;
mod writer;

pub use check::{Agreement, CheckReport, ClassAgreement, Problem, Residual, check};
pub use error::Error;
pub use frame::{CameraData, FrameData, LidarData, Track, WorldTables};
pub use header::{CameraSpec, DatasetHeader, DepthFormat, LidarSpec};
pub use manifest::{FORMAT_VERSION, FileRecord, FrameRecord, Manifest, SequenceRecord};
pub use reader::{Calibration, CameraFrame, Dataset, Frame, LidarFrame, PlyPoint};
pub use stats::{ClassShare, Stats, stats};
pub use writer::{OpenMode, Writer};
