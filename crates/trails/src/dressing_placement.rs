//! The grass, stones and roots of the trails themselves, the grass of their verges, and the beds of
//! stones in their ditches.

use std::ops::Range;

use glam::DVec2;
use nemoral_scene::ChunkCoord;
use nemoral_seed::{Domain, Draw, Key, Rng};

use crate::dressing::{DressingKind, TrailDressing};
use crate::value_noise::ValueNoise1d;
use crate::{TrailPath, TrailSurfaceKind};

const STONES: Domain = Domain::new("trails.stones");
const GRASS: Domain = Domain::new("trails.grass");
const VERGE: Domain = Domain::new("trails.verge");
const STRIP: Domain = Domain::new("trails.strip");
const ROOTS: Domain = Domain::new("trails.roots");
const STEPS: Domain = Domain::new("trails.steps");
const CULVERTS: Domain = Domain::new("trails.culverts");
const BEDS: Domain = Domain::new("trails.beds");

/// The least mean distance of culverts, metres.
const NEAREST_CULVERTS_M: f64 = 5.0;

/// The distance of a culvert's outlet from the way's edge, metres.
const OUTLET_M: f64 = 1.1;

/// The rise of a step, metres.
const RISE_M: f64 = 0.17;

/// The wavelength at which steep runs with and without steps alternate, metres, and the noise from
/// which they have them.
const STEPS_WAVE_M: f64 = 30.0;
const STEPS_FROM: f64 = -0.35;

/// Beds of their full size fit into a ditch of this width, metres.
const BED_DITCH_M: f64 = 1.2;

/// Distance of the beds of stones along an edge, metres.
const BED_M: f64 = 0.7;

/// The wavelength at which stretches with beds and without alternate, metres.
const BED_WAVE_M: f64 = 14.0;

/// The places for mats on a square metre of strip: with nearly all of them taken, four fifths of
/// the ground are covered.
const STRIP_PER_M2: f64 = 11.0;

/// The wavelengths at which strips alternate between overgrown and bare, metres.
const STRIP_WAVES_M: [f64; 2] = [9.0, 1.3];

/// The greatest distance of the verge's grass from the edge, metres.
const VERGE_M: f64 = 0.5;

/// The wavelength at which verges alternate between overgrown and bare, metres.
const VERGE_WAVE_M: f64 = 4.0;

/// The stones of a trail: a uniform number up to the greatest, anywhere on the surface, but mostly
/// outside of the ruts.
pub(crate) fn stones(key: Key, path: &TrailPath) -> Vec<TrailDressing> {
    let way = path.way();
    let key = path.id().key(key.domain(STONES));
    // A branch is a tenth as long as a trail.
    let most = if path.id().is_branch() {
        way.rocks_max_per_trail / 10
    } else {
        way.rocks_max_per_trail
    };
    let count = key.rng().between(0, most);
    let stone = |i: u32| {
        let mut rng = key.item(u64::from(i)).rng();
        let s = rng.range_f64(0.0, path.length_m());
        let reach = 0.48 * path.width_m(s);
        let mut offset = rng.range_f64(-reach, reach);
        for _ in 0..2 {
            let in_rut = way
                .ruts()
                .is_some_and(|r| (offset.abs() - 0.5 * r.gauge_m).abs() < 2.0 * r.sigma_m);
            if in_rut {
                offset = rng.range_f64(-reach, reach);
            }
        }
        let stone = TrailDressing {
            position_m: beside(path, s, offset),
            yaw_rad: rng.range_f64(0.0, std::f64::consts::TAU),
            scale: libm::exp(0.5 * rng.normal()).clamp(0.9, 2.5),
            kind: DressingKind::Stone,
        };
        path.has(stone.kind, s, rng.unit_f64()).then_some(stone)
    };
    (0..count).filter_map(stone).collect()
}

