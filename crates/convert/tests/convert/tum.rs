//! TUM's files, read as its page describes them.

use nemoral_convert::FormatName;
use nemoral_scene::glam::{DQuat, DVec3};

use crate::common::{header, made, numbers, png, pose, text};

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
