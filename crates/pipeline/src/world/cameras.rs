//! The robot's cameras.

use std::collections::BTreeMap;
use std::sync::Arc;

use nemoral_render::{
    Exposure, Lamp, LampParams, Lighting, Metering, Processing, RayCastCamera, RayCastParams,
    SensorNoise, Soiling, ToneCurve, View,
};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{AnnotationKinds, Intrinsics, ParamError, RigidTransform, Shutter, Twist};
use nemoral_seed::{Domain, Key};

use super::library_recipe::LibraryRecipe;
use super::sensor_name;
use super::sky_params::sky_params;
use crate::config::{self, Camera, Config};
use crate::plan::{Encode, Encoder, Hasher};
use crate::{Backend, Error, InputFiles, Renderer};

/// The domain of the fixed patterns of sensors.
const SPECIMEN: Domain = Domain::new("pipeline.camera.specimen");

/// A camera with its place on the body.
#[derive(Clone, Debug)]
pub struct CameraRig {
    /// The name of its table, which is `camera` for the first one.
    pub name: String,
    /// Its pinhole and lens.
    pub intrinsics: Intrinsics,
    /// The transform from the optical frame to the body's.
    pub body_from_camera: RigidTransform,
    /// The renderer that takes the pictures; cameras of the same look share one.
    pub renderer: Arc<Renderer>,
    /// The exposure of its pictures.
    pub exposure: Exposure,
    /// What automatic exposure looks at.
    pub metering: Metering,
    /// What the exposure is wrong by, stops.
    pub exposure_error_ev: f64,
    /// The tone curve.
    pub tone: ToneCurve,
    /// When its rows are exposed.
    pub shutter: Shutter,
    /// The noise of its sensor.
    pub noise: Option<SensorNoise>,
    /// Dirt and drops on its lens.
    pub soiling: Option<Soiling>,
    /// The rain that it takes pictures in.
    pub rain_mm_per_h: f64,
    /// The same of snow, as water.
    pub snowfall_mm_per_h: f64,
    /// What it makes of the sensor's values.
    pub processing: Processing,
    /// The lamps that it sees by, which all cameras share.
    pub lamps: Arc<[MountedLamp]>,
    /// The annotations that are asked for.
    pub annotations: AnnotationKinds,
    /// Whether its pictures show light from where no ray through a pixel leads: light that is
    /// followed comes from anywhere.
    pub looks_all_around: bool,
    /// Objects farther away than this, metres, get no boxes.
    pub boxes_range_m: f64,
}

/// A lamp on the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountedLamp {
    /// Its light.
    pub params: LampParams,
    /// Its place on the body; it shines along its x axis.
    pub body_from_lamp: RigidTransform,
}

impl MountedLamp {
    /// The lamp in a scene.
    ///
    /// # Errors
    /// If its light is out of range, which the allowed ranges of the config exclude.
    fn at(&self, scene_from_body: &RigidTransform) -> Result<Lamp, ParamError> {
        let scene_from_lamp = *scene_from_body * self.body_from_lamp;
        let ahead = scene_from_lamp.transform_vector(DVec3::X);
        Lamp::new(&self.params, scene_from_lamp.translation_m, ahead)
    }
}

impl CameraRig {
    /// A camera whose table is at `path`; `renderer` takes its pictures.
    fn new(
        path: &str,
        camera: &Camera,
        renderer: Arc<Renderer>,
        weather: &config::Weather,
        lamps: Arc<[MountedLamp]>,
        world: Key,
    ) -> Result<Self, Error> {
        // This is checked before the first picture, and so before anything is written.
        renderer.check_size(camera.width_px, camera.height_px)?;
        let intrinsics = intrinsics(path, camera)?;
        let (tone, lens) = camera.tone_and_lens();
        let of_lens = |e: ParamError| Error::request(format!("{path}.vignetting: {e}"));
        lens.check_for(&intrinsics).map_err(of_lens)?;
        let name = sensor_name(path);
        let serial = world.domain(SPECIMEN).domain(Domain::new(name));
        Ok(Self {
            name: name.to_owned(),
            intrinsics,
            body_from_camera: camera.body_from_camera(),
            renderer,
            exposure: camera.exposure_mode(),
            metering: camera.metering_mode(),
            exposure_error_ev: camera.exposure_error_ev,
            tone,
            shutter: camera.shutter_times(),
            noise: camera.sensor_noise(serial),
            soiling: camera.soiled(serial),
            rain_mm_per_h: weather.rain_mm_per_h,
            snowfall_mm_per_h: weather.snowfall_mm_per_h,
            processing: camera.image_processing(),
            lamps,
            annotations: camera.annotation_kinds(),
            looks_all_around: camera.bounces > 0,
            boxes_range_m: camera.boxes_range_m,
        })
    }

