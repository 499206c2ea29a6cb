//! Sensors at any pose record what they record at a frame there.

use nemoral_pipeline::config::{Config, PathStations, Preset, RobotPath};
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_pipeline::{Error, ForestPlan};
use nemoral_scene::RigidTransform;
use nemoral_scene::glam::{DQuat, DVec3};

fn stations() -> Config {
    let mut config = Preset::by_name("demo").expect("there is a demo").config();
    config.robot.path = RobotPath::Stations(PathStations::default());
    config.camera.noise.enabled = true;
    config
}

#[test]
fn at_the_pose_of_a_station_it_is_that_stations_frame() -> Result<(), Error> {
    let config = stations();
    let forest = ForestPlan::new(&config)?;
    let store = Store::unlimited();
    let runner = Runner::new(forest.plan(), &store, 2);
    let pose = runner.get(forest.pose, 5)?;
    let seen = forest.observe(&runner, pose.world_from_body(), pose.time_s, 5)?;
    assert_eq!(seen.images, *runner.get(forest.images, 5)?);
    assert_eq!(seen.scans, *runner.get(forest.scans, 5)?);
    assert!(!seen.scans[0].is_empty());
    // Another number is another noise, at another time the LiDAR scans another part of its pattern.
    let noisy = forest.observe(&runner, pose.world_from_body(), pose.time_s, 6)?;
    assert_ne!(noisy.images[0].rgb, seen.images[0].rgb);
    assert_eq!(noisy.images[0].truth, seen.images[0].truth);
    let later = forest.observe(&runner, pose.world_from_body(), pose.time_s + 0.05, 5)?;
    assert_ne!(later.scans, seen.scans);
    assert_eq!(later.images, seen.images);
    Ok(())
}

#[test]
fn impossible_poses_are_refused() -> Result<(), Error> {
    let forest = ForestPlan::new(&stations())?;
    let store = Store::unlimited();
    let runner = Runner::new(forest.plan(), &store, 1);
    let refused = |pose: RigidTransform, time_s| {
        let error = forest
            .observe(&runner, pose, time_s, 0)
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
    assert!(store.is_empty(), "a wrong request grows nothing");
    Ok(())
}
