//! The plants of a world, with an acceleration structure for each shape.

use std::sync::Arc;

use nemoral_assets::{Library, LogAsset, PlantAsset, SizeClass, TreeAsset};
use nemoral_raycast::Blas;
use nemoral_scene::{
    ChunkCoord, DeadwoodRecord, InstancePlace, ObjectKind, ObjectRecord, Prototype, TreeRecord,
};
use nemoral_seed::Key;
use nemoral_stand::{InstanceVariation, SceneObject};
use rayon::prelude::*;

use super::recipe::Recipe;
use crate::Error;

/// The library and, in the same order, each shape's acceleration structure.
#[derive(Debug)]
pub struct WorldAssets {
    /// Everything that was grown.
    pub library: Arc<Library>,
    /// The standing trees: living ones, then dead ones, then saplings.
    pub standing: Vec<Standing>,
    /// The index in `standing` of the first sapling. Saplings are a layer of their own, and their
    /// weights are relative to each other.
    pub first_sapling: usize,
    /// Of `library.stumps`.
    pub stumps: Vec<Arc<Blas>>,
    /// Of `library.shrubs`.
    pub shrubs: Vec<Arc<Blas>>,
    /// Of `library.rocks`.
    pub rocks: Vec<Arc<Blas>>,
    /// Of `library.grass`.
    pub grass: Vec<Arc<Blas>>,
    /// Of `library.herbs`.
    pub herbs: Vec<Arc<Blas>>,
    /// Of `library.ferns`.
    pub ferns: Vec<Arc<Blas>>,
    /// Of `library.seedlings`.
    pub seedlings: Vec<Arc<Blas>>,
    /// How often each of the seedlings is chosen, relative to the others.
    pub seedling_weights: Vec<f64>,
    /// Of `library.litter`.
    pub litter: Vec<Arc<Blas>>,
    /// Of `library.trail_tufts`.
    pub trail_tufts: Vec<Arc<Blas>>,
    /// Of `library.trail_stones`.
    pub trail_stones: Vec<Arc<Blas>>,
    /// Of `library.deadwood.logs`, then of its `thrown` stems.
    pub logs: Vec<Arc<Blas>>,
    /// Of `library.deadwood.root_plates`.
    pub root_plates: Vec<Arc<Blas>>,
    /// Of `library.deadwood.branches`.
    pub branches: Vec<Arc<Blas>>,
    /// Of `library.deadwood.brash`.
    pub brash: Vec<Arc<Blas>>,
    /// Of `library.climbers`: ivy and moss of each grown tree of `standing`; empty if nothing
    /// climbs.
    pub climbers: Vec<[Vec<Arc<Blas>>; 2]>,
    /// Of `library.communities`: wide tiles and narrow ones.
    pub communities: Vec<[Vec<Arc<Blas>>; 2]>,
    /// Of `library.climbers.carpets`.
    pub ivy_carpets: Vec<Arc<Blas>>,
    /// The species and their shares.
    pub shares: Vec<(String, f64)>,
    /// Mean diameter of the stand's trees at breast height, metres.
    pub dbh_mean_m: f64,
    /// The turns and sizes of copies of trees.
    pub variation: InstanceVariation,
}

/// A tree that can be placed.
#[derive(Clone, Debug)]
pub struct Standing {
    /// The tree.
    pub tree: TreeAsset,
    /// Its acceleration structure.
    pub blas: Arc<Blas>,
    /// How often it is chosen, relative to the others.
    pub weight: f64,
}

