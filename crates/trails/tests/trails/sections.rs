//! The sections of kinds of way.

use std::sync::Arc;

use crate::common::{SIZE_M, flat, hills, northward, plain};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_trails::{CrossSection, TrailZone, WayKind};

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
