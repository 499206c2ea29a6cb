//! Water in a stand: nothing else stands or lies in it, it is inside of its banks, and chunks
//! agree.

use std::sync::LazyLock;

use nemoral_pipeline::config::{ConfigLayers, Preset};
use nemoral_pipeline::world::chunk_ground::ChunkGround;
use nemoral_pipeline::{Backend, Recorder};
use nemoral_realism::{World, grown};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, ObjectKind, PlantCommunity, Prototype, Semantic, Surface};
use nemoral_stand::PatchKind;
use nemoral_water::{ChunkWater, Pond};

/// Streams, ponds and trails in most chunks.
const SETTINGS: [&str; 6] = [
    "assets.individuals=1",
    "water.springs_per_km2=300",
    "water.ponds=1",
    "water.puddles=1",
    "trails.spawn_probability=0.05",
    "trails.forks=0",
];

static VALLEY: LazyLock<World> =
    LazyLock::new(|| World::without_cameras("stream-valley", &SETTINGS));

fn chunks() -> impl Iterator<Item = ChunkCoord> {
    ChunkCoord::new(0, 0).square(2)
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn nothing_stands_or_lies_in_water_but_stones() {
    let runner = VALLEY.runner(2);
    let (mut wet, mut rocks, mut objects) = (0, 0, 0);
    for at in chunks() {
        let ground = runner.get(VALLEY.forest.ground, at).expect("a ground");
        let in_chunk = runner.get(VALLEY.forest.objects, at).expect("objects");
        for object in &in_chunk.0 {
            let p = object.position_m.truncate();
            objects += 1;
            if ground.bank_m(p) > 0.0 {
                continue;
            }
            wet += 1;
            rocks += usize::from(object.kind == ObjectKind::Rock);
            assert!(object.kind == ObjectKind::Rock, "{object:?}");
        }
        let patches = runner.get(VALLEY.forest.undergrowth, at).expect("patches");
        for patch in &*patches {
            let p = patch.point.position_m;
            assert!(ground.bank_m(p) > 0.0, "{patch:?}");
        }
        let seedlings = runner.get(VALLEY.forest.seedlings, at).expect("seedlings");
        for seedling in &*seedlings {
            assert!(ground.bank_m(seedling.position_m) > 0.0);
        }
    }
    println!("{objects} objects, {wet} in water, {rocks} of them stones");
    assert!(rocks > 20 && objects > 1000);
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn stones_in_streams_are_wet_and_reeds_are_beside_them() {
    let runner = VALLEY.runner(2);
    let assets = runner.get(VALLEY.forest.assets, ()).expect("assets");
    let wet = |shape: &Prototype| {
        let mut materials = shape.mesh().triangles.iter().map(|t| t.material);
        materials.any(|m| assets.library.materials.get(m).name.ends_with(".wet"))
    };
    let (mut wet_rocks, mut dry_rocks, mut reeds) = (0, 0, 0);
    for at in chunks() {
        let ground = runner.get(VALLEY.forest.ground, at).expect("a ground");
        let objects = runner.get(VALLEY.forest.objects, at).expect("objects");
        let rocks = objects
            .0
            .iter()
            .filter(|o| o.kind == ObjectKind::Rock && !o.on_trail);
        for rock in rocks {
            let is_wet = wet(assets.shape(rock).prototype());
            let bank_m = ground.bank_m(rock.position_m.truncate());
            // In ponds and on land none is, and in the middle of streams all are.
            assert!(bank_m < 1.0 || !is_wet, "{bank_m}");
            wet_rocks += usize::from(is_wet);
            dry_rocks += usize::from(!is_wet);
        }
        let patches = runner.get(VALLEY.forest.undergrowth, at).expect("patches");
        for patch in &*patches {
            if patch.kind == PatchKind::Closed(PlantCommunity::Reeds) {
                let bank_m = ground.bank_m(patch.point.position_m);
                assert!((0.1..2.9).contains(&bank_m), "{bank_m}");
                reeds += 1;
            }
        }
    }
    println!("{wet_rocks} wet rocks, {dry_rocks} dry ones, {reeds} tiles of reeds");
    assert!(wet_rocks > 20 && dry_rocks > 20 && reeds > 20);
}

#[test]
fn water_is_inside_of_its_banks() {
    let runner = VALLEY.runner(2);
    let assets = runner.get(VALLEY.forest.assets, ()).expect("assets");
    let materials = &assets.library.materials;
    let (mut border, mut above, mut worst_m, mut shown) = (0, 0, 0.0_f64, 0);
    for at in chunks() {
        let geometry = runner
            .get(VALLEY.forest.object_geometry, at)
            .expect("a chunk");
        let ground = runner.get(VALLEY.forest.ground, at).expect("a ground");
        let origin = at.origin_m(50.0);
        for (_, shape) in geometry.group.instances() {
            let mesh = shape.prototype().mesh();
            let is_water = (mesh.triangles.first())
                .is_some_and(|t| materials.get(t.material).semantic == Semantic::Water);
            if !is_water {
                continue;
            }
            let mut edges = std::collections::BTreeMap::new();
            for t in &mesh.triangles {
                let [a, b, c] = t.corners;
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    *edges.entry((from.min(to), from.max(to))).or_insert(0) += 1;
                }
            }
            for ((a, b), count) in edges {
                let [a, b] = [a, b].map(|i| mesh.positions[i as usize].as_dvec3());
                let middle = 0.5 * (a + b);
                let p = origin + middle.truncate();
                let height_m = middle.z - ground.height_m(p);
                if count > 1 {
                    shown += usize::from(height_m > 0.0);
                } else if ground.bank_m(p) > 0.1 {
                    border += 1;
                    above += usize::from(height_m > 0.0);
                    worst_m = worst_m.max(height_m);
                }
            }
        }
    }
    println!("{border} border edges, {above} above the ground by up to {worst_m:.3} m");
    assert!(border > 1000 && shown > 1000, "{border} {shown}");
    assert!(
        above * 100 < border && worst_m < 0.08,
        "{above} of {border}, {worst_m}"
    );
}

/// The middles of a chunk's ponds.
fn ponds(ground: &ChunkGround) -> Vec<DVec2> {
    let ponds = ground.water().into_iter().flat_map(ChunkWater::ponds);
    let middles = ponds.map(Pond::middle_m);
    middles.filter(|&p| ground.owns(p)).collect()
}

#[test]
fn a_robot_must_not_drive_into_ponds_and_streams() {
    let settings = [&SETTINGS[..], &["camera.enabled=false"]].concat();
    let layers = ConfigLayers {
        preset: Some("stream-valley".to_owned()),
        settings: settings.into_iter().map(str::to_owned).collect(),
        ..ConfigLayers::default()
    };
    let sequence = layers.sequences().expect("sound").get(0).expect("one");
    let recorder = Recorder::new(sequence, Backend::Cpu, grown(), 2).expect("sound");
    let runner = VALLEY.runner(2);
    let ground = |at: &ChunkCoord| runner.get(VALLEY.forest.ground, *at).expect("a ground");
    let disks = |at: ChunkCoord| {
        let low_m = at.origin_m(50.0);
        recorder.obstacles(low_m, low_m + 50.0).expect("disks")
    };
    let with_ponds = chunks().find(|at| !ponds(&ground(at)).is_empty());
    let with_ponds = with_ponds.expect("a pond");
    let around_ponds = disks(with_ponds);
    for pond in ponds(&ground(&with_ponds)) {
        let is_there = around_ponds.iter().any(|d| d.position_m == pond);
        assert!(is_there, "no disk about the pond at {pond}");
    }
    // The chunk with most of those streams that come from others.
    let own = |ground: &ChunkGround| {
        let sections = ground.water().map(|w| w.sections().flatten());
        let middles = sections.into_iter().flatten().map(|s| s.middle_m);
        middles.filter(|&p| ground.owns(p)).count()
    };
    let of_others = |at: &ChunkCoord| {
        let ground = ground(at);
        let all = ground.water().map_or(0, |w| w.sections_in_chunk().count());
        all - own(&ground)
    };
    let entered = chunks().max_by_key(of_others).expect("25 chunks");
    let along_streams = disks(entered);
    let (entered_by, ground) = (of_others(&entered), ground(&entered));
    let mut wet = 0;
    for i in 0..250 * 250 {
        let p = entered.origin_m(50.0) + DVec2::new(f64::from(i % 250), f64::from(i / 250)) * 0.2;
        // Beside trails streams are in culverts, which have no disks.
        if ground.bank_m(p) < 0.0 && ground.trail_edge_m(p) > 4.0 {
            wet += 1;
            let is_covered =
                (along_streams.iter()).any(|disk| disk.position_m.distance(p) < disk.radius_m);
            assert!(is_covered, "no disk over the water at {p}");
        }
    }
    assert!(wet > 100 && entered_by > 10, "{wet} {entered_by}");
}

#[test]
fn grounds_of_neighbours_agree_to_the_bit() {
    let runner = VALLEY.runner(2);
    let ground = |at| runner.get(VALLEY.forest.ground, at).expect("a ground");
    let mut wet = 0;
    for at in chunks() {
        let (here, east) = (ground(at), ground(at.offset(1, 0)));
        let border = at.offset(1, 0).origin_m(50.0);
        for i in 0..3000 {
            let p = border + DVec2::new(f64::from(i % 60) * 0.2 - 6.0, f64::from(i / 60));
            assert_eq!(here.sample(p), east.sample(p), "{p}");
            assert_eq!(here.bank_m(p), east.bank_m(p), "{p}");
            assert_eq!(here.puddle_edge_m(p), east.puddle_edge_m(p), "{p}");
            wet += usize::from(here.bank_m(p) < 1.0 || here.puddle_edge_m(p) < 0.0);
        }
    }
    assert!(wet > 300, "{wet}");
}

#[test]
fn puddles_are_on_trails() {
    let runner = VALLEY.runner(2);
    let mut inside = 0;
    for at in chunks() {
        let ground = runner.get(VALLEY.forest.ground, at).expect("a ground");
        for i in 0..40_000 {
            let p = at.origin_m(50.0) + DVec2::new(f64::from(i % 200), f64::from(i / 200)) * 0.25;
            if ground.puddle_edge_m(p) < 0.0 {
                inside += 1;
                assert!(ground.trail_edge_m(p) < 0.0);
            }
        }
    }
    assert!(inside > 100, "{inside}");
}

#[test]
fn the_papers_presets_have_no_water() {
    for preset in ["low", "medium", "high", "demo"] {
        let config = Preset::by_name(preset).expect("a preset").config();
        assert!(!config.water.is_any(), "{preset}");
    }
    assert!(
        Preset::by_name("default")
            .expect("a preset")
            .config()
            .water
            .is_any()
    );
}
