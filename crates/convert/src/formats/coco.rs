//! COCO: objects with masks, and panoptic segments.
//! ```text
//! images/SS_FFFFFF_CAMERA.png    pictures of all cameras
//! panoptic/SS_FFFFFF_CAMERA.png  segment ids, R + 256 G + 65536 B; 0 = no class
//! instances.json                 whole objects; categories are kinds, such as tree, log, rock
//! panoptic.json                  segments; categories are classes
//! ```
//! If the data set is split, there are two of these for each split: `instances_train.json`,
//! `panoptic_val.json` and so on.
//!
//! In `instances.json` an annotation is a whole object, with all its visible pixels as compressed
//! runs, their number as `area`, and the id of our instance maps as `instance_id`. Objects of fewer
//! pixels than [`ConvertParams::min_px`](crate::ConvertParams::min_px) are left out of it: there is
//! no `iscrowd` for them, which stands for several objects at once.
//!
//! In `panoptic.json`, which has all pixels, a segment is what is visible of one class of one
//! object (`instance_id`), or of one class without objects. Classes of which any object has a part
//! are things; what such a class has outside of objects is one segment with `iscrowd` 1. The class
//! of the sky is a segment too.
//! Source: the pages "Data format" and "Results format" of cocodataset.org.

use std::collections::{BTreeMap, BTreeSet};

use nemoral_dataset::{Manifest, Split};
use nemoral_scene::ObjectKind;
use png::{BitDepth, ColorType};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::formats::object_kinds::ObjectKinds;
use crate::formats::refuse_without_cameras;
use crate::labels::Labels;
use crate::{ClassMapping, Error, FileStream, Format, FrameRef, Sequence, Sink, Source, StepFiles};
use crate::{png_encoding, rle};

/// The format.
#[derive(Debug)]
pub(crate) struct Coco {
    pub(crate) ontology: Option<ClassMapping>,
    /// The fewest pixels of an object that is listed.
    pub(crate) min_px: u32,
}

/// What a frame's step leaves for the files about all frames, a picture for each camera.
#[derive(Serialize, Deserialize)]
struct Picture {
    name: String,
    width: usize,
    height: usize,
    objects: Vec<Object>,
    segments: Vec<Segment>,
}

/// A whole object in a picture.
#[derive(Serialize, Deserialize)]
struct Object {
    instance: u32,
    kind: usize,
    area: usize,
    bounds: [usize; 4],
    counts: String,
}

/// What is visible of one class of one object, or of none (0).
#[derive(Serialize, Deserialize)]
struct Segment {
    class: u16,
    instance: u32,
    area: usize,
    bounds: [usize; 4],
}

impl Format for Coco {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        refuse_without_cameras("coco", manifest)?;
        Labels::of(&manifest.header.ontology, self.ontology.as_ref()).map(drop)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        let labels = Labels::of(source.ontology(), self.ontology.as_ref())?;
        let mut parts: BTreeMap<Option<Split>, Vec<String>> = BTreeMap::new();
        for sequence in source.sequences() {
            let split = source.own_split(sequence.number);
            let kinds = ObjectKinds::of(source, sequence.number)?;
            for frame in source.frames(sequence.number) {
                let key = format!("frame-{}", frame.name());
                sink.step(&key, |files| {
                    let objects = (&kinds, self.min_px);
                    let pictures = frame_files(source, &sequence, &frame, &labels, objects, files)?;
                    Ok(serde_json::to_string(&pictures).expect("numbers and names"))
                })?;
                parts.entry(split).or_default().push(key);
            }
        }
        let notes = sink.notes();
        // What is a thing in one split is so in all.
        let mut things = BTreeSet::new();
        for key in parts.values().flatten() {
            let pictures: Vec<Picture> = notes.json(key)?;
            let segments = pictures.into_iter().flat_map(|p| p.segments);
            things.extend(segments.filter(|s| s.instance > 0).map(|s| s.class));
        }
        for (split, keys) in &parts {
            let suffix = split.map_or_else(String::new, |split| format!("_{split}"));
            write_lists(source, sink, &labels, &things, &suffix, keys)?;
        }
        Ok(())
    }
}

