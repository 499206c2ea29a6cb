//! Rows, gaps and clusters.

#[allow(dead_code, reason = "each test binary uses its part")]
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::common::{World, beside_trails, everywhere, forest, layer, square, trees, variety};
use glam::DVec2;
use nemoral_placement::{
    EdgeProfile, OpenLand, Patches, Placement, PlacementError, PlacementParams, Rows, Site,
};
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use proptest::prelude::*;

const GAPS: Patches = Patches {
    share: 0.15,
    radius_m: (4.0, 9.0),
};

fn plantation() -> PlacementParams {
    let mut params = trees(240.0);
    params.layers[0].varieties = vec![variety(2.0, 0.1, 0.15), variety(1.0, 0.15, 0.25)];
    params.layers[0].rows = Some(Rows {
        row_m: 4.0,
        in_row_m: 2.2,
        jitter_m: 0.2,
        heading_deg: 32.0,
    });
    params
}

/// A canopy with gaps, stumps that are indifferent to them, shrubs that seek light, and saplings in
/// clusters.
fn gappy() -> PlacementParams {
    let mut params = forest(96.0);
    params.gaps = Some(GAPS);
    params.layers[0].in_gaps = 0.0;
    params.layers[2].in_gaps = 3.0;
    params.layers.push({
        let mut saplings = layer("saplings", 40.0, vec![variety(1.0, 0.03, 0.06)]);
        saplings.in_gaps = 4.0;
        saplings.clusters = Some(Patches {
            share: 0.2,
            radius_m: (2.0, 5.0),
        });
        saplings
    });
    params
}

fn woody(params: PlacementParams, side: i32, seed: u64) -> Vec<Site> {
    let mut world = World::new(params, seed, &everywhere);
    let chunks = square(ChunkCoord::new(-3, 4), side);
    chunks.into_iter().flat_map(|c| world.woody(c)).collect()
}

/// The pair correlation in rings of `step_m` in a square of `edge_m`, with Ripley's translation
/// correction.
fn pair_correlation(points: &[DVec2], edge_m: f64, step_m: f64, rings: usize) -> Vec<f64> {
    let mut sums = vec![0.0; rings];
    for (i, p) in points.iter().enumerate() {
        for q in &points[..i] {
            let d = (*p - *q).abs();
            let ring = (d.length() / step_m) as usize;
            if let Some(sum) = sums.get_mut(ring) {
                *sum += 2.0 / ((edge_m - d.x) * (edge_m - d.y));
            }
        }
    }
    let density = points.len() as f64 / (edge_m * edge_m);
    let of_ring = |(i, sum): (usize, f64)| {
        let (low, high) = (i as f64 * step_m, (i + 1) as f64 * step_m);
        sum / (density * density * std::f64::consts::PI * (high * high - low * low))
    };
    sums.into_iter().enumerate().map(of_ring).collect()
}

#[test]
fn rows_meet_their_number_and_leave_some_places_empty() {
    let params = plantation();
    let planted = 2500.0 / (4.0 * 2.2);
    let sites = woody(params.clone(), 10, 2);
    let mean = sites.len() as f64 / 100.0;
    assert!((mean / 240.0 - 1.0).abs() < 0.02, "{mean}");
    assert!(planted > 280.0);
    let thick = sites.iter().filter(|s| s.variety == 1).count() as f64 / sites.len() as f64;
    assert!((thick - 1.0 / 3.0).abs() < 0.02, "{thick}");
    let mut more = params;
    more.layers[0].per_chunk = planted + 1.0;
    let error = Placement::new(more, Key::world(1)).expect_err("no places left");
    let PlacementError::TooDense { at_most, .. } = error else {
        panic!("{error}")
    };
    assert!((at_most - planted).abs() < 0.1, "{error}");
}

