//! Rocks and ordered layers of woody plants: users of the sampler, with targets, rows, gaps,
//! clusters.

mod calibrate;
pub(crate) mod params;
pub(crate) mod patches;
pub(crate) mod placement;
pub(crate) mod rows;
pub(crate) mod site;
