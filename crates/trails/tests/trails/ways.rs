//! Kinds of way: their shares, widths and ends, and changes along their run.

use std::collections::{BTreeMap, BTreeSet};

use crate::common::{
    self, SIZE_M, all_ways, around, dense, flat, hills, mixed, northward, points, trails,
};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::Key;
use nemoral_trails::{TrailParams, TrailSurfaceKind, Trails, WayKind};

#[test]
fn kinds_come_with_their_shares_whatever_is_asked_first() {
    let (a, b) = (
        trails(mixed(), 3, hills(0.2)),
        trails(mixed(), 3, hills(0.2)),
    );
    let chunks: Vec<_> = around(ChunkCoord::new(0, 0), 12).collect();
    let count = |trails: &Trails, chunks: &mut dyn Iterator<Item = &ChunkCoord>| {
        let mut kinds = BTreeMap::new();
        for chunk in chunks {
            for path in trails.in_chunk(*chunk) {
                assert_eq!(*path.way(), all_ways()[path.way_number()].0);
                kinds.insert(path.id(), path.way_number());
            }
        }
        kinds
    };
    let kinds = count(&a, &mut chunks.iter());
    assert_eq!(kinds, count(&b, &mut chunks.iter().rev()));
    let total: f64 = all_ways().iter().map(|w| w.1).sum();
    for (number, (_, share)) in all_ways().iter().enumerate() {
        let got = kinds.values().filter(|n| **n == number).count() as f64;
        let (n, p) = (kinds.len() as f64, share / total);
        let sigma = (n * p * (1.0 - p)).sqrt();
        assert!((got - n * p).abs() < 3.5 * sigma, "{number}: {got} of {n}");
    }
    // No trail of a share of 0.
    let mut rare = mixed();
    rare.ways[0].1 = 0.0;
    let kinds = count(&trails(rare, 3, hills(0.2)), &mut chunks.iter());
    assert!(kinds.values().all(|n| *n != 0));
}

#[test]
fn kinds_without_a_share_change_nothing() {
    let track = WayKind::default();
    let one = TrailParams {
        spawn_probability: 0.1,
        max_length_chunks: 14,
        ..TrailParams::of(track.clone())
    };
    let mut six = TrailParams {
        ways: all_ways(),
        ..one.clone()
    };
    for (i, way) in six.ways.iter_mut().enumerate() {
        way.1 = f64::from(u8::from(i == 1));
    }
    let [one, six] = [one, six].map(|params| trails(params, 11, hills(0.3)));
    for chunk in around(ChunkCoord::new(0, 0), 1) {
        let grounds = [&one, &six].map(|t| t.ground_near(chunk, 2.0));
        let [a, b] = &grounds;
        assert_eq!(a.fine_m(), b.fine_m());
        for i in 0..2500 {
            let p = chunk.origin_m(SIZE_M) + DVec2::new(f64::from(i % 50), f64::from(i / 50)) + 0.3;
            assert_eq!(a.sample(p), b.sample(p));
            assert_eq!((a.border_m(p), a.kind(p)), (b.border_m(p), b.kind(p)));
        }
        assert_eq!(one.dressing(chunk), six.dressing(chunk));
    }
}

#[test]
fn shapes_are_as_fine_in_every_chunk() {
    // Else the meshes of neighbours would differ along their border.
    let trails = trails(mixed(), 2, hills(0.3));
    let fine = trails.ground_near(ChunkCoord::new(0, 0), 1.0).fine_m();
    let ditch = WayKind::forest_road()
        .section
        .ditch
        .expect("a road has one");
    assert!(fine > ditch.width_m);
    for chunk in around(ChunkCoord::new(50, -9), 6) {
        assert_eq!(trails.ground_near(chunk, 1.0).fine_m(), fine);
    }
}

#[test]
fn widths_are_those_of_the_kinds() {
    for (way, _) in all_ways() {
        let (trails, path) = northward(way.clone(), hills(0.2));
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for i in -200..200 {
            let s = 120.0 + f64::from(i) * 0.5;
            let (p, left) = (path.position_m(s), path.tangent(s).perp());
            let ground = trails.ground_near(ChunkCoord::containing(p, SIZE_M), 10.0);
            // The edges are searched on the surface, to half a centimetre.
            let reach = |side: f64| {
                let out = |k: i32| p + left * (side * 0.005 * f64::from(k));
                let beyond = (0..2000).find(|&k| ground.edge_m(out(k)) > 0.0);
                0.005 * f64::from(beyond.expect("it ends"))
            };
            let width = reach(1.0) + reach(-1.0);
            assert!((width - path.width_m(s)).abs() < 0.03, "{width}");
            (low, high) = (low.min(width), high.max(width));
        }
        let spread = way.width_m * way.width_variation;
        let range = way.width_m - spread - 0.03..way.width_m + spread + 0.03;
        assert!(
            range.contains(&low) && range.contains(&high),
            "{low} {high}"
        );
        // It does vary.
        assert!(high - low >= 0.8 * spread, "{low} {high} {spread}");
    }
}

