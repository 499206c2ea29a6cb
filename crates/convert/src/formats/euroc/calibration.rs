//! The calibrations, as YAML.
//!
//! Numbers have a point and no exponent: readers of YAML take `1e-5` for a text, and Kalibr refuses
//! whole numbers.

use std::fmt::Write;

use nemoral_dataset::{CameraSpec, ImuSpec};
use nemoral_scene::{Distortion, RigidTransform};

use crate::formats::mcap::{image_topic, imu::TOPIC};
use crate::geometry::relative;
use crate::{Error, Sequence};

/// A lens, by the names that EuRoC and Kalibr have for it.
pub(super) struct Lens {
    euroc: &'static str,
    kalibr: &'static str,
    coefficients: [f64; 4],
}

impl Lens {
    /// The lens of a sequence's camera.
    pub(super) fn of(sequence: u32, camera: &CameraSpec) -> Result<Self, Error> {
        let radial_tangential = |coefficients| Self {
            euroc: "radial-tangential",
            kalibr: "radtan",
            coefficients,
        };
        let refused = |what: String| Error::Unsuitable {
            format: "euroc",
            reason: format!("sequence {sequence:02}, camera '{}': {what}", camera.name),
        };
        match camera.intrinsics.distortion {
            Distortion::None => Ok(radial_tangential([0.0; 4])),
            Distortion::BrownConrady {
                k1,
                k2,
                k3: 0.0,
                p1,
                p2,
            } => Ok(radial_tangential([k1, k2, p1, p2])),
            Distortion::BrownConrady { k3, .. } => Err(refused(format!(
                "k3 = {k3}: must be 0: a radial-tangential lens has k1, k2, p1 and p2 alone; make \
                 the data set with brown_conrady.k3 = 0"
            ))),
            Distortion::Fisheye { k1, k2, k3, k4 } => Ok(Self {
                euroc: "equidistant",
                kalibr: "equidistant",
                coefficients: [k1, k2, k3, k4],
            }),
            lens => Err(refused(format!(
                "the lens is {lens:?}: must be none, brown_conrady or fisheye"
            ))),
        }
    }
}

/// The densities of an inertial unit's errors: white noise and random walk of the gyroscope, then
/// of the accelerometer.
pub(super) const DENSITIES: [&str; 4] = [
    "gyroscope_noise_density",
    "gyroscope_random_walk",
    "accelerometer_noise_density",
    "accelerometer_random_walk",
];

/// `body.yaml`.
pub(super) fn body_yaml(has_unit: bool) -> String {
    let body = if has_unit {
        "the inertial unit's frame; the data set's dataset.json says where it is on the robot"
    } else {
        "the robot's, x forward, y to the left, z up"
    };
    format!("comment: simulated by nemoral\n# B is {body}.\n")
}

/// `sensor.yaml` of a camera whose pose on B is `mount`.
pub(super) fn camera_yaml(
    camera: &CameraSpec,
    lens: &Lens,
    mount: &RigidTransform,
    rate_hz: Option<f64>,
) -> String {
    let k = &camera.intrinsics;
    let mut text = format!(
        "sensor_type: camera\ncomment: simulated by nemoral, camera {}\n\
         # The camera's axes are x right, y down, z forward.\n{}",
        camera.name,
        mount_yaml(mount)
    );
    if let Some(rate_hz) = rate_hz {
        let _ = writeln!(text, "rate_hz: {}", decimal(rate_hz));
    }
    let readout_s = camera.shutter.readout_s;
    if readout_s > 0.0 {
        let _ = writeln!(
            text,
            "# The shutter rolls: it takes {} s / {} = {} s from one row to the next, and times \
             are the middle row's.",
            decimal(readout_s),
            k.height,
            decimal(readout_s / f64::from(k.height))
        );
    }
    let _ = writeln!(
        text,
        "resolution: [{}, {}]\ncamera_model: pinhole\n\
         intrinsics: {} # fu, fv, cu, cv; the first pixel's centre is at (0, 0)\n\
         distortion_model: {}\ndistortion_coefficients: {}",
        k.width,
        k.height,
        list([k.fx, k.fy, k.cx - 0.5, k.cy - 0.5]),
        lens.euroc,
        list(lens.coefficients)
    );
    text
}

