//! Scanners: pulses out, points in.

use std::fmt;

use nemoral_scene::glam::DVec3;
use nemoral_scene::{
    Hit, LaserBand, LidarPoint, Material, MaterialLibrary, PointFlags, Ray, RayCaster,
    RigidTransform,
};
use nemoral_seed::Key;
use rayon::prelude::*;

use crate::error::check;
use crate::{EchoObservation, ParamError, Pulse, RangeModel, ScanPattern};

/// The laser's wavelength: which of a material's reflectances counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wavelength {
    /// 905 nm (Livox, Velodyne): leaves are bright.
    #[default]
    Nm905,
    /// 1550 nm (terrestrial scanners): bark is brighter than leaves.
    Nm1550,
}

impl Wavelength {
    /// A material's answer at this wavelength.
    #[must_use]
    pub fn band(self, material: &Material) -> LaserBand {
        match self {
            Self::Nm905 => material.optics.nm905,
            Self::Nm1550 => material.optics.nm1550,
        }
    }
}

/// Parameters of a [`Scanner`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScannerParams {
    /// Pulses fired in one scan, at least 1. The points are those that come back.
    pub pulses_per_scan: u32,
    /// The blind zone, metres, at least 0: what is nearer blocks the pulse and is not seen.
    pub min_range_m: f32,
    /// The farthest echo, metres, greater than `min_range_m`.
    pub max_range_m: f32,
    /// The laser's wavelength.
    pub wavelength: Wavelength,
}

impl Default for ScannerParams {
    /// The paper's 50,000 pulses; the range of the Livox Mid-40 and Horizon (260 m at 80 %), with
    /// the blind zone of 0.5 m that Livox writes for its rectangular scanners.
    fn default() -> Self {
        Self {
            pulses_per_scan: 50_000,
            min_range_m: 0.5,
            max_range_m: 260.0,
            wavelength: Wavelength::Nm905,
        }
    }
}

/// A virtual LiDAR: a pattern and how much of it makes a scan.
pub struct Scanner {
    params: ScannerParams,
    pattern: Box<dyn ScanPattern>,
    rate_hz: f64,
}

impl fmt::Debug for Scanner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scanner")
            .field("params", &self.params)
            .field("rate_hz", &self.rate_hz)
            .finish_non_exhaustive()
    }
}

/// Pulses cast together. Fixed, so that the work is cut the same way for any number of threads.
const BATCH: u32 = 2048;

/// The longest scan whose times fit a point's 32-bit nanoseconds.
const MAX_DURATION_S: f64 = u32::MAX as f64 * 1e-9;

impl Scanner {
    /// A scanner with these parameters.
    ///
    /// # Errors
    /// If a parameter is out of its range, if the pattern's rate is not positive, or if the scan would
    /// last longer than 4.29 s (times of points are 32-bit nanoseconds).
    pub fn new(params: ScannerParams, pattern: Box<dyn ScanPattern>) -> Result<Self, ParamError> {
        let pulses = f64::from(params.pulses_per_scan);
        check(pulses >= 1.0, "pulses_per_scan", pulses, "at least 1")?;
        check(
            params.min_range_m.is_finite() && params.min_range_m >= 0.0,
            "min_range_m",
            params.min_range_m.into(),
            "finite and at least 0",
        )?;
        check(
            params.max_range_m.is_finite() && params.max_range_m > params.min_range_m,
            "max_range_m",
            params.max_range_m.into(),
            "finite and greater than min_range_m",
        )?;
        let rate_hz = pattern.rate_hz();
        check(
            rate_hz.is_finite() && rate_hz > 0.0,
            "rate_hz",
            rate_hz,
            "finite and greater than 0",
        )?;
        check(
            pulses / rate_hz <= MAX_DURATION_S,
            "pulses_per_scan",
            pulses,
            "at most what the pattern fires in 4.29 s",
        )?;
        Ok(Self {
            params,
            pattern,
            rate_hz,
        })
    }

