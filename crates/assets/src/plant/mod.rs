//! Everything that stands or lies in a forest and is not a tree.

pub(crate) mod bank;
pub(crate) mod branch;
pub(crate) mod climber;
pub(crate) mod floor;
pub(crate) mod fungus;
pub(crate) mod liana;
pub(crate) mod litter;
pub(crate) mod log;
pub(crate) mod rock;
pub(crate) mod root_plate;
pub(crate) mod seedling;
pub(crate) mod shape;
pub(crate) mod shrub;
pub(crate) mod stump;
pub(crate) mod surface_root;
pub(crate) mod sward;
pub(crate) mod thicket;
pub(crate) mod undergrowth;
pub(crate) mod wayside;
