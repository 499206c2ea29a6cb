//! The library: everything a world is made of, grown from one key.

mod climbers;
mod communities;
mod deadwood;
mod kinds;
mod litter;
mod low_plants;
mod params;
mod plants;
mod single_tree;
mod snow;
mod solid;
mod trees;

use std::sync::Arc;

use nemoral_scene::{
    AlphaMask, MaterialId, MaterialLibrary, ParamError, PlantCommunity, Prototype,
};
use nemoral_seed::Key;

pub use self::climbers::{ClimberParams, Climbers, StemMoss, TreeClimbers};
pub use self::communities::CommunityTiles;
pub use self::deadwood::{Deadwood, LogAsset};
pub use self::kinds::{ByKind, PlantKind};
pub use self::litter::{LitterParams, LitterPatches};
pub use self::params::{AssetParams, MeasuredTree, StandParams, StandSpecies};
use self::plants::PlantGrower;
pub use self::single_tree::SingleTree;
pub use self::snow::{SnowMaterials, SnowParams};
pub use self::trees::TreeAsset;
use self::trees::{TreeGrower, TreeKind};
use crate::ambient_occlusion::{self, MaskCoverage, OcclusionParams, Thickness};
use crate::materials::{self, GroundMaterials, WorldMaterials};
use crate::plant::shape::Shape;
use crate::plant::surface_root::LOBE_M;
use crate::tree::{GrowthParams, Species};

/// A shrub, herb, stump or rock, or a patch of such things.
#[derive(Clone, Debug)]
pub struct PlantAsset {
    /// Its shape, upright from z = 0, rooted or sunk below.
    pub prototype: Arc<Prototype>,
    /// What it is, `snake_case`, the same for all individuals of a kind.
    pub name: String,
    /// Radius it occupies at the ground, or a patch's radius, metres.
    pub radius_m: f64,
    /// Height above z = 0, metres.
    pub height_m: f64,
}

/// All prototypes and materials of a world. Of what was not asked for, lists are empty.
#[derive(Clone, Debug)]
pub struct Library {
    /// The materials that all prototypes refer to.
    pub materials: MaterialLibrary,
    /// The masks that surfaces have in full leaf, where the season has taken leaves away, by
    /// material in order.
    pub full_leaf_masks: Vec<(MaterialId, Arc<AlphaMask>)>,
    /// Materials that are wet in any weather.
    pub always_wet: Vec<MaterialId>,
    /// Living trees, species by species, thin ones first; then, if they were asked for, each of
    /// them again as a tree of the wood's edge; then those of given sizes.
    pub trees: Vec<TreeAsset>,
    /// Saplings, species by species, small ones first.
    pub saplings: Vec<TreeAsset>,
    /// Standing dead trees, species by species, thin ones first; then those of given sizes.
    pub snags: Vec<TreeAsset>,
    /// Shrubs, low plants, stumps, rocks, and all else that has a [`PlantKind`].
    pub plants: ByKind<Vec<PlantAsset>>,
    /// Patches of what each species sheds.
    pub shed: Vec<LitterPatches>,
    /// Logs and the stems of thrown trees.
    pub deadwood: Deadwood,
    /// What climbs on trees.
    pub climbers: Climbers,
    /// Tiles of closed vegetation, by [`PlantCommunity::index`].
    pub communities: [CommunityTiles; PlantCommunity::ALL.len()],
    /// The ground.
    pub ground: GroundMaterials,
}

impl Library {
    /// The steps for each kind of trail.
    pub const TRAIL_STEPS: usize = 3;
    /// The surface roots of each species.
    pub const SURFACE_ROOTS: usize = 8;
    /// The distance of a lobe's end from the middle of the stem for which surface roots are made,
    /// metres.
    pub const ROOT_LOBE_M: f64 = LOBE_M as f64;

