//! The robot's sensors, made from a config.

use std::f64::consts::TAU;
use std::sync::Arc;

use nemoral_lidar::{
    Avia, Beam, CsvPattern, EchoObservation, HorizonLike, Mid40, Mid70, Panorama, PanoramaParams,
    PulseErrors, RangeModel, RepeatingLines, RepeatingLinesParams, Returns, ScanPattern, Scanner,
    ScannerParams, Spinning, Wavelength,
};
use nemoral_lidar_noise::{
    IncidenceLawParams, LaconteDevice, LaconteForm, LinearSigmaParams, RangeEquationParams,
    RangeNoise, RangeSensor, SnrSigmaParams,
};
use nemoral_render::{
    Exposure, Lens, Lighting, RayCastCamera, RayCastParams, SensorNoise, SkyParams, Sun, ToneCurve,
    UtcTime,
};
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{AnnotationKinds, Distortion, Intrinsics, ParamError, RigidTransform, Shutter};
use nemoral_seed::{Domain, Key};

use super::assets::Recipe;
use crate::config::{
    self, CameraLens, CameraOptics, Config, LIGHT_M_PER_NS, LidarPattern, SunPosition,
};
use crate::plan::{Encode, Encoder, Forest, Hasher, Stage};
use crate::{Backend, Error, InputFile, InputFiles, Renderer};

/// Of the fixed patterns of sensors.
const SPECIMEN: Domain = Domain::new("pipeline.camera.specimen");

/// A camera with its place on the body.
#[derive(Debug)]
pub struct CameraRig {
    /// Its name: the first one's is `camera`.
    pub name: String,
    /// Pinhole.
    pub intrinsics: Intrinsics,
    /// From the optical frame.
    pub body_from_camera: RigidTransform,
    /// Takes the pictures; cameras of one look share it.
    pub renderer: Arc<Renderer>,
    /// How bright they come out.
    pub exposure: Exposure,
    /// And how light becomes brightness.
    pub tone: ToneCurve,
    /// When its rows see light.
    pub shutter: Shutter,
    /// What its sensor adds.
    pub noise: Option<SensorNoise>,
    /// What else is to be known of a picture.
    pub extra: AnnotationKinds,
    /// Boxes of things up to so far, metres.
    pub boxes_range_m: f64,
}

/// The LiDAR with its place on the body.
#[derive(Debug)]
pub struct LidarRig {
    /// Its name: the first one's is `lidar`.
    pub name: String,
    /// From the LiDAR frame.
    pub body_from_lidar: RigidTransform,
    /// Fires the pulses.
    pub scanner: Scanner,
    /// Errs.
    pub noise: Noise,
}

/// lidar-noise behind lidar's port.
#[derive(Debug)]
pub struct Noise(RangeSensor);

impl RangeModel for Noise {
    fn measure(&self, o: &EchoObservation, key: Key) -> Option<f64> {
        self.0.measure(o, &mut key.rng())
    }

    fn measure_each(&self, os: &[EchoObservation], keys: &[Key], ranges_m: &mut [Option<f64>]) {
        let rngs = keys.iter().map(|key| key.rng());
        self.0.measure_each(os, rngs, ranges_m);
    }
}

/// The pinhole of the camera whose table is at `path`.
///
/// # Errors
/// If it is impossible; the config's ranges leave little room for that.
pub fn intrinsics(path: &str, camera: &config::Camera) -> Result<Intrinsics, Error> {
    lens(camera).map_err(|e| Error::request(format!("{path}.{e}")))
}

