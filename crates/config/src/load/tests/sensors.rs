//! Cameras, LiDARs, lamps and inertial units of a config.

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;

use super::*;

#[test]
fn a_device_lies_under_what_is_set() {
    let config = load(
        "medium",
        "[lidar]\npulses = 7\n[lidar.beam]\nrings = 1",
        &["lidar.device=vlp16"],
    )
    .expect("fine");
    let lidar = &config.lidar;
    assert_eq!((lidar.pulses, lidar.beam.rings), (7, 1));
    assert_eq!(
        (lidar.max_range_m, lidar.noise.model),
        (100.0, RangeNoiseModel::SignalToNoise)
    );
    assert_eq!(lidar.mount_z_m, Config::default().lidar.mount_z_m);
    let again = Config::from_toml(&config.to_toml()).expect("our own");
    assert_eq!(again, config);
    let text = message(load("", "", &["lidar.device=vlp17"]));
    assert!(text.contains("one of \"custom\", \"mid40\""), "{text}");
}

#[test]
fn a_device_has_no_more_returns_than_its_sheet() {
    // It has as many as it can by itself.
    let all = ["lidar.returns=all"];
    for (device, most) in [("vlp16", 2), ("avia", 3), ("tls", 15)] {
        let file = format!("lidar.device = \"{device}\"");
        let config = load("", &file, &all).expect("fine");
        assert_eq!(config.lidar.max_returns, most, "{device}");
    }
    let own = load("", "lidar.max_returns = 15", &all).expect("fine");
    assert_eq!(own.lidar.max_returns, 15);
    for (file, expected) in [
        (
            "[lidar]\ndevice = \"mid40\"\nreturns = \"dual\"",
            "c.toml:3:1: lidar.returns = \"dual\": must be \"strongest\", \"first\" or \"last\" \
             with lidar.device = \"mid40\"",
        ),
        (
            "[lidar]\ndevice = \"os1_64\"\nreturns = \"all\"",
            "lidar.returns = \"all\": must be",
        ),
        (
            "[lidar]\ndevice = \"vlp16\"\nreturns = \"all\"\nmax_returns = 3",
            "c.toml:4:1: lidar.max_returns = 3: must be at most 2 with lidar.device = \"vlp16\"",
        ),
        (
            "[lidar]\nreturns = \"all\"\n[lidars.rear]\ndevice = \"os0_128\"",
            "lidars.rear.returns = \"all\": must be",
        ),
    ] {
        let text = message(load("", file, &[]));
        assert!(text.contains(expected), "{file}: {text}");
    }
    // What is not asked for is not too much.
    let file = "[lidar]\ndevice = \"mid40\"\nmax_returns = 5\nreturns = \"first\"";
    assert_eq!(load("", file, &[]).expect("fine").lidar.max_returns, 5);
}

#[test]
fn a_carrier_is_a_box_that_the_lidar_is_outside_of() {
    let person = "[lidar]\nmount_x_m = 0.4\ncarrier = [-0.3, -0.25, 0, 0, 0.25, 1.8]\n";
    let file = format!(
        "{person}[lidars.alike]\n[lidars.sheet]\ndevice = \"vlp16\"\n[lidars.free]\ncarrier = []"
    );
    let config = load("", &file, &[]).expect("fine");
    let expected = [-0.3, -0.25, 0.0, 0.0, 0.25, 1.8];
    assert_eq!(config.lidar.carrier, expected);
    // Further LiDARs are on the same body, whatever they are.
    assert_eq!(config.lidars["alike"].carrier, expected);
    assert_eq!(config.lidars["sheet"].carrier, expected);
    assert!(config.lidars["free"].carrier.is_empty());
    let annotated = crate::annotated_toml(&config);
    assert_eq!(Config::from_toml(&annotated).expect("our own"), config);

    let must = "must be a box, [x0, y0, z0, x1, y1, z1], of numbers from -10 to 10";
    for carrier in [
        "[0, 0, 0, 1, 1]",
        "[0, 0, 0, 1, 1, 1, 1]",
        "[0, 0, 0, 1, 1, 10.5]",
        "[-inf, 0, 0, 1, 1, 1]",
        "[0, 0, 0, 1, nan, 1]",
        "[0, 2, 0, 1, 1, 1]",
        "[0, 0, 1, 1, 1, 1]",
        "[0, 0, 0, 1, 1, \"1\"]",
        "1",
    ] {
        let text = message(load("", &format!("[lidar]\ncarrier = {carrier}"), &[]));
        let told = "c.toml:2:1: lidar.carrier = ";
        assert!(text.contains(told) && text.contains(must), "{text}");
    }
    let inside = person.replace("0.4", "-0.1");
    let text = message(load("", &inside, &[]));
    let told = "lidar.carrier = [-0.3, -0.25, 0.0, 0.0, 0.25, 1.8]: must leave out the LiDAR";
    assert!(text.contains(told), "{text}");
}

