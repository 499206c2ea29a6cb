//! The ground of ways of different kinds, and where they meet.

use std::sync::Arc;

use crate::common::{SIZE_M, around, flat, given, hills, mixed, trails};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_trails::{TrailParams, TrailZone, WayKind};
use proptest::prelude::*;

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
