//! Procedural trees, shrubs, herbs, rocks, stumps and their textures.

mod error;
mod library;
mod texture;
mod tree;

pub use error::ParamError;
pub use library::{
    AssetParams, GroundMaterials, Library, PlantAsset, StandParams, TrailMaterials, TreeAsset,
};
pub use tree::{FoliageCard, GrownTree, GrowthParams, Species, TreeMaterials, TreeSize, grow};
