//! As much lies and grows on trails and beside them as was asked for.

use crate::common::{SIZE_M, around, flat, points, trails};
use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;
use nemoral_trails::{
    DressingKind, TrailDressing, TrailParams, TrailSurfaceKind, TrailZone, Trails, WayKind,
};

fn dressed(grass: u32, spread: f64, rocks: u32) -> Trails {
    let params = TrailParams {
        spawn_probability: 0.1,
        max_length_chunks: 12,
        ..TrailParams::of(WayKind {
            grass_max_per_chunk: grass,
            grass_spread_m: spread,
            rocks_max_per_trail: rocks,
            verge_tufts_per_m: 0.0,
            strip_cover: 0.0,
            ..WayKind::default()
        })
    };
    trails(params, 13, flat(DVec2::ZERO))
}

#[test]
fn grass_is_where_and_as_much_as_was_asked_for() {
    let (most, spread) = (80, 1.2);
    let trails = dressed(most, spread, 0);
    let (mut tufts, mut chunks, mut inner, mut least) = (0, 0, 0, usize::MAX);
    for chunk in around(ChunkCoord::new(0, 0), 4) {
        let all = trails.dressing(chunk);
        assert!(all.len() <= most as usize);
        if all.is_empty() {
            continue;
        }
        chunks += 1;
        least = least.min(all.len());
        for tuft in all {
            assert_eq!(tuft.kind, DressingKind::Grass);
            assert_eq!(ChunkCoord::containing(tuft.position_m, SIZE_M), chunk);
            let (path, s) = trails.nearest(tuft.position_m, 5.0).expect("on a trail");
            let offset = path.position_m(s).distance(tuft.position_m);
            assert!(offset <= spread + 1e-6);
            tufts += 1;
            inner += u32::from(offset < spread / 2.0);
        }
    }
    assert!(chunks > 30);
    // It is denser in the middle, where a uniform distribution would have half of the tufts.
    assert!(f64::from(inner) > 0.65 * f64::from(tufts));
}

#[test]
fn stones_lie_on_trails() {
    let trails = dressed(0, 1.0, 200);
    let mut stones = std::collections::BTreeMap::new();
    for chunk in around(ChunkCoord::new(0, 0), 14) {
        let ground = trails.ground_near(chunk, 1.0);
        for stone in trails.dressing(chunk) {
            assert_eq!(stone.kind, DressingKind::Stone);
            assert_eq!(ChunkCoord::containing(stone.position_m, SIZE_M), chunk);
            assert!((0.4..=2.5).contains(&stone.scale));
            assert!(ground.edge_m(stone.position_m) < 0.01);
            let (path, _) = trails.nearest(stone.position_m, 5.0).expect("on a trail");
            *stones.entry(path.id()).or_insert(0) += 1;
        }
    }
    // A crossing may give a stone to the wrong trail, so allow a few more.
    assert!(stones.values().all(|&n| n <= 210), "{stones:?}");
    assert!(stones.values().any(|&n| n > 100));
}

