//! The carving of the ground by trails.

use std::sync::Arc;

use crate::common::{SIZE_M, around, flat, hills, plain, trails};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_trails::{
    CrossSection, DressingKind, Ruts, TrailDressing, TrailGround, TrailParams, TrailPath,
    TrailSurfaceKind, TrailZone, Trails, WayKind,
};
use proptest::prelude::*;

fn dense(way: WayKind) -> TrailParams {
    TrailParams {
        spawn_probability: 0.1,
        max_length_chunks: 14,
        ..TrailParams::of(way)
    }
}

fn params(section: CrossSection) -> TrailParams {
    dense(WayKind {
        section,
        ..WayKind::default()
    })
}

/// A place well inside of a trail, far from other trails and from ends.
struct Place {
    ground: Arc<TrailGround>,
    path: Arc<TrailPath>,
    s: f64,
    at: DVec2,
    left: DVec2,
}

fn lonely_places(trails: &Trails, clearance_m: f64) -> Vec<Place> {
    let mut places = Vec::new();
    for chunk in around(ChunkCoord::new(0, 0), 2) {
        let ground = Arc::new(trails.ground_near(chunk, 20.0));
        for path in trails.in_chunk(chunk) {
            let n = (path.length_m() / 1.7) as usize;
            for i in 20..n.saturating_sub(20) {
                let s = i as f64 * 1.7;
                let at = path.position_m(s);
                let left = path.tangent(s).perp();
                let alone = |side: f64| {
                    // No other trail comes closer to a point beside the trail.
                    let p = at + left * (side * clearance_m / 2.0);
                    let (near, t) = trails.nearest(p, clearance_m).expect("the trail itself");
                    near.id() == path.id() && (t - s).abs() < 3.0
                };
                if ChunkCoord::containing(at, SIZE_M) == chunk && alone(1.0) && alone(-1.0) {
                    places.push(Place {
                        ground: Arc::clone(&ground),
                        path: Arc::clone(&path),
                        s,
                        at,
                        left,
                    });
                }
            }
        }
    }
    assert!(places.len() > 100, "{}", places.len());
    places
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn grounds_of_neighbours_agree_to_the_bit(
        seed: u64,
        x in -1_000_000..1_000_000,
        y in -1_000_000..1_000_000,
        east in any::<bool>(),
    ) {
        let trails = trails(params(CrossSection::default()), seed, hills(0.4));
        let here = ChunkCoord::new(x, y);
        let there = if east {
            here.offset(1, 0)
        } else {
            here.offset(0, 1)
        };
        let (a, b) = (
            trails.ground_near(here, 5.0),
            trails.ground_near(there, 3.0),
        );
        let corner = there.origin_m(SIZE_M);
        let along = if east { DVec2::Y } else { DVec2::X };
        for i in 0..=600 {
            // Points on the border and slightly to both sides, where both grounds are valid.
            for off in [0.0, -2.9, 2.9] {
                let p = corner + along * (f64::from(i) / 600.0 * SIZE_M) + along.perp() * off;
                prop_assert_eq!(a.sample(p), b.sample(p));
                prop_assert_eq!(a.edge_m(p), b.edge_m(p));
                prop_assert_eq!(
                    (a.zone(p), a.kind(p), a.offset_m(p)),
                    (b.zone(p), b.kind(p), b.offset_m(p))
                );
            }
        }
    }

    #[test]
    fn the_ground_is_continuous_and_gradients_are_difference_quotients(seed: u64) {
        let trails = trails(params(CrossSection::default()), seed, hills(0.4));
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
                // There is no step anywhere, not even where slopes meet.
                prop_assert!(
                    steps.iter().all(|s| (s - here).abs() < 20.0 * e),
                    "{} {:?}",
                    here,
                    steps
                );
                let expected = DVec2::new(steps[0] - steps[1], steps[2] - steps[3]) / (2.0 * e);
                if ground.edge_m(p) < 5.0 {
                    near += 1;
                    off += i32::from((ground.sample(p).gradient - expected).length() > 0.01);
                }
            }
        }
        // Only creases may differ, such as valleys between slopes, and knots.
        prop_assert!(off * 100 <= near, "{} of {}", off, near);
    }
}

