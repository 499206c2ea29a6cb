//! A folder of pictures as Hugging Face's `datasets` reads it (`imagefolder`), a row for each
//! picture with its truth beside it:
//! ```text
//! README.md                                  the data card
//! croissant.json                             the same for machines: Croissant 1.0, without a URL,
//!                                            which is that of where it is published
//! data/metadata.jsonl                        the rows
//! data/SS/{image,semantic,instance,depth,normals}/FFFFFF_CAMERA.png
//! ```
//! If the data set is split, `data` has a folder of this kind for each split: `train`,
//! `validation`, `test`.
//!
//! A column `NAME_file_name` is read as a picture of its own called NAME, so that truth maps do not
//! pool with pictures: `image` (8-bit sRGB), `semantic` (palette: class ids), `instance` (8-bit
//! RGB, id = R + 256 G + 65536 B), `depth` (16-bit, 256 = 1 m, 0 = none), `normals`. The other
//! columns are `sequence`, `frame`, `camera`, `time_s`, `fx`, `fy`, `cx`, `cy`, `lens` (`pinhole`,
//! `brown_conrady` or `fisheye`), `distortion` (k1 k2 p1 p2 k3, or k1 to k4 of a fisheye and 0) and
//! `world_from_camera` (3 × 4). Source: the pages "Create an image dataset" and "Dataset Cards" of
//! Hugging Face; Croissant's specification 1.0 (MLCommons).

mod croissant;

use std::collections::BTreeMap;

use nemoral_dataset::{CameraFile, Manifest, Split};
use nemoral_scene::{Image, Ontology};
use png::{BitDepth, ColorType};
use serde::Serialize;
use serde_json::json;
use sha2::{Digest, Sha256};

use crate::formats::refuse_without_cameras;
use crate::geometry::lens;
use crate::labels::Labels;
use crate::{ClassMapping, Error, Format, FrameRef, Sequence, Sink, Source, png_encoding};

/// The format.
#[derive(Debug)]
pub(crate) struct HuggingFace {
    pub(crate) ontology: Option<ClassMapping>,
}

/// The truth maps of a picture.
const MAPS: [&str; 4] = ["semantic", "instance", "depth", "normals"];

impl HuggingFace {
    fn labels(&self, own: &Ontology) -> Result<Labels, Error> {
        Labels::of(own, self.ontology.as_ref())?.in_bytes()
    }
}

impl Format for HuggingFace {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        refuse_without_cameras("hf", manifest)?;
        self.labels(&manifest.header.ontology).map(drop)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        let labels = self.labels(source.ontology())?;
        let mut parts: BTreeMap<Option<Split>, Vec<String>> = BTreeMap::new();
        for sequence in source.sequences() {
            let split = source.own_split(sequence.number);
            let data = data(split);
            for frame in source.frames(sequence.number) {
                let key = format!("frame-{}", frame.name());
                sink.step(&key, |files| {
                    let mut rows = String::new();
                    for i in 0..sequence.cameras.len() {
                        let row = Row::of(&sequence, &frame, i);
                        for (path, bytes) in maps(source, &frame, i, &labels, &row)? {
                            files.put(format!("{data}/{path}"), bytes);
                        }
                        rows += &serde_json::to_string(&row).expect("numbers and names");
                        rows.push('\n');
                    }
                    Ok(rows)
                })?;
                parts.entry(split).or_default().push(key);
            }
        }
        let notes = sink.notes();
        let (mut written, mut pictures) = (Vec::new(), 0);
        for (&split, keys) in &parts {
            let mut sha256 = Sha256::new();
            for key in keys {
                let rows = notes.of(key)?;
                pictures += rows.lines().count();
                sha256.update(rows);
            }
            let digest = sha256.finalize();
            let digest = digest.iter().map(|b| format!("{b:02x}")).collect();
            written.push(Part { split, digest });
            let (step, path) = (written[written.len() - 1].of("metadata"), metadata(split));
            sink.stream(&step, &path, |out| {
                keys.iter().try_for_each(|key| out.put(notes.of(key)?))
            })?;
        }
        sink.step("card", |files| {
            files.put("README.md", card(source, &labels, pictures, &written));
            let croissant = croissant::describe(source, &written);
            files.put("croissant.json", format!("{croissant:#}\n"));
            Ok(String::new())
        })
    }
}

/// The rows of a split, or of everything.
struct Part {
    split: Option<Split>,
    /// SHA-256 of the rows.
    digest: String,
}

impl Part {
    /// A name of something of this part.
    fn of(&self, name: &str) -> String {
        match self.split {
            Some(split) => format!("{name}-{}", split_name(split)),
            None => name.to_owned(),
        }
    }
}

/// What Hugging Face calls a split.
fn split_name(split: Split) -> &'static str {
    match split {
        Split::Train => "train",
        Split::Val => "validation",
        Split::Test => "test",
    }
}

/// The folder of a split's rows and pictures.
fn data(split: Option<Split>) -> String {
    match split {
        Some(split) => format!("data/{}", split_name(split)),
        None => "data".to_owned(),
    }
}

/// The rows' file.
fn metadata(split: Option<Split>) -> String {
    format!("{}/metadata.jsonl", data(split))
}

