//! Properties that every pattern must have.

#[allow(dead_code, reason = "each test binary uses its part")]
use crate::common::{
    World, allowed_fraction, beside_trails, everywhere, forest, layer, square, trees, variety,
};
use glam::DVec2;
use nemoral_placement::{
    DiskKind, LayerParams, Placement, PlacementError, PlacementParams, RockParams, Site,
};
use nemoral_scene::ChunkCoord;
use nemoral_seed::{Domain, Draw, Key};
use proptest::prelude::*;

/// Checks every pair of sites in a window, rocks included, by brute force.
fn assert_distances(params: &PlacementParams, rocks: &[Site], woody: &[Site]) {
    let factor = params.spacing_factor * params.density_factor;
    let all: Vec<(&Site, bool)> = rocks
        .iter()
        .map(|s| (s, true))
        .chain(woody.iter().map(|s| (s, false)))
        .collect();
    for (i, (p, p_is_rock)) in all.iter().enumerate() {
        for (q, q_is_rock) in &all[..i] {
            let solid = *p_is_rock || *q_is_rock;
            let factor = if solid { factor.max(1.0) } else { factor };
            let least_m = factor * (p.radius_m + q.radius_m);
            let distance_m = p.position_m.distance(q.position_m);
            // World positions far from the origin are exact to 7 nm.
            assert!(
                distance_m >= least_m - 1e-6,
                "{p:?} and {q:?}: {distance_m} < {least_m}"
            );
        }
    }
}

fn window(params: &PlacementParams, corner: ChunkCoord, side: i32) -> (Vec<Site>, Vec<Site>) {
    let mut world = World::new(params.clone(), 3, &everywhere);
    let chunks = square(corner, side);
    let rocks = chunks.iter().flat_map(|c| world.rocks(*c)).collect();
    let woody = chunks.iter().flat_map(|c| world.woody(*c)).collect();
    (rocks, woody)
}

#[test]
fn all_pairs_of_a_window_keep_their_distance() {
    let params = forest(210.0);
    let (rocks, woody) = window(&params, ChunkCoord::new(-3, -2), 6);
    assert!(rocks.len() > 36 * 5 && woody.len() > 36 * 450);
    assert_distances(&params, &rocks, &woody);
}

#[test]
fn so_they_do_at_other_factors_and_far_away() {
    for (spacing_factor, density_factor, corner) in [
        (0.4, 1.0, ChunkCoord::new(0, 0)),
        (2.0, 1.3, ChunkCoord::new(-1, 4)),
        (1.2, 1.0, ChunkCoord::new(1_000_000, -1_000_000)),
    ] {
        let mut params = forest(60.0);
        params.layers[2].per_chunk = 60.0;
        params.spacing_factor = spacing_factor;
        params.density_factor = density_factor;
        let (rocks, woody) = window(&params, corner, 3);
        assert!(woody.len() > 9 * 50, "{}", woody.len());
        assert_distances(&params, &rocks, &woody);
    }
}

#[test]
fn the_rule_is_not_met_by_accident() {
    // Random sites of this density break the rule, which shows that the check above can fail.
    let params = forest(210.0);
    let (rocks, mut woody) = window(&params, ChunkCoord::new(0, 0), 2);
    for site in &mut woody {
        site.radius_m *= 1.2;
    }
    let result = std::panic::catch_unwind(|| assert_distances(&params, &rocks, &woody));
    assert!(result.is_err());
}

#[test]
fn order_and_eviction_do_not_show() {
    let chunks = square(ChunkCoord::new(-2, -1), 4);
    let mut world = World::new(forest(96.0), 9, &beside_trails);
    let expected: Vec<_> = chunks
        .iter()
        .map(|c| (world.rocks(*c), world.woody(*c)))
        .collect();
    let mut rng = Key::world(1).domain(Domain::new("test.shuffle")).rng();
    for _ in 0..3 {
        let mut order: Vec<usize> = (0..chunks.len()).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, rng.below(i as u32 + 1) as usize);
        }
        world.evict();
        for i in order {
            let woody = world.woody(chunks[i]);
            if rng.chance(0.3) {
                world.evict();
            }
            assert_eq!(
                (world.rocks(chunks[i]), woody),
                expected[i],
                "chunk {}",
                chunks[i]
            );
        }
    }
}

