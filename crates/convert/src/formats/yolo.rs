//! YOLO's boxes, as Ultralytics' programs read them:
//! ```text
//! images/SS/FFFFFF_CAMERA.png
//! labels/SS/FFFFFF_CAMERA.txt   kind, then the middle's x and y, width and height, in pictures
//! data.yaml                     paths and the names of kinds
//! ```
//! A box is around the visible pixels of a whole object, such as a tree, a log or a rock, which are
//! at least [`ConvertParams::min_px`](crate::ConvertParams::min_px). Splits are
//! [`Source::split`]'s; sequences without pictures are not listed. Source: Ultralytics' page
//! "Object Detection Datasets Overview".

use std::collections::BTreeMap;

use nemoral_dataset::{Manifest, Split};
use nemoral_scene::ObjectKind;

use crate::formats::object_kinds::ObjectKinds;
use crate::formats::refuse_without_cameras;
use crate::geometry::line;
use crate::{Error, Format, Sink, Source};

/// The format.
#[derive(Debug)]
pub(crate) struct Yolo {
    /// The fewest pixels of an object that has a box.
    pub(crate) min_px: u32,
}

impl Format for Yolo {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        refuse_without_cameras("yolo", manifest)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        for sequence in source.sequences() {
            let kinds = ObjectKinds::of(source, sequence.number)?;
            for frame in source.frames(sequence.number) {
                sink.step(&format!("frame-{}", frame.name()), |files| {
                    for (i, camera) in sequence.cameras.iter().enumerate() {
                        let (number, index) = (sequence.number, frame.index);
                        let name = format!("{number:02}/{index:06}_{}", camera.name);
                        let picture = source.picture_bytes(&frame, i)?;
                        files.put(format!("images/{name}.png"), picture);
                        let instances = source.instances(&frame, i)?;
                        let size = (instances.width(), instances.height());
                        let mut text = String::new();
                        for (instance, bounds) in boxes(instances.pixels(), size.0, self.min_px) {
                            let kind = kinds.kind("yolo", instance, (&frame, &name))?;
                            text += &format!("{kind} {}", line(normalised(bounds, size)));
                        }
                        files.put(format!("labels/{name}.txt"), text);
                    }
                    Ok(String::new())
                })?;
            }
        }
        sink.step("data", |files| {
            files.put("data.yaml", data_yaml(source));
            Ok(String::new())
        })
    }
}

/// Each object of at least so many pixels, by its id, with their left, top, right and bottom, the
/// last two exclusive.
fn boxes(instances: &[u32], width: usize, min_px: u32) -> Vec<(u32, [usize; 4])> {
    let mut boxes: BTreeMap<u32, ([usize; 4], usize)> = BTreeMap::new();
    for (i, &instance) in instances.iter().enumerate().filter(|(_, id)| **id > 0) {
        let (x, y) = (i % width, i / width);
        let (b, pixels) = boxes.entry(instance).or_insert(([x, y, x + 1, y + 1], 0));
        *b = [b[0].min(x), b[1].min(y), b[2].max(x + 1), b[3].max(y + 1)];
        *pixels += 1;
    }
    let large = boxes
        .into_iter()
        .filter(|(_, (_, pixels))| *pixels >= min_px as usize);
    large.map(|(instance, (b, _))| (instance, b)).collect()
}

/// The middle and the size, as shares of the picture.
fn normalised([left, top, right, bottom]: [usize; 4], size: (usize, usize)) -> [f64; 4] {
    let (w, h) = (size.0 as f64, size.1 as f64);
    [
        (left + right) as f64 / 2.0 / w,
        (top + bottom) as f64 / 2.0 / h,
        (right - left) as f64 / w,
        (bottom - top) as f64 / h,
    ]
}

fn data_yaml(source: &Source) -> String {
    let of = |split| -> Vec<u32> {
        let pictured = source.sequences().filter(|s| !s.cameras.is_empty());
        let numbers = pictured.map(|s| s.number);
        numbers.filter(|n| source.split(*n) == split).collect()
    };
    let (train, mut validation, test) = (of(Split::Train), of(Split::Val), of(Split::Test));
    // Without `path`, places are relative to this file.
    let mut text = String::new();
    if validation.is_empty() {
        text += "# No sequence is for validation, so that it is on the pictures of training.\n";
        validation.clone_from(&train);
    }
    for (name, numbers) in [("train", train), ("val", validation), ("test", test)] {
        if !numbers.is_empty() {
            text += &format!("{name}:\n");
        }
        for number in numbers {
            text += &format!("  - images/{number:02}\n");
        }
    }
    text += "names:\n";
    for (i, kind) in ObjectKind::ALL.iter().enumerate() {
        text += &format!("  {i}: {}\n", kind.name());
    }
    text
}