/// The row of a picture. The order counts: `datasets` 5.2 mixes up the columns of pictures if
/// `file_name` is not the first.
#[derive(Serialize)]
struct Row<'a> {
    file_name: String,
    semantic_file_name: String,
    instance_file_name: String,
    depth_file_name: String,
    normals_file_name: String,
    sequence: u32,
    frame: u64,
    camera: &'a str,
    time_s: f64,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    lens: &'static str,
    distortion: [f64; 5],
    world_from_camera: [[f64; 4]; 3],
}

impl<'a> Row<'a> {
    fn of(sequence: &Sequence<'a>, frame: &FrameRef<'_>, camera: usize) -> Self {
        let c = &sequence.cameras[camera];
        let k = &c.intrinsics;
        let (number, index) = (frame.sequence, frame.index);
        let path = |map: &str| format!("{number:02}/{map}/{index:06}_{}.png", c.name);
        let [semantic, instance, depth, normals] = MAPS.map(path);
        let (lens, distortion) = lens(&k.distortion);
        Self {
            file_name: path("image"),
            semantic_file_name: semantic,
            instance_file_name: instance,
            depth_file_name: depth,
            normals_file_name: normals,
            sequence: number,
            frame: index,
            camera: &c.name,
            time_s: frame.time_s,
            fx: k.fx,
            fy: k.fy,
            cx: k.cx,
            cy: k.cy,
            lens,
            distortion,
            world_from_camera: (frame.world_from_body() * c.body_from_camera).to_rows(),
        }
    }
}

/// A picture's files, with their bytes.
fn maps<'a>(
    source: &Source,
    frame: &FrameRef<'_>,
    camera: usize,
    labels: &Labels,
    row: &'a Row<'_>,
) -> Result<[(&'a str, Vec<u8>); 5], Error> {
    let bytes = |file| source.camera_bytes(frame, camera, file);
    let classes = source
        .classes(frame, camera)?
        .map(|&class| labels.id(class) as u8);
    Ok([
        (&row.file_name, bytes(CameraFile::Rgb)?),
        (&row.semantic_file_name, encode_classes(&classes, labels)),
        (&row.instance_file_name, bytes(CameraFile::Instance)?),
        (
            &row.depth_file_name,
            encode_depth(&source.depth_m(frame, camera)?),
        ),
        (&row.normals_file_name, bytes(CameraFile::Normals)?),
    ])
}

/// 8-bit palette: the index is the class id.
fn encode_classes(classes: &Image<u8>, labels: &Labels) -> Vec<u8> {
    let last = labels.classes.iter().map(|c| c.id).max().unwrap_or(0);
    let mut palette = vec![0; 3 * (usize::from(last) + 1)];
    for class in &labels.classes {
        let at = 3 * usize::from(class.id);
        palette[at..at + 3].copy_from_slice(&class.colour);
    }
    let (width, height) = (classes.width(), classes.height());
    let (indexed, eight) = (ColorType::Indexed, BitDepth::Eight);
    png_encoding::encode(
        width,
        height,
        indexed,
        eight,
        Some(palette),
        classes.pixels(),
    )
}

/// 16-bit grey, 256 for a metre; a surface is never 0.
fn encode_depth(depth_m: &Image<f32>) -> Vec<u8> {
    let code = |&z: &f32| {
        if z > 0.0 {
            ((z * 256.0).round() as u16).max(1)
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

/// The data card: YAML for the site, then words.
fn card(source: &Source, labels: &Labels, pictures: usize, parts: &[Part]) -> String {
    let splits: String = (parts.iter())
        .map(|part| {
            let name = split_name(part.split.unwrap_or(Split::Train));
            format!("  - split: {name}\n    path: {}/**\n", data(part.split))
        })
        .collect();
    let classes = labels
        .classes
        .iter()
        .map(|c| format!("| {} | {} |\n", c.id, c.name));
    format!(
        "---\n\
         license: other\n\
         license_name: {}\n\
         task_categories:\n\
         - image-segmentation\n\
         - depth-estimation\n\
         tags:\n\
         - synthetic\n\
         - forest\n\
         configs:\n\
         - config_name: default\n  \
           data_files:\n\
         {splits}\
         ---\n\n\
         # Pictures of virtual forests, with exact truth\n\n\
         {pictures} pictures, made by {} and converted by nemoral-convert. Licence: {}.\n\n\
         - `image`: 8-bit sRGB.\n\
         - `semantic`: the class of each pixel, as below.\n\
         - `instance`: the object of each pixel, R + 256 G + 65536 B; 0 for none.\n\
         - `depth`: planar depth, 16 bits, 256 for a metre; 0 for none.\n\
         - `normals`: the surface normal in the camera's frame (x right, y down, z forward),\n  \
           127.5 (n + 1); (0, 0, 0) for none.\n\
         - `fx`, `fy`, `cx`, `cy`: pixels; the first pixel's centre is at (0.5, 0.5). `lens`\n  \
           and `distortion`: OpenCV's coefficients, k1 k2 p1 p2 k3, or k1 to k4 of a fisheye.\n\
         - `world_from_camera`: the pose, 3 × 4, metres.\n\n\
         All maps are exact at the pixel's centre.\n\n\
         | class | name |\n|---|---|\n{}",
        quoted(source.licence()),
        source.generator(),
        source.licence(),
        classes.collect::<String>(),
    )
}

/// A text as YAML, of which JSON is a part.
fn quoted(text: &str) -> String {
    json!(text).to_string()
}
