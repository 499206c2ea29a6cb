//! nuScenes' layout, as nuscenes-devkit, mmdetection3d and OpenPCDet read it:
//! ```text
//! samples/CHANNEL/SS_FFFFFF__CHANNEL.png      pictures of all cameras
//! samples/CHANNEL/SS_FFFFFF__CHANNEL.pcd.bin  scans of all LiDARs: x y z intensity ring, float32
//! maps/TOKEN.png                              one black pixel, as there is no map
//! v1.0-trainval/TABLE.json                    the tables
//! v1.0-trainval/splits.json                   the scenes of each split
//! lidarseg/v1.0-trainval/TOKEN_lidarseg.bin   a class for each point of LIDAR_TOP, uint8
//! lidarseg/lidarseg.json  colormap.json       what the development kit needs to read these
//! ```
//! Without any LiDAR there is no `lidarseg`.
//!
//! The version is `v1.0-trainval`, as that is the one that programs train and validate with; of
//! `v1.0-mini` they expect ten scenes. A sequence is a scene, and a frame a sample: all are key
//! frames, without sweeps between them. The global frame is the data set's world.
//!
//! `lidarseg.json` lies outside of the tables because the development kit, where it finds one
//! there, loads nothing without colours for all categories, which programs for boxes do not give.
//!
//! Source: the development kit's `docs/schema_nuscenes.md` and its `nuscenes.py`.

mod annotations;
mod classes;
mod notes;
mod objects;
mod scans;
mod scenes;
mod sensors;
mod tables;

use nemoral_dataset::Manifest;
use nemoral_scene::Distortion;

use crate::formats::{refuse_times_beyond, refuse_times_that_do_not_rise, refuse_without_cameras};
use crate::{ClassMapping, Error, Format, FrameRef, Sink, Source, StepFiles};
use classes::Classes;
use scenes::{Scene, Tokens, scenes};

/// The name of the format, the version of the tables, and the channel of the first LiDAR.
const FORMAT: &str = "nuscenes";
const VERSION: &str = "v1.0-trainval";
const LIDAR_TOP: &str = "LIDAR_TOP";

/// The format.
#[derive(Debug)]
pub(crate) struct NuScenes {
    pub(crate) ontology: Option<ClassMapping>,
}

fn unsuitable(reason: String) -> Error {
    Error::Unsuitable {
        format: FORMAT,
        reason,
    }
}

impl Format for NuScenes {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        refuse_without_cameras(FORMAT, manifest)?;
        Classes::of(&manifest.header.ontology, self.ontology.as_ref())?;
        for sequence in &manifest.header.sequences {
            let number = sequence.number;
            if sequence.cameras.iter().all(|c| !c.annotations.boxes) {
                return Err(unsuitable(format!(
                    "no camera of sequence {number:02} has boxes; make the data set with \
                     camera.boxes = true"
                )));
            }
            let mut cameras = sequence.cameras.iter();
            if let Some(camera) = cameras.find(|c| c.intrinsics.distortion != Distortion::None) {
                return Err(unsuitable(format!(
                    "camera '{}' of sequence {number:02} has a lens, whose coefficients have no \
                     place in nuScenes' tables, so that boxes would lie beside their objects; make \
                     the data set without brown_conrady and fisheye",
                    camera.name
                )));
            }
            sensors::of(number, &sequence.cameras, &sequence.lidars)?;
        }
        refuse_times_beyond(FORMAT, manifest)?;
        refuse_times_that_do_not_rise(FORMAT, manifest, |a, b| b - a < 1e-6)?;
        scenes::starts_us(manifest).map(drop)
    }

    fn notes(&self, manifest: &Manifest) -> Vec<String> {
        notes::of(&manifest.header)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        let classes = Classes::of(source.ontology(), self.ontology.as_ref())?;
        let scenes = scenes(source)?;
        let tokens = Tokens::of(source);
        for scene in &scenes {
            for frame in &scene.frames {
                sink.step(&scenes::step(frame), |files| {
                    let mut found = annotations::of_frame(source, scene, frame)?;
                    pictures(source, scene, frame, files)?;
                    for sensor in scene.sensors.iter().filter(|s| !s.is_camera()) {
                        let scan = scans::read(source, scene.sequence, frame, sensor.index)?;
                        files.put(sensor.file(frame), scans::encode(&scan));
                        if sensor.channel == LIDAR_TOP {
                            let token = tokens.sample_data(frame, sensor);
                            files.put(classes::file(&token), classes.of_points(&scan));
                            let chunk = frame.sensor_chunk(sensor.index);
                            annotations::count_points(&scan, chunk, &mut found);
                        }
                    }
                    let found: Vec<_> = found.into_values().collect();
                    Ok(serde_json::to_string(&found).expect("numbers"))
                })?;
            }
        }
        tables::write(source, &scenes, &classes, &tokens, sink)
    }
}

/// A frame's pictures, byte for byte.
fn pictures(
    source: &Source,
    scene: &Scene<'_>,
    frame: &FrameRef<'_>,
    files: &mut StepFiles,
) -> Result<(), Error> {
    for sensor in scene.sensors.iter().filter(|s| s.is_camera()) {
        let picture = source.picture_bytes(frame, sensor.index)?;
        files.put(sensor.file(frame), picture);
    }
    Ok(())
}
