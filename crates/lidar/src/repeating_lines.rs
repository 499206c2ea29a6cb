//! The traditional pattern: repeating lines.

use std::f64::consts::{PI, TAU};

use crate::pattern::direction;
use nemoral_scene::DirectionCone;
use nemoral_scene::glam::DVec3;

use crate::{ParamError, Pulse, ScanPattern};

/// Parameters of [`RepeatingLines`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepeatingLinesParams {
    /// Laser lines, 1 to 255, at equal angles from bottom to top.
    pub lines: u8,
    /// Elevation of the lowest line, radians, −π/2 to π/2.
    pub bottom_rad: f64,
    /// Elevation of the highest line, radians, from `bottom_rad` to π/2.
    pub top_rad: f64,
    /// Width of the field of view around x forward, radians, greater than 0, at most 2π.
    pub horizontal_fov_rad: f64,
    /// Pulses of each line in one sweep, at least 1.
    pub columns: u32,
    /// Sweeps (turns, for 2π) per second, greater than 0.
    pub rotation_hz: f64,
}

impl Default for RepeatingLinesParams {
    /// Velodyne VLP-16 at 10 Hz: 16 lines from −15° to 15°, 300,000 pulses per second.
    fn default() -> Self {
        Self {
            lines: 16,
            bottom_rad: -PI / 12.0,
            top_rad: PI / 12.0,
            horizontal_fov_rad: TAU,
            columns: 1875,
            rotation_hz: 10.0,
        }
    }
}

/// A spinning (or sweeping) multi-line scanner: the paper's "traditional line scanning pattern".
///
/// Every sweep is the same: it runs from right to left (counter-clockwise from above), with the
/// middle of the sweep straight ahead, so a turn starts and ends at the back. The lines fire one
/// after the other, from the lowest, at equal intervals, while the head keeps turning, so the
/// columns lean as in a real scanner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepeatingLines {
    params: RepeatingLinesParams,
}

impl RepeatingLines {
    /// The pattern with these parameters.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: RepeatingLinesParams) -> Result<Self, ParamError> {
        let p = &params;
        ParamError::check(p.lines >= 1, "lines", p.lines, "at least 1")?;
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
            p.horizontal_fov_rad > 0.0 && p.horizontal_fov_rad <= TAU,
            "horizontal_fov_rad",
            p.horizontal_fov_rad,
            "greater than 0 and at most 2π",
        )?;
        ParamError::check(p.columns >= 1, "columns", p.columns, "at least 1")?;
        ParamError::check(
            p.rotation_hz.is_finite() && p.rotation_hz > 0.0,
            "rotation_hz",
            p.rotation_hz,
            "finite and greater than 0",
        )?;
        Ok(Self { params })
    }

    /// Pulses in one sweep: `lines · columns`. After this number of pulses the pattern repeats.
    #[must_use]
    pub fn pulses_per_sweep(&self) -> u64 {
        u64::from(self.params.lines) * u64::from(self.params.columns)
    }
}

impl Default for RepeatingLines {
    fn default() -> Self {
        Self::new(RepeatingLinesParams::default()).expect("the default parameters are in range")
    }
}

impl ScanPattern for RepeatingLines {
    fn pulse(&self, number: u64) -> Pulse {
        let p = &self.params;
        let per_sweep = self.pulses_per_sweep();
        let ring = (number % u64::from(p.lines)) as u8;
        let share = ((number % per_sweep) as f64 + 0.5) / per_sweep as f64;
        let step_rad = (p.top_rad - p.bottom_rad) / f64::from(p.lines.max(2) - 1);
        let elevation_rad = if p.lines == 1 {
            (p.top_rad + p.bottom_rad) / 2.0
        } else {
            p.bottom_rad + step_rad * f64::from(ring)
        };
        Pulse {
            time_s: number as f64 / self.rate_hz(),
            direction: direction((share - 0.5) * p.horizontal_fov_rad, elevation_rad),
            ring,
        }
    }

    /// The direction of the pulse of a column and line.
    fn identity(&self, number: u64) -> u64 {
        let lines = u64::from(self.params.lines);
        (number / lines) << 8 | (number % lines)
    }

    fn field_of_view(&self) -> DirectionCone {
        let p = &self.params;
        if p.horizontal_fov_rad >= PI {
            return DirectionCone::ALL;
        }
        // The steepest lines at the side are the farthest from the axis.
        let side_rad = p.horizontal_fov_rad / 2.0;
        let corners = [p.bottom_rad, p.top_rad].map(|up_rad| direction(side_rad, up_rad));
        DirectionCone::around(DVec3::X, corners)
    }

    fn rate_hz(&self) -> f64 {
        self.pulses_per_sweep() as f64 * self.params.rotation_hz
    }
}
