//! COLMAP's text model, a folder for each sequence:
//! ```text
//! SS/images/CAMERA/FFFFFF.png
//! SS/sparse/0/cameras.txt  images.txt  points3D.txt
//! ```
//! Poses are the truth, in metres, relative to the first camera's at the first frame: the world is
//! where that camera stands, so that coordinates are small. `frame0.txt` has its pose in the data
//! set's world, a 3 × 4 matrix, row-major. `points3D.txt` has up to 300 points of each picture, by
//! its depth, up to 60 m away, to 0.1 mm; they are seen in no picture (`TRACK[]` is empty), as
//! nothing was matched. COLMAP triangulates others for known poses (`point_triangulator`).
//!
//! A camera model is `PINHOLE`, `OPENCV` or, with a sixth power, `FULL_OPENCV`, or
//! `OPENCV_FISHEYE`; the first pixel's centre is (0.5, 0.5), as ours. A rolling shutter's picture
//! has the pose of its middle row. Source: COLMAP's page "Output Format", and
//! `src/colmap/sensor/models.h`.

use nemoral_dataset::Manifest;
use nemoral_scene::glam::DQuat;
use nemoral_scene::{Distortion, Intrinsics, RigidTransform};

use crate::formats::{points, refuse_without_cameras};
use crate::geometry::{line, relative, rows_line};
use crate::{Error, Format, Sequence, Sink, Source};

/// The format.
#[derive(Debug)]
pub(crate) struct Colmap;

impl Format for Colmap {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        refuse_without_cameras("colmap", manifest)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        for sequence in source.sequences() {
            let Some(world_from_first) = first_camera(source, &sequence) else {
                continue;
            };
            let place = |pose: &RigidTransform| relative(&world_from_first, pose);
            let keys = pictures(source, &sequence, sink, place)?;
            let model = format!("{:02}/sparse/0", sequence.number);
            sink.step(&format!("sequence-{:02}", sequence.number), |files| {
                let mut cameras = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n".to_owned();
                for (i, camera) in sequence.cameras.iter().enumerate() {
                    let k = &camera.intrinsics;
                    let (name, parameters) = model_of(k);
                    let parameters = line(parameters);
                    let (id, width, height) = (i + 1, k.width, k.height);
                    cameras += &format!("{id} {name} {width} {height} {parameters}");
                }
                files.put(format!("{model}/cameras.txt"), cameras);
                let mut images = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n\
                                  # POINTS2D[] as X Y POINT3D_ID\n"
                    .to_owned();
                let mut id = 0;
                for frame in source.frames(sequence.number) {
                    for (i, camera) in sequence.cameras.iter().enumerate() {
                        id += 1;
                        let pose = frame.world_from_body() * camera.body_from_camera;
                        let camera_from_first = relative(&pose, &world_from_first);
                        let DQuat { x, y, z, w } = camera_from_first.rotation;
                        let t = camera_from_first.translation_m;
                        let numbers = line([w, x, y, z, t.x, t.y, t.z]);
                        let (name, index) = (&camera.name, frame.index);
                        // An image without matched points has an empty second line.
                        images += &format!(
                            "{id} {} {} {name}/{index:06}.png\n\n",
                            numbers.trim_end(),
                            i + 1
                        );
                    }
                }
                files.put(format!("{model}/images.txt"), images);
                let folder = format!("{:02}", sequence.number);
                files.put(format!("{folder}/frame0.txt"), rows_line(&world_from_first));
                Ok(String::new())
            })?;
            let (key, notes) = (format!("points-{:02}", sequence.number), sink.notes());
            sink.stream(&key, &format!("{model}/points3D.txt"), |out| {
                out.put("# POINT3D_ID X Y Z R G B ERROR TRACK[]\n")?;
                let mut id = 0_u64;
                for key in &keys {
                    let mut rows = String::new();
                    for point in notes.of(key)?.lines() {
                        id += 1;
                        rows += &format!("{id} {point} 0\n");
                    }
                    out.put(rows)?;
                }
                Ok(())
            })?;
        }
        Ok(())
    }
}

/// Writes the pictures of a sequence, a folder for each camera. Returns the keys of the steps,
/// whose notes are the pictures' [`points::lines`]. `place` turns a camera's pose in the world into
/// that in the frame that they are in.
pub(super) fn pictures(
    source: &Source,
    sequence: &Sequence<'_>,
    sink: &mut Sink,
    place: impl Fn(&RigidTransform) -> RigidTransform,
) -> Result<Vec<String>, Error> {
    let mut keys = Vec::new();
    for frame in source.frames(sequence.number) {
        let key = format!("frame-{}", frame.name());
        sink.step(&key, |files| {
            let mut points = String::new();
            for (i, camera) in sequence.cameras.iter().enumerate() {
                let (number, name, index) = (sequence.number, &camera.name, frame.index);
                let path = format!("{number:02}/images/{name}/{index:06}.png");
                files.put(path, source.picture_bytes(&frame, i)?);
                let pose = place(&(frame.world_from_body() * camera.body_from_camera));
                let (rgb, depth_m) = (source.picture(&frame, i)?, source.depth_m(&frame, i)?);
                points += &points::lines(&camera.intrinsics, &rgb, &depth_m, &pose);
            }
            Ok(points)
        })?;
        keys.push(key);
    }
    Ok(keys)
}

/// The first camera's pose in the world at the first frame that exists.
pub(super) fn first_camera(source: &Source, sequence: &Sequence<'_>) -> Option<RigidTransform> {
    let camera = sequence.cameras.first()?;
    let frame = source.frames(sequence.number).next()?;
    Some(frame.world_from_body() * camera.body_from_camera)
}

/// A camera model's name and parameters, as COLMAP and nerfstudio know it.
pub(super) fn model_of(k: &Intrinsics) -> (&'static str, Vec<f64>) {
    let mut all = vec![k.fx, k.fy, k.cx, k.cy];
    let name = match k.distortion {
        Distortion::BrownConrady {
            k1,
            k2,
            k3: 0.0,
            p1,
            p2,
        } => {
            all.extend([k1, k2, p1, p2]);
            "OPENCV"
        }
        Distortion::BrownConrady { k1, k2, k3, p1, p2 } => {
            all.extend([k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]);
            "FULL_OPENCV"
        }
        Distortion::Fisheye { k1, k2, k3, k4 } => {
            all.extend([k1, k2, k3, k4]);
            "OPENCV_FISHEYE"
        }
        _ => "PINHOLE",
    };
    (name, all)
}
