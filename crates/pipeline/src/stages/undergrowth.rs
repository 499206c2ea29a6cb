//! The places of low plants and of tree seedlings.

use nemoral_placement::{CoverPoint, Placement};
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::SkyViewFactor;

use crate::plan::{ForestTypes, Hasher, Node, Stage, Values, WorldEdge};
use crate::world::chunk_ground::ChunkGround;
use crate::world::flora::{Flora, FloraRecipe, seedlings};
use crate::world::patch::Patch;
use crate::{Error, InputFiles};

/// Makes the [`Flora`].
#[derive(Clone, Debug)]
pub struct FloraStage(pub(crate) FloraRecipe);

impl Stage<ForestTypes> for FloraStage {
    type At = ();
    type Inputs = ();
    type Output = Flora;
    const ID: &'static str = "world.flora";
    const VERSION: u32 = 5;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, &self.0);
    }

    fn run(&self, (): (), world: Key, (): ()) -> Result<Flora, Error> {
        Flora::new(&self.0, world)
    }
}

/// Places the undergrowth of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct UndergrowthStage;

impl Stage<ForestTypes> for UndergrowthStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<Flora>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, SkyViewFactor>,
    );
    type Output = Vec<Patch>;
    const ID: &'static str = "chunk.undergrowth";
    const VERSION: u32 = 10;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (flora, ground, sky): Values<'_, Self>,
    ) -> Result<Vec<Patch>, Error> {
        Ok(flora.patches(at, &ground, &sky))
    }
}

/// Places the tree seedlings of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct SeedlingStage {
    pub(crate) per_m2: f64,
    pub(crate) chunk_size_m: f64,
}

impl Stage<ForestTypes> for SeedlingStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<Placement>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, SkyViewFactor>,
    );
    type Output = Vec<CoverPoint>;
    const ID: &'static str = "chunk.seedlings";
    const VERSION: u32 = 4;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self {
            per_m2,
            chunk_size_m,
        } = self;
        hasher.write_f64(*per_m2);
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (placement, ground, sky): Values<'_, Self>,
    ) -> Result<Vec<CoverPoint>, Error> {
        if self.per_m2 <= 0.0 {
            return Ok(Vec::new());
        }
        let grid = (self.per_m2, self.chunk_size_m);
        seedlings(at, world, grid, &placement, &ground, &sky)
    }
}