#[test]
fn rows_are_rows() {
    let sites = woody(plantation(), 4, 5);
    let heading = 32.0_f64.to_radians();
    let (along, across) = (
        DVec2::new(heading.sin(), heading.cos()),
        DVec2::new(heading.cos(), -heading.sin()),
    );
    // Waves of the row spacing stand out in the spectrum of the projected points; for random points
    // their power is about 1.
    let power = |axis: DVec2, period_m: f64| {
        let wave: DVec2 = sites
            .iter()
            .map(|s| DVec2::from_angle(std::f64::consts::TAU * axis.dot(s.position_m) / period_m))
            .sum();
        wave.length_squared() / sites.len() as f64
    };
    assert!(power(across, 4.0) > 1000.0, "{}", power(across, 4.0));
    assert!(power(along, 2.2) > 1000.0, "{}", power(along, 2.2));
    for other in [3.1, 3.5, 4.6, 5.2] {
        assert!(power(across, other) < 30.0, "{other} m");
    }
    // The oracle knows nothing of rows: neighbours at the in-row spacing, none in between.
    let points: Vec<DVec2> = sites.iter().map(|s| s.position_m).collect();
    let g = pair_correlation(&points, 200.0, 0.4, 14);
    assert!(g[..4].iter().all(|g| *g < 0.1), "{g:?}");
    assert!(g[5] > 1.4 && g[7] < 0.2 * g[5], "{g:?}");
    let scattered: Vec<DVec2> = {
        let sites = woody(trees(240.0), 4, 5);
        sites.iter().map(|s| s.position_m).collect()
    };
    let g = pair_correlation(&scattered, 200.0, 0.4, 14);
    assert!(g[5..].iter().all(|g| (0.6..1.6).contains(g)), "{g:?}");
}

#[test]
fn a_row_goes_on_across_borders_and_far_away() {
    for corner in [
        ChunkCoord::new(0, 0),
        ChunkCoord::new(1_000_000, -1_000_000),
    ] {
        let mut world = World::new(plantation(), 5, &everywhere);
        let mut keys = std::collections::HashSet::new();
        let mut total = 0;
        for coord in square(corner, 4) {
            for site in world.woody(coord) {
                assert_eq!(ChunkCoord::containing(site.position_m, 50.0), coord);
                assert!(keys.insert(site.key));
                total += 1;
            }
        }
        // No place is lost or doubled at a border, so the number is that of the plane.
        let expected = 16.0 * 240.0;
        let sigma = (expected * (1.0 - 240.0 / 284.0_f64)).sqrt();
        assert!(
            (f64::from(total) - expected).abs() < 4.0 * sigma,
            "{total} of {expected}"
        );
    }
}

/// Trees of eight very different sizes.
fn uneven_plantation() -> PlacementParams {
    let mut params = plantation();
    params.layers[0].varieties = (0..8_u32)
        .map(|i| {
            let radius_m = 0.06 + 0.02 * f64::from(i);
            variety(f64::from(1 + i % 3), radius_m, radius_m)
        })
        .collect();
    let rows = params.layers[0].rows.as_mut().expect("rows");
    (rows.row_m, rows.in_row_m) = (3.0, 3.0);
    params
}

#[test]
fn rows_keep_their_weights() {
    let params = uneven_plantation();
    let varieties = &params.layers[0].varieties;
    let total: f64 = varieties.iter().map(|v| v.weight).sum();
    let sites = woody(params.clone(), 10, 2);
    let square = varieties.iter().enumerate().map(|(i, v)| {
        let expected = v.weight / total * sites.len() as f64;
        let found = sites.iter().filter(|s| usize::from(s.variety) == i).count();
        (found as f64 - expected).powi(2) / expected
    });
    // Chi-square with 7 degrees of freedom exceeds 24.3 in one case of a thousand, and is less
    // where neighbours differ.
    let square: f64 = square.sum();
    assert!(square < 24.3, "{square}");
}

#[test]
fn neighbours_in_rows_keep_each_other_small() {
    let sites = woody(uneven_plantation(), 10, 3);
    let n = sites.len() as f64;
    let mean = sites.iter().map(|s| s.radius_m).sum::<f64>() / n;
    let variance = sites
        .iter()
        .map(|s| (s.radius_m - mean).powi(2))
        .sum::<f64>()
        / n;
    // The correlation of neighbours that share their chunk, and of those with a border between
    // them.
    let mut sums = [[0.0; 2]; 2];
    for (i, a) in sites.iter().enumerate() {
        for b in &sites[..i] {
            if a.position_m.distance(b.position_m) < 3.7 {
                let chunk = |s: &Site| ChunkCoord::containing(s.position_m, 50.0);
                let sum = &mut sums[usize::from(chunk(a) != chunk(b))];
                sum[0] += (a.radius_m - mean) * (b.radius_m - mean) / variance;
                sum[1] += 1.0;
            }
        }
    }
    let [within, across] = sums.map(|[sum, pairs]| sum / pairs);
    assert!((-0.3..-0.15).contains(&within), "{within}");
    // Some 3000 pairs.
    assert!((across - within).abs() < 0.07, "{across} {within}");
}