#[test]
fn the_order_of_what_is_handed_in_does_not_show() {
    let coord = ChunkCoord::new(1, 1);
    let mut world = World::new(forest(96.0), 2, &everywhere);
    let mut neighbours: Vec<Vec<Site>> = Placement::lower_phase_neighbours(coord)
        .into_iter()
        .map(|c| world.rocks(c))
        .collect();
    neighbours.reverse();
    let slices: Vec<&[Site]> = neighbours.iter().map(Vec::as_slice).collect();
    assert_eq!(
        world.placement.rocks(coord, &everywhere, &slices),
        world.rocks(coord)
    );
    let mut around: Vec<Site> = square(coord.offset(-1, -1), 3)
        .into_iter()
        .flat_map(|c| world.rocks(c))
        .collect();
    around.reverse();
    assert_eq!(
        world.placement.woody(coord, &everywhere, &around),
        world.woody(coord)
    );
}

#[test]
fn sites_are_in_their_chunk_and_told_apart_by_key() {
    for corner in [
        ChunkCoord::new(-2, -2),
        ChunkCoord::new(1_000_000, -1_000_000),
    ] {
        let params = forest(96.0);
        let mut world = World::new(params.clone(), 4, &everywhere);
        let mut keys = std::collections::HashSet::new();
        for coord in square(corner, 3) {
            let woody = world.woody(coord);
            assert!(woody.is_sorted_by_key(|s| (s.layer, s.key)));
            for site in world.rocks(coord).into_iter().chain(woody) {
                assert_eq!(ChunkCoord::containing(site.position_m, 50.0), coord);
                assert!(keys.insert(site.key));
            }
        }
    }
}

#[test]
fn worlds_differ_and_so_do_chunks() {
    let coord = ChunkCoord::new(0, 0);
    let mut a = World::new(forest(96.0), 1, &everywhere);
    let mut b = World::new(forest(96.0), 2, &everywhere);
    let positions = |sites: Vec<Site>, coord: ChunkCoord| -> Vec<DVec2> {
        sites
            .iter()
            .map(|s| s.position_m - coord.origin_m(50.0))
            .collect()
    };
    let other = ChunkCoord::new(-1, 0);
    assert_ne!(
        positions(a.woody(coord), coord),
        positions(b.woody(coord), coord)
    );
    assert_ne!(
        positions(a.woody(coord), coord),
        positions(a.woody(other), other)
    );
    assert_ne!(
        positions(a.rocks(coord), coord),
        positions(b.rocks(coord), coord)
    );
}

#[test]
fn the_exclusion_is_respected_and_moves_nothing() {
    let mut free = World::new(forest(210.0), 6, &everywhere);
    let mut trails = World::new(forest(210.0), 6, &beside_trails);
    let coord = ChunkCoord::new(3, -5);
    let all = free.placement.woody(coord, &everywhere, &[]);
    let beside = trails.placement.woody(coord, &beside_trails, &[]);
    let expected: Vec<Site> = all
        .iter()
        .filter(|s| beside_trails(s.position_m, s.radius_m))
        .copied()
        .collect();
    assert_eq!(beside, expected);
    assert!(beside.len() < all.len() - 20);
    for coord in square(coord, 4) {
        let rocks = trails.rocks(coord);
        assert!((5..=25).contains(&rocks.len()));
        assert!(
            rocks
                .iter()
                .all(|s| beside_trails(s.position_m, s.radius_m))
        );
        assert!(free.rocks(coord).len() >= 5);
    }
    let nowhere = |_: DVec2, _: f64| false;
    assert!(free.placement.rocks(coord, &nowhere, &[]).is_empty());
    assert!(free.placement.woody(coord, &nowhere, &[]).is_empty());
}

