//! Kinds of way: their sections, joins, and changes along their run.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::common::{SIZE_M, around, flat, given, hills, northward, plain, trails};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::Key;
use nemoral_trails::{CrossSection, TrailParams, TrailSurfaceKind, TrailZone, Trails, WayKind};
use proptest::prelude::*;

fn all_ways() -> Vec<(WayKind, f64)> {
    vec![
        (WayKind::forest_road(), 1.0),
        (WayKind::default(), 1.0),
        (WayKind::skid_trail(), 1.0),
        (WayKind::firebreak(), 0.5),
        (WayKind::footpath(), 2.0),
        (WayKind::deer_path(), 1.0),
    ]
}

fn mixed() -> TrailParams {
    TrailParams {
        spawn_probability: 0.1,
        max_length_chunks: 14,
        ways: all_ways(),
        ..TrailParams::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn grounds_of_neighbours_agree_to_the_bit(
        seed: u64,
        x in -1_000_000..1_000_000,
        y in -1_000_000..1_000_000,
        east in any::<bool>(),
    ) {
        let trails = trails(mixed(), seed, hills(0.4));
        let here = ChunkCoord::new(x, y);
        let there = if east { here.offset(1, 0) } else { here.offset(0, 1) };
        let (a, b) = (trails.ground_near(here, 5.0), trails.ground_near(there, 3.0));
        let corner = there.origin_m(SIZE_M);
        let along = if east { DVec2::Y } else { DVec2::X };
        for i in 0..=600 {
            for off in [0.0, -2.9, 2.9] {
                let p = corner + along * (f64::from(i) / 600.0 * SIZE_M) + along.perp() * off;
                prop_assert_eq!(a.sample(p), b.sample(p));
                prop_assert_eq!(
                    (a.edge_m(p), a.border_m(p), a.way_number(p)),
                    (b.edge_m(p), b.border_m(p), b.way_number(p))
                );
                prop_assert_eq!(
                    (a.zone(p), a.kind(p), a.offset_m(p)),
                    (b.zone(p), b.kind(p), b.offset_m(p))
                );
            }
        }
    }

    #[test]
    fn neighbours_agree_to_the_bit_about_forks(seed: u64) {
        let params = TrailParams {
            fork_probability: 0.5,
            ..mixed()
        };
        let trails = trails(params, seed, hills(0.4));
        for chunk in around(ChunkCoord::new(0, 0), 2) {
            let [here, east] = [chunk, chunk.offset(1, 0)].map(|c| trails.ground_near(c, 25.0));
            let border = chunk.offset(1, 0).origin_m(SIZE_M);
            for i in 0..1500 {
                let p = border + DVec2::new(f64::from(i % 30) * 0.4 - 6.0, f64::from(i / 30));
                prop_assert_eq!(here.sample(p), east.sample(p), "{}", p);
                prop_assert_eq!(here.edge(p), east.edge(p), "{}", p);
            }
        }
    }

    #[test]
    fn the_ground_is_continuous_and_gradients_are_difference_quotients(seed: u64) {
        let trails = trails(mixed(), seed, hills(0.4));
        let (mut near, mut off) = (0, 0);
        for chunk in around(ChunkCoord::new(0, 0), 1) {
            let ground = trails.ground_near(chunk, 1.0);
            for i in 0..3000 {
                let p = chunk.origin_m(SIZE_M)
                    + DVec2::new(f64::from(i) * 0.618_034, f64::from(i) * 0.414_214)
                        .rem_euclid(DVec2::splat(SIZE_M));
                let e = 1e-5;
                let h = |d: DVec2| ground.height_m(p + d * e);
                let steps = [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y].map(h);
                let here = ground.height_m(p);
                prop_assert!(
                    steps.iter().all(|s| (s - here).abs() < 30.0 * e),
                    "{} {:?} at {}",
                    here,
                    steps,
                    p
                );
                let expected = DVec2::new(steps[0] - steps[1], steps[2] - steps[3]) / (2.0 * e);
                if ground.edge_m(p) < 5.0 {
                    near += 1;
                    off += i32::from((ground.sample(p).gradient - expected).length() > 0.01);
                }
            }
        }
        prop_assert!(off * 100 <= near, "{} of {}", off, near);
    }

    #[test]
    fn borders_between_parts_are_where_signs_change(seed in 0_u64..1000) {
        let trails = trails(mixed(), seed, hills(0.3));
        let chunk = ChunkCoord::new(0, 0);
        let ground = trails.ground_near(chunk, 1.0);
        let sign = |p: DVec2| ground.border_m(p) < 0.0;
        for i in 0..4000 {
            let p = chunk.origin_m(SIZE_M)
                + DVec2::new(f64::from(i) * 0.618_034, f64::from(i) * 0.414_214)
                    .rem_euclid(DVec2::splat(SIZE_M));
            let inside = matches!(ground.zone(p), TrailZone::Surface | TrailZone::Strip);
            prop_assert_eq!(inside, sign(p));
            prop_assert_eq!(
                ground.way_number(p).is_some(),
                ground.edge_m(p) <= 0.0,
            );
        }
    }
}

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
fn a_ditch_is_as_deep_and_wide_as_it_says_and_uphill() {
    let way = WayKind::forest_road();
    let ditch = way.section.ditch.expect("a road has one");
    // It rises to the east, which is to the right of a way to the north.
    let base = flat(DVec2::new(0.2, 0.0));
    let (trails, path) = northward(way, Arc::clone(&base));
    for i in -50..50 {
        let s = 120.0 + f64::from(i);
        let (p, right) = (path.position_m(s), -path.tangent(s).perp());
        let ground = trails.ground_near(ChunkCoord::containing(p, SIZE_M), 12.0);
        let half = 0.5 * path.width_m(s);
        let height = |offset: f64| ground.height_m(p + right * offset);
        let middle = half + 0.5 * ditch.width_m;
        let depth = height(half) - height(middle);
        // The surface beside the edge rises to the formation by the camber.
        assert!((depth - ditch.depth_m).abs() < 0.06, "{depth}");
        // Beyond its width the cut slope has begun.
        assert!(height(half + ditch.width_m + 0.4) > height(middle) + ditch.depth_m);
        // There is no ditch downhill, and a fill slope.
        let down = height(-half) - height(-half - 0.5 * ditch.width_m);
        let natural = base.height_m(p) - base.height_m(p - right * middle);
        assert!((-0.01..natural).contains(&down), "{down}");
        let zone = |offset: f64| ground.zone(p + right * offset);
        assert_eq!(zone(middle), TrailZone::CutSlope);
        assert_ne!(zone(half - 0.05), TrailZone::CutSlope);
        // The camber: 4 % of half the width.
        let camber = height(0.0) - height(half - 0.01);
        assert!((camber - 0.04 * half).abs() < 0.05, "{camber}");
    }
    // On level ground there is one on both sides.
    let (trails, path) = northward(WayKind::forest_road(), flat(DVec2::ZERO));
    let p = path.position_m(120.0);
    let ground = trails.ground_near(ChunkCoord::containing(p, SIZE_M), 12.0);
    for side in [-1.0, 1.0] {
        let bed = p + path.tangent(120.0).perp() * side * (0.5 * path.width_m(120.0) + 0.6);
        let depth = 10.0 - ground.height_m(bed);
        assert!((depth - ditch.depth_m).abs() < 0.06, "{depth}");
    }
}

#[test]
fn paths_are_hollow_where_they_are_steep_and_deer_barely_carve() {
    let depth = |way: WayKind, slope: DVec2| {
        let base = flat(slope);
        let (trails, path) = northward(way, Arc::clone(&base));
        let p = path.position_m(120.0);
        let ground = trails.ground_near(ChunkCoord::containing(p, SIZE_M), 10.0);
        base.height_m(p) - ground.height_m(p)
    };
    let CrossSection {
        sink_m, hollow_m, ..
    } = WayKind::footpath().section;
    let level = depth(WayKind::footpath(), DVec2::ZERO);
    assert!((level - sink_m).abs() < 1e-6, "{level}");
    let steep = depth(WayKind::footpath(), DVec2::new(0.0, 0.3));
    assert!((steep - sink_m - hollow_m).abs() < 1e-6, "{steep}");
    let half = depth(WayKind::footpath(), DVec2::new(0.0, -0.1));
    assert!((half - sink_m - 0.5 * hollow_m).abs() < 1e-6, "{half}");
    // The ground under a deer path changes by centimetres wherever it runs.
    let base = hills(0.4);
    let (trails, path) = northward(WayKind::deer_path(), Arc::clone(&base));
    for i in 10..230 {
        let p = path.position_m(f64::from(i));
        let ground = trails.ground_near(ChunkCoord::containing(p, SIZE_M), 10.0);
        for offset in [-3.0, -1.0, -0.4, 0.0, 0.1, 0.7, 2.0] {
            let p = p + path.tangent(f64::from(i)).perp() * offset;
            let change = ground.height_m(p) - base.height_m(p);
            assert!(change.abs() < 0.15, "{change}");
            assert!(offset.abs() < 2.5 || change == 0.0, "{change} at {offset}");
        }
    }
}

#[test]
fn no_way_moves_more_earth_than_it_may() {
    // Straight down 45 %, where a grade of 20 % would need 30 m of earth.
    let base = flat(DVec2::new(0.0, -0.45));
    for earth_m in [0.5, 3.0, 10.0] {
        let way = WayKind {
            section: CrossSection { earth_m, ..plain() },
            ..WayKind::default()
        };
        let (trails, path) = northward(way, Arc::clone(&base));
        let moved = |s: f64| {
            let p = path.position_m(s);
            let ground = trails.ground_near(ChunkCoord::containing(p, SIZE_M), 1.0);
            ground.height_m(p) - base.height_m(p)
        };
        // Neighbouring heights are averaged, on a run that is steeper or less steep there.
        let (low, high) = (moved(20.0), moved(220.0));
        assert!((low + earth_m).abs() < 0.3, "{low} of {earth_m}");
        assert!((high - earth_m).abs() < 0.3, "{high} of {earth_m}");
        for i in 0..=240 {
            let moved = moved(f64::from(i));
            assert!(moved.abs() < earth_m + 0.3, "{moved} at {i}");
        }
    }
}

#[test]
fn lines_that_meet_end_to_end_are_as_wide_there_as_elsewhere() {
    let vertex = |x: f64| DVec2::new(x, 3.0);
    let way = || vec![(WayKind::default(), 1.0)];
    let [first, second] = [[-80.0, 10.0], [10.04, 90.0]].map(|x| x.map(vertex));
    // All lines at once, or one after the other.
    let params = TrailParams {
        spawn_probability: 0.0,
        ways: way(),
        ..TrailParams::default()
    };
    let at_once = trails(params, 5, hills(0.2))
        .along(&[first.to_vec(), second.to_vec()], 0)
        .expect("finite");
    let one_by_one = given(way(), &[(0, first), (0, second)], hills(0.2));
    for trails in [&at_once, &one_by_one] {
        let ground = trails.ground_near(ChunkCoord::new(0, 0), 50.0);
        for i in 0..200 {
            let p = vertex(-5.0 + 0.15 * f64::from(i));
            let edge_m = ground.edge_m(p);
            assert!((edge_m + 1.5).abs() < 0.05, "{edge_m} at {p}");
            // Nor are they wider, as if there were a corner to round.
            for side in [-1.6, 1.6] {
                let edge_m = ground.edge_m(p + DVec2::new(0.0, side));
                assert!((edge_m - 0.1).abs() < 0.05, "{edge_m} beside {p}");
            }
        }
        // Their other ends are free.
        let paths = trails.in_chunk(ChunkCoord::new(0, 0));
        assert_eq!(paths.len(), 2);
        let widths: Vec<f64> = (paths.iter())
            .flat_map(|p| [p.width_m(0.0), p.width_m(p.length_m())])
            .collect();
        let ends = [0.9, 3.0, 3.0, 0.9];
        assert!(
            widths
                .iter()
                .zip(ends)
                .all(|(w, end)| (w - end).abs() < 1e-9),
            "{widths:?}"
        );
    }
    let ground = [&at_once, &one_by_one].map(|t| t.ground_near(ChunkCoord::new(0, 0), 5.0));
    for i in 0..500 {
        let p = DVec2::new(f64::from(i) * 0.1, f64::from(i % 60) * 0.1);
        assert_eq!(ground[0].sample(p), ground[1].sample(p));
    }
    // A line that is alone fades at both ends, and one that comes back at none.
    let alone = given(way(), &[(0, first)], hills(0.2));
    let (path, _) = alone.nearest(vertex(0.0), 5.0).expect("it is near");
    assert!(path.width_m(0.0) < 1.0 && path.width_m(path.length_m()) < 1.0);
    let corners = [
        [0.0, 0.0],
        [40.0, 0.0],
        [40.0, 40.0],
        [0.0, 40.0],
        [0.0, 0.0],
    ];
    let round = corners.map(DVec2::from_array).to_vec();
    let params = TrailParams {
        spawn_probability: 0.0,
        ..TrailParams::default()
    };
    let looped = trails(params, 5, flat(DVec2::ZERO))
        .along(&[round], 0)
        .expect("finite");
    let (path, _) = looped.nearest(DVec2::ZERO, 5.0).expect("it is near");
    assert_eq!(
        (path.width_m(0.0), path.width_m(path.length_m())),
        (3.0, 3.0)
    );
}

#[test]
fn borders_change_by_up_to_the_root_of_two_in_rounded_corners() {
    // As in obtuse corners, where ways cross at an acute angle.
    let second = DVec2::new(60.0 * libm::cos(0.35), 60.0 * libm::sin(0.35));
    let first = DVec2::new(60.0, 0.0);
    let lines = [(0, [-first, first]), (0, [-second, second])];
    let trails = given(vec![(WayKind::default(), 1.0)], &lines, flat(DVec2::ZERO));
    let ground = trails.ground_near(ChunkCoord::new(0, 0), 20.0);
    let mut fastest = 0.0_f64;
    for line in 0..80 {
        for i in 0..800 {
            let [across, along] = [f64::from(line) * 0.1, f64::from(i) * 0.01].map(|x| x - 4.0);
            let a = DVec2::new(across, along);
            let b = a + DVec2::new(0.0, 0.01);
            if ground.edge_m(a) > 0.0 && ground.edge_m(b) > 0.0 {
                let change = (ground.border_m(b) - ground.border_m(a)).abs();
                fastest = fastest.max(change / 0.01);
            }
        }
    }
    // A mesh relies on 1.1, so that the README's adapter divides by 1.3.
    assert!((1.2..1.43).contains(&fastest), "{fastest}");
}

#[test]
fn a_firebreak_follows_the_ground() {
    // A plane that falls across it is not levelled: the slope across stays.
    let base = flat(DVec2::new(0.25, 0.05));
    let (trails, path) = northward(WayKind::firebreak(), Arc::clone(&base));
    let p = path.position_m(120.0);
    let ground = trails.ground_near(ChunkCoord::containing(p, SIZE_M), 10.0);
    for offset in [-2.5, -2.0, 0.0, 2.0, 2.5] {
        let p = p + path.tangent(120.0).perp() * offset;
        let scraped = base.height_m(p) - ground.height_m(p);
        assert!((scraped - 0.08).abs() < 0.03, "{scraped} at {offset}");
    }
}

#[test]
fn a_path_fades_into_the_road_that_it_meets() {
    let road = [DVec2::new(-90.0, 4.0), DVec2::new(90.0, 9.0)];
    let path = [DVec2::new(2.0, -80.0), DVec2::new(-7.0, 85.0)];
    // Widths vary by the number of the line, which differs.
    let footpath = WayKind {
        width_variation: 0.0,
        ..WayKind::footpath()
    };
    let ways = || vec![(WayKind::forest_road(), 1.0), (footpath.clone(), 1.0)];
    let both = given(ways(), &[(0, road), (1, path)], hills(0.4));
    let alone = given(ways(), &[(0, road)], hills(0.4));
    let foot = given(ways(), &[(1, path)], hills(0.4));
    let (mut on_road, mut faded) = (0, 0);
    for chunk in around(ChunkCoord::new(0, 0), 1) {
        let grounds = [&both, &alone, &foot].map(|t| t.ground_near(chunk, 1.0));
        let [both, alone, foot] = &grounds;
        for i in 0..10_000 {
            let p = chunk.origin_m(SIZE_M)
                + 0.1
                + DVec2::new(f64::from(i % 100), f64::from(i / 100)) * 0.5;
            let edge = alone.edge_m(p);
            if edge <= 0.0 {
                // The road is as it was, and its parts too.
                assert_eq!(both.sample(p), alone.sample(p));
                assert_eq!(both.way_number(p), Some(0));
                assert_eq!(both.zone(p), alone.zone(p));
                on_road += 1;
            } else if edge > 2.0 && foot.edge_m(p) < 0.0 {
                // Where the road does not reach, the path is as it was.
                assert_eq!(both.way_number(p), Some(1));
                if edge == f64::INFINITY {
                    let change = both.height_m(p) - foot.height_m(p);
                    assert!(change.abs() < 1e-9, "{change}");
                }
            } else if edge > 0.0 && foot.edge_m(p) < 0.0 {
                // Between, it is sunk into the road's ground less and less.
                assert!((both.height_m(p) - alone.height_m(p)).abs() < 0.6);
                faded += 1;
            }
        }
    }
    assert!(on_road > 500 && faded >= 4, "{on_road} {faded}");
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
fn of_unequal_ways_the_nearest_edge_counts() {
    // A wide trail and a narrow one side by side, with a ridge between that is cut.
    let ridge = |p: DVec2| 3.0 * libm::exp(-(p.x - 4.0).powi(2));
    struct Ridge<F>(F);
    impl<F: Fn(DVec2) -> f64 + Send + Sync> Surface for Ridge<F> {
        fn sample(&self, p: DVec2) -> nemoral_scene::SurfaceSample {
            let height_m = (self.0)(p);
            nemoral_scene::SurfaceSample {
                height_m,
                gradient: DVec2::new(-2.0 * (p.x - 4.0) * height_m, 0.0),
            }
        }
    }
    let wide = WayKind {
        width_m: 4.0,
        width_variation: 0.0,
        ..WayKind::skid_trail()
    };
    let ways = vec![(wide, 1.0), (WayKind::default(), 1.0)];
    let line = |x: f64| [DVec2::new(x, -60.0), DVec2::new(x, 60.0)];
    let lines = [(0, line(8.05)), (1, line(0.0))];
    let trails = given(ways, &lines, Arc::new(Ridge(ridge)));
    let ground = trails.ground_near(ChunkCoord::new(0, 0), 5.0);
    let at = |x: f64| DVec2::new(x, 20.3);
    for i in 0..8000 {
        let (a, b) = (at(f64::from(i) * 1e-3), at(f64::from(i + 1) * 1e-3));
        let step = (ground.height_m(a) - ground.height_m(b)).abs();
        assert!(step < 0.02, "{step} m at {a}");
        let step = (ground.edge_m(a) - ground.edge_m(b)).abs();
        assert!(step < 2e-3, "the edge jumps by {step} m at {a}");
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
fn lines_that_are_none_make_no_kind_used() {
    let wide = WayKind {
        width_m: 6.0,
        ..WayKind::default()
    };
    let params = TrailParams {
        ways: vec![(WayKind::forest_road(), 1.0), (wide, 0.0)],
        ..mixed()
    };
    let without = trails(params.clone(), 4, hills(0.4));
    let with = trails(params, 4, hills(0.4))
        .along(&[], 1)
        .expect("no lines");
    let mut near = 0;
    for chunk in around(ChunkCoord::new(0, 0), 2) {
        let [a, b] = [&without, &with].map(|t| t.ground_near(chunk, 2.0));
        for i in 0..400 {
            let p = chunk.origin_m(SIZE_M) + 2.5 * DVec2::new(f64::from(i % 20), f64::from(i / 20));
            assert_eq!(a.sample(p), b.sample(p));
            near += i32::from(a.edge_m(p) < 8.0);
        }
    }
    assert!(near > 100, "{near}");
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
