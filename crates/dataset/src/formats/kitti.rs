//! `poses.txt`, `calib.txt`, `times.txt`: KITTI's text files, with all digits of an f64.

use std::fmt::Write;
use std::path::Path;

use nemoral_scene::glam::{DMat3, DQuat, DVec3};
use nemoral_scene::{Distortion, Intrinsics, RigidTransform, excerpt};

use crate::header::{RIGHT, is_place};
use crate::{Error, SequenceSpec};

/// A 3 × 4 matrix, row-major.
pub(crate) type Rows = [[f64; 4]; 3];

/// `calib.txt`.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// P0 to P3: homogeneous pixels from the reference camera's frame. All four are the first
    /// camera's, except that P3 is that of the camera called `right` if there is one. The centre of
    /// the first pixel is at (0.5, 0.5).
    pub projections: [[[f64; 4]; 3]; 4],
    /// Tr: the reference camera's frame from the first LiDAR's.
    pub camera_from_lidar: [[f64; 4]; 3],
    /// D2 or F2: the distortion of the first camera's lens, if any.
    pub distortion: Distortion,
    /// The further cameras, in the sequence's order.
    pub further: Vec<CameraCalibration>,
    /// The further LiDARs, in the sequence's order.
    pub further_lidars: Vec<LidarCalibration>,
}

/// A further LiDAR's line of `calib.txt`.
#[derive(Clone, Debug, PartialEq)]
pub struct LidarCalibration {
    /// Its name, the NAME of the line.
    pub name: String,
    /// Tr_NAME: the reference camera's frame from this LiDAR's.
    pub camera_from_lidar: [[f64; 4]; 3],
}

/// A further camera's lines of `calib.txt`.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraCalibration {
    /// Its name, the NAME of the lines.
    pub name: String,
    /// P_NAME: its homogeneous pixels from the reference camera's frame.
    pub projection: [[f64; 4]; 3],
    /// Tr_NAME: its frame from the first LiDAR's.
    pub camera_from_lidar: [[f64; 4]; 3],
    /// D_NAME or F_NAME: the distortion of its lens, if any.
    pub distortion: Distortion,
}