#[test]
fn rocks_come_in_the_numbers_asked_for() {
    let mut params = forest(0.0);
    params.rocks.min_per_chunk = 2;
    params.rocks.max_per_chunk = 6;
    let mut world = World::new(params, 8, &everywhere);
    let mut histogram = [0_u32; 8];
    for coord in square(ChunkCoord::new(0, 0), 30) {
        histogram[world.rocks(coord).len()] += 1;
    }
    assert_eq!(histogram[..2], [0, 0]);
    assert_eq!(histogram[7], 0);
    // 180 of each are expected, with a binomial deviation.
    assert!(
        histogram[2..7].iter().all(|n| n.abs_diff(180) < 48),
        "{histogram:?}"
    );
}

#[test]
fn crowded_rocks_give_up_rather_than_overlap() {
    let mut params = forest(0.0);
    params.chunk_size_m = 10.0;
    params.rocks.min_per_chunk = 200;
    params.rocks.max_per_chunk = 200;
    params.rocks.varieties = vec![variety(1.0, 0.8, 1.0)];
    params.spacing_factor = 1.0;
    let (rocks, _) = {
        params.layers.clear();
        window(&params, ChunkCoord::new(0, 0), 4)
    };
    assert!((16 * 10..16 * 40).contains(&rocks.len()), "{}", rocks.len());
    assert_distances(&params, &rocks, &[]);
}

#[test]
fn phases_tile_the_plane() {
    for coord in square(ChunkCoord::new(-3, -3), 6) {
        let lower = Placement::lower_phase_neighbours(coord);
        let expected = [0, 2, 6, 8][usize::from(Placement::phase(coord))];
        assert_eq!(lower.len(), expected, "{coord}");
        for c in square(coord.offset(-1, -1), 3) {
            if c != coord {
                // Of two neighbours, exactly one sees the other.
                assert_ne!(Placement::phase(c), Placement::phase(coord));
                let seen = Placement::lower_phase_neighbours(c).contains(&coord);
                assert_ne!(lower.contains(&c), seen);
            }
        }
    }
    assert_eq!(Placement::phase(ChunkCoord::new(-1, 4)), 1);
    assert_eq!(Placement::phase(ChunkCoord::new(-2, -7)), 2);
}

#[test]
fn larger_density_factors_are_sparser() {
    let mut last = f64::INFINITY;
    for density_factor in [0.8, 1.0, 1.25, 2.0] {
        let mut params = trees(60.0);
        params.density_factor = density_factor;
        let mut world = World::new(params, 1, &everywhere);
        let chunks = square(ChunkCoord::new(0, 0), 6);
        let count: usize = chunks.iter().map(|c| world.woody(*c).len()).sum();
        let mean = count as f64 / chunks.len() as f64;
        let expected = 60.0 / (density_factor * density_factor);
        assert!(
            (mean / expected - 1.0).abs() < 0.1,
            "{density_factor}: {mean}, not {expected}"
        );
        assert!(mean < last);
        last = mean;
    }
}

#[test]
fn nothing_asked_for_is_nothing() {
    let mut params = trees(0.0);
    let coord = ChunkCoord::new(2, 2);
    let mut world = World::new(params.clone(), 1, &everywhere);
    assert!(world.rocks(coord).is_empty() && world.woody(coord).is_empty());
    params.layers[0].varieties.clear();
    let mut world = World::new(params.clone(), 1, &everywhere);
    assert!(world.woody(coord).is_empty());
    // An empty layer changes no other layer's number.
    params
        .layers
        .push(layer("shrubs", 20.0, vec![variety(1.0, 0.2, 0.3)]));
    let mut world = World::new(params, 1, &everywhere);
    let sites = world.woody(coord);
    assert!(!sites.is_empty() && sites.iter().all(|s| s.layer == 1));
}

#[test]
fn the_trails_share_is_made_up_for() {
    let expected = allowed_fraction();
    let mut params = trees(96.0);
    params.allowed_fraction = expected;
    let mut world = World::new(params, 2, &beside_trails);
    let chunks = square(ChunkCoord::new(-4, -4), 10);
    let count: usize = chunks.iter().map(|c| world.woody(*c).len()).sum();
    assert!((count as f64 / 9600.0 - 1.0).abs() < 0.03, "{count}");
}

