//! Sensors at any pose record what they record at a frame there.

use std::cell::Cell;

use nemoral_pipeline::config::{ConfigLayers, Sequences};
use nemoral_pipeline::recording::scene::visible_chunks;
use nemoral_pipeline::{Backend, BodyState, Error, ExportArea, RecordedFrame, Recorder};
use nemoral_realism::grown;
use nemoral_scene::glam::{DQuat, DVec2, DVec3};
use nemoral_scene::{LidarPoint, MaterialLibrary, RigidTransform, Semantic, Twist};

/// A recorder of a robot that holds still at stations, or drives.
fn recorder(settings: &[&str]) -> Result<Recorder, Error> {
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        file: None,
        settings: settings.iter().map(|&s| s.to_owned()).collect(),
    };
    let sequences: Sequences = layers.sequences()?;
    Recorder::new(sequences.get(0)?, Backend::Cpu, grown(), 2)
}

fn stations() -> Result<Recorder, Error> {
    recorder(&[
        "frames=9",
        "robot.stations.distance_m=12",
        "camera.noise.enabled=true",
    ])
}

fn still(world_from_body: RigidTransform, time_s: f64, index: u64) -> BodyState {
    BodyState {
        world_from_body,
        motion: Twist::STILL,
        time_s,
        index: Some(index),
    }
}

#[test]
fn at_the_pose_of_a_station_it_is_that_stations_frame() -> Result<(), Error> {
    let recorder = stations()?;
    let pose = recorder.pose(5)?;
    let (here, time_s) = (pose.world_from_body(), pose.time_s);
    let frame = recorder.frame(5)?;
    // A number beyond the sequence is noise of its own, which no frame has.
    let beyond = recorder.observe(&still(here, time_s, 1 << 40))?;
    assert_ne!(beyond.images[0].rgb, frame.images[0].rgb);
    assert_eq!(beyond.images[0].truth, frame.images[0].truth);
    assert!(!beyond.scans[0].is_empty());
    // At another time the LiDAR scans another part of its pattern.
    let later = recorder.observe(&still(here, time_s + 0.05, 5))?;
    assert_eq!(later.images, frame.images);
    assert_ne!(later.scans, frame.scans);
    let same = recorder.observe(&still(here, time_s, 5))?;
    assert_eq!(same.images, frame.images);
    assert_eq!(same.scans, frame.scans);
    Ok(())
}

#[test]
fn at_the_pose_time_and_number_of_a_drives_frame_it_is_that_frame() -> Result<(), Error> {
    let recorder = recorder(&["frames=5", "camera.enabled=false"])?;
    let pose = recorder.pose(3)?;
    let seen = recorder.observe(&still(pose.world_from_body(), pose.time_s, 3))?;
    assert_eq!(seen.scans, recorder.frame(3)?.scans);
    let held = recorder.observe(&still(pose.world_from_body(), pose.time_s, 4))?;
    assert_ne!(held.scans, seen.scans);
    Ok(())
}

/// Cameras see by lamps; what is there, and what LiDARs see, does not depend on them.
#[test]
fn lamps_change_pictures_alone() -> Result<(), Error> {
    let night = "sun.angles.elevation_deg=-40";
    let seen = |settings: &[&str]| recorder(&[&["frames=1", night], settings].concat())?.frame(0);
    let dark = seen(&[])?;
    let lit = seen(&["lamp.enabled=true", "lamps.right.mount_y_m=-0.25"])?;
    assert_eq!(lit.images[0].truth, dark.images[0].truth);
    assert_eq!(lit.scans, dark.scans);
    let mean = |frame: &RecordedFrame| {
        let pixels = frame.images[0].rgb.pixels();
        pixels.iter().map(|[_, g, _]| f64::from(*g)).sum::<f64>() / pixels.len() as f64
    };
    assert!(
        mean(&dark) < 3.0 && mean(&lit) > 20.0,
        "{} {}",
        mean(&dark),
        mean(&lit)
    );
    Ok(())
}

