//! Annotations of pictures: optical flow, hidden trunks, and boxes. They are found by casting rays,
//! whichever renderer took the picture.

pub(crate) mod boxes;
pub(crate) mod nearest;
pub(crate) mod optical_flow;

use glam::DVec2;

/// The centre of a pixel.
fn pixel_centre(column: usize, row: usize) -> DVec2 {
    DVec2::new(column as f64 + 0.5, row as f64 + 0.5)
}
