//! The header of a data set's manifest.

use std::collections::BTreeMap;

use nemoral_dataset::{
    CameraSpec, DatasetHeader, DepthFormat, FileRecord, ImuSpec, LidarSpec, SequenceSpec, SiteSpec,
};

use crate::config::{self, Config, SequenceConfig, Sequences};
use crate::recording::pose::half_scan_s;
use crate::world::cameras::intrinsics;
use crate::world::lidars::LidarRecipe;
use crate::world::sensor_name;
use crate::{Backend, Error, ForestPlan, InputFiles};

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

/// Where the world of a config lies on the earth; `None` if nothing of it is somebody's site.
pub(crate) fn site_spec(config: &Config, inputs: &InputFiles) -> Result<Option<SiteSpec>, Error> {
    let site = &config.site;
    let epsg = config.site_epsg(inputs)?;
    let files = [&site.stems.path, &site.terrain.path, &site.trails.path];
    let is_site = epsg.is_some() || files.iter().any(|path| !path.is_empty());
    Ok(is_site.then_some(SiteSpec {
        epsg,
        origin_m: [site.origin_x_m, site.origin_y_m, site.terrain.origin_z_m],
    }))
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
            name: sensor_name(&path).to_owned(),
            intrinsics: intrinsics(&path, camera)?,
            body_from_camera: camera.body_from_camera(),
            annotations: camera.annotation_kinds(),
            shutter: camera.shutter_times(),
            noisy: camera.noise.enabled,
            processed: camera.is_processed(),
        })
    };
    let lidar = |(path, lidar): (String, &config::Lidar)| LidarSpec {
        name: sensor_name(&path).to_owned(),
        body_from_lidar: lidar.body_from_lidar(),
        deskewed: lidar.deskew,
        pointing_errors: lidar.errors.angular_deg > 0.0,
        ply: config.output.ply,
    };
    let rigs = (LidarRecipe::all(config, &sequence.inputs).iter())
        .map(LidarRecipe::make)
        .collect::<Result<Vec<_>, _>>()?;
    let inputs = (sequence.inputs.carried().into_iter())
        .map(|(path, bytes)| FileRecord::of(path, &bytes))
        .collect();
    Ok(SequenceSpec {
        number: sequence.number,
        seed: config.seed,
        split: sequence.split,
        drawn: serde_json::Value::Object(sequence.drawn_as_carried()).into(),
        site: site_spec(config, &sequence.inputs)?,
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
        // What is written does not depend on where the files lay.
        config: (serde_json::to_value(sequence.as_carried()))
            .expect("a config is plain data")
            .into(),
        config_toml: sequence.to_toml(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ConfigLayers;

    fn sequences(settings: &[&str]) -> Sequences {
        let layers = ConfigLayers {
            settings: settings.iter().map(|s| (*s).to_owned()).collect(),
            ..ConfigLayers::default()
        };
        layers.sequences().expect("a request")
    }

    fn header_of(settings: &[&str]) -> DatasetHeader {
        header(&sequences(settings), &Backend::Cpu).expect("a header")
    }

    #[test]
    fn a_sequence_says_how_long_its_longest_scan_takes() {
        let half_scan_s = |settings: &[&str]| header_of(settings).sequences[0].half_scan_s;
        // 240,000 pulses a second.
        assert_eq!(half_scan_s(&["lidar.pulses=24000"]), Some(0.05));
        let second = ["lidar.pulses=24000", "lidars.rear.pulses=480000"];
        assert_eq!(half_scan_s(&second), Some(1.0));
        assert_eq!(half_scan_s(&["lidar.enabled=false"]), None);
    }

    #[test]
    fn a_world_with_files_or_a_code_lies_somewhere() {
        let origin = ["site.origin_x_m=553220", "site.origin_y_m=4450330"];
        let height = "site.terrain.origin_z_m=73";
        let place = |settings: &[&str]| {
            let settings = [&origin[..], settings].concat();
            let only = sequences(&settings).get(0).expect("one");
            site_spec(&only.config, &only.inputs).expect("a place")
        };
        assert_eq!(place(&[height]), None);
        let origin_m = [553_220.0, 4_450_330.0, 73.0];
        let at = |epsg| Some(SiteSpec { epsg, origin_m });
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("trails.geojson");
        let lines = r#"{"type":"FeatureCollection","features":[{"type":"Feature","geometry":
            {"type":"LineString","coordinates":[[553196,4450288],[553195,4450352]]}}]}"#;
        nemoral_files::write(&path, lines.as_bytes()).expect("written");
        let trails = format!("site.trails.path={}", path.display());
        assert_eq!(place(&[&trails, height]), at(None));
        assert_eq!(place(&["site.epsg=25829", height]), at(Some(25_829)));
        // The header of a data set has it.
        let here = header_of(&["site.epsg=25829", "site.origin_x_m=7"]);
        let origin_m = [7.0, 0.0, 0.0];
        let epsg = Some(25_829);
        assert_eq!(here.sequences[0].site, Some(SiteSpec { epsg, origin_m }));
        let invented = header_of(&["site.origin_x_m=7"]);
        assert_eq!(invented.sequences[0].site, None);
        assert_eq!(
            invented.sequences[0].stage_keys,
            here.sequences[0].stage_keys
        );
    }
}