/// Light is most of what a chunk costs, and lasers need none.
/// What falls is in pictures and scans, and not in the truth.
#[test]
fn weather_leaves_the_truth_as_it_is() -> Result<(), Error> {
    let seen = |settings: &[&str]| recorder(&[&["frames=1"], settings].concat())?.frame(0);
    let dry = seen(&[])?;
    for falling in ["weather.rain_mm_per_h=30", "weather.snowfall_mm_per_h=3"] {
        let wet = seen(&[falling])?;
        assert_eq!(wet.images[0].truth, dry.images[0].truth);
        assert_ne!(wet.images[0].rgb, dry.images[0].rgb);
        let (airborne, points): (Vec<&LidarPoint>, Vec<&LidarPoint>) =
            (wet.scans[0].iter()).partition(|p| p.semantic == Semantic::AirborneEcho);
        assert!(!airborne.is_empty(), "{falling}");
        let expected = dry.scans[0].iter().map(|p| (p.pulse, p.semantic, p.object));
        let expected: Vec<_> = expected.collect();
        let found = points.iter().map(|p| (p.pulse, p.semantic, p.object));
        assert!(found.clone().count() > expected.len() / 2);
        assert!(found.clone().all(|p| expected.contains(&p)));
        let blind = seen(&[falling, "lidar.air.enabled=false"])?;
        assert_eq!(blind.images, wet.images);
        assert!(
            blind.scans[0]
                .iter()
                .all(|p| p.semantic != Semantic::AirborneEcho)
        );
    }
    Ok(())
}

#[test]
fn without_cameras_scans_are_the_same_and_less_light_is_computed() -> Result<(), Error> {
    let (lit, unlit) = (
        recorder(&["frames=3"])?,
        recorder(&["frames=3", "camera.enabled=false"])?,
    );
    let pose = lit.pose(2)?;
    let beyond = still(pose.world_from_body(), pose.time_s, 1 << 40);
    assert_eq!(unlit.observe(&beyond)?.scans, lit.observe(&beyond)?.scans);
    assert_eq!(unlit.frame(1)?.scans, lit.frame(1)?.scans);
    let skies = |recorder: &Recorder| {
        let count = Cell::new(0);
        recorder.runner().store().retain(|stage, _| {
            count.set(count.get() + u32::from(stage == "chunk.sky_view_factor"));
            true
        });
        count.get()
    };
    // Undergrowth grows by the light near the ground, and nothing needs that of the crowns.
    assert!(skies(&lit) > 0);
    assert_eq!(skies(&unlit), 0);
    Ok(())
}

/// A program may be given fewer cores while it runs.
#[test]
fn the_number_of_threads_may_change_and_changes_nothing() -> Result<(), Error> {
    let settings = ["frames=3", "camera.enabled=false", "lidar.pulses=500"];
    let (same, other) = (recorder(&settings)?, recorder(&settings)?);
    assert_eq!(other.runner().threads(), 2);
    for (frame, threads) in [(0, 1), (1, 5), (2, 0)] {
        other.set_threads(threads);
        assert_eq!(other.runner().threads(), threads.max(1));
        assert_eq!(other.frame(frame)?.scans, same.frame(frame)?.scans);
    }
    Ok(())
}

/// Lasers do not see textures, but who opens an export does.
#[test]
fn without_cameras_there_are_textures_in_exports_alone() -> Result<(), Error> {
    let few = [
        "frames=2",
        "camera.enabled=false",
        "assets.individuals=1",
        "placement.trees=12",
        "chunks.visible_radius_m=10",
        "chunks.undergrowth_radius_m=0",
    ];
    let recorder = recorder(&few)?;
    let textured = |materials: &MaterialLibrary| {
        let textures = materials.materials().iter().filter(|m| m.mask.is_none());
        textures.filter(|m| m.albedo.width() > 1).count()
    };
    let runner = recorder.runner();
    let assets = runner.get(recorder.forest().assets, ())?;
    assert_eq!(textured(&assets.library.materials), 0);
    let exported = recorder.export_scene(ExportArea::Frame(1))?;
    assert!(textured(&exported.materials) > 20);
    assert!(!exported.instances.is_empty());
    Ok(())
}

