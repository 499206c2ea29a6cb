//! What no sensor sees does not grow for a frame, and this changes no byte of it.

use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_pipeline::recording::moment::Moment;
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
    let assets = runner.get(forest.assets, ()).expect("assets");
    let cameras = runner.get(forest.cameras, ()).expect("cameras");
    let lidars = runner.get(forest.lidars, ()).expect("LiDARs");

    let nodes = [forest.camera_scene, forest.lidar_scene, forest.scene];
    let scenes = nodes.map(|node| runner.get(node, 0).expect("a scene"));
    let [cameras_see, lidars_see, all] = scenes
        .each_ref()
        .map(|scene| Moment::new(forest.world(), 0, &pose, scene, &assets.library.materials));
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
    // What sees all around, or straight down, needs everything.
    let near = "chunks.visible_radius_m=60";
    let [_, seen, all] = compare(&store, &[near, "lidar.device=vlp16"]);
    assert_eq!(seen, all);
    for setting in ["camera.mount_pitch_deg=-80", "camera.flow=true"] {
        let [seen, _, all] = compare(&store, &[near, setting]);
        assert_eq!(seen, all, "{setting}");
    }
}
