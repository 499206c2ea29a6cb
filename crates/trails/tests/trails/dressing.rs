//! What lies and grows on ways and at their edges.

use crate::common::{around, flat, given, northward};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_trails::{DressingKind, WayKind};

#[test]
fn grass_and_stones_come_in_patches_on_a_way_that_changes() {
    let counts = |change: f64, wanted: DressingKind| {
        let way = WayKind {
            change,
            rocks_max_per_trail: 2000,
            ..WayKind::default()
        };
        let (trails, path) = northward(way, flat(DVec2::ZERO));
        let mut along = [0_u32; 24];
        for chunk in around(ChunkCoord::new(0, 0), 3) {
            for d in trails.dressing(chunk).iter().filter(|d| d.kind == wanted) {
                let s = (d.position_m - path.position_m(0.0)).dot(path.tangent(120.0));
                along[((s / 10.0) as usize).min(23)] += 1;
            }
        }
        let (least, most) = (
            along[2..22].iter().min().copied().unwrap_or(0),
            along[2..22].iter().max().copied().unwrap_or(0),
        );
        f64::from(least) / f64::from(most.max(1))
    };
    for kind in [DressingKind::Grass, DressingKind::Stone] {
        let (even, patchy) = (counts(0.0, kind), counts(0.9, kind));
        assert!(even > 0.2 && patchy < 0.15, "{kind:?}: {even} {patchy}");
    }
}

#[test]
fn steps_lie_where_a_path_is_steep() {
    let steps = |grade: f64, from: f64| {
        let way = WayKind {
            steps_from_grade: from,
            ..WayKind::footpath()
        };
        let (trails, path) = northward(way, flat(DVec2::new(0.0, grade)));
        let mut steps = Vec::new();
        for chunk in around(ChunkCoord::new(0, 0), 3) {
            let dressing = trails.dressing(chunk).into_iter();
            steps.extend(dressing.filter(|d| d.kind == DressingKind::Step));
        }
        (steps, path)
    };
    assert!(steps(0.15, 0.2).0.is_empty() && steps(0.3, 0.0).0.is_empty());
    for grade in [0.3, -0.3] {
        let (found, path) = steps(grade, 0.2);
        // A rise of 240 m times 0.3 has room for 423 steps.
        assert!((140..400).contains(&found.len()), "{}", found.len());
        for step in &found {
            let offset = step.position_m.x - path.position_m(120.0).x;
            assert!(offset.abs() < 0.05, "{offset}");
            assert!((0.4..1.2).contains(&step.scale), "{}", step.scale);
            let down = DVec2::from_angle(step.yaw_rad).perp();
            assert!(down.y * grade < -0.29, "{down}");
        }
        let mut places: Vec<f64> = found.iter().map(|s| s.position_m.y).collect();
        places.sort_by(f64::total_cmp);
        let apart = places.windows(2).map(|p| p[1] - p[0]);
        let nearest = apart.fold(f64::INFINITY, f64::min);
        assert!((nearest - 0.17 / 0.3).abs() < 0.02, "{nearest}");
    }
}

#[test]
fn culverts_lead_from_the_uphill_ditch_to_the_slope_below() {
    let culverts = |slope: f64, spacing_m: f64| {
        let way = WayKind {
            culvert_spacing_m: spacing_m,
            ..WayKind::forest_road()
        };
        let (trails, path) = northward(way, flat(DVec2::new(slope, 0.0)));
        let mut found = Vec::new();
        for chunk in around(ChunkCoord::new(0, 0), 3) {
            let dressing = trails.dressing(chunk).into_iter();
            found.extend(dressing.filter(|d| d.kind == DressingKind::Culvert));
        }
        (found, path.position_m(120.0).x)
    };
    // On level ground both sides have ditches.
    assert!(culverts(0.0, 20.0).0.is_empty() && culverts(0.25, 0.0).0.is_empty());
    let (found, middle) = culverts(0.25, 20.0);
    assert!((16..=24).contains(&found.len()), "{}", found.len());
    let uphill = found.iter().filter(|d| d.position_m.x > middle).count();
    assert_eq!(2 * uphill, found.len());
    for mouth in &found {
        let side = (mouth.position_m.x - middle).signum();
        let opens = DVec2::from_angle(mouth.yaw_rad);
        assert!(
            opens.x * side > 0.99,
            "it opens away from the road: {opens}"
        );
        let off_m = (mouth.position_m.x - middle).abs();
        assert!((1.8..3.3).contains(&off_m), "{off_m}");
    }
}

