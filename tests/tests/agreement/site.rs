//! A user's own site, that of `examples/site`: the inventory is the stem map, the ground is the
//! height map, and sensors agree there as everywhere.

use std::path::Path;
use std::sync::LazyLock;

use nemoral_import::{HeightMap, Stem, read_stem_map, read_trail_lines};
use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::config::{ConfigLayers, SiteFiles};
use nemoral_realism::ScannedDiameters;
use nemoral_realism::ranges::{DBH_BIAS_M, DBH_RMSE_M};
use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{ChunkCoord, ObjectId, Ray, Surface, TreeRecord};
use nemoral_tests::{World, record, store};

use crate::sensors::{assert_agreement, frames_of};

/// As for `sensors`: the robot stands still while it scans, and its camera is at the LiDAR.
const SETTINGS: [&str; 14] = [
    "chunks.visible_radius_m=40",
    "chunks.undergrowth_radius_m=20",
    "site.stems.shapes=2",
    "camera.width_px=160",
    "camera.height_px=90",
    "camera.fov.horizontal_deg=100",
    "camera.mount_z_m=1.35",
    "lidar.pulses=20000",
    "lidar.noise.model=off",
    "robot.spacing_m=7",
    "robot.speed_m_s=1e-6",
    "frames=11",
    "assets.individuals=2",
    "undergrowth.grass=2",
];

fn file(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../examples/site")
        .join(name)
}

fn bytes(name: &str) -> Vec<u8> {
    nemoral_files::read(&file(name), 1 << 20).expect("the example is there")
}

/// The world that `nemoral plot` makes of the example, with these settings.
fn world(settings: &[&str]) -> World {
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        file: None,
        settings: settings.iter().map(|s| (*s).to_owned()).collect(),
    };
    let files = SiteFiles {
        stems: file("stems.csv"),
        terrain: Some(file("terrain.tif")),
        trails: None,
    };
    let sequences = layers.plot(&files).unwrap_or_else(|e| panic!("{e}"));
    let config = sequences.get(0).unwrap_or_else(|e| panic!("{e}")).config;
    World {
        forest: ForestPlan::new(&config).unwrap_or_else(|e| panic!("{e}")),
        config,
        store: store(),
    }
}

static SITE: LazyLock<World> = LazyLock::new(|| world(&SETTINGS));

fn stems() -> Vec<Stem> {
    read_stem_map(&bytes("stems.csv")).expect("a stem map")
}

/// A place of a file in the world.
fn in_world(x_m: f64, y_m: f64) -> DVec2 {
    let site = &SITE.config.site;
    DVec2::new(x_m - site.origin_x_m, y_m - site.origin_y_m)
}