impl Calibration {
    /// The calibration of a sequence.
    pub(crate) fn of(sequence: &SequenceSpec) -> Self {
        let reference = sequence.body_from_reference();
        let lidar = sequence.lidars.first();
        let lidar = lidar.map_or(reference, |l| l.body_from_lidar);
        let first = sequence
            .cameras
            .first()
            // Without a camera, poses are those of the LiDAR, and P drops the fourth coordinate.
            .map_or_else(
                || RigidTransform::IDENTITY.to_rows(),
                |c| projection(&c.intrinsics, &RigidTransform::IDENTITY),
            );
        let further = sequence.cameras.iter().skip(1).map(|c| CameraCalibration {
            name: c.name.clone(),
            projection: projection(&c.intrinsics, &relative(&c.body_from_camera, &reference)),
            camera_from_lidar: relative(&c.body_from_camera, &lidar).to_rows(),
            distortion: c.intrinsics.distortion,
        });
        let further: Vec<_> = further.collect();
        let further_lidars = sequence.lidars.iter().skip(1).map(|l| LidarCalibration {
            name: l.name.clone(),
            camera_from_lidar: relative(&reference, &l.body_from_lidar).to_rows(),
        });
        let right = further.iter().find(|c| c.name == RIGHT);
        Self {
            projections: [first, first, first, right.map_or(first, |c| c.projection)],
            camera_from_lidar: relative(&reference, &lidar).to_rows(),
            distortion: sequence
                .cameras
                .first()
                .map_or(Distortion::None, |c| c.intrinsics.distortion),
            further,
            further_lidars: further_lidars.collect(),
        }
    }
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

/// The pinhole's 3 × 4 projection of points in the reference camera's frame.
fn projection(k: &Intrinsics, camera_from_reference: &RigidTransform) -> Rows {
    let [x, y, z] = camera_from_reference.to_rows();
    [
        std::array::from_fn(|i| k.fx * x[i] + k.cx * z[i]),
        std::array::from_fn(|i| k.fy * y[i] + k.cy * z[i]),
        z,
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

/// Whether a matrix is a rotation, but for rounding, and a place within bounds.
pub(crate) fn is_pose(rows: &Rows) -> bool {
    is_pose_within(1e-6, rows)
}

/// The same for what other programs write with few digits.
pub(crate) fn is_nearly_pose(rows: &Rows) -> bool {
    // Three digits may be off by so much in the product of two axes.
    is_pose_within(3e-3, rows)
}

fn is_pose_within(tolerance: f64, rows: &Rows) -> bool {
    let axes = rows.map(|[x, y, z, _]| DVec3::new(x, y, z));
    let [x, y, z] = axes;
    let unit = |axis: DVec3| (axis.length_squared() - 1.0).abs() < tolerance;
    axes.into_iter().all(unit)
        && x.cross(y).distance(z) < tolerance
        && is_place(DVec3::from(rows.map(|row| row[3])))
}

/// `poses.txt`: one matrix on each line.
pub(crate) fn encode_poses(poses: &[Rows]) -> String {
    let mut out = String::new();
    for rows in poses {
        push_rows(&mut out, rows);
    }
    out
}

/// `times.txt`: seconds, one number on each line.
pub(crate) fn encode_times(times_s: &[f64]) -> String {
    times_s.iter().map(|t| format!("{:e}\n", t + 0.0)).collect()
}

/// The letter of a lens's line and its twelve numbers: `D`, Brown and Conrady in OpenCV's order, k1
/// k2 p1 p2 k3; `F`, the fisheye's k1 to k4; then zeros.
fn lens_line(distortion: &Distortion) -> Option<(&'static str, Rows)> {
    let (letter, coefficients) = match *distortion {
        Distortion::BrownConrady { k1, k2, k3, p1, p2 } => ("D", vec![k1, k2, p1, p2, k3]),
        Distortion::Fisheye { k1, k2, k3, k4 } => ("F", vec![k1, k2, k3, k4]),
        _ => return None,
    };
    let mut rows = [[0.0; 4]; 3];
    rows.as_flattened_mut()[..coefficients.len()].copy_from_slice(&coefficients);
    Some((letter, rows))
}

/// `calib.txt`: `P0:` to `P3:` and `Tr:`, then `P_NAME:` and `Tr_NAME:` of further cameras and
/// `Tr_NAME:` of further LiDARs, and for lenses `D2:` or `F2:`, `D_NAME:` or `F_NAME:`. Every line
/// has twelve numbers, because loaders take each for a matrix.
pub(crate) fn encode_calibration(calibration: &Calibration) -> String {
    let mut out = String::new();
    let mut line = |name: &str, rows: &Rows| {
        write!(out, "{name}: ").expect("a string takes it");
        push_rows(&mut out, rows);
    };
    for (i, rows) in calibration.projections.iter().enumerate() {
        line(&format!("P{i}"), rows);
    }
    line("Tr", &calibration.camera_from_lidar);
    if let Some((letter, rows)) = lens_line(&calibration.distortion) {
        line(&format!("{letter}2"), &rows);
    }
    for camera in &calibration.further {
        line(&format!("P_{}", camera.name), &camera.projection);
        line(&format!("Tr_{}", camera.name), &camera.camera_from_lidar);
        if let Some((letter, rows)) = lens_line(&camera.distortion) {
            line(&format!("{letter}_{}", camera.name), &rows);
        }
    }
    for lidar in &calibration.further_lidars {
        line(&format!("Tr_{}", lidar.name), &lidar.camera_from_lidar);
    }
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
        // Sensors' names are of the file.
        let shown = excerpt(name, 80);
        match lines().filter(|(n, _)| *n == name).collect::<Vec<_>>()[..] {
            [(_, rest)] => matrix(path, &shown, rest),
            ref found => Err(Error::malformed(
                path,
                format!("has {} lines '{shown}:', must have one", found.len()),
            )),
        }
    };
    let lens = |suffix: &str| -> Result<Distortion, Error> {
        let has = |letter: &str| {
            text.lines()
                .any(|l| l.starts_with(&format!("{letter}{suffix}: ")))
        };
        Ok(if has("D") {
            let rows = named(&format!("D{suffix}"))?;
            let [k1, k2, p1, p2, k3] = rows.as_flattened()[..5] else {
                return Ok(Distortion::None);
            };
            Distortion::BrownConrady { k1, k2, k3, p1, p2 }
        } else if has("F") {
            let [k1, k2, k3, k4] = named(&format!("F{suffix}"))?[0];
            Distortion::Fisheye { k1, k2, k3, k4 }
        } else {
            Distortion::None
        })
    };
    let names = |prefix: &'static str| {
        let name = move |l| Some(str::strip_prefix(l, prefix)?.split_once(": ")?.0);
        text.lines().filter_map(name)
    };
    let is_camera = |name: &str| names("P_").any(|camera| camera == name);
    let further_lidars = names("Tr_").filter(|name| !is_camera(name)).map(|name| {
        Ok(LidarCalibration {
            name: name.to_owned(),
            camera_from_lidar: named(&format!("Tr_{name}"))?,
        })
    });
    let further = names("P_").map(|name| {
        Ok(CameraCalibration {
            name: name.to_owned(),
            projection: named(&format!("P_{name}"))?,
            camera_from_lidar: named(&format!("Tr_{name}"))?,
            distortion: lens(&format!("_{name}"))?,
        })
    });
    Ok(Calibration {
        projections: [named("P0")?, named("P1")?, named("P2")?, named("P3")?],
        camera_from_lidar: named("Tr")?,
        distortion: lens("2")?,
        further: further.collect::<Result<_, Error>>()?,
        further_lidars: further_lidars.collect::<Result<_, Error>>()?,
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
        fn every_bit_comes_back(
            a in rows(),
            b in rows(),
            times in prop::collection::vec(0.0_f64..1e9, 0..9),
        ) {
            let p = Path::new("x");
            prop_assert_eq!(
                decode_poses(p, &encode_poses(&[a, b])).expect("valid"),
                vec![a, b]
            );
            prop_assert_eq!(
                decode_times(p, &encode_times(&times)).expect("valid"),
                times
            );
            let [k1, k2, k3, k4] = a[0];
            let fish = Distortion::Fisheye { k1, k2, k3, k4 };
            let bent = Distortion::BrownConrady {
                k1,
                k2,
                k3,
                p1: b[0][0],
                p2: b[0][1],
            };
            let further = vec![CameraCalibration {
                name: "rear".to_owned(),
                projection: b,
                camera_from_lidar: a,
                distortion: fish,
            }];
            let calibration = Calibration {
                projections: [a; 4],
                camera_from_lidar: b,
                distortion: bent,
                further,
                further_lidars: vec![LidarCalibration {
                    name: "roof".to_owned(),
                    camera_from_lidar: b,
                }],
            };
            let text = encode_calibration(&calibration);
            prop_assert_eq!(text.matches(':').count(), 10);
            prop_assert_eq!(decode_calibration(p, &text).expect("valid"), calibration);
        }

        #[test]
        fn matrices_are_transforms(
            x in -1e7_f64..1e7,
            yaw in -3.0_f64..3.0,
            pitch in -1.0_f64..1.0,
        ) {
            let t = RigidTransform::from_xyz_rpy(DVec3::new(x, 1.0, -x), 0.3, pitch, yaw);
            let back = from_rows(&t.to_rows());
            let p = DVec3::new(3.0, -2.0, 10.0);
            prop_assert!(t.transform_point(p).distance(back.transform_point(p)) < 1e-8);
            let near = RigidTransform {
                translation_m: t.translation_m + DVec3::X,
                ..t
            };
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
