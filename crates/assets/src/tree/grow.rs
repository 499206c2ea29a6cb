//! From a size to a tree.

use nemoral_scene::{Card, MaterialId, Mesh};
use nemoral_seed::Key;

use super::{Species, TreeSize};
use crate::error::ParamError;

/// The materials of one species' trees.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeMaterials {
    /// Stem at least as thick as the trunk threshold.
    pub stem: MaterialId,
    /// The foot of the stem.
    pub flare: MaterialId,
    /// Limbs at least as thick as the trunk threshold.
    pub limb: MaterialId,
    /// Living wood thinner than the trunk threshold.
    pub branch: MaterialId,
    /// Dead branches thinner than the trunk threshold.
    pub dead: MaterialId,
    /// The pictures of leaves to choose from, with equal chances.
    pub foliage: Vec<FoliageCard>,
}

/// A picture of a leafy twig. The twig enters at (u, v) = (0.5, 0); v grows towards its tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoliageCard {
    /// Its material, with the mask.
    pub material: MaterialId,
    /// Size along u, metres, before the generator's variation.
    pub width_m: f32,
    /// Size along v, metres, before the generator's variation.
    pub height_m: f32,
    /// The opaque share of its mask, 0..=1.
    pub opaque_fraction: f32,
    /// How many layers of leaves lie over each other where it is opaque, at least 1.
    pub leaf_layers: f32,
}

/// How finely to grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrowthParams {
    /// Wood of at least this radius counts as trunk, metres, 0.005..=0.5.
    pub trunk_radius_m: f64,
    /// At most so many triangles of wood, 1,000..=200,000.
    pub wood_triangles_max: usize,
    /// At most so many cards, 50..=100,000.
    pub cards_max: usize,
}

impl Default for GrowthParams {
    fn default() -> Self {
        Self {
            trunk_radius_m: 0.04,
            wood_triangles_max: 12_000,
            cards_max: 6_000,
        }
    }
}

/// A tree. Its origin is the centre of its foot; the ground is z = 0.
#[derive(Clone, Debug)]
pub struct GrownTree {
    /// The wood.
    pub mesh: Mesh,
    /// The foliage.
    pub cards: Vec<Card>,
    /// The size, measured on what was grown.
    pub size: TreeSize,
    /// Volume of the stem over bark above the ground, m³.
    pub stem_volume_m3: f64,
    /// Radius of the root flare where it meets the ground, metres.
    pub foot_radius_m: f64,
}

/// Grows a tree of a demanded size.
///
/// # Errors
/// If a size, material or parameter is out of its range.
pub fn grow(
    species: &Species,
    size: &TreeSize,
    materials: &TreeMaterials,
    params: &GrowthParams,
    key: Key,
) -> Result<GrownTree, ParamError> {
    let _ = (species, size, materials, params, key);
    Err(ParamError::new("tree", "", "implemented"))
}
