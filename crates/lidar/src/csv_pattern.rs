//! Any scan pattern, read from a CSV table of its pulses.

use std::io::BufRead;

use nemoral_scene::glam::DVec3;
use nemoral_scene::{DirectionCone, excerpt};

use crate::pattern::direction;
use crate::{Pulse, ScanPattern};

/// A pattern that replays a table of pulses again and again.
#[derive(Clone, Debug, PartialEq)]
pub struct CsvPattern {
    pulses: Vec<Pulse>,
    /// The time from the first pulse to the first pulse of the next replay, seconds.
    period_s: f64,
}

/// Why a table is not a pattern.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CsvPatternError {
    /// A row is malformed.
    #[error("line {line}: {reason}")]
    Row {
        /// The line's number, from 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
    /// The table has fewer than two pulses.
    #[error("a pattern needs at least two pulses, but the table has {0}")]
    TooFew(usize),
    /// All pulses of the table have the same time, so that a replay would take none.
    #[error("a pattern needs pulses of different times, but all {0} have the same")]
    OneTime(usize),
    /// The table cannot be read.
    #[error(transparent)]
    Read(#[from] std::io::Error),
}

impl CsvPattern {
    /// Reads rows of `time, azimuth, elevation` and, if there, `ring`: seconds, degrees to the left
    /// of x forward, degrees up. Separated by commas; a first line without a number is a header;
    /// empty lines and lines that start with `#` are skipped, and so is a byte order mark. Times
    /// start anywhere, never decrease and are not all the same.
    ///
    /// Livox's own tables have the zenith angle, which is 90° minus the elevation.
    ///
    /// # Errors
    /// If the input cannot be read, a row is malformed, times decrease or do not differ, or there
    /// are fewer than two pulses.
    pub fn from_csv(input: impl BufRead) -> Result<Self, CsvPatternError> {
        let mut pulses: Vec<Pulse> = Vec::new();
        let mut start_s = 0.0;
        let mut is_first = true;
        for (i, line) in input.lines().enumerate() {
            let line = line?;
            let text = line.trim_start_matches('\u{feff}').trim();
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            let is_number = |field: &str| field.trim().parse::<f64>().is_ok();
            if std::mem::take(&mut is_first) && !text.split(',').any(is_number) {
                continue;
            }
            let mut pulse = row(text).map_err(|reason| CsvPatternError::Row {
                line: i + 1,
                reason,
            })?;
            if pulses.is_empty() {
                start_s = pulse.time_s;
            }
            pulse.time_s -= start_s;
            if pulses.last().is_some_and(|last| pulse.time_s < last.time_s) {
                let reason = "times must not decrease".to_owned();
                return Err(CsvPatternError::Row {
                    line: i + 1,
                    reason,
                });
            }
            pulses.push(pulse);
        }
        let last_s = pulses.last().map_or(0.0, |p| p.time_s);
        if pulses.len() < 2 {
            return Err(CsvPatternError::TooFew(pulses.len()));
        }
        if last_s <= 0.0 {
            return Err(CsvPatternError::OneTime(pulses.len()));
        }
        // The next replay follows after the mean interval.
        let period_s = last_s * pulses.len() as f64 / (pulses.len() - 1) as f64;
        Ok(Self { pulses, period_s })
    }

    /// The number of pulses in the table.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pulses.len()
    }

    /// Always false, because a pattern has at least two pulses.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pulses.is_empty()
    }
}

fn row(text: &str) -> Result<Pulse, String> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    if !(3..=4).contains(&fields.len()) {
        return Err(format!(
            "{} fields; must be time, azimuth, elevation and, if wanted, ring",
            fields.len()
        ));
    }
    let number = |name: &str, text: &str, low: f64, high: f64| {
        let value: f64 = text
            .parse()
            .map_err(|_| format!("{name} is {}, which is no number", shown(text)))?;
        if (low..=high).contains(&value) {
            Ok(value)
        } else {
            Err(format!("{name} is {value}, but must be {low}..={high}"))
        }
    };
    let time_s = number("time", fields[0], -1e9, 1e9)?;
    let azimuth_deg = number("azimuth", fields[1], -360.0, 360.0)?;
    let elevation_deg = number("elevation", fields[2], -90.0, 90.0)?;
    let ring = match fields.get(3) {
        Some(text) => text.parse().map_err(|_| {
            let text = shown(text);
            format!("ring is {text}, but must be a whole number, 0..=255")
        })?,
        None => 0,
    };
    Ok(Pulse {
        time_s,
        direction: direction(azimuth_deg.to_radians(), elevation_deg.to_radians()),
        ring,
    })
}

/// A field as a message shows it.
fn shown(field: &str) -> String {
    format!("\"{}\"", excerpt(field, 40))
}

impl ScanPattern for CsvPattern {
    fn pulse(&self, number: u64) -> Pulse {
        let count = self.pulses.len() as u64;
        let mut pulse = self.pulses[(number % count) as usize];
        pulse.time_s += (number / count) as f64 * self.period_s;
        pulse
    }

    fn field_of_view(&self) -> DirectionCone {
        DirectionCone::around(DVec3::X, self.pulses.iter().map(|pulse| pulse.direction))
    }

    fn rate_hz(&self) -> f64 {
        self.pulses.len() as f64 / self.period_s
    }
}
