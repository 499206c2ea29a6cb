//! Procedural assets of a forest: trees, seedlings, shrubs, herbs, rocks, stumps and litter as
//! meshes and leaf cards, and every texture and material that they are made of. All of it is grown
//! from one key, without files.
//!
//! - [`Library::grow`] grows all prototypes and materials of a world.
//! - [`SingleTree::grow`] grows one tree with its materials.
//! - [`grow`] and [`grow_snag`] grow one tree of a given size; [`Species`] is data, read from TOML.
//! - [`Library::to_bytes`] and [`Library::from_bytes`] store a library between runs.
//!
//! ```
//! use nemoral_assets::{AssetParams, Library};
//! use nemoral_seed::Key;
//!
//! // Three species, one tree of each; without textures, which scans do not need.
//! let params = AssetParams {
//!     individuals_per_species: 1,
//!     textures: false,
//!     ..AssetParams::default()
//! };
//! let library = Library::grow(&params, Key::world(7))?;
//! assert!(library.trees.len() >= 3);
//! for tree in &library.trees {
//!     println!("{}: {:.1} m high", tree.species, tree.size.height_m);
//! }
//! # Ok::<(), nemoral_assets::ParamError>(())
//! ```
//!
//! The parts of the source: `tree` (growth and allometry), `plant` (everything smaller), `cards`
//! (images of leaves), `textures` (bark, ground, stone), `materials` (all of them registered),
//! `ambient_occlusion` (the light that near parts of a shape block), `lanes` (arithmetic of eight
//! numbers at once), `serialize`.

mod ambient_occlusion;
mod cards;
mod lanes;
mod library;
mod materials;
mod plant;
mod serialize;
mod textures;
mod tree;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;

pub use ambient_occlusion::{ShapeKind, with_occlusion};
pub use library::{
    AssetParams, ByKind, ClimberParams, Climbers, CommunityTiles, Deadwood, Library, LitterParams,
    LitterPatches, LogAsset, MeasuredTree, PlantAsset, PlantKind, SingleTree, SnowMaterials,
    SnowParams, StandParams, StandSpecies, StemMoss, TreeAsset, TreeClimbers,
};
pub use materials::{GroundMaterials, TrailMaterials};
pub use nemoral_scene::ParamError;
pub use serialize::DeserializeError;
pub use tree::{
    Allometry, BarkKind, BarkLayer, BarkLook, BranchLevel, Competition, Competitors,
    CrownCompetition, CrownForm, DeadBranches, FlareLobe, FoliageCard, FoliageForm, FruitLook,
    GrownTree, GrowthParams, LeafKind, LeafLook, LeafSpectra, LitterBark, LitterLook, Phenology,
    PhenologyState, Season, SizeClass, Species, SpeciesError, StemForm, StemProfile, Taper,
    TreeMaterials, TreeSize, TreeStructure, WoodNode, WoodVolume, grow, grow_snag,
    grow_with_structure,
};
