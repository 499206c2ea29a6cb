//! Streams and ponds on waves of hills.
#![allow(clippy::print_stdout, reason = "what was measured, for --nocapture")]

use std::f64::consts::TAU;
use std::sync::Arc;

use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{ChunkCoord, FlatSurface, MaterialId, Surface, SurfaceSample};
use nemoral_seed::Key;
use nemoral_water::{
    ChunkWater, CrossSection, GroundWithWays, GroundWithoutWays, SURFACE_REACH_M, Water, WaterKind,
    WaterParams,
};

const CHUNK_M: f64 = 50.0;

/// Hills of several sizes, as steep as a walkable forest.
#[derive(Clone, Copy)]
struct Hills;

impl Surface for Hills {
    fn sample(&self, p: DVec2) -> SurfaceSample {
        let waves = [
            (6.0, 310.0, 0.3),
            (4.0, 170.0, 1.9),
            (1.6, 71.0, 4.0),
            (0.5, 29.0, 2.6),
            (0.12, 11.0, 5.1),
        ];
        let (mut height_m, mut gradient) = (40.0, DVec2::ZERO);
        for (i, (amplitude, length, turn)) in waves.into_iter().enumerate() {
            for side in [0.0, 1.7] {
                let (sin, cos) = libm::sincos(turn + side);
                let k = DVec2::new(cos, sin) * TAU / length;
                let (s, c) = libm::sincos(k.dot(p) + i as f64 + side);
                height_m += amplitude * s;
                gradient += k * (amplitude * c);
            }
        }
        SurfaceSample { height_m, gradient }
    }
}

/// Hills with a straight way across, 3 m wide.
struct WithWay;

impl GroundWithWays for WithWay {
    fn ground(&self, p: DVec2) -> SurfaceSample {
        Hills.sample(p)
    }

    fn edge_m(&self, p: DVec2) -> f64 {
        (p.x - 90.0).abs() - 1.5
    }
}

fn params() -> WaterParams {
    WaterParams {
        springs_per_km2: 90.0,
        ponds: 0.3,
        ..WaterParams::default()
    }
}

fn water(seed: u64) -> Water {
    let ways = Arc::new(GroundWithoutWays(Hills));
    Water::new(params(), CHUNK_M, Key::world(seed), Arc::new(Hills), ways).expect("valid")
}

fn chunks() -> impl Iterator<Item = ChunkCoord> {
    ChunkCoord::new(1, -2).square(6)
}

fn carved(near: &ChunkWater, p: DVec2) -> SurfaceSample {
    near.carve(p, Hills.sample(p))
}

struct Carved<'a>(&'a ChunkWater);

impl Surface for Carved<'_> {
    fn sample(&self, p: DVec2) -> SurfaceSample {
        carved(self.0, p)
    }
}

#[test]
fn levels_and_beds_fall_all_along_and_stay_below_the_banks() {
    let water = water(3);
    let (mut rows, mut wide, mut deepest) = (0, 0.0_f64, 0.0_f64);
    for chunk in chunks() {
        let near = water.near(chunk, 40.0);
        for reach in near.sections() {
            for pair in reach.windows(2) {
                let [a, b] = [pair[0], pair[1]];
                assert!(
                    b.level_m <= a.level_m + 1e-12,
                    "{} {}",
                    a.level_m,
                    b.level_m
                );
                assert!(b.level_m - b.depth_m <= a.level_m - a.depth_m + 1e-12);
                assert!(a.middle_m.distance(b.middle_m) < 1.2);
            }
            for s in reach {
                rows += 1;
                wide = wide.max(2.0 * s.half_m);
                let bed = carved(&near, s.middle_m).height_m;
                deepest = deepest.max(Hills.sample(s.middle_m).height_m - bed);
                assert!(bed < s.level_m - 0.5 * s.depth_m, "{bed} {}", s.level_m);
            }
        }
    }
    assert!(rows > 2000, "{rows}");
    assert!(wide > 0.9 && deepest < 3.5, "{wide} {deepest}");
}

