//! Results do not depend on order: bytes are the same for any number of threads, any order of
//! frames, any store and any plan of the same request, near the origin and far from it.

use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

use nemoral_pipeline::ChunkManager;
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_raycast::RayScene;
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{ChunkCoord, ObjectKind, Ray, RayCaster};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_stand::SceneObject;
use nemoral_tests::{World, record};

/// Settings with small views that still reach over chunk borders, and with frames 30 m apart, so
/// that chunks come and go.
const SMALL: [&str; 10] = [
    "frames=3",
    "chunks.visible_radius_m=20",
    "chunks.undergrowth_radius_m=10",
    "chunks.delete_radius_m=30",
    "camera.width_px=48",
    "camera.height_px=27",
    "camera.edge_samples=4",
    "lidar.pulses=1500",
    "robot.spacing_m=30",
    "trails.spawn_probability=0.1",
];

const FRAMES: [u64; 3] = [0, 1, 2];

fn settings(more: &[&'static str]) -> Vec<&'static str> {
    [&SMALL, more].concat()
}

/// A world and its frames.
struct Known {
    world: World,
    frames: Vec<Vec<u8>>,
}

/// The world of these tests. The lock makes them take turns, as each needs a store without chunks
/// and frames of others.
static HOME: LazyLock<Mutex<Known>> = LazyLock::new(|| {
    let world = World::new("demo", &settings(&[]));
    let frames = frames(&world, &world.runner(1), &FRAMES);
    Mutex::new(Known { world, frames })
});

fn home() -> MutexGuard<'static, Known> {
    let known = HOME.lock().unwrap_or_else(PoisonError::into_inner);
    known.world.forget();
    known
}

/// Another world that shares the store, and with it the library, which is the same for both.
fn beside(known: &Known, more: &[&'static str]) -> World {
    let world = World::new("demo", &settings(more));
    let assets = |w: &World| w.forest.plan().key(w.forest.assets, ());
    assert_eq!(assets(&world), assets(&known.world));
    world
}

fn frames(world: &World, runner: &Runner<'_>, order: &[u64]) -> Vec<Vec<u8>> {
    let made = order.iter().map(|&frame| {
        let bytes = record(&world.forest, runner, frame);
        bytes.unwrap_or_else(|e| panic!("{e}"))
    });
    made.collect()
}

/// Asserts that frames are equal, and reports the first difference rather than megabytes.
#[track_caller]
fn assert_same(a: &[Vec<u8>], b: &[Vec<u8>], what: &str) {
    assert_eq!(a.len(), b.len(), "{what}");
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        let at = a.iter().zip(b).position(|(x, y)| x != y);
        assert!(
            a.len() == b.len() && at.is_none(),
            "{what}: frame {i} differs: {} and {} bytes, first at {at:?}",
            a.len(),
            b.len()
        );
    }
}

#[test]
fn frames_differ_from_each_other() {
    let known = home();
    assert!(known.frames[0] != known.frames[1] && known.frames[1] != known.frames[2]);
    assert!(known.frames[0].len() > 48 * 27 * 20);
}

#[test]
fn threads_do_not_matter() {
    let known = home();
    for threads in [1, 2, 8] {
        known.world.forget();
        let made = frames(&known.world, &known.world.runner(threads), &FRAMES[..2]);
        let what = format!("{threads} threads for chunks");
        assert_same(&made, &known.frames[..2], &what);
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().expect("a pool");
        known.world.forget();
        // The runner computes one node at a time, so that no job of the pool waits for another's
        // node.
        let made = pool.install(|| frames(&known.world, &known.world.runner(1), &FRAMES[..1]));
        let what = format!("{threads} threads for pixels and pulses");
        assert_same(&made, &known.frames[..1], &what);
    }
}

#[test]
fn frames_made_by_several_threads_at_once_are_the_same() {
    let known = home();
    let world = &known.world;
    let made: Vec<Vec<u8>> = std::thread::scope(|scope| {
        let workers = FRAMES
            .map(|frame| scope.spawn(move || frames(world, &world.runner(2), &[frame]).remove(0)));
        workers.map(|w| w.join().expect("no panic")).into()
    });
    assert_same(&made, &known.frames, "a thread for each frame");
}

#[test]
fn backwards_is_forwards() {
    let known = home();
    let mut made = frames(&known.world, &known.world.runner(2), &[2, 1, 0]);
    made.reverse();
    assert_same(&made, &known.frames, "backwards");
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_store_that_keeps_one_value_is_enough() {
    // Everything is computed repeatedly, which would take minutes in a larger world.
    let tiny = [
        "chunks.visible_radius_m=10",
        "chunks.undergrowth_radius_m=5",
    ];
    let known = home();
    let tiny_world = beside(&known, &tiny);
    let store = &known.world.store;
    let before = store.computed();
    let runner = Runner::new(tiny_world.forest.plan(), store, 1);
    let expected = frames(&tiny_world, &runner, &[1]);
    let needed = store.computed() - before;
    let one = World {
        store: Store::with_capacity(1),
        ..World::new("demo", &settings(&tiny))
    };
    let made = frames(&one, &one.runner(2), &[1]);
    assert_same(&made, &expected, "capacity 1");
    assert!(one.store.count("chunk.objects") <= 1);
    let computed = one.store.computed();
    println!("{needed} values of chunks and frames, {computed} with a store of capacity 1");
    assert!(computed > 2 * needed);
}

#[test]
fn a_fresh_plan_for_each_frame_is_the_same() {
    let known = home();
    for &frame in &FRAMES {
        known.world.forget();
        let world = beside(&known, &[]);
        let runner = Runner::new(world.forest.plan(), &known.world.store, 2);
        let expected = &known.frames[frame as usize..=frame as usize];
        assert_same(&frames(&world, &runner, &[frame]), expected, "a fresh plan");
    }
    // Nothing is shared, as in another process.
    let world = World::new("demo", &settings(&[]));
    let made = frames(&world, &world.runner(2), &[1]);
    assert_same(&made, &known.frames[1..=1], "a fresh plan and store");
}

/// Gullies, meadows with edge trees, outcrops, and all that follows the lie of the ground.
const STEERED: [&str; 13] = [
    "assets.individuals=1",
    "terrain.gully_depth_m=2",
    "terrain.warp=0.1",
    "terrain.terraces=0.5",
    "undergrowth.ground.wetness=1",
    "undergrowth.ground.heat_load=1",
    "undergrowth.ground.soil=1",
    "undergrowth.ground.mud=1",
    "placement.meadows.share=0.4",
    "placement.meadows.scale_m=40",
    "undergrowth.sward.cover=0.3",
    "placement.outcrops=1",
    "terrain.max_height_m=40",
];

#[test]
#[ignore = "takes long: for .ci/full"]
fn gullies_and_meadows_do_not_depend_on_order() {
    let world = World::new("demo", &settings(&STEERED));
    let expected = frames(&world, &world.runner(1), &FRAMES);
    world.forget();
    let fresh = World::new("demo", &settings(&STEERED));
    let runner = Runner::new(fresh.forest.plan(), &world.store, 8);
    let mut made = frames(&fresh, &runner, &[2, 1, 0]);
    made.reverse();
    assert_same(&made, &expected, "backwards, eight threads, a fresh plan");
}

#[test]
fn another_seed_is_another_world() {
    let known = home();
    let world = World::new("demo", &settings(&["seed=8"]));
    // Growing the assets too would test nothing more.
    let chunk = ChunkCoord::new(0, 0);
    let (a, b) = (&known.world, &world);
    let key = |w: &World| w.forest.plan().key(w.forest.objects, chunk);
    assert_ne!(key(a), key(b));
    let key = |w: &World| w.forest.plan().key(w.forest.scans, 0);
    assert_ne!(key(a), key(b));
}

/// Settings for a place 50,000 km from the origin.
const FAR: [&str; 3] = [
    "robot.start_x_m=50000025.0",
    "robot.start_y_m=-49999975.0",
    "frames=3",
];

#[test]
fn far_from_the_origin_nothing_changes() {
    let known = home();
    let far = beside(&known, &FAR);
    let (world, store) = (&far, &known.world.store);
    let runner = Runner::new(world.forest.plan(), store, 2);
    let expected = frames(world, &runner, &FRAMES);
    assert!(expected[0] != known.frames[0], "another place");
    let size_m = world.config.chunks.size_m;

    let start = ChunkCoord::new(1_000_000, -1_000_000);
    let reach_m = 20.0 + 500.0;
    let mut things_seen = 0;
    for frame in FRAMES {
        let pose = runner.get(world.forest.pose, frame).expect("a pose");
        let body = pose.world_from_body();
        let away = pose.chunk.distance_m(start.centre_m(size_m), size_m);
        assert!(away < reach_m, "{} is {away} m from {start}", pose.chunk);
        let lidars = runner.get(world.forest.lidars, ()).expect("a lidar");
        let assets = runner.get(world.forest.assets, ()).expect("assets");
        let world_from_lidar = body * lidars[0].body_from_lidar;
        for point in &runner.get(world.forest.scans, frame).expect("a scan")[0] {
            if point.object.is_none() {
                continue;
            }
            // The id gives the object, which is where the point is.
            let chunk = point.object.chunk();
            let things = runner.get(world.forest.objects, chunk).expect("things");
            let thing = &things.0[usize::from(point.object.item()) - 1];
            assert_eq!(thing.object, point.object);
            let position = world_from_lidar.transform_point(point.position_m.as_dvec3());
            let off = position - thing.position_m;
            let bounds = assets.shape(thing).prototype().bounds();
            let extent = (bounds.min.abs().max(bounds.max.abs()) * thing.scale as f32).as_dvec3();
            let reach = extent.truncate().length() + 0.2;
            assert!(
                off.truncate().length() <= reach,
                "{:?} at {} is {off} from its foot, reach {reach}",
                thing.kind,
                thing.position_m
            );
            things_seen += 1;
        }
    }
    assert!(things_seen > 100, "{things_seen}");

    known.world.forget();
    let runner = Runner::new(world.forest.plan(), store, 8);
    let mut made = frames(world, &runner, &[2, 1, 0]);
    made.reverse();
    assert_same(&made, &expected, "far, backwards, eight threads");
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_chunk_that_was_deleted_comes_back_the_same() {
    let known = home();
    let world = &known.world;
    let runner = world.runner(2);
    let size_m = world.config.chunks.size_m;
    let chunk = ChunkCoord::new(2, -1);
    let visit = || {
        let things = runner.get(world.forest.objects, chunk).expect("things");
        let solid = runner
            .get(world.forest.object_geometry, chunk)
            .expect("geometry");
        // Rust prints floats exactly, so equal texts mean equal objects.
        let things: Vec<String> = things
            .0
            .iter()
            .map(|t: &SceneObject| format!("{t:?}"))
            .collect();
        let forest = RayScene::new(vec![(Vec3::ZERO, solid.group.clone())]);
        let mut hits = Vec::new();
        let key = Key::world(1).domain(Domain::new("tests.rays"));
        for i in 0..500 {
            let mut rng = key.item(i).rng();
            let mut coordinate = |low: f64, high: f64| rng.range_f64(low, high);
            let from = DVec3::new(coordinate(0.0, 50.0), coordinate(0.0, 50.0), 60.0);
            let to = DVec3::new(coordinate(0.0, 50.0), coordinate(0.0, 50.0), 0.0);
            let ray = Ray::new(from.as_vec3(), (to - from).normalize().as_vec3());
            hits.push(forest.closest_hit(&ray).map(|h| format!("{h:?}")));
        }
        (things, hits)
    };
    let first = visit();
    let kinds = |k: ObjectKind| {
        first
            .0
            .iter()
            .filter(|t| t.contains(&format!("kind: {k:?}")))
            .count()
    };
    assert!(kinds(ObjectKind::Tree) > 10 && kinds(ObjectKind::Shrub) > 10);
    let hits = first.1.iter().flatten().count();
    assert!(hits >= 450, "{hits} of 500 rays hit");

    // The robot leaves, and the chunk manager deletes chunks far behind it.
    let manager = ChunkManager::new(world.config.chunks.clone());
    let plan = world.forest.plan();
    let key = plan.key(world.forest.objects, chunk);
    assert!(world.store.contains(key));
    manager.evict(
        &world.store,
        chunk.centre_m(size_m) + DVec2::new(5000.0, 0.0),
        &[],
    );
    assert!(!world.store.contains(key));
    assert!(
        !world
            .store
            .contains(plan.key(world.forest.object_geometry, chunk))
    );
    assert_eq!(world.store.count("chunk.ground"), 0);

    // Other chunks are computed first this time.
    for (dx, dy) in [(1, 1), (-1, 0), (0, -1)] {
        let other = chunk.offset(dx, dy);
        runner
            .get(world.forest.object_geometry, other)
            .expect("geometry");
    }
    let again = visit();
    assert!(first.0 == again.0, "things differ");
    assert!(first.1 == again.1, "hits differ");
}
