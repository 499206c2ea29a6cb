//! Deadwood: as much as was asked for, of the stages that were asked for, lying on the ground.

use std::sync::LazyLock;

use nemoral_assets::LogAsset;
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_realism::{World, config};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{ChunkCoord, DeadwoodRecord, ObjectKind, Surface};
use nemoral_stand::SceneObject;

const FEW: &str = "assets.individuals=1";

/// An oak stand with trails in most chunks.
static OAKS: LazyLock<World> = LazyLock::new(|| {
    let trails = ["trails.spawn_probability=0.1", FEW];
    World::without_cameras("oak-mixed", &trails)
});

fn square(side: i32) -> impl Iterator<Item = ChunkCoord> {
    (0..side * side).map(move |i| ChunkCoord::new(i % side - side / 2, i / side - side / 2))
}

/// Calls with every log of a square, and with its chunk.
fn each(
    world: &World,
    side: i32,
    kind: ObjectKind,
    mut f: impl FnMut(ChunkCoord, &SceneObject, &WorldAssets),
) {
    let runner = world.runner(2);
    let assets = runner.get(world.forest.assets, ()).expect("assets");
    for at in square(side) {
        let objects = runner.get(world.forest.objects, at).expect("objects");
        for object in objects.0.iter().filter(|o| o.kind == kind) {
            f(at, object, &assets);
        }
    }
}

fn records(world: &World, side: i32, kind: ObjectKind) -> Vec<DeadwoodRecord> {
    let mut all = Vec::new();
    each(world, side, kind, |_, object, assets| {
        all.push(assets.deadwood_record(object).expect("it lies"));
    });
    all
}

fn asset<'a>(assets: &'a WorldAssets, log: &SceneObject) -> &'a LogAsset {
    let of = &assets.library.deadwood;
    of.logs
        .iter()
        .chain(&of.thrown)
        .nth(log.asset)
        .expect("a log")
}

fn per_hectare(side: i32) -> f64 {
    0.25 * f64::from(side * side)
}

#[test]
fn volume_and_decay_are_as_asked() {
    let asked = config("oak-mixed", &[]).deadwood;
    let side = 10;
    let logs = records(&OAKS, side, ObjectKind::Log);
    let volume = logs.iter().map(|l| l.volume_m3).sum::<f64>() / per_hectare(side);
    let fallen = logs.iter().filter(|l| !l.is_thrown);
    let stages: Vec<f64> = fallen.map(|l| f64::from(l.decay.number())).collect();
    let decay = stages.iter().sum::<f64>() / stages.len() as f64;
    let thrown = records(&OAKS, side, ObjectKind::RootPlate).len() as f64 / per_hectare(side);
    println!(
        "{volume:.2} m3/ha of {}, stage {decay:.2} of {}, {thrown:.2} thrown of {}",
        asked.volume_m3_ha, asked.decay, asked.thrown_per_ha
    );
    assert!((volume / asked.volume_m3_ha - 1.0).abs() < 0.12, "{volume}");
    assert!((decay - asked.decay).abs() < 0.2, "{decay}");
    assert!(
        (thrown / asked.thrown_per_ha - 1.0).abs() < 0.35,
        "{thrown}"
    );
    // Every stage is there, and sizes are those of logs.
    for stage in 1..=5 {
        assert!(stages.contains(&f64::from(stage)), "stage {stage}");
    }
    for log in &logs {
        assert!((0.7..17.0).contains(&log.length_m), "{log:?}");
        let [large, small] = log.diameter_m;
        assert!((0.07..0.7).contains(&large) && small <= large, "{log:?}");
    }
}

#[test]
#[ignore = "grows three worlds of spruce"]
fn twice_the_volume_is_twice_as_much_and_none_is_none() {
    let of = |volume: &str| {
        let volume = format!("deadwood.volume_m3_ha={volume}");
        let world = World::without_cameras("spruce", &[FEW, &volume, "deadwood.thrown_per_ha=0"]);
        let logs = records(&world, 6, ObjectKind::Log);
        logs.iter().map(|l| l.volume_m3).sum::<f64>() / per_hectare(6)
    };
    let (some, twice) = (of("10"), of("20"));
    println!("{some:.2} and {twice:.2} m3/ha");
    assert!((1.5..2.6).contains(&(twice / some)), "{some} {twice}");
    assert_eq!(of("0"), 0.0);
    let demo = World::without_cameras("demo", &[]);
    assert!(records(&demo, 4, ObjectKind::Log).is_empty());
}

/// Heights of a log's underside and upper side above the ground, at places along it.
fn heights(object: &SceneObject, log: &LogAsset, ground: &impl Surface) -> Vec<[f64; 2]> {
    let linear = object.linear.as_dmat3();
    let place = |x: f64, z: f64| {
        let p = object.position_m + linear * DVec3::new(x, 0.0, z);
        p.z - ground.sample(p.truncate()).height_m
    };
    (0..=30)
        .map(|i| {
            let t = f64::from(i) / 30.0;
            let x = log.length_m * (t - 0.5);
            let half = log.half_height_m[0] + (log.half_height_m[1] - log.half_height_m[0]) * t;
            [place(x, -half), place(x, half)]
        })
        .collect()
}

