//! Scanners at a user's own scenes.

use nemoral_lidar::{
    AirParams, Device, PulseErrors, ScanRequest, Scanner as VirtualScanner, ScannerParams,
};
use nemoral_lidar_noise::RangeNoiseSampler;
use nemoral_pipeline::world::lidars::RangeModelAdapter;
use nemoral_scene::{LidarPoint, ParamError};
use nemoral_seed::{Domain, Key};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::built_scene::Built;
use crate::failure::Failure;
use crate::ray_scene::RayScene;
use crate::{arrays, config, work};

const SCAN: Domain = Domain::new("python.scan");

/// A scanner by its data sheet.
#[pyclass(frozen)]
pub(crate) struct Scanner {
    device: Device,
    scanner: VirtualScanner,
    range_model: RangeModelAdapter,
}

#[pymethods]
impl Scanner {
    /// A device by its name. `settings` are keys of a config, whose `[lidar.noise]` is the model of
    /// range errors; `errors` is whether there are those of pointing, detection and intensity;
    /// `rings` is the number of rings of sub-rays of a beam; `air` is whether there is that of
    /// `[weather]`; `deskew` is whether points are in the LiDAR's frame of the scan's time.
    #[new]
    #[expect(clippy::too_many_arguments, reason = "the keywords of one function")]
    fn new(
        py: Python<'_>,
        device: &str,
        settings: &Bound<'_, PyList>,
        errors: bool,
        pulses: Option<u32>,
        rings: Option<u8>,
        max_range_m: Option<f32>,
        air: bool,
        deskew: bool,
    ) -> PyResult<Self> {
        let request = config::Request::new(None, None, settings)?;
        let make = || {
            let known = Device::from_name(device).ok_or_else(|| {
                let names: Vec<_> = Device::ALL.iter().map(|d| d.name()).collect();
                let allowed = format!("one of {}", names.join(", "));
                Failure::argument("device", format!("{device:?}"), allowed)
            })?;
            let mut params: ScannerParams = known.params();
            if let Some(pulses) = pulses {
                params.pulses_per_scan = pulses;
            }
            if let Some(rings) = rings {
                params.beam.rings = rings;
            }
            if let Some(max_range_m) = max_range_m {
                params.max_range_m = max_range_m;
            }
            let config = request.sequences()?.get(0)?.config;
            let of_config = config.lidar.pulse_errors();
            params.errors = if errors {
                PulseErrors {
                    intensity_at_threshold: of_config.intensity_at_threshold,
                    reflectance_spread: of_config.reflectance_spread,
                    ..params.errors
                }
            } else {
                PulseErrors::default()
            };
            params.deskew = deskew;
            let of_weather = config.lidar.air_params(&config.weather);
            params.air = if air {
                of_weather
            } else {
                // The spread of intensities is that of the same receiver.
                AirParams {
                    reference_range_m: of_weather.reference_range_m,
                    reference_reflectance: of_weather.reference_reflectance,
                    ..params.air
                }
            };
            let noise = config.lidar.range_noise();
            let scanner = VirtualScanner::new(params, known.pattern());
            Ok(Self {
                device: known,
                scanner: scanner.map_err(|e| as_argument(e, params.min_range_m))?,
                range_model: RangeModelAdapter(RangeNoiseSampler::new(noise)?),
            })
        };
        make().map_err(|e: Failure| e.raise(py))
    }

    /// Title, source and duration of a scan.
    fn about(&self) -> (&'static str, &'static str, f64, u32) {
        let sheet = self.device.sheet();
        let (duration_s, pulses) = (
            self.scanner.duration_s(),
            self.scanner.params().pulses_per_scan,
        );
        (sheet.title, sheet.source, duration_s, pulses)
    }

    /// Names of all devices.
    #[staticmethod]
    fn devices() -> Vec<&'static str> {
        Device::ALL.iter().map(|d| d.name()).collect()
    }

    /// A scan of a scene from a pose, around which the LiDAR moves in its own axes, as packed
    /// records.
    #[expect(clippy::too_many_arguments, reason = "the keywords of one function")]
    fn scan<'py>(
        &self,
        py: Python<'py>,
        scene: &RayScene,
        pose: [f64; 16],
        time_s: f64,
        seed: u64,
        index: u64,
        linear_m_s: [f64; 3],
        angular_rad_s: [f64; 3],
    ) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let bytes = work::brief(py, |pool| {
            if !(0.0..=1e9).contains(&time_s) {
                return Err(Failure::argument("time_s", time_s, "0 to 1e9 s"));
            }
            let scene_from_lidar = arrays::transform("pose", &pose)?;
            let motion = arrays::motion(linear_m_s, angular_rad_s)?;
            let scene_from_lidar_at = |offset_s: f64| {
                if motion.is_still() {
                    scene_from_lidar
                } else {
                    scene_from_lidar * motion.after(offset_s)
                }
            };
            let built = scene.built(pool);
            let request = ScanRequest {
                first_pulse: self.scanner.first_pulse_at(time_s),
                caster: &built.caster,
                materials: &built.materials,
                scene_from_lidar_at: &scene_from_lidar_at,
                range_model: &self.range_model,
                key: Key::world(seed).domain(SCAN).item(index),
            };
            let points = pool.install(|| self.scanner.scan(&request));
            let mut bytes = Vec::with_capacity(RECORD_BYTES * points.len());
            for point in &points {
                write(point, &built, &mut bytes);
            }
            Ok(bytes)
        })?;
        Ok(PyArray1::from_vec(py, bytes))
    }
}

/// A refused parameter by the name of its argument.
fn as_argument(mut error: ParamError, min_range_m: f32) -> ParamError {
    if error.field == "pulses_per_scan" {
        error.field = "pulses".to_owned();
    }
    let blind_zone = format!("the blind zone, {min_range_m} m");
    error.allowed = error.allowed.replace("min_range_m", &blind_zone);
    error
}

/// Bytes of a record: x, y, z, range, true range, intensity, semantic, instance, pulse, t,
/// incidence, normal, ring, return, returns, flags, reflectivity.
const RECORD_BYTES: usize = 6 * 4 + 3 * 4 + 8 + 4 * 4 + 5;

fn write(p: &LidarPoint, built: &Built, out: &mut Vec<u8>) {
    let mut floats = |values: &[f32]| {
        for value in values {
            out.extend_from_slice(&value.to_le_bytes());
        }
    };
    floats(&p.position_m.to_array());
    floats(&[p.range_m, p.true_range_m, p.intensity]);
    let [semantic, instance] = built.labels(p.object);
    for word in [semantic, instance, p.pulse] {
        out.extend_from_slice(&word.to_le_bytes());
    }
    out.extend_from_slice(&(p.time_ns as f64 / 1e9).to_le_bytes());
    let [x, y, z] = p.normal.to_array();
    for value in [p.incidence_cos, x, y, z] {
        out.extend_from_slice(&value.to_le_bytes());
    }
    out.extend_from_slice(&[
        p.ring,
        p.return_number,
        p.returns,
        p.flags.0,
        p.reflectivity,
    ]);
}
