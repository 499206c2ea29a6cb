//! Grows the smaller plants, rocks and stumps of a library.

use std::sync::Arc;

use nemoral_scene::{MaterialId, Prototype};
use nemoral_seed::{Domain, Draw, Key};
use rayon::prelude::*;

use super::{
    Library, PlantAsset, StandParams, StandSpecies, StreamStones, prototype, with_occluders,
    with_occlusion,
};
use crate::ambient_occlusion::{MaskCoverage, OcclusionParams, Thickness};
use crate::materials::WorldMaterials;
use crate::plant::bank::{BankMaterials, bank};
use crate::plant::rock::{RockPlan, StoneMaterials, cobble_m, rock};
use crate::plant::seedling::seedling;
use crate::plant::shape::Shape;
use crate::plant::shrub::ShrubKind;
use crate::plant::stump::stump;
use crate::plant::surface_root::surface_root;
use crate::plant::{floor, undergrowth, wayside};
use crate::tree::{Season, Species, individual_rank};

const SHRUBS: Domain = Domain::new("assets.shrubs");
const STUMPS: Domain = Domain::new("assets.stumps");
const ROCKS: Domain = Domain::new("assets.rocks");
const GRASS: Domain = Domain::new("assets.grass");
const HERBS: Domain = Domain::new("assets.herbs");
const FERNS: Domain = Domain::new("assets.ferns");
const SEEDLINGS: Domain = Domain::new("assets.seedlings");
const LITTER: Domain = Domain::new("assets.litter");
const STRIP_MATS: Domain = Domain::new("assets.strip_mats");
const TRAIL_TUFTS: Domain = Domain::new("assets.trail_tufts");
const TRAIL_STONES: Domain = Domain::new("assets.trail_stones");
const TRAIL_ROOTS: Domain = Domain::new("assets.trail_roots");
const CULVERTS: Domain = Domain::new("assets.culverts");
const TRAIL_STEPS: Domain = Domain::new("assets.trail_steps");
const SURFACE_ROOTS: Domain = Domain::new("assets.surface_roots");
const STONE_BEDS: Domain = Domain::new("assets.stone_beds");
const BANKS: Domain = Domain::new("assets.banks");

const SHRUBS_PER_KIND: u32 = 4;
/// Stumps of a stand, and the fewest of each of its species.
const STUMP_COUNT: u32 = 9;
const STUMPS_OF_SPECIES: u32 = 3;
/// The diameter of a stump's cut over the tree's at breast height (our choice).
const CUT_OVER_DBH: [f64; 2] = [1.15, 1.3];
const ROCK_COUNT: u32 = 12;
/// Variants of each kind of patch.
const PATCHES: u32 = 16;

/// The share of a rock's height up to which it is wet in a stream.
const WATER_LINE: f32 = 0.4;

/// Grows the i-th of a kind from its own key.
pub(super) type GrowOne<'a> = dyn Fn(u32, Key) -> PlantAsset + Sync + 'a;

/// What all of them are grown from.
pub(super) struct PlantGrower<'a> {
    pub(super) species: &'a [Species],
    pub(super) materials: &'a WorldMaterials,
    pub(super) masks: &'a MaskCoverage,
    /// High summer without one.
    pub(super) season: Option<Season>,
    pub(super) key: Key,
}

