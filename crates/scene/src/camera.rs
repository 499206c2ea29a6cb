//! Pinhole intrinsics.

use std::fmt;

use glam::{DVec2, DVec3};

/// A pinhole camera in its optical frame (x right, y down, z forward). Pixel (column c, row r) covers
/// c..c+1 by r..r+1; its centre is (c + 0.5, r + 0.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal length in pixels, along x.
    pub fx: f64,
    /// Focal length in pixels, along y.
    pub fy: f64,
    /// Principal point, pixels.
    pub cx: f64,
    /// Principal point, pixels.
    pub cy: f64,
}

/// Impossible intrinsics.
#[derive(Clone, Debug, PartialEq)]
pub struct IntrinsicsError {
    /// The offending field.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// What is allowed.
    pub allowed: &'static str,
}

impl fmt::Display for IntrinsicsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} = {}: must be {}",
            self.field, self.value, self.allowed
        )
    }
}

impl std::error::Error for IntrinsicsError {}

impl Intrinsics {
    /// Square pixels and a centred principal point, by the horizontal field of view.
    ///
    /// # Errors
    /// If a side is not 1..=16384 or the field of view is not between 1° and 179°.
    pub fn from_fov(
        width: u32,
        height: u32,
        horizontal_fov_rad: f64,
    ) -> Result<Self, IntrinsicsError> {
        check(
            "horizontal_fov_deg",
            horizontal_fov_rad.to_degrees(),
            1.0,
            179.0,
            "1..=179",
        )?;
        Self::centred(
            width,
            height,
            f64::from(width) / 2.0 / (horizontal_fov_rad / 2.0).tan(),
            None,
        )
    }

    /// By sensor size and focal length, both in millimetres (the paper, section V-C). Pixels need
    /// not be square.
    ///
    /// # Errors
    /// If a side is not 1..=16384, or a length is not 0.1..=1000 mm.
    pub fn from_sensor(
        width: u32,
        height: u32,
        sensor_mm: DVec2,
        focal_length_mm: f64,
    ) -> Result<Self, IntrinsicsError> {
        check("sensor_width_mm", sensor_mm.x, 0.1, 1000.0, "0.1..=1000")?;
        check("sensor_height_mm", sensor_mm.y, 0.1, 1000.0, "0.1..=1000")?;
        check(
            "focal_length_mm",
            focal_length_mm,
            0.1,
            1000.0,
            "0.1..=1000",
        )?;
        let f = DVec2::new(f64::from(width), f64::from(height)) / sensor_mm * focal_length_mm;
        Self::centred(width, height, f.x, Some(f.y))
    }

    fn centred(width: u32, height: u32, fx: f64, fy: Option<f64>) -> Result<Self, IntrinsicsError> {
        check("width_px", f64::from(width), 1.0, 16384.0, "1..=16384")?;
        check("height_px", f64::from(height), 1.0, 16384.0, "1..=16384")?;
        let (cx, cy) = (f64::from(width) / 2.0, f64::from(height) / 2.0);
        Ok(Self {
            width,
            height,
            fx,
            fy: fy.unwrap_or(fx),
            cx,
            cy,
        })
    }

    /// The unit direction, in the optical frame, of an image position in pixels.
    #[inline]
    #[must_use]
    pub fn direction(&self, pixel: DVec2) -> DVec3 {
        let d = DVec3::new(
            (pixel.x - self.cx) / self.fx,
            (pixel.y - self.cy) / self.fy,
            1.0,
        );
        d / d.length()
    }

    /// The image position of a point of the optical frame; `None` behind the camera.
    #[inline]
    #[must_use]
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        (point.z > 0.0).then(|| {
            DVec2::new(
                self.fx * point.x / point.z + self.cx,
                self.fy * point.y / point.z + self.cy,
            )
        })
    }

    /// The horizontal field of view, radians.
    #[must_use]
    pub fn horizontal_fov_rad(&self) -> f64 {
        2.0 * (f64::from(self.width) / 2.0 / self.fx).atan()
    }
}

fn check(
    field: &'static str,
    value: f64,
    low: f64,
    high: f64,
    allowed: &'static str,
) -> Result<(), IntrinsicsError> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(IntrinsicsError {
            field,
            value,
            allowed,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn directions_project_back(x in 0.0_f64..1280.0, y in 0.0_f64..720.0, fov in 0.2_f64..2.5, t in 0.1_f64..300.0) {
            let k = Intrinsics::from_fov(1280, 720, fov).expect("valid");
            let back = k.project(k.direction(DVec2::new(x, y)) * t).expect("in front");
            prop_assert!(back.distance(DVec2::new(x, y)) < 1e-8);
        }
    }

    #[test]
    fn sensor_and_fov_agree() {
        let fov = 2.0 * (36.0_f64 / 2.0 / 24.0).atan();
        let a = Intrinsics::from_fov(1280, 720, fov).expect("valid");
        let b = Intrinsics::from_sensor(1280, 720, DVec2::new(36.0, 20.25), 24.0).expect("valid");
        assert!((a.fx - b.fx).abs() < 1e-9 && (a.fy - b.fy).abs() < 1e-9);
        assert!((a.horizontal_fov_rad() - fov).abs() < 1e-12);
    }

    #[test]
    fn impossible_cameras_are_refused() {
        assert!(Intrinsics::from_fov(0, 720, 1.0).is_err());
        let e = Intrinsics::from_fov(1280, 720, 4.0).expect_err("too wide");
        assert!(e.to_string().contains("horizontal_fov_deg"));
        assert!(Intrinsics::from_sensor(9, 9, DVec2::ONE, f64::NAN).is_err());
    }
}
