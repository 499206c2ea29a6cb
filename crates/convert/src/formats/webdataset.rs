//! WebDataset: tar files of up to 100 frames, none of two sequences:
//! ```text
//! SS-000000.tar                        SPLIT-SS-000000.tar if the data set is split
//!   SS_FFFFFF.json                     split, time, pose of the body in the world, and of each
//!                                      sensor, lenses, names of classes
//!   SS_FFFFFF.CAMERA.rgb.png           and .instance.png, .normals.png: as they are
//!   SS_FFFFFF.CAMERA.semantic.png      8-bit grey: class ids
//!   SS_FFFFFF.CAMERA.depth.npy         planar depth, float32, metres; 0 = none, +Inf = farther
//!                                      than the data set can say
//!   SS_FFFFFF.LIDAR.points.npy         float32, a row for each point: x, y, z, intensity
//!   SS_FFFFFF.LIDAR.labels.npy         uint16, a row for each point: class, instance
//! ```
//! Class ids are grey, as WebDataset's decoders make RGB or grey of every picture, which turns the
//! data set's palette into colours. `cx` and `cy` are in pixels, and the first pixel's centre is at
//! (0.5, 0.5); `lens` is `pinhole`, `brown_conrady` or `fisheye`, and `distortion` has its
//! coefficients by names such as `fisheye.k1`. Owners, modes and times of the members are constant.
//! Source: WebDataset's page "The WebDataset Format"; POSIX.1-1988, `ustar`; NumPy's page "NPY
//! format".

use nemoral_dataset::{CameraFile, Split};
use nemoral_scene::RigidTransform;
use serde_json::{Map, Value, json};

use crate::geometry::lens;
use crate::{Error, FileStream, Format, FrameRef, Sequence, Sink, Source, png_encoding};

/// Frames in a tar file.
const FRAMES: usize = 100;
const BLOCK: usize = 512;

/// The format.
#[derive(Debug)]
pub(crate) struct WebDataset;

impl Format for WebDataset {
    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        for sequence in source.sequences() {
            let frames: Vec<_> = source.frames(sequence.number).collect();
            for (i, frames) in frames.chunks(FRAMES).enumerate() {
                let prefix = match source.own_split(sequence.number) {
                    Some(split) => format!("{split}-"),
                    None => String::new(),
                };
                let name = format!("{prefix}{:02}-{i:06}", sequence.number);
                sink.stream(&name, &format!("{name}.tar"), |out| {
                    for frame in frames {
                        put_frame(source, &sequence, frame, out)?;
                    }
                    // Two empty blocks are the end.
                    out.put([0; 2 * BLOCK])
                })?;
            }
        }
        Ok(())
    }
}

fn put_frame(
    source: &Source,
    sequence: &Sequence<'_>,
    frame: &FrameRef<'_>,
    out: &mut FileStream,
) -> Result<(), Error> {
    let key = frame.name();
    member(
        out,
        &format!("{key}.json"),
        &describe(source, sequence, frame),
    )?;
    for (i, camera) in sequence.cameras.iter().enumerate() {
        let bytes = |file| source.camera_bytes(frame, i, file);
        let classes = png_encoding::encode_grey(&source.classes(frame, i)?);
        for (what, picture) in [
            ("rgb", bytes(CameraFile::Rgb)?),
            ("semantic", classes),
            ("instance", bytes(CameraFile::Instance)?),
            ("normals", bytes(CameraFile::Normals)?),
        ] {
            let name = format!("{key}.{}.{what}.png", camera.name);
            member(out, &name, &picture)?;
        }
        let depth = source.depth_m(frame, i)?;
        let data: Vec<u8> = depth
            .pixels()
            .iter()
            .flat_map(|z| z.to_le_bytes())
            .collect();
        let shape = (depth.height(), depth.width());
        member(
            out,
            &format!("{key}.{}.depth.npy", camera.name),
            &npy("<f4", shape, &data),
        )?;
    }
    for (i, lidar) in sequence.lidars.iter().enumerate() {
        let scan = source.scan(frame, i)?;
        let data: Vec<u8> = (scan.points.iter().flatten())
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let points = npy("<f4", (scan.points.len(), 4), &data);
        member(out, &format!("{key}.{}.points.npy", lidar.name), &points)?;
        let data: Vec<u8> = (scan.labels.iter())
            .flat_map(|&(class, instance)| [class, instance])
            .flat_map(u16::to_le_bytes)
            .collect();
        let labels = npy("<u2", (scan.labels.len(), 2), &data);
        member(out, &format!("{key}.{}.labels.npy", lidar.name), &labels)?;
    }
    Ok(())
}

