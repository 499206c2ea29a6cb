//! The plants of a world, with an acceleration structure for each shape.

use std::collections::BTreeSet;
use std::sync::Arc;

use nemoral_assets::{
    Library, LogAsset, PlantAsset, SizeClass, SnowMaterials, SnowParams, TreeAsset, WoodVolume,
};
use nemoral_raycast::Blas;
use nemoral_scene::{
    ChunkCoord, DeadwoodRecord, InstancePlace, MaterialId, MaterialLibrary, ObjectKind,
    ObjectRecord, Prototype, TreeRecord,
};
use nemoral_seed::{Domain, Key};
use nemoral_stand::{MeasuredSize, SceneObject};
use rayon::prelude::*;

use super::models::{ModelRecipe, WorldModels};
use super::recipe::Recipe;
use super::water::WaterMaterials;
use crate::Error;
use crate::site::{MeasuredStem, MeasuredStems, ModelStem};

const SNOW: Domain = Domain::new("pipeline.snow");

/// Snow that lies.
#[derive(Clone, Debug)]
pub struct LyingSnow {
    pub(crate) materials: SnowMaterials,
    /// Its depth on level ground in the open, metres.
    pub(crate) depth_m: f64,
    /// The share of that depth that lies under crowns.
    pub(crate) under_crowns: f64,
}

/// The library and, in the same order, each shape's acceleration structure.
#[derive(Debug)]
pub struct WorldAssets {
    /// Everything that was grown.
    pub library: Arc<Library>,
    /// The standing trees: living ones, then dead ones, then saplings.
    pub standing: Vec<Standing>,
    /// How many of `standing`, from the first on, are followed by as many that are the same trees
    /// grown at the wood's edge; `None` if none grew there.
    pub(crate) with_edge_trees: Option<usize>,
    /// The index in `standing` of the first sapling. Saplings are a layer of their own, and their
    /// weights are relative to each other.
    pub first_sapling: usize,
    /// Of `library.stumps`.
    pub stumps: Vec<Arc<Blas>>,
    /// Of `library.shrubs`.
    pub shrubs: Vec<Arc<Blas>>,
    /// The same in full leaf.
    shrubs_in_full_leaf: Vec<Arc<Blas>>,
    /// Whether the season has taken leaves of trees or shrubs away.
    is_leafless: bool,
    /// Of `library.rocks`, then of `library.stream_stones.rocks`.
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
    /// Of `library.shed`: wide patches and narrow ones.
    pub shed: Vec<[Vec<Arc<Blas>>; 2]>,
    /// Of `library.trail_tufts`.
    pub trail_tufts: Vec<Arc<Blas>>,
    /// Of `library.strip_mats`.
    pub strip_mats: Vec<Arc<Blas>>,
    /// Of `library.trail_stones`.
    pub trail_stones: Vec<Arc<Blas>>,
    /// Of `library.trail_roots`.
    pub trail_roots: Vec<Arc<Blas>>,
    /// Of `library.culverts`.
    pub culverts: Vec<Arc<Blas>>,
    /// Of `library.trail_steps`.
    pub trail_steps: Vec<Arc<Blas>>,
    /// Of `library.surface_roots`.
    pub surface_roots: Vec<Arc<Blas>>,
    /// Of `library.banks`.
    pub banks: Vec<Arc<Blas>>,
    /// Of `library.stone_beds`.
    pub stone_beds: Vec<Arc<Blas>>,
    /// Of `library.stream_stones.stones`.
    pub wet_stones: Vec<Arc<Blas>>,
    /// Of `library.stream_stones.beds`.
    pub wet_beds: Vec<Arc<Blas>>,
    /// Of `library.deadwood.logs`, then of its `thrown` stems.
    pub logs: Vec<Arc<Blas>>,
    /// Of `library.deadwood.root_plates`.
    pub root_plates: Vec<Arc<Blas>>,
    /// Of `library.deadwood.branches`.
    pub branches: Vec<Arc<Blas>>,
    /// Of `library.deadwood.brash`.
    pub brash: Vec<Arc<Blas>>,
    /// Of `library.climbers`: what may grow on each grown tree of `standing`; empty if nothing
    /// climbs.
    pub climbers: Vec<ClimberShapes>,
    /// Of `library.communities`: wide tiles and narrow ones.
    pub communities: Vec<[Vec<Arc<Blas>>; 2]>,
    /// Of `library.climbers.carpets`.
    pub ivy_carpets: Vec<Arc<Blas>>,
    /// The species and their shares.
    pub shares: Vec<(String, f64)>,
    /// Of each of them the silhouette that its leaves or shoots are drawn with, over their
    /// one-sided leaf area.
    pub(crate) silhouette_factors: Vec<f64>,
    /// Mean diameter of the stand's trees at breast height, metres.
    pub dbh_mean_m: f64,
    /// The trees of the stem map, in its order.
    pub(crate) measured: Vec<MeasuredObject>,
    /// What the stem map calls each of them.
    field_ids: Vec<String>,
    /// The user's models among all these.
    pub(crate) models: WorldModels,
    /// The materials of waters and their beds, if there are any.
    pub water: Option<WaterMaterials>,
    /// The materials of lying snow, if any lies.
    pub(crate) snow: Option<LyingSnow>,
}

