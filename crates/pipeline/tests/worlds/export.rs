//! What is exported is what sensors meet, and a region has what the inventory says.

use std::sync::Arc;

use nemoral_export::{ExportScene, clipped, is_ground, write_height_map};
use nemoral_pipeline::config::ConfigLayers;
use nemoral_pipeline::{Backend, ExportArea, Recorder, tree_scene};
use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_realism::grown;
use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{ChunkCoord, MaterialId, Mesh, ObjectKind, Ray, RayCaster, Semantic, Triangle};

fn recorder(settings: &[&str]) -> Recorder {
    let near = [
        "chunks.visible_radius_m=15",
        "chunks.undergrowth_radius_m=10",
        "chunks.delete_radius_m=30",
    ];
    let settings = near.iter().chain(settings).map(|&s| s.to_owned());
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        settings: settings.collect(),
        ..ConfigLayers::default()
    };
    let sequence = layers.sequences().expect("sound").get(0).expect("one");
    Recorder::new(sequence, Backend::Cpu, grown(), 2).expect("sound")
}

/// A caster of an exported scene.
fn caster(scene: &ExportScene) -> RayScene {
    let place = |instance: &nemoral_scene::Instance| {
        let blas = Blas::build(Arc::clone(&instance.prototype), &scene.materials);
        (instance.place(), Arc::new(blas))
    };
    let group = Group::build(scene.instances.iter().map(place).collect());
    RayScene::new(vec![(Vec3::ZERO, Arc::new(group))])
}

#[test]
fn a_forest_is_exported_as_sensors_meet_it() {
    let recorder = recorder(&[
        "terrain.max_height_m=12",
        "climbers.moss=1",
        "deadwood.volume_m3_ha=60",
    ]);
    let frame = ExportArea::Frame(1);
    let exported = recorder.export_scene(frame).expect("frame 1");
    let seen = recorder.runner().get(recorder.forest().scene, 1);
    let seen = seen.expect("frame 1");
    assert_eq!(exported.origin_m, seen.origin_m);
    let ours = caster(&exported);
    let camera = &exported.cameras[0];
    let at = camera.scene_from_camera.translation_m.as_vec3();
    let (mut hits, mut objects) = (0, 0);
    for i in 0..2_000 {
        let (column, row) = (f64::from(i % 50), f64::from(i / 50));
        let k = &camera.intrinsics;
        let pixel = DVec2::new(
            (column + 0.5) / 50.0 * f64::from(k.width),
            (row + 0.5) / 40.0 * f64::from(k.height),
        );
        let direction = camera
            .scene_from_camera
            .transform_vector(k.direction(pixel));
        let ray = Ray::new(at, direction.as_vec3());
        let hit = |caster: &dyn RayCaster| {
            let hit = caster.closest_hit(&ray)?;
            Some((
                hit.surface.object,
                hit.surface.material,
                hit.surface.distance_m,
            ))
        };
        match (hit(&ours), hit(&*seen.caster)) {
            (Some((object, material, d)), Some(theirs)) => {
                assert_eq!((object, material), (theirs.0, theirs.1), "{pixel}");
                assert!((d - theirs.2).abs() < 1e-3, "{d} {}", theirs.2);
                hits += 1;
                objects += u32::from(!object.is_none());
            }
            (mine, theirs) => assert_eq!(mine, theirs, "{pixel}"),
        }
    }
    assert!(hits > 500 && objects > 100, "{hits} {objects}");
    region_has_what_the_inventory_says(&recorder);
    heights_are_the_grounds(&recorder);
}

fn region_has_what_the_inventory_says(recorder: &Recorder) {
    let (low_m, high_m) = (DVec2::new(-21.0, 3.5), DVec2::new(14.0, 26.0));
    let area = ExportArea::Region { low_m, high_m };
    let scene = recorder.export_scene(area).expect("a region");
    assert_eq!(scene.origin_m.truncate(), (low_m + high_m) / 2.0);
    let inventory = recorder.inventory(low_m, high_m).expect("an inventory");
    let ids = |records: &[nemoral_scene::ObjectRecord]| {
        let mut ids: Vec<_> = records.iter().map(|r| r.object).collect();
        ids.sort_unstable();
        ids
    };
    let listed: Vec<_> = inventory.iter().map(|item| item.record.clone()).collect();
    assert_eq!(ids(&scene.objects), ids(&listed));
    assert!(scene.objects.iter().any(|r| r.kind == ObjectKind::Tree));
    assert!(scene.trees.len() > 3);
    let half = ((high_m - low_m) / 2.0).as_vec2();
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let mut places = Vec::new();
    for instance in &scene.instances {
        if !is_ground(&instance.prototype, &scene.materials) {
            assert!(
                instance
                    .position_m
                    .truncate()
                    .abs()
                    .cmple(half + 1e-3)
                    .all()
            );
            continue;
        }
        for position in &instance.prototype.mesh().positions {
            let p = *position + instance.position_m;
            (low, high) = (low.min(p), high.max(p));
            places.push(p);
        }
    }
    // The ground fills the region and ends at its borders.
    assert!((low.truncate() + half).length() < 1e-3, "{low}");
    assert!((high.truncate() - half).length() < 1e-3, "{high}");
    let of = |p: &Vec3| scene.origin_m.truncate() + p.truncate().as_dvec2();
    let heights = recorder.ground(&places.iter().map(of).collect::<Vec<_>>());
    for (p, (sample, _)) in places.iter().zip(heights.expect("ground")) {
        assert!(
            (f64::from(p.z) - sample.height_m).abs() < 0.05,
            "{p} {sample:?}"
        );
    }
}

