//! What is grown once for a world, with a ray-casting tree for each shape.

use std::sync::Arc;

use nemoral_assets::{AssetParams, Library, PlantAsset, StandParams};
use nemoral_raycast::Blas;
use nemoral_scene::Prototype;
use nemoral_seed::Key;
use rayon::prelude::*;

use crate::Error;
use crate::config::{self, Config};
use crate::plan::{Hasher, Stage};

/// The library and, in the same order, each shape's ray-casting tree.
#[derive(Debug)]
pub struct WorldAssets {
    /// Everything that was grown.
    pub library: Library,
    /// Of `library.trees`.
    pub trees: Vec<Arc<Blas>>,
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
    /// Of `library.litter`.
    pub litter: Vec<Arc<Blas>>,
    /// Of `library.trail_grass`.
    pub trail_grass: Vec<Arc<Blas>>,
    /// Of `library.trail_stones`.
    pub trail_stones: Vec<Arc<Blas>>,
}

/// Grows the [`WorldAssets`].
#[derive(Clone, Debug)]
pub struct AssetStage {
    assets: config::Assets,
}

impl AssetStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            assets: config.assets.clone(),
        }
    }
}

impl Stage for AssetStage {
    type At = ();
    type Inputs = ();
    type Output = WorldAssets;
    const ID: &'static str = "world.assets";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        // Species shares decide what is placed, not what is grown.
        let a = &self.assets;
        hasher.write_u64(u64::from(a.individuals));
        hasher.write_f64(a.trunk_radius_m);
        hasher.write_f64(a.dbh_mean_m);
    }

    fn run(&self, (): (), world: Key, (): ()) -> Result<WorldAssets, Error> {
        let params = AssetParams {
            individuals_per_species: self.assets.individuals,
            trunk_radius_m: self.assets.trunk_radius_m,
            stand: StandParams {
                dbh_mean_m: [self.assets.dbh_mean_m; 3],
                ..StandParams::default()
            },
        };
        let library = Library::grow(&params, world).map_err(Error::of_stage)?;
        let build = |prototypes: Vec<&Arc<Prototype>>| -> Vec<Arc<Blas>> {
            prototypes
                .into_par_iter()
                .map(|p| Arc::new(Blas::build(Arc::clone(p), &library.materials)))
                .collect()
        };
        let plants = |assets: &[PlantAsset]| build(assets.iter().map(|a| &a.prototype).collect());
        Ok(WorldAssets {
            trees: build(library.trees.iter().map(|t| &t.prototype).collect()),
            stumps: plants(&library.stumps),
            shrubs: plants(&library.shrubs),
            rocks: plants(&library.rocks),
            grass: plants(&library.grass),
            herbs: plants(&library.herbs),
            ferns: plants(&library.ferns),
            litter: plants(&library.litter),
            trail_grass: plants(&library.trail_grass),
            trail_stones: plants(&library.trail_stones),
            library,
        })
    }
}
