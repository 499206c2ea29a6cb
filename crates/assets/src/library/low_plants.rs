//! Grows shrubs and low plants, and the litter among them.

use nemoral_seed::Domain;

use super::PlantAsset;
use super::plants::{PATCHES, PlantGrower};
use crate::ambient_occlusion::OcclusionParams;
use crate::plant::seedling::seedling;
use crate::plant::shrub::ShrubKind;
use crate::plant::{floor, undergrowth};
use crate::tree::{FruitLook, individual_rank};

const SHRUBS: Domain = Domain::new("assets.shrubs");
const GRASS: Domain = Domain::new("assets.grass");
const HERBS: Domain = Domain::new("assets.herbs");
const FERNS: Domain = Domain::new("assets.ferns");
const SEEDLINGS: Domain = Domain::new("assets.seedlings");
const LITTER: Domain = Domain::new("assets.litter");
const TRAIL_TUFTS: Domain = Domain::new("assets.trail_tufts");
const STRIP_MATS: Domain = Domain::new("assets.strip_mats");

const SHRUBS_PER_KIND: u32 = 4;

impl PlantGrower<'_> {
    /// Gorse, heather and bramble.
    pub(super) fn shrubs(&self) -> Vec<PlantAsset> {
        self.collect(SHRUBS, SHRUBS_PER_KIND * 3, &|i, key| {
            let kind = ShrubKind::ALL[(i / SHRUBS_PER_KIND) as usize];
            let rank = (i % SHRUBS_PER_KIND) as f32 / (SHRUBS_PER_KIND - 1) as f32;
            let shape = kind.grow(rank, self.materials, &mut key.rng());
            // Crowns of shrubs may touch; their lower halves may not.
            let radius_m = 0.6 * shape.reach_m();
            self.leafy(kind.name(), i, shape, radius_m, &OcclusionParams::SHRUB)
        })
    }

    /// Patches of grass.
    pub(super) fn grass(&self) -> Vec<PlantAsset> {
        self.collect(GRASS, PATCHES, &|i, key| {
            self.patch(
                "grass",
                i,
                undergrowth::grass(i, self.materials, &mut key.rng()),
            )
        })
    }

    /// Patches of herbs.
    pub(super) fn herbs(&self) -> Vec<PlantAsset> {
        self.collect(HERBS, PATCHES, &|i, key| {
            self.patch(
                "herbs",
                i,
                undergrowth::herbs(i, self.materials, &mut key.rng()),
            )
        })
    }

    /// Patches of bracken and male fern in turn.
    pub(super) fn ferns(&self) -> Vec<PlantAsset> {
        self.collect(FERNS, 2 * PATCHES, &|i, key| {
            let mut rng = key.rng();
            let (name, mut shape) = if i % 2 == 0 {
                ("bracken", undergrowth::bracken(self.materials, &mut rng))
            } else {
                (
                    "male_fern",
                    undergrowth::male_fern(self.materials, &mut rng),
                )
            };
            shape.flatten(self.materials.frond_height);
            self.patch(name, i, shape)
        })
    }

    /// Single tree seedlings, species by species, small ones first.
    pub(super) fn seedlings(&self) -> Vec<PlantAsset> {
        let of_species = self.params.seedlings_per_species;
        let count = of_species * self.species.len() as u32;
        self.collect(SEEDLINGS, count, &|i, _| {
            let (of, number) = ((i / of_species) as usize, i % of_species);
            // The key is the species' own, so that its seedlings do not depend on the others.
            let name = &self.species[of].name;
            let key = self.key.domain(SEEDLINGS).domain(Domain::new(name));
            let key = key.item(u64::from(number));
            let rank = individual_rank(number, of_species, key) as f32;
            let (leaves, materials) = (&self.species[of].leaves, &self.materials.seedlings[of]);
            let shape = seedling(rank, leaves, materials, &mut key.rng());
            self.patch(&format!("{name}_seedling"), number, shape)
        })
    }

    /// Patches of fallen twigs, fruits and leaves of the stand's trees.
    pub(super) fn litter(&self) -> Vec<PlantAsset> {
        let trees = self.params.species.iter();
        let total: f64 = trees.clone().map(|of| of.trees_per_ha).sum();
        let fruits: Vec<(FruitLook, f64)> = trees
            .filter_map(|of| {
                let share = of.trees_per_ha / total.max(f64::MIN_POSITIVE);
                Some((of.species.litter_look().fruit?, share))
            })
            .collect();
        self.collect(LITTER, PATCHES, &|i, key| {
            let shape = floor::litter(&fruits, self.materials, &mut key.rng());
            let radius_m = shape.reach_m();
            self.finish("litter", i, shape, radius_m)
        })
    }

    /// Tufts for trails.
    pub(super) fn trail_tufts(&self) -> Vec<PlantAsset> {
        self.collect(TRAIL_TUFTS, PATCHES, &|i, key| {
            self.patch(
                "trail_tufts",
                i,
                undergrowth::trail_tuft(i, self.materials, &mut key.rng()),
            )
        })
    }

    /// Mats for the strips between ruts.
    pub(super) fn strip_mats(&self) -> Vec<PlantAsset> {
        self.collect(STRIP_MATS, PATCHES, &|i, key| {
            let shape = undergrowth::strip_mat(i, self.materials, &mut key.rng());
            self.patch("strip_mat", i, shape)
        })
    }
}
