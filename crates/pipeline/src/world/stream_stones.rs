//! Stones in and beside streams: beds of cobbles, single stones, boulders.

use std::f64::consts::TAU;

use nemoral_assets::PlantKind;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, ObjectKind};
use nemoral_seed::{Domain, Draw, Key, PhiloxRng};
use nemoral_stand::{LowPlant, ObjectSite, ObjectSize};
use nemoral_water::CrossSection;

use super::assets::WorldAssets;
use super::chunk_ground::ChunkGround;

const COBBLES: Domain = Domain::new("pipeline.stream.cobbles");
const STONES: Domain = Domain::new("pipeline.stream.stones");
const BOULDERS: Domain = Domain::new("pipeline.stream.boulders");

/// Beds of cobbles, single stones and boulders on a metre of a stream.
const COBBLES_PER_M: f64 = 1.1;
const STONES_PER_M: f64 = 6.0;
const BOULDERS_PER_M: f64 = 0.16;
/// Stones and boulders keep this far from a trail's edge, metres.
const VERGE_M: f64 = 0.9;

/// What lies along the streams of a chunk without an id.
pub(crate) struct StreamStones {
    /// Beds of cobbles, in the water.
    pub(crate) cobbles: Vec<LowPlant>,
    /// Single stones in the water.
    pub(crate) wet_stones: Vec<LowPlant>,
    /// Single stones beside it.
    pub(crate) stones: Vec<LowPlant>,
}

impl StreamStones {
    pub(crate) fn new(at: ChunkCoord, world: Key, ground: &ChunkGround) -> Self {
        let key = |domain| world.domain(domain).chunk(at);
        let mut cobbles = Vec::new();
        along(ground, COBBLES_PER_M, key(COBBLES), |rng, place, key| {
            let scale = (1.5 * place.half_m).clamp(0.7, 1.25) * rng.range_f64(0.8, 1.15);
            cobbles.push(LowPlant {
                position_m: place.offset_m(rng.range_f64(-0.45, 0.45)),
                yaw_rad: rng.range_f64(0.0, TAU),
                scale,
                key,
            });
        });
        let (mut stones, mut wet_stones) = (Vec::new(), Vec::new());
        along(ground, STONES_PER_M, key(STONES), |rng, place, key| {
            let halves = rng.range_f64(-1.25, 1.25);
            let to = if halves.abs() < 1.0 {
                &mut wet_stones
            } else {
                &mut stones
            };
            to.push(LowPlant {
                position_m: place.offset_m(halves),
                yaw_rad: rng.range_f64(0.0, TAU),
                scale: libm::exp(0.5 * rng.normal()).clamp(0.9, 3.0),
                key,
            });
        });
        Self {
            cobbles,
            wet_stones,
            stones,
        }
    }
}

/// The boulders along the streams of a chunk, which have ids.
pub(crate) fn boulders(
    at: ChunkCoord,
    world: Key,
    ground: &ChunkGround,
    assets: &WorldAssets,
) -> Vec<ObjectSite> {
    let rocks = &assets.library.plants[PlantKind::Rock];
    let mut sites = Vec::new();
    if rocks.is_empty() {
        return sites;
    }
    let key = world.domain(BOULDERS).chunk(at);
    along(ground, BOULDERS_PER_M, key, |rng, place, key| {
        let asset = rng.below(rocks.len() as u32) as usize;
        // From a head's size to as wide as the stream.
        let radius_m = rng.range_f64(0.12, (0.9 * place.half_m).clamp(0.2, 0.6));
        let scale = (radius_m / rocks[asset].radius_m).min(1.0);
        let halves = rng.range_f64(-1.5, 1.5);
        let is_wet = (halves.abs() - 1.0) * place.half_m < 0.5 * radius_m;
        sites.push(ObjectSite {
            kind: ObjectKind::Rock,
            position_m: place.offset_m(halves),
            radius_m: rocks[asset].radius_m * scale,
            asset: if is_wet {
                assets.in_stream(asset)
            } else {
                asset
            },
            size: ObjectSize::Given(scale),
            key,
            on_trail: false,
            facing_rad: None,
            lying: None,
        });
    });
    sites
}

/// A place of a stream's middle line.
struct Place {
    middle_m: DVec2,
    left: DVec2,
    half_m: f64,
}

impl Place {
    /// The place so many half widths to the left.
    fn offset_m(&self, halves: f64) -> DVec2 {
        self.middle_m + self.left * (halves * self.half_m)
    }
}

/// Calls for so many random places on a metre of the chunk's streams, but in culverts.
fn along(
    ground: &ChunkGround,
    per_m: f64,
    key: Key,
    mut put: impl FnMut(&mut PhiloxRng, &Place, Key),
) {
    let Some(water) = ground.water() else {
        return;
    };
    for (run, sections) in (0..).zip(water.sections()) {
        for (piece, pair) in (0..).zip(sections.windows(2)) {
            let [a, b]: [CrossSection; 2] = [pair[0], pair[1]];
            let key = key.item(run).item(piece);
            let mut rng = key.rng();
            let mean = per_m * a.middle_m.distance(b.middle_m);
            let count = mean as u64 + u64::from(rng.chance(mean.fract()));
            for i in 0..count {
                let t = rng.unit_f64();
                let place = Place {
                    middle_m: a.middle_m.lerp(b.middle_m, t),
                    left: a.along.perp(),
                    half_m: a.half_m + t * (b.half_m - a.half_m),
                };
                if ground.trail_edge_m(place.middle_m) > VERGE_M {
                    put(&mut rng, &place, key.item(i));
                }
            }
        }
    }
}