#[test]
fn impossible_wishes_are_refused_with_the_reason() {
    let refused = |change: &dyn Fn(&mut PlacementParams)| {
        let mut params = forest(96.0);
        change(&mut params);
        let error = Placement::new(params, Key::world(1)).expect_err("refused");
        (error.to_string(), error)
    };
    type Change = fn(&mut PlacementParams);
    let changes: [(&str, Change); 11] = [
        ("chunk_size_m", |p| p.chunk_size_m = f64::NAN),
        ("spacing_factor", |p| p.spacing_factor = -1.0),
        ("density_factor", |p| p.density_factor = 0.0),
        ("allowed_fraction", |p| p.allowed_fraction = 0.0),
        ("rocks.min_per_chunk", |p| p.rocks.min_per_chunk = 26),
        ("rocks.varieties", |p| p.rocks.varieties.clear()),
        ("layers[1].per_chunk", |p| {
            p.layers[1].per_chunk = f64::INFINITY
        }),
        ("layers[1].varieties", |p| {
            p.layers[1].varieties[0].weight = 0.0
        }),
        ("layers[0].varieties[2].radius_m", |p| {
            p.layers[0].varieties[2].radius_m = (0.6, 0.4)
        }),
        ("layers[2].varieties[0].radius_m", |p| {
            p.layers[2].varieties[0].radius_m = (0.1, 30.0)
        }),
        ("layers[0].varieties[0].weight", |p| {
            p.layers[0].varieties[0].weight = f64::NAN
        }),
    ];
    for (field, change) in changes {
        let (message, _) = refused(&change);
        assert!(message.starts_with(&format!("{field} = ")), "{message}");
        assert!(message.contains("must be"), "{message}");
    }
    let (message, error) = refused(&|p| p.layers[0].varieties[1].radius_m = (3.0, 5.0));
    let PlacementError::TooDense {
        layer: 0, at_most, ..
    } = error
    else {
        panic!("{error:?}")
    };
    assert!(at_most < 96.0 && at_most > 5.0, "{error:?}");
    assert!(
        message.contains("layers[0].per_chunk = 96 (trees)"),
        "{message}"
    );
    let (_, error) = refused(&|p| p.layers[2].per_chunk = 4000.0);
    assert!(
        matches!(error, PlacementError::TooDense { layer: 2, .. }),
        "{error:?}"
    );
}

#[test]
fn the_number_that_fits_fits() {
    let mut params = trees(96.0);
    params.layers[0].varieties = vec![variety(1.0, 2.0, 3.0)];
    let Err(PlacementError::TooDense { at_most, .. }) =
        Placement::new(params.clone(), Key::world(1))
    else {
        panic!("96 hard cores of 3 m do not fit");
    };
    params.layers[0].per_chunk = 0.97 * at_most;
    let mut world = World::new(params, 1, &everywhere);
    let chunks = square(ChunkCoord::new(0, 0), 8);
    let count: usize = chunks.iter().map(|c| world.woody(*c).len()).sum();
    assert!(
        (count as f64 / 64.0 / (0.97 * at_most) - 1.0).abs() < 0.03,
        "{count}"
    );
}

