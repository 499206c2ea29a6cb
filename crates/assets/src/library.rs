//! The library: everything a world is made of, grown from one key.

use std::sync::Arc;

use nemoral_scene::{MaterialLibrary, Prototype};
use nemoral_seed::{Domain, Draw, Key};
use rayon::prelude::*;

use crate::ambient_occlusion::{self, MaskCoverage, OcclusionParams};
use crate::error::ParamError;
use crate::materials::{GroundMaterials, WorldMaterials};
use crate::plant::rock::{RockPlan, rock};
use crate::plant::seedling::seedling;
use crate::plant::shape::Shape;
use crate::plant::shrub::ShrubKind;
use crate::plant::stump::stump;
use crate::plant::{floor, undergrowth};
use crate::tree::{
    GrownTree, GrowthParams, SizeClass, Species, TreeMaterials, TreeSize, grow, grow_snag,
    individual_rank,
};

/// What to grow.
#[derive(Clone, Debug, PartialEq)]
pub struct AssetParams {
    /// The trees' species, 1 to 32, each with a name of its own.
    pub species: Vec<StandSpecies>,
    /// Different living trees of each species, 1..=64. Their diameters stand for one of as many
    /// equal parts of the stand's distribution each, so that few trees already show its spread and
    /// basal area.
    pub individuals_per_species: u32,
    /// Different saplings of each species, 0..=64, 2 to 4.5 m high.
    pub saplings_per_species: u32,
    /// Different seedlings of each species, 0..=64, under 0.3 m high.
    pub seedlings_per_species: u32,
    /// Different standing dead trees of each species, 0..=64, as thick as the stand's.
    pub snags_per_species: u32,
    /// Wood of at least this radius is a limb, thinner wood a branch; metres, 0.01..=0.2.
    pub trunk_radius_m: f64,
    /// How thick the trees of a stand are.
    pub stand: StandParams,
}

/// A species in a stand.
#[derive(Clone, Debug, PartialEq)]
pub struct StandSpecies {
    /// The species.
    pub species: Species,
    /// Mean diameter at breast height before truncation, metres, 0.08..=1.0.
    pub dbh_mean_m: f64,
}

/// The distribution of diameters at breast height: a truncated Weibull
/// (shape 2.5 to 4 in even-aged stands, 1 to 1.5 in uneven ones), its mean with the species.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandParams {
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
    pub species: String,
    /// Its size as grown.
    pub size: TreeSize,
    /// How grown up it is, or was.
    pub class: SizeClass,
    /// Is it alive?
    pub alive: bool,
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

/// All prototypes and materials of a world.
#[derive(Clone, Debug)]
pub struct Library {
    /// The materials that all prototypes refer to.
    pub materials: MaterialLibrary,
    /// Living trees, species by species, thin ones first.
    pub trees: Vec<TreeAsset>,
    /// Saplings, species by species, small ones first.
    pub saplings: Vec<TreeAsset>,
    /// Standing dead trees, species by species, thin ones first.
    pub snags: Vec<TreeAsset>,
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
    /// Single tree seedlings, species by species, small ones first.
    pub seedlings: Vec<PlantAsset>,
    /// Patches of fallen twigs, cones and leaves.
    pub litter: Vec<PlantAsset>,
    /// Tufts for trails: grass, trodden grass, plantain, clover.
    pub trail_tufts: Vec<PlantAsset>,
    /// Loose stones for trails.
    pub trail_stones: Vec<PlantAsset>,
    /// The ground.
    pub ground: GroundMaterials,
}

impl Default for AssetParams {
    /// The paper's Portuguese forest: maritime pine, eucalypt, English oak.
    fn default() -> Self {
        let of = |species, dbh_mean_m| StandSpecies {
            species,
            dbh_mean_m,
        };
        Self {
            species: vec![
                of(Species::maritime_pine(), 0.28),
                of(Species::eucalyptus(), 0.22),
                of(Species::english_oak(), 0.30),
            ],
            individuals_per_species: 8,
            saplings_per_species: 0,
            seedlings_per_species: 0,
            snags_per_species: 0,
            trunk_radius_m: 0.04,
            stand: StandParams::default(),
        }
    }
}

impl Default for StandParams {
    fn default() -> Self {
        Self {
            shape: 2.5,
            dbh_min_m: 0.10,
            dbh_max_m: 0.60,
        }
    }
}