    /// The parameters.
    #[must_use]
    pub fn params(&self) -> &ScannerParams {
        &self.params
    }

    /// How long a scan takes, seconds: pulses per scan over the pattern's rate.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        f64::from(self.params.pulses_per_scan) / self.rate_hz
    }

    /// The number of the first pulse of the scan at a frame time, seconds after the first frame (whose
    /// scan starts with the pattern's first pulse).
    ///
    /// So frames show the pattern as it runs on. Where frames follow each other faster than a scan
    /// lasts, scans share pulses, as with a real sensor that is read with a longer integration time;
    /// where they are slower, pulses between the scans are skipped.
    #[must_use]
    pub fn first_pulse_at(&self, frame_time_s: f64) -> u64 {
        (frame_time_s * self.rate_hz).round() as u64
    }

    /// The pulses of the scan that starts at a pulse of the pattern.
    pub fn pulses(&self, first_pulse: u64) -> impl Iterator<Item = Pulse> + '_ {
        (0..self.params.pulses_per_scan)
            .map(move |i| self.pattern.pulse(first_pulse.wrapping_add(i.into())))
    }

    /// One scan: a point for each pulse that comes back, in the order of firing.
    ///
    /// Each pulse is cast from where the LiDAR is when it fires: `scene_from_lidar_at` gives the pose
    /// at a time in seconds relative to the frame's, and the scan is centred on that time, from
    /// −duration/2 to +duration/2. The points are written *deskewed*, in the LiDAR frame at the
    /// frame's time. `first_pulse` says where in the pattern the scan starts
    /// ([`Scanner::first_pulse_at`]).
    ///
    /// A pulse's noise is keyed by `key` and the pulse's number in the pattern: it does not depend on
    /// other pulses. A hit nearer than the blind zone or an echo that `noise` does not see gives no
    /// point. Work is spread over rayon's current thread pool; the result is the same for any.
    #[must_use]
    pub fn scan(
        &self,
        first_pulse: u64,
        caster: &dyn RayCaster,
        materials: &MaterialLibrary,
        scene_from_lidar_at: &(dyn Fn(f64) -> RigidTransform + Sync),
        noise: &dyn RangeModel,
        key: Key,
    ) -> Vec<LidarPoint> {
        let scan = Scan {
            scanner: self,
            first_pulse,
            start_s: self.pattern.pulse(first_pulse).time_s,
            lidar_from_scene: scene_from_lidar_at(0.0).inverse(),
            caster,
            materials,
            scene_from_lidar_at,
            noise,
            key,
        };
        let pulses = self.params.pulses_per_scan;
        let batches: Vec<Vec<LidarPoint>> = (0..pulses.div_ceil(BATCH))
            .into_par_iter()
            .map(|b| scan.batch(b * BATCH, BATCH.min(pulses - b * BATCH)))
            .collect();
        batches.concat()
    }
}

/// What the pulses of one scan have in common.
struct Scan<'a> {
    scanner: &'a Scanner,
    first_pulse: u64,
    /// When the first pulse fires, in the pattern's time.
    start_s: f64,
    /// At the frame's time.
    lidar_from_scene: RigidTransform,
    caster: &'a dyn RayCaster,
    materials: &'a MaterialLibrary,
    scene_from_lidar_at: &'a (dyn Fn(f64) -> RigidTransform + Sync),
    noise: &'a dyn RangeModel,
    key: Key,
}