#[test]
fn value_stability() {
    let mut world = World::new(forest(96.0), 7, &everywhere);
    let coord = ChunkCoord::new(-3, 5);
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
    let rocks = world.rocks(coord);
    let woody = world.woody(coord);
    let got = [
        format!("{} {}", rocks.len(), woody.len()),
        line(&rocks[0]),
        line(&woody[0]),
        line(&woody[woody.len() - 1]),
    ];
    assert_eq!(got, VALUES);
}
const VALUES: [&str; 4] = [
    "23 393",
    "-148.411590746 281.673710188 0.689600079 0 0 33d1743371ddc5c8",
    "-103.638436925 254.659812292 0.428357204 0 2 074352e501fffa5e",
    "-135.010190262 282.691568043 0.378482939 2 0 13f0fd72fe83f61d",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    #[test]
    fn any_world_keeps_the_rule(
        seed: u64,
        x in -1000_i32..1000,
        y in -1000_i32..1000,
        chunk_size_m in 20.0_f64..60.0,
        spacing_factor in 0.0_f64..2.0,
        density_factor in 0.9_f64..1.5,
        trees in 0.5_f64..40.0,
        ratio in 1.0_f64..6.0,
    ) {
        let mut params = forest(trees);
        params.chunk_size_m = chunk_size_m;
        params.spacing_factor = spacing_factor;
        params.density_factor = density_factor;
        params.rocks.min_per_chunk = 0;
        params.rocks.max_per_chunk = 5;
        params.layers[0].varieties[2] = variety(1.0, 0.15, 0.15 * ratio);
        params.layers[1].per_chunk = 1.0;
        params.layers[2].per_chunk = 20.0;
        let mut world = World::new(params.clone(), seed, &everywhere);
        let chunks = square(ChunkCoord::new(x, y), 2);
        let rocks: Vec<Site> = chunks.iter().flat_map(|c| world.rocks(*c)).collect();
        let woody: Vec<Site> = chunks.iter().flat_map(|c| world.woody(*c)).collect();
        assert_distances(&params, &rocks, &woody);
    }
}

/// A layer of six sizes, some of them rare, on which the fit of the calibration must not diverge.
#[test]
fn any_mix_of_sizes_finds_room_if_there_is_room() {
    for case in 0..60 {
        let mut rng = Key::world(case).rng();
        let varieties = (0..rng.between(1, 8)).map(|_| {
            let radius = rng.range_f64(0.1, 0.6);
            DiskKind {
                weight: rng.range_f64(0.01, 1.0),
                radius_m: (radius, radius),
            }
        });
        let per_chunk = [5.0, 60.0][case as usize % 2];
        let layer = LayerParams::new("things", per_chunk, varieties.collect());
        let params = PlacementParams {
            layers: vec![layer],
            ..PlacementParams::default()
        };
        Placement::new(params, Key::world(1)).unwrap_or_else(|e| panic!("case {case}: {e}"));
    }
}

/// Shrubs among trees, with varieties six times as large as others of their layer.
#[test]
fn very_different_sizes_find_room_beside_other_layers() {
    let sized = |radii: &[(f64, f64)]| -> Vec<DiskKind> {
        let exactly = |&(weight, radius_m)| DiskKind {
            weight,
            radius_m: (radius_m, radius_m),
        };
        radii.iter().map(exactly).collect()
    };
    let equal = |radii: &[f64]| sized(&radii.iter().map(|&r| (1.0, r)).collect::<Vec<_>>());
    let layer = |per_chunk, varieties| LayerParams::new("things", per_chunk, varieties);
    let params = PlacementParams {
        rocks: RockParams {
            min_per_chunk: 2,
            max_per_chunk: 14,
            varieties: equal(&[
                0.18, 0.19, 0.22, 0.28, 0.34, 0.4, 0.43, 0.61, 0.71, 1.03, 1.14, 1.28,
            ]),
        },
        layers: vec![
            layer(
                96.0,
                sized(&[
                    (0.6, 0.170_135_462_801_139_7),
                    (0.2, 0.2565453865198012),
                    (0.2, 0.2630495971818622),
                ]),
            ),
            layer(
                5.0,
                equal(&[
                    0.13672864437103271,
                    0.20677655935287476,
                    0.223398819565773,
                    0.2907021641731262,
                    0.29264745116233826,
                    0.3246815800666809,
                    0.3888181447982788,
                    0.3714057505130768,
                    0.4013883173465729,
                ]),
            ),
            layer(
                60.0,
                equal(&[
                    0.14713879823684692,
                    0.2229231595993042,
                    0.31046073436737065,
                    0.35193464756011966,
                    0.09629182815551758,
                    0.1305549144744873,
                    0.1469892740249634,
                    0.20175564289093018,
                    0.2903842210769653,
                    0.37794497013092043,
                    0.5349044799804688,
                    0.5772736072540283,
                ]),
            ),
        ],
        spacing_factor: 1.3,
        allowed_fraction: 0.98297119140625,
        ..PlacementParams::default()
    };
    Placement::new(params, Key::world(1)).expect("there is room");
}
