//! What no sensor sees does not grow for a frame, and this changes no byte of it.

use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_pipeline::recording::recording_context::RecordingContext;
use nemoral_tests::{config, grown};

/// Compares the pictures and scans of frame 0, of what its sensors see, with those of everything
/// around. Returns the numbers of chunks that its cameras see, that its LiDARs see, and of all.
fn compare(store: &Store, settings: &[&str]) -> [usize; 3] {
    let small = [
        "chunks.visible_radius_m=140",
        "chunks.delete_radius_m=250",
        "placement.trees=8",
        "camera.width_px=240",
        "camera.height_px=120",
        "lidar.pulses=4000",
    ];
    let config = config("demo", &[&small, settings].concat());
    let forest = ForestPlan::new(&config).expect("a plan");
    let runner = Runner::new(forest.plan(), store, 2);
    let pose = runner.get(forest.pose, 0).expect("a pose");
    let materials = runner.get(forest.materials, ()).expect("materials");
    let cameras = runner.get(forest.cameras, ()).expect("cameras");
    let lidars = runner.get(forest.lidars, ()).expect("LiDARs");

    let nodes = [forest.camera_scene, forest.lidar_scene, forest.scene];
    let scenes = nodes.map(|node| runner.get(node, 0).expect("a scene"));
    let [cameras_see, lidars_see, all] = scenes
        .each_ref()
        .map(|scene| RecordingContext::new(forest.world(), 0, &pose, scene, &materials));
    for (i, rig) in cameras.iter().enumerate() {
        let [a, b] = [cameras_see, all].map(|m| m.picture(i, rig).expect("a picture"));
        assert!(a.truth == b.truth, "its truth differs: {settings:?}");
        assert!(a.rgb == b.rgb, "its colours differ: {settings:?}");
    }
    for rig in lidars.iter() {
        let [a, b] = [lidars_see, all].map(|m| m.scan(rig));
        assert!(a.len() > 100, "{} points", a.len());
        assert!(a == b, "its points differ: {settings:?}");
    }
    scenes.map(|scene| scene.chunks.len())
}

#[test]
fn frames_are_those_of_all_that_is_around() {
    // Worlds that are equal but for light and sensors grow once.
    let store = Store::unlimited().with_cache(grown());
    for azimuth_deg in [30, 120, 210, 300] {
        let azimuth = format!("sun.angles.azimuth_deg={azimuth_deg}");
        let seen = compare(&store, &["sun.angles.elevation_deg=25", &azimuth]);
        assert!(seen[0] < seen[2] && 4 * seen[1] < 3 * seen[2], "{seen:?}");
    }
    // Shadows without an end, through a wide lens, while rows roll.
    let wide = [
        "sun.angles.elevation_deg=4",
        "camera.fov.horizontal_deg=110",
        "camera.shutter.exposure_ms=5",
        "camera.shutter.readout_ms=30",
        "lidar.device=mid70",
    ];
    let seen = compare(&store, &wide);
    assert!(seen[1] < seen[0] && seen[0] < seen[2], "{seen:?}");
    // By moonlight, and by a lamp far to the side of the camera.
    let night = [
        "sun.angles.elevation_deg=-30",
        "moon.illuminated=1",
        "moon.elevation_deg=60",
        "camera.exposure_least_ev=-10",
        "lamp.enabled=true",
        "lamp.mount_y_m=5",
        "lamp.lumen=100000",
    ];
    let seen = compare(&store, &night);
    assert!(seen[0] < seen[2], "{seen:?}");
    // What sees all around, or up, needs everything.
    let near = "chunks.visible_radius_m=60";
    let [_, seen, all] = compare(&store, &[near, "lidar.device=vlp16"]);
    assert_eq!(seen, all);
    for setting in ["camera.mount_pitch_deg=-80", "camera.bounces=1"] {
        let [seen, _, all] = compare(&store, &[near, setting]);
        assert_eq!(seen, all, "{setting}");
    }
    // Flow looks at what the next frame's cameras see, and at nothing else.
    let flow = compare(&store, &[near, "camera.flow=true"]);
    assert_eq!(flow, compare(&store, &[near]));
}

#[test]
fn who_looks_down_sees_as_far_as_the_ground() {
    let store = Store::unlimited().with_cache(grown());
    let flight = [
        "robot.flight.height_m=25",
        "robot.flight.sway_deg=2",
        "camera.mount_pitch_deg=90",
        "camera.fov.horizontal_deg=60",
        "lidar.device=vux1uav",
    ];
    // Under a low sun, trees from afar cast shadows there.
    for (elevation_deg, cameras_share) in [(25, 1.0), (80, 0.9)] {
        let sun = format!("sun.angles.elevation_deg={elevation_deg}");
        let seen = compare(&store, &[&flight[..], &[&sun]].concat());
        let [by_cameras, by_lidars, all] = seen.map(|chunks| chunks as f64);
        assert!(by_cameras <= cameras_share * all, "{seen:?}");
        assert!(by_lidars < 0.7 * all, "{seen:?}");
    }
    // Water mirrors what is further away, and errors lead beyond the field of view.
    let wide = [
        "water.ponds=1",
        "water.puddles=1",
        "lidar.mirror.half_angle_deg=60",
        "lidar.errors.angular_deg=3",
        "lidar.returns=all",
    ];
    compare(&store, &[&flight[..], &wide].concat());
}

/// A tree of a user whose mast, 30 cm thick, carries a beam that goes 58 m to one side.
fn crane_obj() -> String {
    let mut obj = "usemtl wood\n".to_owned();
    for [low, high] in [
        [[-0.15, -0.15, -0.5], [0.15, 0.15, 12.0]],
        [[0.0, -1.0, 9.0], [58.0, 1.0, 10.0]],
    ] {
        for corner in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|k| [low[k], high[k]][corner >> k & 1]);
            obj += &format!("v {x} {y} {z}\n");
        }
        obj += "f -8 -7 -5 -6\nf -4 -3 -1 -2\nf -8 -7 -3 -4\nf -6 -5 -1 -2\nf -8 -6 -2 -4\n\
                f -7 -5 -1 -3\n";
    }
    obj
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn what_reaches_far_out_of_its_chunk_is_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("crane.obj");
    nemoral_files::write(&path, crane_obj().as_bytes()).expect("written");
    let sidecar = b"up = \"z\"\nmetres_per_unit = 1.0\ndbh_m = 0.3\nradius_m = 0.3\n";
    nemoral_files::write(&path.with_extension("obj.toml"), sidecar).expect("written");
    let file = format!("models.crane.file={}", path.display());
    // Beams of 75 m, above a camera that looks up and a narrow scanner.
    let cranes = [
        &file,
        "models.crane.share=1",
        "placement.trees=15",
        "models.crane.scale_min=1.3",
        "models.crane.scale_max=1.3",
        "chunks.visible_radius_m=220",
        "chunks.delete_radius_m=300",
        "sun.angles.elevation_deg=40",
        "camera.fov.horizontal_deg=35",
        "camera.mount_pitch_deg=25",
        "lidar.device=mid40",
    ];
    let seen = compare(&Store::unlimited().with_cache(grown()), &cranes);
    assert!(seen[1] < seen[2], "{seen:?}");
}
