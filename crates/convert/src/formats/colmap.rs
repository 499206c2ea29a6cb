//! COLMAP's text model, a folder for each sequence:
//! ```text
//! SS/images/CAMERA/FFFFFF.png
//! SS/sparse/0/cameras.txt  images.txt  points3D.txt
//! ```
//! Poses are the truth, in metres, relative to the first camera's at the first frame: the world is
//! where that camera stands, so that coordinates are small. `frame0.txt` has its pose in the data
//! set's world, a 3 × 4 matrix, row-major. `points3D.txt` is empty; COLMAP triangulates points for
//! known poses (`point_triangulator`). A camera model is `PINHOLE`, `OPENCV` or, with a sixth
//! power, `FULL_OPENCV`, or `OPENCV_FISHEYE`; the first pixel's centre is (0.5, 0.5), as ours. A
//! rolling shutter's picture has the pose of its middle row. Source: COLMAP's page "Output Format",
//! and `src/colmap/sensor/models.h`.

use nemoral_dataset::Manifest;
use nemoral_scene::glam::DQuat;
use nemoral_scene::{Distortion, Intrinsics, RigidTransform};

use crate::formats::coco::needs_cameras;
use crate::geometry::{line, relative, rows_line};
use crate::{Error, Format, Sequence, Sink, Source};

/// The format.
#[derive(Debug)]
pub(crate) struct Colmap;

impl Format for Colmap {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        needs_cameras("colmap", manifest)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        for sequence in source.sequences() {
            pictures(source, &sequence, sink)?;
            sink.step(&format!("sequence-{:02}", sequence.number), |files| {
                let Some(world_from_first) = first_camera(source, &sequence) else {
                    return Ok(String::new());
                };
                let model = format!("{:02}/sparse/0", sequence.number);
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
                let points = "# POINT3D_ID X Y Z R G B ERROR TRACK[]\n";
                files.put(format!("{model}/points3D.txt"), points);
                let folder = format!("{:02}", sequence.number);
                files.put(format!("{folder}/frame0.txt"), rows_line(&world_from_first));
                Ok(String::new())
            })?;
        }
        Ok(())
    }
}

/// Writes the pictures of a sequence, a folder for each camera.
pub(super) fn pictures(
    source: &Source,
    sequence: &Sequence<'_>,
    sink: &mut Sink,
) -> Result<(), Error> {
    for frame in source.frames(sequence.number) {
        sink.step(&format!("frame-{}", frame.name()), |files| {
            for (i, camera) in sequence.cameras.iter().enumerate() {
                let (number, name, index) = (sequence.number, &camera.name, frame.index);
                let path = format!("{number:02}/images/{name}/{index:06}.png");
                files.put(path, source.picture_bytes(&frame, i)?);
            }
            Ok(String::new())
        })?;
    }
    Ok(())
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