    /// The view of a picture that it takes from a pose of the body, which moves like this.
    pub(crate) fn view(&self, scene_from_body: RigidTransform, motion: Twist) -> View {
        View {
            motion: motion.of_mounted(&self.body_from_camera),
            shutter: self.shutter,
            exposure: self.exposure,
            metering: self.metering,
            exposure_error_ev: self.exposure_error_ev,
            tone: self.tone,
            noise: self.noise,
            soiling: self.soiling,
            processing: self.processing,
            ..View::new(self.intrinsics, scene_from_body * self.body_from_camera)
        }
    }

    /// The lamps, on a body at this pose.
    pub(crate) fn lamps_on(&self, scene_from_body: &RigidTransform) -> Result<Vec<Lamp>, Error> {
        let lamps = self.lamps.iter().map(|lamp| lamp.at(scene_from_body));
        lamps.collect::<Result<_, _>>().map_err(Error::of_stage)
    }
}

/// The pinhole of the camera whose table is at `path`.
///
/// # Errors
/// If it is invalid, which the allowed ranges of the config almost exclude.
pub fn intrinsics(path: &str, camera: &Camera) -> Result<Intrinsics, Error> {
    camera
        .intrinsics()
        .map_err(|e| Error::request(format!("{path}.{e}")))
}

/// The robot's cameras, as a config describes them.
#[derive(Clone, Debug)]
pub(crate) struct CameraRecipe {
    /// The paths of their tables, and the tables.
    cameras: Vec<(String, Camera)>,
    lamps: BTreeMap<String, config::Lamp>,
    sun: config::Sun,
    moon: config::Moon,
    sky: config::Sky,
    weather: config::Weather,
    max_range_m: f64,
    backend: Backend,
    /// The trees, whose leaves scatter light.
    trees: LibraryRecipe,
    inputs: InputFiles,
}

impl CameraRecipe {
    pub(crate) fn new(config: &Config, inputs: &InputFiles, backend: Backend) -> Self {
        Self {
            backend,
            trees: LibraryRecipe::new(config, inputs),
            inputs: inputs.clone(),
            cameras: config.all_cameras().map(|(p, c)| (p, c.clone())).collect(),
            lamps: config.all_lamps().map(|(p, l)| (p, l.clone())).collect(),
            sun: config.sun.clone(),
            moon: config.moon.clone(),
            sky: config.sky.clone(),
            weather: config.weather.clone(),
            max_range_m: config.chunks.visible_radius_m,
        }
    }

    pub(crate) fn fingerprint(&self, hasher: &mut Hasher) {
        self.inputs.encode(hasher, self);
    }

    /// The cameras, which share one light.
    pub(crate) fn make(&self, world: Key) -> Result<Vec<CameraRig>, Error> {
        let renderers = self.renderers(&self.lighting()?)?;
        let mounted = |lamp: &config::Lamp| MountedLamp {
            params: lamp.params(),
            body_from_lamp: lamp.body_from_lamp(),
        };
        let lamps: Arc<[MountedLamp]> = self.lamps.values().map(mounted).collect();
        (self.cameras.iter().zip(renderers))
            .map(|((path, camera), renderer)| {
                CameraRig::new(path, camera, renderer, &self.weather, lamps.clone(), world)
            })
            .collect()
    }

