//! Procedural trees, shrubs, herbs, rocks, stumps and their textures.

mod error;
mod tree;

pub use error::ParamError;
pub use tree::{FoliageCard, GrownTree, GrowthParams, Species, TreeMaterials, TreeSize, grow};