impl WorldAssets {
    /// The library of a recipe, prepared for ray casting.
    pub(crate) fn new(library: Arc<Library>, recipe: &Recipe, world: Key) -> Result<Self, Error> {
        let species = recipe.species()?;
        let params = recipe.params(&species);
        let snags = recipe.snag_share();
        // There are as many shapes of each species, one species after the other.
        let of_species = params.seedlings_per_species as usize;
        let seedling_weights = species
            .iter()
            .flat_map(|(_, share)| std::iter::repeat_n(*share, of_species))
            .collect();
        let standing = |tree: &TreeAsset| {
            let of = species.iter().find(|(s, _)| s.name == tree.species);
            let (all, of_them) = if tree.class == SizeClass::Sapling {
                (1.0, params.saplings_per_species)
            } else if tree.alive {
                (1.0 - snags, params.individuals_per_species)
            } else {
                (snags, params.snags_per_species)
            };
            Standing {
                tree: tree.clone(),
                blas: Arc::new(Blas::build(Arc::clone(&tree.prototype), &library.materials)),
                weight: of.map_or(0.0, |(_, share)| share * all / f64::from(of_them)),
            }
        };
        let trees = library.trees.par_iter().chain(&library.snags);
        let standing = trees.chain(&library.saplings).map(standing).collect();
        let first_sapling = library.trees.len() + library.snags.len();
        let build = |prototypes: Vec<&Arc<Prototype>>| -> Vec<Arc<Blas>> {
            prototypes
                .into_par_iter()
                .map(|p| Arc::new(Blas::build(Arc::clone(p), &library.materials)))
                .collect()
        };
        let plants = |assets: &[PlantAsset]| build(assets.iter().map(|a| &a.prototype).collect());
        Ok(Self {
            standing,
            first_sapling,
            stumps: plants(&library.stumps),
            shrubs: plants(&library.shrubs),
            rocks: plants(&library.rocks),
            grass: plants(&library.grass),
            herbs: plants(&library.herbs),
            ferns: plants(&library.ferns),
            seedlings: plants(&library.seedlings),
            seedling_weights,
            litter: plants(&library.litter),
            trail_tufts: plants(&library.trail_tufts),
            trail_stones: plants(&library.trail_stones),
            logs: build(logs(&library).map(|log| &log.prototype).collect()),
            root_plates: plants(&library.deadwood.root_plates),
            branches: plants(&library.deadwood.branches),
            brash: plants(&library.deadwood.brash),
            climbers: {
                let of = &library.climbers;
                let trees = of.trees.iter().chain(&of.snags);
                let shapes = |shapes: &[Arc<Prototype>]| build(shapes.iter().collect());
                trees.map(|t| [shapes(&t.ivy), shapes(&t.moss)]).collect()
            },
            communities: (library.communities.iter())
                .map(|tiles| [plants(&tiles.wide), plants(&tiles.narrow)])
                .collect(),
            ivy_carpets: plants(&library.climbers.carpets),
            shares: species.iter().map(|(s, n)| (s.name.clone(), *n)).collect(),
            dbh_mean_m: recipe.dbh_mean_m(),
            variation: InstanceVariation::new(world),
            library,
        })
    }

    /// Mean height of trees without saplings, weighted by how often each is chosen, metres.
    #[must_use]
    pub fn mean_height_m(&self) -> f64 {
        let grown = self.standing[..self.first_sapling].iter();
        let (sum, weight) = grown.fold((0.0, 0.0), |(sum, weight), t| {
            (sum + t.weight * t.tree.size.height_m, weight + t.weight)
        });
        if weight > 0.0 { sum / weight } else { 0.0 }
    }

    /// An object's shape with its acceleration structure.
    #[must_use]
    pub fn shape(&self, object: &SceneObject) -> &Arc<Blas> {
        match object.kind {
            ObjectKind::Tree => &self.standing[object.asset].blas,
            ObjectKind::Stump => &self.stumps[object.asset],
            ObjectKind::Shrub => &self.shrubs[object.asset],
            ObjectKind::Log => &self.logs[object.asset],
            ObjectKind::RootPlate => &self.root_plates[object.asset],
            _ if object.on_trail => &self.trail_stones[object.asset],
            _ => &self.rocks[object.asset],
        }
    }

    /// An object placed in its chunk, with its acceleration structure.
    pub(crate) fn instance(
        &self,
        object: &SceneObject,
        chunk: ChunkCoord,
        chunk_size_m: f64,
    ) -> (InstancePlace, Arc<Blas>) {
        let shape = self.shape(object);
        (object.place(chunk, chunk_size_m), Arc::clone(shape))
    }

