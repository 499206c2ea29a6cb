//! Scanners, which send pulses out and turn what comes back into points.

use std::fmt;
use std::ops::RangeInclusive;

use nemoral_scene::{
    DirectionCone, LidarPoint, MaterialLibrary, ParamError, RayCaster, RigidTransform,
};
use nemoral_seed::{Domain, Key, Rng};

use crate::air::Air;
use crate::beam::SubRay;
use crate::params::ScannerParams;
use crate::pattern::{Pulse, ScanPattern};
use crate::pulse_batch::ScanContext;
use crate::range_model::RangeModel;
use crate::scan;

/// A virtual LiDAR: a pattern, and the parameters of a scan.
pub struct Scanner {
    params: ScannerParams,
    pattern: Box<dyn ScanPattern>,
    rate_hz: f64,
    field_of_view: DirectionCone,
    sub_rays: Vec<SubRay>,
    air: Air,
}

/// What is scanned, and from where.
#[derive(Clone, Copy)]
pub struct ScanRequest<'a> {
    /// The number in the pattern of the first pulse of the scan ([`Scanner::first_pulse_at`]).
    pub first_pulse: u64,
    /// What the pulses are cast at.
    pub caster: &'a dyn RayCaster,
    /// The library that made the hits' [`MaterialId`](nemoral_scene::MaterialId)s.
    pub materials: &'a MaterialLibrary,
    /// The LiDAR's pose in the scene at a time in seconds relative to the frame's. The scan is
    /// centred on the frame's time, so it asks for times within [`Scanner::half_scan_s`] of it. Its
    /// rotation is a unit quaternion, which is asserted in debug builds.
    pub scene_from_lidar_at: &'a (dyn Fn(f64) -> RigidTransform + Sync),
    /// How the receiver measures ranges.
    pub range_model: &'a dyn RangeModel,
    /// The key of all randomness of the scan.
    pub key: Key,
}

impl fmt::Debug for ScanRequest<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ScanRequest")
            .field("first_pulse", &self.first_pulse)
            .field("key", &self.key)
            .finish_non_exhaustive()
    }
}

impl fmt::Debug for Scanner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scanner")
            .field("params", &self.params)
            .field("rate_hz", &self.rate_hz)
            .finish_non_exhaustive()
    }
}

/// The longest scan. Terrestrial scanners take minutes.
const MAX_DURATION_S: f64 = 3600.0;

const START: Domain = Domain::new("lidar.start");

/// How many pulses of a pattern are looked at before it is used.
const FIRST_PULSES: u32 = 1024;

/// The lengths of a unit vector, rounded.
const UNIT: RangeInclusive<f64> = 1.0 - 1e-6..=1.0 + 1e-6;

impl Scanner {
    /// A scanner with these parameters.
    ///
    /// # Errors
    /// If a parameter is out of its range, if the pattern's rate is not positive, if one of the
    /// pattern's first pulses has no unit vector for a direction, or if the scan would last longer
    /// than an hour.
    pub fn new(params: ScannerParams, pattern: Box<dyn ScanPattern>) -> Result<Self, ParamError> {
        params.check()?;
        let rate_hz = pattern.rate_hz();
        ParamError::check_positive("rate_hz", rate_hz)?;
        ParamError::check(
            f64::from(params.pulses_per_scan) / rate_hz <= MAX_DURATION_S,
            "pulses_per_scan",
            params.pulses_per_scan,
            "at most what the pattern fires in 3600 s",
        )?;
        let first = pattern.pulses(0, params.pulses_per_scan.min(FIRST_PULSES));
        for pulse in first {
            let length = pulse.direction.length();
            ParamError::check_range("direction.length()", length, UNIT, "1: a unit vector")?;
        }
        Ok(Self {
            params,
            field_of_view: pattern.field_of_view(),
            pattern,
            rate_hz,
            sub_rays: params.beam.sub_rays(),
            air: Air::new(
                params.air,
                &params.beam,
                (params.min_range_m.into(), params.max_range_m.into()),
            ),
        })
    }

    /// The parameters.
    #[must_use]
    pub fn params(&self) -> &ScannerParams {
        &self.params
    }

