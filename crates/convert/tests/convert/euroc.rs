//! EuRoC's and Kalibr's files, read by a small reader of this YAML and these tables.

use std::collections::BTreeMap;
use std::path::Path;

use nemoral_convert::{Error, FormatName, OutputMode};
use nemoral_dataset::{DatasetHeader, ImuSpec};
use nemoral_scene::glam::{DMat4, DQuat, DVec3};
use nemoral_scene::{Distortion, RigidTransform, Shutter};

use crate::common::{Made, header, made_of, made_of_frames, pose, run, text, write};

/// The frames that exist, with their times as text.
const FRAMES: [(u64, &str); 3] = [
    (1, "0000000001750000000"),
    (2, "0000000002250000000"),
    (4, "0000000003250000000"),
];
const K: [f64; 4] = [-0.15, 0.03, 0.002, -0.004];
const FISHEYE: [f64; 4] = [0.02, 0.003, -0.001, 0.0005];

/// A camera with a lens, a fisheye whose shutter rolls, and a unit in a direction of its own.
fn inertial() -> DatasetHeader {
    let mut header = header();
    let sequence = &mut header.sequences[0];
    let [k1, k2, p1, p2] = K;
    let k3 = 0.0;
    sequence.cameras[0].intrinsics.distortion = Distortion::BrownConrady { k1, k2, k3, p1, p2 };
    let [k1, k2, k3, k4] = FISHEYE;
    sequence.cameras[1].intrinsics.distortion = Distortion::Fisheye { k1, k2, k3, k4 };
    sequence.cameras[1].shutter = Shutter {
        exposure_s: 0.005,
        readout_s: 0.02,
    };
    sequence.imu = Some(ImuSpec {
        body_from_imu: RigidTransform::from_xyz_rpy(DVec3::new(0.3, -0.2, 0.5), 3.1, 0.2, 1.5),
        rate_hz: 20.0,
        angular_rate_noise_rad_s: 0.5,
        specific_force_noise_m_s2: 0.25,
    });
    header
}

/// The words of a YAML file by `key.key`, lists as numbers; rows of a matrix follow each other.
fn yaml(path: impl AsRef<Path>) -> BTreeMap<String, (String, Vec<f64>)> {
    let mut all: BTreeMap<String, (String, Vec<f64>)> = BTreeMap::new();
    let mut keys: Vec<String> = Vec::new();
    for line in text(path).lines() {
        let line = line.split('#').next().expect("a part");
        let depth = (line.len() - line.trim_start().len()) / 2;
        let mut value = line.trim();
        let is_next = value.starts_with("- ") || !value.contains(": ") && !value.ends_with(':');
        if value.is_empty() {
            continue;
        }
        if !is_next {
            let (key, rest) = value.split_once(':').expect("a key");
            keys.truncate(depth);
            keys.push(key.to_owned());
            value = rest.trim();
        }
        let entry = all.entry(keys.join(".")).or_default();
        entry.0 += value;
        let numbers = value.trim_start_matches("- ").split([',', '[', ']', ' ']);
        let numbers = numbers.filter(|word| !word.is_empty());
        entry
            .1
            .extend(numbers.filter_map(|n| n.parse::<f64>().ok()));
    }
    all
}

fn matrix(numbers: &[f64]) -> DMat4 {
    DMat4::from_cols_slice(numbers).transpose()
}

fn matrix_of(pose: &RigidTransform) -> DMat4 {
    DMat4::from_rotation_translation(pose.rotation, pose.translation_m)
}

/// The cells of each line after the first, which names columns.
fn table(path: impl AsRef<Path>) -> Vec<Vec<String>> {
    let text = text(path);
    assert!(text.starts_with("#timestamp"), "{text}");
    let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let columns = cells(text.lines().next().expect("a line")).len();
    let rows: Vec<_> = text.lines().skip(1).map(cells).collect();
    assert!(rows.iter().all(|row| row.len() == columns));
    rows
}

/// The true poses of B by their times.
fn truth(made: &Made) -> BTreeMap<String, DMat4> {
    let rows = table(
        made.out
            .join("00/mav0/state_groundtruth_estimate0/data.csv"),
    );
    let pose = |row: &Vec<String>| {
        let n: Vec<f64> = row[1..]
            .iter()
            .map(|n| n.parse().expect("a number"))
            .collect();
        let turn = DQuat::from_xyzw(n[4], n[5], n[6], n[3]);
        DMat4::from_rotation_translation(turn, DVec3::new(n[0], n[1], n[2]))
    };
    rows.iter().map(|row| (row[0].clone(), pose(row))).collect()
}

