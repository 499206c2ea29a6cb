//! Trees: one generator for all species, driven by allometry.
//!
//! A [`Species`] is data: a file in `species/`, or the user's own. [`Species::draw_size`] draws
//! what a forester would measure from published relations; [`grow`] makes a tree of exactly that
//! size, so diameter, height, crown and leaf area are never outcomes of luck. The branching follows
//! Weber and Penn 1995, "Creation and rendering of realistic trees" (levels, whorls or alternate
//! nodes, insertion angles that change with height, curvature, tropism), with these differences:
//! - branch lengths come from a crown envelope of the demanded size, not from the parent's length
//!   alone;
//! - stem radii follow a published taper curve through the diameter at breast height; the radii of
//!   higher orders follow the pipe model (Shinozaki et al. 1964) with an exponent near 2.3;
//! - decurrent trees (oak) are those whose stem ends low in the crown: their first nodes are the
//!   fork;
//! - leaf cards carry the *silhouette* of the demanded leaf area and its inclination distribution.
//!
//! ```
//! use nemoral_assets::{FoliageCard, GrowthParams, Species, TreeMaterials, grow};
//! use nemoral_scene::MaterialId;
//! use nemoral_seed::{Key, Domain};
//!
//! let id = MaterialId(0);
//! let leaf = FoliageCard { material: id, width_m: 0.45, height_m: 0.45, opaque_fraction: 0.5 };
//! let materials = TreeMaterials {
//!     stem: id,
//!     flare: id,
//!     limb: id,
//!     branch: id,
//!     dead: id,
//!     snag: id,
//!     change: id,
//!     upper: id,
//!     foliage: vec![leaf],
//! };
//! let oak = Species::english_oak();
//! let key = Key::world(7).domain(Domain::new("example.oak"));
//! let size = oak.draw_size(0.35, key);
//! let tree = grow(&oak, &size, &materials, &GrowthParams::default(), key)?;
//! assert!((tree.size.dbh_m - 0.35).abs() < 0.007);
//! # Ok::<(), nemoral_assets::ParamError>(())
//! ```

mod budget;
mod catalogue;
mod competition;
mod edge;
mod envelope;
mod fit;
mod flare;
mod foliage;
mod grow;
mod litter;
mod look;
mod materials;
mod phenology;
mod radii;
mod ranges;
mod size;
mod skeleton;
mod snag;
mod species;
mod structure;
mod sweep;
mod wood;

pub use catalogue::SpeciesError;
pub use competition::{Competition, Competitors, CrownCompetition};
pub use flare::FlareLobe;
pub use grow::{GrownTree, GrowthParams, grow, grow_with_structure};
pub use litter::{FruitLook, LitterBark, LitterLook};
pub(crate) use look::linear;
pub use look::{BarkKind, BarkLayer, BarkLook, LeafKind, LeafLook};
pub use materials::{FoliageCard, TreeMaterials};
pub(crate) use phenology::SeasonalLeaves;
pub use phenology::{LeafSpectra, Phenology, PhenologyState, Season};
pub(crate) use size::individual_rank;
pub use size::{SizeClass, TreeSize};
pub use snag::grow_snag;
pub use species::{
    Allometry, BranchLevel, CrownForm, DeadBranches, FoliageForm, Species, StemForm, Taper,
};
pub use structure::{TreeStructure, WoodNode};
pub use wood::{StemProfile, WoodVolume};
