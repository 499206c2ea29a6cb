//! Keys of a camera's optics and lens.

use serde::{Deserialize, Serialize};

use crate::schema::AllowedValues::Real;
use crate::schema::{encode_variants, section};

/// The optics of a camera.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraOptics {
    /// By its field of view.
    Fov(CameraFov),
    /// By sensor and lens.
    Sensor(CameraSensor),
    /// By a calibration.
    Calibration(CameraCalibration),
}

encode_variants! { CameraOptics
    Fov: "fov";
    Sensor: "sensor";
    Calibration: "calibration";
}

impl Default for CameraOptics {
    fn default() -> Self {
        Self::Fov(CameraFov::default())
    }
}

section! {
    /// The camera by its field of view.
    CameraFov at "camera.fov", one of "the camera's optics" {
        /// Horizontal field of view.
        horizontal_deg: f64 = 80.0, Real(1.0, 179.0), "as wide as the default LiDAR";
    }
}

section! {
    /// The camera by sensor size and focal length.
    CameraSensor at "camera.sensor", one of "the camera's optics" {
        /// Sensor width.
        width_mm: f64 = 7.2, Real(0.1, 1000.0), "1/2 inch class";
        /// Sensor height.
        height_mm: f64 = 4.05, Real(0.1, 1000.0), "1/2 inch class";
        /// Focal length.
        focal_length_mm: f64 = 4.3, Real(0.1, 1000.0), "80 degrees on 7.2 mm";
    }
}

section! {
    /// The camera by the numbers of its calibration, in pixels; the first pixel's centre is at
    /// (0.5, 0.5). Without `fy_px` pixels are square, and without a principal point it is the
    /// picture's middle.
    CameraCalibration at "camera.calibration", one of "the camera's optics" {
        /// Focal length along rows; without it, as `fy_px`.
        fx_px: f64 = 760.0, Real(1.0, 1e6), "80 degrees on 1280 pixels";
        /// Focal length along columns; without it, as `fx_px`.
        fy_px: f64 = 760.0, Real(1.0, 1e6), "square pixels";
        /// Principal point from the left edge, OpenCV's plus 0.5; without it, the middle.
        cx_px: f64 = 640.0, Real(-8192.0, 16384.0), "the middle of 1280 pixels";
        /// Principal point from the top edge, OpenCV's plus 0.5; without it, the middle.
        cy_px: f64 = 360.0, Real(-8192.0, 16384.0), "the middle of 720 pixels";
    }
}

/// The lens of a camera.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraLens {
    /// No distortion.
    Pinhole(CameraPinhole),
    /// Brown and Conrady's distortion.
    BrownConrady(CameraBrownConrady),
    /// A fisheye.
    Fisheye(CameraFisheye),
}

encode_variants! { CameraLens
    Pinhole: "pinhole";
    BrownConrady: "brown_conrady";
    Fisheye: "fisheye";
}

impl Default for CameraLens {
    fn default() -> Self {
        Self::Pinhole(CameraPinhole::default())
    }
}

section! {
    /// No distortion.
    CameraPinhole at "camera.pinhole", one of "the camera's lens" {}
}

section! {
    /// Brown and Conrady's distortion with OpenCV's coefficients, applied to picture and truth
    /// alike. The field of view is that of the middle row.
    CameraBrownConrady at "camera.brown_conrady", one of "the camera's lens" {
        /// Radial coefficient, negative for barrel distortion.
        k1: f64 = -0.1, Real(-100.0, 100.0), "a wide lens of machine vision";
        /// Radial coefficient of the fourth power.
        k2: f64 = 0.01, Real(-100.0, 100.0), "a wide lens of machine vision";
        /// Radial coefficient of the sixth power.
        k3: f64 = 0.0, Real(-100.0, 100.0), "none";
        /// Tangential.
        p1: f64 = 0.0, Real(-1.0, 1.0), "none";
        /// Tangential.
        p2: f64 = 0.0, Real(-1.0, 1.0), "none";
    }
}

section! {
    /// An equidistant fisheye after Kannala and Brandt with OpenCV's coefficients, applied to
    /// picture and truth alike. Every pixel must look within 89 degrees of the axis.
    CameraFisheye at "camera.fisheye", one of "the camera's lens" {
        /// Coefficient of the third power of the angle.
        k1: f64 = 0.0, Real(-100.0, 100.0), "equidistant";
        /// Coefficient of the fifth power.
        k2: f64 = 0.0, Real(-100.0, 100.0), "equidistant";
        /// Coefficient of the seventh power.
        k3: f64 = 0.0, Real(-100.0, 100.0), "equidistant";
        /// Coefficient of the ninth power.
        k4: f64 = 0.0, Real(-100.0, 100.0), "equidistant";
    }
}