#[test]
fn a_gap_has_no_trees_and_more_shrubs() {
    let sites = woody(gappy(), 8, 9);
    let of = |layer: u8| sites.iter().filter(|s| s.layer == layer).count() as f64 / 64.0;
    // There are few rocks here; patches make the numbers in 64 chunks vary by some percent.
    for (layer, target) in [(0, 96.0), (1, 12.0), (2, 300.0), (3, 40.0)] {
        let tolerance = if layer == 3 { 0.15 } else { 0.08 };
        assert!(
            (of(layer) / target - 1.0).abs() < tolerance,
            "layer {layer}: {} of {target}",
            of(layer)
        );
    }
    // The share of the plane that is farther than 6 m from any tree, with and without gaps.
    let empty = |sites: &[Site]| {
        let trees: Vec<DVec2> = sites
            .iter()
            .filter(|s| s.layer == 0)
            .map(|s| s.position_m)
            .collect();
        let corner = ChunkCoord::new(-3, 4).origin_m(50.0) + DVec2::splat(10.0);
        let probes = (0..60 * 60)
            .map(|i| corner + DVec2::new(f64::from(i % 60), f64::from(i / 60)) * (380.0 / 60.0));
        let far = |p: &DVec2| trees.iter().all(|t| t.distance(*p) > 6.0);
        probes.filter(far).count() as f64 / 3600.0
    };
    let mut closed = gappy();
    closed.gaps = None;
    let (with, without) = (empty(&sites), empty(&woody(closed, 8, 9)));
    assert!(with > 0.02 && without < 0.3 * with, "{with} {without}");
}

#[test]
fn saplings_cluster() {
    let of = |params| -> Vec<DVec2> {
        let sites = woody(params, 8, 9);
        let saplings = sites.iter().filter(|s| s.layer == 3);
        saplings.map(|s| s.position_m).collect()
    };
    let g = pair_correlation(&of(gappy()), 400.0, 1.0, 6);
    assert!(g[1] > 2.5 && g[5] < g[1], "{g:?}");
    let mut even = gappy();
    even.gaps = None;
    even.layers[3].clusters = None;
    let g = pair_correlation(&of(even), 400.0, 1.0, 6);
    assert!(g[1..].iter().all(|g| *g < 1.6), "{g:?}");
}

#[test]
fn order_and_eviction_do_not_show() {
    let mut both = gappy();
    both.layers[0].rows = plantation().layers[0].rows;
    both.layers[0].varieties = plantation().layers[0].varieties.clone();
    let chunks = square(ChunkCoord::new(-2, -1), 3);
    let mut world = World::new(both, 9, &beside_trails);
    let expected: Vec<_> = chunks.iter().map(|c| world.woody(*c)).collect();
    for i in [4, 8, 0, 7, 2, 5, 1, 3, 6] {
        world.evict();
        assert_eq!(world.woody(chunks[i]), expected[i]);
    }
}

#[test]
fn what_cannot_be_is_named() {
    let refused = |change: &dyn Fn(&mut PlacementParams)| {
        let mut params = gappy();
        change(&mut params);
        let error = Placement::new(params, Key::world(1)).expect_err("refused");
        error.to_string()
    };
    let wild = |p: &mut PlacementParams| {
        p.layers[0].rows = Some(Rows {
            jitter_m: 0.6,
            ..plantation().layers[0].rows.expect("rows")
        });
    };
    let message = refused(&wild);
    assert!(
        message.starts_with("layers[0].rows.jitter_m = 0.6"),
        "{message}"
    );
    let message = refused(&|p| p.layers[2].in_gaps = -1.0);
    assert!(message.starts_with("layers[2].in_gaps = -1"), "{message}");
    let message = refused(&|p| {
        p.gaps = Some(Patches {
            share: 0.95,
            ..GAPS
        });
    });
    assert!(message.starts_with("gaps.share = 0.95"), "{message}");
    let message = refused(&|p| {
        p.layers[3].clusters = Some(Patches {
            share: 0.2,
            radius_m: (5.0, 60.0),
        });
    });
    assert!(message.contains("high <= 25"), "{message}");
}

