//! Undergrowth, a grid of the whole plane that is cut into chunks.

use glam::DVec2;
use nemoral_placement::{CoverKind, CoverPoint, GroundCover, GroundCoverParams};
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use proptest::prelude::*;

fn cover(params: GroundCoverParams) -> GroundCover {
    GroundCover::new(params, Key::world(7)).expect("valid parameters")
}

fn everywhere(_: DVec2, _: f64) -> bool {
    true
}

fn square(side: i32) -> impl Iterator<Item = ChunkCoord> {
    (0..side).flat_map(move |y| (0..side).map(move |x| ChunkCoord::new(x - 2, y - 2)))
}

#[test]
fn points_stay_near_their_cells_and_in_their_chunk() {
    let params = GroundCoverParams::default();
    let cover = cover(params.clone());
    for coord in [
        ChunkCoord::new(3, -2),
        ChunkCoord::new(1_000_000, -1_000_000),
    ] {
        let points = cover.points(coord, &everywhere, &|_| 1.0);
        // 50² / 1.2² cells, give or take what strays across the border.
        assert!((1660..1815).contains(&points.len()), "{}", points.len());
        for p in points {
            assert_eq!(ChunkCoord::containing(p.position_m, 50.0), coord);
            assert!((0.7..1.3).contains(&p.scale));
            assert!((0.0..std::f64::consts::TAU).contains(&p.yaw_rad));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Larger chunks over the same grid hold the same points: none is lost or doubled at a border.
    #[test]
    fn chunks_cut_one_grid(
        cell_m in 0.5_f64..4.0,
        jitter in 0.0_f64..2.0,
        chunk_size_m in 5.0_f64..12.0,
    ) {
        let small = GroundCoverParams {
            chunk_size_m,
            cell_m,
            jitter,
            ..GroundCoverParams::default()
        };
        let large = GroundCoverParams {
            chunk_size_m: 2.0 * chunk_size_m,
            ..small.clone()
        };
        let (small, large) = (cover(small), cover(large));
        let sorted = |mut points: Vec<CoverPoint>| {
            points.sort_by_key(|p| p.key);
            points
        };
        let of = |cover: &GroundCover, side| -> Vec<CoverPoint> {
            square(side)
                .flat_map(|c| cover.points(c, &everywhere, &|_| 1.0))
                .collect()
        };
        // 4 × 4 small chunks from (−2, −2) are 2 × 2 large ones from (−1, −1).
        let of_large: Vec<CoverPoint> = [(-1, -1), (0, -1), (-1, 0), (0, 0)]
            .into_iter()
            .flat_map(|(x, y)| large.points(ChunkCoord::new(x, y), &everywhere, &|_| 1.0))
            .collect();
        prop_assert!(!of_large.is_empty());
        prop_assert_eq!(sorted(of(&small, 4)), sorted(of_large));
    }
}

#[test]
fn thinning_follows_the_density_and_only_removes() {
    let cover = cover(GroundCoverParams::default());
    let coord = ChunkCoord::new(0, 0);
    let all = cover.points(coord, &everywhere, &|_| 1.0);
    let mut last = all.clone();
    for density in [0.7, 0.3, 0.05] {
        let points = cover.points(coord, &everywhere, &|_| density);
        let share = points.len() as f64 / all.len() as f64;
        let sigma = (density * (1.0 - density) / all.len() as f64).sqrt();
        assert!(
            (share - density).abs() < 4.0 * sigma,
            "{share}, not {density}"
        );
        assert!(points.iter().all(|p| last.contains(p)));
        last = points;
    }
    assert!(cover.points(coord, &everywhere, &|_| 0.0).is_empty());
    // A density that depends on the place: undergrowth in the eastern half only.
    let east = cover.points(coord, &everywhere, &|p| f64::from(u8::from(p.x > 25.0)));
    let expected: Vec<_> = all
        .iter()
        .filter(|p| p.position_m.x > 25.0)
        .copied()
        .collect();
    assert_eq!(east, expected);
}

#[test]
fn the_exclusion_is_asked_with_the_scaled_radius() {
    let cover = cover(GroundCoverParams::default());
    let coord = ChunkCoord::new(-1, 0);
    let off_trail = |p: DVec2, r: f64| (p.y - 25.0).abs() > 1.5 + r;
    let all = cover.points(coord, &everywhere, &|_| 1.0);
    let expected: Vec<_> = all
        .iter()
        .filter(|p| off_trail(p.position_m, 0.3 * p.scale))
        .copied()
        .collect();
    assert_eq!(cover.points(coord, &off_trail, &|_| 1.0), expected);
    assert!(expected.len() < all.len() - 60);
}

#[test]
fn weights_are_shares() {
    let mut params = GroundCoverParams::default();
    let variety = params.varieties[0];
    params.varieties = [1.0, 0.0, 3.0]
        .map(|weight| CoverKind { weight, ..variety })
        .to_vec();
    let cover = cover(params);
    let points: Vec<_> = square(3)
        .flat_map(|c| cover.points(c, &everywhere, &|_| 1.0))
        .collect();
    let of = |v: u16| points.iter().filter(|p| p.variety == v).count() as f64 / points.len() as f64;
    assert!((of(0) - 0.25).abs() < 0.015);
    assert_eq!(of(1), 0.0);
}

#[test]
fn impossible_wishes_are_refused() {
    let default = GroundCoverParams::default();
    let variety = default.varieties[0];
    for (params, field) in [
        (
            GroundCoverParams {
                cell_m: 0.0,
                ..default.clone()
            },
            "cell_m",
        ),
        (
            GroundCoverParams {
                cell_m: 51.0,
                ..default.clone()
            },
            "cell_m",
        ),
        (
            GroundCoverParams {
                cell_m: 0.01,
                ..default.clone()
            },
            "cell_m",
        ),
        (
            GroundCoverParams {
                jitter: f64::NAN,
                ..default.clone()
            },
            "jitter",
        ),
        (
            GroundCoverParams {
                varieties: vec![],
                ..default.clone()
            },
            "varieties",
        ),
        (
            GroundCoverParams {
                varieties: vec![CoverKind {
                    scale: (1.0, 0.5),
                    ..variety
                }],
                ..default
            },
            "varieties[0].scale",
        ),
    ] {
        let error = GroundCover::new(params, Key::world(1))
            .expect_err("refused")
            .to_string();
        assert!(error.starts_with(&format!("{field} = ")), "{error}");
    }
}

#[test]
fn value_stability() {
    let cover = cover(GroundCoverParams::default());
    let points = cover.points(ChunkCoord::new(-3, 5), &everywhere, &|_| 0.5);
    let p = points[100];
    let got = format!(
        "{} {:.9} {:.9} {:.9} {:.9} {}",
        points.len(),
        p.position_m.x,
        p.position_m.y,
        p.yaw_rad,
        p.scale,
        p.variety
    );
    assert_eq!(got, VALUES);
}
const VALUES: &str = "849 -102.651833088 254.844637122 4.096027278 0.756976860 0";
