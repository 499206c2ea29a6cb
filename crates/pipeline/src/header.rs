//! The header of a data set's manifest.

use nemoral_dataset::{CameraSpec, DatasetHeader, DepthFormat, LidarSpec};
use nemoral_scene::Ontology;

use crate::config::{self, Config};
use crate::world::cameras::intrinsics;
use crate::{Error, ForestPlan};

/// The header, which has everything that decides the bytes of a data set.
///
/// # Errors
/// If a camera is invalid.
pub fn header(config: &Config, forest: &ForestPlan) -> Result<DatasetHeader, Error> {
    let ontology = Ontology::by_name(&config.output.ontology)
        .expect("the config's words are the built-in ontologies");
    let stage_keys = forest
        .plan()
        .provenance()
        .into_iter()
        .enumerate()
        .map(|(i, (id, key))| {
            // Stage ids may repeat (rock phases), so they are numbered in the order of the plan.
            (format!("{i:02} {id}"), key.to_string())
        });
    let camera = |(path, camera): (String, &config::Camera)| {
        Ok::<_, Error>(CameraSpec {
            name: config::sensor_name(&path).to_owned(),
            intrinsics: intrinsics(&path, camera)?,
            body_from_camera: camera.body_from_camera(),
            annotations: camera.annotation_kinds(),
            shutter: camera.shutter_times(),
            noisy: camera.noise.enabled,
        })
    };
    let lidar = |(path, lidar): (String, &config::Lidar)| LidarSpec {
        name: config::sensor_name(&path).to_owned(),
        body_from_lidar: lidar.body_from_lidar(),
        deskewed: lidar.deskew,
        pointing_errors: lidar.errors.angular_deg > 0.0,
        ply: config.output.ply,
    };
    Ok(DatasetHeader {
        generator: "nemoral".to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: config.seed,
        backend: forest.backend().name(),
        chunk_size_m: config.chunks.size_m,
        depth_format: if config.output.depth_npy {
            DepthFormat::Npy
        } else {
            DepthFormat::Png16
        },
        licence: String::new(),
        ontology,
        cameras: config.all_cameras().map(camera).collect::<Result<_, _>>()?,
        lidars: config.all_lidars().map(lidar).collect(),
        stage_keys: stage_keys.collect(),
        config: serde_json::to_value(config).expect("a config is plain data"),
        config_toml: config.to_toml(),
    })
}
