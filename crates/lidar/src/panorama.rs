//! Terrestrial scanners: a mirror sweeps up and down while the head turns once.

use std::f64::consts::{PI, TAU};

use crate::pattern::direction;
use crate::{ParamError, Pulse, ScanPattern};

/// Parameters of [`Panorama`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanoramaParams {
    /// Pulses of one upward sweep, at least 1.
    pub rows: u32,
    /// Sweeps of one turn, at least 1.
    pub columns: u32,
    /// Elevation of the lowest row, radians, −π/2 to π/2.
    pub bottom_rad: f64,
    /// Elevation of the highest row, radians, from `bottom_rad` to π/2.
    pub top_rad: f64,
    /// Pulses per second, greater than 0.
    pub rate_hz: f64,
}

impl Default for PanoramaParams {
    /// A phase-shift scanner with two million pulses a second and a pulse at each 0.15°, which is
    /// 2.4 million from 60° below the horizon to the zenith.
    fn default() -> Self {
        Self {
            rows: 1000,
            columns: 2400,
            bottom_rad: -PI / 3.0,
            top_rad: PI / 2.0,
            rate_hz: 2e6,
        }
    }
}

/// A full turn of columns, counter-clockwise from above, starting at the back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Panorama {
    params: PanoramaParams,
}

impl Panorama {
    /// The pattern with these parameters.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: PanoramaParams) -> Result<Self, ParamError> {
        let p = &params;
        ParamError::check(p.rows >= 1, "rows", p.rows, "at least 1")?;
        ParamError::check(p.columns >= 1, "columns", p.columns, "at least 1")?;
        ParamError::check(
            (-PI / 2.0..=PI / 2.0).contains(&p.bottom_rad),
            "bottom_rad",
            p.bottom_rad,
            "from −π/2 to π/2",
        )?;
        ParamError::check(
            (p.bottom_rad..=PI / 2.0).contains(&p.top_rad),
            "top_rad",
            p.top_rad,
            "from bottom_rad to π/2",
        )?;
        ParamError::check(
            p.rate_hz.is_finite() && p.rate_hz > 0.0,
            "rate_hz",
            p.rate_hz,
            "finite and greater than 0",
        )?;
        Ok(Self { params })
    }

    /// Pulses in one turn. After this number of pulses the pattern repeats.
    #[must_use]
    pub fn pulses_per_turn(&self) -> u64 {
        u64::from(self.params.rows) * u64::from(self.params.columns)
    }
}

impl ScanPattern for Panorama {
    fn pulse(&self, number: u64) -> Pulse {
        let p = &self.params;
        let in_turn = number % self.pulses_per_turn();
        // The head keeps turning while the mirror sweeps, so columns lean by one step.
        let turned = (in_turn as f64 + 0.5) / self.pulses_per_turn() as f64;
        let row = (in_turn % u64::from(p.rows)) as f64 + 0.5;
        let elevation_rad = p.bottom_rad + (p.top_rad - p.bottom_rad) * row / f64::from(p.rows);
        Pulse {
            time_s: number as f64 / p.rate_hz,
            direction: direction(TAU * turned - PI, elevation_rad),
            ring: 0,
        }
    }

    fn rate_hz(&self) -> f64 {
        self.params.rate_hz
    }
}