/// The grass that a trail would have in a chunk, for each passage through it: from half of the
/// greatest number to all of it, denser in the middle, none in the ruts.
pub(crate) fn grass(
    key: Key,
    path: &TrailPath,
    chunk: ChunkCoord,
    mut emit: impl FnMut(u64, TrailDressing),
) {
    let way = path.way();
    let most = way.grass_max_per_chunk;
    // Where only a corner is touched between two knots, there is no room.
    let here = |t: &(usize, ChunkCoord, Range<usize>)| t.1 == chunk && !t.2.is_empty();
    for (index, _, knots) in path.transits().filter(here) {
        let key = path.id().key(key.domain(GRASS)).item(index as u64);
        let last = knots.end.min(path.knots().len() - 1);
        let (from, to) = (path.knots()[knots.start].arc, path.knots()[last].arc);
        for i in 0..key.rng().between(most / 2, most) {
            let mut rng = key.item(u64::from(i)).rng();
            let s = rng.range_f64(from, to);
            let offset = way.grass_spread_m * (rng.unit_f64() - rng.unit_f64());
            let worn = way
                .ruts()
                .is_some_and(|r| (offset.abs() - 0.5 * r.gauge_m).abs() < 1.5 * r.sigma_m);
            if !worn {
                let tuft = TrailDressing {
                    position_m: beside(path, s, offset),
                    yaw_rad: rng.range_f64(0.0, std::f64::consts::TAU),
                    scale: rng.range_f64(0.6, 1.2),
                    kind: DressingKind::Grass,
                };
                let priority = rng.next_u64();
                if path.has(tuft.kind, s, rng.unit_f64()) {
                    emit(priority, tuft);
                }
            }
        }
    }
}

/// The grass of a trail's verges along its passage through a chunk, dense at the edge, and growing
/// in patches.
pub(crate) fn verges(
    key: Key,
    path: &TrailPath,
    chunk: ChunkCoord,
    mut emit: impl FnMut(TrailDressing),
) {
    for (index, _, knots) in path.transits().filter(|t| t.1 == chunk) {
        let key = path.id().key(key.domain(VERGE));
        let last = knots.end.min(path.knots().len() - 1);
        let (from, to) = (path.knots()[knots.start].arc, path.knots()[last].arc);
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let key = key.item(side);
            let growth = ValueNoise1d::new(key, path.length_m(), VERGE_WAVE_M);
            let key = key.item(index as u64);
            let count = (path.way().verge_tufts_per_m * (to - from)).round() as u32;
            for i in 0..count {
                let mut rng = key.item(u64::from(i)).rng();
                let s = rng.range_f64(from, to);
                let near = rng.unit_f64();
                let offset = 0.5 * path.width_m(s) + VERGE_M * near * near;
                let tuft = TrailDressing {
                    position_m: beside(path, s, sign * offset),
                    yaw_rad: rng.range_f64(0.0, std::f64::consts::TAU),
                    scale: rng.range_f64(0.6, 1.6),
                    kind: DressingKind::Verge,
                };
                if rng.chance(0.6 + 0.7 * growth.at(s)) {
                    emit(tuft);
                }
            }
        }
    }
}

/// The mats of low plants on the strip between a trail's ruts along its passage through a chunk:
/// smaller and fewer beside the ruts, and growing in patches.
pub(crate) fn strip(
    key: Key,
    path: &TrailPath,
    chunk: ChunkCoord,
    mut emit: impl FnMut(TrailDressing),
) {
    let way = path.way();
    let Some(ruts) = way.ruts().filter(|_| way.strip_cover > 0.0) else {
        return;
    };
    let half_m = 0.5 * ruts.gauge_m - 1.2 * ruts.sigma_m;
    if half_m <= 0.0 {
        return;
    }
    let key = path.id().key(key.domain(STRIP));
    let [stands, gaps] = [(0, STRIP_WAVES_M[0]), (1, STRIP_WAVES_M[1])]
        .map(|(i, wave_m)| ValueNoise1d::new(key.item(i), path.length_m(), wave_m));
    for (index, _, knots) in path.transits().filter(|t| t.1 == chunk) {
        let key = key.item(2).item(index as u64);
        let last = knots.end.min(path.knots().len() - 1);
        let (from, to) = (path.knots()[knots.start].arc, path.knots()[last].arc);
        let count = (STRIP_PER_M2 * 2.0 * half_m * (to - from)).round() as u32;
        for i in 0..count {
            let mut rng = key.item(u64::from(i)).rng();
            let s = rng.range_f64(from, to);
            let across = rng.range_f64(-1.0, 1.0);
            let worn = across * across;
            let growth = 1.0 + 0.9 * stands.at(s) + 0.6 * gaps.at(s);
            let cover = way.strip_cover * growth * strip_factor(path.kind(s));
            let mat = TrailDressing {
                position_m: beside(path, s, path.wander_m(s) + across * half_m),
                yaw_rad: rng.range_f64(0.0, std::f64::consts::TAU),
                scale: rng.range_f64(0.8, 1.3) * (1.0 - 0.35 * worn),
                kind: DressingKind::Strip,
            };
            if rng.chance((cover * (1.0 - worn * worn)).clamp(0.0, 1.0)) {
                emit(mat);
            }
        }
    }
}