/// Poses that are composed of the true ones and of `T_BS` are those of the data set's cameras, at
/// the times of their pictures.
fn check_poses(made: &Made, header: &DatasetHeader) {
    let truth = truth(made);
    for (i, camera) in header.sequences[0].cameras.iter().enumerate() {
        let folder = made.out.join(format!("00/mav0/cam{i}"));
        let b_from_camera = matrix(&yaml(folder.join("sensor.yaml"))["T_BS.data"].1);
        let rows = table(folder.join("data.csv"));
        assert_eq!(rows.len(), FRAMES.len());
        for (k, (row, (frame, stamp))) in rows.iter().zip(FRAMES).enumerate() {
            assert_eq!(row[..], [stamp.to_owned(), format!("{stamp}.png")]);
            assert_eq!(
                stamp.parse::<f64>().expect("a time") * 1e-9 - 1.0,
                pose(frame).0
            );
            let found = truth[stamp] * b_from_camera;
            let asked = matrix_of(&(pose(frame).1 * camera.body_from_camera));
            assert!(found.abs_diff_eq(asked, 1e-9), "{found} {asked}");
            let frame = made.dataset.read_frame(k).expect("a frame");
            let (w, h, data) = crate::common::png(folder.join("data").join(&row[1]));
            assert_eq!(
                (w as u32, h as u32),
                (camera.intrinsics.width, camera.intrinsics.height)
            );
            assert_eq!(data, frame.cameras[i].rgb.pixels().as_flattened());
        }
    }
}

#[test]
fn poses_of_the_unit_and_mounts_compose_to_those_of_cameras() {
    let header = inertial();
    let made = made_of(FormatName::Euroc, &header);
    check_poses(&made, &header);
    // The unit and the true states are B itself.
    for folder in ["imu0", "state_groundtruth_estimate0"] {
        let sensor = yaml(made.out.join("00/mav0").join(folder).join("sensor.yaml"));
        assert_eq!(matrix(&sensor["T_BS.data"].1), DMat4::IDENTITY);
    }
    assert!(text(made.out.join("00/mav0/body.yaml")).contains("inertial unit"));
}

#[test]
fn lenses_and_rates_are_those_of_the_data_set() {
    let header = inertial();
    let made = made_of(FormatName::Euroc, &header);
    let lenses = [
        ("radial-tangential", "radtan", K),
        ("equidistant", "equidistant", FISHEYE),
    ];
    let chain = yaml(made.out.join("00/camchain-imucam.yaml"));
    for (i, (euroc, kalibr, coefficients)) in lenses.into_iter().enumerate() {
        let camera = &header.sequences[0].cameras[i];
        let k = &camera.intrinsics;
        let intrinsics = [k.fx, k.fy, k.cx - 0.5, k.cy - 0.5];
        let resolution = [f64::from(k.width), f64::from(k.height)];
        let path = made.out.join(format!("00/mav0/cam{i}/sensor.yaml"));
        let sensor = yaml(&path);
        assert_eq!(sensor["sensor_type"].0, "camera");
        assert_eq!(sensor["camera_model"].0, "pinhole");
        assert_eq!(sensor["distortion_model"].0, euroc);
        assert_eq!(sensor["distortion_coefficients"].1, coefficients);
        assert_eq!(sensor["intrinsics"].1, intrinsics);
        assert_eq!(sensor["resolution"].1, resolution);
        // Frames 1, 2 and 4 of a drive that has two a second.
        assert_eq!(sensor["rate_hz"].1, [2.0]);
        let told = format!(", camera {}", camera.name);
        assert!(sensor["comment"].0.ends_with(&told));
        let rolls = "The shutter rolls: it takes 0.02 s / 22 = 0.00090";
        assert_eq!(text(path).contains(rolls), i == 1);

        let of = |key: &str| chain[&format!("cam{i}.{key}")].clone();
        assert_eq!(of("camera_model").0, "pinhole");
        assert_eq!(of("distortion_model").0, kalibr);
        assert_eq!(of("distortion_coeffs").1, coefficients);
        assert_eq!(of("intrinsics").1, intrinsics);
        assert_eq!(of("resolution").1, resolution);
        assert_eq!(of("rostopic").0, format!("/{}/image", camera.name));
        assert_eq!(of("timeshift_cam_imu").0, "0.0");
        // Kalibr turns the other way.
        let there_and_back = matrix(&of("T_cam_imu").1) * matrix(&sensor["T_BS.data"].1);
        assert!(there_and_back.abs_diff_eq(DMat4::IDENTITY, 1e-12));
    }
    assert!(!chain.contains_key("cam0.T_cn_cnm1"));
    let [first, second] = [0, 1].map(|i| matrix(&chain[&format!("cam{i}.T_cam_imu")].1));
    let from_before = matrix(&chain["cam1.T_cn_cnm1"].1);
    assert!((from_before * first).abs_diff_eq(second, 1e-12));
}