impl AssetParams {
    /// Proves the parameters valid.
    ///
    /// # Errors
    /// If one is out of its range.
    pub fn check(&self) -> Result<(), ParamError> {
        if !(1..=32).contains(&self.species.len()) {
            let n = self.species.len();
            return Err(ParamError::new("species", n, "1 to 32 species"));
        }
        for (i, of) in self.species.iter().enumerate() {
            of.species.check()?;
            let name = &of.species.name;
            if self.species[..i].iter().any(|o| o.species.name == *name) {
                let field = format!("species[{i}].name");
                return Err(ParamError::new(
                    field,
                    name,
                    "another name than the others'",
                ));
            }
            let field = format!("species[{i}].dbh_mean_m");
            ParamError::check_range(field, of.dbh_mean_m, 0.08, 1.0)?;
        }
        let n = f64::from(self.individuals_per_species);
        ParamError::check_range("individuals_per_species", n, 1.0, 64.0)?;
        let n = f64::from(self.saplings_per_species);
        ParamError::check_range("saplings_per_species", n, 0.0, 64.0)?;
        let n = f64::from(self.seedlings_per_species);
        ParamError::check_range("seedlings_per_species", n, 0.0, 64.0)?;
        let n = f64::from(self.snags_per_species);
        ParamError::check_range("snags_per_species", n, 0.0, 64.0)?;
        ParamError::check_range("trunk_radius_m", self.trunk_radius_m, 0.01, 0.2)?;
        let stand = &self.stand;
        ParamError::check_range("stand.shape", stand.shape, 1.0, 6.0)?;
        ParamError::check_range("stand.dbh_min_m", stand.dbh_min_m, 0.07, 0.5)?;
        ParamError::check_range("stand.dbh_max_m", stand.dbh_max_m, stand.dbh_min_m, 1.5)
    }
}