#[test]
fn edges_are_where_the_width_says() {
    for p in lonely_places(&trails(params(plain()), 1, hills(0.3)), 16.0) {
        let half = p.path.width_m(p.s) / 2.0;
        assert!((half - 1.5).abs() < 1e-9 || p.s < 12.0 || p.path.length_m() - p.s < 12.0);
        for offset in [-4.0, -1.5, -0.5, 0.0, 0.7, 1.5, 5.0] {
            let at = p.at + p.left * offset;
            if half == 1.5 {
                assert!((p.ground.edge_m(at) - (f64::abs(offset) - half)).abs() < 1e-3);
                let got = p.ground.offset_m(at).expect("near");
                assert!((got - offset).abs() < 1e-3, "{got} {offset}");
            }
        }
        assert_eq!(p.ground.kind(p.at), Some(p.path.kind(p.s)));
    }
}

#[test]
fn the_full_width_is_usable_and_the_grade_is_limited() {
    let section = CrossSection {
        earth_m: 30.0,
        ..plain()
    };
    let steep = trails(params(section), 2, hills(0.6));
    let mut worst = 0.0_f64;
    for p in lonely_places(&steep, 30.0) {
        let middle = p.ground.height_m(p.at);
        for side in [-1.45, -0.7, 0.7, 1.45] {
            let there = p.ground.height_m(p.at + p.left * side);
            assert!((there - middle).abs() < 0.08, "{}", there - middle);
        }
        let ahead = p.ground.height_m(p.path.position_m(p.s + 1.0));
        worst = worst.max((ahead - middle).abs());
    }
    // The ground is three times as steep.
    assert!((0.15..0.21).contains(&worst), "{worst}");
}

#[test]
fn slopes_are_no_steeper_than_their_ratios() {
    let section = CrossSection {
        cut_ratio: 0.8,
        fill_ratio: 1.6,
        ..plain()
    };
    // With 25 % across, slopes stay well within reach.
    let base = flat(DVec2::new(0.2, 0.15));
    let trails = trails(params(section), 3, Arc::clone(&base));
    let (mut cuts, mut fills) = (0, 0);
    for p in lonely_places(&trails, 30.0) {
        for i in 0..120 {
            let at = p.at + p.left * (f64::from(i - 60) * 0.1);
            let (z, ground) = (p.ground.sample(at), base.sample(at));
            let touched = z.height_m - ground.height_m;
            if p.ground.edge_m(at) > 0.05 && touched.abs() > 0.1 {
                // The gradient has the slope across, and the grade along adds to it.
                let across = z.gradient.length();
                let limit: f64 = if touched < 0.0 { 1.0 / 0.8 } else { 1.0 / 1.6 };
                assert!(across < f64::hypot(1.12 * limit, 0.21), "{across} {limit}");
                cuts += i32::from(touched < 0.0);
                fills += i32::from(touched > 0.0);
                assert_eq!(p.ground.zone(at), TrailZone::CutSlope);
            }
        }
    }
    assert!(cuts > 100 && fills > 100, "{cuts} {fills}");
}

#[test]
fn ground_is_untouched_where_no_slope_reaches() {
    let base = hills(0.3);
    let trails = trails(params(CrossSection::default()), 4, Arc::clone(&base));
    let (mut far, mut daylight) = (0, 0);
    for chunk in around(ChunkCoord::new(0, 0), 1) {
        let ground = trails.ground_near(chunk, 0.0);
        for i in 0..2500 {
            let p = chunk.origin_m(SIZE_M) + DVec2::new(f64::from(i % 50), f64::from(i / 50)) + 0.3;
            let untouched = ground.sample(p) == base.sample(p);
            if ground.edge_m(p) == f64::INFINITY {
                assert!(untouched);
                assert_eq!(
                    (ground.zone(p), ground.kind(p), ground.offset_m(p)),
                    (TrailZone::Off, None, None)
                );
                far += 1;
            } else if ground.edge_m(p) > 3.0 && untouched {
                daylight += 1;
            }
        }
    }
    assert!(far > 1000 && daylight > 1000, "{far} {daylight}");
}

#[test]
fn a_plain_trail_on_a_plane_changes_nothing_it_need_not() {
    // Along the fall line nothing is cut or filled beyond rounding, on level ground nothing at all.
    let base = flat(DVec2::ZERO);
    let trails = trails(params(plain()), 5, Arc::clone(&base));
    for p in lonely_places(&trails, 8.0) {
        for side in [-6.0, -2.0, 0.0, 1.0, 3.0] {
            let at = p.at + p.left * side;
            // Corners of slopes are rounded by centimetres.
            assert!((p.ground.height_m(at) - base.height_m(at)).abs() < 0.03);
        }
        assert!((p.ground.height_m(p.at) - 10.0).abs() < 1e-9);
    }
}

