//! This crate runs forest trails through an endless chunked world and carves them into its ground.

mod dressing;
mod error;
mod ground;
mod params;
mod path;
mod trails;

pub use dressing::{DressingKind, TrailDressing};
pub use error::ParamError;
pub use ground::{TrailGround, TrailZone};
pub use params::{Ruts, Section, TrailParams, TrailSurfaceKind};
pub use path::{TrailId, TrailPath};
pub use trails::Trails;