impl Library {
    /// Grows a library, on all threads of the pool it is called in. The same key and parameters
    /// give the same bytes on any number of threads.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn grow(params: &AssetParams, key: Key) -> Result<Self, ParamError> {
        params.check()?;
        let species: Vec<Species> = params.species.iter().map(|s| s.species.clone()).collect();
        let materials = WorldMaterials::bake(&species, params.seedlings_per_species > 0, key);
        let masks = MaskCoverage::of(&materials.library);
        let grower = TreeGrower {
            params,
            materials: &materials,
            masks: &masks,
            growth: GrowthParams {
                trunk_radius_m: params.trunk_radius_m,
                ..GrowthParams::default()
            },
        };
        let trees = grower.all(TreeKind::Living, params.individuals_per_species, key)?;
        let saplings = grower.all(TreeKind::Sapling, params.saplings_per_species, key)?;
        let snags = grower.all(TreeKind::Snag, params.snags_per_species, key)?;
        let collect = |stage: Domain, count: u32, grow: &GrowOne<'_>| -> Vec<PlantAsset> {
            (0..count)
                .into_par_iter()
                .map(|i| grow(i, key.domain(stage).item(u64::from(i))))
                .collect()
        };
        let finish = |name: &str, number: u32, shape: Shape, radius_m: f32| {
            let shape = prototype(name, number, shape, &materials.library);
            asset(name, shape, radius_m)
        };
        let leafy =
            |name: &str, number: u32, shape: Shape, radius_m: f32, near: &OcclusionParams| {
                let shape = prototype(name, number, shape, &materials.library);
                asset(name, between_leaves(shape, &masks, near), radius_m)
            };
        let patch = |name: &str, number: u32, shape: Shape| {
            let radius_m = shape.reach_m();
            leafy(name, number, shape, radius_m, &OcclusionParams::LOW)
        };
        let shrubs = collect(SHRUBS, SHRUBS_PER_KIND * 3, &|i, key| {
            let kind = ShrubKind::ALL[(i / SHRUBS_PER_KIND) as usize];
            let rank = (i % SHRUBS_PER_KIND) as f32 / (SHRUBS_PER_KIND - 1) as f32;
            let shape = kind.grow(rank, &materials, &mut key.rng());
            // Crowns of shrubs may touch; their lower halves may not.
            let radius_m = 0.6 * shape.reach_m();
            leafy(kind.name(), i, shape, radius_m, &OcclusionParams::SHRUB)
        });
        let stumps = collect(STUMPS, STUMP_COUNT, &|i, key| {
            let mut rng = key.rng();
            let species = i as usize % materials.stumps.len();
            // Diameters of 0.2 to 0.6 m, in even steps so that a library has them all.
            let radius_m = 0.10 + 0.20 * (i as f32 + rng.unit_f32()) / STUMP_COUNT as f32;
            let height_m = rng.range_f32(0.14, 0.38);
            let old = rng.chance(0.6);
            let shape = stump(
                radius_m,
                height_m,
                old,
                &materials.stumps[species],
                key.item(0),
            );
            let foot = foot_radius_m(&shape);
            finish("stump", i, shape, foot)
        });
        let rocks = collect(ROCKS, ROCK_COUNT, &|i, key| {
            let mut rng = key.rng();
            // Radii of 0.15 to 1.2 m in a geometric series, smallest first.
            let step = f64::from(i) / f64::from(ROCK_COUNT - 1);
            let radius_m = (0.15 * libm::pow(8.0, step)) as f32 * rng.range_f32(0.93, 1.07);
            let plan = RockPlan {
                radius_m,
                subdivisions: if radius_m < 0.45 { 3 } else { 4 },
                sunk: rng.range_f32(0.30, 0.60),
                roughness: rng.range_f32(0.05, 0.11),
                material: materials.rock,
                tile_m: 1.0,
            };
            let shape = rock(&plan, key.item(0));
            let foot = foot_radius_m(&shape);
            finish("rock", i, shape, foot)
        });
        let trail_stones = collect(TRAIL_STONES, 16, &|i, key| {
            let mut rng = key.rng();
            let plan = RockPlan {
                radius_m: rng.range_f32(0.028, 0.072),
                subdivisions: 2,
                sunk: rng.range_f32(0.25, 0.45),
                roughness: rng.range_f32(0.03, 0.08),
                material: materials.stone,
                tile_m: 0.5,
            };
            let shape = rock(&plan, key.item(0));
            let foot = foot_radius_m(&shape);
            finish("stone", i, shape, foot)
        });
        let grass = collect(GRASS, PATCHES, &|i, key| {
            patch(
                "grass",
                i,
                undergrowth::grass(i, &materials, &mut key.rng()),
            )
        });
        let herbs = collect(HERBS, PATCHES, &|i, key| {
            patch(
                "herbs",
                i,
                undergrowth::herbs(i, &materials, &mut key.rng()),
            )
        });
        let ferns = collect(FERNS, 2 * PATCHES, &|i, key| {
            let mut rng = key.rng();
            if i % 2 == 0 {
                patch("bracken", i, undergrowth::bracken(&materials, &mut rng))
            } else {
                patch("male_fern", i, undergrowth::male_fern(&materials, &mut rng))
            }
        });
        let of_species = params.seedlings_per_species;
        let seedlings = collect(SEEDLINGS, of_species * species.len() as u32, &|i, _| {
            let (of, number) = ((i / of_species) as usize, i % of_species);
            // Each species' are its own, whatever others there are.
            let name = &species[of].name;
            let key = key.domain(SEEDLINGS).domain(Domain::new(name));
            let key = key.item(u64::from(number));
            let rank = individual_rank(number, of_species, key) as f32;
            let (leaves, materials) = (&species[of].leaves, &materials.seedlings[of]);
            let shape = seedling(rank, leaves, materials, &mut key.rng());
            patch(&format!("{name}_seedling"), number, shape)
        });
        let litter = collect(LITTER, PATCHES, &|i, key| {
            let shape = floor::litter(i, &materials, &mut key.rng());
            let radius_m = shape.reach_m();
            finish("litter", i, shape, radius_m)
        });
        let trail_tufts = collect(TRAIL_TUFTS, PATCHES, &|i, key| {
            patch(
                "trail_tufts",
                i,
                undergrowth::trail_tuft(i, &materials, &mut key.rng()),
            )
        });
        Ok(Self {
            trees,
            saplings,
            snags,
            shrubs,
            stumps,
            rocks,
            grass,
            herbs,
            ferns,
            seedlings,
            litter,
            trail_tufts,
            trail_stones,
            ground: materials.ground,
            materials: materials.library,
        })
    }
}

