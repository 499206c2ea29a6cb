//! Pairs of cameras and pictures that are not rectified, of which users are told.

use nemoral_convert::FormatName;
use nemoral_dataset::DatasetHeader;
use nemoral_scene::glam::DVec3;
use nemoral_scene::{Distortion, RigidTransform};

use crate::common::{header, made_of};

/// The pair, whose right camera is mounted 0.2 m to the right along the axis y of a body.
fn pair(left_yaw_rad: f64, right_yaw_rad: f64) -> DatasetHeader {
    let mut header = header();
    let cameras = &mut header.sequences[0].cameras;
    for (camera, (y_m, yaw_rad)) in cameras
        .iter_mut()
        .zip([(0.0, left_yaw_rad), (-0.2, right_yaw_rad)])
    {
        let mount = RigidTransform::from_xyz_rpy(DVec3::new(0.3, y_m, 1.3), 0.0, 0.0, yaw_rad);
        camera.body_from_camera = mount * RigidTransform::body_from_optical();
    }
    header
}

/// The notes about pairs.
fn notes(format: FormatName, header: &DatasetHeader) -> Vec<String> {
    let notes = made_of(format, header).done.notes.into_iter();
    notes.filter(|note| note.contains("rectified")).collect()
}

#[test]
fn a_note_says_what_spoils_a_pair() {
    for (format, consequence) in [
        (FormatName::Mcap, "`camera_info` has no baseline (p[3] = 0)"),
        (FormatName::Kitti, "P1 and P3"),
        (FormatName::SemanticKitti, "P1 and P3"),
    ] {
        assert_eq!(notes(format, &pair(0.0, 0.0)), [""; 0]);
        // Both are yawed by 0.1 rad: 0.2 sin(0.1) m to the rear, 0.2 cos(0.1) m to the right.
        let [note] = &notes(format, &pair(0.1, 0.1))[..] else {
            panic!("one note")
        };
        for said in [
            "cameras 'front' and 'right' of sequence 00 are not a rectified pair",
            "turned by 0.0000°",
            "0.1990 m to the right, 0.0000 m down and -0.0200 m forward",
            consequence,
        ] {
            assert!(note.contains(said), "{said:?} is not in {note:?}");
        }
        let [note] = &notes(format, &pair(0.0, 0.05))[..] else {
            panic!("one note")
        };
        assert!(note.contains("turned by 2.8648°"), "{note}");
    }
    // A camera of another name is no part of a pair.
    let mut header = pair(0.1, 0.0);
    header.sequences[0].cameras[1].name = "back".to_owned();
    assert_eq!(notes(FormatName::Mcap, &header), [""; 0]);
}

#[test]
fn a_note_says_that_pictures_are_not_rectified() {
    let lens = Distortion::BrownConrady {
        k1: -0.2,
        k2: 0.03,
        k3: 0.0,
        p1: 0.0,
        p2: 0.0,
    };
    let note = |header: &DatasetHeader| {
        let [note] = &notes(FormatName::Kitti, header)[..] else {
            panic!("one note")
        };
        note.clone()
    };
    let mut both = pair(0.0, 0.0);
    for camera in &mut both.sequences[0].cameras {
        camera.intrinsics.distortion = lens;
    }
    let said = note(&both);
    let expected = "camera 'front' of sequence 00 (and 1 more) has a lens, and readers";
    assert!(said.starts_with(expected), "{said}");
    assert!(said.contains("undistort them by D2"), "{said}");
    // Whoever reads a bag undistorts pictures by its `camera_info`.
    assert_eq!(notes(FormatName::Mcap, &both), [""; 0]);
    let mut rolling = pair(0.0, 0.0);
    rolling.sequences[0].cameras[1].shutter.readout_s = 0.02;
    let said = note(&rolling);
    let expected = "camera 'right' of sequence 00 has a rolling shutter";
    assert!(said.starts_with(expected), "{said}");
    // KITTI has no place for a camera of another name.
    rolling.sequences[0].cameras[1].name = "back".to_owned();
    assert_eq!(notes(FormatName::Kitti, &rolling), [""; 0]);
    // A single camera is told of, too.
    both.sequences[0].cameras.truncate(1);
    assert!(note(&both).starts_with("camera 'front' of sequence 00 has a lens"));
}