impl Scan<'_> {
    /// The points of `count` pulses from the `start`-th of the scan on.
    fn batch(&self, start: u32, count: u32) -> Vec<LidarPoint> {
        let pulses: Vec<Pulse> = (start..start + count)
            .map(|i| self.scanner.pattern.pulse(self.number(i)))
            .collect();
        let poses = self.poses(&pulses);
        let rays: Vec<Ray> = pulses
            .iter()
            .zip(&poses)
            .map(|(pulse, pose)| self.ray(pulse, pose))
            .collect();
        let mut hits = vec![None; rays.len()];
        self.caster.closest_hits(&rays, &mut hits);
        (start..)
            .zip(pulses.iter().zip(&poses).zip(rays.iter().zip(&hits)))
            .filter_map(|(i, ((pulse, pose), (ray, hit)))| {
                self.point(i, pulse, pose, ray, hit.as_ref()?)
            })
            .collect()
    }

    /// The number in the pattern of the `i`-th pulse of the scan.
    fn number(&self, i: u32) -> u64 {
        self.first_pulse.wrapping_add(i.into())
    }

    /// Where the LiDAR is in the scene when each pulse fires.
    fn poses(&self, pulses: &[Pulse]) -> Vec<RigidTransform> {
        let middle_s = self.start_s + self.scanner.duration_s() / 2.0;
        // Lasers that fire together share a pose, and poses may cost more than rays.
        let mut fired_s = f64::NAN;
        let mut scene_from_lidar = RigidTransform::IDENTITY;
        let pose = |pulse: &Pulse| {
            if pulse.time_s != fired_s {
                fired_s = pulse.time_s;
                scene_from_lidar = (self.scene_from_lidar_at)(fired_s - middle_s);
            }
            scene_from_lidar
        };
        pulses.iter().map(pose).collect()
    }

    /// The ray of a pulse, in the scene.
    fn ray(&self, pulse: &Pulse, scene_from_lidar: &RigidTransform) -> Ray {
        Ray {
            origin: scene_from_lidar.translation_m.as_vec3(),
            direction: scene_from_lidar.transform_vector(pulse.direction).as_vec3(),
            // From 0, not from the blind zone: what is there blocks the pulse.
            t_min_m: 0.0,
            t_max_m: self.scanner.params.max_range_m,
        }
    }

    fn point(
        &self,
        i: u32,
        pulse: &Pulse,
        scene_from_lidar: &RigidTransform,
        ray: &Ray,
        hit: &Hit,
    ) -> Option<LidarPoint> {
        let params = &self.scanner.params;
        if hit.distance_m < params.min_range_m {
            return None;
        }
        let direction: DVec3 = ray.direction.into();
        // The flat primitive's: it is what stops the light. Its side is the shape's, so it is turned.
        let mut normal: DVec3 = hit.geometric_normal.into();
        if normal.dot(direction) > 0.0 {
            normal = -normal;
        }
        let incidence_cos = (-normal.dot(direction)).clamp(0.0, 1.0);
        let material = self.materials.get(hit.material);
        let reflectance = f64::from(params.wavelength.band(material).reflectance);
        let observation = EchoObservation {
            range_m: hit.distance_m.into(),
            incidence_rad: libm::acos(incidence_cos),
            reflectance,
        };
        let key = self.key.item(self.number(i));
        let range_m = self.noise.measure(&observation, key)?;
        // Along the pulse, not along its ray, whose f32 origin is micrometres beside the LiDAR: a
        // camera at the LiDAR's place, with the same f32 origin, looks along the pulse too.
        let in_scene = scene_from_lidar.transform_point(pulse.direction * range_m);
        let measured = self.lidar_from_scene.transform_point(in_scene);
        let intensity = reflectance * incidence_cos;
        Some(LidarPoint {
            position_m: measured.as_vec3(),
            true_range_m: hit.distance_m,
            range_m: range_m as f32,
            intensity: intensity as f32,
            reflectivity: (150.0 * intensity).round() as u8,
            semantic: material.semantic,
            object: hit.object,
            ring: pulse.ring,
            return_number: 1,
            returns: 1,
            time_offset_ns: ((pulse.time_s - self.start_s) * 1e9).round() as u32,
            pulse: i,
            incidence_cos: incidence_cos as f32,
            normal: self.lidar_from_scene.transform_vector(normal).as_vec3(),
            flags: PointFlags::default(),
        })
    }
}
