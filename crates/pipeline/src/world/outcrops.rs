//! Outcrops and scree: rocks where the ground has hardly any soil.

use nemoral_placement::{CoverKind, DiskKind, GroundCover, GroundCoverParams, Site};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_stand::{FieldParams, OUTCROP_CELL_M, ScalarField, outcrop_chance};

use super::chunk_ground::ChunkGround;
use super::ground::TerrainField;
use super::placement::is_free;
use crate::Error;

const ROCKS: Domain = Domain::new("pipeline.outcrops.rocks");
const CLUMPS: Domain = Domain::new("pipeline.outcrops.clumps");

/// The greatest jitter of a rock in its cell, in cells.
const JITTER: f64 = 0.9;

/// The field by which rocks crop out in clusters.
const CLUMP_FIELD: FieldParams = FieldParams {
    octaves: 2,
    scale_m: 9.0,
    lacunarity: 2.2,
    persistence: 0.5,
};

/// How readily rock crops out at a place, 0..=1.
pub(crate) fn bareness(ground: &ChunkGround, p: DVec2) -> f64 {
    let slope = || ground.sample(p).gradient.length();
    outcrop_chance(ground.conditions(p).soil_m, slope)
}

/// The rocks that crop out in a chunk. They may lie on each other.
pub(crate) fn outcrops(
    at: ChunkCoord,
    world: Key,
    (share, chunk_size_m): (f64, f64),
    varieties: &[DiskKind],
    ground: &ChunkGround,
) -> Result<Vec<Site>, Error> {
    if share <= 0.0 || varieties.is_empty() {
        return Ok(Vec::new());
    }
    let grid = GroundCoverParams {
        chunk_size_m,
        cell_m: OUTCROP_CELL_M,
        jitter: JITTER,
        varieties: varieties.iter().map(cover).collect(),
    };
    let grid = GroundCover::new(grid, world.domain(ROCKS)).map_err(Error::of_stage)?;
    let clumps = TerrainField::new(CLUMP_FIELD, world.domain(CLUMPS))?;
    let chance = |p: DVec2| {
        let bare = bareness(ground, p);
        if bare <= 0.0 {
            return 0.0;
        }
        let clump = ((clumps.value(p) - 0.42) * 5.0).clamp(0.0, 1.0);
        share * bare * clump
    };
    let points = grid.points(at, &|p, radius_m| is_free(ground, p, radius_m), &chance);
    let site = |point: &nemoral_placement::CoverPoint| {
        let (low, high) = varieties[usize::from(point.variety)].radius_m;
        Site {
            position_m: point.position_m,
            radius_m: point.key.domain(ROCKS).rng().range_f64(low, high),
            layer: 0,
            variety: point.variety,
            key: point.key,
        }
    };
    Ok(points.iter().map(site).collect())
}

fn cover(rock: &DiskKind) -> CoverKind {
    CoverKind {
        weight: rock.weight,
        radius_m: rock.radius_m.1,
        scale: (1.0, 1.0),
    }
}
