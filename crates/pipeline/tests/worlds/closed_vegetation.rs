//! Swards and thickets: where they were asked for, as far as light allows, and off trails unless
//! these are grassy.

use nemoral_pipeline::world::patch::Patch;
use nemoral_realism::World;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, PlantCommunity, TrailSurfaceKind};
use nemoral_stand::PatchKind;

/// A world of few plants.
fn world(preset: &str, settings: &[&str]) -> World {
    World::without_cameras(
        preset,
        &[
            &["assets.individuals=1", "trails.spawn_probability=0.1"],
            settings,
        ]
        .concat(),
    )
}

/// Calls with the patches of nine chunks, each with its distance from the edge of a trail and
/// the surface of that trail.
fn each(world: &World, mut f: impl FnMut(&Patch, f64, Option<TrailSurfaceKind>)) {
    let runner = world.runner(2);
    for i in 0..9 {
        let at = ChunkCoord::new(i % 3, i / 3);
        let ground = runner.get(world.forest.ground, at).expect("ground");
        for patch in runner
            .get(world.forest.undergrowth, at)
            .expect("patches")
            .iter()
        {
            let p = patch.point.position_m;
            f(patch, ground.trail_edge_m(p), ground.trail_kind(p));
        }
    }
}

const CHUNKS_M2: f64 = 9.0 * 2500.0;

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_glade_is_under_grass_and_its_trails_too() {
    let world = world("glade", &[]);
    let (mut wide, mut on_trail, mut trail_cells) = (0, 0, 0);
    each(&world, |patch, edge_m, surface| match patch.kind {
        PatchKind::Closed(community) => {
            assert!(edge_m > 0.8, "{community:?} {edge_m} m from a trail");
            wide += i32::from(community.is_grass());
        }
        PatchKind::ClosedBorder(community) => {
            assert!(community.is_grass());
            if edge_m < 0.0 {
                assert_eq!(community, PlantCommunity::GrazedGrass);
                assert_eq!(surface, Some(TrailSurfaceKind::Grassy));
                on_trail += 1;
            }
        }
        _ => {}
    });
    let share = f64::from(wide) * 1.25 * 1.25 / CHUNKS_M2;
    assert!((0.5..=1.0).contains(&share), "{share}");
    // Narrow tiles on 0.55 m cells, from verge to verge.
    let runner = world.runner(2);
    for i in 0..9 {
        let at = ChunkCoord::new(i % 3, i / 3);
        let ground = runner.get(world.forest.ground, at).expect("ground");
        for k in 0..100 * 100 {
            let cell = DVec2::new(f64::from(k % 100) + 0.5, f64::from(k / 100) + 0.5) * 0.5;
            let p = at.origin_m(50.0) + cell;
            let is_grassy = ground.trail_kind(p) == Some(TrailSurfaceKind::Grassy);
            trail_cells += i32::from(is_grassy && ground.trail_edge_m(p) < 0.0);
        }
    }
    assert!(trail_cells > 500, "no trail to look at: {trail_cells}");
    let closed = f64::from(on_trail) * 0.55 * 0.55 / (f64::from(trail_cells) * 0.25);
    assert!((0.6..1.1).contains(&closed), "{closed}");
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn where_deer_are_there_are_fewer_brambles_and_young_trees() {
    let world = world("rank-clearing", &["undergrowth.ground.browsing=1"]);
    let runner = world.runner(2);
    // Tiles of brambles, of bracken, seedlings, and the ground, where few and where many deer are.
    let mut found = [[0.0_f64; 4]; 2];
    for at in ChunkCoord::new(0, 0).square(2) {
        let ground = runner.get(world.forest.ground, at).expect("ground");
        let mut count = |p: DVec2, what: usize| {
            let browsing = ground.history(p).browsing;
            if browsing.abs() > 0.3 {
                found[usize::from(browsing > 0.0)][what] += 1.0;
            }
        };
        for patch in &*runner.get(world.forest.undergrowth, at).expect("patches") {
            match patch.kind {
                PatchKind::Closed(PlantCommunity::Bramble) => count(patch.point.position_m, 0),
                PatchKind::Closed(PlantCommunity::Bracken) => count(patch.point.position_m, 1),
                _ => {}
            }
        }
        for seedling in &*runner.get(world.forest.seedlings, at).expect("seedlings") {
            count(seedling.position_m, 2);
        }
        for k in 0..400 {
            let cell = DVec2::new(f64::from(k % 20) + 0.5, f64::from(k / 20) + 0.5) * 2.5;
            count(at.origin_m(50.0) + cell, 3);
        }
    }
    let [few, many] = found.map(|of| [0, 1, 2].map(|what| of[what] / of[3]));
    println!("brambles, bracken, seedlings a place: {few:?} where deer are few, else {many:?}");
    assert!(found.iter().all(|of| of[3] > 1000.0), "{found:?}");
    assert!(many[0] < 0.5 * few[0] && many[2] < 0.6 * few[2]);
    assert!(many[1] > 1.05 * few[1]);
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn other_surfaces_stay_free_and_thickets_take_their_share() {
    let world = world("rank-clearing", &[]);
    let mut counts = [0; PlantCommunity::ALL.len()];
    each(&world, |patch, edge_m, _| match patch.kind {
        PatchKind::Closed(community) => counts[community.index()] += 1,
        PatchKind::ClosedBorder(_) => assert!(edge_m > 0.0, "{edge_m}"),
        _ => {}
    });
    let share = |of: PlantCommunity| f64::from(counts[of.index()]) * 1.25 * 1.25 / CHUNKS_M2;
    let bramble = share(PlantCommunity::Bramble);
    assert!((0.05..0.6).contains(&bramble), "{counts:?}");
    assert!(share(PlantCommunity::GrazedGrass) == 0.0, "{counts:?}");
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn there_is_less_in_the_dark_and_nothing_without_being_asked_for() {
    let closed = |preset, settings: &[&str]| {
        let mut count = 0;
        each(&world(preset, settings), |patch, _, _| {
            let is_closed = matches!(
                patch.kind,
                PatchKind::Closed(_) | PatchKind::ClosedBorder(_)
            );
            count += i32::from(is_closed);
        });
        count
    };
    let same = [
        "undergrowth.sward.cover=0.5",
        "undergrowth.thickets.bramble=0.0",
    ];
    let [light, dark] = ["montado", "beech"].map(|preset| closed(preset, &same));
    assert!(f64::from(dark) < 0.6 * f64::from(light), "{dark} {light}");
    assert_eq!(closed("demo", &[]), 0);
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn the_paper_medium_preset_stays_within_its_instances() {
    let world = world("medium", &["trails.spawn_probability=0.012"]);
    let scene = world.runner(2).get(world.forest.scene, 0).expect("a scene");
    let counts = scene
        .groups
        .iter()
        .map(|(_, group)| group.instances().len());
    let in_view: usize = counts.sum();
    println!("{in_view} instances in view");
    assert!((20_000..45_000).contains(&in_view), "{in_view}");
}
