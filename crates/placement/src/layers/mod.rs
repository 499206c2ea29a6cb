//! Rocks and ordered layers of woody plants, which use the sampler, with targets, rows, gaps and
//! clusters.

mod blocks;
mod calibrate;
mod calibrated_layer;
mod gap_part;
pub(crate) mod open_land;
pub(crate) mod params;
pub(crate) mod patches;
pub(crate) mod placement;
pub(crate) mod rows;
pub(crate) mod site;
mod size_bias;