fn heights_are_the_grounds(recorder: &Recorder) {
    let (low_m, high_m) = (DVec2::new(-3.0, 40.0), DVec2::new(4.5, 56.1));
    let area = ExportArea::Region { low_m, high_m };
    let grid = recorder.export_heights(area, 0.3).expect("a grid");
    assert_eq!(
        (grid.columns, grid.rows, grid.south_west_m),
        (26, 54, low_m)
    );
    let place = |i: usize| low_m + DVec2::new((i % 26) as f64, (i / 26) as f64) * 0.3;
    let places: Vec<_> = (0..26 * 54).map(place).collect();
    for (height, (sample, _)) in grid
        .heights_m
        .iter()
        .zip(recorder.ground(&places).expect("it"))
    {
        assert_eq!(*height, sample.height_m);
    }
    // The northernmost row is in the next chunk.
    assert!(grid.height_scale().metres_per_level > 1e-6);
    // The last post of a row would be in the next chunk, which the region does not touch.
    let area = ExportArea::Region {
        low_m: DVec2::new(48.0, 40.0),
        high_m: DVec2::new(49.999_999_99, 41.0),
    };
    let grid = recorder.export_heights(area, 0.5).expect("a grid");
    assert_eq!((grid.columns, grid.rows), (5, 3));
}

/// The area of triangles on the map, m².
fn level_area_m2(mesh: &Mesh) -> f64 {
    let of = |t: &Triangle| {
        let [a, b, c] = t.corners.map(|i| mesh.positions[i as usize].truncate());
        f64::from((b - a).perp_dot(c - a).abs()) / 2.0
    };
    mesh.triangles.iter().map(of).sum()
}

