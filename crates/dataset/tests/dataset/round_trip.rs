//! Everything that is written comes back, also through a second reader written from the formats'
//! specifications.

use std::fs;
use std::path::Path;

use crate::common::{header, opened, see, small, write};
use nemoral_dataset::{Agreement, Dataset, DepthFormat, FrameData, OpenMode, Writer, stats};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{AnnotationKinds, Distortion, Intrinsics, Ontology, RigidTransform, Shutter};

#[test]
fn a_data_set_comes_back() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = header();
    let dataset = write(dir.path(), &header, &[0, 1, 3]);
    assert_eq!(dataset.manifest().header, opened(&header));
    let config = dataset.sequence_config(0).expect("a config");
    assert_eq!(config, header.sequences[0].config_toml);
    assert_eq!(dataset.manifest().tracks[0].frames, [[0, 2], [3, 4]]);
    assert_eq!(dataset.manifest().tracks[0].length, 4);
    for (i, k) in [0, 1, 3].into_iter().enumerate() {
        let (seen, frame) = (see(&header, k), dataset.read_frame(i).expect("frame"));
        let (camera, truth) = (&frame.cameras[0], &seen.truth[0]);
        assert_eq!(camera.rgb, seen.rgb[0]);
        assert_eq!(
            camera.semantic,
            truth.semantic.map(|&s| header.ontology.class(s).id)
        );
        assert_eq!(camera.instance, truth.object.map(|o| o.to_image_id()));
        for (a, b) in camera.depth_m.pixels().iter().zip(truth.depth_m.pixels()) {
            assert!((a - b).abs() <= 0.5 / 256.0 + 1e-5 && (*a == 0.0) == (*b == 0.0));
        }
        for (a, b) in camera.normal.pixels().iter().zip(truth.normal.pixels()) {
            assert!(a == b || a.angle_between(*b).to_degrees() < 0.4);
        }
        let (scan, points) = (&frame.lidars[0], &seen.points[0]);
        assert!(points.len() > 10_000);
        assert!(scan.ply.iter().map(|p| p.point).eq(points.iter().copied()));
        for ((p, bin), (label, ply)) in points
            .iter()
            .zip(&scan.points)
            .zip(scan.labels.iter().zip(&scan.ply))
        {
            assert_eq!(
                bin,
                &[p.position_m.x, p.position_m.y, p.position_m.z, p.intensity]
            );
            let expected = (
                u16::from(header.ontology.class(p.semantic).id),
                p.object.to_label_id(seen.chunk),
            );
            assert_eq!(
                (*label, u16::from(ply.class), ply.label),
                (expected, expected.0, expected.1)
            );
        }
    }
    assert_eq!(dataset.trees(0).expect("trees"), crate::common::trees());
    assert_eq!(
        dataset.objects(0).expect("objects"),
        crate::common::objects()
    );
    assert!(dataset.read_frame(3).is_err());
    assert!(!dir.path().join(".nemoral").exists());
}

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

/// Reads PLY by its specification, as far as scalars in one element need it.
fn read_ply(bytes: &[u8]) -> Vec<Vec<(String, f64)>> {
    let end = b"end_header\n";
    let at = bytes
        .windows(end.len())
        .position(|w| w == end)
        .expect("a header")
        + end.len();
    let text = std::str::from_utf8(&bytes[..at]).expect("ascii");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("ply"));
    assert_eq!(lines.next(), Some("format binary_little_endian 1.0"));
    let (mut count, mut fields) = (0, Vec::new());
    for line in lines {
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["element", "vertex", n] => count = n.parse().expect("a count"),
            ["property", kind, name] => fields.push((kind, name)),
            ["comment", ..] | ["end_header"] => {}
            ref other => panic!("{other:?}"),
        }
    }
    let mut data = &bytes[at..];
    let mut take = |n: usize| {
        let (head, tail) = data.split_at(n);
        data = tail;
        head
    };
    let mut rows = Vec::new();
    for _ in 0..count {
        let mut row = Vec::new();
        for (kind, name) in &fields {
            let value = match *kind {
                "uchar" => f64::from(take(1)[0]),
                "double" => f64::from_le_bytes(take(8).try_into().expect("8")),
                "int" => f64::from(i32::from_le_bytes(take(4).try_into().expect("4"))),
                "float" => f64::from(f32::from_le_bytes(take(4).try_into().expect("4"))),
                other => panic!("{other}"),
            };
            row.push(((*name).to_owned(), value));
        }
        rows.push(row);
    }
    assert!(data.is_empty());
    rows
}

