//! nerfstudio's `transforms.json`, a folder for each sequence:
//! ```text
//! SS/images/CAMERA/FFFFFF.png
//! SS/transforms.json            the cameras of the first one's kind: a lens, or a fisheye
//! SS/transforms_fisheye.json    those of the other kind, if there are any; or
//!                               transforms_lens.json
//! SS/points.ply                 points of surfaces, which trainers of Gaussian splats begin with
//! ```
//! `transform_matrix` takes points of the camera (x right, y up, z backward, as OpenGL's) to a
//! world in metres with z up, whose origin is the first camera's place at the first frame, rounded
//! to metres, and whose axes are the data set's; `origin_m` is that place. Every frame has its own
//! camera, but a file has one kind, `OPENCV` or `OPENCV_FISHEYE`, as readers take the file's for
//! all; the first pixel's centre is (0.5, 0.5). `time` is in seconds. `points.ply`, which
//! `ply_file_path` names, has up to 300 points of each picture in that world, by its depth, up to
//! 60 m away, to 0.1 mm. Source: nerfstudio's page "Data conventions".

use nemoral_dataset::{CameraSpec, Manifest};
use nemoral_scene::glam::{DQuat, DVec3};
use nemoral_scene::{Distortion, Intrinsics, RigidTransform};
use serde_json::{Value, json};

use crate::formats::colmap::{first_camera, pictures};
use crate::formats::refuse_without_cameras;
use crate::{Error, Format, Sink, Source};

/// The format.
#[derive(Debug)]
pub(crate) struct Nerfstudio;

impl Format for Nerfstudio {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        refuse_without_cameras("nerfstudio", manifest)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        for sequence in source.sequences() {
            let Some(first) = first_camera(source, &sequence) else {
                continue;
            };
            let origin = first.translation_m.round();
            let place = |pose: &RigidTransform| RigidTransform {
                translation_m: pose.translation_m - origin,
                ..*pose
            };
            let keys = pictures(source, &sequence, sink, place)?;
            let has_points = put_points(sequence.number, &keys, sink)?;
            sink.step(&format!("sequence-{:02}", sequence.number), |files| {
                let cameras = sequence.cameras.iter();
                let (fisheyes, others): (Vec<_>, Vec<_>) =
                    cameras.partition(|c| is_fisheye(&c.intrinsics));
                let is_first_fisheye = is_fisheye(&sequence.cameras[0].intrinsics);
                for (name, cameras, is_fisheye) in [
                    ("transforms_fisheye", fisheyes, true),
                    ("transforms_lens", others, false),
                ] {
                    let is_first = is_fisheye == is_first_fisheye;
                    let name = if is_first { "transforms" } else { name };
                    if !cameras.is_empty() {
                        let of = (sequence.number, origin, has_points);
                        let text = transforms(source, &cameras, of);
                        files.put(format!("{:02}/{name}.json", sequence.number), text);
                    }
                }
                Ok(String::new())
            })?;
        }
        Ok(())
    }
}

/// Writes the points that the notes of a sequence's steps list, if there are any, and says so:
/// readers fail at a file without points.
fn put_points(sequence: u32, keys: &[String], sink: &mut Sink) -> Result<bool, Error> {
    let notes = sink.notes();
    let mut count = 0;
    for key in keys {
        count += notes.of(key)?.lines().count();
    }
    if count > 0 {
        let (key, path) = (
            format!("points-{sequence:02}"),
            format!("{sequence:02}/points.ply"),
        );
        sink.stream(&key, &path, |out| {
            out.put(format!(
                "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\n\
                 property float y\nproperty float z\nproperty uchar red\n\
                 property uchar green\nproperty uchar blue\nend_header\n"
            ))?;
            keys.iter().try_for_each(|key| out.put(notes.of(key)?))
        })?;
    }
    Ok(count > 0)
}

/// The file of some cameras, which are of one kind, of a sequence with this origin, with or without
/// points.
fn transforms(
    source: &Source,
    cameras: &[&CameraSpec],
    (sequence, origin, has_points): (u32, DVec3, bool),
) -> String {
    let model = camera_model(&cameras[0].intrinsics);
    let points = if has_points {
        "\"ply_file_path\":\"points.ply\","
    } else {
        ""
    };
    let mut text = format!(
        "{{\"camera_model\":\"{model}\",\"orientation_override\":\"none\",{points}\
         \"origin_m\":{},\n\"frames\":[",
        json!(origin.to_array())
    );
    let mut comma = "\n";
    for frame in source.frames(sequence) {
        for camera in cameras {
            let pose = frame.world_from_body() * camera.body_from_camera;
            let matrix = matrix(&RigidTransform {
                translation_m: pose.translation_m - origin,
                ..pose
            });
            let mut one = camera_keys(&camera.intrinsics);
            one["file_path"] = format!("images/{}/{:06}.png", camera.name, frame.index).into();
            one["time"] = frame.time_s.into();
            one["transform_matrix"] = json!(matrix);
            text += &format!("{comma}{one}");
            comma = ",\n";
        }
    }
    text + "\n]}\n"
}

/// The pose of a camera whose axes are OpenGL's, from that of one whose axes are OpenCV's.
fn matrix(pose: &RigidTransform) -> [[f64; 4]; 4] {
    let [a, b, c] = RigidTransform {
        rotation: pose.rotation * DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
        ..*pose
    }
    .to_rows();
    [a, b, c, [0.0, 0.0, 0.0, 1.0]]
}

fn is_fisheye(k: &Intrinsics) -> bool {
    matches!(k.distortion, Distortion::Fisheye { .. })
}

fn camera_model(k: &Intrinsics) -> &'static str {
    if is_fisheye(k) {
        "OPENCV_FISHEYE"
    } else {
        "OPENCV"
    }
}

/// The keys that describe a camera.
fn camera_keys(k: &Intrinsics) -> Value {
    let mut keys = json!({
        "camera_model": camera_model(k), "w": k.width, "h": k.height,
        "fl_x": k.fx, "fl_y": k.fy, "cx": k.cx, "cy": k.cy,
    });
    match k.distortion {
        Distortion::BrownConrady { k1, k2, k3, p1, p2 } => {
            for (key, value) in [("k1", k1), ("k2", k2), ("k3", k3), ("p1", p1), ("p2", p2)] {
                keys[key] = value.into();
            }
        }
        Distortion::Fisheye { k1, k2, k3, k4 } => {
            for (key, value) in [("k1", k1), ("k2", k2), ("k3", k3), ("k4", k4)] {
                keys[key] = value.into();
            }
        }
        _ => {}
    }
    keys
}
