//! The robot's LiDARs.

use nemoral_lidar::{EchoObservation, RangeModel, Scanner};
use nemoral_lidar_noise::RangeNoiseSampler;
use nemoral_scene::RigidTransform;
use nemoral_seed::Key;

use super::sensor_name;
use crate::config::{Config, Lidar, Weather};
use crate::plan::{Encode, Encoder, Hasher};
use crate::{Error, InputFiles};

/// A LiDAR with its place on the body.
#[derive(Debug)]
pub struct LidarRig {
    /// The name of its table, which is `lidar` for the first one.
    pub name: String,
    /// The transform from the LiDAR's frame to the body's.
    pub body_from_lidar: RigidTransform,
    /// The scanner.
    pub scanner: Scanner,
    /// The model of its range errors.
    pub noise: RangeModelAdapter,
}

impl LidarRig {
    /// The LiDAR whose table is at `path`.
    fn new(
        path: &str,
        lidar: &Lidar,
        visible_radius_m: f64,
        weather: &Weather,
        inputs: &InputFiles,
    ) -> Result<Self, Error> {
        let params = lidar.scanner_params(visible_radius_m, weather);
        let scanner = Scanner::new(params, lidar.scan_pattern(path, inputs)?);
        let noise = RangeNoiseSampler::new(lidar.range_noise());
        Ok(Self {
            name: sensor_name(path).to_owned(),
            body_from_lidar: lidar.body_from_lidar(),
            scanner: scanner.map_err(|e| refused_at(path, e))?,
            noise: RangeModelAdapter(noise.map_err(|e| refused_at(&format!("{path}.noise"), e))?),
        })
    }
}

/// An error of the table at `path`.
fn refused_at(path: &str, why: impl std::fmt::Display) -> Error {
    Error::request(format!("{path}: {why}"))
}

/// A noise model of lidar-noise behind the port of lidar.
#[derive(Debug)]
pub struct RangeModelAdapter(pub RangeNoiseSampler);

impl RangeModel for RangeModelAdapter {
    fn measure(&self, o: &EchoObservation, key: Key) -> Option<f64> {
        self.0.measure(o, &mut key.rng())
    }

    fn measure_each(&self, os: &[EchoObservation], keys: &[Key], ranges_m: &mut [Option<f64>]) {
        let rngs = keys.iter().map(|key| key.rng());
        self.0.measure_each(os, rngs, ranges_m);
    }
}

/// One of the robot's LiDARs, as a config describes it.
#[derive(Clone, Debug)]
pub(crate) struct LidarRecipe {
    /// Its table in the config.
    path: String,
    params: Lidar,
    visible_radius_m: f64,
    weather: Weather,
    inputs: InputFiles,
}

impl LidarRecipe {
    /// The recipes of all LiDARs of a config.
    pub(crate) fn all(config: &Config, inputs: &InputFiles) -> Vec<Self> {
        let recipe = |(path, lidar): (String, &Lidar)| Self {
            path,
            params: lidar.clone(),
            visible_radius_m: config.chunks.visible_radius_m,
            weather: config.weather.clone(),
            inputs: inputs.clone(),
        };
        config.all_lidars().map(recipe).collect()
    }

    pub(crate) fn fingerprint(&self, hasher: &mut Hasher) {
        self.inputs.encode(hasher, self);
    }

    /// The LiDAR.
    pub(crate) fn make(&self) -> Result<LidarRig, Error> {
        LidarRig::new(
            &self.path,
            &self.params,
            self.visible_radius_m,
            &self.weather,
            &self.inputs,
        )
    }
}

impl Encode for LidarRecipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            path,
            params,
            visible_radius_m,
            weather,
            inputs: _,
        } = self;
        encoder.field(path, params);
        encoder.field("visible_radius_m", visible_radius_m);
        encoder.field("weather", weather);
    }
}
