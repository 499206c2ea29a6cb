//! RELLIS-3D's layout, with its class ids:
//! ```text
//! 00000/pylon_camera_node/frameFFFFFF-SECONDS_MILLISECONDS.png
//! 00000/pylon_camera_node_label_id/frameFFFFFF-SECONDS_MILLISECONDS.png
//! 00000/os1_cloud_node_kitti_bin/FFFFFF.bin
//! 00000/os1_cloud_node_semantickitti_label_id/FFFFFF.label
//! 00000/camera_info.txt            fx fy cx cy of the first camera, as OpenCV has them: the first
//!                                  pixel's centre is at (0, 0)
//! 00000/calib.txt  poses.txt       as in KITTI's odometry benchmark
//! {train,val,test}.lst             pictures and their labels
//! pt_{train,val,test}.lst          scans and their labels
//! ```
//! The first camera and the first LiDAR are written. Pictures are PNG, where RELLIS-3D has JPEG;
//! lists name them. Splits are [`Source::split`]'s. A LiDAR's false alarms are void, not sky.
//! Source: Jiang et al. (ICRA 2021) and the data set's `README.md`.

use nemoral_dataset::Manifest;
use nemoral_scene::{Ontology, Semantic};

use crate::formats::kitti::{calibration, poses};
use crate::geometry::line;
use crate::labels::Labels;
use crate::{ClassMapping, Error, Format, FrameRef, Sink, Source, png_encoding};

/// The format.
#[derive(Debug)]
pub(crate) struct Rellis {
    pub(crate) ontology: Option<ClassMapping>,
}

impl Rellis {
    fn labels(&self, own: &Ontology) -> Result<Labels, Error> {
        let table = match &self.ontology {
            Some(table) => table.clone(),
            None => ClassMapping::load("rellis")?,
        };
        Labels::of(own, Some(&table))?.in_bytes()
    }
}

impl Format for Rellis {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        self.labels(&manifest.header.ontology).map(drop)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        let labels = self.labels(source.ontology())?;
        let sky = source.ontology().class(Semantic::Sky).id;
        for sequence in source.sequences() {
            let folder = format!("{:05}", sequence.number);
            for frame in source.frames(sequence.number) {
                sink.step(&format!("frame-{}", frame.name()), |files| {
                    if !sequence.cameras.is_empty() {
                        let [picture, map] = picture_names(&frame);
                        files.put(picture, source.picture_bytes(&frame, 0)?);
                        let classes = source.classes(&frame, 0)?.map(|&c| labels.id(c) as u8);
                        files.put(map, png_encoding::encode_grey(&classes));
                    }
                    if !sequence.lidars.is_empty() {
                        let [bin, label] = scan_names(&frame);
                        let scan = source.scan(&frame, 0)?;
                        let points = scan.points.iter().flatten().flat_map(|v| v.to_le_bytes());
                        files.put(bin, points.collect::<Vec<u8>>());
                        let id = |class: u8| match class {
                            alarm if alarm == sky => 0,
                            class => u32::from(labels.id(class)),
                        };
                        let words = (scan.labels.iter())
                            .map(|&(class, instance)| id(class as u8) | u32::from(instance) << 16);
                        let words = words.flat_map(u32::to_le_bytes);
                        files.put(label, words.collect::<Vec<u8>>());
                    }
                    Ok(String::new())
                })?;
            }
            sink.step(&format!("sequence-{folder}"), |files| {
                let frames: Vec<_> = source.frames(sequence.number).collect();
                files.put(format!("{folder}/poses.txt"), poses(&sequence, &frames));
                files.put(format!("{folder}/calib.txt"), calibration(&sequence));
                if let Some(camera) = sequence.cameras.first() {
                    let k = &camera.intrinsics;
                    let text = line([k.fx, k.fy, k.cx - 0.5, k.cy - 0.5]);
                    files.put(format!("{folder}/camera_info.txt"), text);
                }
                Ok(String::new())
            })?;
        }
        sink.step("lists", |files| {
            let mut lists = [const { String::new() }; 6];
            for sequence in source.sequences() {
                let split = source.split(sequence.number) as usize;
                for frame in source.frames(sequence.number) {
                    if !sequence.cameras.is_empty() {
                        lists[split] += &format!("{}\n", picture_names(&frame).join(" "));
                    }
                    if !sequence.lidars.is_empty() {
                        lists[3 + split] += &format!("{}\n", scan_names(&frame).join(" "));
                    }
                }
            }
            let names = ["train", "val", "test", "pt_train", "pt_val", "pt_test"];
            for (name, list) in names.into_iter().zip(lists) {
                files.put(format!("{name}.lst"), list);
            }
            Ok(String::new())
        })
    }
}

/// The paths of a frame's picture and of its label map.
fn picture_names(frame: &FrameRef<'_>) -> [String; 2] {
    let milliseconds = (frame.time_s * 1000.0).round() as i64;
    let (seconds, rest) = (milliseconds.div_euclid(1000), milliseconds.rem_euclid(1000));
    let name = format!("frame{:06}-{seconds}_{rest:03}.png", frame.index);
    ["pylon_camera_node", "pylon_camera_node_label_id"]
        .map(|folder| format!("{:05}/{folder}/{name}", frame.sequence))
}

/// The paths of a frame's scan and of its labels.
fn scan_names(frame: &FrameRef<'_>) -> [String; 2] {
    let (number, index) = (frame.sequence, frame.index);
    [
        format!("{number:05}/os1_cloud_node_kitti_bin/{index:06}.bin"),
        format!("{number:05}/os1_cloud_node_semantickitti_label_id/{index:06}.label"),
    ]
}
