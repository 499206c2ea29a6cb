//! What is grown once for a world, with a ray-casting tree for each shape.

use std::sync::Arc;

use nemoral_assets::{
    AssetParams, Library, PlantAsset, SizeClass, Species, StandParams, StandSpecies, TreeAsset,
};
use nemoral_raycast::Blas;
use nemoral_scene::Prototype;
use nemoral_scene::glam::Vec3;
use nemoral_seed::Key;
use rayon::prelude::*;

use super::looks::Looks;
use crate::config::{self, Config};
use crate::plan::{Encode, Encoder, Forest, Hasher, Kept, OfWorld, Stage};
use crate::{Error, InputFiles};

/// The library and, in the same order, each shape's ray-casting tree.
#[derive(Debug)]
pub struct WorldAssets {
    /// Everything that was grown.
    pub library: Arc<Library>,
    /// What stands as a tree: living ones, then dead ones, then saplings.
    pub standing: Vec<Standing>,
    /// From here on, `standing` has saplings: a layer of their own, whose weights are among themselves.
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
    /// How often each of them is chosen, relative to the others.
    pub seedling_weights: Vec<f64>,
    /// Of `library.litter`.
    pub litter: Vec<Arc<Blas>>,
    /// Of `library.trail_tufts`.
    pub trail_tufts: Vec<Arc<Blas>>,
    /// Of `library.trail_stones`.
    pub trail_stones: Vec<Arc<Blas>>,
    /// How copies of trees are turned and sized.
    pub(super) looks: Looks,
}

/// A tree that can be placed.
#[derive(Clone, Debug)]
pub struct Standing {
    /// The tree.
    pub tree: TreeAsset,
    /// Its ray-casting tree.
    pub blas: Arc<Blas>,
    /// How often it is chosen, relative to the others.
    pub weight: f64,
}

impl WorldAssets {
    /// How high trees are, by how often each is chosen, metres; saplings apart.
    #[must_use]
    pub fn mean_height_m(&self) -> f64 {
        let grown = self.standing[..self.first_sapling].iter();
        let (sum, weight) = grown.fold((0.0, 0.0), |(sum, weight), t| {
            (sum + t.weight * t.tree.size.height_m, weight + t.weight)
        });
        if weight > 0.0 { sum / weight } else { 0.0 }
    }
}

/// Grows the library.
#[derive(Clone, Debug)]
pub struct LibraryStage(Recipe);

/// Makes the [`WorldAssets`] of a library.
#[derive(Clone, Debug)]
pub struct AssetStage(Recipe);

/// What is to be grown.
#[derive(Clone, Debug)]
pub(super) struct Recipe {
    assets: config::Assets,
    saplings: bool,
    seedlings: bool,
    inputs: InputFiles,
}

impl Encode for Recipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            assets,
            saplings,
            seedlings,
            inputs: _,
        } = self;
        let config::Assets {
            individuals,
            trunk_radius_m,
            dbh_mean_m,
            dbh_shape,
            dbh_min_m,
            dbh_max_m,
            maritime_pine,
            eucalyptus,
            english_oak,
            scots_pine,
            norway_spruce,
            douglas_fir,
            cork_oak,
            beech,
            silver_birch,
            own_species,
            own_share,
            snags,
            // How often a shrub is placed makes no difference to how it is grown.
            gorse: _,
            heather: _,
            bramble: _,
        } = assets;
        encoder.field("individuals", individuals);
        encoder.field("trunk_radius_m", trunk_radius_m);
        encoder.field("dbh_mean_m", dbh_mean_m);
        encoder.field("dbh_shape", dbh_shape);
        encoder.field("dbh_min_m", dbh_min_m);
        encoder.field("dbh_max_m", dbh_max_m);
        encoder.field("maritime_pine", maritime_pine);
        encoder.field("eucalyptus", eucalyptus);
        encoder.field("english_oak", english_oak);
        encoder.field("scots_pine", scots_pine);
        encoder.field("norway_spruce", norway_spruce);
        encoder.field("douglas_fir", douglas_fir);
        encoder.field("cork_oak", cork_oak);
        encoder.field("beech", beech);
        encoder.field("silver_birch", silver_birch);
        encoder.field("own_species", own_species);
        encoder.field("own_share", own_share);
        encoder.field("snags", snags);
        encoder.field("saplings", saplings);
        encoder.field("seedlings", seedlings);
    }
}

/// One dead tree is grown for so many living ones.
const LIVING_PER_SNAG: u32 = 4;

/// So many seedlings are grown of each species.
const SEEDLINGS: u32 = 8;

/// One sapling is grown for so many living trees.
const LIVING_PER_SAPLING: u32 = 2;

