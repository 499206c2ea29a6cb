//! Mounts, lenses, shutters and pairs of cameras, as files say them and as check holds them against
//! what was recorded.

use std::fs;

use nemoral_dataset::{Agreement, OpenMode, Writer};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{Distortion, Intrinsics, Ontology, RigidTransform, Shutter};

use crate::common::{header, opened, see, small, write};

#[test]
fn poses_calibration_and_times_mean_what_kitti_says() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = small();
    let dataset = write(dir.path(), &header, &[2]);
    let (poses, calibration) = (
        dataset.poses(0).expect("poses"),
        dataset.calibration(0).expect("calib"),
    );
    assert_eq!(dataset.times(0).expect("times"), [0.0, 0.5, 1.0, 1.5]);
    assert_eq!(poses.len(), 4);
    // A LiDAR point of frame 2, through the files, must land where the mounts put it.
    let p = DVec3::new(7.0, -1.0, 0.5);
    let by_rows = |m: &[[f64; 4]; 3], p: DVec3| {
        DVec3::from_array(std::array::from_fn(|r| {
            m[r][0] * p.x + m[r][1] * p.y + m[r][2] * p.z + m[r][3]
        }))
    };
    let in_camera = by_rows(&calibration.camera_from_lidar, p);
    let in_frame0 = poses[2].transform_point(in_camera);
    let in_world = by_rows(&dataset.manifest().tracks[0].world_from_frame0, in_frame0);
    let world_from_body = crate::common::track(3).poses[2].1;
    let expected =
        (world_from_body * header.sequences[0].lidars[0].body_from_lidar).transform_point(p);
    assert!(in_world.distance(expected) < 1e-9, "{in_world} {expected}");
    let k = header.sequences[0].cameras[0].intrinsics;
    let image = by_rows(&calibration.projections[2], in_camera);
    let pixel = k.project(in_camera).expect("in front");
    assert!((image.truncate() / image.z).distance(pixel) < 1e-9);
    let first = std::fs::read_to_string(dir.path().join("sequences/00/poses.txt")).expect("poses");
    let identity: Vec<f64> = first
        .lines()
        .next()
        .expect("a line")
        .split(' ')
        .map(|w| w.parse().expect("a number"))
        .collect();
    for (i, v) in identity.iter().enumerate() {
        assert!((v - if i % 5 == 0 { 1.0 } else { 0.0 }).abs() < 1e-12);
    }
}

#[test]
fn further_sensors_and_no_camera() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut two = small();
    let (mut camera, mut lidar) = (
        two.sequences[0].cameras[0].clone(),
        two.sequences[0].lidars[0].clone(),
    );
    camera.name = "rear".to_owned();
    camera.intrinsics = Intrinsics::from_fov(16, 20, 0.9).expect("valid");
    lidar.name = "low".to_owned();
    lidar.body_from_lidar.translation_m.z -= 0.75;
    two.sequences[0].cameras.push(camera);
    two.sequences[0].lidars.push(lidar);
    two.ontology = Ontology::fuel();
    let dataset = write(&dir.path().join("two"), &two, &[0]);
    assert_eq!(dataset.manifest().header, opened(&two));
    let at = dir.path().join("two/sequences/00");
    for file in [
        "rear/image_2/000000.png",
        "rear/depth/000000.png",
        "low/velodyne/000000.bin",
        "low/points/000000.ply",
    ] {
        assert!(at.join(file).exists(), "{file}");
    }
    let frame = dataset.read_frame(0).expect("frame");
    assert_eq!(frame.cameras[1].semantic.width(), 16);

    let calibration = dataset.calibration(0).expect("calib");
    assert_eq!(calibration.further.len(), 1);
    let [low] = &calibration.further_lidars[..] else {
        panic!("{calibration:?}");
    };
    assert_eq!(low.name, "low");
    // Lower by 0.75 m than the first LiDAR, in the camera's axes: y is down.
    let first = calibration.camera_from_lidar;
    let lower = DVec3::from_array(std::array::from_fn(|i| {
        low.camera_from_lidar[i][3] - first[i][3]
    }));
    assert!(
        (lower.length() - 0.75).abs() < 1e-9 && lower.y > 0.7,
        "{lower}"
    );
    let text = fs::read_to_string(at.join("calib.txt")).expect("read");
    let tr = text.lines().find(|l| l.starts_with("Tr: ")).expect("Tr");
    for (with, what) in [
        (tr.replace("Tr: ", "\nTr_low: ") + "\nX: ", "Tr_low is 0.75"),
        ("\nTr_high: ".to_owned(), "Tr_NAME differ"),
    ] {
        let lie = text.replace("\nTr_low: ", &with);
        fs::write(at.join("calib.txt"), lie).expect("write");
        crate::common::reseal(&dir.path().join("two"), "sequences/00/calib.txt");
        let report = nemoral_dataset::check(&dir.path().join("two")).expect("check");
        assert!(report.to_string().contains(what), "{what}: {report}");
    }

    let mut lidar_only = small();
    lidar_only.sequences[0].cameras.clear();
    let dataset = write(&dir.path().join("lidar"), &lidar_only, &[1]);
    let calibration = dataset.calibration(0).expect("calib");
    assert_eq!(
        calibration.camera_from_lidar,
        nemoral_scene::RigidTransform::IDENTITY.to_rows()
    );
    let world =
        crate::common::track(2).poses[1].1 * lidar_only.sequences[0].lidars[0].body_from_lidar;
    let found =
        dataset.manifest().tracks[0].world_from_frame0() * dataset.poses(0).expect("poses")[1];
    assert!(found.translation_m.distance(world.translation_m) < 1e-9);
}

