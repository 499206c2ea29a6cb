//! This crate is what lands on disk.

mod agreement;
mod atomic;
mod card;
mod check;
mod csv;
mod error;
mod folder;
mod frame;
mod header;
mod images;
mod layout;
mod manifest;
mod merge;
mod npy;
mod ply;
mod reader;
mod scan;
mod serde_scene;
mod stats;
mod text;
mod writer;
mod yaml;

pub use agreement::{Agreement, ClassAgreement, Residual};
pub use check::{CheckReport, Problem, check};
pub use error::Error;
pub use frame::{CameraData, FrameData, LidarData, Track, WorldTables};
pub use images::write_png;
pub use header::{CameraSpec, DatasetHeader, DepthFormat, LidarSpec};
pub use manifest::{FORMAT_VERSION, FileRecord, FrameRecord, Manifest, SequenceRecord};
pub use merge::merge;
pub use ply::PlyPoint;
pub use reader::{CameraFrame, Dataset, Frame, LidarFrame};
pub use stats::{ClassShare, Quantiles, Stats, stats};
pub use text::Calibration;
pub use writer::{OpenMode, Writer};
