//! Paths of all kinds in time.

use std::convert::Infallible;

use super::*;
use crate::Obstacle;
use nemoral_scene::FlatSurface;

const PACE: SpeedProfile = SpeedProfile {
    spacing_m: 3.0,
    spacing_s: 0.0,
    speed_m_s: 1.5,
    rest_s: 0.0,
};
const BODY: Body = Body {
    wheelbase_m: 0.8,
    track_m: 0.6,
};
const SLOPE: FlatSurface = FlatSurface {
    height_m: 1.0,
    gradient: DVec2::new(0.1, 0.0),
};

fn nothing(_: DVec2, _: f64) -> Result<Vec<Obstacle>, Infallible> {
    Ok(Vec::new())
}

fn of(path: Path) -> Trajectory {
    Trajectory {
        path,
        pace: PACE,
        body: BODY,
        gait: None,
    }
}

#[test]
fn a_walker_sways_and_keeps_to_the_path() {
    let gait = Gait {
        step_m: 0.6,
        bob_m: 0.03,
        sway_m: 0.02,
        pitch_rad: 0.0,
        roll_rad: 0.0,
        hip_m: 1.0,
    };
    let straight = || Path::Straight {
        start_m: DVec2::ZERO,
        forward: DVec2::X,
    };
    let walked = Trajectory {
        gait: Some(gait),
        ..of(straight())
    };
    let flat = FlatSurface::default();
    let pose = |offset_s| walked.pose(0, offset_s, &nothing, &flat).expect("never");
    // A quarter of a step is 0.1 s.
    assert!(
        pose(0.1)
            .translation_m
            .distance(DVec3::new(0.15, 0.02 * 0.5_f64.sqrt(), 0.03))
            < 1e-12
    );
    assert!(pose(0.8).translation_m.distance(DVec3::new(1.2, 0.0, 0.0)) < 1e-12);
    // On a slope a walker is upright at the start of each stride.
    let uphill = walked.pose(0, 0.8, &nothing, &SLOPE).expect("never");
    assert!(uphill.translation_m.distance(DVec3::new(1.2, 0.0, 1.12)) < 1e-12);
    assert!(uphill.transform_vector(DVec3::Z).distance(DVec3::Z) < 1e-12);
    let wrong = Trajectory {
        gait: Some(Gait {
            step_m: 0.0,
            ..gait
        }),
        ..of(straight())
    };
    assert_eq!(wrong.check().expect_err("no step").field, "gait.step_m");
}

#[test]
fn a_straight_line_is_driven_at_its_pace() {
    let straight = of(Path::Straight {
        start_m: DVec2::new(2.0, 0.0),
        forward: DVec2::Y,
    });
    assert_eq!((straight.frames(), straight.time_s(4)), (None, 8.0));
    assert!(straight.goes_on_after(4));
    let pose = straight.pose(4, -2.0, &nothing, &SLOPE).expect("never");
    // 4 frames of 3 m, less 2 s at 1.5 m/s.
    assert!(pose.translation_m.distance(DVec3::new(2.0, 9.0, 1.2)) < 1e-12);
    let by_time = SpeedProfile {
        spacing_s: 0.25,
        ..PACE
    };
    assert_eq!((by_time.step_s(), by_time.time_s(8)), (0.25, 2.0));
    assert_eq!(PACE.step_s(), 2.0);
    assert_eq!(straight.check(), Ok(()));
    let flat = Trajectory {
        body: Body {
            track_m: 0.0,
            ..BODY
        },
        ..straight
    };
    assert_eq!(flat.check().expect_err("no track").field, "body.track_m");
}

#[test]
fn wrong_values_are_named() {
    let straight = |start_m, forward| of(Path::Straight { start_m, forward });
    let field = |wrong: Trajectory| wrong.check().expect_err("is refused").field;
    assert_eq!(field(straight(DVec2::ZERO, DVec2::ONE)), "path.forward");
    assert_eq!(field(straight(DVec2::ZERO, DVec2::NAN)), "path.forward");
    assert_eq!(field(straight(DVec2::NAN, DVec2::X)), "path.start_m");
    let key = nemoral_seed::Key::world(1);
    let wander = Wander::new(DVec2::INFINITY, DVec2::X, 1.0, 1.0, key);
    assert_eq!(field(of(Path::Wander(wander))), "wander.start_m");
    let nowhere = Stations {
        middle_m: DVec2::ZERO,
        forward: DVec2::Y,
        columns: 0,
        rows: 1,
        distance_m: 10.0,
        clearance_m: 1.0,
    };
    assert_eq!(field(of(Path::Stations(nowhere))), "stations.columns");
    // All frames would be at once; a recording has times of its own.
    let no_step = SpeedProfile {
        spacing_m: 0.0,
        ..PACE
    };
    let standing = Trajectory {
        pace: no_step,
        ..straight(DVec2::ZERO, DVec2::X)
    };
    assert_eq!(field(standing), "pace.spacing_m");
    let pose = RigidTransform::from_xyz_rpy(DVec3::ZERO, 0.0, 0.0, 0.0);
    let recording = RecordedTrajectory::new(vec![(Some(0.0), pose)], 1.0, false, "poses");
    let recorded = Trajectory {
        pace: no_step,
        ..of(Path::Recording(recording.expect("a pose")))
    };
    assert_eq!(recorded.check(), Ok(()));
}

#[test]
fn stations_are_level_and_still() {
    let stations = of(Path::Stations(Stations {
        middle_m: DVec2::ZERO,
        forward: DVec2::Y,
        columns: 2,
        rows: 1,
        distance_m: 10.0,
        clearance_m: 1.0,
    }));
    assert_eq!(stations.frames(), Some(2));
    // It is carried from the first one to the second.
    assert!(!stations.goes_on_after(0) && !stations.goes_on_after(1));
    let pose = |offset_s| stations.pose(1, offset_s, &nothing, &SLOPE);
    let pose_of = |offset_s| pose(offset_s).expect("never");
    assert_eq!(pose_of(0.0), pose_of(5.0));
    let up = pose_of(0.0).transform_vector(DVec3::Z);
    assert!(up.distance(DVec3::Z) < 1e-15);
    let ahead = pose_of(0.0).transform_vector(DVec3::X);
    assert!(ahead.distance(DVec3::Y) < 1e-12);
    assert_eq!(pose_of(0.0).translation_m, DVec3::new(5.0, 0.0, 1.5));
}

#[test]
fn a_recording_lies_on_the_ground_or_not() {
    let recorded = |on_ground| {
        let pose = RigidTransform::from_xyz_rpy(DVec3::new(1.0, 2.0, 30.0), 0.3, 0.2, 0.0);
        let recording = RecordedTrajectory::new(vec![(Some(0.0), pose)], 1.0, on_ground, "poses");
        let path = of(Path::Recording(recording.expect("a pose")));
        let path_pose = path.path_pose(0, 0.0, &nothing).expect("never");
        assert_eq!(path_pose.ground_m().is_some(), on_ground);
        (pose, path_pose.pose(&BODY, &SLOPE))
    };
    let (pose, free) = recorded(false);
    assert_eq!(free, pose);
    let (_, on_ground) = recorded(true);
    assert!(on_ground.translation_m.distance(DVec3::new(1.0, 2.0, 1.1)) < 1e-12);
}
