//! Procedural trees, shrubs, herbs, rocks, stumps and their textures.

mod card;
mod error;
mod kept;
mod library;
mod near;
mod optics;
mod palette;
mod plant;
mod texture;
mod tree;

pub use error::ParamError;
pub use kept::KeptError;
pub use library::{
    AssetParams, GroundMaterials, Library, PlantAsset, StandParams, StandSpecies, TrailMaterials,
    TreeAsset,
};
pub use tree::{
    Allometry, BarkKind, BarkLayer, BarkLook, BranchLevel, CrownForm, DeadBranches, FoliageCard,
    FoliageForm, GrownTree, GrowthParams, LeafKind, LeafLook, SizeClass, Species, SpeciesError,
    StemForm, Taper, TreeMaterials, TreeSize, grow, grow_snag,
};
