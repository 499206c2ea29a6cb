//! The parameters of a scanner.

use nemoral_scene::{LaserBand, Material, ParamError};

use crate::air::AirParams;
use crate::beam::Beam;
use crate::carrier::Carrier;
use crate::echo::ReturnMode;
use crate::pulse_errors::PulseErrors;

/// The laser's wavelength, which selects one of a material's reflectances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wavelength {
    /// 905 nm (Livox, Velodyne): leaves are bright.
    #[default]
    Nm905,
    /// 1550 nm (terrestrial scanners): bark is brighter than leaves.
    Nm1550,
}

impl Wavelength {
    /// A material's reflectance and transmittance at this wavelength.
    #[must_use]
    pub fn band(self, material: &Material) -> LaserBand {
        match self {
            Self::Nm905 => material.optics.nm905,
            Self::Nm1550 => material.optics.nm1550,
        }
    }

    /// The reflectance of a disc that sends as much light back as a raindrop of its width: of the
    /// front and the rear of a sphere of water, by Fresnel. At 1550 nm water absorbs most of what
    /// goes to the rear and back, two diameters of it (811 per metre; Hale and Querry 1973).
    #[must_use]
    pub const fn drop_reflectance(self) -> f64 {
        match self {
            Self::Nm905 => 0.024,
            Self::Nm1550 => 0.008,
        }
    }
}

/// Parameters of a [`Scanner`](crate::Scanner).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScannerParams {
    /// Pulses fired in one scan, at least 1. Only those that come back give points.
    pub pulses_per_scan: u32,
    /// The blind zone, metres, at least 0. A surface that is nearer blocks the pulse and is not
    /// seen.
    pub min_range_m: f32,
    /// The farthest echo, metres, greater than `min_range_m`. Its range may be measured as greater.
    pub max_range_m: f32,
    /// The laser's wavelength.
    pub wavelength: Wavelength,
    /// The laser's width.
    pub beam: Beam,
    /// Which echoes of a pulse become points.
    pub returns: ReturnMode,
    /// Errors of pointing, detection and intensity.
    pub errors: PulseErrors,
    /// The air that pulses pass.
    pub air: AirParams,
    /// What carries the scanner and hides what is behind it; nothing if none.
    pub carrier: Option<Carrier>,
    /// Whether points are written in the LiDAR frame of the frame's time (`true`), or of the moment
    /// each was measured (`false`: raw, as the sensor sends them).
    pub deskew: bool,
}

impl Default for ScannerParams {
    /// The paper's 50,000 pulses, each a line, deskewed, without errors, air and carrier. The range
    /// is that of the Livox Mid-40 and Horizon (260 m at 80 %), with the blind zone of 0.5 m that
    /// Livox gives for its rectangular scanners.
    fn default() -> Self {
        Self {
            pulses_per_scan: 50_000,
            min_range_m: 0.5,
            max_range_m: 260.0,
            wavelength: Wavelength::Nm905,
            beam: Beam::default(),
            returns: ReturnMode::default(),
            errors: PulseErrors::default(),
            air: AirParams::default(),
            carrier: None,
            deskew: true,
        }
    }
}

impl ScannerParams {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        ParamError::check(
            self.pulses_per_scan >= 1,
            "pulses_per_scan",
            self.pulses_per_scan,
            "at least 1",
        )?;
        ParamError::check_at_least_zero("min_range_m", self.min_range_m.into())?;
        ParamError::check(
            self.max_range_m.is_finite() && self.max_range_m > self.min_range_m,
            "max_range_m",
            self.max_range_m,
            "finite and greater than min_range_m",
        )?;
        self.beam.check()?;
        self.errors.check()?;
        self.air.check()?;
        if let Some(carrier) = &self.carrier {
            carrier.check()?;
        }
        if let ReturnMode::All(most) = self.returns {
            ParamError::check((1..=15).contains(&most), "returns", most, "1..=15 for all")?;
        }
        Ok(())
    }
}
