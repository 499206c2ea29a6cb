//! Scanners: pulses out, points in.

use std::fmt;

use nemoral_scene::{LaserBand, LidarPoint, Material, MaterialLibrary, RayCaster, RigidTransform};
use nemoral_seed::Key;

use crate::beam::SubRay;
use crate::error::check;
use crate::scan::Scan;
use crate::{Beam, ParamError, Pulse, PulseErrors, RangeModel, Returns, ScanPattern};

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
    /// The laser's width.
    pub beam: Beam,
    /// Which echoes of a pulse become points.
    pub returns: Returns,
    /// Errors of pointing and detection.
    pub errors: PulseErrors,
    /// Are points written in the LiDAR frame of the frame's time (`true`), or of the moment each was
    /// measured (`false`: raw, as the sensor sends them)?
    pub deskew: bool,
}

impl Default for ScannerParams {
    /// The paper's 50,000 pulses, each a line, deskewed, without errors; the range of the Livox Mid-40 and Horizon (260 m at 80 %), with
    /// the blind zone of 0.5 m that Livox writes for its rectangular scanners.
    fn default() -> Self {
        Self {
            pulses_per_scan: 50_000,
            min_range_m: 0.5,
            max_range_m: 260.0,
            wavelength: Wavelength::Nm905,
            beam: Beam::default(),
            returns: Returns::default(),
            errors: PulseErrors::default(),
            deskew: true,
        }
    }
}

/// A virtual LiDAR: a pattern and how much of it makes a scan.
pub struct Scanner {
    params: ScannerParams,
    pattern: Box<dyn ScanPattern>,
    rate_hz: f64,
    sub_rays: Vec<SubRay>,
}

impl fmt::Debug for Scanner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scanner")
            .field("params", &self.params)
            .field("rate_hz", &self.rate_hz)
            .finish_non_exhaustive()
    }
}

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
        params.beam.check()?;
        params.errors.check()?;
        if let Returns::All(most) = params.returns {
            check(
                (1..=15).contains(&most),
                "returns",
                most.into(),
                "1..=15 for all",
            )?;
        }
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
            sub_rays: params.beam.sub_rays(),
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

    /// One scan: the points of each pulse that comes back, in the order of firing.
    ///
    /// Each pulse is cast from where the LiDAR is when it fires: `scene_from_lidar_at` gives the pose
    /// at a time in seconds relative to the frame's, and the scan is centred on that time, from
    /// −duration/2 to +duration/2. `first_pulse` says where in the pattern the scan starts
    /// ([`Scanner::first_pulse_at`]).
    ///
    /// What a beam's sub-rays hit is put together to echoes; `noise` measures each, and
    /// [`ScannerParams::returns`] says which become points. A point carries the truth of the surface that
    /// gave most of its light, and [`PointFlags::MIXED`](nemoral_scene::PointFlags::MIXED) if others
    /// gave some too. A hit nearer than the blind zone blocks its part of the beam and is not seen.
    ///
    /// A pulse's randomness is keyed by `key` and the pulse's [identity](ScanPattern::identity) in the
    /// pattern: it does not depend
    /// on other pulses. Work is spread over rayon's current thread pool; the result is the same for any.
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
        let start_s = self.pattern.pulse(first_pulse).time_s;
        let scan = Scan {
            params: &self.params,
            pattern: &*self.pattern,
            sub_rays: &self.sub_rays,
            first_pulse,
            start_s,
            middle_s: start_s + self.duration_s() / 2.0,
            lidar_from_scene: scene_from_lidar_at(0.0).inverse(),
            caster,
            materials,
            scene_from_lidar_at,
            noise,
            key,
        };
        scan.points()
    }
}
