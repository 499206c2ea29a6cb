//! Directions on the map.

use std::f64::consts::TAU;

use glam::DVec2;

/// Directions all around, counter-clockwise.
pub(crate) fn all_around(count: u32) -> impl Iterator<Item = DVec2> {
    (0..count).map(move |i| {
        let (sin, cos) = libm::sincos(TAU * f64::from(i) / f64::from(count));
        DVec2::new(cos, sin)
    })
}
