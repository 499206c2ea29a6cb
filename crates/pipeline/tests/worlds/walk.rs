//! A walker who carries a handheld scanner in lanes over a plot, and what navigation makes of it.

use nemoral_dataset::{Cloud, CloudParams, CloudPoint, CloudPoses, Dataset};
use nemoral_pipeline::{Backend, Error, Recorder};
use nemoral_realism::grown;
use nemoral_scene::glam::DVec3;

use crate::common::{recorded, refused, sequences};

/// A loop of two lanes, by a scanner whose place drifts.
const WALK: [&str; 18] = [
    "frames=0",
    "chunks.visible_radius_m=40",
    "chunks.delete_radius_m=100",
    "camera.enabled=false",
    "lidar.device=zeb_horizon",
    "lidar.pulses=3000",
    "lidar.mount_z_m=1.2",
    "robot.speed_m_s=0.8",
    "robot.spacing_s=0.5",
    "robot.heading_deg=0",
    "robot.lanes.length_m=12",
    "robot.lanes.width_m=8",
    "robot.lanes.spacing_m=8",
    "robot.gait.step_m=0.65",
    "navigation.enabled=true",
    "navigation.drift_m=0.05",
    "navigation.horizontal_m=0",
    "navigation.vertical_m=0",
];

fn with_walk<'a>(settings: &[&'a str]) -> Vec<&'a str> {
    [&WALK[..], settings].concat()
}

fn points(dataset: &Dataset, poses: CloudPoses) -> Result<Vec<CloudPoint>, Error> {
    let params = CloudParams {
        poses,
        ..CloudParams::default()
    };
    let mut points = Vec::new();
    Cloud::open(dataset.root(), params)?.for_each(|point| {
        points.push(*point);
        Ok::<_, nemoral_dataset::Error>(())
    })?;
    Ok(points)
}

#[test]
fn a_walk_is_a_loop_that_sways_and_drifts() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("walk");
    let (dataset, _) = recorded(&out, 3, &WALK)?;
    let report = nemoral_dataset::check(&out)?;
    assert!(report.passed(), "{report}");

    // Two lanes and two turns of 8 m, at 0.4 m a frame; the turns are half circles, but smoother.
    let estimated = dataset.estimated_world_from_body(0)?.expect("navigation");
    let frames = estimated.len() as f64;
    assert!((120.0..136.0).contains(&frames), "{frames}");
    // Drift is 0 where the walk begins, and nearly so where the loop is closed again. Places are
    // those of the scanner.
    let scanner_m = DVec3::new(0.35, 0.0, 1.2);
    let sequence = sequences(&WALK)?.get(0)?;
    let recorder = Recorder::new(sequence, Backend::Cpu, grown(), 2)?;
    let off_m = |frame: usize| -> Result<f64, Error> {
        let truth = recorder.pose(frame as u64)?.world_from_body();
        let [true_m, found_m] =
            [truth, estimated[frame]].map(|pose| pose.transform_point(scanner_m));
        Ok(true_m.distance(found_m))
    };
    let (last, half) = (estimated.len() - 1, estimated.len() / 2);
    let [start_m, middle_m, end_m] = [off_m(0)?, off_m(half)?, off_m(last)?];
    assert!(
        start_m < 1e-9 && middle_m > 0.05 && end_m < 0.1,
        "{middle_m} {end_m}"
    );

    // What is measured is registered by them, with errors of some centimetres.
    let (truth, walked) = (
        points(&dataset, CloudPoses::True)?,
        points(&dataset, CloudPoses::Estimated)?,
    );
    assert!(truth.len() > 3000, "{}", truth.len());
    let off = |(a, b): (&CloudPoint, &CloudPoint)| a.world_m.distance(b.world_m);
    let most_m = truth.iter().zip(&walked).map(off).fold(0.0, f64::max);
    assert!((0.005..0.5).contains(&most_m), "{most_m}");

    // A walker goes up and down by 2.5 cm, and a robot that rolls does not.
    let heights = |settings: &[&str]| -> Result<Vec<f64>, Error> {
        let sequence = sequences(&with_walk(settings))?.get(0)?;
        let recorder = Recorder::new(sequence, Backend::Cpu, grown(), 2)?;
        let height = |frame: u64| Ok(recorder.pose(frame)?.world_from_body().translation_m.z);
        (0..40).map(height).collect()
    };
    let (sways, rolls) = (heights(&[])?, heights(&["robot.gait.step_m=0"])?);
    let bobs: Vec<f64> = sways.iter().zip(&rolls).map(|(a, b)| a - b).collect();
    let most_m = bobs.iter().copied().fold(0.0, f64::max);
    assert!((0.023..0.028).contains(&most_m), "{most_m}");
    assert!(bobs.iter().any(|bob| *bob < -0.02));
    Ok(())
}

#[test]
fn walks_that_cannot_be_are_refused() {
    for (settings, told) in [
        (
            &["robot.lanes.amplitude_m=1.7"][..],
            "robot.lanes.amplitude_m = 1.7: must be at most 1.6",
        ),
        (&["lidar.motor.turns_hz=200"], "lidar.motor.turns_hz"),
        (
            &["navigation.enabled=false", "balance.targets.deadwood=0.2"],
            "[robot.lanes] asks for lanes",
        ),
        (&["robot.gait.step_m=0.01"], "must be 0 or at least 0.1"),
        (
            &["robot.speed_m_s=5"],
            "robot.gait.step_m = 0.65: must be so long that there are at most 5 steps a second",
        ),
        (
            &["robot.spacing_s=0.000001"],
            "robot.lanes: it has more than 10000000 frames",
        ),
    ] {
        let text = refused(&with_walk(settings));
        assert!(text.contains(told), "{text}");
    }
    let text = refused(&["robot.stations.columns=1", "robot.gait.step_m=0.6"]);
    assert!(text.contains("must be 0 with [robot.stations]"), "{text}");
    // Frames that are chosen are no way that could drift.
    let text = refused(&["navigation.enabled=true", "balance.targets.deadwood=0.2"]);
    assert!(text.contains("navigation.enabled = true"), "{text}");
}