#[test]
fn surfaces_end_in_the_ground() {
    let water = water(3);
    let (mut ends, mut shown, mut above) = (0, 0, 0);
    for chunk in chunks() {
        let near = water.near(chunk, 40.0);
        let around: Vec<CrossSection> = chunk
            .square(1)
            .flat_map(|c| {
                water
                    .near(c, 0.0)
                    .sections()
                    .flatten()
                    .copied()
                    .collect::<Vec<_>>()
            })
            .collect();
        let origin = chunk.origin_m(CHUNK_M);
        let mesh = near.surface_mesh(&Carved(&near), &|kind| MaterialId(kind as u16));
        assert_eq!(mesh.positions.len(), mesh.normals.len());
        // The border: edges that one triangle has alone.
        let mut edges = std::collections::BTreeMap::new();
        for t in &mesh.triangles {
            let [a, b, c] = t.corners;
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((from.min(to), from.max(to))).or_insert(0) += 1;
            }
            let [a, b, c] = t.corners.map(|i| mesh.positions[i as usize]);
            let up = (b - a).cross(c - a);
            let is_stream = t.material == MaterialId(WaterKind::Stream as u16);
            assert!(up.z > 0.0 || is_stream, "a pond's triangles face up: {up}");
        }
        for ((a, b), count) in edges {
            let [a, b]: [Vec3; 2] = [a, b].map(|i| mesh.positions[i as usize]);
            let middle = (0.5 * (a + b)).as_dvec3();
            let p = origin + middle.truncate();
            let ground = carved(&near, p).height_m;
            if count > 1 {
                shown += usize::from(ground < middle.z);
                continue;
            }
            // Where reaches meet, they end in the water of the next.
            let is_covered = || {
                let beside = |s: &&CrossSection| s.middle_m.distance(p) < s.half_m + 0.8;
                let levels = around.iter().filter(beside).map(|s| s.level_m);
                let ponds = near.ponds().filter(|pond| pond.edge_m(p) < 0.05);
                let mut levels = levels.chain(ponds.map(|pond| pond.level_m()));
                levels.any(|level_m| middle.z < level_m + 0.06)
            };
            ends += 1;
            // The last piece of a row reaches from the water into the bank.
            if (near.edge_m(p) < 0.1 && is_covered()) || ground > middle.z + 0.01 {
                continue;
            }
            // Between its vertices, which are all below the ground.
            above += 1;
            let height = middle.z - ground;
            assert!(
                height < 0.06,
                "at {p} a surface ends {height:.3} m above the ground"
            );
        }
    }
    assert!(above * 60 < ends, "{above} of {ends}");
    assert!(ends > 4000 && shown > 4000, "{ends} {shown}");
}

#[test]
fn gradients_are_difference_quotients() {
    let water = water(3);
    let (mut near_water, mut kinks) = (0, 0);
    for chunk in chunks().step_by(3) {
        let near = water.near(chunk, 5.0);
        let origin = chunk.origin_m(CHUNK_M);
        for i in 0..2500_u32 {
            let p = origin + DVec2::new(f64::from(i % 50), f64::from(i / 50)) + 0.37;
            if !near.concerns(p) {
                assert_eq!(carved(&near, p), Hills.sample(p));
                continue;
            }
            near_water += 1;
            let edge = |p: DVec2| (p.x - origin.x - 24.0, DVec2::X);
            let at = |p: DVec2| near.carve_beside(p, Hills.sample(p), edge(p));
            let e = 1e-5;
            let slope =
                |way: DVec2| (at(p + way * e).height_m - at(p - way * e).height_m) / (2.0 * e);
            let measured = DVec2::new(slope(DVec2::X), slope(DVec2::Y));
            kinks += u32::from(at(p).gradient.distance(measured) > 1e-3);
        }
    }
    // There is none where the nearest segment changes.
    assert!(near_water > 5000, "{near_water}");
    assert!(kinks * 200 < near_water, "{kinks} of {near_water}");
}

#[test]
fn the_ground_has_no_steps() {
    let water = water(3);
    let mut walked = 0;
    for chunk in chunks().step_by(2) {
        let near = water.near(chunk, 5.0);
        for reach in near.sections() {
            for s in reach.iter().step_by(3) {
                let left = s.along.perp();
                for i in -300..300 {
                    let p = s.middle_m + left * (0.03 * f64::from(i));
                    let q = p + left * 0.001;
                    let out = (p - chunk.origin_m(CHUNK_M) - 25.0).abs().max_element();
                    if out < 29.0 {
                        let step = carved(&near, q).height_m - carved(&near, p).height_m;
                        assert!(step.abs() < 0.02, "{step} at {p}");
                        walked += 1;
                    }
                }
            }
        }
    }
    assert!(walked > 50_000, "{walked}");
}

#[test]
fn it_is_known_how_far_surfaces_reach() {
    let water = water(3);
    let (mut inside, mut outside) = (0, 0);
    for chunk in chunks() {
        let near = water.near(chunk, 12.0);
        let mesh = near.surface_mesh(&Carved(&near), &|kind| MaterialId(kind as u16));
        let low = chunk.origin_m(CHUNK_M);
        let high = low + CHUNK_M;
        for position in &mesh.positions {
            let p = low + position.truncate().as_dvec2();
            assert!(near.surface_reaches(p, p), "{p} from {low}");
            let beyond = (low - p).max(p - high).max_element();
            assert!(beyond < SURFACE_REACH_M, "{beyond} m beyond {low}");
            *(if beyond > 0.0 {
                &mut outside
            } else {
                &mut inside
            }) += 1;
        }
        assert!(!near.surface_reaches(high + SURFACE_REACH_M, high + 1000.0));
        assert!(!near.surface_reaches(low - 1000.0, low - SURFACE_REACH_M));
    }
    assert!(inside > 1000 && outside > 100, "{inside} {outside}");
}