/// The hills, streams and ponds of `stream-valley`, without trails.
#[test]
fn water_is_cut_at_the_borders_of_a_region_whatever_chunk_has_it() {
    let recorder = recorder(&[
        "seed=7",
        "terrain.scale_m=240",
        "terrain.max_height_m=34",
        "terrain.persistence=0.24",
        "trails.enabled=false",
        "water.springs_per_km2=95",
        "water.stream_width_m=1.3",
        "water.ponds=0.3",
    ]);
    let size_m = 50.0;
    let runner = recorder.runner();
    let mut surfaces = Vec::new();
    for chunk in ChunkCoord::new(0, 1).square(3) {
        let ground = runner.get(recorder.forest().ground, chunk).expect("ground");
        if let Some(water) = ground.water() {
            surfaces.push((chunk, water.surface_mesh(&*ground, &|_| MaterialId(0))));
        }
    }
    // The water in a rectangle, of those chunks that are asked for.
    let water_m2 = |low_m: DVec2, high_m: DVec2, is_asked: &dyn Fn(ChunkCoord) -> bool| {
        let asked = surfaces.iter().filter(|(chunk, _)| is_asked(*chunk));
        let areas = asked.map(|(chunk, mesh)| {
            let [low, high] = [low_m, high_m].map(|m| (m - chunk.origin_m(size_m)).as_vec2());
            level_area_m2(&clipped(mesh, low, high))
        });
        areas.sum::<f64>()
    };
    let inside = |chunk: ChunkCoord| {
        let low_m = chunk.origin_m(size_m) + 1.0;
        (low_m, low_m + (size_m - 2.0))
    };
    // Chunks into which most water comes from others.
    let of_others = |chunk: ChunkCoord| {
        let (low_m, high_m) = inside(chunk);
        water_m2(low_m, high_m, &|other| other != chunk)
    };
    let entered = ChunkCoord::new(0, 1).square(1);
    let entered = entered.max_by(|a, b| of_others(*a).total_cmp(&of_others(*b)));
    let entered = entered.expect("nine chunks");
    // From outside of the corner of the largest pond's chunk to the middle of that pond.
    let ponds = ChunkCoord::new(0, 1).square(1).flat_map(|chunk| {
        let ground = runner.get(recorder.forest().ground, chunk).expect("ground");
        let ponds = ground.water().into_iter().flat_map(|water| water.ponds());
        let ponds = ponds.map(|pond| (pond.widest_m(), pond.middle_m()));
        let own = ponds.filter(|(_, middle_m)| ground.owns(*middle_m));
        own.collect::<Vec<_>>()
    });
    let (_, pond_m) = (ponds.max_by(|a, b| a.0.total_cmp(&b.0))).expect("a pond");
    let corner_m = ChunkCoord::containing(pond_m, size_m).origin_m(size_m);
    let at = DVec2::new;
    for (name, (low_m, high_m), least_m2) in [
        ("a pond", (at(25.0, 65.0), at(55.0, 95.0)), 50.0),
        ("a quarter of a pond", (corner_m - 10.0, pond_m), 2.0),
        ("water of others", inside(entered), 0.0),
    ] {
        let expected_m2 = water_m2(low_m, high_m, &|_| true);
        let area = ExportArea::Region { low_m, high_m };
        let scene = recorder.export_scene(area).expect("a region");
        let half = ((high_m - low_m) / 2.0).as_vec2();
        let mut found_m2 = 0.0;
        for instance in &scene.instances {
            let mesh = instance.prototype.mesh();
            let first = mesh.triangles.first();
            let material = first.map(|t| scene.materials.get(t.material));
            if material.is_none_or(|m| m.semantic != Semantic::Water) {
                continue;
            }
            found_m2 += level_area_m2(mesh);
            for position in &mesh.positions {
                let p = (*position + instance.position_m).truncate();
                assert!(p.abs().cmple(half + 1e-3).all(), "{name}: {p}");
            }
        }
        println!("{name}: {found_m2:.2} m² of {expected_m2:.2}");
        assert!(
            (found_m2 - expected_m2).abs() < 0.01,
            "{name}: {found_m2} {expected_m2}"
        );
        assert!(expected_m2 >= least_m2, "{name}: {expected_m2}");
    }
    assert!(of_others(entered) > 0.2, "{}", of_others(entered));
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_tree_is_as_thick_as_asked() {
    let scene = tree_scene("scots_pine", Some(0.3), true, 5).expect("a pine");
    let tree = &scene.trees[0];
    assert!((tree.dbh_m - 0.3).abs() < 0.006 && tree.alive, "{tree:?}");
    assert!(!scene.instances[0].prototype.cards().is_empty());
    let other = tree_scene("scots_pine", Some(0.3), true, 6).expect("a pine");
    assert_ne!(other.trees[0].height_m, tree.height_m);
    let dead = tree_scene("scots_pine", Some(0.3), false, 5).expect("a snag");
    assert!(!dead.trees[0].alive && dead.instances[0].prototype.cards().is_empty());
}

#[test]
fn an_exported_height_map_is_ground_again() {
    let world = |seed: u32, more: &[String]| {
        let bare = ["trails.enabled=false", "deadwood.thrown_per_ha=0"].map(str::to_owned);
        let seed = [format!("seed={seed}")];
        let layers = ConfigLayers {
            preset: Some("demo".to_owned()),
            settings: [&bare[..], &seed[..], more].concat(),
            ..ConfigLayers::default()
        };
        let sequence = layers.sequences().expect("sound").get(0).expect("one");
        Recorder::new(sequence, Backend::Cpu, grown(), 2).expect("sound")
    };
    let area = ExportArea::Region {
        low_m: DVec2::new(-21.0, 30.5),
        high_m: DVec2::new(44.0, 81.0),
    };
    let first = world(7, &[]).export_heights(area, 0.5).expect("heights");
    let folder = tempfile::tempdir().expect("a folder");
    let map = folder.path().join("ground.png");
    write_height_map(&first, &map).expect("written");
    let site = [
        format!("site.terrain.path={}", map.display()),
        format!(
            "site.terrain.sidecar={}",
            map.with_extension("toml").display()
        ),
    ];
    // The forest of another seed, whose own ground is another.
    let again = world(8, &site).export_heights(area, 0.5).expect("heights");
    let without = world(8, &[]).export_heights(area, 0.5).expect("heights");
    let worst_m = |other: &nemoral_export::HeightGrid| {
        assert_eq!((other.columns, other.rows), (131, 102));
        let pairs = first.heights_m.iter().zip(&other.heights_m);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    println!(
        "worst {:.4} m; another ground: {:.1} m",
        worst_m(&again),
        worst_m(&without)
    );
    assert!(worst_m(&again) < 0.01 && worst_m(&without) > 1.0);
}