/// The lists of objects and of segments of some frames.
fn write_lists(
    source: &Source,
    sink: &mut Sink,
    labels: &Labels,
    things: &BTreeSet<u16>,
    suffix: &str,
    keys: &[String],
) -> Result<(), Error> {
    // One frame's notes are in memory at a time, so they are read again for each list.
    let notes = sink.notes();
    let head = format!(
        "{{\"info\":{},\n\"licenses\":{},\n",
        info(source),
        licences(source)
    );
    let pictures = || keys.iter().map(|key| notes.json::<Vec<Picture>>(key));
    let (instances, panoptics) = (format!("instances{suffix}"), format!("panoptic{suffix}"));
    sink.stream(&instances, &format!("{instances}.json"), |out| {
        out.put(&head)?;
        out.put(format!("\"categories\":{},\n", kinds_json()))?;
        write_images(out, pictures())?;
        let (mut image, mut id) = (0, 0);
        let mut list = List::begin(out, "annotations")?;
        for frame in pictures() {
            for picture in frame? {
                image += 1;
                for object in &picture.objects {
                    id += 1;
                    list.item(out, &annotation(id, image, &picture, object))?;
                }
            }
        }
        list.end(out)?;
        out.put("}\n")
    })?;
    sink.stream(&panoptics, &format!("{panoptics}.json"), |out| {
        out.put(&head)?;
        out.put(format!(
            "\"categories\":{},\n",
            classes_json(labels, things)
        ))?;
        write_images(out, pictures())?;
        let mut image = 0;
        let mut list = List::begin(out, "annotations")?;
        for frame in pictures() {
            for picture in frame? {
                image += 1;
                list.item(out, &panoptic(image, &picture, things))?;
            }
        }
        list.end(out)?;
        out.put("}\n")
    })
}

/// Puts a frame's pictures, and returns what is in them; of objects those of at least `min_px`
/// pixels.
fn frame_files(
    source: &Source,
    sequence: &Sequence<'_>,
    frame: &FrameRef<'_>,
    labels: &Labels,
    (kinds, min_px): (&ObjectKinds, u32),
    files: &mut StepFiles,
) -> Result<Vec<Picture>, Error> {
    let mut pictures = Vec::new();
    for (i, camera) in sequence.cameras.iter().enumerate() {
        let name = format!("{}_{}.png", frame.name(), camera.name);
        files.put(format!("images/{name}"), source.picture_bytes(frame, i)?);
        let (classes, instances) = (source.classes(frame, i)?, source.instances(frame, i)?);
        let (width, height) = (classes.width(), classes.height());
        // The pixels of each object and of each segment, numbered column by column.
        let mut objects: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        let mut segments: BTreeMap<(u16, u32), Vec<usize>> = BTreeMap::new();
        for column in 0..width {
            for row in 0..height {
                let (class, instance) = (*classes.at(column, row), *instances.at(column, row));
                let pixel = column * height + row;
                if instance > 0 {
                    objects.entry(instance).or_default().push(pixel);
                }
                let segment = (labels.id(class), instance);
                segments.entry(segment).or_default().push(pixel);
            }
        }
        let mut ids = vec![0; 3 * width * height];
        for (id, pixels) in (1_u32..).zip(segments.values()) {
            for &pixel in pixels {
                let at = 3 * (pixel % height * width + pixel / height);
                ids[at..at + 3].copy_from_slice(&id.to_le_bytes()[..3]);
            }
        }
        let (rgb, eight) = (ColorType::Rgb, BitDepth::Eight);
        let bytes = png_encoding::encode(width, height, rgb, eight, None, &ids);
        files.put(format!("panoptic/{name}"), bytes);
        objects.retain(|_, pixels| pixels.len() >= min_px as usize);
        let object = |(instance, pixels): (u32, Vec<usize>)| {
            let kind = kinds.kind("coco", instance, (frame, &name))?;
            Ok(Object {
                instance,
                kind,
                area: pixels.len(),
                bounds: bounds(&pixels, height),
                counts: rle::compress(pixels, width * height),
            })
        };
        let objects: Result<_, Error> = objects.into_iter().map(object).collect();
        let objects = objects?;
        let segment = |((class, instance), pixels): (&(u16, u32), &Vec<usize>)| Segment {
            class: *class,
            instance: *instance,
            area: pixels.len(),
            bounds: bounds(pixels, height),
        };
        let segments = segments.iter().map(segment).collect();
        pictures.push(Picture {
            name,
            width,
            height,
            objects,
            segments,
        });
    }
    Ok(pictures)
}

/// x, y, width and height of pixels that are numbered column by column.
fn bounds(pixels: &[usize], height: usize) -> [usize; 4] {
    let column = |p: &usize| p / height;
    let row = |p: &usize| p % height;
    let (left, right) = (
        pixels.first().map_or(0, column),
        pixels.last().map_or(0, column),
    );
    let top = pixels.iter().map(row).min().unwrap_or(0);
    let bottom = pixels.iter().map(row).max().unwrap_or(0);
    [left, top, right + 1 - left, bottom + 1 - top]
}