impl Recipe {
    pub(super) fn new(config: &Config, inputs: &InputFiles) -> Self {
        Self {
            assets: config.assets.clone(),
            saplings: config.placement.regeneration.saplings > 0.0,
            seedlings: config.placement.regeneration.seedlings > 0.0,
            inputs: inputs.clone(),
        }
    }

    pub(super) fn fingerprint(&self, hasher: &mut Hasher) {
        self.inputs.encode(hasher, self);
    }

    /// The species with a share, and their shares.
    fn species(&self) -> Result<Vec<(Species, f64)>, Error> {
        let own = || {
            let file = self.inputs.get(&self.assets.own_species);
            let (text, path) = match file {
                Some(file) => (file.text()?, file.path().display().to_string()),
                None => ("", "assets.own_species".to_owned()),
            };
            Species::from_toml(text, &path).map_err(Error::of_stage)
        };
        let wanted = self.assets.shares().into_iter().filter(|(_, s)| *s > 0.0);
        let species = wanted.map(|(name, share)| {
            let species = match name.and_then(Species::built_in) {
                Some(species) => species,
                None => own()?,
            };
            Ok((species, share))
        });
        species.collect()
    }

    /// Share of the light on leaves that leaves their shoot again, linear sRGB: the mean over all leaf
    /// area, as the species' shares and their leaf area at the stand's mean diameter have it.
    pub(super) fn foliage_albedo(&self) -> Result<Vec3, Error> {
        let named = self.species()?;
        let share = |name: &str| {
            named
                .iter()
                .find(|(s, _)| s.name == name)
                .map_or(1.0, |n| n.1)
        };
        let (mut sum, mut total) = (Vec3::ZERO, 0.0);
        for StandSpecies {
            species,
            dbh_mean_m,
        } in self.params(&named).species
        {
            let area = (share(&species.name) * species.mean_leaf_area_m2(dbh_mean_m)) as f32;
            sum += area * species.shoot().scattering();
            total += area;
        }
        Ok(sum / total)
    }

    fn params(&self, species: &[(Species, f64)]) -> AssetParams {
        let a = &self.assets;
        let mut params = AssetParams {
            individuals_per_species: a.individuals,
            snags_per_species: if a.snags > 0.0 {
                a.individuals.div_ceil(LIVING_PER_SNAG)
            } else {
                0
            },
            saplings_per_species: if self.saplings {
                a.individuals.div_ceil(LIVING_PER_SAPLING)
            } else {
                0
            },
            seedlings_per_species: if self.seedlings { SEEDLINGS } else { 0 },
            trunk_radius_m: a.trunk_radius_m,
            stand: StandParams {
                shape: a.dbh_shape,
                dbh_min_m: a.dbh_min_m,
                dbh_max_m: a.dbh_max_m,
            },
            ..AssetParams::default()
        };
        if !species.is_empty() {
            let of = |(species, _): &(Species, f64)| StandSpecies {
                species: species.clone(),
                dbh_mean_m: a.dbh_mean_m,
            };
            params.species = species.iter().map(of).collect();
        }
        params
    }
}

impl LibraryStage {
    /// The stage of a config and the files that it names.
    #[must_use]
    pub fn new(config: &Config, inputs: &InputFiles) -> Self {
        Self(Recipe::new(config, inputs))
    }
}

impl Stage<Forest> for LibraryStage {
    type At = ();
    type Inputs = ();
    type Output = Library;
    const ID: &'static str = "world.library";
    const VERSION: u32 = 8;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(&self, (): (), world: Key, (): ()) -> Result<Library, Error> {
        let species = self.0.species()?;
        Library::grow(&self.0.params(&species), world).map_err(Error::of_stage)
    }

    fn kept() -> Option<Kept<Library>> {
        Some(Kept {
            to_bytes: Library::to_bytes,
            from_bytes: |bytes| Library::from_bytes(bytes).ok(),
        })
    }
}

impl AssetStage {
    /// The stage of a config and the files that it names.
    #[must_use]
    pub fn new(config: &Config, inputs: &InputFiles) -> Self {
        Self(Recipe::new(config, inputs))
    }
}

impl Stage<Forest> for AssetStage {
    type At = ();
    type Inputs = (OfWorld<Library>,);
    type Output = WorldAssets;
    const ID: &'static str = "world.assets";
    const VERSION: u32 = 4;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(&self, (): (), world: Key, (library,): (Arc<Library>,)) -> Result<WorldAssets, Error> {
        let species = self.0.species()?;
        let params = self.0.params(&species);
        let snags = self.0.assets.snags;
        // Of each species as many looks, one species after the other.
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
        Ok(WorldAssets {
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
            looks: Looks::new(world),
            library,
        })
    }
}