#[test]
fn logs_lie_on_the_ground() {
    let runner = OAKS.runner(2);
    let mut all = 0;
    each(&OAKS, 6, ObjectKind::Log, |at, object, assets| {
        let ground = runner.get(OAKS.forest.ground, at).expect("ground");
        let log = asset(assets, object);
        let heights = heights(object, log, &*ground);
        let lowest = heights.iter().map(|h| h[0]).fold(f64::INFINITY, f64::min);
        // It touches ...
        assert!(
            lowest < 0.03,
            "{} {object:?} floats: {lowest}",
            log.prototype.name()
        );
        // ... and most of it is above the ground.
        let seen = heights.iter().filter(|h| h[1] > 0.01).count();
        assert!(
            seen * 10 >= heights.len() * 6,
            "{object:?} is buried: {heights:?}"
        );
        let thick = 2.0 * log.half_height_m[0];
        assert!(
            lowest > -1.4 * thick - 0.05,
            "{object:?} pierces the ground: {lowest}"
        );
        all += 1;
    });
    println!("{all} logs");
    assert!(all > 100, "{all}");
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn logs_keep_clear_of_trails_and_trees() {
    let runner = OAKS.runner(2);
    each(&OAKS, 6, ObjectKind::Log, |at, object, assets| {
        let ground = runner.get(OAKS.forest.ground, at).expect("ground");
        let log = asset(assets, object);
        let axis = object.linear.x_axis.as_dvec3() * log.length_m;
        let objects = runner.get(OAKS.forest.objects, at).expect("objects");
        for i in 0..=20 {
            let p = (object.position_m + axis * (f64::from(i) / 20.0 - 0.5)).truncate();
            assert!(ground.trail_edge_m(p) > 0.0, "{object:?} lies on a trail");
            for tree in objects.0.iter().filter(|o| o.kind == ObjectKind::Tree) {
                let off = tree.position_m.truncate().distance(p);
                assert!(off > tree.radius_m, "{object:?} lies in {tree:?}");
            }
        }
    });
    let across = World::without_cameras(
        "oak-mixed",
        &[
            FEW,
            "trails.spawn_probability=0.1",
            "deadwood.across_trails=true",
        ],
    );
    let runner = across.runner(2);
    let mut on_trails = 0;
    each(&across, 6, ObjectKind::Log, |at, object, _| {
        let ground = runner.get(across.forest.ground, at).expect("ground");
        on_trails += u32::from(ground.trail_edge_m(object.position_m.truncate()) < 0.0);
    });
    assert!(on_trails > 0, "none lies across a trail");
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_thrown_tree_has_its_plate_and_its_pit() {
    let runner = OAKS.runner(2);
    let mut all = 0;
    each(&OAKS, 8, ObjectKind::RootPlate, |at, plate, assets| {
        let ground = runner.get(OAKS.forest.ground, at).expect("ground");
        let row = assets.deadwood_record(plate).expect("it lies");
        let away = plate.linear.x_axis.as_dvec3().truncate().normalize();
        let foot = plate.position_m.truncate();
        let radius_m = 0.5 * row.diameter_m[0];
        // The plate stands in the ground and above it.
        let low = plate.position_m.z - ground.height_m(foot);
        assert!(
            (0.1..0.9).contains(&(low / radius_m)),
            "{low} of {radius_m}"
        );
        // Behind it the ground is lower than on both sides of the pit.
        let pit = foot - away * (0.75 * radius_m);
        let beside = |side: f64| ground.height_m(pit + away.perp() * (side * 1.3 * radius_m));
        let dug = 0.5 * (beside(1.0) + beside(-1.0)) - ground.height_m(pit);
        assert!(dug > 0.2 * radius_m, "{dug} of {radius_m}");
        all += 1;
    });
    println!("{all} thrown trees");
    assert!(all >= 8, "{all}");
}

/// What lies in a chunk depends neither on which chunks were asked for before, nor on threads.
#[test]
fn the_order_of_chunks_does_not_matter() {
    let of = |chunks: &[ChunkCoord], threads: usize| {
        let world = World::without_cameras("oak-mixed", &[FEW]);
        let runner = world.runner(threads);
        let mut texts: Vec<(ChunkCoord, String)> = Vec::new();
        for &at in chunks {
            let objects = runner.get(world.forest.objects, at).expect("objects");
            texts.push((at, format!("{:?}", objects.0)));
        }
        texts.sort();
        texts
    };
    let mut chunks: Vec<ChunkCoord> = square(3).collect();
    let forwards = of(&chunks, 1);
    chunks.reverse();
    chunks.swap(0, 4);
    assert!(forwards == of(&chunks, 3));
}
