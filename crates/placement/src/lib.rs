//! This crate decides where things stand on an endless plane of chunks.

mod bridson;
mod calibrate;
mod cover;
mod index;
mod params;
mod placement;
mod quadtree;
mod site;

pub use cover::{CoverPoint, CoverVariety, GroundCover, GroundCoverParams};
pub use index::{LinearScan, NeighbourIndex};
pub use params::{LayerParams, ParamError, PlacementParams, RockParams, Variety};
pub use placement::Placement;
pub use quadtree::QuadTree;
pub use site::{Exclusion, Site};
