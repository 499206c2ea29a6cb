//! Grows stumps, rocks and stones, roots, and what is built on ways.

use nemoral_scene::MaterialId;
use nemoral_seed::{Domain, Draw};

use super::plants::{PATCHES, PlantGrower};
use super::{Library, PlantAsset, StandSpecies};
use crate::ambient_occlusion::Thickness;
use crate::plant::bank::{BankMaterials, bank};
use crate::plant::rock::{RockPlan, StoneMaterials, cobble_m, rock};
use crate::plant::shape::Shape;
use crate::plant::stump::stump;
use crate::plant::surface_root::surface_root;
use crate::plant::wayside;

const STUMPS: Domain = Domain::new("assets.stumps");
const ROCKS: Domain = Domain::new("assets.rocks");
const TRAIL_STONES: Domain = Domain::new("assets.trail_stones");
const TRAIL_ROOTS: Domain = Domain::new("assets.trail_roots");
const CULVERTS: Domain = Domain::new("assets.culverts");
const TRAIL_STEPS: Domain = Domain::new("assets.trail_steps");
const SURFACE_ROOTS: Domain = Domain::new("assets.surface_roots");
const STONE_BEDS: Domain = Domain::new("assets.stone_beds");
const BANKS: Domain = Domain::new("assets.banks");

/// The fewest stumps of a stand.
const STUMP_COUNT: u32 = 9;
/// The fewest stumps of each of its species.
const STUMPS_OF_SPECIES: u32 = 3;
/// The diameter of a stump's cut over the tree's at breast height (our choice).
const CUT_OVER_DBH: [f64; 2] = [1.15, 1.3];
const ROCK_COUNT: u32 = 12;

/// The share of a rock's height up to which it is wet in a stream.
const WATER_LINE: f32 = 0.4;

impl PlantGrower<'_> {
    /// Stumps of trees as thick as those that stand: equally many of each species, species by
    /// species, thin ones first. Those of a species are of equal parts of its distribution of
    /// diameters.
    pub(super) fn stumps(&self) -> Vec<PlantAsset> {
        let (stand, of) = (&self.params.species, &self.params.stand);
        let count = stand.len() as u32;
        let each = STUMP_COUNT.div_ceil(count).max(STUMPS_OF_SPECIES);
        let limits_m = [of.dbh_min_m, of.dbh_max_m];
        self.collect(STUMPS, count * each, &|i, key| {
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

    /// Rocks, smallest first; of the material `wet` up to [`WATER_LINE`], if there is one.
    pub(super) fn rocks(&self, wet: Option<MaterialId>) -> Vec<PlantAsset> {
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

    /// Rocks in streams, if their material is there.
    pub(super) fn wet_rocks(&self) -> Vec<PlantAsset> {
        let wet = self.materials.wet_rock;
        wet.map_or_else(Vec::new, |wet| self.rocks(Some(wet)))
    }

    /// Loose stones, if their materials are there.
    pub(super) fn stones(&self, of: Option<StoneMaterials>) -> Vec<PlantAsset> {
        let Some(of) = of else {
            return Vec::new();
        };
        self.collect(TRAIL_STONES, 16, &|i, key| {
            let mut rng = key.rng();
            let plan = RockPlan {
                radius_m: cobble_m(&mut rng),
                subdivisions: 2,
                sunk: rng.range_f32(0.25, 0.45),
                roughness: rng.range_f32(0.03, 0.08),
                material: of.stone,
                tile_m: 0.5,
            };
            let shape = rock(&plan, key.item(0));
            let foot = foot_radius_m(&shape);
            self.finish("stone", i, shape, foot)
        })
    }

    /// Beds of stones, if their materials are there.
    pub(super) fn stone_beds(&self, of: Option<StoneMaterials>) -> Vec<PlantAsset> {
        let Some(of) = of else {
            return Vec::new();
        };
        self.collect(STONE_BEDS, 8, &|i, key| {
            self.patch("stone_bed", i, wayside::bed(of, key))
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

    /// Roots that lie across trails, if their bark is there.
    pub(super) fn trail_roots(&self) -> Vec<PlantAsset> {
        let Some(bark) = self.materials.surface_root else {
            return Vec::new();
        };
        self.collect(TRAIL_ROOTS, 16, &|i, key| {
            self.patch("root", i, wayside::root(bark, &mut key.rng()))
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
}

/// The largest distance from the axis at or above the ground.
fn foot_radius_m(shape: &Shape) -> f32 {
    let above = shape.mesh.positions.iter().filter(|p| p.z > -0.02);
    above.fold(0.0, |r, p| r.max(p.truncate().length()))
}
