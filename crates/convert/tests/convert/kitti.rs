//! KITTI's layout, read as its development kit describes it.

use nemoral_convert::{ConvertParams, FormatName, Table, convert};
use nemoral_scene::glam::DVec3;

use crate::common::{header, made, numbers, png, pose, text};

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
                let expected = c.intrinsics.project(seen).expect("in front");
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
fn labels_follow_a_table() {
    let made = made(FormatName::SemanticKitti);
    let by_table = made.out.with_file_name("by_table");
    let params = ConvertParams {
        ontology: Some(Table::load("semantickitti").expect("built in")),
        ..ConvertParams::new(FormatName::Kitti)
    };
    convert(made.dataset.root(), &by_table, &params).expect("converted");
    let label = "sequences/00/labels/000000.label";
    let read = made.dataset.read_frame(0).expect("a frame");
    let bytes = std::fs::read(made.out.join(label)).expect("labels");
    let ids = [0, 72, 40, 71, 70, 70, 70, 99];
    for (word, &(class, instance)) in bytes.as_chunks::<4>().0.iter().zip(&read.lidars[0].labels) {
        let word = u32::from_le_bytes(*word);
        assert_eq!(word & 0xFFFF, ids[usize::from(class)]);
        assert_eq!(word >> 16, u32::from(instance));
    }
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
    let content = yaml.split("content:\n").nth(1).expect("a section");
    let content = content.split("learning_map:").next().expect("a section");
    let shares = content.lines().filter_map(|l| l.split_once(": "));
    let sum: f64 = shares.map(|s| s.1.parse::<f64>().expect("a share")).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    let other = [label, "ontology.yaml"].map(|f| std::fs::read(by_table.join(f)).expect("a file"));
    assert_eq!(other, [bytes, yaml.into_bytes()]);
}