/// The camera's pinhole and lens; the error names the key below the camera's table.
pub(crate) fn lens(camera: &config::Camera) -> Result<Intrinsics, ParamError> {
    let (width, height) = (camera.width_px, camera.height_px);
    let distortion = match &camera.lens {
        CameraLens::Pinhole(_) => Distortion::None,
        CameraLens::BrownConrady(b) => Distortion::BrownConrady {
            k1: b.k1,
            k2: b.k2,
            k3: b.k3,
            p1: b.p1,
            p2: b.p2,
        },
        CameraLens::Fisheye(f) => Distortion::Fisheye {
            k1: f.k1,
            k2: f.k2,
            k3: f.k3,
            k4: f.k4,
        },
    };
    match &camera.optics {
        CameraOptics::Fov(fov) => {
            let fov_rad = fov.horizontal_deg.to_radians();
            Intrinsics::through_lens(width, height, fov_rad, distortion)
        }
        CameraOptics::Sensor(s) => {
            let size = DVec2::new(s.width_mm, s.height_mm);
            Intrinsics::from_sensor(width, height, size, s.focal_length_mm)?
                .with_distortion(distortion)
        }
        CameraOptics::Calibration(c) => {
            let (focal, centre) = (DVec2::new(c.fx_px, c.fy_px), DVec2::new(c.cx_px, c.cy_px));
            Intrinsics::from_calibration(width, height, focal, centre)?.with_distortion(distortion)
        }
    }
}

/// What a camera writes besides its pictures and their truth.
#[must_use]
pub fn extra_kinds(c: &config::Camera) -> AnnotationKinds {
    AnnotationKinds {
        sky: c.sky,
        flow: c.flow,
        trunks: c.trunks,
        boxes: c.boxes,
        radiance: c.radiance,
    }
}

/// When the camera's rows see light.
#[must_use]
pub fn shutter(c: &config::Camera) -> Shutter {
    Shutter {
        exposure_s: c.shutter.exposure_ms / 1000.0,
        readout_s: c.shutter.readout_ms / 1000.0,
    }
}

/// What the camera's sensor adds.
fn noise(c: &config::Camera, serial: Key) -> Option<SensorNoise> {
    let n = &c.noise;
    n.enabled.then_some(SensorNoise {
        full_well_e: n.full_well_e,
        read_noise_e: n.read_noise_e,
        gain: n.gain,
        gain_below_ev: n.gain_below_ev,
        prnu: n.prnu,
        dsnu_e: n.dsnu_e,
        bits: n.bits,
        serial,
    })
}

/// Where the camera's optical frame sits on the body.
#[must_use]
pub fn body_from_camera(c: &config::Camera) -> RigidTransform {
    mount(
        [c.mount_x_m, c.mount_y_m, c.mount_z_m],
        c.mount_pitch_deg,
        c.mount_yaw_deg,
    ) * RigidTransform::body_from_optical()
}

/// Where the LiDAR frame sits on the body.
#[must_use]
pub fn body_from_lidar(l: &config::Lidar) -> RigidTransform {
    mount(
        [l.mount_x_m, l.mount_y_m, l.mount_z_m],
        l.mount_pitch_deg,
        l.mount_yaw_deg,
    )
}

fn mount(position_m: [f64; 3], pitch_deg: f64, yaw_deg: f64) -> RigidTransform {
    let position = DVec3::from_array(position_m);
    RigidTransform::from_xyz_rpy(position, 0.0, pitch_deg.to_radians(), yaw_deg.to_radians())
}

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

    fn sun(&self) -> Result<Sun, Error> {
        match &self.sun.position {
            SunPosition::Angles(a) => Sun::from_angles(a.azimuth_deg, a.elevation_deg),
            SunPosition::Date(d) => Sun::at(d.latitude_deg, d.longitude_deg, utc(d)?),
        }
        .map_err(|e| Error::request(format!("sun: {e}")))
    }
}

/// The date and time of a sun by its date.
pub(crate) fn utc(date: &config::SunDate) -> Result<UtcTime, Error> {
    let refused = |why: &dyn std::fmt::Display| {
        Error::request(format!("sun.date.utc = \"{}\": {why}", date.utc))
    };
    let time = parse_utc(&date.utc)
        .ok_or_else(|| refused(&"must be a date and time, YYYY-MM-DDThh:mm:ss"))?;
    time.later(date.later_h).map_err(|e| refused(&e))
}

/// `YYYY-MM-DDThh:mm:ss`, with or without a `Z`.
fn parse_utc(text: &str) -> Option<UtcTime> {
    let (date, time) = text.trim_end_matches('Z').split_once('T')?;
    let date: Vec<&str> = date.split('-').collect();
    let time: Vec<f64> = time
        .split(':')
        .map(|w| w.parse().ok())
        .collect::<Option<_>>()?;
    let (&[year, month, day], &[h, m, s]) = (date.as_slice(), time.as_slice()) else {
        return None;
    };
    let inside = (0.0..24.0).contains(&h) && (0.0..60.0).contains(&m) && (0.0..60.0).contains(&s);
    inside.then_some(UtcTime {
        year: year.parse().ok()?,
        month: month.parse().ok()?,
        day: day.parse().ok()?,
        hour: h + m / 60.0 + s / 3600.0,
    })
}