/// A tree of a stem map as an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeasuredObject {
    /// Its shape in [`WorldAssets::standing`].
    pub(crate) asset: usize,
    pub(crate) size: MeasuredSize,
    /// The radius of its foot, metres.
    pub(crate) radius_m: f64,
}

/// The shapes of a tree's `TreeClimbers`.
#[derive(Clone, Debug)]
pub struct ClimberShapes {
    /// Ivy that climbs a third of the stem, and ivy that climbs into the crown.
    pub ivy: Vec<Arc<Blas>>,
    /// Moss by the side where it is densest.
    pub moss: Vec<Arc<Blas>>,
    /// Honeysuckle that winds up the stem.
    pub honeysuckle: Option<Arc<Blas>>,
    /// Clematis that hangs from the crown.
    pub clematis: Option<Arc<Blas>>,
    /// Runs of resin on the bark.
    pub resin: Option<Arc<Blas>>,
}

/// A tree that can be placed.
#[derive(Clone, Debug)]
pub struct Standing {
    /// The tree.
    pub tree: TreeAsset,
    /// Its acceleration structure.
    pub blas: Arc<Blas>,
    /// The same in full leaf.
    in_full_leaf: Arc<Blas>,
    /// How often it is chosen, relative to the others.
    pub weight: f64,
}