#[test]
fn crossings_have_no_cliffs() {
    let trails = trails(params(plain()), 6, hills(0.4));
    let mut crossings = 0;
    for chunk in around(ChunkCoord::new(0, 0), 4) {
        let ground = trails.ground_near(chunk, 1.0);
        let paths = trails.in_chunk(chunk);
        if paths.len() < 2 {
            continue;
        }
        for i in 0..10_000 {
            let p =
                chunk.origin_m(SIZE_M) + DVec2::new(f64::from(i % 100), f64::from(i / 100)) * 0.5;
            if ground.edge_m(p) < 0.0 {
                let slope = ground.sample(p).gradient.length();
                assert!(slope < 0.6, "{slope} at {p}");
                let near = |path: &Arc<TrailPath>| {
                    let n = (path.length_m() / 0.5) as usize;
                    (0..n).any(|i| path.position_m(i as f64 * 0.5).distance(p) < 1.4)
                };
                // Finding crossings is slow, so only look at some points.
                if i % 7 == 0 && paths.iter().filter(|path| near(path)).count() > 1 {
                    crossings += 1;
                }
            }
        }
    }
    assert!(crossings > 3, "{crossings}");
}

#[test]
fn the_section_is_carved() {
    let base = flat(DVec2::ZERO);
    let relief = |section: CrossSection, width_m: f64, offset: f64| {
        let way = WayKind {
            width_m,
            section,
            ..WayKind::default()
        };
        let params = dense(way.surfaced(TrailSurfaceKind::DryEarth));
        let trails = trails(params, 7, Arc::clone(&base));
        let places = lonely_places(&trails, 16.0);
        let heights = places
            .iter()
            .filter(|p| p.path.width_m(p.s) == width_m)
            .map(|p| p.ground.height_m(p.at + p.left * offset) - p.ground.height_m(p.at));
        let (sum, n) = heights.fold((0.0, 0.0), |(sum, n), h| (sum + h, n + 1.0));
        sum / n
    };
    let crowned = CrossSection {
        crown: 0.1,
        ..plain()
    };
    assert!((relief(crowned, 3.0, 1.0) + 0.1 * 2.0 / 3.0).abs() < 1e-6);
    let curved = CrossSection {
        curve: vec![
            DVec2::new(-1.0, 0.2),
            DVec2::new(0.0, 0.0),
            DVec2::new(1.0, -0.1),
        ],
        ..plain()
    };
    assert!((relief(curved.clone(), 3.0, -0.5) - 0.1).abs() < 1e-6);
    assert!((relief(curved, 3.0, 1.2) + 0.1).abs() < 1e-6);
    // The curve goes on beyond the edge, and the shoulder fades it by a fifth 0.4 m from there.
    let banked = CrossSection {
        curve: vec![DVec2::new(1.5, 0.0), DVec2::new(1.9, 0.6)],
        ..plain()
    };
    let bank = relief(banked, 3.0, 1.9);
    assert!((0.3..0.6).contains(&bank), "{bank}");
    let rutted = CrossSection {
        ruts: Some(Ruts {
            depth_m: 0.2,
            gauge_m: 1.6,
            sigma_m: 0.16,
        }),
        ..plain()
    };
    // The mean depth below the ridge is the depth and a quarter, up to the keyed variation.
    for side in [-0.8, 0.8] {
        let depth = -relief(rutted.clone(), 3.0, side);
        assert!((0.15..0.3).contains(&depth), "{depth}");
    }
    assert!(relief(rutted, 1.8, 0.8).abs() < 1e-9);
    // Crossfall falls to the downhill side.
    let tilted = trails(
        params(CrossSection {
            crossfall: 0.05,
            ..plain()
        }),
        8,
        flat(DVec2::new(0.2, 0.0)),
    );
    for p in lonely_places(&tilted, 30.0)
        .iter()
        .filter(|p| p.left.x.abs() > 0.9)
    {
        let east = p.left * p.left.x.signum();
        let rise = p.ground.height_m(p.at + east) - p.ground.height_m(p.at - east);
        assert!(rise > 0.05, "{rise}");
    }
}

