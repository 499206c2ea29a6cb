//! The library that is grown once for a world.

use nemoral_assets::Library;
use nemoral_scene::MaterialLibrary;
use nemoral_seed::Key;

use crate::Error;
use crate::plan::{CacheCodec, ForestTypes, Hasher, Stage, Values, WorldEdge};
use crate::pool::in_pool;
use crate::world::assets::WorldAssets;
use crate::world::library_recipe::LibraryRecipe;
use crate::world::models::ModelRecipe;

/// Grows the library.
#[derive(Clone, Debug)]
pub struct LibraryStage(pub(crate) LibraryRecipe);

/// Makes the [`WorldAssets`] of a library and the user's models.
#[derive(Clone, Debug)]
pub struct AssetStage {
    pub(crate) recipe: LibraryRecipe,
    pub(crate) models: ModelRecipe,
}

/// Wets the materials of the [`WorldAssets`] as the weather does. Nothing that grows depends on it.
#[derive(Clone, Copy, Debug)]
pub struct MaterialStage {
    /// From 0, dry, to 1, soaked.
    pub wetness: f64,
}

impl Stage<ForestTypes> for MaterialStage {
    type At = ();
    type Inputs = (WorldEdge<WorldAssets>,);
    type Output = MaterialLibrary;
    const ID: &'static str = "world.materials";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { wetness } = self;
        hasher.write_f64(*wetness);
    }

    fn run(&self, (): (), _: Key, (assets,): Values<'_, Self>) -> Result<MaterialLibrary, Error> {
        Ok(assets.wet_materials(self.wetness))
    }
}

impl Stage<ForestTypes> for LibraryStage {
    type At = ();
    type Inputs = ();
    type Output = Library;
    const ID: &'static str = "world.library";
    const VERSION: u32 = 34;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(&self, (): (), key: Key, (): ()) -> Result<Library, Error> {
        let species = self.0.species()?;
        let mut params = self.0.params(&species);
        params.measured = self.0.measured(&species, key)?.shapes;
        in_pool(|| Library::grow(&params, key)).map_err(Error::of_stage)
    }

    fn context(&self, world: &Key) -> Key {
        self.0.key(world)
    }

    fn cache_codec() -> Option<CacheCodec<Library>> {
        Some(CacheCodec {
            write: |library, out| library.write(out),
            from_bytes: |bytes| Library::from_bytes(bytes).ok(),
        })
    }
}

impl Stage<ForestTypes> for AssetStage {
    type At = ();
    type Inputs = (WorldEdge<Library>,);
    type Output = WorldAssets;
    const ID: &'static str = "world.assets";
    const VERSION: u32 = 23;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.recipe.fingerprint(hasher);
        hasher.write_u64(u64::from(self.recipe.has_water()));
        for amount in self.recipe.snow() {
            hasher.write_f64(amount);
        }
        self.models.fingerprint(hasher);
    }

    fn run(&self, (): (), key: Key, (library,): Values<'_, Self>) -> Result<WorldAssets, Error> {
        in_pool(|| WorldAssets::new(library, &self.recipe, &self.models, key))
    }

    /// Worlds that share a library share what is made of it.
    fn context(&self, world: &Key) -> Key {
        self.recipe.key(world)
    }
}