impl WorldAssets {
    /// The library of a recipe, which grew from this key, with the models of another, prepared for
    /// ray casting.
    pub(crate) fn new(
        library: Arc<Library>,
        recipe: &Recipe,
        models: &ModelRecipe,
        key: Key,
    ) -> Result<Self, Error> {
        let (mut library, models) = models.add_to(library)?;
        let water = recipe
            .has_water()
            .then(|| WaterMaterials::add_to(Arc::make_mut(&mut library)));
        let beds = water.as_ref().map(|of| [of.gravel, of.mud]);
        let beds = beds.as_ref().map_or(&[][..], |beds| beds);
        // What grows below grew without snow on what is above.
        let without_snow: Vec<Arc<Prototype>> = (library.trees.iter())
            .chain(&library.snags)
            .chain(&library.saplings)
            .map(|tree| Arc::clone(&tree.prototype))
            .collect();
        let [depth_m, on_crowns] = recipe.snow();
        let under_crowns = recipe.snow_under_crowns()?;
        let snow = (depth_m > 0.0).then(|| {
            let params = SnowParams {
                depth_m,
                on_crowns,
                beds,
                textures: recipe.has_textures(),
            };
            LyingSnow {
                materials: Arc::make_mut(&mut library).add_snow(&params, key.domain(SNOW)),
                depth_m,
                under_crowns,
            }
        });
        let species = recipe.species()?;
        let params = recipe.params(&species);
        let snags = recipe.snag_share();
        let mut stems = recipe.measured(&species, key)?;
        let field_ids = std::mem::take(&mut stems.ids);
        // The trees and snags of the stand come before those of its edge and of the stem map.
        let of_stand = [params.individuals_per_species, params.snags_per_species]
            .map(|of_species| of_species as usize * params.species.len());
        // There are as many shapes of each species, one species after the other.
        let of_species = params.seedlings_per_species as usize;
        let seedling_weights = species
            .iter()
            .flat_map(|(_, share)| std::iter::repeat_n(*share, of_species))
            .collect();
        let full_leaf = library.materials_in_full_leaf();
        let has_lost_leaves: BTreeSet<MaterialId> =
            library.full_leaf_masks.iter().map(|(id, _)| *id).collect();
        let in_full_leaf = |blas: &Arc<Blas>, bare: &Arc<Prototype>| {
            let mut cards = bare.cards().iter();
            let has_lost = cards.any(|card| has_lost_leaves.contains(&card.material));
            if !has_lost && Arc::ptr_eq(blas.prototype(), bare) {
                return Arc::clone(blas);
            }
            let materials = full_leaf.as_ref().unwrap_or(&library.materials);
            Arc::new(Blas::build(Arc::clone(bare), materials))
        };
        let standing = |(tree, is_measured): (&TreeAsset, bool), bare: &Arc<Prototype>| {
            let of = species.iter().find(|(s, _)| s.name == tree.species);
            let (all, of_them) = if tree.class == SizeClass::Sapling {
                (1.0, params.saplings_per_species)
            } else if tree.alive {
                (1.0 - snags, params.individuals_per_species)
            } else {
                (snags, params.snags_per_species)
            };
            let blas = Arc::new(Blas::build(Arc::clone(&tree.prototype), &library.materials));
            Standing {
                tree: tree.clone(),
                in_full_leaf: in_full_leaf(&blas, bare),
                blas,
                weight: of
                    .filter(|_| !is_measured)
                    .map_or(0.0, |(_, share)| share * all / f64::from(of_them)),
            }
        };
        let grown = |trees: &'_ [TreeAsset], of_stand: usize| {
            let trees = trees.iter().enumerate();
            trees
                .map(|(i, tree)| (tree.clone(), i >= of_stand))
                .collect::<Vec<_>>()
        };
        let mut all = grown(&library.trees, of_stand[0]);
        all.extend(grown(&library.snags, of_stand[1]));
        all.extend(grown(&library.saplings, usize::MAX));
        let mut standing: Vec<Standing> = (all.par_iter().zip(&without_snow))
            .map(|((tree, is_measured), bare)| standing((tree, *is_measured), bare))
            .collect();
        let first_sapling = library.trees.len() + library.snags.len();
        let grown = &mut standing[..first_sapling];
        let mut weights: Vec<f64> = grown.iter().map(|tree| tree.weight).collect();
        models.weigh(ObjectKind::Tree, &mut weights);
        for (tree, weight) in grown.iter_mut().zip(weights) {
            tree.weight = weight;
        }
        let measured = {
            let edge_trees = if params.edge_trees { of_stand[0] } else { 0 };
            let first = [of_stand[0] + edge_trees, library.trees.len() + of_stand[1]];
            let mut objects = objects_of(&stems, first, &standing);
            for stem in &stems.models {
                let copy = copy_of(stem, &models, &standing).map_err(|e| recipe.of_stems(&e))?;
                objects.push(copy);
            }
            objects.sort_unstable_by_key(|object| object.size.number);
            objects
        };
        let build = |prototypes: Vec<&Arc<Prototype>>| -> Vec<Arc<Blas>> {
            prototypes
                .into_par_iter()
                .map(|p| Arc::new(Blas::build(Arc::clone(p), &library.materials)))
                .collect()
        };
        let plants = |assets: &[PlantAsset]| build(assets.iter().map(|a| &a.prototype).collect());
        let shrubs = plants(&library.shrubs);
        let shrubs_in_full_leaf: Vec<_> = (shrubs.par_iter())
            .map(|blas| in_full_leaf(blas, blas.prototype()))
            .collect();
        let trees = standing.iter().map(|tree| (&tree.blas, &tree.in_full_leaf));
        let mut leafy = trees.chain(shrubs.iter().zip(&shrubs_in_full_leaf));
        Ok(Self {
            is_leafless: leafy.any(|(now, full)| !Arc::ptr_eq(now, full)),
            shrubs_in_full_leaf,
            shrubs,
            standing,
            with_edge_trees: params.edge_trees.then_some(of_stand[0]),
            first_sapling,
            stumps: plants(&library.stumps),
            rocks: [plants(&library.rocks), plants(&library.stream_stones.rocks)].concat(),
            grass: plants(&library.grass),
            herbs: plants(&library.herbs),
            ferns: plants(&library.ferns),
            seedlings: plants(&library.seedlings),
            seedling_weights,
            litter: plants(&library.litter),
            shed: (library.shed.iter())
                .map(|of| [plants(&of.wide), plants(&of.narrow)])
                .collect(),
            trail_tufts: plants(&library.trail_tufts),
            strip_mats: plants(&library.strip_mats),
            trail_stones: plants(&library.trail_stones),
            trail_roots: plants(&library.trail_roots),
            stone_beds: plants(&library.stone_beds),
            wet_stones: plants(&library.stream_stones.stones),
            wet_beds: plants(&library.stream_stones.beds),
            culverts: plants(&library.culverts),
            trail_steps: plants(&library.trail_steps),
            surface_roots: plants(&library.surface_roots),
            banks: plants(&library.banks),
            logs: build(logs(&library).map(|log| &log.prototype).collect()),
            root_plates: plants(&library.deadwood.root_plates),
            branches: plants(&library.deadwood.branches),
            brash: plants(&library.deadwood.brash),
            climbers: {
                let of = &library.climbers;
                let trees = of.trees.par_iter().chain(&of.snags);
                let shapes = |shapes: &[Arc<Prototype>]| build(shapes.iter().collect());
                trees
                    .map(|t| ClimberShapes {
                        ivy: shapes(&t.ivy),
                        moss: shapes(&t.moss),
                        honeysuckle: shapes(t.honeysuckle.as_slice()).pop(),
                        clematis: shapes(t.clematis.as_slice()).pop(),
                        resin: shapes(t.resin.as_slice()).pop(),
                    })
                    .collect()
            },
            communities: (library.communities.iter())
                .map(|tiles| [plants(&tiles.wide), plants(&tiles.narrow)])
                .collect(),
            ivy_carpets: plants(&library.climbers.carpets),
            shares: species.iter().map(|(s, n)| (s.name.clone(), *n)).collect(),
            silhouette_factors: (species.iter())
                .map(|(s, _)| s.foliage.silhouette_factor)
                .collect(),
            dbh_mean_m: recipe.dbh_mean_m(),
            measured,
            field_ids,
            models,
            water,
            snow,
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

    /// The tree that a living tree of the stand would be at the wood's edge; `None` for others.
    pub(crate) fn at_edge(&self, asset: usize) -> Option<usize> {
        self.with_edge_trees
            .filter(|&count| asset < count)
            .map(|count| count + asset)
    }

    /// Whether a tree is one that grew up at the wood's edge.
    pub(crate) fn is_at_edge(&self, asset: usize) -> bool {
        (self.with_edge_trees).is_some_and(|count| (count..2 * count).contains(&asset))
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

    /// The materials in wet weather, from 0, dry, to 1. The beds of waters are wet in any, and snow
    /// is in none.
    pub(crate) fn wet_materials(&self, wetness: f64) -> MaterialLibrary {
        if wetness <= 0.0 {
            return self.library.materials.clone();
        }
        let beds = self.water.iter().flat_map(|of| [of.gravel, of.mud]);
        let covers = self.snow.iter().flat_map(|of| of.materials.covers());
        let but: Vec<MaterialId> = beds.chain(covers).collect();
        self.library.wet_materials(wetness, &but)
    }

    /// Whether light falls otherwise than in summer: leaves are missing, or snow lies.
    pub(crate) const fn differs_from_summer(&self) -> bool {
        self.is_leafless || self.snow.is_some()
    }

    /// An object's shape in full leaf.
    fn shape_in_full_leaf(&self, object: &SceneObject) -> &Arc<Blas> {
        match object.kind {
            ObjectKind::Tree => &self.standing[object.asset].in_full_leaf,
            ObjectKind::Shrub => &self.shrubs_in_full_leaf[object.asset],
            _ => self.shape(object),
        }
    }

    /// A rock by its number among the shapes of rocks.
    fn rock(&self, asset: usize) -> &PlantAsset {
        let (dry, wet) = (&self.library.rocks, &self.library.stream_stones.rocks);
        dry.get(asset).unwrap_or_else(|| &wet[asset - dry.len()])
    }

    /// The number of a rock as it is in a stream among the shapes of rocks; those of a user's
    /// models stay as they are.
    pub(crate) fn in_stream(&self, rock: usize) -> usize {
        let (dry, wet) = (&self.library.rocks, &self.library.stream_stones.rocks);
        if rock < wet.len() {
            dry.len() + rock
        } else {
            rock
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

    /// The same in full leaf.
    pub(crate) fn instance_in_full_leaf(
        &self,
        object: &SceneObject,
        chunk: ChunkCoord,
        chunk_size_m: f64,
    ) -> (InstancePlace, Arc<Blas>) {
        let shape = self.shape_in_full_leaf(object);
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
            _ => {
                let rock = self.rock(object.asset);
                (rock.name.clone(), rock.height_m)
            }
        };
        ObjectRecord {
            object: object.object,
            kind: object.kind,
            species,
            position_m: object.position_m,
            radius_m: object.radius_m,
            height_m: object
                .measured
                .map_or(height_m * object.scale, |m| m.height_m),
        }
    }

    /// The share of a species among the trees.
    pub(crate) fn share_of(&self, species: &str) -> f64 {
        let found = self.shares.iter().find(|(name, _)| name == species);
        found.map_or(0.0, |(_, share)| *share)
    }

    /// The number of the species of a tree among [`shares`](Self::shares); `None` for what is not
    /// a tree, and for trees of the user's models.
    pub(crate) fn species_of(&self, object: &SceneObject) -> Option<usize> {
        if object.kind != ObjectKind::Tree {
            return None;
        }
        let species = &self.standing[object.asset].tree.species;
        self.shares.iter().position(|(name, _)| name == species)
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
        let mut stretch = [s, s];
        let mut measured_m = None;
        let mut field_id = String::new();
        if let Some(measured) = object.measured {
            stretch = [measured.across, measured.along];
            measured_m = Some([measured.dbh_m, measured.height_m]);
            field_id.clone_from(&self.field_ids[measured.number as usize]);
        }
        let [across, along] = stretch;
        let size = tree.size_of_copy(stretch);
        let [dbh_m, height_m] = measured_m.unwrap_or([size.dbh_m, size.height_m]);
        let growth = across * across * along;
        let merchantable_m3 =
            |wood: &WoodVolume| growth * wood.of_at_least_m3(WoodVolume::MERCHANTABLE_M / across);
        Some(TreeRecord {
            object: object.object,
            species: tree.species.clone(),
            position_m: object.position_m,
            dbh_m,
            height_m,
            crown_base_m: size.crown_base_m,
            crown_radius_m: size.crown_radius_m,
            leaf_area_m2: size.leaf_area_m2,
            stem_volume_m3: growth * tree.stem_volume_m3,
            wood_volume_m3: tree.wood.as_ref().map(|wood| growth * wood.total_m3()),
            merchantable_volume_m3: tree.wood.as_ref().map(merchantable_m3),
            lean_rad: size.lean_rad,
            age_class: tree.class.name().to_owned(),
            alive: tree.alive,
            field_id,
        })
    }
}

/// The trees of a stem map that are grown, as objects. `first` are the places of their first living
/// and their first dead shape among the standing trees.
fn objects_of(
    measured: &MeasuredStems,
    first: [usize; 2],
    standing: &[Standing],
) -> Vec<MeasuredObject> {
    let mut next = first;
    let place = |alive: bool| usize::from(!alive);
    let assets: Vec<usize> = (measured.shapes.iter())
        .map(|shape| {
            let next = &mut next[place(shape.alive)];
            *next += 1;
            *next - 1
        })
        .collect();
    let object = |stem: &MeasuredStem| {
        let asset = assets[stem.shape];
        let tree = &standing[asset].tree;
        let along = stem.height_m / tree.size.height_m;
        // The shape's stem where the copy's breast height is.
        let across = stem.dbh_m / tree.stem.breast_diameter_m(along);
        MeasuredObject {
            asset,
            size: MeasuredSize {
                number: stem.number as u32,
                dbh_m: stem.dbh_m,
                height_m: stem.height_m,
                across,
                along,
            },
            radius_m: tree.radius_m * across,
        }
    };
    measured.stems.iter().map(object).collect()
}

/// A tree of a stem map that is a copy of a model.
fn copy_of(
    stem: &ModelStem,
    models: &WorldModels,
    standing: &[Standing],
) -> Result<MeasuredObject, String> {
    let mut trees = models.trees();
    let (name, asset) = trees.nth(stem.model).ok_or("the model is not there")?;
    let tree = &standing[asset].tree;
    let stretch = stem.stretch(name, &tree.stem, tree.size.height_m)?;
    let ([across, along], size) = (stretch, tree.size_of_copy(stretch));
    Ok(MeasuredObject {
        asset,
        size: MeasuredSize {
            number: stem.number as u32,
            dbh_m: size.dbh_m,
            height_m: size.height_m,
            across,
            along,
        },
        radius_m: tree.radius_m * across,
    })
}

/// The logs of a library in the order of [`WorldAssets::logs`].
fn logs(library: &Library) -> impl Iterator<Item = &LogAsset> {
    (library.deadwood.logs.iter()).chain(&library.deadwood.thrown)
}