impl Stage<Forest> for CameraStage {
    type At = ();
    type Inputs = ();
    type Output = Vec<CameraRig>;
    const ID: &'static str = "world.cameras";
    const VERSION: u32 = 3;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.inputs.encode(hasher, self);
    }

    fn run(&self, (): (), world: Key, (): ()) -> Result<Vec<CameraRig>, Error> {
        let sky = SkyParams {
            turbidity: self.sky.turbidity,
            overcast: self.sky.overcast,
            sun_intensity: self.sun.intensity,
            sun_tint: DVec3::from_array(self.sun.colour).as_vec3().max(Vec3::ZERO),
            visibility_m: self.weather.visibility_m,
            haze_height_m: self.weather.haze_height_m,
            fog_per_m: self.weather.fog_per_m,
            fog_base_m: self.weather.fog_base_m,
            fog_height_m: self.weather.fog_height_m,
            foliage_albedo: self.trees.foliage_albedo()?,
            ..SkyParams::default()
        };
        let sun = self.sun()?;
        let lighting = match super::sky_image::read(&self.sky, &self.inputs)? {
            None => Lighting::new(&sun, &sky),
            Some(image) => Lighting::photographed(&sun, &sky, &image, self.sky.image_gain),
        }
        .map_err(Error::of_stage)?;
        let mut rigs = Vec::new();
        let renderers = self.renderers(&lighting)?;
        for ((path, camera), renderer) in self.cameras.iter().zip(renderers) {
            // Before the first picture, and so before anything is written.
            renderer.check_size(camera.width_px, camera.height_px)?;
            let name = config::sensor_name(path);
            let serial = world.domain(SPECIMEN).domain(Domain::new(name));
            rigs.push(CameraRig {
                name: name.to_owned(),
                intrinsics: intrinsics(path, camera)?,
                body_from_camera: body_from_camera(camera),
                renderer,
                exposure: exposure(camera),
                tone: look(&camera.look).0,
                shutter: shutter(camera),
                noise: noise(camera, serial),
                extra: extra_kinds(camera),
                boxes_range_m: camera.boxes_range_m,
            });
        }
        Ok(rigs)
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

/// The share of pixels that edges may be.
const EDGES: f32 = 0.1;

impl CameraStage {
    /// Each camera's.
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

    fn ray_cast(&self, camera: &config::Camera) -> RayCastParams {
        let edge_samples = camera.edge_samples.saturating_sub(camera.samples);
        RayCastParams {
            lens: look(&camera.look).1,
            colour_samples: camera.samples,
            edge_samples,
            edge_budget: EDGES * edge_samples as f32,
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
        camera: &config::Camera,
        memory_mib: u32,
    ) -> Result<nemoral_render::GpuParams, Error> {
        if camera.bounces > 0 {
            return Err(Error::request(format!(
                "{path}.bounces = {}: light is followed on the CPU alone; 0 with a GPU",
                camera.bounces
            )));
        }
        Ok(nemoral_render::GpuParams {
            lens: look(&camera.look).1,
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

/// A renderer for each of these parameters; equal ones share one, as a GPU holds the scene once for each.
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

fn exposure(camera: &config::Camera) -> Exposure {
    match Exposure::default() {
        Exposure::Auto { key, .. } if camera.exposure == "auto" => Exposure::Auto {
            key,
            bias_ev: camera.exposure_bias_ev,
        },
        _ => Exposure::Fixed {
            ev100: camera.exposure_ev,
        },
    }
}

/// What the looks of the config are.
fn look(name: &str) -> (ToneCurve, Lens) {
    match name {
        "cinema" => (
            ToneCurve::Filmic,
            Lens {
                veiling_glare: 0.01,
                halo: 0.02,
                vignetting: 0.2,
            },
        ),
        "flat" => (ToneCurve::Linear, Lens::default()),
        // A small plastic lens on a small sensor.
        _ => (
            ToneCurve::Linear,
            Lens {
                veiling_glare: 0.02,
                halo: 0.06,
                vignetting: 0.5,
            },
        ),
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

impl Stage<Forest> for LidarStage {
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
        self.lidars.iter().map(LidarMaker::make).collect()
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

impl LidarMaker {
    fn make(&self) -> Result<LidarRig, Error> {
        let scanner = Scanner::new(self.scanner_params(), self.pattern()?);
        let noise = RangeSensor::new(self.noise());
        Ok(LidarRig {
            name: config::sensor_name(&self.path).to_owned(),
            body_from_lidar: body_from_lidar(&self.params),
            scanner: scanner.map_err(|e| self.refused("", e))?,
            noise: Noise(noise.map_err(|e| self.refused(".noise", e))?),
        })
    }

    fn refused(&self, table: &str, why: impl std::fmt::Display) -> Error {
        Error::request(format!("{}{table}: {why}", self.path))
    }

    fn pattern(&self) -> Result<Box<dyn ScanPattern>, Error> {
        let refused = |e| self.refused("", e);
        Ok(match &self.params.pattern {
            LidarPattern::Mid40(_) => Box::new(Mid40),
            LidarPattern::Mid70(_) => Box::new(Mid70),
            LidarPattern::Avia(_) => Box::new(Avia),
            LidarPattern::Horizon(_) => Box::new(HorizonLike),
            LidarPattern::Lines(l) => {
                // A turn holds the pulses asked for.
                let columns = self.params.pulses.div_ceil(l.lines).max(1);
                let params = RepeatingLinesParams {
                    lines: l.lines as u8,
                    bottom_rad: l.low_deg.to_radians(),
                    top_rad: l.high_deg.to_radians(),
                    horizontal_fov_rad: TAU,
                    columns,
                    rotation_hz: l.rotation_hz,
                };
                Box::new(RepeatingLines::new(params).map_err(refused)?)
            }
            LidarPattern::Spinning(s) => {
                let head = match s.head.as_str() {
                    "vlp16" => Spinning::vlp16(s.rotation_hz),
                    "hdl64e" => Spinning::hdl64e(s.rotation_hz),
                    _ => Spinning::ouster(
                        s.vertical_fov_deg.to_radians(),
                        s.beams as u8,
                        s.columns,
                        s.rotation_hz,
                    ),
                };
                Box::new(head.map_err(refused)?)
            }
            LidarPattern::Panorama(p) => {
                let (bottom, top) = (p.low_deg.to_radians(), p.high_deg.to_radians());
                // Square cells of the angles.
                let pulses = f64::from(self.params.pulses);
                let rows = (pulses * (top - bottom) / TAU).sqrt().round().max(1.0);
                let params = PanoramaParams {
                    rows: rows as u32,
                    columns: self.params.pulses.div_ceil(rows as u32),
                    bottom_rad: bottom,
                    top_rad: top,
                    rate_hz: p.rate_hz,
                };
                Box::new(Panorama::new(params).map_err(refused)?)
            }
            LidarPattern::Table(table) => {
                let file = self.inputs.get(&table.path);
                let pattern = CsvPattern::from_csv(file.map_or(&[][..], InputFile::bytes));
                Box::new(pattern.map_err(|e| {
                    Error::request(format!("{}.table: {}: {e}", self.path, table.path))
                })?)
            }
        })
    }

    fn scanner_params(&self) -> ScannerParams {
        let l = &self.params;
        ScannerParams {
            pulses_per_scan: l.pulses,
            min_range_m: l.min_range_m as f32,
            // All sensors see equally far.
            max_range_m: l.max_range_m.min(self.visible_radius_m) as f32,
            wavelength: if l.wavelength_nm == 1550 {
                Wavelength::Nm1550
            } else {
                Wavelength::Nm905
            },
            beam: Beam {
                horizontal_fwhm_rad: l.beam.horizontal_deg.to_radians(),
                vertical_fwhm_rad: l.beam.vertical_deg.to_radians(),
                rings: l.beam.rings as u8,
                resolution_m: 0.5 * LIGHT_M_PER_NS * l.beam.pulse_ns,
            },
            returns: match l.returns.as_str() {
                "first" => Returns::First,
                "last" => Returns::Last,
                "dual" => Returns::Dual,
                "all" => Returns::All(l.max_returns as u8),
                _ => Returns::Strongest,
            },
            errors: PulseErrors {
                angular_sigma_rad: l.errors.angular_deg.to_radians(),
                range_step_m: l.errors.range_step_m,
                dropout: l.errors.dropout,
                false_alarm: l.errors.false_alarm,
            },
            deskew: l.deskew,
        }
    }

    fn noise(&self) -> RangeNoise {
        let n = &self.params.noise;
        match n.model.as_str() {
            "off" => RangeNoise::Off,
            "paper" => RangeNoise::Paper { sigma_m: n.sigma_m },
            "laconte" => RangeNoise::Laconte {
                device: match n.laconte_device.as_str() {
                    "lms1xx" => LaconteDevice::SickLms1xx,
                    _ => LaconteDevice::VelodyneHdl32e,
                },
                form: if n.laconte_closed {
                    LaconteForm::Closed
                } else {
                    LaconteForm::Waveform
                },
                sigma_m: n.sigma_m,
            },
            "incidence" => RangeNoise::Incidence(IncidenceLawParams {
                error_m: n.floor_m,
                ..IncidenceLawParams::default()
            }),
            "linear" => RangeNoise::Linear(LinearSigmaParams {
                min_m: n.floor_m,
                base_m: 0.0,
                per_metre: n.per_metre,
            }),
            _ => RangeNoise::SignalToNoise {
                range: RangeEquationParams {
                    reference_range_m: n.reference_range_m,
                    reference_reflectance: n.reference_reflectance,
                    extinction_per_m: n.extinction_per_m,
                },
                sigma: SnrSigmaParams {
                    floor_m: n.floor_m,
                    at_threshold_m: n.at_threshold_m,
                },
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use nemoral_render::{CameraRenderer, OpenSky, SceneView, View};
    use nemoral_scene::{Hit, Material, MaterialId, MaterialLibrary, Ray, RayCaster, Semantic};

    use super::*;

    /// A grey card before the lens, wherever it looks.
    struct GreyCard;

    impl RayCaster for GreyCard {
        fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
            Some(Hit::new(1.0, -ray.direction, MaterialId(0)))
        }
    }

    /// 18 % of what a light meter reads: sRGB's 118, and 125 by the filmic curve.
    #[test]
    fn a_grey_card_has_its_code_value_in_every_look() {
        let mut camera = config::Camera {
            exposure: "fixed".to_owned(),
            exposure_ev: 12.0,
            ..config::Camera::default()
        };
        let mut materials = MaterialLibrary::new();
        materials.add(Material::plain("card", Semantic::Rock, Vec3::splat(0.18)));
        let scene = SceneView {
            caster: &GreyCard,
            instances: None,
            materials: &materials,
            sky_visibility: &OpenSky,
        };
        // In an integrating sphere, as bright as EV 12 is meant for.
        let white = 0.125 * 4096.0 / 0.18;
        for (name, code) in [("robot", 118), ("cinema", 125), ("flat", 118)] {
            let (tone, lens) = look(name);
            let params = RayCastParams {
                lens,
                ..RayCastParams::draft()
            };
            let renderer = RayCastCamera::new(params, Lighting::uniform(Vec3::splat(white)));
            let mut shoot = |ev: f64| {
                camera.exposure_ev = ev;
                let view = View {
                    exposure: exposure(&camera),
                    tone,
                    ..View::new(
                        Intrinsics::from_fov(33, 21, 0.5).expect("a pinhole"),
                        RigidTransform::body_from_optical(),
                    )
                };
                let renderer = renderer.as_ref().expect("valid");
                let images = renderer.render(&scene, &view, Key::world(1));
                images.expect("renders").rgb.at(16, 10)[1]
            };
            let got = shoot(12.0);
            assert!(got.abs_diff(code) <= 1, "{name}: {got} for {code}");
            // A stop more is half the light.
            assert!(shoot(13.0) < got - 25, "{name}");
        }
    }
}
