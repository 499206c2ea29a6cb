//! How the plants of a world are prepared for ray casting.

use std::collections::BTreeSet;
use std::sync::Arc;

use nemoral_assets::{ByKind, Library, PlantAsset, PlantKind, SizeClass, SnowParams, TreeAsset};
use nemoral_raycast::Blas;
use nemoral_scene::{MaterialId, ObjectKind, Prototype};
use nemoral_seed::{Domain, Key};
use rayon::prelude::*;

use super::measured::{copy_of, objects_of};
use super::{ClimberShapes, LyingSnow, StandingTree, WorldAssets};
use crate::Error;
use crate::world::library_recipe::LibraryRecipe;
use crate::world::models::ModelRecipe;
use crate::world::snow::share_under_crowns;
use crate::world::water::WaterMaterials;

const SNOW: Domain = Domain::new("pipeline.snow");

impl WorldAssets {
    /// The library of a recipe, which grew from this key, with the models of another, prepared for
    /// ray casting.
    pub(crate) fn new(
        library: Arc<Library>,
        recipe: &LibraryRecipe,
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
        let species = recipe.species()?;
        let params = recipe.params(&species);
        let snow = (depth_m > 0.0).then(|| {
            let snow_params = SnowParams {
                depth_m,
                on_crowns,
                beds,
                textures: recipe.has_textures(),
            };
            LyingSnow {
                materials: Arc::make_mut(&mut library).add_snow(&snow_params, key.domain(SNOW)),
                depth_m,
                under_crowns: share_under_crowns(&params),
            }
        });
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
            StandingTree {
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
        let mut standing: Vec<StandingTree> = (all.par_iter().zip(&without_snow))
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
        let of_plants =
            |plants: &[PlantAsset]| build(plants.iter().map(|plant| &plant.prototype).collect());
        let plants = ByKind::new(|kind| of_plants(&library.plants[kind]));
        let shrubs = &plants[PlantKind::Shrub];
        let shrubs_in_full_leaf: Vec<_> = (shrubs.par_iter())
            .map(|blas| in_full_leaf(blas, blas.prototype()))
            .collect();
        let trees = standing.iter().map(|tree| (&tree.blas, &tree.in_full_leaf));
        let mut leafy = trees.chain(shrubs.iter().zip(&shrubs_in_full_leaf));
        let is_leafless = leafy.any(|(now, full)| !Arc::ptr_eq(now, full));
        let logs = library.deadwood.logs.iter().chain(&library.deadwood.thrown);
        Ok(Self {
            is_leafless,
            shrubs_in_full_leaf,
            standing,
            with_edge_trees: params.edge_trees.then_some(of_stand[0]),
            first_sapling,
            plants,
            seedling_weights,
            shed: (library.shed.iter())
                .map(|of| [of_plants(&of.wide), of_plants(&of.narrow)])
                .collect(),
            logs: build(logs.map(|log| &log.prototype).collect()),
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
                .map(|tiles| [of_plants(&tiles.wide), of_plants(&tiles.narrow)])
                .collect(),
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
}
