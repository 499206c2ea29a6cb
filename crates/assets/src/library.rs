//! The library: everything a world is made of, grown from one key.

use std::sync::Arc;

use nemoral_scene::{MaterialId, MaterialLibrary, Prototype};
use nemoral_seed::Key;

use crate::error::ParamError;
use crate::tree::TreeSize;

/// What to grow.
#[derive(Clone, Debug, PartialEq)]
pub struct AssetParams {
    /// Different trees of each species, 1..=64.
    pub individuals_per_species: u32,
    /// Wood of at least this radius is a limb, thinner wood a branch; metres, 0.01..=0.2.
    pub trunk_radius_m: f64,
    /// How thick the trees of a stand are.
    pub stand: StandParams,
}

/// The distribution of diameters at breast height: a truncated Weibull
/// (`reference/vegetation.md` section 2.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandParams {
    /// Mean diameter at breast height of each species before truncation, metres, 0.08..=1.0: maritime
    /// pine, eucalypt, oak.
    pub dbh_mean_m: [f64; 3],
    /// Weibull shape, 1..=6: about 1.2 in uneven-aged, 3 in even-aged stands.
    pub shape: f64,
    /// Thinnest tree, metres, 0.07..=0.5.
    pub dbh_min_m: f64,
    /// Thickest tree, metres, above the thinnest and at most 1.5.
    pub dbh_max_m: f64,
}

/// A grown tree.
#[derive(Clone, Debug)]
pub struct TreeAsset {
    /// Its shape.
    pub prototype: Arc<Prototype>,
    /// Its species, `snake_case`.
    pub species: &'static str,
    /// Its size as grown.
    pub size: TreeSize,
    /// Stem volume over bark, m³.
    pub stem_volume_m3: f64,
    /// Radius it occupies at the ground, flare included, metres.
    pub radius_m: f64,
}

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

/// The materials of the ground and of trails; all of them `ground`, uv in metres.
#[derive(Clone, Debug)]
pub struct GroundMaterials {
    /// The forest floor: leaf litter, needle litter, moss and soil.
    pub floor: Vec<MaterialId>,
    /// Slopes that a trail has cut or filled.
    pub cut_slope: MaterialId,
    /// Gravel, dry earth, mud, grassy, leaf litter, needles, sand, rock.
    pub trails: [TrailMaterials; 8],
}

/// The three bands of a trail's section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrailMaterials {
    /// Most of it.
    pub surface: MaterialId,
    /// Where wheels run.
    pub rut: MaterialId,
    /// Between the ruts.
    pub strip: MaterialId,
}

/// All prototypes and materials of a world.
#[derive(Clone, Debug)]
pub struct Library {
    /// The materials that all prototypes refer to.
    pub materials: MaterialLibrary,
    /// Trees, species by species.
    pub trees: Vec<TreeAsset>,
    /// Gorse, heather and bramble.
    pub shrubs: Vec<PlantAsset>,
    /// Stumps.
    pub stumps: Vec<PlantAsset>,
    /// Rocks, smallest first.
    pub rocks: Vec<PlantAsset>,
    /// Patches of grass.
    pub grass: Vec<PlantAsset>,
    /// Patches of herbs.
    pub herbs: Vec<PlantAsset>,
    /// Patches of ferns and bracken.
    pub ferns: Vec<PlantAsset>,
    /// Patches of fallen twigs, cones and leaves.
    pub litter: Vec<PlantAsset>,
    /// Grass tufts for trails.
    pub trail_grass: Vec<PlantAsset>,
    /// Loose stones for trails.
    pub trail_stones: Vec<PlantAsset>,
    /// The ground.
    pub ground: GroundMaterials,
}

impl Default for AssetParams {
    fn default() -> Self {
        Self {
            individuals_per_species: 8,
            trunk_radius_m: 0.04,
            stand: StandParams::default(),
        }
    }
}

impl Default for StandParams {
    fn default() -> Self {
        Self {
            dbh_mean_m: [0.28, 0.22, 0.30],
            shape: 2.5,
            dbh_min_m: 0.10,
            dbh_max_m: 0.60,
        }
    }
}

impl Library {
    /// Grows a library. The same key and parameters give the same bytes.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn grow(params: &AssetParams, key: Key) -> Result<Self, ParamError> {
        let _ = (params, key);
        Err(ParamError::new("library", "", "implemented"))
    }
}