#[test]
fn every_section_is_known_in_the_chunk_where_it_is() {
    let water = water(3);
    let (mut own, mut of_others) = (0, 0);
    for chunk in chunks() {
        for section in water.near(chunk, 0.0).sections().flatten() {
            let there = ChunkCoord::containing(section.middle_m, CHUNK_M);
            let known = water.near(there, 0.0);
            let is_known = known.sections_in_chunk().any(|other| other == section);
            assert!(is_known, "{section:?} of {chunk}");
            *(if there == chunk {
                &mut own
            } else {
                &mut of_others
            }) += 1;
        }
    }
    assert!(own > 1000 && of_others > 100, "{own} {of_others}");
}

#[test]
fn neighbours_agree_to_the_bit_in_any_order() {
    let (one, other) = (water(5), water(5));
    let all: Vec<ChunkCoord> = chunks().collect();
    let forwards: Vec<Arc<ChunkWater>> = all.iter().map(|&c| one.near(c, 8.0)).collect();
    let mut compared = 0;
    for (chunk, first) in all.iter().zip(&forwards).rev() {
        let second = other.near(*chunk, 8.0);
        let material = |kind| MaterialId(kind as u16);
        let surfaces = |near: &ChunkWater| near.surface_mesh(&Carved(near), &material);
        assert_eq!(surfaces(first), surfaces(&second));
        for (neighbour, third) in all.iter().zip(&forwards) {
            if (neighbour.x - chunk.x, neighbour.y - chunk.y) != (1, 0) {
                continue;
            }
            let border = neighbour.origin_m(CHUNK_M);
            for i in 0..400 {
                let off = DVec2::new(f64::from(i % 8) - 4.0, f64::from(i / 8));
                let p = border + off * 0.99;
                assert_eq!(carved(&second, p), carved(third, p), "{p}");
                assert_eq!(second.edge_m(p), third.edge_m(p), "{p}");
                compared += usize::from(second.concerns(p));
            }
        }
    }
    assert!(compared > 3000, "{compared}");
}

#[test]
fn streams_join_and_end_in_ponds() {
    let water = water(3);
    let (mut ponds, mut into_ponds) = (0, 0);
    for chunk in chunks() {
        let near = water.near(chunk, 0.0);
        ponds += near.ponds().count();
        for reach in near.sections() {
            let end = reach[reach.len() - 1];
            let pond = near.ponds().find(|p| p.edge_m(end.middle_m) < -0.5);
            if let Some(pond) = pond {
                assert_eq!(end.level_m, pond.level_m());
                into_ponds += 1;
            }
        }
    }
    assert!(ponds > 10 && into_ponds > 5, "{ponds} {into_ponds}");
}

/// Water falls to a pond in time, also where it meets the pond early on its way from a node.
#[test]
fn water_falls_nowhere_at_once() {
    let (mut steepest, mut joints, mut apart_m) = (0.0_f64, 0, 0.0_f64);
    for seed in 0..6 {
        let water = water(seed);
        for chunk in chunks() {
            let near = water.near(chunk, 40.0);
            let reaches: Vec<&[CrossSection]> = near.sections().collect();
            for reach in &reaches {
                for pair in reach.windows(2) {
                    let step_m = pair[0].middle_m.distance(pair[1].middle_m);
                    steepest = steepest.max((pair[0].level_m - pair[1].level_m) / step_m.max(0.05));
                }
                let end = reach[reach.len() - 1];
                for next in reaches
                    .iter()
                    .filter(|next| next[0].middle_m == end.middle_m)
                {
                    joints += 1;
                    apart_m = apart_m.max((end.level_m - next[0].level_m).abs());
                }
            }
        }
    }
    println!("{steepest:.2} m/m at most; {joints} joints, {apart_m:.4} m apart at most");
    assert!(joints > 500, "{joints}");
    assert!(apart_m < 1e-9, "{apart_m}");
    assert!(steepest < 0.9, "{steepest}");
}

#[test]
fn ways_are_passed_under() {
    let ways = Arc::new(WithWay);
    let water = Water::new(params(), CHUNK_M, Key::world(3), Arc::new(Hills), ways);
    let water = water.expect("valid");
    let mut crossings = 0;
    for chunk in (-12..12).flat_map(|y| [ChunkCoord::new(1, y)]) {
        let near = water.near(chunk, 10.0);
        for pond in near.ponds() {
            assert!(WithWay.edge_m(pond.middle_m()) > 2.0);
        }
        for s in near.sections().flatten() {
            let edge = WithWay.edge_m(s.middle_m);
            if edge > 0.3 {
                continue;
            }
            crossings += 1;
            let way = DVec2::new((s.middle_m.x - 90.0).signum(), 0.0);
            let ground = Hills.sample(s.middle_m);
            let on_way = near.carve_beside(s.middle_m, ground, (edge, way));
            assert_eq!(on_way, ground);
            assert!(s.level_m < ground.height_m - 0.1);
        }
    }
    assert!(crossings > 5, "{crossings}");
}

