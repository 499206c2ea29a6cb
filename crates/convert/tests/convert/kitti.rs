//! KITTI's layout, read as its development kit describes it.

use nemoral_convert::{ClassMapping, ConvertParams, FormatName, convert};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{Distortion, Semantic};

use crate::common::{header, made, made_of, numbers, png, pose, text};

#[test]
fn points_poses_and_calibration_are_those_of_the_data_set() {
    let made = made(FormatName::Kitti);
    let sequence = made.out.join("sequences/00");
    let header = header();
    let (camera, lidar) = (
        &header.sequences[0].cameras[0],
        &header.sequences[0].lidars[0],
    );
    let poses = numbers(&text(made.out.join("poses/00.txt")));
    let times = numbers(&text(sequence.join("times.txt")));
    assert_eq!(times.concat(), [0.0, 0.5, 1.5]);
    let calib = text(sequence.join("calib.txt"));
    let matrix = |name: &str| {
        let line = calib
            .lines()
            .find_map(|l| l.strip_prefix(&format!("{name}: ")));
        numbers(line.expect(name))[0].clone()
    };
    assert!(calib.lines().all(|l| l.matches(':').count() == 1));
    let apply = |m: &[f64], p: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|r| {
            m[4 * r] * p[0] + m[4 * r + 1] * p[1] + m[4 * r + 2] * p[2] + m[4 * r + 3]
        })
    };
    let first = pose(1).1 * camera.body_from_camera;
    for (i, frame) in [1_u64, 2, 4].into_iter().enumerate() {
        let bytes = std::fs::read(sequence.join(format!("velodyne/{i:06}.bin"))).expect("a scan");
        let read = made.dataset.read_frame(i).expect("a frame");
        let floats: Vec<f32> = bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b))
            .collect();
        assert_eq!(floats, read.lidars[0].points.as_flattened());
        // A point goes to the first frame's camera by file as it does by mounts and poses.
        for point in floats.chunks(4).step_by(17) {
            let point: [f64; 3] = std::array::from_fn(|i| f64::from(point[i]));
            let by_file = apply(&poses[i], apply(&matrix("Tr"), point));
            let world_from_lidar = pose(frame).1 * lidar.body_from_lidar;
            let in_world = world_from_lidar.transform_point(DVec3::from_array(point));
            let expected = first.inverse().transform_point(in_world);
            assert!(DVec3::from_array(by_file).distance(expected) < 1e-8);
            // And it is projected to the same pixels, left and right.
            for (p, camera) in [("P2", 0), ("P0", 0), ("P3", 1), ("P1", 1)] {
                let c = &header.sequences[0].cameras[camera];
                let [u, v, w] = apply(&matrix(p), apply(&matrix("Tr"), point));
                let body = lidar
                    .body_from_lidar
                    .transform_point(DVec3::from_array(point));
                let seen = c.body_from_camera.inverse().transform_point(body);
                // There the first pixel's centre is at (0, 0), as OpenCV has it.
                let expected = c.intrinsics.project(seen).expect("in front") - 0.5;
                assert!((u / w - expected.x).hypot(v / w - expected.y) < 1e-8, "{p}");
            }
        }
        for (grey, colour, camera) in [("image_0", "image_2", 0), ("image_1", "image_3", 1)] {
            let rgb = &read.cameras[camera].rgb;
            let (w, h, data) = png(sequence.join(format!("{colour}/{i:06}.png")));
            assert_eq!((w, h, &*data), (31, 22, rgb.pixels().as_flattened()));
            let (_, _, data) = png(sequence.join(format!("{grey}/{i:06}.png")));
            for (&found, [r, g, b]) in data.iter().zip(rgb.pixels()) {
                let [r, g, b] = [r, g, b].map(|&c| f64::from(c));
                let luma = 0.299 * r + 0.587 * g + 0.114 * b;
                assert!((f64::from(found) - luma).abs() <= 0.5 + 1e-9);
            }
        }
        let bytes = std::fs::read(sequence.join(format!("labels/{i:06}.label"))).expect("labels");
        let words = bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| u32::from_le_bytes(*b));
        let labels: Vec<_> = words.map(|w| (w as u16, (w >> 16) as u16)).collect();
        assert_eq!(labels, read.lidars[0].labels);
    }
    assert_eq!((made.done.frames, made.done.files), (3, 3 * 6 + 5));
    let own = text(made.dataset.root().join("ontology.yaml"));
    assert_eq!(text(made.out.join("ontology.yaml")), own);
}

