//! Low plants and seedlings on their grids.

use nemoral_placement::{CoverPoint, CoverVariety, GroundCover, GroundCoverParams, Placement};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::{Domain, Key};
use nemoral_stand::{
    CLUMP_FIELD, FERN_FIELD, PATCH_JITTER, PATCH_SCALE, PatchKind, Seedlings, SkyViewFactor,
    StandLayer, Undergrowth, UndergrowthParams,
};

use super::ground::{ChunkGround, TerrainField};
use crate::{Error, config};

const PATCHES: Domain = Domain::new("pipeline.undergrowth.patches");
const SEEDLINGS: Domain = Domain::new("pipeline.seedlings");

/// A patch of low plants.
#[derive(Clone, Debug)]
pub struct Patch {
    /// What it is.
    pub kind: PatchKind,
    /// Its position, variety, turn and size.
    pub point: CoverPoint,
}

/// The undergrowth of a world: its grid, and the preferred places of its plants.
#[derive(Debug)]
pub struct Flora {
    grid: GroundCover,
    undergrowth: Undergrowth<TerrainField>,
    cell_m: f64,
}

impl Flora {
    /// The undergrowth of a config.
    pub(crate) fn new(
        p: &config::Undergrowth,
        chunk_size_m: f64,
        world: Key,
    ) -> Result<Self, Error> {
        let key = world.domain(PATCHES);
        let grid = GroundCoverParams {
            chunk_size_m,
            cell_m: p.cell_m,
            jitter: PATCH_JITTER,
            varieties: vec![CoverVariety {
                weight: 1.0,
                radius_m: 0.0,
                scale: PATCH_SCALE,
            }],
        };
        Ok(Self {
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

    /// The patches of a chunk.
    pub(crate) fn patches(
        &self,
        at: ChunkCoord,
        ground: &ChunkGround,
        sky: &SkyViewFactor,
    ) -> Vec<Patch> {
        let radius_m = self.cell_m * 0.5;
        let off_trail = |p: DVec2, _: f64| ground.trail_edge_m(p) > radius_m;
        let chance = |p: DVec2| {
            let sky_view = sky.at(p.extend(ground.height_m(p) + 0.3));
            self.undergrowth.chance(p, sky_view)
        };
        let points = self.grid.points(at, &off_trail, &chance).into_iter();
        let patches = points.map(|point| {
            let chance = chance(point.position_m);
            let kind = self.undergrowth.kind(point.position_m, chance, point.key);
            Patch { kind, point }
        });
        patches.collect()
    }
}

/// The seedlings of a chunk, `per_m2` of them in clusters in full light.
pub(crate) fn seedlings(
    at: ChunkCoord,
    world: Key,
    (per_m2, chunk_size_m): (f64, f64),
    placement: &Placement,
    ground: &ChunkGround,
    sky: &SkyViewFactor,
) -> Result<Vec<CoverPoint>, Error> {
    let seedlings = Seedlings { per_m2 };
    let grid = GroundCoverParams {
        chunk_size_m,
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