#[test]
fn errors_of_intensity_and_detection_are_shares() {
    for (key, value, allowed) in [
        ("intensity_at_threshold", "-0.1", "a number from 0 to 1"),
        ("reflectance_spread", "1.5", "a number from 0 to 1"),
        ("false_alarm_probability", "0.5", "a number from 0 to 0.4"),
    ] {
        let setting = format!("lidar.noise.{key}={value}");
        let text = message(load("", "", &[&setting]));
        let expected = format!("lidar.noise.{key} = {value}: must be {allowed}");
        assert!(text.contains(&expected), "{text}");
    }
    let drops = message(load("", "", &["lidar.air.drop_reflectance=-0.1"]));
    assert!(drops.contains("must be a number from 0 to 1"), "{drops}");
    let exit = message(load("", "", &["lidar.beam.exit_m=0.2"]));
    assert!(exit.contains("must be a number from 0 to 0.1"), "{exit}");
}

#[test]
fn further_lamps_are_as_the_first_but_for_what_they_say() {
    let file = "[lamps.lidar]\nmount_y_m = -0.25\n[lamp]\nenabled = true\nlumen = 500\n\
        [lamps.off]\nenabled = false";
    let config = load("demo", file, &["lamp.kelvin=3200"]).expect("fine");
    let expected = crate::Lamp {
        mount_y_m: -0.25,
        ..config.lamp.clone()
    };
    assert_eq!(config.lamps["lidar"], expected);
    assert_eq!((expected.lumen, expected.kelvin), (500.0, 3200.0));
    let paths: Vec<String> = config.all_lamps().map(|(path, _)| path).collect();
    assert_eq!(paths, ["lamp", "lamps.lidar"]);
    let annotated = crate::annotated_toml(&config);
    assert_eq!(Config::from_toml(&annotated).expect("our own"), config);
    let chain: String = (0..17)
        .map(|i| format!("[lamps.l{i}]\nenabled = true\n"))
        .collect();
    let text = message(load("", &chain, &[]));
    assert!(text.contains("at most 16 lamps"), "{text}");
    for (file, said) in [
        ("[lamps.\"a b\"]\nlumen = 3", "a lamp's name must be"),
        ("[lamps.x]\nlumens = 3", "lamps.x.lumens"),
        ("[lamps.x]\nbeam_deg = 5", "lamps.x.beam_deg = 5"),
    ] {
        let text = message(load("", file, &[]));
        assert!(text.contains(said), "{text}");
    }
}