#[test]
fn value_stability() {
    let line = |s: &Site| {
        format!(
            "{:.9} {:.9} {:.9} {} {} {:016x}",
            s.position_m.x,
            s.position_m.y,
            s.radius_m,
            s.layer,
            s.variety,
            s.key.to_u64()
        )
    };
    let coord = ChunkCoord::new(-3, 5);
    let rows = World::new(plantation(), 7, &everywhere).woody(coord);
    let gaps = World::new(gappy(), 7, &everywhere).woody(coord);
    let got = [
        format!("{} {}", rows.len(), gaps.len()),
        line(&rows[0]),
        line(&gaps[0]),
        line(&gaps[gaps.len() - 1]),
    ];
    assert_eq!(got, VALUES);
}
const VALUES: [&str; 4] = [
    "237 523",
    "-121.885266993 281.263084337 0.133103741 0 0 9d780bae046dd5ee",
    "-103.467387473 255.030145589 0.428357204 0 2 074352e501fffa5e",
    "-113.312187418 287.701410940 0.046796694 3 0 009c4abefb95d418",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(5))]

    /// The distance rule holds across borders for any rows, gaps and clusters.
    #[test]
    fn any_stand_keeps_the_rule(
        seed: u64,
        x in -1000_i32..1000,
        heading_deg in -180.0_f64..180.0,
        row_m in 2.0_f64..5.0,
        share in 0.02_f64..0.4,
        in_gaps in 0.0_f64..4.0,
    ) {
        let mut params = gappy();
        params.spacing_factor = 1.3;
        params.layers[0].varieties = vec![variety(1.0, 0.1, 0.25)];
        params.layers[0].per_chunk = 60.0;
        params.layers[0].rows = Some(Rows { row_m, in_row_m: 2.0, jitter_m: 0.25, heading_deg });
        params.layers[2].per_chunk = 60.0;
        params.layers[2].in_gaps = in_gaps;
        params.gaps = Some(Patches { share, radius_m: (3.0, 6.0) });
        let mut world = World::new(params.clone(), seed, &everywhere);
        let sites: Vec<Site> = square(ChunkCoord::new(x, -x), 2)
            .into_iter()
            .flat_map(|c| world.woody(c))
            .collect();
        prop_assert!(sites.len() > 4 * 60);
        for (i, p) in sites.iter().enumerate() {
            for q in &sites[..i] {
                let least = params.spacing_factor * (p.radius_m + q.radius_m);
                prop_assert!(p.position_m.distance(q.position_m) >= least - 1e-6, "{p:?} {q:?}");
            }
        }
    }
}

#[test]
fn clusters_are_where_their_layer_stands() {
    let params = gappy();
    let placement = Placement::new(params.clone(), Key::world(5)).expect("valid");
    let mut world = World::new(params.clone(), 5, &everywhere);
    let (mut saplings, mut inside, mut all) = (0, 0, 0);
    for chunk in square(ChunkCoord::new(-3, 4), 8) {
        let clusters = placement.clusters(chunk, 3).expect("saplings cluster");
        for site in world.woody(chunk).iter().filter(|s| s.layer == 3) {
            assert!(clusters.contain(site.position_m), "{site:?}");
            saplings += 1;
        }
        for i in 0..625 {
            let cell = DVec2::new(f64::from(i % 25), f64::from(i / 25)) + 0.5;
            let p = chunk.origin_m(params.chunk_size_m) + cell * (params.chunk_size_m / 25.0);
            inside += u32::from(clusters.contain(p));
            all += 1;
        }
        assert!(placement.clusters(chunk, 0).is_none());
        assert!(placement.clusters(chunk, 9).is_none());
    }
    let share = f64::from(inside) / f64::from(all);
    assert!(saplings > 1000 && (share - 0.2).abs() < 0.03, "{share}");
    // Clusters exist even if nothing stands in them.
    let mut empty = params;
    empty.layers[3].per_chunk = 0.0;
    let empty = Placement::new(empty, Key::world(5)).expect("valid");
    let clusters = |p: &Placement| p.clusters(ChunkCoord::new(1, 2), 3).expect("clusters");
    let (a, b) = (clusters(&placement), clusters(&empty));
    let places = (0..2500).map(|i| DVec2::new(50.0 + f64::from(i % 50), 100.0 + f64::from(i / 50)));
    assert!(places.into_iter().all(|p| a.contain(p) == b.contain(p)));
}

/// A wavy line from south-west to north-east, with the open on its south-eastern side.
#[derive(Debug)]
struct WavyEdge;

impl OpenLand for WavyEdge {
    fn depth_m(&self, p: DVec2) -> f64 {
        let along = DVec2::new(0.8, 0.6);
        -p.dot(along.perp()) + 4.0 * libm::sin(0.09 * p.dot(along))
    }
}

/// Trees that end, and shrubs that close up into a mantle.
fn edged() -> PlacementParams {
    let mut params = forest(96.0);
    params.layers[2].per_chunk = 60.0;
    let profile = |points: &[(f64, f64)]| {
        Some(EdgeProfile {
            points: points.to_vec(),
        })
    };
    params.layers[0].at_edges = profile(&[(-1.0, 1.0), (1.0, 0.0)]);
    params.layers[2].at_edges = profile(&[(-6.0, 1.0), (-3.0, 5.0), (3.0, 5.0), (6.0, 0.0)]);
    params
}

