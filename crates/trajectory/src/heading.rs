//! Headings.

use nemoral_scene::glam::DVec2;

/// The direction on the map that is this far clockwise from north, of length 1.
#[must_use]
pub fn forward_of_heading(heading_deg: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(heading_deg.to_radians());
    DVec2::new(sin, cos)
}
