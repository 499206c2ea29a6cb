//! The header of a data set's manifest.

use std::collections::BTreeMap;

use nemoral_dataset::{
    CameraSpec, DatasetHeader, DepthFormat, FileRecord, ImuSpec, LidarSpec, SequenceSpec,
};

use crate::config::{self, Config, SEQUENCE_UP, SequenceConfig, Sequences};
use crate::recording::pose::half_scan_s;
use crate::world::cameras::intrinsics;
use crate::world::lidars::LidarRecipe;
use crate::{Backend, Error, ForestPlan};

/// The header, which has everything that decides the bytes of a data set.
///
/// # Errors
/// If a sequence's config is impossible.
pub fn header(sequences: &Sequences, backend: &Backend) -> Result<DatasetHeader, Error> {
    let first = sequences.get(0)?;
    let mut input_files = BTreeMap::new();
    let spec = |number| {
        let sequence = sequences.get(number)?;
        input_files.extend(sequence.inputs.carried());
        let forest = ForestPlan::with_inputs(&sequence.config, &sequence.inputs, backend.clone());
        let spec = forest.and_then(|forest| sequence_spec(&sequence, &forest));
        spec.map_err(|e| e.in_sequence(number, sequences.len()))
    };
    let specs = (0..sequences.len()).map(spec).collect::<Result<_, _>>()?;
    Ok(DatasetHeader {
        generator: "nemoral".to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: sequences.seed(),
        backend: backend.name(),
        licence: String::new(),
        ontology: first.config.output.ontology.table(),
        sequences: specs,
        config_toml: sequences.to_toml()?,
        input_files,
    })
}

fn imu_spec(imu: &config::Imu) -> ImuSpec {
    let params = imu.params();
    let (gyroscope, accelerometer) = (params.errors.gyroscope, params.errors.accelerometer);
    ImuSpec {
        body_from_imu: imu.body_from_imu(),
        rate_hz: params.rate_hz,
        angular_rate_noise_rad_s: gyroscope.noise_density * params.rate_hz.sqrt(),
        specific_force_noise_m_s2: accelerometer.noise_density * params.rate_hz.sqrt(),
    }
}

/// What decides the bytes of a sequence.
pub(crate) fn sequence_spec(
    sequence: &SequenceConfig,
    forest: &ForestPlan,
) -> Result<SequenceSpec, Error> {
    let config: &Config = &sequence.config;
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
            processed: camera.is_processed(),
        })
    };
    let lidar = |(path, lidar): (String, &config::Lidar)| LidarSpec {
        name: config::sensor_name(&path).to_owned(),
        body_from_lidar: lidar.body_from_lidar(),
        deskewed: lidar.deskew,
        pointing_errors: lidar.errors.angular_deg > 0.0,
        ply: config.output.ply,
    };
    let rigs = (LidarRecipe::all(config, &sequence.inputs).iter())
        .map(LidarRecipe::make)
        .collect::<Result<Vec<_>, _>>()?;
    let json = |value: &toml::Value| serde_json::to_value(value).expect("TOML is plain data");
    // What is written does not depend on where the files lay.
    let carried = |path: &str| sequence.inputs.carried_name(path);
    let drawn = sequence.drawn.iter().map(|(key, value)| {
        match value.as_str().filter(|_| config::most_bytes(key) > 0) {
            Some(path) => (key.clone(), carried(path).into()),
            None => (key.clone(), json(value)),
        }
    });
    let inputs = (sequence.inputs.carried().into_iter())
        .map(|(path, bytes)| FileRecord::of(path, &bytes))
        .collect();
    let from_sequence = |path: &str| match carried(path) {
        name if name.is_empty() => name,
        name => format!("{SEQUENCE_UP}{name}"),
    };
    Ok(SequenceSpec {
        number: sequence.number,
        seed: config.seed,
        split: sequence.split,
        drawn: serde_json::Value::Object(drawn.collect()).into(),
        site: config.place(&sequence.inputs)?,
        chunk_size_m: config.chunks.size_m,
        has_deadwood: config.deadwood.has_objects(),
        has_estimated_poses: config.navigation.enabled,
        depth_format: if config.output.depth_npy {
            DepthFormat::Npy
        } else {
            DepthFormat::Png16
        },
        cameras: config.all_cameras().map(camera).collect::<Result<_, _>>()?,
        lidars: config.all_lidars().map(lidar).collect(),
        half_scan_s: (!rigs.is_empty()).then(|| half_scan_s(&rigs)),
        imu: config.imu.enabled.then(|| imu_spec(&config.imu)),
        stage_keys: stage_keys.collect(),
        inputs,
        config: (serde_json::to_value(config.with_files(&carried)))
            .expect("a config is plain data")
            .into(),
        config_toml: config.with_files(&from_sequence).to_toml(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ConfigLayers;

    #[test]
    fn a_sequence_says_how_long_its_longest_scan_takes() {
        let half_scan_s = |settings: &[&str]| {
            let layers = ConfigLayers {
                settings: settings.iter().map(|s| (*s).to_owned()).collect(),
                ..ConfigLayers::default()
            };
            let sequences = layers.sequences().expect("a request");
            let header = header(&sequences, &Backend::Cpu).expect("a header");
            header.sequences[0].half_scan_s
        };
        // 240,000 pulses a second.
        assert_eq!(half_scan_s(&["lidar.pulses=24000"]), Some(0.05));
        let second = ["lidar.pulses=24000", "lidars.rear.pulses=480000"];
        assert_eq!(half_scan_s(&second), Some(1.0));
        assert_eq!(half_scan_s(&["lidar.enabled=false"]), None);
    }
}
