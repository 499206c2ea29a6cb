//! GOOSE's layout, with its class ids:
//! ```text
//! images/SPLIT/SCENE/STEM_windshield_vis.png
//! labels/SPLIT/SCENE/STEM_{labelids,instanceids,color}.png
//! velodyne/SPLIT/SCENE/STEM_vls128.bin
//! labels/SPLIT/SCENE/STEM_goose.label
//! goose_label_mapping.csv
//! ```
//! A scene is a sequence, `nemoral_SS`; a stem is its name, two underscores, the frame and the time
//! in nanoseconds. The first camera and the first LiDAR are written. Instances of a picture are
//! numbered from 1 in 16 bits, in the order of their ids. Splits are [`Source::split`]'s. A LiDAR's
//! false alarms are undefined, not sky. Source: Mortimer et al. (ICRA 2024) and the data set's page
//! "Dataset structure".

use std::collections::BTreeSet;

use nemoral_dataset::Manifest;
use nemoral_scene::{Image, Ontology, Semantic};
use png::{BitDepth, ColorType};

use crate::labels::Labels;
use crate::{ClassMapping, Error, Format, FrameRef, Sink, Source, png_encoding};

/// The format.
#[derive(Debug)]
pub(crate) struct Goose {
    pub(crate) ontology: Option<ClassMapping>,
}

impl Goose {
    fn labels(&self, own: &Ontology) -> Result<Labels, Error> {
        let table = match &self.ontology {
            Some(table) => table.clone(),
            None => ClassMapping::load("goose")?,
        };
        Labels::of(own, Some(&table))?.in_bytes()
    }
}

impl Format for Goose {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        self.labels(&manifest.header.ontology).map(drop)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        let labels = self.labels(source.ontology())?;
        let sky = source.ontology().class(Semantic::Sky).id;
        for sequence in source.sequences() {
            let split = source.split(sequence.number).name();
            for frame in source.frames(sequence.number) {
                sink.step(&format!("frame-{}", frame.name()), |files| {
                    let stem = stem(split, &frame);
                    if !sequence.cameras.is_empty() {
                        let picture = source.picture_bytes(&frame, 0)?;
                        files.put(format!("images/{stem}_windshield_vis.png"), picture);
                        let classes = source.classes(&frame, 0)?.map(|&c| labels.id(c) as u8);
                        let maps = [
                            (
                                "labelids",
                                encode(&classes, ColorType::Grayscale, classes.pixels()),
                            ),
                            ("color", encode_colours(&classes, &labels)),
                            (
                                "instanceids",
                                encode_instances(&source.instances(&frame, 0)?),
                            ),
                        ];
                        for (name, bytes) in maps {
                            files.put(format!("labels/{stem}_{name}.png"), bytes);
                        }
                    }
                    if !sequence.lidars.is_empty() {
                        let scan = source.scan(&frame, 0)?;
                        let points = scan.points.iter().flatten().flat_map(|v| v.to_le_bytes());
                        let path = format!("velodyne/{stem}_vls128.bin");
                        files.put(path, points.collect::<Vec<u8>>());
                        let id = |class: u8| match class {
                            alarm if alarm == sky => 0,
                            class => u32::from(labels.id(class)),
                        };
                        let words = (scan.labels.iter())
                            .map(|&(class, instance)| id(class as u8) | u32::from(instance) << 16);
                        let words = words.flat_map(u32::to_le_bytes);
                        let path = format!("labels/{stem}_goose.label");
                        files.put(path, words.collect::<Vec<u8>>());
                    }
                    Ok(String::new())
                })?;
            }
        }
        sink.step("mapping", |files| {
            let mut text = "class_name,label_key,has_instance,hex\n".to_owned();
            for class in &labels.classes {
                let [r, g, b] = class.colour;
                let is_thing = ["tree_trunk", "rock"].contains(&&*class.name);
                let (name, id, thing) = (field(&class.name), class.id, u8::from(is_thing));
                text += &format!("{name},{id},{thing},#{r:02x}{g:02x}{b:02x}\n");
            }
            files.put("goose_label_mapping.csv", text);
            Ok(String::new())
        })
    }
}

/// A text as one field of a CSV table, in quotes if it would be several (RFC 4180).
fn field(text: &str) -> String {
    if text.contains(['"', ',', '\r', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// `SPLIT/SCENE/STEM`.
fn stem(split: &str, frame: &FrameRef<'_>) -> String {
    let scene = format!("nemoral_{:02}", frame.sequence);
    let time_ns = (frame.time_s * 1e9).round() as i64;
    format!("{split}/{scene}/{scene}__{:04}_{time_ns:019}", frame.index)
}

/// 8-bit samples of a picture of this size.
fn encode<T>(size: &Image<T>, colour: ColorType, data: &[u8]) -> Vec<u8> {
    let (width, height) = (size.width(), size.height());
    png_encoding::encode(width, height, colour, BitDepth::Eight, None, data)
}

fn encode_colours(classes: &Image<u8>, labels: &Labels) -> Vec<u8> {
    let mut colours = [[0; 3]; 256];
    for class in &labels.classes {
        colours[usize::from(class.id)] = class.colour;
    }
    let data: Vec<u8> = (classes.pixels().iter())
        .flat_map(|&c| colours[usize::from(c)])
        .collect();
    encode(classes, ColorType::Rgb, &data)
}

/// 16-bit grey: objects numbered from 1, 0 for none.
fn encode_instances(instances: &Image<u32>) -> Vec<u8> {
    let ids: BTreeSet<u32> = instances
        .pixels()
        .iter()
        .copied()
        .filter(|i| *i > 0)
        .collect();
    let ids: Vec<u32> = ids.into_iter().collect();
    // There are not so many objects in a picture that the last ones have no number.
    let number = |id: &u32| ids.binary_search(id).map_or(0, |at| (at + 1).min(65535)) as u16;
    let data: Vec<u8> = (instances.pixels().iter())
        .flat_map(|id| number(id).to_be_bytes())
        .collect();
    let (width, height) = (instances.width(), instances.height());
    let (grey, sixteen) = (ColorType::Grayscale, BitDepth::Sixteen);
    png_encoding::encode(width, height, grey, sixteen, None, &data)
}