/// The trees of the chunks that a view from the plot's middle may show.
fn inventory() -> Vec<TreeRecord> {
    let runner = SITE.runner(2);
    let assets = runner.get(SITE.forest.assets, ()).expect("plants");
    let around = (-2..=2).flat_map(|x| (-2..=2).map(move |y| ChunkCoord::new(x, y)));
    let of_chunk = |chunk| runner.get(SITE.forest.objects, chunk).expect("objects");
    around
        .flat_map(|chunk| {
            let objects = of_chunk(chunk);
            objects
                .0
                .iter()
                .filter_map(|o| assets.tree_record(o))
                .collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn the_inventory_is_the_stem_map() {
    let (stems, trees) = (stems(), inventory());
    assert_eq!(stems.len(), 200);
    let mut drawn = 0;
    for stem in &stems {
        let at = in_world(stem.x_m, stem.y_m);
        let here = |t: &&TreeRecord| t.position_m.truncate().distance(at) < 1e-6;
        let found: Vec<&TreeRecord> = trees.iter().filter(here).collect();
        let [tree] = found[..] else {
            panic!("{} trees at line {}", found.len(), stem.line);
        };
        assert_eq!(
            Some(&tree.species),
            stem.species.as_ref(),
            "line {}",
            stem.line
        );
        assert_eq!(tree.alive, stem.is_alive, "line {}", stem.line);
        let id = stem.id.as_deref().expect("the example numbers its trees");
        assert_eq!(tree.field_id, id, "line {}", stem.line);
        assert_eq!(Some(tree.dbh_m), stem.dbh_m, "line {}", stem.line);
        match stem.height_m {
            Some(height_m) => assert_eq!(tree.height_m, height_m, "line {}", stem.line),
            None => {
                // By the relations of its species.
                let slender = tree.height_m / tree.dbh_m;
                assert!(
                    (20.0..180.0).contains(&slender),
                    "line {}: {slender}",
                    stem.line
                );
                drawn += 1;
            }
        }
    }
    assert!(drawn > 50, "{drawn}");
    // Among them there is no other tree, and around them there are many.
    let named = trees.iter().filter(|t| !t.field_id.is_empty()).count();
    assert_eq!(named, stems.len());
    let others = trees.len() - stems.len();
    assert!(others > 500, "{others}");
    let feet: Vec<DVec2> = stems.iter().map(|s| in_world(s.x_m, s.y_m)).collect();
    let low = feet.iter().copied().reduce(DVec2::min).expect("some");
    let high = feet.iter().copied().reduce(DVec2::max).expect("some");
    let inside = |p: DVec2| p.cmpgt(low + 4.0).all() && p.cmplt(high - 4.0).all();
    let is_known = |p: DVec2| feet.iter().any(|f| f.distance(p) < 1e-6);
    for tree in &trees {
        let at = tree.position_m.truncate();
        assert!(
            is_known(at) || !inside(at) || tree.age_class == "sapling",
            "{tree:?}"
        );
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn the_ground_passes_through_every_post() {
    let map = HeightMap::from_tiff(&bytes("terrain.tif")).expect("a height map");
    let runner = SITE.runner(2);
    let size_m = SITE.config.chunks.size_m;
    // A scene of the plot without what covers its ground.
    let bare = world(
        &[
            &SETTINGS[..],
            &[
                "undergrowth.cover=0",
                "undergrowth.litter=0",
                "placement.regeneration.seedlings=0",
                "climbers.ivy=0",
                "climbers.moss=0",
                "chunks.visible_radius_m=60",
            ],
        ]
        .concat(),
    );
    let scene = bare.runner(2).get(bare.forest.scene, 4).expect("a scene");
    let (mut posts, mut hits, mut worst_m) = (0, 0, 0.0_f64);
    for (column, row) in (0..map.rows).flat_map(|r| (0..map.columns).map(move |c| (c, r))) {
        let Some(height_m) = map.height_m(column, row) else {
            continue;
        };
        let [x, y] = map.post_m(column, row);
        let at = in_world(x, y);
        let expected_m = f64::from(height_m) - SITE.config.site.terrain.origin_z_m;
        let chunk = ChunkCoord::containing(at, size_m);
        let ground = runner.get(SITE.forest.ground, chunk).expect("a ground");
        let off_m = (ground.height_m(at) - expected_m).abs();
        assert!(off_m < 1e-4, "post {column}, {row}: {off_m} m off");
        posts += 1;
        // The mesh that sensors see, from just above it.
        let above = at.extend(expected_m + 0.3) - scene.origin_m;
        let ray = Ray::new(above.as_vec3(), Vec3::NEG_Z);
        if let Some(hit) = scene.caster.closest_hit(&ray) {
            // The foot of a tree, or a rock.
            if hit.surface.object != ObjectId::NONE {
                continue;
            }
            let seen_m = above.z - f64::from(hit.surface.distance_m) + scene.origin_m.z;
            worst_m = worst_m.max((seen_m - expected_m).abs());
            hits += 1;
        }
    }
    println!("{posts} posts, {hits} seen on the mesh, worst {worst_m:.4} m");
    assert!(posts > 4900 && hits > 4500, "{posts} {hits}");
    assert!(worst_m < 0.01, "{worst_m}");
}

#[test]
fn trails_run_along_their_lines() {
    let settings = [
        format!("site.trails.path={}", file("trails.geojson").display()),
        "trails.enabled=false".to_owned(),
    ];
    let settings = [&SETTINGS[..], &settings.each_ref().map(String::as_str)].concat();
    let world = world(&settings);
    let (runner, size_m) = (world.runner(2), world.config.chunks.size_m);
    let trails = read_trail_lines(&bytes("trails.geojson")).expect("trail lines");
    let ground = |at: DVec2| {
        let chunk = ChunkCoord::containing(at, size_m);
        runner.get(world.forest.ground, chunk).expect("a ground")
    };
    let half_m = 0.5 * world.config.trails.width_m;
    let vertices = &trails.lines[0].vertices_m;
    for &[x, y] in &vertices[1..vertices.len() - 1] {
        let at = in_world(x, y);
        let edge_m = ground(at).trail_edge_m(at);
        assert!((edge_m + half_m).abs() < 0.3, "{x} {y}: {edge_m}");
    }
    // The ground beside them is that of the map, and trees of the map stay off.
    let model = runner.get(world.forest.ground_model, ()).expect("a ground");
    let (path, _) = model
        .trails()
        .expect("trails")
        .nearest(DVec2::ZERO, 200.0)
        .expect("near");
    assert!(path.length_m() > 120.0, "{}", path.length_m());
    for stem in stems() {
        let at = in_world(stem.x_m, stem.y_m);
        assert!(ground(at).trail_edge_m(at) > 0.3, "line {}", stem.line);
    }
}

#[test]
fn sensors_agree_on_a_site() {
    let frames = frames_of(&SITE);
    println!("{}", assert_agreement(&frames, 100_000, &[1, 3, 4, 6]));
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_frame_alone_is_that_of_a_drive() {
    let runner = SITE.runner(2);
    let of_drive: Vec<Vec<u8>> = (0..10)
        .map(|frame| record(&SITE.forest, &runner, frame).expect("a frame"))
        .collect();
    let alone = world(&SETTINGS);
    let frame = record(&alone.forest, &alone.runner(1), 7).expect("a frame");
    assert!(frame == of_drive[7], "frame 7 differs");
    assert!(frame != of_drive[6]);
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn stems_are_as_thick_as_they_were_measured() {
    let settings = [
        "site.stems.shapes=4",
        "assets.individuals=2",
        "undergrowth.cover=0",
        "chunks.undergrowth_radius_m=0",
        "frames=4",
        "robot.start_x_m=0",
        "robot.start_y_m=0",
        "robot.stations.columns=2",
        "robot.stations.rows=2",
        "robot.stations.distance_m=20",
    ];
    let world = world(&[&nemoral_realism::STATIONS[..], &settings].concat());
    let found = ScannedDiameters::of(&world.forest, &world.config, &world.runner(2));
    println!(
        "{} stems: bias {:+.1} mm, RMSE {:.1} mm",
        found.stems.len(),
        1000.0 * found.bias_m(),
        1000.0 * found.rmse_m()
    );
    let within = |(low, high): (f64, f64), value: f64| (low..=high).contains(&value);
    assert!(found.stems.len() >= 20, "{} stems", found.stems.len());
    assert!(within(DBH_RMSE_M, found.rmse_m()), "{found:?}");
    assert!(within(DBH_BIAS_M, found.bias_m()), "{found:?}");
}

#[test]
fn a_map_of_another_place_is_refused() {
    let layers = |x: f64| ConfigLayers {
        preset: Some("demo".to_owned()),
        file: None,
        settings: vec![
            format!("site.stems.path={}", file("stems.csv").display()),
            format!("site.terrain.path={}", file("terrain.tif").display()),
            format!("site.origin_x_m={x}"),
            "trails.enabled=false".to_owned(),
        ],
    };
    // Any origin is allowed, as long as both files have the same coordinates.
    layers(553_000.0).load().expect("fine");
    let dir = tempfile::tempdir().expect("a folder");
    let elsewhere = dir.path().join("stems.csv");
    nemoral_files::write(&elsewhere, b"x,y,species\n10,20,beech\n").expect("written");
    let mut other = layers(0.0);
    other.settings[0] = format!("site.stems.path={}", elsewhere.display());
    let message = other.load().expect_err("no tree is on the map").to_string();
    for part in [
        "site.terrain.path",
        "no tree of the stem map",
        "(10, 20)",
        "553",
    ] {
        assert!(message.contains(part), "{message}");
    }
    nemoral_files::write(&elsewhere, b"x,y,species\n10,20,beach\n").expect("written");
    let message = other.load().expect_err("no such species").to_string();
    for part in [
        "site.stems.path",
        "line 2",
        "beach",
        "silver_birch",
        "other_species",
    ] {
        assert!(message.contains(part), "{message}");
    }
}
