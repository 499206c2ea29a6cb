//! TUM's RGB-D benchmark, a folder for each sensor of each sequence:
//! ```text
//! SS-NAME/rgb/12.500000.png    rgb.txt    colour
//! SS-NAME/depth/12.500000.png  depth.txt  planar depth, 16 bits, 5000 = 1 m, 0 = none
//! SS-NAME/groundtruth.txt      timestamp tx ty tz qx qy qz qw
//! SS-NAME/estimated.txt        the same as a navigation system estimates it, if there is one
//! SS-NAME/camera.txt           size, fx fy cx cy and the lens' coefficients, as OpenCV has them
//! SS-imu/accelerometer.txt     timestamp ax ay az, m/s², of the inertial measurement unit
//! ```
//! Poses are those of the sensor in the world: a camera's optical frame (x right, y down, z
//! forward), or that of a LiDAR (x forward, y left, z up), which has `groundtruth.txt` alone, or of
//! the inertial unit, whose accelerometer measures gravity, too, along the whole drive. Depth
//! beyond 13.1 m, which 16 bits cannot hold, is 0. Source: the benchmark's page "File Formats".

use nemoral_dataset::{CameraSpec, ImuReading, Manifest};
use nemoral_scene::{Image, RigidTransform};
use png::{BitDepth, ColorType};

use crate::formats::refuse_times_that_do_not_rise;
use crate::geometry::{lens, line};
use crate::{Error, Format, FrameRef, Sink, Source, png_encoding};

/// The inertial measurement unit's name, which no other sensor beside it has, and its file.
const UNIT: &str = "imu";
const ACCELEROMETER: &str = "accelerometer.txt";

/// The format.
#[derive(Debug)]
pub(crate) struct Tum;

impl Format for Tum {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        refuse_times_that_do_not_rise("tum", manifest, |a, b| b - a < 1e-6)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        for sequence in source.sequences() {
            let folder = |name: &str| format!("{:02}-{name}", sequence.number);
            for frame in source.frames(sequence.number) {
                sink.step(&format!("frame-{}", frame.name()), |files| {
                    for (i, camera) in sequence.cameras.iter().enumerate() {
                        let (folder, stamp) = (folder(&camera.name), stamp(&frame));
                        let picture = source.picture_bytes(&frame, i)?;
                        files.put(format!("{folder}/rgb/{stamp}.png"), picture);
                        let depth = encode_depth(&source.depth_m(&frame, i)?);
                        files.put(format!("{folder}/depth/{stamp}.png"), depth);
                    }
                    Ok(String::new())
                })?;
            }
            let frames: Vec<_> = source.frames(sequence.number).collect();
            let truth: Vec<_> = (frames.iter())
                .map(|frame| (stamp(frame), frame.world_from_body()))
                .collect();
            let estimated = source.estimated_world_from_body(sequence.number)?;
            // The file has a pose for each frame of the sequence, made or not.
            let estimated: Option<Vec<_>> = estimated.map(|poses| {
                let of_frame = |frame: &FrameRef<'_>| (stamp(frame), poses[frame.index as usize]);
                frames.iter().map(of_frame).collect()
            });
            sink.step(&format!("sequence-{:02}", sequence.number), |files| {
                for camera in sequence.cameras {
                    let folder = folder(&camera.name);
                    for what in ["rgb", "depth"] {
                        let list = frames.iter().map(|f| {
                            let stamp = stamp(f);
                            format!("{stamp} {what}/{stamp}.png\n")
                        });
                        let head = format!("# timestamp filename of {what} pictures\n");
                        let text = head + &list.collect::<String>();
                        files.put(format!("{folder}/{what}.txt"), text);
                    }
                    files.put(format!("{folder}/camera.txt"), intrinsics(camera));
                }
                let cameras = sequence.cameras.iter();
                let cameras = cameras.map(|c| (c.name.as_str(), c.body_from_camera));
                let lidars = sequence.lidars.iter();
                let lidars = lidars.map(|l| (l.name.as_str(), l.body_from_lidar));
                let unit = sequence.imu.map(|unit| (UNIT, unit.body_from_imu));
                for (name, mount) in cameras.chain(lidars).chain(unit) {
                    let folder = folder(name);
                    let poses = trajectory(&truth, &mount);
                    files.put(format!("{folder}/groundtruth.txt"), poses);
                    if let Some(estimated) = &estimated {
                        let poses = trajectory(estimated, &mount);
                        files.put(format!("{folder}/estimated.txt"), poses);
                    }
                }
                if sequence.imu.is_some() {
                    let readings = source.imu(sequence.number)?;
                    let path = format!("{}/{ACCELEROMETER}", folder(UNIT));
                    files.put(path, accelerations(&readings));
                }
                Ok(String::new())
            })?;
        }
        Ok(())
    }
}

/// Seconds after the start of the sequence, to a microsecond.
fn stamp(frame: &FrameRef<'_>) -> String {
    format!("{:.6}", frame.time_s)
}

/// `camera.txt`: a name and numbers a line. The first pixel's centre is at (0, 0).
fn intrinsics(camera: &CameraSpec) -> String {
    let k = &camera.intrinsics;
    let (model, coefficients) = lens(&k.distortion);
    format!(
        "# The first pixel's centre is at (0, 0); coefficients are k1 k2 p1 p2 k3, or k1 to k4 \
         of a fisheye.\nwidth {}\nheight {}\nfx {}\nfy {}\ncx {}\ncy {}\nmodel {model}\n\
         coefficients {}",
        k.width,
        k.height,
        k.fx,
        k.fy,
        k.cx - 0.5,
        k.cy - 0.5,
        line(coefficients)
    )
}

/// `accelerometer.txt`, whose times have all nanoseconds.
fn accelerations(readings: &[ImuReading]) -> String {
    let mut text = "# timestamp ax ay az\n".to_owned();
    for reading in readings {
        const NS: i64 = 1_000_000_000;
        let (s, ns) = (
            reading.time_ns.div_euclid(NS),
            reading.time_ns.rem_euclid(NS),
        );
        let force = line(reading.specific_force_m_s2.to_array());
        text += &format!("{s}.{ns:09} {force}");
    }
    text
}

fn trajectory(bodies: &[(String, RigidTransform)], body_from_sensor: &RigidTransform) -> String {
    let mut text = "# timestamp tx ty tz qx qy qz qw\n".to_owned();
    for (stamp, world_from_body) in bodies {
        let pose = *world_from_body * *body_from_sensor;
        let numbers = (pose.translation_m.to_array().into_iter()).chain(pose.rotation.to_array());
        text += &format!("{stamp} {}", line(numbers));
    }
    text
}

/// 16-bit grey, 5000 for a metre.
fn encode_depth(depth_m: &Image<f32>) -> Vec<u8> {
    let code = |&z: &f32| {
        let code = (z * 5000.0).round();
        // A surface that is too near for the first step is not nothing.
        if z > 0.0 && code <= 65535.0 {
            (code as u16).max(1)
        } else {
            0
        }
    };
    let data: Vec<u8> = (depth_m.pixels().iter())
        .flat_map(|z| code(z).to_be_bytes())
        .collect();
    let (width, height) = (depth_m.width(), depth_m.height());
    png_encoding::encode(
        width,
        height,
        ColorType::Grayscale,
        BitDepth::Sixteen,
        None,
        &data,
    )
}