#[test]
fn what_the_unit_measured_has_the_times_of_pictures_and_all_else_as_it_was() {
    let made = made_of(FormatName::Euroc, &inertial());
    let readings = made.dataset.imu(0).expect("readings");
    let rows = table(made.out.join("00/mav0/imu0/data.csv"));
    assert_eq!((rows.len(), rows[0].len()), (readings.len(), 7));
    for (row, reading) in rows.iter().zip(&readings) {
        assert_eq!(row[0].len(), 19);
        assert_eq!(
            row[0].parse::<i64>().expect("a time"),
            reading.time_ns + 1_000_000_000
        );
        let rest = format!("{},0,0.5,0,0.25,9.75", reading.time_ns);
        assert_eq!(row[1..].join(","), rest);
    }
    let states = table(
        made.out
            .join("00/mav0/state_groundtruth_estimate0/data.csv"),
    );
    assert_eq!((states.len(), states[0].len()), (readings.len(), 17));
    assert!(rows.iter().zip(&states).all(|(a, b)| a[0] == b[0]));
    assert_eq!(states[0][8..].join(","), "0.1,0.2,0.3,0,0,0.01,0,0,0.02");
    let times: Vec<_> = rows.iter().map(|row| &row[0]).collect();
    for (_, stamp) in FRAMES {
        assert!(times.iter().any(|time| **time == stamp), "{stamp}");
    }
    let densities = [
        ("gyroscope_noise_density", 1.6968e-4),
        ("gyroscope_random_walk", 1.9393e-5),
        ("accelerometer_noise_density", 2e-3),
        ("accelerometer_random_walk", 3e-3),
    ];
    let sensor = yaml(made.out.join("00/mav0/imu0/sensor.yaml"));
    let kalibr = yaml(made.out.join("00/imu.yaml"));
    for (name, density) in densities {
        assert_eq!(sensor[name].1, [density]);
        assert_eq!(kalibr[name].1, [density]);
        assert!(!kalibr[name].0.contains('e'));
    }
    assert_eq!(sensor["sensor_type"].0, "imu");
    assert_eq!(sensor["rate_hz"].1, [20.0]);
    assert_eq!(kalibr["update_rate"].1, [20.0]);
    assert_eq!(kalibr["rostopic"].0, "/imu");
}

#[test]
fn without_a_unit_the_truth_is_that_of_the_body_at_frames() {
    let header = header();
    let made = made_of(FormatName::Euroc, &header);
    check_poses(&made, &header);
    let without_gaps = made_of_frames(FormatName::Euroc, &header, &[1, 2, 3]);
    let states = table(
        without_gaps
            .out
            .join("00/mav0/state_groundtruth_estimate0/data.csv"),
    );
    assert_eq!((states.len(), states[0].len()), (3, 17));
    // It drives 1.6 m/s east, which is known where both neighbours are.
    let east: Vec<f64> = states
        .iter()
        .map(|row| row[8].parse().expect("a number"))
        .collect();
    assert!((east[1] - 1.6).abs() < 1e-9, "{east:?}");
    assert_eq!([east[0], east[2]], [0.0; 2]);
    assert!(states.iter().all(|row| row[11..].iter().all(|n| n == "0")));
    let found: Vec<_> = std::fs::read_dir(made.out.join("00"))
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name())
        .collect();
    assert!(found.iter().any(|name| name == "camchain.yaml") && found.len() == 2);
    assert!(!made.out.join("00/mav0/imu0").exists());
    let chain = yaml(made.out.join("00/camchain.yaml"));
    assert!(!chain.keys().any(|key| key.contains("imu")));
    assert_eq!(chain["cam0.distortion_coeffs"].1, [0.0; 4]);
    assert_eq!(chain["cam1.T_cn_cnm1"].1.len(), 16);
    assert!(text(made.out.join("00/mav0/body.yaml")).contains("B is the robot's"));
}

#[test]
fn a_lens_with_a_sixth_power_is_refused() {
    let mut header = inertial();
    let [k1, k2, p1, p2] = K;
    let k3 = 0.001;
    header.sequences[0].cameras[1].intrinsics.distortion =
        Distortion::BrownConrady { k1, k2, k3, p1, p2 };
    let folder = tempfile::tempdir().expect("a folder");
    let (source, out) = (folder.path().join("dataset"), folder.path().join("out"));
    write(&source, &header, &[0]);
    let error = run(&source, &out, FormatName::Euroc, OutputMode::Fresh).expect_err("k3");
    assert!(matches!(error, Error::Unsuitable { .. }) && !out.exists());
    let told = error.to_string();
    assert!(
        told.contains("sequence 00, camera 'right': k3 = 0.001: must be 0"),
        "{told}"
    );
}
