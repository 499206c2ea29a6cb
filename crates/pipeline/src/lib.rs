//! Wires the stages.
mod chunks;
pub mod config;
mod error;
mod estimate;
mod forest;
mod generate;
pub mod plan;
mod preview;
pub mod robot;
pub mod stages;
pub use chunks::{ChunkManager, ChunkState};
pub use error::Error;
pub use estimate::{Estimate, estimate};
pub use forest::ForestPlan;
pub use generate::{CAMERA_NAME, Done, LIDAR_NAME, Observer, Request, generate};
pub use preview::{preview, write_png};