#[test]
fn a_plain_has_ponds_and_no_streams() {
    let plain = FlatSurface::default();
    let ways = Arc::new(GroundWithoutWays(plain));
    let params = WaterParams {
        ponds: 0.01,
        ..params()
    };
    let water = Water::new(params, CHUNK_M, Key::world(1), Arc::new(plain), ways);
    let water = water.expect("valid");
    let mut ponds = 0;
    for chunk in chunks() {
        let near = water.near(chunk, 0.0);
        assert_eq!(near.sections().count(), 0);
        for pond in near.ponds() {
            ponds += 1;
            let bed = near.carve(pond.middle_m(), plain.sample(pond.middle_m()));
            assert!(pond.level_m() < 0.0 && bed.height_m < pond.level_m() - 0.2);
        }
    }
    assert!(ponds > 20, "{ponds}");
}

#[test]
fn no_water_is_no_change() {
    let none = WaterParams {
        springs_per_km2: 0.0,
        ponds: 0.0,
        ..WaterParams::default()
    };
    let ways = Arc::new(GroundWithoutWays(Hills));
    let water = Water::new(none, CHUNK_M, Key::world(1), Arc::new(Hills), ways).expect("valid");
    for chunk in chunks() {
        let near = water.near(chunk, 10.0);
        assert!(near.is_empty());
        assert!(
            near.surface_mesh(&Hills, &|_| MaterialId(0))
                .triangles
                .is_empty()
        );
        let p = chunk.centre_m(CHUNK_M);
        assert_eq!(carved(&near, p), Hills.sample(p));
        assert_eq!(near.edge_m(p), f64::INFINITY);
    }
}

#[test]
fn margins_below_none_are_none() {
    let water = water(3);
    for chunk in chunks().take(20) {
        let none = water.near(chunk, 0.0);
        for margin_m in [-30.0, -1e9, f64::NEG_INFINITY, f64::NAN, -0.0] {
            assert!(
                Arc::ptr_eq(&none, &water.near(chunk, margin_m)),
                "{margin_m}"
            );
        }
    }
    // What is too wide is as wide as may be.
    let dry = WaterParams {
        springs_per_km2: 0.0,
        ponds: 0.0,
        ..WaterParams::default()
    };
    let ways = Arc::new(GroundWithoutWays(Hills));
    let dry = Water::new(dry, CHUNK_M, Key::world(1), Arc::new(Hills), ways).expect("valid");
    let [most, more] = [1000.0, f64::INFINITY].map(|m| dry.near(ChunkCoord::new(0, 0), m));
    assert!(Arc::ptr_eq(&most, &more));
}

#[test]
fn bad_parameters_are_named() {
    let cases: [(&str, WaterParams); 4] = [
        (
            "springs_per_km2",
            WaterParams {
                springs_per_km2: -1.0,
                ..WaterParams::default()
            },
        ),
        (
            "stream_width_m",
            WaterParams {
                stream_width_m: 0.0,
                ..WaterParams::default()
            },
        ),
        (
            "ponds",
            WaterParams {
                ponds: f64::NAN,
                ..WaterParams::default()
            },
        ),
        (
            "pond_radius_m",
            WaterParams {
                pond_radius_m: 40.0,
                ..WaterParams::default()
            },
        ),
    ];
    for (field, params) in cases {
        let ways = Arc::new(GroundWithoutWays(Hills));
        let e = Water::new(params, CHUNK_M, Key::world(1), Arc::new(Hills), ways);
        assert_eq!(e.expect_err("out of range").field, field);
    }
}

#[test]
fn value_stability() {
    let water = water(3);
    let mut all = Vec::new();
    for chunk in chunks() {
        let near = water.near(chunk, 0.0);
        all.extend(near.sections().flatten().copied());
    }
    let s: CrossSection = all[all.len() / 2];
    let found = [
        s.middle_m.x,
        s.middle_m.y,
        s.level_m,
        s.half_m,
        s.depth_m,
        s.bank,
    ];
    let expected = [
        -53.340_166_644_652_32,
        155.223_504_405_660_8,
        38.599_292_034_029_79,
        0.216_373_721_595_752_2,
        0.09,
        1.177_364_447_353_511_6,
    ];
    let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
    assert!(
        all.len() == 2604 && off.fold(0.0, f64::max) < 1e-9,
        "{found:?}"
    );
}