#[test]
fn zones_meet_where_the_border_says() {
    let trails = trails(params(CrossSection::default()), 9, hills(0.2));
    let mut borders = 0;
    for p in lonely_places(&trails, 16.0).iter().take(40) {
        let half = 0.5 * p.path.width_m(p.s) + 0.5;
        let at = |i: i32| p.at + p.left * (f64::from(i) * 1e-3);
        let steps = (half * 1e3) as i32;
        for i in -steps..steps {
            let flat = |z| {
                if z == TrailZone::CutSlope {
                    TrailZone::Off
                } else {
                    z
                }
            };
            let (a, b) = (at(i), at(i + 1));
            let (za, zb) = (flat(p.ground.zone(a)), flat(p.ground.zone(b)));
            let (da, db) = (p.ground.border_m(a), p.ground.border_m(b));
            // It changes like the position, except for the wander of the ruts.
            assert!((da - db).abs() < 1.2e-3, "{da} {db}");
            assert_eq!(za != zb, da.signum() != db.signum(), "{za:?} {zb:?}");
            if za != zb {
                borders += 1;
                // On whichever side rounding puts a piece of the mesh, its part is one of the two.
                let sides = [true, false].map(|n| flat(p.ground.place(a).zone_on_side(n)));
                assert!(sides.contains(&za) && sides.contains(&zb), "{sides:?}");
            }
        }
    }
    assert!(borders > 150, "{borders}");
}

#[test]
fn zones_follow_the_ruts() {
    let trails = trails(params(CrossSection::default()), 9, hills(0.2));
    let mut seen = std::collections::BTreeSet::new();
    for p in lonely_places(&trails, 16.0)
        .iter()
        .filter(|p| p.path.width_m(p.s) == 3.0)
    {
        let zone = |offset: f64| p.ground.zone(p.at + p.left * offset);
        // The ruts wander by 10 cm.
        assert_eq!(
            (zone(0.0), zone(0.4), zone(-0.4)),
            (TrailZone::Strip, TrailZone::Strip, TrailZone::Strip)
        );
        assert_eq!((zone(0.8), zone(-0.8)), (TrailZone::Rut, TrailZone::Rut));
        assert_eq!(
            (zone(1.25), zone(-1.25)),
            (TrailZone::Surface, TrailZone::Surface)
        );
        seen.insert(zone(2.0));
        seen.insert(zone(9.0));
    }
    assert!(
        seen.contains(&TrailZone::CutSlope) && seen.contains(&TrailZone::Off),
        "{seen:?}"
    );
}

#[test]
fn small_chunks_and_wide_trails_work() {
    let params = dense(WayKind {
        width_m: 4.0,
        grass_spread_m: 9.0,
        ..WayKind::default()
    });
    let trails = Trails::new(params, 16.0, nemoral_seed::Key::world(3), hills(0.3)).expect("valid");
    for chunk in around(ChunkCoord::new(0, 0), 2) {
        let (a, b) = (
            trails.ground_near(chunk, 4.0),
            trails.ground_near(chunk.offset(1, 0), 0.0),
        );
        for i in 0..=100 {
            let p = chunk.offset(1, 0).origin_m(16.0) + DVec2::Y * (f64::from(i) * 0.16);
            assert_eq!((a.sample(p), a.edge_m(p)), (b.sample(p), b.edge_m(p)));
            assert!(a.sample(p).height_m.is_finite());
        }
        let mats = |d: &&TrailDressing| d.kind == DressingKind::Strip;
        let dressing = trails.dressing(chunk);
        let count = dressing.iter().filter(mats).count();
        assert!(dressing.len() - count < 500 && count < 2000, "{count}");
    }
}

#[test]
fn value_stability() {
    let trails = trails(
        params(CrossSection::default()),
        7,
        flat(DVec2::new(0.1, -0.05)),
    );
    let (path, s) = trails.nearest(DVec2::ZERO, 500.0).expect("a trail");
    let middle = path.position_m(s);
    let ground = trails.ground_near(ChunkCoord::containing(middle, SIZE_M), 20.0);
    let got = [0.3, 1.7, 2.4].map(|offset| {
        let p = middle + path.tangent(s).perp() * offset;
        format!(
            "{:?} {:?} {:?}",
            ground.sample(p),
            ground.edge_m(p),
            ground.zone(p)
        )
    });
    assert_eq!(got, VALUES);
}
const VALUES: [&str; 3] = [
    "SurfaceSample { height_m: 9.577432304842057, gradient: DVec2(0.10920366799681284, \
     0.0021093399055451267) } -1.2000000000000004 Strip",
    "SurfaceSample { height_m: 9.613277996784998, gradient: DVec2(0.06340717198745843, \
     -0.22193170958147698) } 0.2000000000000004 Off",
    "SurfaceSample { height_m: 9.641397423259447, gradient: DVec2(0.1, -0.05) } 0.9000000000000008 \
     Off",
];