#[test]
fn a_second_reader_sees_the_same_points() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = small();
    write(dir.path(), &header, &[1]);
    let (seen, at) = (see(&header, 1), dir.path().join("sequences/00"));
    let bin = std::fs::read(at.join("velodyne/000001.bin")).expect("bin");
    let label = std::fs::read(at.join("labels/000001.label")).expect("label");
    let ply = read_ply(&std::fs::read(at.join("points/000001.ply")).expect("ply"));
    let points = &seen.points[0];
    assert_eq!(
        (bin.len(), label.len(), ply.len()),
        (16 * points.len(), 4 * points.len(), points.len())
    );
    for (i, p) in points.iter().enumerate() {
        let float =
            |k: usize| f32::from_le_bytes(bin[16 * i + 4 * k..][..4].try_into().expect("4"));
        assert_eq!(
            [float(0), float(1), float(2), float(3)],
            [p.position_m.x, p.position_m.y, p.position_m.z, p.intensity]
        );
        let word = u32::from_le_bytes(label[4 * i..][..4].try_into().expect("4"));
        let class = u32::from(header.ontology.class(p.semantic).id);
        assert_eq!(
            word,
            class | u32::from(p.object.to_label_id(seen.chunk)) << 16
        );
        let expected = [
            ("x", f64::from(p.position_m.x)),
            ("y", f64::from(p.position_m.y)),
            ("z", f64::from(p.position_m.z)),
            ("range", f64::from(p.range_m)),
            ("range_true", f64::from(p.true_range_m)),
            ("intensity", f64::from(p.intensity)),
            ("reflectivity", f64::from(p.reflectivity)),
            ("class", f64::from(class)),
            ("semantic", f64::from(p.semantic as u8)),
            ("chunk_x", f64::from(p.object.chunk().x)),
            ("chunk_y", f64::from(p.object.chunk().y)),
            ("item", f64::from(p.object.item())),
            ("label_instance", f64::from(word >> 16)),
            ("ring", f64::from(p.ring)),
            ("return_no", f64::from(p.return_number)),
            ("n_returns", f64::from(p.returns)),
            ("t", p.time_ns as f64 / 1e9),
            ("pulse", f64::from(p.pulse)),
            ("incidence_cos", f64::from(p.incidence_cos)),
            ("nx", f64::from(p.normal.x)),
            ("ny", f64::from(p.normal.y)),
            ("nz", f64::from(p.normal.z)),
            ("flags", f64::from(p.flags.0)),
        ];
        assert!(
            ply[i].iter().map(|(n, v)| (n.as_str(), *v)).eq(expected),
            "{:?}",
            ply[i]
        );
    }
}

#[test]
fn images_look_right_to_an_ordinary_viewer() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = small();
    write(dir.path(), &header, &[0]);
    let seen = see(&header, 0);
    let open = |folder: &str| {
        image::open(dir.path().join(format!("sequences/00/{folder}/000000.png"))).expect("an image")
    };
    let truth = &seen.truth[0];
    // The colours of the palette are those of the classes.
    let colours = open("semantic").into_rgb8();
    for (s, c) in truth.semantic.pixels().iter().zip(colours.pixels()) {
        assert_eq!(c.0, header.ontology.class(*s).colour);
    }
    let ids = open("instance").into_rgb8();
    for (o, c) in truth.object.pixels().iter().zip(ids.pixels()) {
        let [r, g, b] = c.0.map(u32::from);
        assert_eq!(o.to_image_id(), r + 256 * g + 65536 * b);
    }
    let depth = open("depth");
    assert_eq!(depth.color(), image::ColorType::L16);
    for (z, d) in truth
        .depth_m
        .pixels()
        .iter()
        .zip(depth.into_luma16().pixels())
    {
        assert_eq!(f32::from(d.0[0]), (z * 256.0).round());
    }
    let normals = open("normals").into_rgb8();
    for (n, c) in truth.normal.pixels().iter().zip(normals.pixels()) {
        let code = |v: f32| (127.5 * (v + 1.0)).round() as u8;
        let expected = if n.length() == 0.0 {
            [0; 3]
        } else {
            n.to_array().map(code)
        };
        assert_eq!(c.0, expected);
    }
    assert_eq!(
        open("image_2").into_rgb8().into_raw(),
        seen.rgb[0].pixels().as_flattened()
    );
}

