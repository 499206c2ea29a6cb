//! One tree on its own.

use nemoral_scene::{MaterialLibrary, ParamError};
use nemoral_seed::{Domain, Key};

use super::trees::{Grow, TreeGrower};
use super::{AssetParams, TreeAsset};
use crate::ambient_occlusion::MaskCoverage;
use crate::materials::{MaterialSelection, WorldMaterials};
use crate::tree::{GrowthParams, Species, grow, grow_snag};

const SINGLE: Domain = Domain::new("assets.single_tree");

/// A tree that stands for itself, with the materials that it is made of.
///
/// ```no_run
/// use nemoral_assets::{SingleTree, Species};
/// use nemoral_seed::Key;
///
/// let beech = SingleTree::grow(&Species::beech(), 0.4, true, Key::world(3))?;
/// println!("{:.1} m high", beech.tree.size.height_m);
/// # Ok::<(), nemoral_assets::ParamError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SingleTree {
    /// The tree.
    pub tree: TreeAsset,
    /// The materials that its shape refers to, among others.
    pub materials: MaterialLibrary,
}

impl SingleTree {
    /// Grows a living or a dead tree with this diameter at breast height, metres. Everything else
    /// about its size is drawn from the species' relations, for a tree of a closed stand.
    ///
    /// # Errors
    /// If the diameter is out of the species' range, or the species is invalid.
    pub fn grow(species: &Species, dbh_m: f64, alive: bool, key: Key) -> Result<Self, ParamError> {
        species.check()?;
        let [least, most] = species.allometry.dbh_range_m;
        ParamError::check_within("dbh_m", dbh_m, least, most)?;
        let wanted = MaterialSelection {
            trees_per_ha: &[1.0],
            seedlings: false,
            deadwood: false,
            climbers: false,
            lianas: false,
            resin: false,
            textures: true,
            communities: &[],
            trail_surfaces: &[],
            wayside: false,
            stream_stones: false,
            surface_roots: false,
            rock_faces: false,
            litter: false,
            season: None,
        };
        let materials = WorldMaterials::bake(std::slice::from_ref(species), wanted, key);
        let params = AssetParams::default();
        let grower = TreeGrower {
            masks: &MaskCoverage::of(&materials.library),
            materials: &materials,
            growth: GrowthParams {
                trunk_radius_m: params.trunk_radius_m,
                ..GrowthParams::default()
            },
            competitors: params.competitors(),
            params: &params,
        };
        let key = key.domain(SINGLE).domain(Domain::new(&species.name));
        let size = species.draw_size(dbh_m, key.item(1));
        let grow: Grow = if alive { grow } else { grow_snag };
        let size = (&size, &grower.growth);
        let tree = grower.grown((species, 0), grow, size, species.name.clone(), key.item(2))?;
        Ok(Self {
            tree,
            materials: materials.library,
        })
    }
}
