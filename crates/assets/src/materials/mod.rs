//! All materials of a world, baked and registered.

mod bake;
mod climbers;
mod communities;
mod deadwood;
mod foliage;
mod ground;
mod lianas;
mod litter;
pub(crate) mod optics;
mod plant_phenology;
mod register;
mod seasons;
mod seedling;
mod solid;
mod trees;
mod wet;

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{MaterialId, MaterialLibrary, PlantCommunity, Texture, TrailSurfaceKind};

use self::seasons::SpeciesLeaves;
use crate::plant::rock::StoneMaterials;
use crate::plant::wayside::StepMaterials;
use crate::textures::tile::Tile;
use crate::tree::{FoliageCard, Season, TreeMaterials};

pub(crate) use self::climbers::ClimberMaterials;
pub(crate) use self::communities::{CommunityMaterials, Hue};
pub(crate) use self::deadwood::{DeadwoodMaterials, LogMaterials, RootPlateMaterials};
pub use self::ground::{GroundMaterials, TrailMaterials};
pub(crate) use self::lianas::LianaMaterials;
pub(crate) use self::litter::LitterMaterials;
pub(crate) use self::seasons::{FullLeafMasks, LeafingGroup};
pub(crate) use self::seedling::SeedlingMaterials;
pub(crate) use self::solid::StumpMaterials;
pub(crate) use self::wet::wet;

/// Bakes textures, or spares their baking.
#[derive(Clone, Debug)]
struct TextureBaker {
    /// What every tile has if textures are not wanted.
    plain: Option<Arc<Texture>>,
}

impl TextureBaker {
    fn new(textures: bool) -> Self {
        let plain = (!textures).then(|| Arc::new(Texture::plain(Vec3::splat(0.2))));
        Self { plain }
    }

    /// The texture of a tile, which is only made if textures are wanted.
    fn bake(&self, tile: impl FnOnce() -> Tile) -> Arc<Texture> {
        let plain = self.plain.clone();
        plain.unwrap_or_else(|| Arc::new(tile().texture()))
    }
}

/// The materials that plants are made of, with the library that holds them.
#[derive(Clone, Debug)]
pub(crate) struct WorldMaterials {
    pub(crate) library: MaterialLibrary,
    /// The materials of each species.
    trees: Vec<TreeMaterials>,
    /// The leaves of each species, and the images of all that are different.
    leaves: Vec<(SpeciesLeaves, Vec<Vec<FoliageCard>>)>,
    /// What tells in full leaf how much light is left under leaves that the season has taken.
    pub(crate) full_leaf: FullLeafMasks,
    /// Bark and face of stumps, of each species.
    pub(crate) stumps: Vec<StumpMaterials>,
    /// The materials of the seedlings of each species; empty without seedlings.
    pub(crate) seedlings: Vec<SeedlingMaterials>,
    /// The materials of deadwood, if there is any.
    pub(crate) deadwood: Option<DeadwoodMaterials>,
    /// The materials of what grows on stems, if anything does.
    pub(crate) climbers: Option<ClimberMaterials>,
    /// The materials of clematis and honeysuckle, if there are any.
    pub(crate) lianas: Option<LianaMaterials>,
    /// Runs of resin on bark; none if they were not asked for.
    pub(crate) resin: Vec<FoliageCard>,
    /// The materials of closed vegetation.
    pub(crate) communities: CommunityMaterials,
    pub(crate) ground: GroundMaterials,
    pub(crate) rock: MaterialId,
    pub(crate) stones: StoneMaterials,
    pub(crate) shrub_wood: MaterialId,
    pub(crate) cane: MaterialId,
    pub(crate) frond_stalk: MaterialId,
    pub(crate) herb_stalk: MaterialId,
    pub(crate) fallen_twig: MaterialId,
    /// Bark of roots across trails, if they were asked for.
    pub(crate) surface_root: Option<MaterialId>,
    /// Bark of roots at the surface, by species; none if they were not asked for.
    pub(crate) surface_roots: Vec<MaterialId>,
    /// The concrete of culverts and the dark in them, if roots across trails were asked for.
    pub(crate) culvert: Option<[MaterialId; 2]>,
    /// Steps on trails, by [`TrailSurfaceKind::index`]; none if roots across trails were not
    /// asked for.
    pub(crate) steps: Vec<StepMaterials>,
    /// Lumps of the earth that trails are cut through, if roots across trails were asked for.
    pub(crate) bank_soil: Option<MaterialId>,
    pub(crate) cone: MaterialId,
    /// The materials of what each species sheds; empty if that was not asked for.
    pub(crate) litter: Vec<LitterMaterials>,
    /// Cones, nuts and capsules, if they were asked for.
    pub(crate) fruit: Option<MaterialId>,
    /// Rock and stone in streams; `None` where they are not wanted.
    pub(crate) wet_rock: Option<MaterialId>,
    pub(crate) wet_stones: Option<StoneMaterials>,
    /// What is wet in any weather.
    pub(crate) always_wet: Vec<MaterialId>,
    /// Bare faces of cliffs; `None` where there are none.
    pub(crate) rock_face: Option<MaterialId>,
    pub(crate) gorse: Vec<FoliageCard>,
    pub(crate) heather: Vec<FoliageCard>,
    pub(crate) bramble: Vec<FoliageCard>,
    pub(crate) bracken: Vec<FoliageCard>,
    pub(crate) bracken_dead: Vec<FoliageCard>,
    /// The height of fronds over that of standing ones.
    pub(crate) frond_height: f32,
    /// Fronds; each is its slices, foot first.
    pub(crate) fronds: Vec<Vec<FoliageCard>>,
    /// The last one bears flowering stalks.
    pub(crate) grass: Vec<FoliageCard>,
    pub(crate) broad_leaf: Vec<FoliageCard>,
    pub(crate) leafy_stem: Vec<FoliageCard>,
    pub(crate) trefoil: Vec<FoliageCard>,
    pub(crate) fallen_leaf: Vec<FoliageCard>,
}

/// The materials that only some worlds have, and what the others depend on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaterialSelection<'a> {
    /// How many trees of each species there are, relative to each other.
    pub(crate) trees_per_ha: &'a [f64],
    pub(crate) seedlings: bool,
    pub(crate) deadwood: bool,
    pub(crate) climbers: bool,
    pub(crate) lianas: bool,
    pub(crate) resin: bool,
    pub(crate) communities: &'a [PlantCommunity],
    pub(crate) trail_surfaces: &'a [TrailSurfaceKind],
    pub(crate) wayside: bool,
    pub(crate) stream_stones: bool,
    pub(crate) rock_faces: bool,
    pub(crate) surface_roots: bool,
    pub(crate) litter: bool,
    /// High summer without one.
    pub(crate) season: Option<Season>,
    /// Whether bark, wood, stone and ground have textures.
    pub(crate) textures: bool,
}

impl WorldMaterials {
    /// What the trees of a species in this group are made of.
    pub(crate) fn tree(&self, species: usize, group: LeafingGroup) -> TreeMaterials {
        let (leaves, foliage) = &self.leaves[species];
        TreeMaterials {
            foliage: foliage[leaves.number(group)].clone(),
            ..self.trees[species].clone()
        }
    }
}
