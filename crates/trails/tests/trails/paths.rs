//! The paths of trails.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::common::{self, SIZE_M, around, flat, hills, trails};
use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;
use nemoral_seed::Key;
use nemoral_trails::{
    DressingKind, TrailDressing, TrailParams, TrailPath, TrailSurfaceKind, TrailZone, Trails,
    WayKind,
};
use proptest::prelude::*;

fn dense(seed: u64) -> Trails {
    let params = TrailParams {
        spawn_probability: 0.1,
        max_length_chunks: 12,
        fork_probability: 0.15,
        ..TrailParams::default()
    };
    trails(params, seed, hills(0.3))
}

/// Points along a path, with arc lengths.
fn points(path: &TrailPath, step_m: f64) -> impl Iterator<Item = (f64, DVec2)> + '_ {
    let n = (path.length_m() / step_m) as usize;
    (0..=n).map(move |i| {
        let s = i as f64 / n as f64 * path.length_m();
        (s, path.position_m(s))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_chunk_knows_exactly_the_trails_that_touch_it(
        seed: u64,
        x in -1_000_000..1_000_000,
        y in -1_000_000..1_000_000,
    ) {
        let centre = ChunkCoord::new(x, y);
        let trails = dense(seed);
        for chunk in around(centre, 1) {
            for path in trails.in_chunk(chunk) {
                let mut expected: Vec<_> = path.chunks().collect();
                expected.dedup();
                let mut got = Vec::new();
                for (_, p) in points(&path, 0.7) {
                    let c = ChunkCoord::containing(p, SIZE_M);
                    // Points within a millimetre of a border are skipped.
                    let sure = ChunkCoord::containing(p + 1e-3, SIZE_M)
                        == ChunkCoord::containing(p - 1e-3, SIZE_M);
                    if sure && got.last() != Some(&c) {
                        got.push(c);
                    }
                }
                prop_assert_eq!(&got, &expected);
                for c in expected {
                    prop_assert!(trails.in_chunk(c).iter().any(|p| p.id() == path.id()));
                }
            }
        }
    }

    #[test]
    fn paths_are_smooth_and_their_arc_lengths_true(seed: u64, far in any::<bool>()) {
        let trails = dense(seed);
        let centre = if far {
            ChunkCoord::new(1_000_000, -1_000_000)
        } else {
            ChunkCoord::new(0, 0)
        };
        for path in trails.in_chunk(centre) {
            let step = 0.05;
            let all: Vec<_> = points(&path, step).collect();
            let step = all[1].0;
            let mut length = 0.0;
            for pair in all.windows(2) {
                let d = pair[1].1 - pair[0].1;
                length += d.length();
                prop_assert!((d.length() / step - 1.0).abs() < 0.01);
                // The direction is that of the path, and turns no faster than on a circle of 4 m.
                let [a, b] = [path.tangent(pair[0].0), path.tangent(pair[1].0)];
                prop_assert!((d / d.length() - a).length() < 0.02, "{} {}", d, a);
                prop_assert!((b - a).length() < step / 4.0 + 1e-6);
                prop_assert!(path.curvature(pair[0].0).abs() < 1.0 / 4.0);
            }
            prop_assert!((length / path.length_m() - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn nearest_is_the_brute_force_answer(
        seed in 0_u64..50,
        x in -60.0_f64..60.0,
        y in -60.0_f64..60.0,
    ) {
        let trails = dense(seed);
        let p = DVec2::new(x, y);
        let radius = 40.0;
        let mut best = f64::INFINITY;
        for chunk in around(ChunkCoord::new(0, 0), 3) {
            for path in trails.in_chunk(chunk) {
                best = points(&path, 0.1)
                    .map(|q| q.1.distance(p))
                    .fold(best, f64::min);
            }
        }
        match trails.nearest(p, radius) {
            Some((path, s)) => {
                let d = path.position_m(s).distance(p);
                prop_assert!(
                    d <= radius && d <= best + 1e-6 && d > best - 0.05,
                    "{} {}",
                    d,
                    best
                );
            }
            None => prop_assert!(best > radius - 0.05),
        }
    }
}

#[test]
fn the_nearest_of_all_is_that_of_those_around() {
    let trails = dense(3);
    let found = |p: DVec2, radius_m: f64| {
        let (path, s) = trails.nearest(p, radius_m)?;
        Some((path.id(), s.to_bits()))
    };
    for i in 0..40 {
        let p = DVec2::new(f64::from(i % 8) * 13.7, f64::from(i / 8) * 21.3);
        let near = found(p, 300.0);
        assert!(near.is_some());
        for radius_m in [1e4, 1e30, f64::INFINITY] {
            assert_eq!(found(p, radius_m), near);
        }
        assert_eq!(found(p, f64::NAN), None);
        assert_eq!(found(p, -1.0), None);
        // Not farther than asked for.
        let (path, s) = trails.nearest(p, 300.0).expect("it is near");
        let away_m = path.position_m(s).distance(p);
        assert_eq!(found(p, 0.99 * away_m), None);
    }
    for lost in [f64::NAN, f64::INFINITY, 1e300, -1e14] {
        assert_eq!(found(DVec2::new(lost, 0.0), f64::INFINITY), None);
    }
    // Where there is none, the search ends.
    let none = TrailParams {
        spawn_probability: 0.0,
        ..TrailParams::default()
    };
    let none = common::trails(none, 3, flat(DVec2::ZERO));
    assert!(none.nearest(DVec2::ZERO, f64::INFINITY).is_none());
    // So does that around a chunk.
    let here = ChunkCoord::new(0, 0);
    let [most, more] = [1000.0, f64::INFINITY].map(|m| none.ground_near(here, m));
    assert_eq!(most.edge_m(DVec2::ZERO), more.edge_m(DVec2::ZERO));
}

#[test]
fn both_sides_of_a_border_know_the_same_crossings() {
    // The same trail from either chunk, in worlds with separate caches.
    let (a, b) = (dense(9), dense(9));
    let mut crossings = 0;
    let pairs = around(ChunkCoord::new(0, 0), 2).flat_map(|c| {
        let east = b.in_chunk(c.offset(1, 0));
        a.in_chunk(c).into_iter().filter_map(move |path| {
            let other = east.iter().find(|p| p.id() == path.id());
            other.map(|other| (path, Arc::clone(other)))
        })
    });
    for (path, other) in pairs {
        crossings += 1;
        assert!(!Arc::ptr_eq(&path, &other));
        for i in 0..200 {
            let s = f64::from(i) / 199.0 * path.length_m();
            assert_eq!(path.position_m(s), other.position_m(s));
            assert_eq!(path.tangent(s), other.tangent(s));
        }
    }
    assert!(crossings > 5);
}

#[test]
fn crossings_keep_off_corners_and_lean_little() {
    let trails = dense(10);
    let mut crossings = 0;
    for path in around(ChunkCoord::new(0, 0), 3).flat_map(|c| trails.in_chunk(c)) {
        let all: Vec<_> = points(&path, 0.1).collect();
        for pair in all.windows(2) {
            let [a, b] = [pair[0].1, pair[1].1].map(|p| (p / SIZE_M).floor());
            if a != b {
                crossings += 1;
                // The point after the border is at most a step beyond it.
                let place = pair[1].1.rem_euclid(DVec2::splat(SIZE_M)) / SIZE_M;
                let (along, across) = if a.x == b.x {
                    (place.x, DVec2::Y)
                } else {
                    (place.y, DVec2::X)
                };
                assert!((0.245..0.755).contains(&along), "{along}");
                assert!(path.tangent(pair[1].0).dot(across).abs() > 0.8);
            }
        }
    }
    assert!(crossings > 5);
}

#[test]
fn tight_turns_are_rare() {
    let trails = dense(11);
    let (mut tight, mut all) = (0, 0);
    let paths: BTreeMap<_, _> = around(ChunkCoord::new(0, 0), 6)
        .flat_map(|c| trails.in_chunk(c).into_iter().map(|p| (p.id(), p)))
        .collect();
    assert!(paths.len() > 20);
    for path in paths.values() {
        for (s, _) in points(path, 0.5) {
            all += 1;
            tight += u32::from(path.curvature(s).abs() > 1.0 / 6.0);
        }
    }
    assert!(
        f64::from(tight) < 0.005 * f64::from(all),
        "{tight} of {all}"
    );
}

#[test]
fn the_order_of_questions_does_not_matter() {
    let ask = |trails: &Trails, chunk: ChunkCoord| {
        let paths: Vec<_> = trails
            .in_chunk(chunk)
            .iter()
            .map(|p| (p.id(), p.length_m(), p.position_m(37.0), p.kind(99.0)))
            .collect();
        format!("{paths:?} {:?}", trails.dressing(chunk))
    };
    let chunks: Vec<_> = around(ChunkCoord::new(7, -3), 3).collect();
    let trails = dense(12);
    let expected: Vec<_> = chunks.iter().map(|&c| ask(&trails, c)).collect();
    // In reverse order, each without a cache, and all at once.
    let again = dense(12);
    for (i, &chunk) in chunks.iter().enumerate().rev() {
        assert_eq!(ask(&again, chunk), expected[i]);
    }
    for (i, &chunk) in chunks.iter().enumerate().step_by(11) {
        assert_eq!(ask(&dense(12), chunk), expected[i]);
    }
    let shared = dense(12);
    std::thread::scope(|scope| {
        for t in 0..4 {
            let (shared, chunks, expected) = (&shared, &chunks, &expected);
            scope.spawn(move || {
                for i in 0..chunks.len() {
                    let i = (i * 17 + t * 13) % chunks.len();
                    assert_eq!(ask(shared, chunks[i]), expected[i]);
                }
            });
        }
    });
}

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

#[test]
fn materials_differ_from_trail_to_trail_and_along_them() {
    let trails = dense(14);
    let (mut kinds, mut changes) = (BTreeSet::new(), 0);
    for chunk in around(ChunkCoord::new(0, 0), 5) {
        for path in trails.in_chunk(chunk) {
            let along: Vec<_> = points(&path, 5.0).map(|p| path.kind(p.0)).collect();
            changes += along.windows(2).filter(|w| w[0] != w[1]).count();
            kinds.extend(along);
        }
    }
    assert_eq!(kinds.len(), TrailSurfaceKind::ALL.len(), "{kinds:?}");
    assert!(changes > 0);
    let mud = TrailParams {
        spawn_probability: 0.1,
        ..TrailParams::of(WayKind::default().surfaced(TrailSurfaceKind::Mud))
    };
    for path in common::trails(mud, 1, flat(DVec2::ZERO)).in_chunk(ChunkCoord::new(0, 0)) {
        assert!(points(&path, 5.0).all(|p| path.kind(p.0) == TrailSurfaceKind::Mud));
    }
}

#[test]
fn impossible_trails_are_refused() {
    let new = |p: TrailParams, size| {
        Trails::new(p, size, Key::world(0), flat(DVec2::ZERO))
            .expect_err("refused")
            .field
    };
    let good = TrailParams::default;
    assert_eq!(
        new(
            TrailParams::of(WayKind {
                width_m: 0.1,
                ..WayKind::default()
            }),
            50.0
        ),
        "width_m"
    );
    assert_eq!(new(good(), 5.0), "chunk_size_m");
    assert_eq!(
        new(
            TrailParams {
                spawn_probability: 1.5,
                ..good()
            },
            50.0
        ),
        "spawn_probability"
    );
    assert_eq!(
        new(
            TrailParams {
                forward_probability: f64::NAN,
                ..good()
            },
            50.0
        ),
        "forward_probability"
    );
    assert_eq!(
        new(
            TrailParams {
                max_length_chunks: 0,
                ..good()
            },
            50.0
        ),
        "max_length_chunks"
    );
    assert_eq!(
        new(
            TrailParams::of(WayKind {
                grass_spread_m: -1.0,
                ..WayKind::default()
            }),
            50.0
        ),
        "grass_spread_m"
    );
    let mut bad = good();
    bad.ways[0].0.section.cut_ratio = 0.0;
    assert_eq!(new(bad, 50.0), "section.cut_ratio");
    let mut bad = good();
    bad.ways[0].0.section.curve = vec![DVec2::new(1.0, 0.0), DVec2::new(1.0, 0.1)];
    assert_eq!(new(bad, 50.0), "section.curve offset");
    let mut bad = TrailParams::default();
    bad.ways[0].0.section.curve = vec![DVec2::new(f64::NEG_INFINITY, 0.0)];
    assert_eq!(new(bad, 50.0), "section.curve offset");
    for beyond in [-10.1, 10.1] {
        let mut bad = TrailParams::default();
        bad.ways[0].0.section.curve = vec![DVec2::new(beyond, 0.0)];
        assert_eq!(new(bad, 50.0), "section.curve offset");
    }
}

#[test]
fn value_stability() {
    // The ground is a sloping plane, because sines differ between platforms.
    let params = TrailParams {
        spawn_probability: 0.1,
        ..TrailParams::default()
    };
    let trails = trails(params, 7, flat(DVec2::new(0.1, -0.05)));
    let chunk = ChunkCoord::new(2, -1);
    let paths = trails.in_chunk(chunk);
    let path = &paths[0];
    let got = [
        format!(
            "{} {:?} {:?}",
            paths.len(),
            path.id().birth,
            path.kind(500.0)
        ),
        format!("{:?} {:?}", path.length_m(), path.position_m(123.0)),
        format!("{:?}", trails.dressing(chunk)[0]),
        format!(
            "{:?}",
            trails
                .dressing(chunk)
                .iter()
                .rfind(|d| d.kind == DressingKind::Stone)
        ),
        format!(
            "{:?}",
            trails
                .dressing(chunk)
                .iter()
                .rfind(|d| d.kind == DressingKind::Verge)
        ),
        format!("{:?}", trails.dressing(chunk).last()),
    ];
    assert_eq!(got, VALUES);
}
const VALUES: [&str; 6] = [
    "3 ChunkCoord { x: -9, y: 0 } LeafLitter",
    "1815.6317408020088 DVec2(-412.52622576885483, -71.0004321911224)",
    "TrailDressing { position_m: DVec2(120.51844378147157, -47.369021413471074), yaw_rad: \
     0.02763158361172375, scale: 1.0875785400079991, kind: Grass }",
    "Some(TrailDressing { position_m: DVec2(115.56678910244048, -5.182610678238906), yaw_rad: \
     0.4125438364883822, scale: 0.9, kind: Stone })",
    "Some(TrailDressing { position_m: DVec2(149.8107142412161, -12.778436750346291), yaw_rad: \
     0.5573484738590785, scale: 1.3742250095982231, kind: Verge })",
    "Some(TrailDressing { position_m: DVec2(116.02647474273905, -7.057548883499383), yaw_rad: \
     4.899359469878036, scale: 1.0412154456416638, kind: Strip })",
];

#[test]
fn value_stability_of_branches_and_steps() {
    let params = TrailParams {
        spawn_probability: 0.1,
        fork_probability: 0.2,
        ..TrailParams::of(WayKind::footpath())
    };
    let trails = trails(params, 7, flat(DVec2::new(0.3, -0.15)));
    let mut branches = around(ChunkCoord::new(0, 0), 4)
        .flat_map(|c| trails.in_chunk(c))
        .filter(|p| p.id().is_branch());
    let branch = branches.next().expect("there are branches");
    let chunk = branch.chunks().last().expect("it goes through chunks");
    let dressing = trails.dressing(chunk);
    let got = [
        format!("{:?}", branch.id()),
        format!("{:?} {:?}", branch.length_m(), branch.position_m(60.0)),
        format!(
            "{:?}",
            dressing.iter().rfind(|d| d.kind == DressingKind::Step)
        ),
    ];
    assert_eq!(got, BRANCH_VALUES);
}
const BRANCH_VALUES: [&str; 3] = [
    "TrailId { birth: ChunkCoord { x: -7, y: 0 }, number: 2147483656 }",
    "256.7373824345565 DVec2(-135.42595126944278, -35.880018200685186)",
    "Some(TrailDressing { position_m: DVec2(-216.33622077615559, -100.39023113958902), yaw_rad: \
     0.39344523184298813, scale: 0.533481754970602, kind: Step })",
];

#[test]
fn branches_leave_their_trail_at_an_acute_angle() {
    let trails = dense(5);
    let mut branches = BTreeSet::new();
    for chunk in around(ChunkCoord::new(0, 0), 9) {
        let paths = trails.in_chunk(chunk);
        for branch in paths.iter().filter(|p| p.id().is_branch()) {
            let start = branch.position_m(0.0);
            if branch.chunks().next() != Some(chunk) || !branches.insert(branch.id()) {
                continue;
            }
            let trail = paths
                .iter()
                .find(|p| p.id().birth == branch.id().birth && !p.id().is_branch())
                .expect("a branch begins at its trail");
            assert_eq!(trail.way_number(), branch.way_number());
            // Where it begins, it is the trail, and goes its way.
            let (s, gap) = points(trail, 0.05)
                .map(|(s, p)| (s, p.distance(start)))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .expect("points");
            assert!(gap < 0.06, "{gap}");
            assert!(trail.tangent(s).dot(branch.tangent(0.0)) > 0.99);
            // Then it leaves it.
            let apart = |ahead: f64| {
                let place = branch.position_m(ahead);
                let on = points(trail, 0.5).filter(|(at, _)| (s..s + 60.0).contains(at));
                let away = on.map(|(_, p)| p.distance(place));
                away.fold(f64::INFINITY, f64::min)
            };
            let [soon, later] = [5.0, 32.0].map(apart);
            assert!(soon < 3.0 && later > 4.0, "{soon} {later}");
        }
    }
    assert!(branches.len() > 20, "{}", branches.len());
}
