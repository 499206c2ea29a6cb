//! Poses from a file: TUM or KITTI.

use nemoral_scene::glam::{DMat3, DQuat, DVec3};
use nemoral_scene::{RigidTransform, excerpt};

use crate::Error;

/// A format of pose files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseFormat {
    /// TUM: `t x y z qx qy qz qw` on each line.
    Tum,
    /// KITTI: a 3 x 4 matrix on each line, row by row, without a time.
    Kitti,
}

impl PoseFormat {
    /// The format of a name, `tum` or `kitti`.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        match name {
            "tum" => Some(Self::Tum),
            "kitti" => Some(Self::Kitti),
            _ => None,
        }
    }
}

/// The greatest time of a pose, seconds. The time since 1970 is 2e9 s, and 2e12 in milliseconds.
const LATEST_S: f64 = 1e10;

/// The greatest distance of a pose from the world's origin along each axis, metres, as of all poses
/// at which sensors record.
const FARTHEST_M: f64 = 1e8;

/// Reads world poses of the body with their times in seconds (a KITTI file has none: `None`) from
/// the text of a file; `origin` is what errors call it.
///
/// # Errors
/// If a line is not a pose, or one whose time is not within 1e10 s of 0, as those in nanoseconds
/// are not, or whose coordinates are not within 1e8 m; the error has the line's number and what is
/// expected.
pub fn read_poses(
    text: &str,
    origin: &str,
    format: PoseFormat,
) -> Result<Vec<(Option<f64>, RigidTransform)>, Error> {
    let mut poses = Vec::new();
    for (i, line) in text.lines().enumerate() {
        if line.trim().is_empty() || line.trim_start().starts_with('#') {
            continue;
        }
        let wrong = |expected: &'static str| Error::Line {
            origin: origin.to_owned(),
            line: i + 1,
            shown: format!("\"{}\"", excerpt(line, 80)),
            expected,
        };
        let numbers: Option<Vec<f64>> = line
            .split_whitespace()
            .map(|word| word.parse::<f64>().ok().filter(|x| x.is_finite()))
            .collect();
        let numbers = numbers.ok_or_else(|| wrong("numbers, separated by blanks"))?;
        let (time_s, pose) = match (format, numbers.as_slice()) {
            (PoseFormat::Tum, &[t, x, y, z, qx, qy, qz, qw]) => {
                let q = DQuat::from_xyzw(qx, qy, qz, qw);
                if (q.length() - 1.0).abs() > 0.01 {
                    return Err(wrong("a pose whose quaternion has length 1"));
                }
                (
                    Some(t),
                    RigidTransform {
                        rotation: q.normalize(),
                        translation_m: DVec3::new(x, y, z),
                    },
                )
            }
            (PoseFormat::Kitti, &[a, b, c, x, d, e, f, y, g, h, i, z]) => {
                let m = DMat3::from_cols_array(&[a, d, g, b, e, h, c, f, i]);
                let turned = (m * m.transpose() - DMat3::IDENTITY).to_cols_array();
                if turned.iter().any(|v| v.abs() > 0.01) || m.determinant() < 0.0 {
                    return Err(wrong("a pose whose 3 x 3 part is a rotation"));
                }
                let rotation = DQuat::from_mat3(&m).normalize();
                (
                    None,
                    RigidTransform {
                        rotation,
                        translation_m: DVec3::new(x, y, z),
                    },
                )
            }
            (PoseFormat::Tum, _) => return Err(wrong("`t x y z qx qy qz qw`")),
            (PoseFormat::Kitti, _) => return Err(wrong("12 numbers, a 3 x 4 matrix row by row")),
        };
        if let Some((shown, expected)) = beyond(time_s, pose.translation_m) {
            return Err(Error::Line {
                origin: origin.to_owned(),
                line: i + 1,
                shown,
                expected,
            });
        }
        poses.push((time_s, pose));
    }
    if poses.is_empty() {
        return Err(Error::Empty {
            origin: origin.to_owned(),
        });
    }
    Ok(poses)
}

/// The number of a pose that is beyond what can be recorded, if there is one, and what is allowed.
fn beyond(time_s: Option<f64>, place_m: DVec3) -> Option<(String, &'static str)> {
    if let Some(time_s) = time_s.filter(|t| t.abs() > LATEST_S) {
        return Some((format!("t = {time_s:e}"), "seconds within 1e10 of 0"));
    }
    let mut axes = ["x", "y", "z"].into_iter().zip(place_m.to_array());
    let (axis, far_m) = axes.find(|(_, m)| m.abs() > FARTHEST_M)?;
    Some((format!("{axis} = {far_m:e}"), "metres within 1e8 of 0"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(format: &str, text: &str) -> Result<Vec<(Option<f64>, RigidTransform)>, Error> {
        let format = PoseFormat::by_name(format).expect("a format's name");
        read_poses(text, "poses.txt", format)
    }

    #[test]
    fn both_formats_say_the_same() {
        let yaw = DQuat::from_rotation_z(0.5);
        let tum = format!(
            "# t x y z q\n\n0.5 1 2 3 {} {} {} {}\n",
            yaw.x, yaw.y, yaw.z, yaw.w
        );
        let (s, c) = 0.5_f64.sin_cos();
        let kitti = format!("{c} {} 0 1 {s} {c} 0 2 0 0 1 3\n", -s);
        let (a, b) = (
            read("tum", &tum).expect("fine"),
            read("kitti", &kitti).expect("fine"),
        );
        assert_eq!((a[0].0, b[0].0), (Some(0.5), None));
        let p = DVec3::new(0.3, 0.4, 0.5);
        assert!(
            a[0].1
                .transform_point(p)
                .distance(b[0].1.transform_point(p))
                < 1e-12
        );
    }

    #[test]
    fn bad_lines_are_named() {
        for (format, text, expected) in [
            ("tum", "0 1 2\n", ":1:"),
            ("tum", "# c\n0 1 2 3 0 0 0 x\n", ":2:"),
            ("tum", "0 1 2 3 0 0 0 2\n", "length 1"),
            ("kitti", "1 0 0 0 0 1 0 0 0 0 -1 0\n", "rotation"),
            ("kitti", "1 2 3\n", "12 numbers"),
            ("tum", "\n", "no pose"),
        ] {
            let text = read(format, text).expect_err("is refused").to_string();
            assert!(text.contains(expected), "{text}");
        }
    }

    #[test]
    fn times_and_places_of_other_units_are_refused() {
        for (format, text, expected) in [
            (
                "tum",
                "# ns\n1700000000000000000 1 2 3 0 0 0 1\n",
                "poses.txt:2: t = 1.7e18: must be seconds within 1e10 of 0",
            ),
            ("tum", "-2e10 1 2 3 0 0 0 1\n", ":1: t = -2e10: must be"),
            (
                "tum",
                "0 1 -3e8 3 0 0 0 1\n",
                ":1: y = -3e8: must be metres within 1e8 of 0",
            ),
            (
                "kitti",
                "1 0 0 0 0 1 0 0 0 0 1 2e11\n",
                ":1: z = 2e11: must be",
            ),
        ] {
            let text = read(format, text).expect_err("is refused").to_string();
            assert!(text.contains(expected), "{text}");
        }
        // Seconds since 1970 and metres of national grids are fine, and so are times before 0.
        let honest = "-3 0 0 0 0 0 0 1\n1305031102.1758 458000.5 6290000 1e8 0 0 0 1\n";
        assert_eq!(read("tum", honest).expect("fine").len(), 2);
    }
}