#[test]
fn roads_end_in_loops_around_islands() {
    let of_roads = |turning_radius_m| {
        let road = WayKind {
            turning_radius_m,
            ..WayKind::forest_road()
        };
        let params = TrailParams {
            spawn_probability: 0.04,
            max_length_chunks: 8,
            ..TrailParams::of(road)
        };
        trails(params, 11, hills(0.1))
    };
    let trails = of_roads(7.0);
    let mut loops = 0;
    let mut seen = std::collections::BTreeSet::new();
    for chunk in ChunkCoord::new(0, 0).square(8) {
        for path in trails.in_chunk(chunk) {
            if !seen.insert(path.id()) {
                continue;
            }
            let length_m = path.length_m();
            let once_m = 7.0 * std::f64::consts::FRAC_PI_3 * 7.0;
            for [end_m, inner_m] in [[0.0, once_m], [length_m, length_m - once_m]] {
                let [foot, back] = [end_m, inner_m].map(|s| path.position_m(s));
                assert!(foot.distance(back) < 0.02, "{foot} {back}");
                // The loop's middle is an island, all around it is road.
                let out = path.tangent(inner_m) * if end_m > 0.0 { 1.0 } else { -1.0 };
                let middle = foot + out * 7.0 * f64::sqrt(3.0);
                let home = ChunkCoord::containing(foot, SIZE_M);
                let ground = trails.ground_near(home, 1.0);
                let island_m = ground.edge_m(middle);
                assert!((4.5..=5.6).contains(&island_m), "{island_m}");
                for i in 0..100 {
                    let s = once_m * f64::from(i) / 100.0;
                    let p = path.position_m(if end_m > 0.0 { length_m - s } else { s });
                    assert_eq!(ChunkCoord::containing(p, SIZE_M), home);
                    assert!(ground.edge_m(p) < -0.4, "{}", ground.edge_m(p));
                }
                loops += 1;
            }
        }
    }
    assert!(loops > 8, "{loops}");
    // Without a radius, roads end as all ways do.
    let (path, _) = of_roads(0.0)
        .nearest(DVec2::ZERO, 500.0)
        .expect("there is one");
    assert!(path.position_m(0.0).distance(path.position_m(51.3)) > 10.0);
}

#[test]
fn surfaces_change_along_a_way_without_straight_lines() {
    let way = WayKind {
        surfaces: WayKind::ALL_SURFACES,
        change: 0.8,
        ..WayKind::forest_road()
    };
    let (trails, path) = northward(way, flat(DVec2::ZERO));
    let kinds: Vec<_> = (0..480).map(|i| path.kind(f64::from(i) * 0.5)).collect();
    let changes: Vec<_> = (1..480).filter(|&i| kinds[i] != kinds[i - 1]).collect();
    assert!(changes.len() >= 6, "{changes:?}");
    // Where the material changes, it changes elsewhere on the left than on the right.
    let mut ragged = 0;
    for &i in &changes {
        let s0 = i as f64 * 0.5;
        let flip = |offset: f64| {
            (-40..40).map(f64::from).find(|k| {
                let s = s0 + 0.05 * k;
                let p = path.position_m(s) + path.tangent(s).perp() * offset;
                let ground = trails.ground_near(ChunkCoord::containing(p, SIZE_M), 1.0);
                ground.kind(p) == Some(kinds[i])
            })
        };
        if let (Some(a), Some(b)) = (flip(-1.2), flip(1.2)) {
            ragged += i32::from((a - b).abs() > 4.0);
        }
    }
    assert!(
        ragged * 3 >= changes.len() as i32,
        "{ragged} of {}",
        changes.len()
    );
    // A way without changes has straight ends.
    let still = WayKind {
        change: 0.0,
        ..WayKind::default()
    };
    let (trails, path) = northward(still, flat(DVec2::ZERO));
    for i in 0..240 {
        let s = f64::from(i);
        for offset in [-1.0, 0.3, 1.2] {
            let p = path.position_m(s) + path.tangent(s).perp() * offset;
            let ground = trails.ground_near(ChunkCoord::containing(p, SIZE_M), 1.0);
            let (here, there) = (path.kind(s - 0.01), path.kind(s + 0.01));
            let got = ground.kind(p);
            assert!(got.is_none_or(|k| k == here || k == there), "{s}");
        }
    }
}