#[test]
fn lenses_are_in_the_calibration() {
    let mut header = header();
    let cameras = &mut header.sequences[0].cameras;
    let [k1, k2, k3, p1, p2] = [-0.15, 0.03, 0.001, 0.002, -0.004];
    cameras[0].intrinsics.distortion = Distortion::BrownConrady { k1, k2, k3, p1, p2 };
    let [k1, k2, k3, k4] = [0.02, 0.003, -0.001, 0.0005];
    cameras[1].intrinsics.distortion = Distortion::Fisheye { k1, k2, k3, k4 };
    let made = made_of(FormatName::Kitti, &header);
    let calib = text(made.out.join("sequences/00/calib.txt"));
    for line in [
        "\nD2: -0.15 0.03 0.002 -0.004 0.001 0 0 0 0 0 0 0\n",
        "\nF3: 0.02 0.003 -0.001 0.0005 0 0 0 0 0 0 0 0\n",
    ] {
        assert!(calib.contains(line), "{calib}");
    }
    let made = made_of(FormatName::Tum, &header);
    let camera = text(made.out.join("00-front/camera.txt"));
    assert!(camera.contains("\nwidth 31\nheight 22\n"), "{camera}");
    let lens = "\nmodel brown_conrady\ncoefficients -0.15 0.03 0.002 -0.004 0.001\n";
    assert!(camera.contains(lens), "{camera}");
    assert!(camera.contains("\ncx 15\ncy 10.5\n"), "{camera}");
}

#[test]
fn labels_follow_a_table() {
    let made = made(FormatName::SemanticKitti);
    let by_table = made.out.with_file_name("by_table");
    let params = ConvertParams {
        ontology: Some(ClassMapping::load("semantickitti").expect("built in")),
        ..ConvertParams::new(FormatName::Kitti)
    };
    convert(made.dataset.root(), &by_table, &params).expect("converted");
    let label = "sequences/00/labels/000000.label";
    let read = made.dataset.read_frame(0).expect("a frame");
    let bytes = std::fs::read(made.out.join(label)).expect("labels");
    let ids = [0, 72, 40, 71, 70, 70, 70, 99];
    let (words, scan) = (bytes.as_chunks::<4>().0, &read.lidars[0]);
    assert_eq!(words.len(), scan.labels.len());
    let mut of_grass = 0;
    for (word, (&(class, instance), fine)) in words.iter().zip(scan.labels.iter().zip(&scan.ply)) {
        let word = u32::from_le_bytes(*word);
        // What scans know besides their class: grass is no other low plant.
        let is_grass = fine.point.semantic == Semantic::Grass;
        let id = if is_grass {
            72
        } else {
            ids[usize::from(class)]
        };
        assert_eq!(word & 0xFFFF, id);
        assert_eq!(word >> 16, u32::from(instance));
        of_grass += usize::from(is_grass);
    }
    assert!(of_grass > 0);
    let yaml = text(made.out.join("ontology.yaml"));
    for said in [
        "\n  71: \"trunk\"\n",
        "\n  10: \"car\"\n",
        "\n  0: 0\n",
        "\n  10: 0\n",
        "\n  train: [0]\n",
    ] {
        assert!(yaml.contains(said), "{said:?} is not in {yaml}");
    }
    let all: f64 = (0..3)
        .map(|i| {
            made.dataset.read_frame(i).expect("a frame").lidars[0]
                .ply
                .len() as f64
        })
        .sum();
    let content = yaml.split("content:\n").nth(1).expect("a section");
    let content = content.split("learning_map:").next().expect("a section");
    let shares = content.lines().filter_map(|l| l.split_once(": "));
    let sum: f64 = shares.map(|s| s.1.parse::<f64>().expect("a share")).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{sum} of {all} points");
    let other = [label, "ontology.yaml"].map(|f| std::fs::read(by_table.join(f)).expect("a file"));
    assert_eq!(other, [bytes, yaml.into_bytes()]);
}
