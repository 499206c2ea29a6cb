//! Trees of a library, and how they are grown.

use std::sync::Arc;

use nemoral_scene::{ParamError, Prototype};
use nemoral_seed::{Domain, Key};
use rayon::prelude::*;

use super::params::{AssetParams, StandSpecies};
use super::{with_occluders, with_occlusion};
use crate::ambient_occlusion::{MaskCoverage, OcclusionParams, Thickness};
use crate::materials::{LeafingGroup, WorldMaterials};
use crate::tree::{
    Competitors, FlareLobe, GrownTree, GrowthParams, SizeClass, Species, StemProfile,
    TreeMaterials, TreeSize, WoodVolume, grow, grow_snag, individual_rank,
};

const TREES: Domain = Domain::new("assets.trees");
const SAPLINGS: Domain = Domain::new("assets.saplings");
const SNAGS: Domain = Domain::new("assets.snags");
const MEASURED: Domain = Domain::new("assets.measured");

/// A grown tree.
#[derive(Clone, Debug)]
pub struct TreeAsset {
    /// Its shape.
    pub prototype: Arc<Prototype>,
    /// Its species, `snake_case`.
    pub species: String,
    /// Its size as grown.
    pub size: TreeSize,
    /// Its age class; of a dead tree, the class that it had.
    pub class: SizeClass,
    /// Is it alive?
    pub alive: bool,
    /// The diameters of its stem.
    pub stem: StemProfile,
    /// Stem volume over bark, from the ground to the stem's end, m³: where it forks, to the fork.
    pub stem_volume_m3: f64,
    /// Volume of all its wood over bark; `None` if that is not known.
    pub wood: Option<WoodVolume>,
    /// Radius it occupies at the ground, flare included, metres.
    pub radius_m: f64,
    /// The lobes of its root flare; none if they are not known.
    pub flare_lobes: Vec<FlareLobe>,
}

impl TreeAsset {
    /// The size of a copy that is wider and higher by these factors, which are above 0. A copy that
    /// is no higher than breast height has a diameter of 0.
    #[must_use]
    pub fn size_of_copy(&self, [across, along]: [f64; 2]) -> TreeSize {
        let size = &self.size;
        // Leaves point all ways, so their area grows as the mean of all ways does.
        let mean = libm::cbrt(across * across * along);
        TreeSize {
            dbh_m: across * self.stem.dbh_m(along),
            height_m: size.height_m * along,
            crown_base_m: size.crown_base_m * along,
            crown_radius_m: size.crown_radius_m * across,
            leaf_area_m2: size.leaf_area_m2 * mean * mean,
            lean_rad: libm::atan(libm::tan(size.lean_rad) * across / along),
        }
    }
}

#[derive(Clone, Copy)]
pub(super) enum TreeKind {
    Living,
    Edge,
    Sapling,
    Snag,
}

pub(super) struct TreeGrower<'a> {
    pub(super) params: &'a AssetParams,
    pub(super) materials: &'a WorldMaterials,
    pub(super) masks: &'a MaskCoverage,
    pub(super) growth: GrowthParams,
    pub(super) competitors: Competitors,
}

