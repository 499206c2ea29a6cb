//! Where low plants grow.

use std::sync::Arc;

use nemoral_placement::{CoverPoint, CoverVariety, GroundCover, GroundCoverParams};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::{Domain, Key};
use nemoral_stand::{
    CLUMP_FIELD, FERN_FIELD, PATCH_JITTER, PATCH_SCALE, PatchKind, SkyViewFactor, Undergrowth,
    UndergrowthParams,
};

use crate::config::{self, Config};
use crate::plan::{Encode, Encoder, Hasher, Node, OfWorld, Stage};
use crate::world::ground::{ChunkGround, TerrainField};
use crate::{Error, InputFiles};

const PATCHES: Domain = Domain::new("pipeline.undergrowth.patches");

/// A patch of low plants.
#[derive(Clone, Debug)]
pub struct Patch {
    /// What it is.
    pub kind: PatchKind,
    /// Where it is, which of its kind, how turned and how large.
    pub point: CoverPoint,
}

/// The undergrowth of a world: its grid, and where which plants like to grow.
#[derive(Debug)]
pub struct Flora {
    grid: GroundCover,
    undergrowth: Undergrowth<TerrainField>,
    cell_m: f64,
}

/// Makes the [`Flora`].
#[derive(Clone, Debug)]
pub struct FloraStage {
    params: config::Undergrowth,
    chunk_size_m: f64,
}

impl FloraStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            params: config.undergrowth.clone(),
            chunk_size_m: config.chunks.size_m,
        }
    }
}

impl Encode for FloraStage {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            params,
            chunk_size_m,
        } = self;
        encoder.field("undergrowth", params);
        encoder.field("chunk_size_m", chunk_size_m);
    }
}

impl Stage for FloraStage {
    type At = ();
    type Inputs = ();
    type Output = Flora;
    const ID: &'static str = "world.flora";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, self);
    }

    fn run(&self, (): (), world: Key, (): ()) -> Result<Flora, Error> {
        let key = world.domain(PATCHES);
        let p = &self.params;
        let grid = GroundCoverParams {
            chunk_size_m: self.chunk_size_m,
            cell_m: p.cell_m,
            jitter: PATCH_JITTER,
            varieties: vec![CoverVariety {
                weight: 1.0,
                radius_m: 0.0,
                scale: PATCH_SCALE,
            }],
        };
        Ok(Flora {
            grid: GroundCover::new(grid, key).map_err(Error::of_stage)?,
            undergrowth: Undergrowth {
                params: UndergrowthParams {
                    cover: p.cover,
                    litter: p.litter,
                    grass: p.grass,
                    herbs: p.herbs,
                    ferns: p.ferns,
                },
                clumps: TerrainField::new(CLUMP_FIELD, key.item(1))?,
                ferns: TerrainField::new(FERN_FIELD, key.item(2))?,
            },
            cell_m: p.cell_m,
        })
    }
}

/// Sows the undergrowth of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct UndergrowthStage;

impl Stage for UndergrowthStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<Flora>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, SkyViewFactor>,
    );
    type Output = Vec<Patch>;
    const ID: &'static str = "chunk.undergrowth";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (flora, ground, sky): (Arc<Flora>, Arc<ChunkGround>, Arc<SkyViewFactor>),
    ) -> Result<Vec<Patch>, Error> {
        let radius_m = flora.cell_m * 0.5;
        let off_trail = |p: DVec2, _: f64| ground.trail_edge_m(p) > radius_m;
        let chance = |p: DVec2| {
            let sky_view = sky.at(p.extend(ground.height_m(p) + 0.3));
            flora.undergrowth.chance(p, sky_view)
        };
        let points = flora.grid.points(at, &off_trail, &chance).into_iter();
        let patches = points.map(|point| {
            let chance = chance(point.position_m);
            let kind = flora.undergrowth.kind(point.position_m, chance, point.key);
            Patch { kind, point }
        });
        Ok(patches.collect())
    }
}
