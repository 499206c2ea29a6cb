//! The ground and the distance to the edge have no steps, wherever trails meet, end or bend.

use std::sync::Arc;

use crate::common::{SIZE_M, around, flat, hills, trails};
use nemoral_scene::glam::{DVec2, Vec2Swizzles};
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_trails::{TrailGround, TrailParams, Trails, WayKind};
use proptest::prelude::*;

/// The steps along a line, metres.
const STRIDE_M: f64 = 0.05;

/// A change that is larger than this within less than a micrometre is a step, metres.
const STEP_M: f64 = 5e-3;

/// What is left of the change of a function between two places when the interval is halved often,
/// always keeping the half that changes more.
fn step(f: &dyn Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    let (mut at_a, mut at_b) = (f(a), f(b));
    while b - a > 1e-7 {
        let middle = 0.5 * (a + b);
        let there = f(middle);
        if (there - at_a).abs() > (at_b - there).abs() {
            (b, at_b) = (middle, there);
        } else {
            (a, at_a) = (middle, there);
        }
    }
    (at_b - at_a).abs()
}

/// The greatest step of a ground's height and of its edge's distance along lines through a chunk,
/// and the greatest slope of that distance over a stride.
fn worst(ground: &TrailGround, chunk: ChunkCoord, lines: usize) -> (f64, f64, f64) {
    let (mut height_step, mut edge_step, mut edge_slope) = (0.0_f64, 0.0_f64, 0.0_f64);
    for line in 0..lines {
        let across = (line as f64 + 0.377) * SIZE_M / lines as f64;
        let place = |s: f64| {
            let at = DVec2::new(s, across);
            chunk.origin_m(SIZE_M) + if line % 2 == 0 { at } else { at.yx() }
        };
        let height = |s: f64| ground.height_m(place(s));
        // Beyond its reach the distance is infinite.
        let edge = |s: f64| ground.edge_m(place(s)).min(12.0);
        let (mut last_height, mut last_edge) = (height(0.0), edge(0.0));
        for i in 1..(SIZE_M / STRIDE_M) as usize {
            let s = i as f64 * STRIDE_M;
            let (here, near) = (height(s), edge(s));
            if (here - last_height).abs() > 0.01 {
                height_step = height_step.max(step(&height, s - STRIDE_M, s));
            }
            let slope = (near - last_edge).abs() / STRIDE_M;
            if slope > 1.01 {
                edge_step = edge_step.max(step(&edge, s - STRIDE_M, s));
                edge_slope = edge_slope.max(slope);
            }
            (last_height, last_edge) = (here, near);
        }
    }
    (height_step, edge_step, edge_slope)
}

fn ways() -> impl Strategy<Value = WayKind> {
    prop_oneof![
        Just(WayKind::default()),
        Just(WayKind::forest_road()),
        Just(WayKind::footpath()),
        Just(WayKind::skid_trail()),
        Just(WayKind::firebreak()),
    ]
}

/// A line of vertices about as far apart as `stride_m`, turning by up to 1.5 rad at each.
fn line(stride_m: f64) -> impl Strategy<Value = Vec<DVec2>> {
    let start = (0.0..SIZE_M, 0.0..SIZE_M, 0.0..6.3_f64);
    let turns = proptest::collection::vec((-1.5..1.5_f64, 0.3..1.0_f64), 1..6);
    (start, turns).prop_map(move |((x, y, mut heading), turns)| {
        let mut at = DVec2::new(x, y);
        let mut vertices = vec![at];
        for (turn, share) in turns {
            heading += turn;
            at += DVec2::new(heading.cos(), heading.sin()) * (stride_m * share);
            vertices.push(at);
        }
        vertices
    })
}

