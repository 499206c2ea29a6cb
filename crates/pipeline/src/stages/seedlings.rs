//! Where seedlings of trees come up.

use std::sync::Arc;

use nemoral_placement::{CoverPoint, CoverVariety, GroundCover, GroundCoverParams, Placement};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::{Domain, Key};

use super::ground::ChunkGround;
use super::openness::Openness;
use super::placement::StandLayer;
use crate::Error;
use crate::config::Config;
use crate::plan::{Forest, Hasher, Node, OfWorld, Stage};

const SEEDLINGS: Domain = Domain::new("pipeline.seedlings");

/// Side of a grid cell: each may hold one seedling.
const CELL_M: f64 = 0.7;

/// How far one stands from its cell's middle at most, in cells: so far that no row of the grid is seen.
const JITTER: f64 = 2.0;

/// The share of a cluster's seedlings that comes up outside of clusters.
const STRAYS: f64 = 0.06;

/// Under so open a sky, seen past the crowns, there are as many as in full light ...
const LIGHT_ENOUGH: f64 = 0.4;

/// ... and in deep shade this share of them: seeds sprout there too, and few live on.
const IN_SHADE: f64 = 0.1;

/// Nearer to a trail's edge they are driven over or mown.
const VERGE_M: f64 = 0.4;

/// Sows the tree seedlings of a chunk: in the clusters where saplings stand, if there are any, and where
/// light is; single ones elsewhere.
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
        Node<ChunkCoord, Openness>,
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
        (placement, ground, openness): (Arc<Placement>, Arc<ChunkGround>, Arc<Openness>),
    ) -> Result<Vec<CoverPoint>, Error> {
        if self.per_m2 <= 0.0 {
            return Ok(Vec::new());
        }
        let grid = GroundCoverParams {
            chunk_size_m: self.chunk_size_m,
            cell_m: CELL_M,
            jitter: JITTER,
            varieties: vec![CoverVariety {
                weight: 1.0,
                radius_m: VERGE_M,
                // With their own heights, under 0.3 m.
                scale: (0.9, 1.1),
            }],
        };
        let grid = GroundCover::new(grid, world.domain(SEEDLINGS)).map_err(Error::of_stage)?;
        let clusters = placement.clusters(at, StandLayer::Saplings.index());
        let density = |p: DVec2| {
            let inside = clusters.as_ref().is_some_and(|c| c.contain(p));
            let most = self.per_m2 * CELL_M * CELL_M * if inside { 1.0 } else { STRAYS };
            let sky = f64::from(openness.at(p.extend(ground.height_m(p) + 0.3)));
            most * (sky / LIGHT_ENOUGH).clamp(IN_SHADE, 1.0)
        };
        let off_trail = |p: DVec2, verge_m: f64| ground.trail_edge_m(p) > verge_m;
        Ok(grid.points(at, &off_trail, &density))
    }
}
