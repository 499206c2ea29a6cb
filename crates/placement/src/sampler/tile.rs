//! Coordinates on a plane of square tiles.
//!
//! Lengths are in tile edges and positions are relative to a tile's south-west corner. Positions
//! are multiples of 2⁻³⁰, so that sums and differences of positions are exact: two tiles that see
//! the same pair of points from different origins compute with the same bits.

use glam::DVec2;

/// The distance from a tile's centre in the maximum norm.
pub(crate) fn from_centre(p: DVec2) -> f64 {
    (p - DVec2::splat(0.5)).abs().max_element()
}

/// Rounds to the nearest multiple of 2⁻³⁰, for magnitudes below 2²¹.
pub(crate) fn snap(p: DVec2) -> DVec2 {
    // Adding 1.5 · 2²² leaves exactly 30 binary places, whatever the sign.
    let shift = DVec2::splat(6_291_456.0);
    (p + shift) - shift
}