#[test]
fn further_cameras_are_as_the_first_but_for_what_they_say() {
    let file = "[cameras.right]\nmount_y_m = -0.12\n[camera.sensor]\nwidth_mm = 5\n\
        [cameras.rear.fov]\nhorizontal_deg = 120\n[cameras.off]\nenabled = false";
    let config = load("demo", file, &["camera.samples=3"]).expect("fine");
    let expected = crate::Camera {
        mount_y_m: -0.12,
        ..config.camera.clone()
    };
    assert_eq!(config.cameras["right"], expected);
    assert_eq!((expected.width_px, expected.samples), (160, 3));
    let fov = |c: &crate::Camera| match &c.optics {
        crate::CameraOptics::Fov(fov) => Some(fov.horizontal_deg),
        _ => None,
    };
    assert_eq!(fov(&config.cameras["right"]), None);
    assert_eq!(fov(&config.cameras["rear"]), Some(120.0));
    let wide = load(
        "",
        "[cameras.w.fov]\nhorizontal_deg = 140\n[cameras.w.fisheye]\nk1 = 0.01",
        &[],
    );
    let wide = &wide.expect("fine").cameras["w"];
    assert!(matches!(wide.lens, crate::CameraLens::Fisheye(_)));
    let paths: Vec<String> = config.all_cameras().map(|(path, _)| path).collect();
    assert_eq!(paths, ["camera", "cameras.rear", "cameras.right"]);
    assert_eq!(
        Config::from_toml(&config.to_toml()).expect("our own"),
        config
    );

    for (file, expected) in [
        (
            "[cameras.x]\nwidthpx = 3",
            "cameras.x.widthpx: no such key; did you mean `width_px`",
        ),
        ("[cameras.image_3]", "a camera's name must be"),
        ("[cameras.aux]", "cameras.aux: a camera's name must be"),
        ("[cameras.com1]", "nor a device's name on Windows"),
        ("[lidars.con]", "lidars.con: a LiDAR's name must be"),
        (
            "[cameras.top]\n[lidars.top]",
            "there is a camera of that name, cameras.top",
        ),
        (
            "camera.enabled = false\n[cameras.x]\nenabled = true",
            "cameras.x.enabled = true: must be false",
        ),
        (
            "lidar.enabled = false\n[lidars.x]\nenabled = true",
            "lidars.x.enabled = true: must be false",
        ),
        (
            "lidar.enabled = false\ncamera.enabled = false",
            "lidar.enabled = false: must be true, as camera.enabled is false",
        ),
        (
            "[cameras.x.brown_conrady]\nk1 = -0.9",
            "c.toml:2:1: cameras.x.brown_conrady.k1 = -0.9: must be such that",
        ),
        (
            "[camera.fisheye]\n[camera.pinhole]",
            "both give the camera's lens",
        ),
        ("cameras = 3", "must be a table"),
        ("[cameras]\nx = 3", "must be a table"),
    ] {
        let text = message(load("", file, &[]));
        assert!(text.contains(expected), "{file}: {text}");
    }
}

#[test]
fn further_lidars_have_the_keys_of_the_first() {
    let file =
        "[lidars.rear]\ndevice = \"mid40\"\nmount_yaw_deg = 180\n[lidars.top.lines]\nlines = 4";
    let config = load("", file, &["lidars.rear.pulses=5"]).expect("fine");
    let rear = &config.lidars["rear"];
    assert_eq!(
        (rear.pulses, rear.mount_yaw_deg, rear.min_range_m),
        (5, 180.0, 1.0)
    );
    // What the first one is told they all have, but a device's sheet lies over it.
    let told = "[lidar]\npulses = 77\nmax_range_m = 60\nmount_z_m = 2\n[lidar.lines]\nlines = 3";
    let file = format!("{told}\n{file}");
    let config = load("", &file, &[]).expect("fine");
    let (rear, top) = (&config.lidars["rear"], &config.lidars["top"]);
    let sheet = load("", "[lidar]\ndevice = \"mid40\"", &[])
        .expect("fine")
        .lidar;
    assert_eq!(
        (top.pulses, top.max_range_m, top.mount_z_m),
        (77, 60.0, 2.0)
    );
    assert_eq!((rear.pulses, rear.mount_z_m), (sheet.pulses, 2.0));
    assert_eq!(rear.pattern, sheet.pattern);
    let same_as_first = file.replace("mount_yaw_deg = 180", "pulses = 77");
    for file in [&file, &same_as_first] {
        let config = load("", file, &[]).expect("fine");
        let annotated = crate::annotated_toml(&config);
        assert_eq!(
            Config::from_toml(&annotated).expect("fine"),
            config,
            "{annotated}"
        );
    }
    let paths: Vec<String> = config.all_lidars().map(|(path, _)| path).collect();
    assert_eq!(paths, ["lidar", "lidars.rear", "lidars.top"]);
    assert_eq!(
        Config::from_toml(&config.to_toml()).expect("our own"),
        config
    );

    let text = message(load("", "[lidars.rear.noise]\nsigma = 1", &[]));
    assert!(
        text.contains("lidars.rear.noise.sigma: no such key; did you mean `sigma_m`"),
        "{text}"
    );
    let text = message(load("", "[lidars.velodyne]", &[]));
    assert!(text.contains("and none of camera, lidar"), "{text}");
    let text = message(load(
        "",
        "[lidars.x]\nmin_range_m = 5\nmax_range_m = 3",
        &[],
    ));
    assert!(
        text.contains("lidars.x.min_range_m = 5: must be below lidars.x.max_range_m = 3"),
        "{text}"
    );
}

