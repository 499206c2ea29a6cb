//! The tables, a JSON list each. Those with records of frames are streamed.

use std::collections::BTreeMap;

use nemoral_dataset::Split;
use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DQuat;
use png::{BitDepth, ColorType};
use serde_json::{Map, Value, json};

use super::VERSION;
use super::classes::{self, Classes};
use super::objects::{annotations, instances};
use super::scenes::{Scene, Tokens};
use super::sensors::{Kind, Sensor};
use crate::{Error, FileStream, FrameRef, Sink, Source, png_encoding};

/// Writes all of them, and the files that go with them.
pub(super) fn write(
    source: &Source,
    scenes: &[Scene<'_>],
    classes: &Classes,
    tokens: &Tokens,
    sink: &mut Sink,
) -> Result<(), Error> {
    let has_classes = scenes.iter().any(|scene| scene.top().is_some());
    sink.step("tables", |files| {
        let small = [
            ("attribute", Vec::new()),
            ("visibility", visibilities()),
            ("category", categories(classes, tokens)),
            ("sensor", sensors(scenes, tokens)),
            ("calibrated_sensor", calibrations(scenes, tokens)),
            ("log", logs(scenes, tokens)),
            ("map", vec![map(scenes, tokens)]),
            ("scene", scene_records(source, scenes, tokens)),
        ];
        for (name, records) in small {
            files.put(format!("{VERSION}/{name}.json"), list(&records));
        }
        files.put(format!("{VERSION}/splits.json"), splits(source, scenes));
        if has_classes {
            files.put("lidarseg/colormap.json", colours(classes));
        }
        let (grey, eight) = (ColorType::Grayscale, BitDepth::Eight);
        let black = png_encoding::encode(1, 1, grey, eight, None, &[0]);
        files.put(map_file(tokens), black);
        Ok(String::new())
    })?;
    let rows = |path: &str| format!("{VERSION}/{path}.json");
    sink.stream("sample", &rows("sample"), |out| {
        samples(scenes, tokens, out)
    })?;
    sink.stream("ego_pose", &rows("ego_pose"), |out| {
        ego_poses(scenes, tokens, out)
    })?;
    sink.stream("sample_data", &rows("sample_data"), |out| {
        sample_data(scenes, tokens, out)
    })?;
    if has_classes {
        sink.stream("lidarseg", "lidarseg/lidarseg.json", |out| {
            lidarseg(scenes, tokens, out)
        })?;
    }
    let notes = sink.notes();
    sink.stream("instance", &rows("instance"), |out| {
        instances(scenes, tokens, &notes, out)
    })?;
    sink.stream("sample_annotation", &rows("sample_annotation"), |out| {
        annotations(scenes, tokens, &notes, out)
    })
}

/// Records of a table that is being written, each on a line.
pub(super) struct Rows<'a> {
    out: &'a mut FileStream,
    is_empty: bool,
}

impl<'a> Rows<'a> {
    pub(super) fn begin(out: &'a mut FileStream) -> Result<Self, Error> {
        out.put("[")?;
        let is_empty = true;
        Ok(Self { out, is_empty })
    }

    pub(super) fn put(&mut self, record: &Value) -> Result<(), Error> {
        let comma = if self.is_empty { "\n" } else { ",\n" };
        self.is_empty = false;
        self.out.put(format!("{comma}{record}"))
    }

    pub(super) fn end(self) -> Result<(), Error> {
        self.out.put("\n]\n")
    }
}

/// A table of few records.
fn list(records: &[Value]) -> String {
    let lines: Vec<_> = records.iter().map(Value::to_string).collect();
    format!("[\n{}\n]\n", lines.join(",\n"))
}

fn visibilities() -> Vec<Value> {
    let level = |(i, (low, high)): (usize, (u32, u32))| {
        json!({
            "token": (i + 1).to_string(), "level": format!("v{low}-{high}"),
            "description": format!("visibility of whole object is between {low} and {high}%"),
        })
    };
    let levels = [(0, 40), (40, 60), (60, 80), (80, 100)];
    levels.into_iter().enumerate().map(level).collect()
}

