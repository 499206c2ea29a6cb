//! Trees, grown from allometry.

mod grow;
mod size;
mod species;

pub use grow::{FoliageCard, GrownTree, GrowthParams, TreeMaterials, grow};
pub use size::TreeSize;
pub use species::Species;
