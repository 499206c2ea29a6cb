//! The robot's sensors, made from a config.

use nemoral_render::Lighting;
use nemoral_seed::Key;

use crate::config::{self, Config, sky_image, sky_params};
use crate::plan::{Encode, Encoder, Hasher, Stage};
use crate::world::cameras::{CameraBuilder, CameraRig};
use crate::world::lidars::LidarRig;
use crate::world::recipe::Recipe;
use crate::{Backend, Error, InputFiles};

/// Makes the robot's cameras.
#[derive(Clone, Debug)]
pub struct CameraStage {
    /// Their tables in the config, and what these say.
    cameras: Vec<(String, config::Camera)>,
    sun: config::Sun,
    sky: config::Sky,
    weather: config::Weather,
    max_range_m: f64,
    backend: Backend,
    /// Whose leaves light passes.
    trees: Recipe,
    inputs: InputFiles,
}

impl CameraStage {
    /// The stage of a config and the files that it names.
    #[must_use]
    pub fn new(config: &Config, inputs: &InputFiles, backend: Backend) -> Self {
        Self {
            backend,
            trees: Recipe::new(config, inputs),
            inputs: inputs.clone(),
            cameras: config.all_cameras().map(|(p, c)| (p, c.clone())).collect(),
            sun: config.sun.clone(),
            sky: config.sky.clone(),
            weather: config.weather.clone(),
            max_range_m: config.chunks.visible_radius_m,
        }
    }
}

impl Stage for CameraStage {
    type At = ();
    type Inputs = ();
    type Output = Vec<CameraRig>;
    const ID: &'static str = "world.cameras";
    const VERSION: u32 = 3;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.inputs.encode(hasher, self);
    }

    fn run(&self, (): (), world: Key, (): ()) -> Result<Vec<CameraRig>, Error> {
        let foliage = self.trees.foliage_albedo()?;
        let sky = sky_params(&self.sun, &self.sky, &self.weather, foliage);
        let sun = self.sun.place()?;
        let lighting = match sky_image(&self.sky, &self.inputs)? {
            None => Lighting::new(&sun, &sky),
            Some(image) => Lighting::photographed(&sun, &sky, &image, self.sky.image_gain),
        }
        .map_err(Error::of_stage)?;
        let builder = CameraBuilder {
            cameras: &self.cameras,
            backend: &self.backend,
            max_range_m: self.max_range_m,
        };
        builder.build(&lighting, world)
    }
}

impl Encode for CameraStage {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            cameras,
            sun,
            sky,
            weather,
            max_range_m,
            backend,
            trees,
            inputs: _,
        } = self;
        for (path, camera) in cameras {
            encoder.field(path, camera);
        }
        encoder.field("sun", sun);
        encoder.field("sky", sky);
        encoder.field("weather", weather);
        encoder.field("max_range_m", max_range_m);
        encoder.field("backend", &backend.name());
        encoder.field("trees", trees);
    }
}

/// Makes the robot's LiDARs.
#[derive(Clone, Debug)]
pub struct LidarStage {
    lidars: Vec<LidarMaker>,
}

/// Makes a [`LidarRig`].
#[derive(Clone, Debug)]
struct LidarMaker {
    /// Its table in the config.
    path: String,
    params: config::Lidar,
    visible_radius_m: f64,
    inputs: InputFiles,
}

impl LidarStage {
    /// The stage of a config and the files that it names.
    #[must_use]
    pub fn new(config: &Config, inputs: &InputFiles) -> Self {
        let maker = |(path, lidar): (String, &config::Lidar)| LidarMaker {
            path,
            params: lidar.clone(),
            visible_radius_m: config.chunks.visible_radius_m,
            inputs: inputs.clone(),
        };
        Self {
            lidars: config.all_lidars().map(maker).collect(),
        }
    }
}

impl Stage for LidarStage {
    type At = ();
    type Inputs = ();
    type Output = Vec<LidarRig>;
    const ID: &'static str = "world.lidars";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        for lidar in &self.lidars {
            lidar.inputs.encode(hasher, lidar);
        }
    }

    fn run(&self, (): (), _: Key, (): ()) -> Result<Vec<LidarRig>, Error> {
        let rig = |l: &LidarMaker| LidarRig::new(&l.path, &l.params, l.visible_radius_m, &l.inputs);
        self.lidars.iter().map(rig).collect()
    }
}

impl Encode for LidarMaker {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            path,
            params,
            visible_radius_m,
            inputs: _,
        } = self;
        encoder.field(path, params);
        encoder.field("visible_radius_m", visible_radius_m);
    }
}
