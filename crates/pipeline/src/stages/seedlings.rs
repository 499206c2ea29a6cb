//! Where seedlings of trees come up.

use std::sync::Arc;

use nemoral_placement::{CoverPoint, CoverVariety, GroundCover, GroundCoverParams, Placement};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::{Domain, Key};
use nemoral_stand::{Seedlings, SkyViewFactor, StandLayer};

use crate::Error;
use crate::config::Config;
use crate::plan::{Hasher, Node, OfWorld, Stage};
use crate::world::ground::ChunkGround;

const SEEDLINGS: Domain = Domain::new("pipeline.seedlings");

/// Sows the tree seedlings of a chunk.
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

impl Stage for SeedlingStage {
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
        let seedlings = Seedlings {
            per_m2: self.per_m2,
        };
        let grid = GroundCoverParams {
            chunk_size_m: self.chunk_size_m,
            cell_m: Seedlings::CELL_M,
            jitter: Seedlings::JITTER,
            varieties: vec![CoverVariety {
                weight: 1.0,
                radius_m: Seedlings::VERGE_M,
                scale: Seedlings::SCALE,
            }],
        };
        let grid = GroundCover::new(grid, world.domain(SEEDLINGS)).map_err(Error::of_stage)?;
        let clusters = placement.clusters(at, StandLayer::Saplings.index());
        let chance = |p: DVec2| {
            let in_cluster = clusters.as_ref().is_some_and(|c| c.contain(p));
            let sky_view = sky.at(p.extend(ground.height_m(p) + 0.3));
            seedlings.chance(in_cluster, sky_view)
        };
        let off_trail = |p: DVec2, verge_m: f64| ground.trail_edge_m(p) > verge_m;
        Ok(grid.points(at, &off_trail, &chance))
    }
}