/// With rows that are read one after the other while the robot moves, everything still agrees,
/// because the time of each row and the body's motion are known. Without these nothing would agree.
#[test]
fn rolling_shutters_agree_with_scans_and_flow() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut header = crate::common::header();
    header.sequences[0].cameras[0].shutter = Shutter {
        exposure_s: 0.01,
        readout_s: 0.03,
    };
    header.sequences[0].cameras[0].annotations.flow = true;
    let dataset = write(dir.path(), &header, &[0, 1, 2, 3]);
    assert_eq!(dataset.manifest().header, opened(&header));
    assert_eq!(dataset.frames()[2].body_motion, crate::common::MOTION);
    let check = || nemoral_dataset::check(dir.path()).expect("check");
    let report = check();
    assert!(report.passed(), "{report}");
    let residual = report.agreement.same_frame.median_m().expect("points");
    assert!(residual.abs() < 0.005, "{residual}");
    let card = fs::read_to_string(dir.path().join("README.md")).expect("a card");
    assert!(card.contains("body_motion"), "{card}");

    // The motion is removed.
    let path = dir.path().join("dataset.json");
    let text = fs::read_to_string(&path).expect("read");
    fs::write(&path, text.replace("\"body_motion\"", "\"forgotten\"")).expect("write");
    let still = check();
    let wrong = |r: &nemoral_dataset::CheckReport| 1.0 - r.agreement.overall().expect("points");
    println!(
        "disagreement {} with, {} without",
        wrong(&report),
        wrong(&still)
    );
    assert!(wrong(&still) > 2.0 * wrong(&report), "{still}");
    assert!(
        still.to_string().contains("pixels flow elsewhere"),
        "{still}"
    );
}

#[test]
fn lenses_come_back_and_agree_with_the_scans() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut bent = header();
    let lens = Distortion::BrownConrady {
        k1: -0.2,
        k2: 0.03,
        k3: 0.0,
        p1: 0.001,
        p2: -0.002,
    };
    let fish = Distortion::Fisheye {
        k1: -0.01,
        k2: 0.002,
        k3: 0.0,
        k4: 0.0,
    };
    bent.sequences[0].cameras[0].intrinsics =
        Intrinsics::through_lens(320, 240, 1.3, lens).expect("sound");
    let mut wide = bent.sequences[0].cameras[0].clone();
    wide.name = "wide".to_owned();
    wide.intrinsics = Intrinsics::through_lens(320, 240, 2.2, fish).expect("sound");
    bent.sequences[0].cameras.push(wide);
    let dataset = write(&dir.path().join("bent"), &bent, &[0, 1]);
    assert_eq!(dataset.manifest().header, opened(&bent));
    let calibration = dataset.calibration(0).expect("calib");
    assert_eq!(calibration.distortion, lens);
    assert_eq!(calibration.further[0].distortion, fish);
    let text = fs::read_to_string(dataset.root().join("sequences/00/calib.txt")).expect("read");
    assert!(
        text.contains("\nD2: -2e-1 3e-2 1e-3 -2e-3 0e0 0e0"),
        "{text}"
    );
    assert!(
        text.lines().all(|l| l.split_whitespace().count() == 13),
        "{text}"
    );
    let sound = nemoral_dataset::check(dataset.root()).expect("check");
    assert!(
        sound.passed() && sound.agreement.comparable() > 10_000,
        "{sound}"
    );

    // Distorted pictures with a header that says they are not.
    let mut straight = bent.clone();
    for camera in &mut straight.sequences[0].cameras {
        camera.intrinsics.distortion = Distortion::None;
    }
    let out = dir.path().join("straight");
    let writer = Writer::create(&out, OpenMode::Fresh, straight.clone()).expect("create");
    for k in 0..2 {
        writer
            .write_frame(&see(&bent, k).data(&straight))
            .expect("frame");
    }
    crate::common::finish(writer, 4);
    let lied = nemoral_dataset::check(&out).expect("check");
    let (sound, lied) = (&sound.agreement, &lied.agreement);
    println!("{sound}{lied}");
    let shares = [sound, lied].map(Agreement::comparable_share);
    assert!(shares[1] < 0.7 * shares[0], "{shares:?}");
    let wrong = [sound, lied].map(|a| 1.0 - a.overall().expect("points"));
    assert!(wrong[1] > 2.0 * wrong[0], "{wrong:?}");
}