#[test]
fn float_depth_keeps_every_bit() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut header = small();
    header.sequences[0].depth_format = DepthFormat::Npy;
    let dataset = write(dir.path(), &header, &[0]);
    let frame = dataset.read_frame(0).expect("frame");
    assert_eq!(frame.cameras[0].depth_m, see(&header, 0).truth[0].depth_m);
    assert!(dir.path().join("sequences/00/depth/000000.npy").exists());
    assert!(!dir.path().join("sequences/00/depth/000000.png").exists());
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

#[test]
fn further_truth_comes_back_and_lies_are_found() {
    let dir = tempfile::tempdir().expect("a folder");
    let mut header = small();
    header.sequences[0].cameras[0].intrinsics = Intrinsics::from_fov(96, 72, 1.3).expect("valid");
    header.sequences[0].cameras[0].annotations = AnnotationKinds {
        sky: true,
        flow: true,
        trunks: true,
        boxes: true,
        radiance: true,
    };
    let dataset = write(&dir.path().join("sound"), &header, &[0, 1]);
    let (seen, frame) = (see(&header, 0), dataset.read_frame(0).expect("frame"));
    let (camera, annotations) = (&frame.cameras[0], &seen.annotations[0]);
    let sky = camera.sky.as_ref().expect("asked for");
    assert_eq!(
        *sky,
        seen.truth[0]
            .depth_m
            .map(|&z| if z == 0.0 { 255 } else { 0 })
    );
    let trunks = annotations
        .trunks
        .as_ref()
        .map(|t| t.map(|o| o.to_image_id()));
    assert_eq!(camera.trunks, trunks);
    let (found, made) = (camera.flow.as_ref(), annotations.flow.as_ref());
    let pairs = found.expect("asked for").pixels().iter();
    let mut hidden = 0;
    for (a, b) in pairs.zip(made.expect("made").pixels()) {
        assert_eq!(a.map(|f| f.seen), b.map(|f| f.seen));
        if let (Some(a), Some(b)) = (a, b) {
            assert!((a.offset_px - b.offset_px).abs().max_element() < 0.01);
            hidden += usize::from(!a.seen);
        }
    }
    assert!(hidden > 50);
    let (found, made) = (camera.boxes.as_ref(), annotations.boxes.as_ref());
    let (found, made) = (found.expect("asked for"), made.expect("made"));
    assert_eq!(found.len(), made.len());
    for (a, b) in found.iter().zip(made) {
        assert_eq!(
            (a.object, a.kind, a.visible, a.whole),
            (b.object, b.kind, b.visible, b.whole)
        );
        assert_eq!((a.visible_px, a.whole_px), (b.visible_px, b.whole_px));
        assert!(a.centre_m.distance(b.centre_m) < 1e-3);
    }
    assert!(found.iter().any(|b| b.visible_fraction() < 0.9));
    assert_eq!(camera.radiance.as_ref(), Some(&seen.radiance[0]));
    let report = nemoral_dataset::check(dataset.root()).expect("check");
    assert!(report.passed(), "{report}");

    // False values, each of which must be found in its file.
    let lie = |name: &str, change: &dyn Fn(&mut nemoral_scene::Annotations)| {
        let out = dir.path().join(name);
        let writer = Writer::create(&out, OpenMode::Fresh, header.clone()).expect("create");
        let mut seen = see(&header, 0);
        change(&mut seen.annotations[0]);
        writer.write_frame(&seen.data(&header)).expect("frame");
        crate::common::finish(writer, 4);
        let report = nemoral_dataset::check(&out).expect("check").to_string();
        assert!(
            report.contains(&format!("problem: sequences/00/{name}/000000")),
            "{report}"
        );
    };
    lie("flow", &|e| {
        let flow = e.flow.take().expect("made");
        e.flow = Some(flow.map(|f| {
            f.map(|mut f| {
                f.offset_px.x += 0.5;
                f
            })
        }));
    });
    lie("trunks", &|e| {
        let trunks = e.trunks.take().expect("made");
        let mut pixels = trunks.pixels().to_vec();
        pixels.rotate_right(1);
        e.trunks = Some(nemoral_scene::Image::new(96, 72, pixels));
    });
    lie("boxes", &|e| {
        let boxes = e.boxes.as_mut().expect("made");
        let seen = boxes.iter_mut().find(|b| b.visible_px > 1);
        seen.expect("some").visible_px -= 1;
    });
    let at = dataset.root().join("sequences/00/sky");
    fs::copy(at.join("000001.png"), at.join("000000.png")).expect("copy");
    crate::common::reseal(dataset.root(), "sequences/00/sky/000000.png");
    let report = nemoral_dataset::check(dataset.root())
        .expect("check")
        .to_string();
    assert!(report.contains("contradict the depth image"), "{report}");

    // A picture that does not follow its light, and light that is negative.
    for (name, change) in [("a lower one", 0.5_f32), ("below 0", -1.0)] {
        let out = dir.path().join(name);
        let writer = Writer::create(&out, OpenMode::Fresh, header.clone()).expect("create");
        let mut seen = see(&header, 0);
        let mut light = seen.radiance[0].clone().into_pixels();
        let lit = light.iter().position(|c| c.y > 100.0).expect("some");
        light[lit].y *= change;
        seen.radiance[0] = nemoral_scene::Image::new(96, 72, light);
        writer.write_frame(&seen.data(&header)).expect("frame");
        crate::common::finish(writer, 4);
        let report = nemoral_dataset::check(&out).expect("check").to_string();
        let file = "problem: sequences/00/radiance/000000.exr";
        assert!(report.contains(file) && report.contains(name), "{report}");
    }

    // What the header asks for must be given.
    let writer = Writer::create(&dir.path().join("less"), OpenMode::Fresh, header.clone());
    let mut seen = see(&header, 0);
    seen.annotations[0].flow = None;
    let e = writer.expect("create").write_frame(&seen.data(&header));
    assert!(e.expect_err("refused").to_string().contains("front.flow"));
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

#[test]
fn impossible_headers_and_frames_are_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("x");
    let refused = |change: &dyn Fn(&mut nemoral_dataset::DatasetHeader)| {
        let mut header = small();
        change(&mut header);
        Writer::create(&out, OpenMode::Fresh, header)
            .expect_err("refused")
            .to_string()
    };
    assert!(refused(&|h| h.sequences[0].cameras[0].name = "../x".to_owned()).contains("'../x'"));
    assert!(
        refused(&|h| h.sequences[0].cameras[0].name = "velodyne".to_owned()).contains("velodyne")
    );
    assert!(refused(&|h| h.sequences[0].lidars[0].name = "front".to_owned()).contains("unique"));
    assert!(refused(&|h| h.sequences[0].chunk_size_m = f64::NAN).contains("chunk_size_m"));
    let long = "#".repeat((4 << 20) + 1);
    for told in [
        refused(&|h| h.config_toml = long.clone()),
        refused(&|h| h.sequences[0].config_toml = long.clone()),
    ] {
        assert!(told.contains("config.toml = 4194305: must be"), "{told}");
    }
    assert!(
        refused(&|h| h.sequences[0].lidars[0].body_from_lidar.translation_m.x = f64::NAN)
            .contains("top.mount")
    );
    assert!(
        refused(&|h| {
            h.sequences[0].lidars.clear();
            h.sequences[0].cameras.clear();
        })
        .contains("at least one")
    );
    assert!(!out.exists());

    let header = small();
    let writer = Writer::create(&out, OpenMode::Fresh, header.clone()).expect("create");
    let seen = see(&crate::common::header(), 0);
    let e = writer.write_frame(&seen.data(&header)).expect_err("size");
    assert!(
        e.to_string()
            .contains("frame 0.front.rgb = 320 × 240: must be 32 × 24"),
        "{e}"
    );
    let seen = see(&header, 0);
    let mut frame = seen.data(&header);
    frame.lidars.clear();
    assert!(
        writer
            .write_frame(&frame)
            .expect_err("no scan")
            .to_string()
            .contains("lidars")
    );
    // What could not be listed at the end is refused at the beginning.
    type Lie<'a> = (&'a str, &'a dyn Fn(&mut FrameData<'_>));
    let lies: [Lie<'_>; 5] = [
        ("time_s = 1700000000000000000: ", &|f| f.time_s = 1.7e18),
        ("time_s = NaN: ", &|f| f.time_s = f64::NAN),
        ("world_from_body", &|f| {
            f.world_from_body.translation_m.x = 1.7e18
        }),
        ("body_motion", &|f| {
            f.body_motion.linear_m_s.y = f64::INFINITY
        }),
        ("must be less than 10000000", &|f| f.index = 10_000_000),
    ];
    for (told, lie) in lies {
        let mut frame = seen.data(&header);
        lie(&mut frame);
        let e = writer.write_frame(&frame).expect_err(told).to_string();
        assert!(e.contains(told), "{e}");
    }
    assert!(writer.frames().is_empty() && !out.join("sequences").exists());
    let mut frame = seen.data(&header);
    frame.world_from_body.translation_m.x += 1.0;
    writer.write_frame(&frame).expect("written");
    let world = nemoral_dataset::WorldTables::default();
    let e = writer
        .write_sequence(&crate::common::track(4), &world)
        .expect_err("another pose");
    assert!(e.to_string().contains("pose of frame 0"), "{e}");
}