fn categories(classes: &Classes, tokens: &Tokens) -> Vec<Value> {
    let category = |(index, c): (usize, &classes::Category)| {
        json!({
            "token": tokens.category(&c.name), "name": c.name, "description": c.description,
            "index": index,
        })
    };
    let categories = classes.categories.iter().enumerate();
    categories.map(category).collect()
}

fn colours(classes: &Classes) -> String {
    let colours: Map<String, Value> = (classes.categories.iter())
        .map(|c| (c.name.clone(), json!(c.colour)))
        .collect();
    format!("{}\n", Value::from(colours))
}

/// The channels of all sequences.
fn sensors(scenes: &[Scene<'_>], tokens: &Tokens) -> Vec<Value> {
    let sensors = scenes.iter().flat_map(|scene| &scene.sensors);
    let channels: BTreeMap<&str, &Sensor> = sensors.map(|s| (&*s.channel, s)).collect();
    let sensor = |s: &&Sensor| {
        let (token, modality) = (tokens.sensor(s), s.modality());
        json!({ "token": token, "channel": s.channel, "modality": modality })
    };
    channels.values().map(sensor).collect()
}

fn calibrations(scenes: &[Scene<'_>], tokens: &Tokens) -> Vec<Value> {
    let mut records = Vec::new();
    for scene in scenes {
        for sensor in &scene.sensors {
            let matrix = match sensor.kind {
                // The first pixel's centre is at (0, 0).
                Kind::Camera(k) => json!([
                    [k.fx, 0.0, k.cx - 0.5],
                    [0.0, k.fy, k.cy - 0.5],
                    [0.0, 0.0, 1.0]
                ]),
                Kind::Lidar => json!([]),
            };
            records.push(json!({
                "token": tokens.calibrated_sensor(scene, sensor),
                "sensor_token": tokens.sensor(sensor),
                "translation": translation(&sensor.body_from_sensor),
                "rotation": rotation(sensor.body_from_sensor.rotation),
                "camera_intrinsic": matrix,
            }));
        }
    }
    records
}

fn translation(pose: &RigidTransform) -> [f64; 3] {
    // Adding zero turns -0 into 0.
    pose.translation_m.to_array().map(|v| v + 0.0)
}

/// w, x, y, z, with w not negative.
fn rotation(q: DQuat) -> [f64; 4] {
    let q = if q.w < 0.0 { -q } else { q };
    [q.w, q.x, q.y, q.z].map(|v| v + 0.0)
}

fn logs(scenes: &[Scene<'_>], tokens: &Tokens) -> Vec<Value> {
    let log = |scene: &Scene<'_>| {
        json!({
            "token": tokens.log(scene), "logfile": scene.name(), "vehicle": "nemoral",
            // No day is in any file.
            "date_captured": "", "location": scene.name(),
        })
    };
    scenes.iter().map(log).collect()
}

fn map_file(tokens: &Tokens) -> String {
    format!("maps/{}.png", tokens.map())
}

fn map(scenes: &[Scene<'_>], tokens: &Tokens) -> Value {
    let logs: Vec<_> = scenes.iter().map(|scene| tokens.log(scene)).collect();
    json!({
        "token": tokens.map(), "category": "semantic_prior", "filename": map_file(tokens),
        "log_tokens": logs,
    })
}

fn scene_records(source: &Source, scenes: &[Scene<'_>], tokens: &Tokens) -> Vec<Value> {
    let scene = |scene: &Scene<'_>| {
        let number = scene.sequence.number;
        let ends = [scene.frames.first(), scene.frames.last()];
        let [first, last] = ends.map(|f| tokens.sample(f.expect("scenes have frames")));
        json!({
            "token": tokens.scene(scene), "log_token": tokens.log(scene), "name": scene.name(),
            "description": format!("sequence {number:02} by {}", source.generator()),
            "nbr_samples": scene.frames.len(),
            "first_sample_token": first, "last_sample_token": last,
        })
    };
    scenes.iter().map(scene).collect()
}

/// The scenes of each split, which the development kit's `get_scenes_of_split` reads. Names of its
/// own splits would be those of nuScenes' scenes.
fn splits(source: &Source, scenes: &[Scene<'_>]) -> String {
    let of = |split: Split| -> Vec<String> {
        let mine = scenes
            .iter()
            .filter(|s| source.split(s.sequence.number) == split);
        mine.map(Scene::name).collect()
    };
    let splits: Map<String, Value> = (Split::ALL.into_iter())
        .map(|split| (format!("nemoral_{split}"), json!(of(split))))
        .collect();
    format!("{}\n", Value::from(splits))
}

/// The tokens of the neighbours of a record in a list; empty where there is none.
fn neighbours<T>(list: &[T], at: usize, token: impl Fn(&T) -> String) -> [String; 2] {
    let before = at.checked_sub(1).and_then(|i| list.get(i));
    [before, list.get(at + 1)].map(|record| record.map_or_else(String::new, &token))
}

fn samples(scenes: &[Scene<'_>], tokens: &Tokens, out: &mut FileStream) -> Result<(), Error> {
    let mut rows = Rows::begin(out)?;
    for scene in scenes {
        for (i, frame) in scene.frames.iter().enumerate() {
            let [prev, next] = neighbours(&scene.frames, i, |f| tokens.sample(f));
            rows.put(&json!({
                "token": tokens.sample(frame), "timestamp": scene.time_us(frame),
                "scene_token": tokens.scene(scene), "prev": prev, "next": next,
            }))?;
        }
    }
    rows.end()
}

/// One for a frame, as all sensors measure at its time.
fn ego_poses(scenes: &[Scene<'_>], tokens: &Tokens, out: &mut FileStream) -> Result<(), Error> {
    let mut rows = Rows::begin(out)?;
    for scene in scenes {
        for frame in &scene.frames {
            let pose = frame.world_from_body();
            rows.put(&json!({
                "token": tokens.ego_pose(frame), "timestamp": scene.time_us(frame),
                "translation": translation(&pose), "rotation": rotation(pose.rotation),
            }))?;
        }
    }
    rows.end()
}

fn sample_data(scenes: &[Scene<'_>], tokens: &Tokens, out: &mut FileStream) -> Result<(), Error> {
    let mut rows = Rows::begin(out)?;
    for scene in scenes {
        for (i, frame) in scene.frames.iter().enumerate() {
            for sensor in &scene.sensors {
                let token = |f: &FrameRef<'_>| tokens.sample_data(f, sensor);
                let [prev, next] = neighbours(&scene.frames, i, token);
                let (width, height, format) = match sensor.kind {
                    Kind::Camera(k) => (k.width, k.height, "png"),
                    Kind::Lidar => (0, 0, "pcd"),
                };
                rows.put(&json!({
                    "token": token(frame), "sample_token": tokens.sample(frame),
                    "ego_pose_token": tokens.ego_pose(frame),
                    "calibrated_sensor_token": tokens.calibrated_sensor(scene, sensor),
                    "filename": sensor.file(frame), "fileformat": format,
                    "width": width, "height": height, "timestamp": scene.time_us(frame),
                    "is_key_frame": true, "prev": prev, "next": next,
                }))?;
            }
        }
    }
    rows.end()
}

fn lidarseg(scenes: &[Scene<'_>], tokens: &Tokens, out: &mut FileStream) -> Result<(), Error> {
    let mut rows = Rows::begin(out)?;
    for scene in scenes {
        let Some(sensor) = scene.top() else {
            continue;
        };
        for frame in &scene.frames {
            let token = tokens.sample_data(frame, sensor);
            rows.put(&json!({
                "token": token, "sample_data_token": token, "filename": classes::file(&token),
            }))?;
        }
    }
    rows.end()
}