    /// Grows a library, on all threads of the pool it is called in. The same key and parameters
    /// give the same bytes on any number of threads.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn grow(params: &AssetParams, key: Key) -> Result<Self, ParamError> {
        params.check()?;
        let species: Vec<Species> = params.species.iter().map(|s| s.species.clone()).collect();
        let season = params.season.filter(|of| !of.is_high_summer(&species));
        let trees_per_ha: Vec<f64> = params.species.iter().map(|s| s.trees_per_ha).collect();
        let wanted = params.wanted_materials(&trees_per_ha, season);
        let materials = WorldMaterials::bake(&species, wanted, key);
        let masks = MaskCoverage::of(&materials.library);
        let grower = TreeGrower {
            params,
            materials: &materials,
            masks: &masks,
            competitors: params.competitors(),
            growth: GrowthParams {
                trunk_radius_m: params.trunk_radius_m,
                ..GrowthParams::default()
            },
        };
        let mut trees = grower.all(TreeKind::Living, params.individuals_per_species, key)?;
        if params.edge_trees {
            trees.extend(grower.all(TreeKind::Edge, params.individuals_per_species, key)?);
        }
        let saplings = grower.all(TreeKind::Sapling, params.saplings_per_species, key)?;
        let mut snags = grower.all(TreeKind::Snag, params.snags_per_species, key)?;
        for tree in grower.measured(key)? {
            let to = if tree.alive { &mut trees } else { &mut snags };
            to.push(tree);
        }
        let plants = PlantGrower {
            params,
            species: &species,
            materials: &materials,
            masks: &masks,
            season,
            key,
        };
        Ok(Self {
            climbers: plants.climbers([&trees, &snags]),
            trees,
            saplings,
            snags,
            plants: ByKind::new(|kind| plants.grow(kind)),
            shed: plants.litter_patches(),
            deadwood: plants.deadwood(),
            communities: plants.communities(),
            ground: GroundMaterials {
                rock_face: materials.rock_face,
                ..materials.ground
            },
            full_leaf_masks: materials.full_leaf,
            always_wet: materials.always_wet,
            materials: materials.library,
        })
    }

    /// The materials as they are when all surfaces are wet but some and those that always are,
    /// from 0, dry, to 1, soaked by rain: a film of water makes what is porous darker, for eyes and
    /// lasers, and smoother. Leaves shed most of it.
    #[must_use]
    pub fn wet_materials(&self, wetness: f64, but: &[MaterialId]) -> MaterialLibrary {
        let but = [&self.always_wet, but].concat();
        materials::wet(&self.materials, wetness.clamp(0.0, 1.0) as f32, &but)
    }

    /// The materials with the masks that they have in full leaf; `None` if they have these. What
    /// grows under leaves goes by them.
    #[must_use]
    pub fn materials_in_full_leaf(&self) -> Option<MaterialLibrary> {
        if self.full_leaf_masks.is_empty() {
            return None;
        }
        let mut masks = self.full_leaf_masks.iter().peekable();
        let mut library = MaterialLibrary::new();
        for (i, material) in self.materials.materials().iter().enumerate() {
            let mut material = material.clone();
            if let Some((_, mask)) = masks.next_if(|(id, _)| usize::from(id.0) == i) {
                material.mask = Some(Arc::clone(mask));
            }
            library.add(material);
        }
        Some(library)
    }
}

fn prototype(name: &str, number: u32, shape: Shape, library: &MaterialLibrary) -> Prototype {
    Prototype::new(format!("{name}.{number}"), shape.mesh, shape.cards, library)
        .expect("shapes are made of finite points and of this library's materials")
}

/// Adds its ambient occlusion to a shape.
fn with_occlusion(shape: Prototype, masks: &MaskCoverage, near: &OcclusionParams) -> Prototype {
    let occlusion = ambient_occlusion::bake(&shape, masks, near);
    (shape.with_ambient_occlusion(occlusion))
        .expect("one share of each vertex and corner, and no ground")
}

/// Adds what it hides from the ground to a shape.
fn with_occluders(
    shape: Prototype,
    of: (&MaterialLibrary, &MaskCoverage),
    thickness: Thickness,
) -> Prototype {
    let occluders = ambient_occlusion::occluders(&shape, of, thickness, 1.0);
    shape.with_occluders(occluders)
}
