//! KITTI's odometry benchmark, as pykitti and KISS-ICP read it:
//! ```text
//! sequences/SS/image_0/000000.png   grey, the first camera
//! sequences/SS/image_2/000000.png   the first camera; image_1 and image_3 for one called `right`
//! sequences/SS/velodyne/000000.bin  the first LiDAR, x y z intensity
//! sequences/SS/labels/000000.label  its classes and instances, as in SemanticKITTI
//! sequences/SS/calib.txt times.txt
//! poses/SS.txt
//! ontology.yaml                     the classes, as semantic-kitti-api reads them
//! ```
//! SemanticKITTI's layout is the same, with the classes of the table `semantickitti`.
//!
//! Frames that exist are numbered from 0 without gaps, because readers count lines, and poses are
//! relative to the first of them. In `calib.txt` the first pixel's centre is at (0, 0), as OpenCV
//! has it. Source: the benchmark's development kit, `readme.txt`.

use std::collections::BTreeMap;

use nemoral_dataset::{CameraSpec, ClassTable, Manifest, TableRow};
use nemoral_scene::{Distortion, Image, Ontology, RigidTransform};
use png::{BitDepth, ColorType};

use crate::formats::stereo;
use crate::geometry::{lens, line, relative, rows_line};
use crate::labels::Labels;
use crate::{ClassMapping, Error, Format, FrameRef, Sequence, Sink, Source, png_encoding};

/// The format.
#[derive(Debug)]
pub(crate) struct Kitti {
    pub(crate) ontology: Option<ClassMapping>,
    /// The built-in table that labels follow if none is given; the data set's classes without one.
    pub(crate) built_in: Option<&'static str>,
}

impl Kitti {
    fn labels(&self, own: &Ontology) -> Result<Labels, Error> {
        let built_in = self.built_in.map(ClassMapping::load).transpose()?;
        Labels::of(own, self.ontology.as_ref().or(built_in.as_ref()))
    }
}

impl Format for Kitti {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        self.labels(&manifest.header.ontology).map(drop)
    }

    fn notes(&self, manifest: &Manifest) -> Vec<String> {
        let mut notes = stereo::notes(
            manifest,
            "P1 and P3 project points into its pictures as they are, but are no projections of a \
             rectified camera, from whose fourth number programs for stereo take the baseline",
        );
        notes.extend(distortion_note(manifest));
        notes
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        let labels = self.labels(source.ontology())?;
        let mut keys = Vec::new();
        for sequence in source.sequences() {
            for (k, frame) in source.frames(sequence.number).enumerate() {
                let key = format!("frame-{}", frame.name());
                sink.step(&key, |files| {
                    let mut counts: BTreeMap<u16, u64> = BTreeMap::new();
                    let folder = format!("sequences/{:02}", sequence.number);
                    for (camera, grey, colour) in pairs(&sequence) {
                        let picture = source.picture(&frame, camera)?;
                        files.put(format!("{folder}/{grey}/{k:06}.png"), encode_grey(&picture));
                        let bytes = source.picture_bytes(&frame, camera)?;
                        files.put(format!("{folder}/{colour}/{k:06}.png"), bytes);
                    }
                    if !sequence.lidars.is_empty() {
                        let scan = source.scan(&frame, 0)?;
                        let points = scan.points.iter().flatten().flat_map(|v| v.to_le_bytes());
                        let path = format!("{folder}/velodyne/{k:06}.bin");
                        files.put(path, points.collect::<Vec<u8>>());
                        let mut word = |(i, &(class, instance)): (usize, &(u16, u16))| {
                            // The fine semantics, where the data set has them, tell more.
                            let id = match scan.ply.get(i) {
                                Some(fine) => labels.id_of_semantic(fine.point.semantic),
                                None => labels.id(class as u8),
                            };
                            *counts.entry(id).or_default() += 1;
                            u32::from(id) | u32::from(instance) << 16
                        };
                        let words = scan.labels.iter().enumerate();
                        let words: Vec<u8> = words.flat_map(|l| word(l).to_le_bytes()).collect();
                        files.put(format!("{folder}/labels/{k:06}.label"), words);
                    }
                    Ok(serde_json::to_string(&counts).expect("numbers"))
                })?;
                keys.push(key);
            }
            sink.step(&format!("sequence-{:02}", sequence.number), |files| {
                let frames: Vec<_> = source.frames(sequence.number).collect();
                let folder = format!("sequences/{:02}", sequence.number);
                let poses = poses(&sequence, &frames);
                files.put(format!("poses/{:02}.txt", sequence.number), poses.clone());
                files.put(format!("{folder}/poses.txt"), poses);
                let first = frames.first().map_or(0.0, |f| f.time_s);
                let times: String = frames.iter().map(|f| line([f.time_s - first])).collect();
                files.put(format!("{folder}/times.txt"), times);
                files.put(format!("{folder}/calib.txt"), calibration(&sequence));
                Ok(String::new())
            })?;
        }
        let notes = sink.notes();
        let mut points: BTreeMap<u16, u64> = BTreeMap::new();
        for key in &keys {
            for (id, count) in notes.json::<BTreeMap<u16, u64>>(key)? {
                let sum = points.entry(id).or_default();
                *sum = sum.saturating_add(count);
            }
        }
        sink.step("ontology", |files| {
            files.put("ontology.yaml", ontology(source, &labels, &points));
            Ok(String::new())
        })
    }
}

