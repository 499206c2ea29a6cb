//! What readers of bags compute motion from: stamps and times of points, velocities, and the tree
//! of frames.

use nemoral_convert::{Error, FormatName, OutputMode};
use nemoral_dataset::{DatasetHeader, ImuSpec};
use nemoral_scene::glam::{DQuat, DVec3};
use nemoral_scene::{RigidTransform, rotation_vector};

use crate::common::{
    Drive, Made, UNIT_VELOCITY_M_S, header, made, made_of, made_of_drives, made_of_frames, pose,
    pose_at, run, write,
};
use crate::mcap::{Cloud, Reader, messages};

/// What is added to the times of a sequence.
const START_NS: u64 = 1_000_000_000;

fn file(made: &Made) -> Vec<u8> {
    std::fs::read(made.out.join("00/00_0.mcap")).expect("a file")
}

fn raw() -> DatasetHeader {
    let mut header = header();
    header.sequences[0].lidars[0].deskewed = false;
    header
}

#[test]
fn raw_scans_are_stamped_with_their_start_and_times_count_from_there() {
    let made = made_of(FormatName::Mcap, &raw());
    assert!(!made.done.notes.iter().any(|note| note.contains("deskew")));
    let bytes = file(&made);
    let messages = messages(&bytes);
    assert!(messages.is_sorted_by_key(|m| m.1));
    let scans = messages.iter().filter(|m| m.0 == "/top/points");
    let mut count = 0;
    for (i, (_, logged_ns, data)) in scans.enumerate() {
        let scan = &made.dataset.read_frame(i).expect("a frame").lidars[0].ply;
        // Where the first pulse of all scans was fired.
        let lead_ns = 50_000;
        let time_ns = START_NS + (pose([1, 2, 4][i]).0 * 1e9).round() as u64;
        assert_eq!(*logged_ns, time_ns);
        let mut r = Reader::new(data);
        r.at = 4;
        let stamp_ns = r.aligned(4) * 1_000_000_000 + r.aligned(4);
        assert_eq!(stamp_ns, time_ns - lead_ns);
        assert_eq!(r.cdr_text(), "top");
        let _size = (r.aligned(4), r.aligned(4));
        let cloud = Cloud::read(&mut r);
        assert_eq!(cloud.points.len(), scan.len());
        for (point, p) in cloud.points.iter().zip(scan) {
            let after_ns = cloud.number(point, "t");
            let fired_ns = time_ns.checked_add_signed(p.point.time_ns);
            assert_eq!(Some(stamp_ns + after_ns), fired_ns);
            let time_s = f64::from(cloud.real(point, "time"));
            assert!(time_s >= 0.0 && (time_s - after_ns as f64 * 1e-9).abs() < 1e-8);
            count += 1;
        }
    }
    assert!(count > 300);
}

#[test]
fn deskewed_scans_are_told_of() {
    let notes = made(FormatName::Mcap).done.notes;
    let [deskewed] = notes
        .iter()
        .filter(|note| note.contains("deskewed"))
        .collect::<Vec<_>>()[..]
    else {
        panic!("one note: {notes:?}")
    };
    assert!(deskewed.contains("the scans of 'top' are deskewed, so their points have no `time`"));
    assert!(deskewed.contains("lidar.deskew = false"), "{deskewed}");
    assert_eq!(made(FormatName::Tum).done.notes, [""; 0]);
}

/// The linear and the angular velocity of each frame, and the diagonals of their covariances.
fn twists(made: &Made) -> Vec<(DVec3, DVec3, [f64; 6])> {
    let bytes = file(made);
    let messages = messages(&bytes);
    let odometry = messages.iter().filter(|m| m.0 == "/odom");
    let twist = |data: &[u8]| {
        let mut r = Reader::new(data);
        r.at = 4;
        let _stamp = (r.aligned(4), r.aligned(4));
        assert_eq!(
            (r.cdr_text(), r.cdr_text()),
            ("map".into(), "base_link".into())
        );
        let numbers: Vec<f64> = (0..7 + 36 + 6 + 36)
            .map(|_| f64::from_bits(r.aligned(8)))
            .collect();
        assert_eq!(r.at, data.len());
        assert!(numbers[7..43].iter().all(|v| *v == 0.0), "poses are exact");
        let covariance = &numbers[49..];
        let of_rest = (0..36).filter(|k| k % 7 != 0).map(|k| covariance[k]);
        assert!(of_rest.into_iter().all(|v| v == 0.0));
        (
            DVec3::from_slice(&numbers[43..46]),
            DVec3::from_slice(&numbers[46..49]),
            std::array::from_fn(|axis| covariance[7 * axis]),
        )
    };
    odometry.map(|(.., data)| twist(data)).collect()
}