    fn lighting(&self) -> Result<Lighting, Error> {
        let foliage = self.trees.foliage_albedo()?;
        let moon = self.moon.place(&self.sun)?;
        let sky = sky_params(&self.sun, moon, &self.sky, &self.weather, foliage);
        let sun = self.sun.place()?;
        match self.sky.photograph(&self.inputs)? {
            None => Lighting::new(&sun, &sky),
            Some(image) => Lighting::photographed(&sun, &sky, &image, self.sky.image_gain),
        }
        .map_err(Error::of_stage)
    }

    /// The renderer of each camera.
    fn renderers(&self, lighting: &Lighting) -> Result<Vec<Arc<Renderer>>, Error> {
        match &self.backend {
            Backend::Cpu => shared(
                self.cameras
                    .iter()
                    .map(|(_, camera)| Ok(self.ray_cast(camera))),
                |params| {
                    let camera = RayCastCamera::new(*params, lighting.clone());
                    Ok(Renderer::Cpu(Box::new(camera.map_err(Error::of_stage)?)))
                },
            ),
            #[cfg(feature = "gpu")]
            Backend::Gpu { gpu, memory_mib } => shared(
                (self.cameras.iter()).map(|(path, camera)| self.on_gpu(path, camera, *memory_mib)),
                |params| {
                    let camera = nemoral_render::GpuCamera::new(gpu, *params, lighting.clone());
                    Ok(Renderer::Gpu(Box::new(camera.map_err(Error::of_stage)?)))
                },
            ),
        }
    }

    fn ray_cast(&self, camera: &Camera) -> RayCastParams {
        let edge_samples = camera.edge_samples.saturating_sub(camera.samples);
        RayCastParams {
            lens: camera.tone_and_lens().1,
            colour_samples: camera.samples,
            edge_samples,
            edge_budget: edge_samples as f32,
            blur_samples: camera.shutter.samples,
            bounces: camera.bounces,
            max_range_m: self.max_range_m as f32,
            keep_linear: camera.radiance,
        }
    }

    #[cfg(feature = "gpu")]
    fn on_gpu(
        &self,
        path: &str,
        camera: &Camera,
        memory_mib: u32,
    ) -> Result<nemoral_render::GpuParams, Error> {
        if let Some(lamp) = self.lamps.keys().next() {
            return Err(Error::request(format!(
                "{lamp}.enabled = true: lamps shine on the CPU alone; false with a GPU"
            )));
        }
        if camera.bounces > 0 {
            return Err(Error::request(format!(
                "{path}.bounces = {}: light is followed on the CPU alone; 0 with a GPU",
                camera.bounces
            )));
        }
        Ok(nemoral_render::GpuParams {
            lens: camera.tone_and_lens().1,
            max_range_m: self.max_range_m as f32,
            keep_linear: camera.radiance,
            colour_samples: match camera.samples.max(camera.edge_samples) {
                1 => 1,
                _ => 4,
            },
            blur_samples: camera.shutter.samples,
            memory_mib,
            ..Default::default()
        })
    }
}

impl Encode for CameraRecipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            cameras,
            lamps,
            sun,
            moon,
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
        for (path, lamp) in lamps {
            encoder.field(path, lamp);
        }
        encoder.field("sun", sun);
        encoder.field("moon", moon);
        encoder.field("sky", sky);
        encoder.field("weather", weather);
        encoder.field("max_range_m", max_range_m);
        encoder.field("backend", &backend.name());
        encoder.field("trees", trees);
    }
}

/// A renderer for each of these parameters. Equal ones share one, as a GPU holds the scene once for
/// each.
fn shared<P: PartialEq>(
    params: impl Iterator<Item = Result<P, Error>>,
    make: impl Fn(&P) -> Result<Renderer, Error>,
) -> Result<Vec<Arc<Renderer>>, Error> {
    let params = params.collect::<Result<Vec<P>, Error>>()?;
    let mut all: Vec<Arc<Renderer>> = Vec::new();
    for (i, wanted) in params.iter().enumerate() {
        let alike = params[..i].iter().position(|before| before == wanted);
        all.push(match alike {
            Some(before) => Arc::clone(&all[before]),
            None => Arc::new(make(wanted)?),
        });
    }
    Ok(all)
}