    /// A cone in the LiDAR frame that contains the directions of all pulses, but for the width of
    /// their beams.
    #[must_use]
    pub fn field_of_view(&self) -> DirectionCone {
        self.field_of_view
    }

    /// How long a scan takes, seconds: pulses per scan over the pattern's rate.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        f64::from(self.params.pulses_per_scan) / self.rate_hz
    }

    /// How long before and after a frame's time a scan may fire, seconds: half its duration, and a
    /// [pause](ScanPattern::pause_s), in which a scan ends that begins in the middle of a line.
    #[must_use]
    pub fn half_scan_s(&self) -> f64 {
        self.duration_s() / 2.0 + self.pattern.pause_s()
    }

    /// The number of the first pulse of the scan at a frame time, seconds after the first frame
    /// (whose scan starts with the pattern's first pulse).
    ///
    /// So consecutive frames continue the pattern. If the interval of frames is shorter than a
    /// scan, scans share pulses, as with a real sensor that is read with a longer integration time;
    /// if it is longer, pulses between the scans are skipped.
    #[must_use]
    pub fn first_pulse_at(&self, frame_time_s: f64) -> u64 {
        (frame_time_s * self.rate_hz).round() as u64
    }

    /// The number of a pulse with which a recording may begin: a key draws it from the pattern's
    /// [cycle](ScanPattern::cycle), so that recordings, and scanners side by side, do not scan in
    /// step. It is the first of those that fire together; 0 where the pattern begins at a set
    /// place.
    #[must_use]
    pub fn start(&self, key: Key) -> u64 {
        let word = u128::from(key.domain(START).rng().next_u64());
        let mut number = ((word * u128::from(self.pattern.cycle())) >> 64) as u64;
        let fired_s = self.pattern.pulse(number).time_s;
        while number > 0 && self.pattern.pulse(number - 1).time_s == fired_s {
            number -= 1;
        }
        number
    }

    /// The pulses of the scan that starts at a pulse of the pattern.
    pub fn pulses(&self, first_pulse: u64) -> impl Iterator<Item = Pulse> + '_ {
        (0..self.params.pulses_per_scan)
            .map(move |i| self.pattern.pulse(first_pulse.wrapping_add(i.into())))
    }

    /// One scan: the points of each pulse that comes back, in the order of firing.
    ///
    /// Each pulse is cast from where the LiDAR is when it fires.
    ///
    /// The hits of a beam's sub-rays are grouped into echoes. The range model measures each echo,
    /// and [`ScannerParams::returns`] says which become points. A point carries the truth of the
    /// surface that gave most of its light, and
    /// [`PointFlags::MIXED`](nemoral_scene::PointFlags::MIXED) if others gave some too. A hit
    /// nearer than the blind zone blocks its part of the beam and is not seen, and so does what
    /// [carries](ScannerParams::carrier) the scanner. Air weakens echoes; an echo of its own
    /// becomes a point that is labelled [`AirborneEcho`](nemoral_scene::Semantic::AirborneEcho) and
    /// [`PointFlags::FALSE_ALARM`](nemoral_scene::PointFlags::FALSE_ALARM), as no surface is there.
    ///
    /// A pulse's randomness is keyed by the request's key and the pulse's
    /// [identity](ScanPattern::identity) in the pattern, so it does not depend on other pulses.
    /// Work is spread over rayon's current thread pool; the result is the same for any pool.
    #[must_use]
    pub fn scan(&self, request: &ScanRequest<'_>) -> Vec<LidarPoint> {
        let start_s = self.pattern.pulse(request.first_pulse).time_s;
        scan::points(&ScanContext {
            params: &self.params,
            pattern: &*self.pattern,
            sub_rays: &self.sub_rays,
            air: &self.air,
            first_pulse: request.first_pulse,
            middle_s: start_s + self.duration_s() / 2.0,
            lidar_from_scene: (request.scene_from_lidar_at)(0.0).inverse(),
            caster: request.caster,
            materials: request.materials,
            scene_from_lidar_at: request.scene_from_lidar_at,
            range_model: request.range_model,
            key: request.key,
        })
    }
}
