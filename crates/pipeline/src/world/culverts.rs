//! The mouths of culverts, on the ground.

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, FlatSurface, Surface};
use nemoral_seed::{Domain, Key};
use nemoral_stand::LowPlant;
use nemoral_trails::{DressingKind, TrailDressing};

use super::chunk_ground::ChunkGround;

const CULVERTS: Domain = Domain::new("pipeline.culverts");

/// How far from a mouth the way's surface is, metres.
const INWARDS_M: f64 = 1.3;
/// How much higher the way must be, and from what height on its pipe lies freer, metres.
const COVER_M: [f64; 2] = [0.2, 0.35];
/// How free it lies at most, metres.
const FREE_M: f64 = 0.15;

/// The mouths of culverts in a chunk, each with the level that it is on.
pub(crate) fn culverts(
    at: ChunkCoord,
    world: Key,
    dressing: &[TrailDressing],
    ground: &ChunkGround,
) -> Vec<(LowPlant, FlatSurface)> {
    let key = world.domain(CULVERTS).chunk(at);
    let mouths = dressing.iter().filter(|d| d.kind == DressingKind::Culvert);
    let numbered = (0_u64..).zip(mouths);
    let on_ground = numbered.filter_map(|(i, mouth)| culvert(mouth, ground, key.item(i)));
    on_ground.collect()
}

/// `None` where the way is not high enough over a mouth.
fn culvert(
    mouth: &TrailDressing,
    ground: &ChunkGround,
    key: Key,
) -> Option<(LowPlant, FlatSurface)> {
    let (sin, cos) = libm::sincos(mouth.yaw_rad);
    let here_m = ground.height_m(mouth.position_m);
    let way_m = ground.height_m(mouth.position_m - INWARDS_M * DVec2::new(cos, sin));
    let cover_m = way_m - here_m;
    let level = FlatSurface {
        height_m: here_m + (cover_m - COVER_M[1]).clamp(0.0, FREE_M),
        gradient: DVec2::ZERO,
    };
    let of = LowPlant {
        position_m: mouth.position_m,
        yaw_rad: mouth.yaw_rad,
        scale: mouth.scale,
        key,
    };
    (cover_m > COVER_M[0]).then_some((of, level))
}
