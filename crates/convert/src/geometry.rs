//! Transforms between poses, and their text.

use std::fmt::Write;

use nemoral_scene::{Distortion, RigidTransform};

/// `a_from_c = inverse(b_from_a) * b_from_c`; translations are subtracted first, so that nothing is
/// lost far from b's origin.
pub(crate) fn relative(b_from_a: &RigidTransform, b_from_c: &RigidTransform) -> RigidTransform {
    if b_from_a == b_from_c {
        return RigidTransform::IDENTITY;
    }
    let back = b_from_a.rotation.inverse();
    RigidTransform {
        rotation: (back * b_from_c.rotation).normalize(),
        translation_m: back * (b_from_c.translation_m - b_from_a.translation_m),
    }
}

/// OpenCV's coefficients of a lens, filled up with zeros: k1, k2, p1, p2, k3, or k1 to k4 of a
/// fisheye; and the model's name.
pub(crate) fn lens(distortion: &Distortion) -> (&'static str, [f64; 5]) {
    match *distortion {
        Distortion::BrownConrady { k1, k2, k3, p1, p2 } => ("brown_conrady", [k1, k2, p1, p2, k3]),
        Distortion::Fisheye { k1, k2, k3, k4 } => ("fisheye", [k1, k2, k3, k4, 0.0]),
        _ => ("pinhole", [0.0; 5]),
    }
}

/// Numbers with all digits of an f64, separated by spaces, as a line.
pub(crate) fn line(numbers: impl IntoIterator<Item = f64>) -> String {
    let mut out = String::new();
    for (i, n) in numbers.into_iter().enumerate() {
        let space = if i == 0 { "" } else { " " };
        // Adding zero turns -0 into 0.
        write!(out, "{space}{}", n + 0.0).expect("a string takes it");
    }
    out.push('\n');
    out
}

/// A transform's 3 × 4 matrix, row-major, as a line.
pub(crate) fn rows_line(transform: &RigidTransform) -> String {
    line(transform.to_rows().into_iter().flatten())
}