#[test]
fn a_kind_without_a_share_bounds_no_chunk() {
    let params = |share| TrailParams {
        ways: vec![(WayKind::default(), 1.0), (WayKind::firebreak(), share)],
        ..TrailParams::default()
    };
    let made = |share| Trails::new(params(share), 20.0, Key::world(1), flat(DVec2::ZERO));
    assert!(made(0.0).is_ok());
    let refused = made(0.1).expect_err("a firebreak needs 24 m").to_string();
    assert!(refused.contains("4 times width_m"), "{refused}");
}

#[test]
fn impossible_ways_are_refused() {
    let refused = |change: &dyn Fn(&mut WayKind)| {
        let mut way = WayKind::forest_road();
        change(&mut way);
        let params = TrailParams::of(way);
        Trails::new(params, 50.0, Key::world(0), flat(DVec2::ZERO))
            .expect_err("refused")
            .field
    };
    assert_eq!(refused(&|w| w.width_m = 13.0), "width_m");
    assert_eq!(refused(&|w| w.width_variation = 0.7), "width_variation");
    assert_eq!(refused(&|w| w.change = f64::NAN), "change");
    assert_eq!(refused(&|w| w.surfaces = [0.0; 8]), "surfaces");
    assert_eq!(refused(&|w| w.section.levelling = 1.1), "section.levelling");
    assert_eq!(refused(&|w| w.section.reach_m = 1.0), "section.reach_m");
    assert_eq!(refused(&|w| w.section.earth_m = 0.1), "section.earth_m");
    assert_eq!(refused(&|w| w.section.earth_m = 31.0), "section.earth_m");
    assert_eq!(refused(&|w| w.section.sink_m = 2.0), "section.sink_m");
    assert_eq!(refused(&|w| w.section.hollow_m = -1.0), "section.hollow_m");
    assert_eq!(
        refused(&|w| w.section.ditch.as_mut().expect("a road").depth_m = 2.0),
        "section.ditch.depth_m"
    );
    assert_eq!(
        refused(&|w| w.section.ditch.as_mut().expect("a road").width_m = 3.0),
        "section.ditch.width_m"
    );
    assert_eq!(refused(&|w| w.roots_per_m = 6.0), "roots_per_m");
    assert_eq!(refused(&|w| w.stone_beds = -0.1), "stone_beds");
    assert_eq!(refused(&|w| w.turning_radius_m = 15.1), "turning_radius_m");
    let shares = |ways: Vec<(WayKind, f64)>| {
        let params = TrailParams {
            ways,
            ..TrailParams::default()
        };
        Trails::new(params, 50.0, Key::world(0), flat(DVec2::ZERO))
            .expect_err("refused")
            .field
    };
    assert_eq!(shares(Vec::new()), "ways");
    assert_eq!(shares(vec![(WayKind::default(), 0.0)]), "ways");
    assert_eq!(shares(vec![(WayKind::default(), -1.0)]), "ways share");
}

#[test]
fn value_stability() {
    let trails = trails(mixed(), 7, flat(DVec2::new(0.1, -0.05)));
    let mut got = Vec::new();
    for number in [0, 2, 3, 4, 5] {
        let (path, s) = trails
            .nearest_where(DVec2::ZERO, 400.0, |p| p.way_number() == number)
            .expect("there is one of each");
        let p = path.position_m(s) + path.tangent(s).perp() * 0.15;
        let ground = trails.ground_near(ChunkCoord::containing(p, SIZE_M), 20.0);
        let beside = p + path.tangent(s).perp() * (0.5 * path.width_m(s) + 0.3);
        got.push(format!(
            "{} {:?} {:?} {:?} {:?}",
            TrailSurfaceKind::name(path.kind(s)),
            ground.zone(p),
            ground.height_m(p),
            ground.height_m(beside),
            path.width_m(s),
        ));
    }
    assert_eq!(got, VALUES);
}
const VALUES: [&str; 5] = [
    "gravel Strip -0.7525483515174816 -0.8396287176826756 3.569733253007005",
    "leaf_litter Strip 16.02894295969607 15.935312386792898 1.1424313020654346",
    "grassy Strip 15.410189942026653 15.285706033233183 7.7235565306460545",
    "rock Surface 13.166778316932383 13.18124331407704 0.9471141720461612",
    "dry_earth Surface 3.706215627359822 3.790676017745872 0.4",
];

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