#[test]
fn a_right_eye_is_kittis() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut pair = small();
    let mut right = pair.sequences[0].cameras[0].clone();
    right.name = "right".to_owned();
    // Half a metre to the right in the optical frame.
    let aside = RigidTransform {
        translation_m: DVec3::new(0.5, 0.0, 0.0),
        ..RigidTransform::IDENTITY
    };
    right.body_from_camera = right.body_from_camera * aside;
    pair.sequences[0].cameras.push(right);
    let dataset = write(dir.path(), &pair, &[0]);
    let at = dir.path().join("sequences/00");
    for (file, there) in [
        ("image_2/000000.png", true),
        ("image_3/000000.png", true),
        ("right/depth/000000.png", true),
        ("right/image_2", false),
    ] {
        assert_eq!(at.join(file).exists(), there, "{file}");
    }
    let calibration = dataset.calibration(0).expect("calib");
    let [p2, p3] = [calibration.projections[2], calibration.projections[3]];
    let k = pair.sequences[0].cameras[0].intrinsics;
    // KITTI: the fourth column is -focal length × baseline.
    assert!((p3[0][3] + 0.5 * k.fx).abs() < 1e-9, "{p3:?}");
    assert!((p3[0][0] - p2[0][0]).abs() < 1e-9 && p2[0][3] == 0.0);
    assert_eq!(calibration.further[0].projection, p3);
    // A point of the LiDAR is projected by Tr and P3, and by Tr_right and the pinhole.
    let apply = |m: &[[f64; 4]; 3], p: DVec3| {
        DVec3::from_array(m.map(|r| r[0] * p.x + r[1] * p.y + r[2] * p.z + r[3]))
    };
    let point = DVec3::new(9.0, 1.0, -0.5);
    let pixel = apply(&p3, apply(&calibration.camera_from_lidar, point));
    let in_right = apply(&calibration.further[0].camera_from_lidar, point);
    let other = k.project(in_right).expect("in front");
    assert!((pixel.truncate() / pixel.z).distance(other) < 1e-9);
    assert!((pixel.z - in_right.z).abs() < 1e-9);

    assert!(nemoral_dataset::check(dir.path()).expect("check").passed());
    let calib = at.join("calib.txt");
    let text = fs::read_to_string(&calib).expect("read");
    let tr = text.lines().find(|l| l.starts_with("Tr: ")).expect("Tr");
    let of_first = format!("{}\nX: ", tr.replace("Tr", "Tr_right"));
    for (line, with, what) in [
        ("Tr_right: ", &*of_first, "Tr_right is 0.5"),
        ("P3: ", "P3: 1", "P0 to P3 differ"),
        ("P_right: ", "P_right: 1", "P_NAME differ"),
        ("P_right: ", "P_left: ", "Tr_left"),
        ("Tr_right: ", "Tr_left: ", "has 0 lines 'Tr_right:'"),
        ("\nTr: ", "\nTrue: ", "has 0 lines 'Tr:'"),
    ] {
        fs::write(&calib, text.replace(line, with)).expect("write");
        crate::common::reseal(dir.path(), "sequences/00/calib.txt");
        let report = nemoral_dataset::check(dir.path())
            .expect("check")
            .to_string();
        assert!(report.contains(what), "{what}: {report}");
    }
}