/// How much of a strip of some material plants cover, relative to one of earth: our choice.
fn strip_factor(kind: TrailSurfaceKind) -> f64 {
    match kind {
        TrailSurfaceKind::DryEarth | TrailSurfaceKind::Grassy => 1.0,
        TrailSurfaceKind::Gravel | TrailSurfaceKind::Mud => 0.8,
        TrailSurfaceKind::Sand => 0.5,
        TrailSurfaceKind::LeafLitter | TrailSurfaceKind::Needles => 0.35,
        TrailSurfaceKind::Rock => 0.2,
    }
}

/// The roots across a trail along its passage through a chunk.
pub(crate) fn roots(
    key: Key,
    path: &TrailPath,
    chunk: ChunkCoord,
    mut emit: impl FnMut(TrailDressing),
) {
    for (index, _, knots) in path.transits().filter(|t| t.1 == chunk) {
        let key = path.id().key(key.domain(ROOTS)).item(index as u64);
        let last = knots.end.min(path.knots().len() - 1);
        let (from, to) = (path.knots()[knots.start].arc, path.knots()[last].arc);
        let count = (path.way().roots_per_m * (to - from)).round() as u32;
        for i in 0..count {
            let mut rng = key.item(u64::from(i)).rng();
            let s = rng.range_f64(from, to);
            let reach = 0.6 * path.width_m(s);
            let across = path.tangent(s).perp();
            let half_turn = if rng.chance(0.5) {
                std::f64::consts::PI
            } else {
                0.0
            };
            let root = TrailDressing {
                position_m: beside(path, s, rng.range_f64(-reach, reach)),
                yaw_rad: libm::atan2(across.y, across.x) + half_turn + rng.range_f64(-0.8, 0.8),
                scale: rng.range_f64(0.6, 1.3),
                kind: DressingKind::Root,
            };
            if path.has(root.kind, s, rng.unit_f64()) {
                emit(root);
            }
        }
    }
}

/// The steps of a trail along its passage through a chunk: one wherever a steep run has risen by
/// [`RISE_M`], in some of these runs.
pub(crate) fn steps(
    key: Key,
    path: &TrailPath,
    chunk: ChunkCoord,
    mut emit: impl FnMut(TrailDressing),
) {
    let steep = path.way().steps_from_grade;
    if steep <= 0.0 {
        return;
    }
    let built = ValueNoise1d::new(
        path.id().key(key.domain(STEPS)),
        path.length_m(),
        STEPS_WAVE_M,
    );
    for (_, _, knots) in path.transits().filter(|t| t.1 == chunk) {
        let last = (knots.end + 1).min(path.knots().len());
        for pair in path.knots()[knots.start..last].windows(2) {
            let (a, b) = (&pair[0], &pair[1]);
            let rise = b.height - a.height;
            let is_built = rise.abs() > steep * (b.arc - a.arc) && built.at(a.arc) > STEPS_FROM;
            if !is_built {
                continue;
            }
            let [low, high] = [a.height.min(b.height), a.height.max(b.height)];
            for level in (low / RISE_M).ceil() as i64..(high / RISE_M).ceil() as i64 {
                let share = (level as f64 * RISE_M - a.height) / rise;
                let s = a.arc + share * (b.arc - a.arc);
                // The axis lies across the way, and y goes down.
                let down = -path.tangent(s) * rise.signum();
                let axis = -down.perp();
                emit(TrailDressing {
                    position_m: path.position_m(s),
                    yaw_rad: libm::atan2(axis.y, axis.x),
                    scale: path.width_m(s),
                    kind: DressingKind::Step,
                });
            }
        }
    }
}

