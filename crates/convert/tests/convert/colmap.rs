//! COLMAP's text model and nerfstudio's transforms: a LiDAR's points land on the same pixels as by
//! the data set's own mounts and lenses.

use nemoral_convert::FormatName;
use nemoral_dataset::{CameraFrame, DatasetHeader};
use nemoral_scene::glam::{DMat4, DQuat, DVec2, DVec3, DVec4};
use nemoral_scene::{Distortion, Intrinsics};

use crate::common::{Made, header, made_of, numbers, png, pose, text};

/// Three lenses, as far as the two cameras have room for them.
fn headers() -> Vec<DatasetHeader> {
    let brown = |k3| Distortion::BrownConrady {
        k1: -0.1,
        k2: 0.02,
        k3,
        p1: 0.004,
        p2: -0.003,
    };
    let fish = Distortion::Fisheye {
        k1: -0.02,
        k2: 0.004,
        k3: -0.001,
        k4: 0.0001,
    };
    let with = |lens: Distortion| {
        let mut header = header();
        header.sequences[0].cameras[0].intrinsics =
            Intrinsics::through_lens(31, 22, 1.3, lens).expect("sound");
        header
    };
    vec![header(), with(brown(0.0)), with(brown(-0.01)), with(fish)]
}

/// OpenCV's projections, written down once more.
fn project(model: &str, k: &[f64], p: DVec3) -> DVec2 {
    let (x, y) = (p.x / p.z, p.y / p.z);
    let r2 = x * x + y * y;
    let bent = match model {
        "PINHOLE" => DVec2::new(x, y),
        "OPENCV" | "FULL_OPENCV" => {
            let [k1, k2, p1, p2] = [k[4], k[5], k[6], k[7]];
            let k3 = k.get(8).copied().unwrap_or(0.0);
            assert!(k.iter().skip(9).all(|k| *k == 0.0));
            let radial = 1.0 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
            DVec2::new(
                x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
            )
        }
        "OPENCV_FISHEYE" => {
            let r = r2.sqrt();
            let t = r.atan();
            let (t2, c) = (t * t, &k[4..8]);
            let bent = t * (1.0 + t2 * (c[0] + t2 * (c[1] + t2 * (c[2] + t2 * c[3]))));
            DVec2::new(x, y) * (bent / r)
        }
        other => panic!("{other}"),
    };
    DVec2::new(k[0] * bent.x + k[2], k[1] * bent.y + k[3])
}

/// World positions of a frame's points that a camera has in front, with their true pixels.
fn seen(made: &Made, header: &DatasetHeader, i: usize, camera: usize) -> Vec<(DVec3, DVec2)> {
    let body = pose([1, 2, 4][i]).1;
    let scan = &made.dataset.read_frame(i).expect("a frame").lidars[0].points;
    let c = &header.sequences[0].cameras[camera];
    let world_from_camera = body * c.body_from_camera;
    let points = scan.iter().filter_map(|&[x, y, z, _]| {
        let here = DVec3::new(x.into(), y.into(), z.into());
        let there = (body * header.sequences[0].lidars[0].body_from_lidar).transform_point(here);
        let in_camera = world_from_camera.inverse().transform_point(there);
        Some((there, c.intrinsics.project(in_camera)?))
    });
    points.collect()
}

#[test]
fn colmaps_poses_and_lenses_project_points_as_ours() {
    for header in headers() {
        let made = made_of(FormatName::Colmap, &header);
        let model = made.out.join("00/sparse/0");
        let cameras = text(model.join("cameras.txt"));
        let cameras: Vec<Vec<&str>> = (cameras.lines().filter(|l| !l.starts_with('#')))
            .map(|l| l.split(' ').collect())
            .collect();
        let images = text(model.join("images.txt"));
        let images: Vec<&str> = images.lines().filter(|l| !l.starts_with('#')).collect();
        assert_eq!((cameras.len(), images.len()), (2, 12));
        let own = numbers(&text(model.join("points3D.txt")));
        // Points have ids from 1, and an error of 0 without a track.
        let are_listed = |(i, row): (usize, &Vec<f64>)| {
            row.len() == 8 && row[0] == (i + 1) as f64 && row[7] == 0.0
        };
        assert!(own.iter().enumerate().all(are_listed) && own.len() > 600);
        let own: Vec<&[f64]> = own.iter().map(|row| &row[1..7]).collect();
        let mut shown = vec![false; own.len()];
        let frame0 = &numbers(&text(made.out.join("00/frame0.txt")))[0];
        let rows = |r: usize| DVec4::from_slice(&frame0[4 * r..]);
        let world_from_first = DMat4::from_cols(rows(0), rows(1), rows(2), DVec4::W).transpose();
        let first_from_world = world_from_first.inverse();
        for (i, pair) in images.chunks(2).enumerate() {
            let (frame, camera) = (i / 2, i % 2);
            let words: Vec<&str> = pair[0].split(' ').collect();
            assert_eq!((words.len(), pair[1]), (10, ""));
            let n: Vec<f64> = words[1..8]
                .iter()
                .map(|w| w.parse().expect("a number"))
                .collect();
            let turn = DQuat::from_xyzw(n[1], n[2], n[3], n[0]);
            assert_eq!(words[8], cameras[camera][0]);
            let k: Vec<f64> = (cameras[camera][4..].iter())
                .map(|w| w.parse().expect("a number"))
                .collect();
            let mut most = 0.0_f64;
            for (there, expected) in seen(&made, &header, frame, camera) {
                let in_first = first_from_world.transform_point3(there);
                let in_camera = turn * in_first + DVec3::new(n[4], n[5], n[6]);
                let found = project(cameras[camera][1], &k, in_camera);
                most = most.max(found.distance(expected));
            }
            assert!(most < 1e-6, "{most} pixels");
            let (w, h, data) = png(made.out.join("00/images").join(words[9]));
            assert_eq!((w, h), (31, 22));
            let read = made.dataset.read_frame(frame).expect("a frame");
            let read = &read.cameras[camera];
            assert_eq!(data, read.rgb.pixels().as_flattened());
            for (point, is_shown) in own.iter().zip(&mut shown) {
                let in_camera = turn * DVec3::from_slice(point) + DVec3::new(n[4], n[5], n[6]);
                let pixel = project(cameras[camera][1], &k, in_camera);
                *is_shown |= shows(read, in_camera.z, pixel, &point[3..]);
            }
        }
        assert!(shown.iter().all(|is_shown| *is_shown));
    }
}