const TREES: Domain = Domain::new("assets.trees");
const SAPLINGS: Domain = Domain::new("assets.saplings");
const SNAGS: Domain = Domain::new("assets.snags");
const SHRUBS: Domain = Domain::new("assets.shrubs");
const STUMPS: Domain = Domain::new("assets.stumps");
const ROCKS: Domain = Domain::new("assets.rocks");
const GRASS: Domain = Domain::new("assets.grass");
const HERBS: Domain = Domain::new("assets.herbs");
const FERNS: Domain = Domain::new("assets.ferns");
const SEEDLINGS: Domain = Domain::new("assets.seedlings");
const LITTER: Domain = Domain::new("assets.litter");
const TRAIL_TUFTS: Domain = Domain::new("assets.trail_tufts");
const TRAIL_STONES: Domain = Domain::new("assets.trail_stones");

const SHRUBS_PER_KIND: u32 = 4;
const STUMP_COUNT: u32 = 9;
const ROCK_COUNT: u32 = 12;
/// Variants of each kind of patch.
const PATCHES: u32 = 16;

/// Grows the i-th of a kind from its own key.
type GrowOne<'a> = dyn Fn(u32, Key) -> PlantAsset + Sync + 'a;

fn prototype(name: &str, number: u32, shape: Shape, library: &MaterialLibrary) -> Prototype {
    Prototype::new(format!("{name}.{number}"), shape.mesh, shape.cards, library)
        .expect("shapes are made of finite points and of this library's materials")
}

/// The same shape, dark between its leaves.
fn between_leaves(shape: Prototype, masks: &MaskCoverage, near: &OcclusionParams) -> Prototype {
    let occlusion = ambient_occlusion::bake(&shape, masks, near);
    (shape.with_ambient_occlusion(occlusion))
        .expect("one share of each vertex and corner, and no ground")
}

fn asset(name: &str, prototype: Prototype, radius_m: f32) -> PlantAsset {
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

#[derive(Clone, Copy)]
enum TreeKind {
    Living,
    Sapling,
    Snag,
}

struct TreeGrower<'a> {
    params: &'a AssetParams,
    materials: &'a WorldMaterials,
    masks: &'a MaskCoverage,
    growth: GrowthParams,
}

impl TreeGrower<'_> {
    /// So many of each species: species in turn, individuals in turn; each has its own key.
    fn all(&self, kind: TreeKind, of: u32, key: Key) -> Result<Vec<TreeAsset>, ParamError> {
        let key = key.domain(match kind {
            TreeKind::Living => TREES,
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
        } = &self.params.species[index];
        let stand = &self.params.stand;
        let limits = [stand.dbh_min_m, stand.dbh_max_m];
        let (size, part) = if let TreeKind::Sapling = kind {
            let height_m = 2.0 + 2.5 * individual_rank(number, of, key);
            (species.draw_sapling(height_m, key.item(1)), "sapling.")
        } else {
            let number = [number, of];
            let dbh_m = species.dbh_of_individual(*dbh_mean_m, stand.shape, limits, number, of_all);
            (species.draw_size(dbh_m, key.item(1)), "")
        };
        let (grow, part): (Grow, _) = match kind {
            TreeKind::Snag => (grow_snag, "snag."),
            _ => (grow, part),
        };
        let materials = &self.materials.trees[index];
        let tree = grow(species, &size, materials, &self.growth, key.item(2))?;
        let name = format!("{}.{part}{number}", species.name);
        let prototype = Prototype::new(name, tree.mesh, tree.cards, &self.materials.library)
            .expect("trees are made of finite points and of this library's materials");
        let prototype = between_leaves(prototype, self.masks, &OcclusionParams::TREE);
        Ok(TreeAsset {
            prototype: Arc::new(prototype),
            species: species.name.clone(),
            class: species.size_class(tree.size.dbh_m),
            size: tree.size,
            alive: tree.alive,
            stem_volume_m3: tree.stem_volume_m3,
            radius_m: tree.foot_radius_m,
        })
    }
}

/// [`grow`] or [`grow_snag`].
type Grow =
    fn(&Species, &TreeSize, &TreeMaterials, &GrowthParams, Key) -> Result<GrownTree, ParamError>;