/// The density of a layer's sites in strips along the edge, 3 m wide, per chunk.
fn densities(params: PlacementParams) -> impl Fn(u8, std::ops::Range<i32>) -> f64 {
    let mut world = World::new(params, 3, &everywhere);
    world.placement = world.placement.with_open_land(Arc::new(WavyEdge));
    let sites: Vec<Site> = square(ChunkCoord::new(-7, -7), 14)
        .into_iter()
        .flat_map(|c| world.woody(c))
        .collect();
    // The areas of the strips, by a grid.
    let strip = |p: DVec2| (WavyEdge.depth_m(p) / 3.0).floor().clamp(-100.0, 100.0) as i32;
    let mut areas = BTreeMap::new();
    for i in 0..700 * 700 {
        let p = DVec2::new(f64::from(i % 700), f64::from(i / 700)) - 350.0;
        *areas.entry(strip(p)).or_insert(0.0) += 1.0;
    }
    move |layer, strips| {
        let here = |site: &&Site| site.layer == layer && strips.contains(&strip(site.position_m));
        let area: f64 = strips.clone().filter_map(|s| areas.get(&s)).sum();
        sites.iter().filter(here).count() as f64 / area * 2500.0
    }
}

#[test]
fn in_gaps_of_a_mantle_the_greater_density_counts() {
    let mut params = edged();
    let share = 0.5;
    params.gaps = Some(Patches { share, ..GAPS });
    params.layers[2].in_gaps = 4.0;
    let density = densities(params);
    let usual = density(2, -100..-3);
    assert!((usual / 60.0 - 1.0).abs() < 0.1, "{usual}");
    // In the mantle there are 5 times as many as outside of gaps, in gaps or not.
    let outside = 60.0 / (1.0 - share + 4.0 * share);
    let mantle = density(2, -1..1);
    assert!((mantle / (5.0 * outside) - 1.0).abs() < 0.2, "{mantle}");
}

#[test]
fn trees_end_at_open_land_behind_a_mantle_of_shrubs() {
    let density = densities(edged());
    assert_eq!(density(0, 1..101), 0.0);
    let wood = density(0, -100..-1);
    assert!((wood / 96.0 - 1.0).abs() < 0.05, "{wood}");
    // Shrubs stand densely on both sides of the edge, as usual in the wood, and not in the open.
    let (usual, mantle) = (density(2, -100..-3), density(2, -1..1));
    assert!((usual / 60.0 - 1.0).abs() < 0.06, "{usual}");
    assert!((mantle / 300.0 - 1.0).abs() < 0.2, "{mantle}");
    assert_eq!(density(2, 2..101), 0.0);
    // Stumps do not mind.
    let stumps = density(1, 0..101) / density(1, -100..0);
    assert!((0.85..1.2).contains(&stumps), "{stumps}");
}

#[test]
fn the_edge_of_a_wood_has_no_seams() {
    // A chunk's sites are those that a window of twice its size would have: no pair anywhere is
    // nearer than the rule allows, across borders too, and whatever was asked for before.
    let placed = |order: &mut dyn Iterator<Item = ChunkCoord>| {
        let mut world = World::new(edged(), 9, &everywhere);
        world.placement = world.placement.with_open_land(Arc::new(WavyEdge));
        let sites = order.flat_map(|c| world.woody(c));
        let mut sites: Vec<_> = sites.map(|s| (s.key, s)).collect();
        sites.sort_by_key(|(key, _)| *key);
        sites
    };
    let chunks = square(ChunkCoord::new(-2, -2), 4);
    let sites = placed(&mut chunks.iter().copied());
    let backwards = placed(&mut chunks.iter().rev().copied());
    assert!(sites == backwards);
    let params = edged();
    let factor = params.spacing_factor * params.density_factor;
    for (i, (_, a)) in sites.iter().enumerate() {
        for (_, b) in &sites[..i] {
            let room = factor * (a.radius_m + b.radius_m);
            assert!(a.position_m.distance(b.position_m) >= room - 1e-6);
        }
    }
}

#[test]
fn impossible_edges_are_refused() {
    let refused = |points: &[(f64, f64)]| {
        let mut params = edged();
        params.layers[0].at_edges = Some(EdgeProfile {
            points: points.to_vec(),
        });
        let error = Placement::new(params, Key::world(1)).expect_err("refused");
        error.to_string()
    };
    for points in [&[][..], &[(1.0, 1.0), (1.0, 0.0)], &[(f64::NAN, 1.0)]] {
        assert!(refused(points).contains("layers[0].at_edges.points"));
    }
    assert!(refused(&[(0.0, 21.0)]).contains("layers[0].at_edges.points[0].1"));
}