#[test]
fn verges_grow_at_edges_and_on_no_trail() {
    let verged = |tufts_per_m| {
        let params = TrailParams {
            spawn_probability: 0.1,
            max_length_chunks: 12,
            ..TrailParams::of(WayKind {
                grass_max_per_chunk: 0,
                rocks_max_per_trail: 0,
                verge_tufts_per_m: tufts_per_m,
                strip_cover: 0.0,
                ..WayKind::default()
            })
        };
        trails(params, 13, flat(DVec2::ZERO))
    };
    let trails = verged(4.0);
    let (mut tufts, mut room_m, mut near) = (0, 0.0, 0);
    for chunk in around(ChunkCoord::new(0, 0), 4) {
        let ground = trails.ground_near(chunk, 1.0);
        for path in trails.in_chunk(chunk) {
            let here = |p: &(f64, DVec2)| ChunkCoord::containing(p.1, SIZE_M) == chunk;
            room_m += 2.0 * 0.5 * points(&path, 0.5).filter(here).count() as f64;
        }
        for tuft in trails.dressing(chunk) {
            assert_eq!(tuft.kind, DressingKind::Verge);
            assert_eq!(ChunkCoord::containing(tuft.position_m, SIZE_M), chunk);
            let edge_m = ground.edge_m(tuft.position_m);
            assert!((0.0..0.55).contains(&edge_m), "{edge_m}");
            tufts += 1;
            near += u32::from(edge_m < 0.125);
        }
    }
    // Some of the room is on other trails, and growth varies along the trail.
    let grown = f64::from(tufts) / (4.0 * room_m);
    assert!((0.4..0.65).contains(&grown), "{grown}");
    // Half of them stand in the nearest quarter.
    let near = f64::from(near) / f64::from(tufts);
    assert!((0.44..0.56).contains(&near), "{near}");
    let twice = verged(8.0);
    let count = |t: &Trails| {
        around(ChunkCoord::new(0, 0), 4)
            .map(|c| t.dressing(c).len())
            .sum::<usize>() as f64
    };
    assert!((count(&twice) / count(&trails) - 2.0).abs() < 0.1);
}

#[test]
fn strips_are_covered_as_asked_for() {
    let with = |strip_cover, kind| {
        let params = TrailParams {
            spawn_probability: 0.1,
            max_length_chunks: 12,
            ..TrailParams::of(
                WayKind {
                    grass_max_per_chunk: 0,
                    rocks_max_per_trail: 0,
                    verge_tufts_per_m: 0.0,
                    strip_cover,
                    ..WayKind::default()
                }
                .surfaced(kind),
            )
        };
        trails(params, 13, flat(DVec2::ZERO))
    };
    // The covered share of the strips, by discs of the mats' size.
    let covered = |trails: &Trails| {
        let (mut strip, mut under) = (0, 0);
        for chunk in around(ChunkCoord::new(0, 0), 2) {
            let ground = trails.ground_near(chunk, 1.0);
            let mats = trails.dressing(chunk);
            for mat in &mats {
                assert_eq!(mat.kind, DressingKind::Strip);
                assert_eq!(ChunkCoord::containing(mat.position_m, SIZE_M), chunk);
                assert_eq!(ground.zone(mat.position_m), TrailZone::Strip);
                assert!((0.5..=1.3).contains(&mat.scale));
            }
            for k in 0..40_000 {
                let cell = DVec2::new(f64::from(k % 200), f64::from(k / 200)) + 0.5;
                let p = chunk.origin_m(SIZE_M) + cell * (SIZE_M / 200.0);
                if ground.zone(p) == TrailZone::Strip {
                    strip += 1;
                    let is_under = |m: &TrailDressing| m.position_m.distance(p) < 0.2 * m.scale;
                    under += u32::from(mats.iter().any(is_under));
                }
            }
        }
        assert!(strip > 2000, "{strip}");
        f64::from(under) / f64::from(strip)
    };
    let earth = TrailSurfaceKind::DryEarth;
    let shares = [0.0, 0.3, 0.6, 1.0].map(|cover| covered(&with(cover, earth)));
    assert_eq!(shares[0], 0.0);
    assert!((0.2..0.36).contains(&shares[1]), "{shares:?}");
    assert!((0.4..0.6).contains(&shares[2]), "{shares:?}");
    assert!((0.55..0.8).contains(&shares[3]), "{shares:?}");
    let sand = covered(&with(0.6, TrailSurfaceKind::Sand));
    assert!(sand < 0.75 * shares[2], "{sand}");
}

#[test]
fn no_dressing_where_none_is_asked_for() {
    let trails = dressed(0, 1.0, 0);
    assert!(around(ChunkCoord::new(0, 0), 3).all(|c| trails.dressing(c).is_empty()));
}
