//! Poses from a file: TUM or KITTI.

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::{DMat3, DQuat, DVec3};

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

/// Reads world poses of the body with their times in seconds (a KITTI file has none: `None`) from
/// the text of a file; `origin` is what errors call it.
///
/// # Errors
/// If a line is not a pose; the error has its number and what is expected.
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
        let wrong = |expected: &'static str| {
            // A long line is shortened in the message.
            let (end, cut) = match line.char_indices().nth(80) {
                Some((end, _)) => (end, "…"),
                None => (line.len(), ""),
            };
            Error::Line {
                origin: origin.to_owned(),
                line: i + 1,
                shown: format!("{:?}{cut}", &line[..end]),
                expected,
            }
        };
        let numbers: Option<Vec<f64>> = line
            .split_whitespace()
            .map(|word| word.parse::<f64>().ok().filter(|x| x.is_finite()))
            .collect();
        let numbers = numbers.ok_or_else(|| wrong("numbers, separated by blanks"))?;
        poses.push(match (format, numbers.as_slice()) {
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
        });
    }
    if poses.is_empty() {
        return Err(Error::Empty {
            origin: origin.to_owned(),
        });
    }
    Ok(poses)
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
}