/// A body that drives on finds everything grown that comes into sight, and what is grown for it is
/// neither much nor another world.
#[test]
fn what_lies_ahead_grows_before_it_is_seen_and_changes_nothing() -> Result<(), Error> {
    let settings = [
        "camera.enabled=false",
        "lidar.pulses=500",
        "chunks.size_m=20",
        "placement.trees=12",
        "placement.shrubs=6",
        "placement.rocks_max=4",
        "chunks.visible_radius_m=50",
        "chunks.undergrowth_radius_m=25",
        "chunks.delete_radius_m=90",
        "assets.individuals=1",
    ];
    let recorder = recorder(&settings)?;
    let place = |k: u32| DVec2::new(0.7, 0.4) * f64::from(k);
    let pose = |k| recorder.pose_on_ground(place(k), DVec2::X);
    let forest = recorder.forest();
    let (objects, undergrowth) = (forest.object_geometry, forest.undergrowth_geometry);
    for k in 0..90 {
        if k > 1 {
            let runner = recorder.runner();
            let (plan, store) = (runner.plan(), runner.store());
            for chunk in visible_chunks(place(k), 50.0, 20.0) {
                assert!(store.contains(plan.key(objects, chunk)), "{k}: {chunk}");
            }
            for chunk in visible_chunks(place(k), 25.0, 20.0) {
                assert!(store.contains(plan.key(undergrowth, chunk)), "{k}: {chunk}");
            }
        }
        let pose = pose(k)?;
        recorder.observe(&still(pose, 0.0, 1000 + u64::from(k)))?;
        // Nothing is grown that the next step would drop.
        let body_m = pose.translation_m.truncate();
        let runner = recorder.runner();
        for chunk in visible_chunks(body_m, 200.0, 20.0) {
            let is_near = chunk.distance_m(body_m, 20.0) <= 90.0;
            let key = runner.plan().key(objects, chunk);
            assert!(is_near || !runner.store().contains(key), "{k}: {chunk}");
        }
    }
    let last = still(pose(89)?, 0.0, 2000);
    let found = recorder.observe(&last)?;
    let there = self::recorder(&settings)?;
    assert_eq!(found.scans, there.observe(&last)?.scans);
    assert!(!found.scans[0].is_empty());
    Ok(())
}

/// Nothing is grown ahead that would not be kept.
#[test]
fn nothing_is_grown_ahead_where_nothing_is_kept() -> Result<(), Error> {
    let recorder = recorder(&[
        "camera.enabled=false",
        "lidar.pulses=100",
        "chunks.size_m=20",
        "placement.trees=12",
        "placement.shrubs=6",
        "placement.rocks_max=4",
        "chunks.visible_radius_m=40",
        "chunks.delete_radius_m=40",
        "assets.individuals=1",
    ])?;
    let mut grown = 0;
    for k in 0..4_u32 {
        let pose =
            recorder.pose_on_ground(DVec2::new(10.0 + 0.01 * f64::from(k), 10.0), DVec2::X)?;
        recorder.observe(&still(pose, 0.0, 1000 + u64::from(k)))?;
        let now = recorder.runner().store().computed();
        assert!(k == 0 || now == grown, "{k}: {now} {grown}");
        grown = now;
    }
    Ok(())
}

#[test]
fn impossible_poses_are_refused() -> Result<(), Error> {
    let recorder = stations()?;
    let refused = |pose: RigidTransform, time_s| {
        let error = recorder
            .observe(&still(pose, time_s, 0))
            .expect_err("a wrong request");
        assert!(error.is_request(), "{error}");
        error.to_string()
    };
    let here = RigidTransform::from_xyz_rpy(DVec3::ZERO, 0.0, 0.0, 0.0);
    let mut twisted = here;
    twisted.rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0);
    assert!(refused(twisted, 0.0).contains("must be a unit quaternion"));
    for x in [f64::NAN, f64::INFINITY, 2e8] {
        let mut away = here;
        away.translation_m.x = x;
        assert!(refused(away, 0.0).contains("must be within 1e8 m"));
    }
    for time_s in [f64::NAN, -1.0, f64::INFINITY] {
        assert!(refused(here, time_s).contains("time_s = "));
    }
    Ok(())
}