/// `ontology.yaml`, with the numbers of points of each class that was written.
fn ontology(source: &Source, labels: &Labels, points: &BTreeMap<u16, u64>) -> String {
    let count = |id: u16| points.get(&id).copied().unwrap_or(0);
    let rows = labels.classes.iter().map(|c| TableRow {
        id: c.id,
        name: &c.name,
        colour: c.colour,
        points: count(c.id),
        ignored: c.ignored,
    });
    let sequences = source.sequences().map(|s| s.number);
    let table = ClassTable {
        name: &labels.name,
        classes: rows.collect(),
        sequences: sequences.map(|n| (n, Some(source.split(n)))).collect(),
    };
    table.to_yaml()
}

/// The cameras that KITTI has a place for, with the folders of their grey and coloured pictures.
fn pairs(sequence: &Sequence<'_>) -> Vec<(usize, &'static str, &'static str)> {
    let mut pairs = Vec::new();
    if !sequence.cameras.is_empty() {
        pairs.push((0, "image_0", "image_2"));
    }
    if let Some(right) = stereo::right(sequence.cameras) {
        pairs.push((right, "image_1", "image_3"));
    }
    pairs
}

/// A note if pictures that KITTI has a place for are not those of a pinhole at one instant.
fn distortion_note(manifest: &Manifest) -> Option<String> {
    let is_distorted = |camera: &&CameraSpec| {
        camera.intrinsics.distortion != Distortion::None || camera.shutter.readout_s != 0.0
    };
    let sequences = manifest.header.sequences.iter();
    let distorted: Vec<(u32, &CameraSpec)> = sequences
        .flat_map(|s| {
            let right = stereo::right(&s.cameras).map(|i| &s.cameras[i]);
            let pair = s.cameras.first().into_iter().chain(right);
            pair.filter(is_distorted)
                .map(move |camera| (s.number, camera))
        })
        .collect();
    let ((sequence, camera), others) = distorted.split_first()?;
    let others = match others.len() {
        0 => String::new(),
        n => format!(" (and {n} more)"),
    };
    let (mut what, mut so) = (Vec::new(), Vec::new());
    if camera.intrinsics.distortion != Distortion::None {
        what.push("a lens");
        so.push("undistort them by D2 and D3, or F2 and F3, of calib.txt");
    }
    if camera.shutter.readout_s != 0.0 {
        what.push("a rolling shutter");
        so.push("their rows have poses of their own");
    }
    Some(format!(
        "camera '{}' of sequence {sequence:02}{others} has {}, and readers of this format take its \
         pictures for rectified ones: {}",
        camera.name,
        what.join(" and "),
        so.join("; ")
    ))
}

/// The luma of ITU-R BT.601, rounded, as common decoders make grey pictures.
fn encode_grey(picture: &Image<[u8; 3]>) -> Vec<u8> {
    let luma = |&[r, g, b]: &[u8; 3]| {
        let [r, g, b] = [r, g, b].map(u32::from);
        ((299 * r + 587 * g + 114 * b + 500) / 1000) as u8
    };
    let grey: Vec<u8> = picture.pixels().iter().map(luma).collect();
    let (width, height) = (picture.width(), picture.height());
    png_encoding::encode(
        width,
        height,
        ColorType::Grayscale,
        BitDepth::Eight,
        None,
        &grey,
    )
}

/// The reference sensor's poses, relative to its first one.
pub(super) fn poses(sequence: &Sequence<'_>, frames: &[FrameRef<'_>]) -> String {
    let pose = |f: &FrameRef<'_>| f.world_from_body() * sequence.body_from_reference();
    let first = frames.first().map_or(RigidTransform::IDENTITY, pose);
    frames
        .iter()
        .map(|f| rows_line(&relative(&first, &pose(f))))
        .collect()
}

/// `P0` to `P3`, those of the left and the right camera, `Tr`, and where lenses distort, `D2` and
/// `D3` (k1 k2 p1 p2 k3) or `F2` and `F3` of fisheyes (k1 to k4), with zeros up to the twelve
/// numbers that readers take each line for. The first pixel's centre is at (0, 0).
pub(super) fn calibration(sequence: &Sequence<'_>) -> String {
    let reference = sequence.body_from_reference();
    let projection = |camera: usize| {
        let Some(c) = sequence.cameras.get(camera) else {
            // Without a camera, poses are those of the LiDAR.
            return rows_line(&RigidTransform::IDENTITY);
        };
        let k = &c.intrinsics;
        let (cx, cy) = (k.cx - 0.5, k.cy - 0.5);
        let [x, y, z] = relative(&c.body_from_camera, &reference).to_rows();
        let first = (0..4).map(|i| k.fx * x[i] + cx * z[i]);
        let second = (0..4).map(|i| k.fy * y[i] + cy * z[i]);
        line(first.chain(second).chain(z))
    };
    let (left, right) = (
        projection(0),
        projection(stereo::right(sequence.cameras).unwrap_or(0)),
    );
    let lidar = sequence
        .lidars
        .first()
        .map_or(reference, |l| l.body_from_lidar);
    let tr = rows_line(&relative(&reference, &lidar));
    let mut text = format!("P0: {left}P1: {right}P2: {left}P3: {right}Tr: {tr}");
    for (number, camera) in [(2, Some(0)), (3, stereo::right(sequence.cameras))] {
        let camera = camera.and_then(|camera| sequence.cameras.get(camera));
        let letter = match camera.map(|c| lens(&c.intrinsics.distortion)) {
            Some(("brown_conrady", coefficients)) => Some(("D", coefficients)),
            Some(("fisheye", coefficients)) => Some(("F", coefficients)),
            _ => None,
        };
        if let Some((letter, coefficients)) = letter {
            let numbers = line(coefficients.into_iter().chain([0.0; 7]));
            text += &format!("{letter}{number}: {numbers}");
        }
    }
    text
}
