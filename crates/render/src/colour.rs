//! Functions of linear sRGB colours that several parts of the crate use.

use glam::Vec3;
use rayon::prelude::*;

/// Rec. 709 luminance of linear sRGB.
pub(crate) const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Maps each part of a picture to a value, on all threads. The division into parts does not depend
/// on the number of threads, so sums of the values are equal to the bit for any number of them.
pub(crate) fn in_parts<T: Send>(
    linear: &[Vec3],
    of: impl Fn(&[Vec3]) -> T + Sync + Send,
) -> Vec<T> {
    linear.par_chunks(1 << 14).map(of).collect()
}
