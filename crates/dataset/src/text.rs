//! `poses.txt`, `calib.txt`, `times.txt`: KITTI's text files, with all digits of an f64.

use std::fmt::Write;
use std::path::Path;

use nemoral_scene::glam::{DMat3, DQuat, DVec3};
use nemoral_scene::{Intrinsics, RigidTransform};

use crate::Error;

/// A 3 × 4 matrix, row-major.
pub(crate) type Rows = [[f64; 4]; 3];

/// `calib.txt`.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// P0 to P3: homogeneous pixels from the reference camera's frame. All four are the first
    /// camera's; the centre of the first pixel is at (0.5, 0.5).
    pub projections: [[[f64; 4]; 3]; 4],
    /// Tr: the reference camera's frame from the first LiDAR's.
    pub camera_from_lidar: [[f64; 4]; 3],
}

/// A transform from its 3 × 4 matrix.
pub(crate) fn from_rows(rows: &Rows) -> RigidTransform {
    let column = |c: usize| DVec3::new(rows[0][c], rows[1][c], rows[2][c]);
    RigidTransform {
        rotation: DQuat::from_mat3(&DMat3::from_cols(column(0), column(1), column(2))).normalize(),
        translation_m: column(3),
    }
}

/// `a_from_c = inverse(b_from_a) * b_from_c`, the identity to the bit for equal ones; translations
/// are subtracted first, so that nothing is lost far from b's origin.
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

/// The pinhole's 3 × 4 projection.
pub(crate) fn projection(k: &Intrinsics) -> Rows {
    [
        [k.fx, 0.0, k.cx, 0.0],
        [0.0, k.fy, k.cy, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ]
}

fn push_rows(out: &mut String, rows: &Rows) {
    for (i, value) in rows.as_flattened().iter().enumerate() {
        let space = if i == 0 { "" } else { " " };
        // Adding zero turns -0 into 0.
        write!(out, "{space}{:e}", value + 0.0).expect("a string takes it");
    }
    out.push('\n');
}

/// `poses.txt`: one matrix a line.
pub(crate) fn encode_poses(poses: &[Rows]) -> String {
    let mut out = String::new();
    for rows in poses {
        push_rows(&mut out, rows);
    }
    out
}

/// `times.txt`: seconds, one a line.
pub(crate) fn encode_times(times_s: &[f64]) -> String {
    times_s.iter().map(|t| format!("{:e}\n", t + 0.0)).collect()
}

/// `calib.txt`: `P0:` to `P3:` and `Tr:`.
pub(crate) fn encode_calibration(calibration: &Calibration) -> String {
    let mut out = String::new();
    for (i, rows) in calibration.projections.iter().enumerate() {
        write!(out, "P{i}: ").expect("a string takes it");
        push_rows(&mut out, rows);
    }
    out.push_str("Tr: ");
    push_rows(&mut out, &calibration.camera_from_lidar);
    out
}

fn numbers<const N: usize>(path: &Path, line: &str, text: &str) -> Result<[f64; N], Error> {
    let values: Option<Vec<f64>> = text.split_whitespace().map(|w| w.parse().ok()).collect();
    values
        .and_then(|v| v.try_into().ok())
        .ok_or_else(|| Error::malformed(path, format!("{line}: must be {N} numbers")))
}

fn matrix(path: &Path, line: &str, text: &str) -> Result<Rows, Error> {
    let values: [f64; 12] = numbers(path, line, text)?;
    Ok(std::array::from_fn(|r| {
        std::array::from_fn(|c| values[4 * r + c])
    }))
}

pub(crate) fn decode_poses(path: &Path, text: &str) -> Result<Vec<Rows>, Error> {
    text.lines()
        .enumerate()
        .map(|(i, line)| matrix(path, &format!("line {}", i + 1), line))
        .collect()
}

pub(crate) fn decode_times(path: &Path, text: &str) -> Result<Vec<f64>, Error> {
    text.lines()
        .enumerate()
        .map(|(i, line)| numbers::<1>(path, &format!("line {}", i + 1), line).map(|[t]| t))
        .collect()
}

pub(crate) fn decode_calibration(path: &Path, text: &str) -> Result<Calibration, Error> {
    let named = |name: &str| {
        let lines = || text.lines().filter_map(|l| l.split_once(": "));
        match lines().filter(|(n, _)| *n == name).collect::<Vec<_>>()[..] {
            [(_, rest)] => matrix(path, name, rest),
            ref found => Err(Error::malformed(
                path,
                format!("has {} lines '{name}:', must have one", found.len()),
            )),
        }
    };
    Ok(Calibration {
        projections: [named("P0")?, named("P1")?, named("P2")?, named("P3")?],
        camera_from_lidar: named("Tr")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rows() -> impl Strategy<Value = Rows> {
        prop::array::uniform3(prop::array::uniform4(prop::num::f64::NORMAL))
    }

    proptest! {
        #[test]
        fn every_bit_comes_back(a in rows(), b in rows(), times in prop::collection::vec(0.0_f64..1e9, 0..9)) {
            let p = Path::new("x");
            prop_assert_eq!(decode_poses(p, &encode_poses(&[a, b])).expect("valid"), vec![a, b]);
            prop_assert_eq!(decode_times(p, &encode_times(&times)).expect("valid"), times);
            let calibration = Calibration { projections: [a; 4], camera_from_lidar: b };
            let text = encode_calibration(&calibration);
            prop_assert_eq!(text.matches(':').count(), 5);
            prop_assert_eq!(decode_calibration(p, &text).expect("valid"), calibration);
        }

        #[test]
        fn matrices_are_transforms(x in -1e7_f64..1e7, yaw in -3.0_f64..3.0, pitch in -1.0_f64..1.0) {
            let t = RigidTransform::from_xyz_rpy(DVec3::new(x, 1.0, -x), 0.3, pitch, yaw);
            let back = from_rows(&t.to_rows());
            let p = DVec3::new(3.0, -2.0, 10.0);
            prop_assert!(t.transform_point(p).distance(back.transform_point(p)) < 1e-8);
            let near = RigidTransform { translation_m: t.translation_m + DVec3::X, ..t };
            let step = relative(&t, &near).translation_m.length();
            prop_assert!((step - 1.0).abs() < 1e-8, "{step}");
        }
    }

    #[test]
    fn nonsense_names_the_line() {
        let e = decode_poses(Path::new("poses.txt"), "1 2 3\n").expect_err("short");
        assert!(e.to_string().contains("poses.txt: line 1"), "{e}");
        assert!(decode_calibration(Path::new("c"), "P0: 1\n").is_err());
    }
}