#[test]
fn a_calibration_that_leaves_numbers_out_is_that_of_its_picture() {
    let calibration = |file: &str| match load("", file, &[]).expect("fine").camera.optics {
        CameraOptics::Calibration(c) => [c.fx_px, c.fy_px, c.cx_px, c.cy_px],
        other => panic!("{other:?}"),
    };
    let camera = "[camera]\nwidth_px = 640\nheight_px = 400\n[camera.calibration]\n";
    let with = |numbers: &str| calibration(&format!("{camera}{numbers}"));
    assert_eq!(with("fx_px = 402.4"), [402.4, 402.4, 320.0, 200.0]);
    assert_eq!(with("fy_px = 402"), [402.0, 402.0, 320.0, 200.0]);
    assert_eq!(with(""), [380.0, 380.0, 320.0, 200.0]);
    let all = "fx_px = 400.0\nfy_px = 410.0\ncx_px = 300\ncy_px = 190";
    assert_eq!(with(all), [400.0, 410.0, 300.0, 190.0]);
    // A further camera has the numbers that were said of the first, and its own picture.
    let file = format!("{camera}fx_px = 402.4\n[cameras.small]\nwidth_px = 320\nheight_px = 200");
    let config = load("", &file, &[]).expect("fine");
    let CameraOptics::Calibration(c) = &config.cameras["small"].optics else {
        panic!("a calibration");
    };
    assert_eq!(
        [c.fx_px, c.fy_px, c.cx_px, c.cy_px],
        [402.4, 402.4, 160.0, 100.0]
    );
}

#[test]
fn a_lens_that_sees_too_much_names_the_key_that_says_how_much() {
    let camera = "[camera]\nwidth_px = 640\nheight_px = 400\n[camera.fisheye]\n";
    for (optics, key) in [
        (
            "[camera.fov]\nhorizontal_deg = 160",
            "camera.fov.horizontal_deg = 160",
        ),
        (
            "[camera.calibration]\nfx_px = 229",
            "camera.calibration.fx_px = 229",
        ),
        (
            "[camera.sensor]\nfocal_length_mm = 2.57",
            "camera.sensor.focal_length_mm = 2.57",
        ),
    ] {
        let text = message(load("", &format!("{camera}{optics}"), &[]));
        assert!(text.contains(key) && text.contains("within 89°"), "{text}");
    }
}

#[test]
fn mounts_roll_to_the_right() {
    let settings = ["mount_roll_deg=90", "mount_yaw_deg=90"];
    let all: Vec<String> = ["camera", "lidar", "imu"]
        .iter()
        .flat_map(|sensor| settings.map(|s| format!("{sensor}.{s}")))
        .collect();
    let config = load("", "", &all.iter().map(|s| &**s).collect::<Vec<_>>()).expect("fine");
    // They look to the left, which is y, and their left side is up.
    let mounts = [
        config.camera.body_from_camera() * RigidTransform::body_from_optical().inverse(),
        config.lidar.body_from_lidar(),
        config.imu.body_from_imu(),
    ];
    for mount in mounts {
        assert!(mount.transform_vector(DVec3::X).distance(DVec3::Y) < 1e-12);
        assert!(mount.transform_vector(DVec3::Y).distance(DVec3::Z) < 1e-12);
    }
}