impl TreeGrower<'_> {
    /// Grows `of` trees of each species, in the order of species and individuals; each has its own
    /// key.
    pub(super) fn all(
        &self,
        kind: TreeKind,
        of: u32,
        key: Key,
    ) -> Result<Vec<TreeAsset>, ParamError> {
        let key = key.domain(match kind {
            // A tree at the edge is the one of its number inside, in other light.
            TreeKind::Living | TreeKind::Edge => TREES,
            TreeKind::Sapling => SAPLINGS,
            TreeKind::Snag => SNAGS,
        });
        let count = of as usize * self.params.species.len();
        let trees = (0..count).into_par_iter().map(|i| {
            let (species, number) = (i / of as usize, (i % of as usize) as u32);
            let name = &self.params.species[species].species.name;
            self.one(kind, species, [number, of], key.domain(Domain::new(name)))
        });
        trees.collect()
    }

    fn one(
        &self,
        kind: TreeKind,
        index: usize,
        [number, of]: [u32; 2],
        of_all: Key,
    ) -> Result<TreeAsset, ParamError> {
        let key = of_all.item(u64::from(number));
        let StandSpecies {
            species,
            dbh_mean_m,
            ..
        } = &self.params.species[index];
        let stand = &self.params.stand;
        let limits = [stand.dbh_min_m, stand.dbh_max_m];
        let inside = || {
            let number = [number, of];
            let dbh_m = species.dbh_of_individual(*dbh_mean_m, stand.shape, limits, number, of_all);
            species.draw_size_among(dbh_m, &self.competitors.of(dbh_m), key.item(1))
        };
        let (size, part, growth) = match kind {
            TreeKind::Living => (inside(), "", self.growth),
            TreeKind::Snag => (inside(), "snag.", self.growth),
            TreeKind::Sapling => {
                let height_m = 2.0 + 2.5 * individual_rank(number, of, key);
                let size = species.draw_sapling(height_m, key.item(1));
                (size, "sapling.", self.growth)
            }
            TreeKind::Edge => {
                let inside = inside();
                let growth = GrowthParams {
                    // Their crowns are larger, and nothing stands before them.
                    wood_triangles_max: self.growth.wood_triangles_max * 3 / 2,
                    cards_max: self.growth.cards_max * 3 / 2,
                    shaded_base_m: Some(species.shaded_base_m(&inside)),
                    ..self.growth
                };
                (species.size_at_edge(&inside), "edge.", growth)
            }
        };
        let grow: Grow = match kind {
            TreeKind::Snag => grow_snag,
            _ => grow,
        };
        let name = format!("{}.{part}{number}", species.name);
        self.grown((species, index), grow, (&size, &growth), name, key.item(2))
    }

    /// Grows the trees of given sizes.
    pub(super) fn measured(&self, key: Key) -> Result<Vec<TreeAsset>, ParamError> {
        let key = key.domain(MEASURED);
        let trees = self
            .params
            .measured
            .par_iter()
            .enumerate()
            .map(|(i, tree)| {
                let grow: Grow = if tree.alive { grow } else { grow_snag };
                let species = &self.params.species[tree.species].species;
                let name = format!("{}.measured.{i}", species.name);
                let key = key.item(i as u64);
                let size = (&tree.size, &self.growth);
                self.grown((species, tree.species), grow, size, name, key)
            });
        trees.collect()
    }

    /// Grows a tree of this size as finely as that; the species has this number among those with
    /// materials.
    pub(super) fn grown(
        &self,
        (species, index): (&Species, usize),
        grow: Grow,
        (size, growth): (&TreeSize, &GrowthParams),
        name: String,
        key: Key,
    ) -> Result<TreeAsset, ParamError> {
        let group = match species.size_class(size.dbh_m) {
            SizeClass::Sapling => LeafingGroup::Young,
            _ => LeafingGroup::of_tree(key),
        };
        let materials = self.materials.tree(index, group);
        let tree = grow(species, size, &materials, growth, key)?;
        let prototype = Prototype::new(name, tree.mesh, tree.cards, &self.materials.library)
            .expect("trees are made of finite points and of this library's materials");
        let prototype = with_occlusion(prototype, self.masks, &OcclusionParams::TREE);
        let thickness = match species.size_class(tree.size.dbh_m) {
            SizeClass::Sapling => Thickness::Thin,
            _ => Thickness::Thick,
        };
        let prototype = with_occluders(prototype, (&self.materials.library, self.masks), thickness);
        Ok(TreeAsset {
            prototype: Arc::new(prototype),
            species: species.name.clone(),
            class: species.size_class(tree.size.dbh_m),
            size: tree.size,
            alive: tree.alive,
            stem_volume_m3: tree.stem.volume_m3(),
            stem: tree.stem,
            wood: Some(tree.wood),
            radius_m: tree.foot_radius_m,
            flare_lobes: tree.flare_lobes,
        })
    }
}

/// [`grow`] or [`grow_snag`].
pub(super) type Grow =
    fn(&Species, &TreeSize, &TreeMaterials, &GrowthParams, Key) -> Result<GrownTree, ParamError>;
