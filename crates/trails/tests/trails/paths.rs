//! The paths of trails.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::common::{self, SIZE_M, around, dense, flat, points, trails};
use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;
use nemoral_seed::Key;
use nemoral_trails::{DressingKind, TrailParams, Trails, WayKind};
use proptest::prelude::*;

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