fn info(source: &Source) -> Value {
    let description = "Virtual forests, recorded with virtual cameras";
    json!({ "description": description, "version": source.generator() })
}

fn licences(source: &Source) -> Value {
    json!([{ "id": 1, "name": source.licence(), "url": "" }])
}

fn kinds_json() -> Value {
    let kind = |(i, kind): (usize, &ObjectKind)| {
        let supercategory = match kind {
            ObjectKind::Rock => "ground",
            ObjectKind::Log | ObjectKind::RootPlate => "deadwood",
            _ => "plant",
        };
        json!({ "id": i + 1, "name": kind.name(), "supercategory": supercategory })
    };
    ObjectKind::ALL.iter().enumerate().map(kind).collect()
}

fn classes_json(labels: &Labels, things: &BTreeSet<u16>) -> Value {
    // Category 0 is no class to some readers.
    let class = |c: &crate::labels::LabelClass| {
        let is_thing = u8::from(things.contains(&c.id));
        json!({
            "id": u32::from(c.id) + 1, "name": c.name, "color": c.colour, "isthing": is_thing,
            "supercategory": if is_thing == 1 { "thing" } else { "stuff" },
        })
    };
    labels.classes.iter().map(class).collect()
}

fn annotation(id: u64, image: u64, picture: &Picture, object: &Object) -> Value {
    json!({
        "id": id, "image_id": image, "category_id": object.kind + 1, "iscrowd": 0,
        "area": object.area, "bbox": object.bounds, "instance_id": object.instance,
        "segmentation": { "size": [picture.height, picture.width], "counts": object.counts },
    })
}

fn panoptic(image: u64, picture: &Picture, things: &BTreeSet<u16>) -> Value {
    let segment = |(id, s): (u32, &Segment)| {
        let is_crowd = s.instance == 0 && things.contains(&s.class);
        json!({
            "id": id, "category_id": u32::from(s.class) + 1, "area": s.area, "bbox": s.bounds,
            "iscrowd": u8::from(is_crowd), "instance_id": s.instance,
        })
    };
    let segments: Vec<_> = (1..).zip(&picture.segments).map(segment).collect();
    json!({ "image_id": image, "file_name": picture.name, "segments_info": segments })
}

fn write_images(
    out: &mut FileStream,
    frames: impl Iterator<Item = Result<Vec<Picture>, Error>>,
) -> Result<(), Error> {
    let mut list = List::begin(out, "images")?;
    let mut id = 0;
    for frame in frames {
        for picture in frame? {
            id += 1;
            let (name, width, height) = (picture.name, picture.width, picture.height);
            let image = json!({
                "id": id, "file_name": name, "width": width, "height": height, "license": 1,
            });
            list.item(out, &image)?;
        }
    }
    list.end(out)?;
    out.put(",\n")
}

/// A list of a JSON object, an item on each line.
struct List {
    is_empty: bool,
}

impl List {
    fn begin(out: &mut FileStream, name: &str) -> Result<Self, Error> {
        out.put(format!("\"{name}\":["))?;
        Ok(Self { is_empty: true })
    }

    fn item(&mut self, out: &mut FileStream, item: &Value) -> Result<(), Error> {
        let comma = if self.is_empty { "\n" } else { ",\n" };
        self.is_empty = false;
        out.put(format!("{comma}{item}"))
    }

    fn end(self, out: &mut FileStream) -> Result<(), Error> {
        out.put("\n]")
    }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::Ontology;

    use super::*;

    #[test]
    fn the_greatest_class_is_a_category_of_its_own() {
        let table = "name = \"x\"\nsource = \"s\"\nrest = \"a\"\n[[class]]\nid = 65535\n\
                     name = \"a\"\ncolour = [0, 0, 0]\nfrom = [\"Trunks\"]\n";
        let table = ClassMapping::parse("x", table).expect("valid");
        let labels = Labels::of(&Ontology::paper(), Some(&table)).expect("it fits");
        let things = BTreeSet::new();
        assert_eq!(classes_json(&labels, &things)[0]["id"], 65_536);
        let segment = Segment {
            class: 65_535,
            instance: 0,
            area: 1,
            bounds: [0, 0, 1, 1],
        };
        let picture = Picture {
            name: "a.png".to_owned(),
            width: 1,
            height: 1,
            objects: Vec::new(),
            segments: vec![segment],
        };
        let json = panoptic(1, &picture, &things);
        assert_eq!(json["segments_info"][0]["category_id"], 65_536);
    }
}
