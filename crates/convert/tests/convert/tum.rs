//! TUM's files, read as its page describes them.

use nemoral_convert::FormatName;
use nemoral_dataset::ImuSpec;
use nemoral_scene::RigidTransform;
use nemoral_scene::glam::{DQuat, DVec3};

use crate::common::{estimated, header, made, made_of, numbers, png, pose, text};

#[test]
fn lists_name_files_and_poses_and_depth_are_those_of_the_data_set() {
    let made = made(FormatName::Tum);
    let header = header();
    let cameras = header.sequences[0]
        .cameras
        .iter()
        .map(|c| (&c.name, c.body_from_camera));
    let lidars = header.sequences[0]
        .lidars
        .iter()
        .map(|l| (&l.name, l.body_from_lidar));
    for (name, mount) in cameras.chain(lidars) {
        let folder = made.out.join(format!("00-{name}"));
        let poses = numbers(&text(folder.join("groundtruth.txt")));
        assert_eq!(poses.len(), 3);
        for (row, frame) in poses.iter().zip([1, 2, 4]) {
            let (time_s, world_from_body) = pose(frame);
            let expected = world_from_body * mount;
            assert_eq!(row[0], time_s);
            let at = DVec3::new(row[1], row[2], row[3]);
            let turn = DQuat::from_xyzw(row[4], row[5], row[6], row[7]);
            assert!(at.distance(expected.translation_m) < 1e-9);
            assert!(turn.dot(expected.rotation).abs() > 1.0 - 1e-12);
        }
    }
    for (c, camera) in header.sequences[0].cameras.iter().enumerate() {
        let folder = made.out.join(format!("00-{}", camera.name));
        for (what, bytes_per_pixel) in [("rgb", 3), ("depth", 2)] {
            let list = text(folder.join(format!("{what}.txt")));
            let rows: Vec<_> = list.lines().filter(|l| !l.starts_with('#')).collect();
            assert_eq!(rows.len(), 3);
            for (i, row) in rows.iter().enumerate() {
                let (stamp, file) = row.split_once(' ').expect("two columns");
                assert_eq!(stamp.parse::<f64>().expect("a time"), pose([1, 2, 4][i]).0);
                let (w, h, data) = png(folder.join(file));
                assert_eq!(data.len(), w * h * bytes_per_pixel);
                let frame = made.dataset.read_frame(i).expect("a frame");
                let seen = &frame.cameras[c];
                if what == "rgb" {
                    assert_eq!(data, seen.rgb.pixels().as_flattened());
                    continue;
                }
                for (code, &z) in data.as_chunks::<2>().0.iter().zip(seen.depth_m.pixels()) {
                    let code = u16::from_be_bytes(*code);
                    if z == 0.0 || z > 13.107 {
                        assert_eq!(code, 0);
                    } else {
                        assert!((f32::from(code) / 5000.0 - z).abs() <= 0.000_11, "{z}");
                    }
                }
            }
        }
    }
}

fn unit() -> ImuSpec {
    ImuSpec {
        body_from_imu: RigidTransform::from_xyz_rpy(DVec3::new(0.1, 0.2, 0.3), 0.4, 0.0, 0.0),
        rate_hz: 10.0,
        angular_rate_noise_rad_s: 0.5,
        specific_force_noise_m_s2: 0.25,
    }
}

#[test]
fn what_a_navigation_system_estimates_lies_beside_the_truth() {
    let mut header = header();
    header.sequences[0].has_estimated_poses = true;
    let unit = unit();
    let mount = unit.body_from_imu;
    header.sequences[0].imu = Some(unit);
    let made = made_of(FormatName::Tum, &header);
    let sequence = &header.sequences[0];
    let cameras = (sequence.cameras.iter()).map(|c| (&c.name, c.body_from_camera));
    let lidars = (sequence.lidars.iter()).map(|l| (&l.name, l.body_from_lidar));
    let unit_name = "imu".to_owned();
    for (name, mount) in cameras.chain(lidars).chain([(&unit_name, mount)]) {
        let folder = made.out.join(format!("00-{name}"));
        let truth = numbers(&text(folder.join("groundtruth.txt")));
        let rows = numbers(&text(folder.join("estimated.txt")));
        assert_eq!(rows.len(), truth.len());
        for ((row, truth), frame) in rows.iter().zip(truth).zip([1, 2, 4]) {
            assert_eq!(row[0], truth[0]);
            let expected = (estimated(frame) * mount).translation_m;
            assert!(DVec3::from_slice(&row[1..4]).distance(expected) < 1e-9);
            assert!((row[3] - truth[3] - 0.1).abs() < 1e-9);
        }
    }
}

#[test]
fn an_inertial_unit_has_its_accelerations_and_poses() {
    let mut header = header();
    let unit = unit();
    let mount = unit.body_from_imu;
    header.sequences[0].imu = Some(unit);
    let made = made_of(FormatName::Tum, &header);
    let folder = made.out.join("00-imu");
    let written = text(folder.join("accelerometer.txt"));
    assert!(written.starts_with("# timestamp ax ay az\n0.000000000 0 0.25 9.75\n0.050000000 "));
    let rows = numbers(&written);
    let readings = made.dataset.imu(0).expect("readings");
    assert_eq!(rows.len(), readings.len());
    for (row, reading) in rows.iter().zip(&readings) {
        assert_eq!((row[0] * 1e9).round() as i64, reading.time_ns);
        assert_eq!(row[1..], reading.specific_force_m_s2.to_array());
    }
    let poses = numbers(&text(folder.join("groundtruth.txt")));
    assert_eq!(poses.len(), 3);
    let expected = pose(1).1 * mount;
    let at = DVec3::from_slice(&poses[0][1..4]);
    assert!(at.distance(expected.translation_m) < 1e-9);
}