#[test]
fn roots_lie_across_paths_and_stones_in_ditches() {
    let (trails, path) = northward(WayKind::footpath(), flat(DVec2::ZERO));
    let mut roots = 0;
    for chunk in around(ChunkCoord::new(0, 0), 3) {
        let roots_here = trails.dressing(chunk);
        for root in roots_here.iter().filter(|d| d.kind == DressingKind::Root) {
            let offset = (root.position_m.x - path.position_m(120.0).x).abs();
            assert!(offset < 0.75, "{offset}");
            // Within 46 degrees of across.
            assert!(root.yaw_rad.cos().abs() > 0.69, "{}", root.yaw_rad);
            roots += 1;
        }
    }
    // About half of one a metre, in patches.
    assert!((60..200).contains(&roots), "{roots}");
    let way = WayKind {
        stone_beds: 0.5,
        ..WayKind::forest_road()
    };
    let ditch = way.section.ditch.expect("a road has one");
    let (trails, path) = northward(way, flat(DVec2::new(0.2, 0.0)));
    let mut beds = 0;
    for chunk in around(ChunkCoord::new(0, 0), 3) {
        let ground = trails.ground_near(chunk, 1.0);
        let beds_here = trails.dressing(chunk);
        for bed in beds_here.iter().filter(|d| d.kind == DressingKind::Bed) {
            let edge = ground.edge_m(bed.position_m);
            assert!((edge - 0.5 * ditch.width_m).abs() < 0.2, "{edge}");
            assert!(bed.position_m.x > path.position_m(120.0).x, "uphill only");
            beds += 1;
        }
    }
    // Of room for 343.
    assert!((90..260).contains(&beds), "{beds}");
}

#[test]
fn no_root_lies_on_a_road() {
    let lines = [
        (0, [DVec2::new(-60.0, 10.0), DVec2::new(60.0, 12.0)]),
        (1, [DVec2::new(9.0, -60.0), DVec2::new(11.0, 60.0)]),
    ];
    let rooted = WayKind {
        roots_per_m: 5.0,
        change: 0.0,
        ..WayKind::footpath()
    };
    let trails = given(
        vec![(WayKind::forest_road(), 1.0), (rooted, 1.0)],
        &lines,
        flat(DVec2::ZERO),
    );
    let chunk = ChunkCoord::new(0, 0);
    let ground = trails.ground_near(chunk, 2.0);
    let dressing = trails.dressing(chunk);
    let mut roots = dressing.iter().filter(|d| d.kind == DressingKind::Root);
    assert!(roots.clone().count() > 100);
    assert!(roots.all(|d| ground.way_number(d.position_m) != Some(0)));
}

#[test]
fn stones_lie_in_narrow_ditches_too() {
    let mut way = WayKind::forest_road();
    way.stone_beds = 1.0;
    for width_m in [0.4, 0.6, 1.2, 1.5] {
        way.section.ditch = Some(nemoral_trails::Ditch {
            depth_m: 0.35,
            width_m,
        });
        let (trails, path) = northward(way.clone(), flat(DVec2::ZERO));
        let dressing = trails.dressing(ChunkCoord::new(0, 0));
        let beds = dressing.iter().filter(|d| d.kind == DressingKind::Bed);
        let ground = trails.ground_near(ChunkCoord::new(0, 0), 2.0);
        let mut count = 0;
        for bed in beds {
            count += 1;
            // The bed's edge away from the trail, on the plane that touches the ground at its
            // middle, is not above the edges of the ditch.
            let s = ground.sample(bed.position_m);
            let away = path.tangent(60.0).perp();
            let half_m = 0.52 * bed.scale;
            let level_m = ground.height_m(DVec2::new(40.0, 20.0));
            let highest = s.height_m - level_m + (s.gradient.dot(away) * half_m).abs();
            assert!(highest < 0.12, "{width_m}: {highest}");
            assert!(ground.is_in_ditch(bed.position_m, 0.0), "{width_m}");
        }
        assert!(count > 20, "{count}");
        let place = DVec2::new(3.0 + 1.8 + width_m + 1.0, 20.0);
        assert!(!ground.is_in_ditch(place, 0.3) && ground.is_in_ditch(place, 1.1));
    }
}