    /// An object's row of `instances.csv`.
    #[must_use]
    pub fn object_record(&self, object: &SceneObject) -> ObjectRecord {
        let library = &self.library;
        let plant = |plants: &[PlantAsset]| {
            (
                plants[object.asset].name.clone(),
                plants[object.asset].height_m,
            )
        };
        let (species, height_m) = match object.kind {
            ObjectKind::Tree => {
                let tree = &self.standing[object.asset].tree;
                (tree.species.clone(), tree.size.height_m)
            }
            ObjectKind::Stump => plant(&library.stumps),
            ObjectKind::Shrub => plant(&library.shrubs),
            ObjectKind::Log => {
                let log = self.log(object);
                (log.species.clone(), log.half_height_m[0] * 2.0)
            }
            ObjectKind::RootPlate => {
                let log = &library.deadwood.thrown[object.asset];
                (log.species.clone(), plant(&library.deadwood.root_plates).1)
            }
            _ if object.on_trail => plant(&library.trail_stones),
            _ => plant(&library.rocks),
        };
        ObjectRecord {
            object: object.object,
            kind: object.kind,
            species,
            position_m: object.position_m,
            radius_m: object.radius_m,
            height_m: height_m * object.scale,
        }
    }

    /// The share of a species among the trees.
    pub(crate) fn share_of(&self, species: &str) -> f64 {
        let found = self.shares.iter().find(|(name, _)| name == species);
        found.map_or(0.0, |(_, share)| *share)
    }

    /// The asset of a log.
    fn log(&self, object: &SceneObject) -> &LogAsset {
        let of = &self.library.deadwood;
        let thrown = object.asset.checked_sub(of.logs.len());
        thrown.map_or_else(|| &of.logs[object.asset], |i| &of.thrown[i])
    }

    /// An object's row of `deadwood.csv`, if it is a log or a root plate.
    #[must_use]
    pub fn deadwood_record(&self, object: &SceneObject) -> Option<DeadwoodRecord> {
        let of = &self.library.deadwood;
        let linear = object.linear.as_dmat3();
        let (along, across) = (linear.x_axis.length(), linear.z_axis.length());
        let azimuth = libm::atan2(linear.x_axis.x, linear.x_axis.y).to_degrees();
        let (log, is_thrown) = match object.kind {
            ObjectKind::Log => (self.log(object), object.asset >= of.logs.len()),
            ObjectKind::RootPlate => (&of.thrown[object.asset], true),
            _ => return None,
        };
        let is_log = object.kind == ObjectKind::Log;
        let (length_m, diameter_m) = if is_log {
            (log.length_m * along, log.diameter_m.map(|d| d * across))
        } else {
            let plate = &of.root_plates[object.asset];
            let bounds = plate.prototype.bounds();
            let thick = f64::from(bounds.max.x - bounds.min.x);
            (thick * along, [2.0 * plate.radius_m * across; 2])
        };
        Some(DeadwoodRecord {
            object: object.object,
            kind: object.kind,
            species: log.species.clone(),
            position_m: object.position_m,
            azimuth_deg: azimuth.rem_euclid(360.0),
            length_m,
            diameter_m,
            decay: log.stage,
            volume_m3: if is_log {
                log.volume_m3 * along * across * across
            } else {
                0.0
            },
            is_thrown,
        })
    }

    /// An object's row of `trees.csv`, if it is a tree.
    #[must_use]
    pub fn tree_record(&self, object: &SceneObject) -> Option<TreeRecord> {
        if object.kind != ObjectKind::Tree {
            return None;
        }
        let tree = &self.standing[object.asset].tree;
        let s = object.scale;
        let size = tree.size.scaled(s);
        Some(TreeRecord {
            object: object.object,
            species: tree.species.clone(),
            position_m: object.position_m,
            dbh_m: size.dbh_m,
            height_m: size.height_m,
            crown_base_m: size.crown_base_m,
            crown_radius_m: size.crown_radius_m,
            leaf_area_m2: size.leaf_area_m2,
            stem_volume_m3: tree.stem_volume_m3 * s * s * s,
            lean_rad: size.lean_rad,
            age_class: tree.class.name().to_owned(),
            alive: tree.alive,
        })
    }
}

/// The logs of a library in the order of [`WorldAssets::logs`].
fn logs(library: &Library) -> impl Iterator<Item = &LogAsset> {
    (library.deadwood.logs.iter()).chain(&library.deadwood.thrown)
}