/// The ends of a trail's culverts along its passage through a chunk.
pub(crate) fn culverts(
    key: Key,
    path: &TrailPath,
    chunk: ChunkCoord,
    mut emit: impl FnMut(TrailDressing),
) {
    let way = path.way();
    let Some(ditch) = way.section.ditch.filter(|_| way.culvert_spacing_m > 0.0) else {
        return;
    };
    let spacing_m = way.culvert_spacing_m.max(NEAREST_CULVERTS_M);
    let key = path.id().key(key.domain(CULVERTS));
    for (_, _, knots) in path.transits().filter(|t| t.1 == chunk) {
        let last = knots.end.min(path.knots().len() - 1);
        let (from, to) = (path.knots()[knots.start].arc, path.knots()[last].arc);
        let numbers = [from, to].map(|s| (s / spacing_m) as u64);
        for number in numbers[0]..=numbers[1] {
            let mut rng = key.item(number).rng();
            let s = spacing_m * (number as f64 + rng.unit_f64());
            let scale = rng.range_f64(0.85, 1.2);
            let [left, right] = path.ditches(s);
            let uphill = match (left > 0.8, right > 0.8) {
                (true, false) if right < 0.2 => 1.0,
                (false, true) if left < 0.2 => -1.0,
                _ => continue,
            };
            if !(from..to).contains(&s) {
                continue;
            }
            // The water comes in in the ditch's middle, and leaves in the filled slope.
            for (side, beyond) in [(uphill, 0.5 * ditch.width_m), (-uphill, OUTLET_M)] {
                let out = path.tangent(s).perp() * side;
                emit(TrailDressing {
                    position_m: beside(path, s, side * (0.5 * path.width_m(s) + beyond)),
                    yaw_rad: libm::atan2(out.y, out.x),
                    scale,
                    kind: DressingKind::Culvert,
                });
            }
        }
    }
}

/// The beds of stones in a trail's ditches, or at its edges, along its passage through a chunk.
pub(crate) fn beds(
    key: Key,
    path: &TrailPath,
    chunk: ChunkCoord,
    mut emit: impl FnMut(TrailDressing),
) {
    let way = path.way();
    if way.stone_beds <= 0.0 {
        return;
    }
    for (index, _, knots) in path.transits().filter(|t| t.1 == chunk) {
        let key = path.id().key(key.domain(BEDS));
        let last = knots.end.min(path.knots().len() - 1);
        let (from, to) = (path.knots()[knots.start].arc, path.knots()[last].arc);
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let key = key.item(side);
            let stony = ValueNoise1d::new(key, path.length_m(), BED_WAVE_M);
            let key = key.item(index as u64);
            for i in 0..((to - from) / BED_M) as u32 {
                let mut rng = key.item(u64::from(i)).rng();
                let s = from + BED_M * (f64::from(i) + rng.unit_f64());
                let shift = rng.range_f64(-0.15, 0.15);
                let (beyond, size, there) = match way.section.ditch {
                    Some(ditch) => (
                        0.5 * ditch.width_m,
                        (ditch.width_m / BED_DITCH_M).min(1.0),
                        path.ditches(s)[side as usize] > 0.4,
                    ),
                    None => (0.3, 1.0, true),
                };
                let bed = TrailDressing {
                    position_m: beside(
                        path,
                        s,
                        sign * (0.5 * path.width_m(s) + beyond + size * shift),
                    ),
                    yaw_rad: rng.range_f64(0.0, std::f64::consts::TAU),
                    scale: size * rng.range_f64(0.8, 1.15),
                    kind: DressingKind::Bed,
                };
                if there && 0.5 * (1.0 + stony.at(s)) < way.stone_beds {
                    emit(bed);
                }
            }
        }
    }
}

fn beside(path: &TrailPath, s_m: f64, offset_m: f64) -> DVec2 {
    path.position_m(s_m) + path.tangent(s_m).perp() * offset_m
}