fn along(way: WayKind, lines: &[Vec<DVec2>], slope: DVec2) -> TrailGround {
    let none = TrailParams {
        spawn_probability: 0.0,
        ..TrailParams::of(way)
    };
    let trails = trails(none, 7, flat(slope))
        .along(lines, 0)
        .expect("finite lines");
    trails.ground_near(ChunkCoord::new(0, 0), 1.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn given_lines_have_no_cliffs(
        way in ways(),
        lines in proptest::collection::vec(line(60.0), 2..5),
        slope in (-0.4..0.4_f64, -0.4..0.4_f64),
    ) {
        let ground = along(way, &lines, DVec2::new(slope.0, slope.1));
        let (height, edge, slope) = worst(&ground, ChunkCoord::new(0, 0), 16);
        prop_assert!(height < STEP_M && edge < 1e-4, "{} {}", height, edge);
        // Where two edges that are parallel are rounded off, it changes by up to 1.42 per metre.
        prop_assert!(slope < 1.5, "{}", slope);
    }

    #[test]
    fn lines_that_meet_end_to_end_have_no_cliffs(
        way in ways(),
        first in line(40.0),
        mut second in line(40.0),
        slope in (-0.4..0.4_f64, -0.4..0.4_f64),
    ) {
        // The second one begins where the first one ends, in any direction.
        let moved = first[first.len() - 1] - second[0];
        second.iter_mut().for_each(|vertex| *vertex += moved);
        let ground = along(way, &[first, second], DVec2::new(slope.0, slope.1));
        let (height, edge, _) = worst(&ground, ChunkCoord::new(0, 0), 16);
        prop_assert!(height < STEP_M && edge < 1e-3, "{} {}", height, edge);
    }

    #[test]
    fn bends_have_no_cliffs(
        way in ways(),
        lines in proptest::collection::vec(line(15.0), 2..5),
        slope in (-0.4..0.4_f64, -0.4..0.4_f64),
    ) {
        let ground = along(way, &lines, DVec2::new(slope.0, slope.1));
        let (height, edge, slope) = worst(&ground, ChunkCoord::new(0, 0), 16);
        prop_assert!(height < STEP_M && edge < 1e-3, "{} {}", height, edge);
        prop_assert!(slope < 2.5, "{}", slope);
    }

    #[test]
    fn born_trails_have_no_cliffs(seed: u64, way in ways()) {
        let params = TrailParams {
            spawn_probability: 0.1,
            max_length_chunks: 14,
            fork_probability: 0.3,
            ..TrailParams::of(way)
        };
        let trails: Trails = trails(params, seed, hills(0.4));
        for chunk in around(ChunkCoord::new(0, 0), 1) {
            let (height, edge, slope) = worst(&trails.ground_near(chunk, 1.0), chunk, 8);
            prop_assert!(height < STEP_M && edge < 1e-4, "{} {}", height, edge);
            prop_assert!(slope < 1.5, "{}", slope);
        }
    }
}

#[test]
fn a_trail_that_ends_beside_another_makes_no_cliff() {
    let base: Arc<dyn Surface> = flat(DVec2::new(0.0, 0.4));
    let none = TrailParams {
        spawn_probability: 0.0,
        ..TrailParams::default()
    };
    for end in [6.0, 9.0, 12.0] {
        let lines = [
            vec![DVec2::new(-100.0, 0.0), DVec2::new(100.0, 0.0)],
            vec![DVec2::new(0.0, 100.0), DVec2::new(0.0, end)],
        ];
        let trails = trails(none.clone(), 7, Arc::clone(&base))
            .along(&lines, 0)
            .expect("finite lines");
        let ground = trails.ground_near(ChunkCoord::new(0, 0), 20.0);
        for i in 0..20_000 {
            let at = |i: i32| DVec2::new(1.0, f64::from(i) * 1e-3);
            let (a, b) = (at(i), at(i + 1));
            assert!(
                (ground.height_m(a) - ground.height_m(b)).abs() < 5e-3,
                "{a}"
            );
            let edge_m = |p: DVec2| ground.edge_m(p).min(12.0);
            let change = (edge_m(a) - edge_m(b)).abs();
            assert!(change < 1.5e-3, "{change} at {a}");
        }
    }
}