#[test]
fn velocities_are_central_differences_where_a_frame_has_its_neighbours() {
    let all = made_of_frames(FormatName::Mcap, &header(), &[0, 1, 2, 3, 4]);
    for (k, (linear, angular, variances)) in twists(&all).into_iter().enumerate() {
        assert_eq!(variances, [0.0; 6]);
        let k = k as u64;
        let (before, after) = (pose(k.saturating_sub(1)), pose((k + 1).min(4)));
        let duration_s = after.0 - before.0;
        let here = pose(k).1.rotation;
        let way_m = after.1.translation_m - before.1.translation_m;
        assert!((here * linear * duration_s).distance(way_m) < 1e-8);
        // The motion, as a rotation in the world, leads from the pose before to the one after.
        let turn = DQuat::from_scaled_axis(here * angular * duration_s);
        let reached = turn * before.1.rotation;
        assert!(reached.dot(after.1.rotation).abs() > 1.0 - 1e-12);
        assert!(angular.length() * duration_s < 1.0, "by the short way");
    }
    // Frames 0 and 3 are missing.
    for (linear, angular, variances) in twists(&made(FormatName::Mcap)) {
        assert_eq!((linear, angular), (DVec3::ZERO, DVec3::ZERO));
        assert_eq!(variances, [1e6; 6]);
    }
    // Of frame 1 alone nothing is known either, and the last two frames know their neighbour.
    let few = twists(&made_of_frames(FormatName::Mcap, &header(), &[1, 3, 4]));
    assert_eq!(
        few.iter().map(|t| t.2[0]).collect::<Vec<_>>(),
        [1e6, 1e6, 0.0]
    );
    // Nothing is known of the turn from a flight line to the next: 2 has 3 alone, and 4 nothing.
    let flight = Drive {
        lines: vec![0, 2, 4],
        ..Drive::of(0, &[0, 1, 2, 3, 4])
    };
    let lines = twists(&made_of_drives(FormatName::Mcap, &header(), &[flight]));
    let (from, to) = (pose(2), pose(3));
    let way_m = to.1.translation_m - from.1.translation_m;
    let found_m = from.1.rotation * lines[2].0 * (to.0 - from.0);
    assert!(found_m.distance(way_m) < 1e-8);
    assert_eq!((lines[4].0, lines[4].2), (DVec3::ZERO, [1e6; 6]));
}

#[test]
fn velocities_are_those_of_the_inertial_unit_if_there_is_one() {
    let mut header = header();
    let lever_m = DVec3::new(0.3, -0.2, 0.5);
    header.sequences[0].imu = Some(ImuSpec {
        body_from_imu: RigidTransform::from_xyz_rpy(lever_m, 0.1, 0.2, 0.3),
        rate_hz: 10.0,
        angular_rate_noise_rad_s: 0.5,
        specific_force_noise_m_s2: 0.25,
    });
    let twists = twists(&made_of(FormatName::Mcap, &header));
    assert_eq!(twists.len(), 3);
    for ((linear, angular, variances), frame) in twists.into_iter().zip([1, 2, 4]) {
        assert_eq!(variances, [0.0; 6]);
        let back = pose(frame).1.rotation.inverse();
        // The body turns nearly steadily.
        let [before, after] = [-0.01, 0.01].map(|s| pose_at(pose(frame).0 + s).rotation);
        let rate = rotation_vector(after * before.inverse()) / 0.02;
        assert!(angular.distance(back * rate) < 1e-3, "{angular} {rate}");
        let swing = rate.cross(pose(frame).1.rotation * lever_m);
        let expected = back * (UNIT_VELOCITY_M_S - swing);
        assert!(linear.distance(expected) < 1e-3, "{linear} {expected}");
    }
}

#[test]
fn sensors_are_not_called_as_the_robots_frames() {
    for name in ["base_link", "map", "odom"] {
        let mut header = header();
        header.sequences[0].cameras[1].name = name.to_owned();
        let folder = tempfile::tempdir().expect("a folder");
        let (source, out) = (folder.path().join("dataset"), folder.path().join("out"));
        write(&source, &header, &[1]);
        let refused = run(&source, &out, FormatName::Mcap, OutputMode::Fresh).expect_err("a frame");
        assert!(matches!(refused, Error::Unsuitable { .. }));
        let told = refused.to_string();
        assert!(told.contains(&format!("is called '{name}'")), "{told}");
        assert!(told.contains("'base_link', 'map', 'odom'"), "{told}");
        assert!(!out.exists());
        run(&source, &out, FormatName::Tum, OutputMode::Fresh).expect("TUM has no such frames");
    }
}
