//! Where logs lie.

use std::sync::Arc;

use nemoral_placement::Site;
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::{FallenStem, settle};

use crate::config::{self, Config};
use crate::plan::{AnyChunk, Demand, Encode, Encoder, Forest, Hasher, Node, OfWorld, Stage};
use crate::world::assets::WorldAssets;
use crate::world::deadwood::{Surroundings, logs};
use crate::world::ground::{ChunkGround, GroundModel};
use crate::{Error, InputFiles};

/// Finds places for the logs of a chunk among what stands in it and its neighbours.
#[derive(Clone, Debug)]
pub struct FallenStemStage {
    deadwood: config::Deadwood,
    chunk_size_m: f64,
}

impl FallenStemStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            deadwood: config.deadwood.clone(),
            chunk_size_m: config.chunks.size_m,
        }
    }
}

impl Encode for FallenStemStage {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            deadwood,
            chunk_size_m,
        } = self;
        encoder.field("deadwood", deadwood);
        encoder.field("chunk_size_m", chunk_size_m);
    }
}

impl Stage<Forest> for FallenStemStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        OfWorld<GroundModel>,
        Node<ChunkCoord, ChunkGround>,
        AnyChunk<Vec<Site>>,
        AnyChunk<Vec<Site>>,
    );
    type Output = Vec<FallenStem>;
    const ID: &'static str = "chunk.fallen_stems";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, self);
    }

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (assets, model, ground, rocks, woody): (
            Arc<WorldAssets>,
            Arc<GroundModel>,
            Arc<ChunkGround>,
            Demand<'_, Vec<Site>>,
            Demand<'_, Vec<Site>>,
        ),
    ) -> Result<Vec<FallenStem>, Error> {
        if self.deadwood.volume_m3_ha <= 0.0 {
            return Ok(Vec::new());
        }
        let mut sites = Vec::new();
        for (dx, dy) in (-1..=1).flat_map(|x| (-1..=1).map(move |y| (x, y))) {
            let near = at.offset(dx, dy);
            sites.extend_from_slice(&rocks.at(near)?);
            sites.extend_from_slice(&woody.at(near)?);
        }
        let around = Surroundings {
            ground: &ground,
            model: &model,
            sites: &sites,
        };
        let (size, wanted) = (self.chunk_size_m, &self.deadwood);
        Ok(logs(at, size, world, wanted, &assets, &around))
    }
}

/// The logs of a chunk that its neighbours' leave.
#[derive(Clone, Debug)]
pub struct DeadwoodStage {
    is_empty: bool,
}

impl DeadwoodStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            is_empty: config.deadwood.volume_m3_ha <= 0.0,
        }
    }
}

impl Stage<Forest> for DeadwoodStage {
    type At = ChunkCoord;
    type Inputs = (AnyChunk<Vec<FallenStem>>,);
    type Output = Vec<FallenStem>;
    const ID: &'static str = "chunk.deadwood";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { is_empty } = self;
        hasher.write_u64(u64::from(*is_empty));
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (stems,): (Demand<'_, Vec<FallenStem>>,),
    ) -> Result<Vec<FallenStem>, Error> {
        if self.is_empty {
            return Ok(Vec::new());
        }
        let own = stems.at(at)?;
        let mut around = Vec::new();
        for (dx, dy) in (-1..=1).flat_map(|x| (-1..=1).map(move |y| (x, y))) {
            if (dx, dy) != (0, 0) {
                around.push(stems.at(at.offset(dx, dy))?);
            }
        }
        let around: Vec<&[FallenStem]> = around.iter().map(|a| a.as_slice()).collect();
        Ok(settle(&own, &around))
    }
}