/// `sensor.yaml` of the true states, which are those of B.
pub(super) fn states_yaml() -> String {
    format!(
        "sensor_type: visual-inertial\ncomment: simulated by nemoral, the truth\n{}",
        mount_yaml(&RigidTransform::IDENTITY)
    )
}

/// `sensor.yaml` of the unit, which is B.
pub(super) fn unit_yaml(unit: &ImuSpec, densities: &[f64; 4]) -> String {
    let mount = mount_yaml(&RigidTransform::IDENTITY);
    let rate_hz = decimal(unit.rate_hz);
    let densities = named(densities);
    format!(
        "sensor_type: imu\ncomment: simulated by nemoral\n{mount}rate_hz: {rate_hz}\n{densities}"
    )
}

/// Kalibr's `imu.yaml`.
pub(super) fn kalibr_unit_yaml(unit: &ImuSpec, densities: &[f64; 4]) -> String {
    let (densities, rate_hz) = (named(densities), decimal(unit.rate_hz));
    format!("{densities}rostopic: {TOPIC}\nupdate_rate: {rate_hz}\n")
}

/// Kalibr's `camchain-imucam.yaml`, or without a unit its `camchain.yaml`.
pub(super) fn camera_chain(sequence: &Sequence<'_>) -> Result<String, Error> {
    let mut text = String::new();
    let mut before: Option<&CameraSpec> = None;
    for (i, camera) in sequence.cameras.iter().enumerate() {
        let k = &camera.intrinsics;
        let lens = Lens::of(sequence.number, camera)?;
        let _ = writeln!(text, "cam{i}: # camera {}", camera.name);
        let pose_of = |other| rows(&relative(&camera.body_from_camera, other));
        if let Some(unit) = sequence.imu {
            let _ = write!(text, "  T_cam_imu:\n{}", pose_of(&unit.body_from_imu));
        }
        if let Some(before) = before {
            let _ = write!(text, "  T_cn_cnm1:\n{}", pose_of(&before.body_from_camera));
        }
        let _ = writeln!(
            text,
            "  camera_model: pinhole\n  intrinsics: {}\n  distortion_model: {}\n  \
             distortion_coeffs: {}\n  resolution: [{}, {}]\n  rostopic: {}",
            list([k.fx, k.fy, k.cx - 0.5, k.cy - 0.5]),
            lens.kalibr,
            list(lens.coefficients),
            k.width,
            k.height,
            image_topic(&camera.name)
        );
        if sequence.imu.is_some() {
            text += "  timeshift_cam_imu: 0.0\n";
        }
        before = Some(camera);
    }
    Ok(text)
}

/// A line for each density.
fn named(densities: &[f64; 4]) -> String {
    let lines = DENSITIES.iter().zip(densities);
    lines
        .map(|(name, v)| format!("{name}: {}\n", decimal(*v)))
        .collect()
}

/// `T_BS`: takes points of the sensor to B.
fn mount_yaml(mount: &RigidTransform) -> String {
    let mut text = "T_BS:\n  cols: 4\n  rows: 4\n  data: [".to_owned();
    for row in mount.to_rows() {
        text += &row.map(decimal).join(", ");
        text += ",\n         ";
    }
    text + "0.0, 0.0, 0.0, 1.0]\n"
}

/// A 4 × 4 matrix as Kalibr has it, indented farther than its key, as OpenCV's reader wants it.
fn rows(transform: &RigidTransform) -> String {
    let [a, b, c] = transform.to_rows();
    let rows = [a, b, c, [0.0, 0.0, 0.0, 1.0]];
    rows.map(|row| format!("    - {}\n", list(row))).concat()
}

fn list<const N: usize>(numbers: [f64; N]) -> String {
    format!("[{}]", numbers.map(decimal).join(", "))
}

/// A number with all its digits and a point.
fn decimal(v: f64) -> String {
    // Adding zero turns -0 into 0.
    let mut text = (v + 0.0).to_string();
    if !text.contains('.') {
        text += ".0";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_and_no_exponent() {
        let numbers = [1.9393e-5, -0.0, 200.0, 1e-17, -4.5].map(decimal);
        assert_eq!(
            numbers,
            ["0.000019393", "0.0", "200.0", "0.00000000000000001", "-4.5"]
        );
    }
}