/// Whether a picture shows a point of this depth and colour in the middle of this pixel.
fn shows(read: &CameraFrame, z_m: f64, at: DVec2, rgb: &[f64]) -> bool {
    if z_m <= 0.0 || at.min_element() < 0.0 || at.x >= 31.0 || at.y >= 22.0 {
        return false;
    }
    let (column, row) = (at.x as usize, at.y as usize);
    let is_middle = at.distance(at.floor() + 0.5) < 0.05;
    let depth_m = f64::from(*read.depth_m.at(column, row));
    let seen = read.rgb.at(column, row).map(f64::from);
    is_middle && depth_m < 60.0 && (depth_m - z_m).abs() < 1e-3 && seen == *rgb
}

#[test]
fn nerfstudios_transforms_project_points_as_ours() {
    for header in headers() {
        let made = made_of(FormatName::Nerfstudio, &header);
        // Lenses and fisheyes are in files of their own.
        let files = ["transforms", "transforms_fisheye", "transforms_lens"];
        let files = files.map(|file| made.out.join(format!("00/{file}.json")));
        let files: Vec<serde_json::Value> = (files.iter().filter(|path| path.is_file()))
            .map(|path| serde_json::from_str(&text(path)).expect("JSON"))
            .collect();
        let vector = |v: &serde_json::Value| -> Vec<f64> {
            v.as_array()
                .expect("a list")
                .iter()
                .filter_map(|n| n.as_f64())
                .collect()
        };
        let origin = DVec3::from_slice(&vector(&files[0]["origin_m"]));
        assert!(
            files
                .iter()
                .all(|file| file["ply_file_path"] == "points.ply")
        );
        let ply = text(made.out.join("00/points.ply"));
        let (head, body) = ply.split_once("end_header\n").expect("a header");
        let own = numbers(body);
        let count = format!("\nelement vertex {}\nproperty float x\n", own.len());
        assert!(own.len() > 600 && head.contains(&count), "{head}");
        let mut shown = vec![false; own.len()];
        let all = files
            .iter()
            .flat_map(|f| f["frames"].as_array().expect("frames"));
        let all: Vec<_> = all.collect();
        assert_eq!(all.len(), 6);
        let frame = |i: usize| {
            let (index, camera) = ([1, 2, 4][i / 2], &header.sequences[0].cameras[i % 2].name);
            let path = format!("images/{camera}/{index:06}.png");
            let found = all.iter().find(|one| one["file_path"] == *path);
            *found.unwrap_or_else(|| panic!("no {path}"))
        };
        for (i, one) in (0..6).map(frame).enumerate() {
            let rows = one["transform_matrix"].as_array().expect("rows");
            let rows: Vec<DVec4> = rows.iter().map(|r| DVec4::from_slice(&vector(r))).collect();
            let back = DMat4::from_cols(rows[0], rows[1], rows[2], rows[3])
                .transpose()
                .inverse();
            let get = |key: &str| one[key].as_f64().unwrap_or(0.0);
            let keys = ["fl_x", "fl_y", "cx", "cy"].map(get);
            let (model, lens) = match one["camera_model"].as_str().expect("a model") {
                "OPENCV" => ("OPENCV", vec!["k1", "k2", "p1", "p2", "k3"]),
                "OPENCV_FISHEYE" => ("OPENCV_FISHEYE", vec!["k1", "k2", "k3", "k4"]),
                other => panic!("{other}"),
            };
            let k: Vec<f64> = keys.into_iter().chain(lens.into_iter().map(get)).collect();
            assert_eq!(get("time"), pose([1, 2, 4][i / 2]).0);
            for (there, expected) in seen(&made, &header, i / 2, i % 2) {
                let gl = back.transform_point3(there - origin);
                let found = project(model, &k, DVec3::new(gl.x, -gl.y, -gl.z));
                assert!(found.distance(expected) < 1e-6, "{found} {expected}");
            }
            let read = &made.dataset.read_frame(i / 2).expect("a frame").cameras[i % 2];
            for (point, is_shown) in own.iter().zip(&mut shown) {
                let gl = back.transform_point3(DVec3::from_slice(point));
                let pixel = project(model, &k, DVec3::new(gl.x, -gl.y, -gl.z));
                *is_shown |= shows(read, -gl.z, pixel, &point[3..]);
            }
            let path = one["file_path"].as_str().expect("a path");
            assert_eq!(png(made.out.join("00").join(path)).0, 31);
        }
        assert!(shown.iter().all(|is_shown| *is_shown));
    }
}