#[test]
fn statistics_are_counted_right() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = small();
    write(dir.path(), &header, &[0, 2]);
    let s = stats(dir.path()).expect("stats");
    let seen = [see(&header, 0), see(&header, 2)];
    for c in &s.classes {
        let of = |s| header.ontology.class(s).id == c.id;
        let pixels = seen
            .iter()
            .flat_map(|f| f.truth[0].semantic.pixels())
            .filter(|s| of(**s))
            .count();
        let points = seen
            .iter()
            .flat_map(|f| &f.points[0])
            .filter(|p| of(p.semantic))
            .count();
        assert_eq!(
            (c.pixels, c.points),
            (pixels as u64, points as u64),
            "{}",
            c.name
        );
    }
    let depths = seen.iter().flat_map(|f| f.truth[0].depth_m.pixels());
    let farthest = depths.fold(0.0_f32, |a, &b| a.max(b));
    assert!((s.depth_m.expect("depth").max - f64::from(farthest)).abs() < 0.01);
    let files = crate::common::tree(dir.path());
    let size: usize = files
        .iter()
        .filter(|(p, _)| p != &Path::new("dataset.json"))
        .map(|(_, b)| b.len())
        .sum();
    assert_eq!((s.frames, s.trees, s.bytes), (2, 2, size as u64));
    let dbh = s.dbh_m.expect("trees");
    assert!((dbh.min - 0.2).abs() < 1e-12 && (dbh.max - 0.3).abs() < 1e-12);
    println!("{s}");
}

#[test]
fn the_second_opening_of_a_manifest_is_the_first() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = small();
    let writer = Writer::create(dir.path(), OpenMode::Fresh, header.clone()).expect("create");
    writer
        .write_frame(&see(&header, 0).data(&header))
        .expect("frame");
    let mut written = crate::common::finish(writer, 4);
    written.header = opened(&written.header);
    assert_eq!(
        Dataset::open(dir.path()).expect("open").manifest(),
        &written
    );
    let json = std::fs::read_to_string(dir.path().join("dataset.json")).expect("json");
    assert!(json.contains("\"seed\": 18446744073709551609"), "{json}");
}
