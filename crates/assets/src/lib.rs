//! Procedural trees, shrubs, herbs, rocks, stumps and their textures.

mod card;
mod error;
mod library;
mod optics;
mod palette;
mod plant;
mod texture;
mod tree;

pub use error::ParamError;
pub use library::{
    AssetParams, GroundMaterials, Library, PlantAsset, StandParams, TrailMaterials, TreeAsset,
};
pub use tree::{
    Allometry, BranchLevel, CrownForm, DeadBranches, FoliageCard, FoliageForm, GrownTree,
    GrowthParams, Species, StemForm, Taper, TreeMaterials, TreeSize, grow,
};