/// What is not in pictures and scans; matrices are 3 × 4, row-major.
fn describe(source: &Source, sequence: &Sequence<'_>, frame: &FrameRef<'_>) -> Vec<u8> {
    let world_from_body = frame.world_from_body();
    let in_world =
        |body_from_sensor: RigidTransform| (world_from_body * body_from_sensor).to_rows();
    let camera = |c: &nemoral_dataset::CameraSpec| {
        let k = &c.intrinsics;
        json!({
            "name": c.name, "width": k.width, "height": k.height,
            "fx": k.fx, "fy": k.fy, "cx": k.cx, "cy": k.cy, "lens": lens(&k.distortion).0,
            "distortion": (k.distortion.coefficients().into_iter())
                .map(|(name, value)| (name.to_owned(), value.into()))
                .collect::<Map<String, Value>>(),
            "world_from_camera": in_world(c.body_from_camera),
        })
    };
    let lidar = |l: &nemoral_dataset::LidarSpec| {
        let pose = in_world(l.body_from_lidar);
        json!({ "name": l.name, "world_from_lidar": pose })
    };
    let classes = source.ontology().classes().iter();
    let classes: Map<String, Value> = classes
        .map(|c| (c.id.to_string(), c.name.clone().into()))
        .collect();
    let value = json!({
        "sequence": frame.sequence, "frame": frame.index, "time_s": frame.time_s,
        "split": source.own_split(frame.sequence).map(Split::name),
        "world_from_body": world_from_body.to_rows(), "classes": classes,
        "cameras": sequence.cameras.iter().map(camera).collect::<Vec<_>>(),
        "lidars": sequence.lidars.iter().map(lidar).collect::<Vec<_>>(),
    });
    value.to_string().into_bytes()
}

/// A file of NumPy's, version 1.0, with two dimensions in C's order.
fn npy(data_type: &str, (rows, columns): (usize, usize), data: &[u8]) -> Vec<u8> {
    let head = format!(
        "{{'descr': '{data_type}', 'fortran_order': False, 'shape': ({rows}, {columns}), }}"
    );
    // Magic, version and length are ten bytes, and the data begin at a multiple of 64.
    let length = (10 + head.len() + 1).next_multiple_of(64) - 10;
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&(length as u16).to_le_bytes());
    out.extend_from_slice(format!("{head:<width$}\n", width = length - 1).as_bytes());
    out.extend_from_slice(data);
    out
}

/// A member of a tar file: a header of one block, and the bytes, filled up to whole blocks.
fn member(out: &mut FileStream, name: &str, bytes: &[u8]) -> Result<(), Error> {
    let mut header = [0_u8; BLOCK];
    let mut field = |at: usize, text: &str| {
        header[at..at + text.len()].copy_from_slice(text.as_bytes());
    };
    // Sensors' names have at most 64 characters, so that names fit into 100.
    field(0, name);
    field(100, "0000644\0");
    field(108, "0000000\0");
    field(116, "0000000\0");
    field(124, &format!("{:011o}\0", bytes.len()));
    field(136, "00000000000\0");
    // The sum is taken with blanks in its own place.
    field(148, "        ");
    field(156, "0");
    field(257, "ustar\x0000");
    let sum: u32 = header.iter().map(|b| u32::from(*b)).sum();
    header[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
    out.put(header)?;
    out.put(bytes)?;
    let rest = bytes.len().next_multiple_of(BLOCK) - bytes.len();
    out.put(&[0; BLOCK][..rest])
}
