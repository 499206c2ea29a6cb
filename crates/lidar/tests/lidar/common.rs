//! Coverage of the field of view, as Livox defines it: the share of its area that pulses have lit,
//! drawn on a grid of cells.

#![allow(dead_code, reason = "each test uses its part")]

use std::collections::BTreeSet;

use nemoral_lidar::{Pulse, ScanPattern};

/// A square cell of azimuth and elevation.
pub(crate) type Cell = (i32, i32);

/// Azimuth and elevation of a pulse, degrees.
pub(crate) fn azimuth_elevation_deg(pulse: &Pulse) -> (f64, f64) {
    let d = pulse.direction;
    (d.y.atan2(d.x).to_degrees(), d.z.asin().to_degrees())
}

/// The cells that are lit between two pulses of a pattern.
pub(crate) fn lit(
    pattern: &dyn ScanPattern,
    pulses: std::ops::Range<u64>,
    cell_deg: f64,
) -> BTreeSet<Cell> {
    let cell = |deg: f64| (deg / cell_deg).floor() as i32;
    let mut lit: Vec<Cell> = pulses
        .map(|i| azimuth_elevation_deg(&pattern.pulse(i)))
        .map(|(azimuth, elevation)| (cell(azimuth), cell(elevation)))
        .collect();
    lit.sort_unstable();
    lit.dedup();
    lit.into_iter().collect()
}

/// The cells whose centre is within a disc around straight ahead.
pub(crate) fn disc(radius_deg: f64, cell_deg: f64) -> BTreeSet<Cell> {
    let n = (radius_deg / cell_deg).ceil() as i32;
    let inside = |i: i32, j: i32| {
        let (x, y) = (
            (f64::from(i) + 0.5) * cell_deg,
            (f64::from(j) + 0.5) * cell_deg,
        );
        x * x + y * y <= radius_deg * radius_deg
    };
    (-n..n)
        .flat_map(|i| (-n..n).map(move |j| (i, j)))
        .filter(|&(i, j)| inside(i, j))
        .collect()
}

/// Coverage in percent of `field` by the first `time_s` of a pattern from `start` on.
pub(crate) fn coverage(
    pattern: &dyn ScanPattern,
    start: u64,
    time_s: f64,
    cell_deg: f64,
    field: &BTreeSet<Cell>,
) -> f64 {
    let pulses = (time_s * pattern.rate_hz()).round() as u64;
    let lit = lit(pattern, start..start + pulses, cell_deg);
    100.0 * lit.intersection(field).count() as f64 / field.len() as f64
}