impl PlantGrower<'_> {
    /// `count` individuals, each from its own key, on all threads.
    pub(super) fn collect(
        &self,
        domain: Domain,
        count: u32,
        grow: &GrowOne<'_>,
    ) -> Vec<PlantAsset> {
        (0..count)
            .into_par_iter()
            .map(|i| grow(i, self.key.domain(domain).item(u64::from(i))))
            .collect()
    }

    /// A shape without leaves.
    pub(super) fn finish(
        &self,
        name: &str,
        number: u32,
        shape: Shape,
        radius_m: f32,
    ) -> PlantAsset {
        asset(
            name,
            prototype(name, number, shape, &self.materials.library),
            radius_m,
        )
    }

    /// The same of wood or stone that stands up from the ground, and hides light from it.
    pub(super) fn upright(
        &self,
        name: &str,
        number: u32,
        shape: Shape,
        (radius_m, thickness): (f32, Thickness),
    ) -> PlantAsset {
        let library = &self.materials.library;
        let shape = prototype(name, number, shape, library);
        let shape = with_occluders(shape, (library, self.masks), thickness);
        asset(name, shape, radius_m)
    }

    /// A shape whose parts, such as leaves, occlude each other and, if they do not lie on it, the
    /// ground.
    pub(super) fn leafy(
        &self,
        name: &str,
        number: u32,
        shape: Shape,
        radius_m: f32,
        occlusion: &OcclusionParams,
    ) -> PlantAsset {
        let library = &self.materials.library;
        let shape = prototype(name, number, shape, library);
        let shape = with_occluders(shape, (library, self.masks), Thickness::Thin);
        asset(name, with_occlusion(shape, self.masks, occlusion), radius_m)
    }

    /// A patch of low plants.
    pub(super) fn patch(&self, name: &str, number: u32, shape: Shape) -> PlantAsset {
        let radius_m = shape.reach_m();
        self.leafy(name, number, shape, radius_m, &OcclusionParams::LOW)
    }

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

    /// Stumps of trees as thick as those that stand: as many of each species, one species after
    /// the other, and of each thin ones first. They stand for equal parts of its diameters.
    pub(super) fn stumps(&self, stand: &[StandSpecies], of: &StandParams) -> Vec<PlantAsset> {
        let species = stand.len() as u32;
        let each = STUMP_COUNT.div_ceil(species).max(STUMPS_OF_SPECIES);
        let limits_m = [of.dbh_min_m, of.dbh_max_m];
        self.collect(STUMPS, species * each, &|i, key| {
            let mut rng = key.rng();
            let (index, number) = ((i / each) as usize, [i % each, each]);
            let StandSpecies {
                species,
                dbh_mean_m,
                ..
            } = &stand[index];
            let of_all = self.key.domain(STUMPS).domain(Domain::new(&species.name));
            let dbh_m = species.dbh_of_individual(*dbh_mean_m, of.shape, limits_m, number, of_all);
            let [thin, thick] = CUT_OVER_DBH;
            let radius_m = (0.5 * rng.range_f64(thin, thick) * dbh_m) as f32;
            let height_m = rng.range_f32(0.14, 0.38);
            let old = rng.chance(0.6);
            let shape = stump(
                radius_m,
                height_m,
                old,
                &self.materials.stumps[index],
                key.item(0),
            );
            let foot = foot_radius_m(&shape);
            self.upright("stump", i, shape, (foot, Thickness::Thick))
        })
    }

    /// Rocks, smallest first.
    pub(super) fn rocks(&self) -> Vec<PlantAsset> {
        self.rocks_up_to(None)
    }

    /// Stones in streams, if their materials are there.
    pub(super) fn stream_stones(&self) -> StreamStones {
        let (Some(wet_rock), Some(wet)) = (self.materials.wet_rock, self.materials.wet_stones)
        else {
            return StreamStones::default();
        };
        StreamStones {
            rocks: self.rocks_up_to(Some(wet_rock)),
            stones: self.stones_of(wet.stone),
            beds: self.beds_of(wet),
        }
    }

    /// Rocks, of another material up to [`WATER_LINE`].
    fn rocks_up_to(&self, wet: Option<MaterialId>) -> Vec<PlantAsset> {
        self.collect(ROCKS, ROCK_COUNT, &|i, key| {
            let mut rng = key.rng();
            // Radii of 0.15 to 1.2 m in a geometric series, smallest first.
            let step = f64::from(i) / f64::from(ROCK_COUNT - 1);
            let radius_m = (0.15 * libm::pow(8.0, step)) as f32 * rng.range_f32(0.93, 1.07);
            let plan = RockPlan {
                radius_m,
                subdivisions: if radius_m < 0.45 { 3 } else { 4 },
                sunk: rng.range_f32(0.30, 0.60),
                roughness: rng.range_f32(0.05, 0.11),
                material: self.materials.rock,
                tile_m: 1.0,
            };
            let mut shape = rock(&plan, key.item(0));
            let foot = foot_radius_m(&shape);
            if let Some(wet) = wet {
                let top_m = shape.mesh.positions.iter().fold(0.0_f32, |a, p| a.max(p.z));
                shape.soak(WATER_LINE * top_m, wet);
            }
            self.upright("rock", i, shape, (foot, Thickness::Thick))
        })
    }

    /// Loose stones for trails.
    pub(super) fn trail_stones(&self) -> Vec<PlantAsset> {
        self.stones_of(self.materials.stones.stone)
    }

    fn stones_of(&self, material: MaterialId) -> Vec<PlantAsset> {
        self.collect(TRAIL_STONES, 16, &|i, key| {
            let mut rng = key.rng();
            let plan = RockPlan {
                radius_m: cobble_m(&mut rng),
                subdivisions: 2,
                sunk: rng.range_f32(0.25, 0.45),
                roughness: rng.range_f32(0.03, 0.08),
                material,
                tile_m: 0.5,
            };
            let shape = rock(&plan, key.item(0));
            let foot = foot_radius_m(&shape);
            self.finish("stone", i, shape, foot)
        })
    }

    /// Roots that lie across trails.
    pub(super) fn trail_roots(&self, bark: MaterialId) -> Vec<PlantAsset> {
        self.collect(TRAIL_ROOTS, 16, &|i, key| {
            self.patch("root", i, wayside::root(bark, &mut key.rng()))
        })
    }

    /// Mouths of culverts, if their material is there.
    pub(super) fn culverts(&self) -> Vec<PlantAsset> {
        let Some(of) = self.materials.culvert else {
            return Vec::new();
        };
        self.collect(CULVERTS, 4, &|i, key| {
            self.patch("culvert", i, wayside::culvert(of, &mut key.rng()))
        })
    }

    /// Steps of logs across trails, if their materials are there.
    pub(super) fn trail_steps(&self) -> Vec<PlantAsset> {
        let each = Library::TRAIL_STEPS as u32;
        let count = each * self.materials.steps.len() as u32;
        self.collect(TRAIL_STEPS, count, &|i, key| {
            let of = self.materials.steps[(i / each) as usize];
            self.patch("step", i, wayside::step(of, &mut key.rng()))
        })
    }

    /// Roots that spread from old trees, species by species, if their materials are there.
    pub(super) fn surface_roots(&self) -> Vec<PlantAsset> {
        let each = Library::SURFACE_ROOTS as u32;
        let of_species = self.species.iter().zip(&self.materials.surface_roots);
        let roots = of_species.flat_map(|(species, &bark)| {
            // The key is the species' own, so that its roots do not depend on the other species.
            let of = Domain::new(&species.name);
            let name = format!("{}_root", species.name);
            self.collect(SURFACE_ROOTS, each, &|i, key| {
                self.patch(&name, i, surface_root(bark, key.domain(of)))
            })
        });
        roots.collect()
    }

    /// Beds of stones.
    pub(super) fn stone_beds(&self) -> Vec<PlantAsset> {
        self.beds_of(self.materials.stones)
    }

    fn beds_of(&self, materials: StoneMaterials) -> Vec<PlantAsset> {
        self.collect(STONE_BEDS, 8, &|i, key| {
            self.patch("stone_bed", i, wayside::bed(materials, key))
        })
    }

    /// What sticks out of cut slopes, if its materials are there.
    pub(super) fn banks(&self) -> Vec<PlantAsset> {
        let (Some(soil), Some(root)) = (self.materials.bank_soil, self.materials.surface_root)
        else {
            return Vec::new();
        };
        let materials = BankMaterials {
            stones: self.materials.stones,
            soil,
            root,
        };
        self.collect(BANKS, PATCHES, &|i, key| {
            self.patch("bank", i, bank(i >= PATCHES / 2, &materials, key))
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
    pub(super) fn seedlings(&self, of_species: u32) -> Vec<PlantAsset> {
        self.collect(
            SEEDLINGS,
            of_species * self.species.len() as u32,
            &|i, _| {
                let (of, number) = ((i / of_species) as usize, i % of_species);
                // The key is the species' own, so that its seedlings do not depend on the other
                // species.
                let name = &self.species[of].name;
                let key = self.key.domain(SEEDLINGS).domain(Domain::new(name));
                let key = key.item(u64::from(number));
                let rank = individual_rank(number, of_species, key) as f32;
                let (leaves, materials) = (&self.species[of].leaves, &self.materials.seedlings[of]);
                let shape = seedling(rank, leaves, materials, &mut key.rng());
                self.patch(&format!("{name}_seedling"), number, shape)
            },
        )
    }

    /// Patches of fallen twigs, cones and leaves.
    pub(super) fn litter(&self) -> Vec<PlantAsset> {
        self.collect(LITTER, PATCHES, &|i, key| {
            let shape = floor::litter(i, self.materials, &mut key.rng());
            let radius_m = shape.reach_m();
            self.finish("litter", i, shape, radius_m)
        })
    }

    /// Mats for the strips between ruts.
    pub(super) fn strip_mats(&self) -> Vec<PlantAsset> {
        self.collect(STRIP_MATS, PATCHES, &|i, key| {
            let shape = undergrowth::strip_mat(i, self.materials, &mut key.rng());
            self.patch("strip_mat", i, shape)
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
}

pub(super) fn asset(name: &str, prototype: Prototype, radius_m: f32) -> PlantAsset {
    PlantAsset {
        height_m: f64::from(prototype.bounds().max.z),
        prototype: Arc::new(prototype),
        name: name.to_owned(),
        radius_m: f64::from(radius_m),
    }
}

/// The largest distance from the axis at or above the ground.
fn foot_radius_m(shape: &Shape) -> f32 {
    let above = shape.mesh.positions.iter().filter(|p| p.z > -0.02);
    above.fold(0.0, |r, p| r.max(p.truncate().length()))
}
