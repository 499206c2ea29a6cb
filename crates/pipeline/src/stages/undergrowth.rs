//! The places of low plants and of tree seedlings.

use std::sync::Arc;

use nemoral_placement::{CoverPoint, Placement};
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::SkyViewFactor;

use crate::config::{self, Config};
use crate::plan::{Encode, Encoder, Forest, Hasher, Node, OfWorld, Stage};
use crate::world::flora::{Flora, seedlings};
use crate::world::ground::ChunkGround;
use crate::world::patch::Patch;
use crate::world::ways::skid_brash;
use crate::{Error, InputFiles};

/// Makes the [`Flora`].
#[derive(Clone, Debug)]
pub struct FloraStage {
    params: config::Undergrowth,
    deadwood: config::Deadwood,
    skid_brash: f64,
    chunk_size_m: f64,
}

impl FloraStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            params: config.undergrowth.clone(),
            deadwood: config.deadwood.clone(),
            skid_brash: skid_brash(&config.trails),
            chunk_size_m: config.chunks.size_m,
        }
    }
}

impl Encode for FloraStage {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            params,
            deadwood,
            skid_brash,
            chunk_size_m,
        } = self;
        encoder.field("undergrowth", params);
        encoder.field("branches", &deadwood.branches);
        encoder.field("brash", &deadwood.brash);
        encoder.field("skid_brash", skid_brash);
        encoder.field("chunk_size_m", chunk_size_m);
    }
}

impl Stage<Forest> for FloraStage {
    type At = ();
    type Inputs = ();
    type Output = Flora;
    const ID: &'static str = "world.flora";
    const VERSION: u32 = 4;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, self);
    }

    fn run(&self, (): (), world: Key, (): ()) -> Result<Flora, Error> {
        let of_deadwood = (&self.deadwood, self.skid_brash);
        Flora::new((&self.params, of_deadwood), self.chunk_size_m, world)
    }
}

/// Places the undergrowth of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct UndergrowthStage;

impl Stage<Forest> for UndergrowthStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<Flora>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, SkyViewFactor>,
    );
    type Output = Vec<Patch>;
    const ID: &'static str = "chunk.undergrowth";
    const VERSION: u32 = 5;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (flora, ground, sky): (Arc<Flora>, Arc<ChunkGround>, Arc<SkyViewFactor>),
    ) -> Result<Vec<Patch>, Error> {
        Ok(flora.patches(at, &ground, &sky))
    }
}

/// Places the tree seedlings of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct SeedlingStage {
    per_m2: f64,
    chunk_size_m: f64,
}

impl SeedlingStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            per_m2: config.placement.regeneration.seedlings,
            chunk_size_m: config.chunks.size_m,
        }
    }
}

impl Stage<Forest> for SeedlingStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<Placement>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, SkyViewFactor>,
    );
    type Output = Vec<CoverPoint>;
    const ID: &'static str = "chunk.seedlings";
    const VERSION: u32 = 1;

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
        (placement, ground, sky): (Arc<Placement>, Arc<ChunkGround>, Arc<SkyViewFactor>),
    ) -> Result<Vec<CoverPoint>, Error> {
        if self.per_m2 <= 0.0 {
            return Ok(Vec::new());
        }
        let grid = (self.per_m2, self.chunk_size_m);
        seedlings(at, world, grid, &placement, &ground, &sky)
    }
}
