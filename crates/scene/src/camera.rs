//! Camera intrinsics: a pinhole, and the distortion of the lens.

use glam::{DVec2, DVec3};

use crate::{Distortion, ParamError};

/// A camera with a pinhole or a lens in its optical frame (x right, y down, z forward). Pixel
/// (column c, row r) covers c..c+1 by r..r+1; its centre is (c + 0.5, r + 0.5).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Intrinsics {
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// Focal length in pixels, along x.
    pub fx: f64,
    /// Focal length in pixels, along y.
    pub fy: f64,
    /// The principal point's column, pixels from the left edge.
    pub cx: f64,
    /// The principal point's row, pixels from the top edge.
    pub cy: f64,
    /// The distortion of the lens.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Distortion::is_none")
    )]
    pub distortion: Distortion,
}

impl Intrinsics {
    /// Square pixels and a centred principal point, by the horizontal field of view.
    ///
    /// # Errors
    /// If a side is not 1..=16384 or the field of view is not between 1° and 179°.
    pub fn from_fov(width: u32, height: u32, horizontal_fov_rad: f64) -> Result<Self, ParamError> {
        Self::through_lens(width, height, horizontal_fov_rad, Distortion::None)
    }

    /// The same through a lens: the field of view is that of the middle row, without tangential
    /// distortion.
    ///
    /// # Errors
    /// As [`Intrinsics::from_fov`] and [`Intrinsics::with_distortion`].
    pub fn through_lens(
        width: u32,
        height: u32,
        horizontal_fov_rad: f64,
        distortion: Distortion,
    ) -> Result<Self, ParamError> {
        check(
            "horizontal_fov_deg",
            horizontal_fov_rad.to_degrees(),
            1.0,
            179.0,
            "1..=179",
        )?;
        let radius = distortion.radius(horizontal_fov_rad / 2.0);
        let (sin, cos) = libm::sincos(horizontal_fov_rad / 2.0);
        let sound = distortion.unfolds(DVec3::new(sin, 0.0, cos));
        if !(sound && radius > 0.0 && radius.is_finite()) {
            return Err(folded(&distortion));
        }
        let f = f64::from(width) / 2.0 / radius;
        Self::centred(width, height, f, None)?.with_distortion(distortion)
    }

    /// Intrinsics by the numbers of a calibration, in pixels; the first pixel's centre is at (0.5,
    /// 0.5).
    ///
    /// # Errors
    /// If a side is not 1..=16384, a focal length not 1..=1e6, or the principal point more than a
    /// picture's size outside the picture.
    pub fn from_calibration(
        width: u32,
        height: u32,
        focal_px: DVec2,
        centre_px: DVec2,
    ) -> Result<Self, ParamError> {
        check("fx_px", focal_px.x, 1.0, 1e6, "1..=1e6")?;
        check("fy_px", focal_px.y, 1.0, 1e6, "1..=1e6")?;
        let (w, h) = (f64::from(width), f64::from(height));
        let near = "at most a picture's size outside the picture";
        check("cx_px", centre_px.x, -w, 2.0 * w, near)?;
        check("cy_px", centre_px.y, -h, 2.0 * h, near)?;
        let centred = Self::centred(width, height, focal_px.x, Some(focal_px.y))?;
        Ok(Self {
            cx: centre_px.x,
            cy: centre_px.y,
            ..centred
        })
    }

    /// The same behind a lens.
    ///
    /// # Errors
    /// If a coefficient is beyond ±100, or the lens folds inside the picture, so that two rays are
    /// projected to the same place, or a place shows no ray within 89° of the axis.
    pub fn with_distortion(self, distortion: Distortion) -> Result<Self, ParamError> {
        let lens = Self { distortion, ..self };
        lens.check_distortion()?;
        Ok(lens)
    }

    /// Checks that the lens is valid all over the picture, as [`Intrinsics::with_distortion`]
    /// requires.
    ///
    /// # Errors
    /// If it is not; the error names the strongest coefficient of a lens that folds, or the field
    /// of view.
    pub fn check_distortion(&self) -> Result<(), ParamError> {
        /// Number of places tested along a side. They are on the border, because a fold is a curve
        /// that comes in from there.
        const PLACES: u32 = 32;
        for (field, value) in self.distortion.coefficients() {
            check(field, value, -100.0, 100.0, "-100..=100")?;
        }
        if self.distortion == Distortion::None {
            return Ok(());
        }
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        let (widest, least_z) = libm::sincos(89.0_f64.to_radians());
        // A lens without a fold up to there cannot fold nearer to the axis.
        let folds = !self.distortion.unfolds(DVec3::new(widest, 0.0, least_z));
        for i in 0..=PLACES {
            for j in 0..=PLACES {
                let part = DVec2::new(f64::from(i), f64::from(j)) / f64::from(PLACES);
                let ray = self
                    .distortion
                    .ray(self.at_unit_focal(part * DVec2::new(w, h)));
                match ray {
                    Some(r) if r.z > least_z && self.distortion.unfolds(r) => {}
                    _ if folds => return Err(folded(&self.distortion)),
                    _ => return Err(self.too_wide()),
                }
            }
        }
        Ok(())
    }

    fn too_wide(&self) -> ParamError {
        let fov_deg = self.horizontal_fov_rad().to_degrees();
        let allowed = "so small that with this lens all of the picture, its corners too, looks \
                       within 89° of the axis";
        ParamError::new("horizontal_fov_deg", fov_deg, allowed)
    }

    /// A pixel's place in the image of a camera of focal length 1.
    #[inline]
    fn at_unit_focal(&self, pixel: DVec2) -> DVec2 {
        (pixel - DVec2::new(self.cx, self.cy)) / DVec2::new(self.fx, self.fy)
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
    ) -> Result<Self, ParamError> {
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

    fn centred(width: u32, height: u32, fx: f64, fy: Option<f64>) -> Result<Self, ParamError> {
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
            distortion: Distortion::None,
        })
    }

    /// The unit direction, in the optical frame, of an image position in pixels. Through a lens it
    /// is found by Newton's method, to 1e-9 pixels all over the picture, and is the one before any
    /// fold of the lens; outside of the picture, where a lens may have no ray, it is the axis.
    #[inline]
    #[must_use]
    pub fn direction(&self, pixel: DVec2) -> DVec3 {
        if self.distortion != Distortion::None {
            let ray = self.distortion.ray(self.at_unit_focal(pixel));
            return ray.unwrap_or(DVec3::Z);
        }
        let d = DVec3::new(
            (pixel.x - self.cx) / self.fx,
            (pixel.y - self.cy) / self.fy,
            1.0,
        );
        d / d.length()
    }

    /// The image position of a point of the optical frame; `None` behind the camera, and beyond the
    /// angle where the lens folds.
    #[inline]
    #[must_use]
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        if self.distortion != Distortion::None {
            let drawn = (point.z > 0.0).then(|| self.distortion.draw(point))??;
            return Some(drawn * DVec2::new(self.fx, self.fy) + DVec2::new(self.cx, self.cy));
        }
        (point.z > 0.0).then(|| {
            DVec2::new(
                self.fx * point.x / point.z + self.cx,
                self.fy * point.y / point.z + self.cy,
            )
        })
    }

    /// The horizontal field of view of the row of the principal point, radians.
    #[must_use]
    pub fn horizontal_fov_rad(&self) -> f64 {
        if self.distortion != Distortion::None {
            let at = |x: f64| self.direction(DVec2::new(x, self.cy));
            return at(0.0).angle_between(at(f64::from(self.width)));
        }
        libm::atan((f64::from(self.width) - self.cx) / self.fx) + libm::atan(self.cx / self.fx)
    }
}

/// The error of a lens that folds, which names its strongest coefficient.
fn folded(distortion: &Distortion) -> ParamError {
    let strongest = distortion
        .coefficients()
        .into_iter()
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let (field, value) = strongest.unwrap_or(("distortion", 0.0));
    let allowed = "such that, with the others, each place of the picture shows one ray: the lens \
                   folds inside the picture";
    ParamError::new(field, value, allowed)
}

fn check(field: &str, value: f64, low: f64, high: f64, allowed: &str) -> Result<(), ParamError> {
    ParamError::check_range(field, value, low..=high, allowed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn directions_project_back(
            x in 0.0_f64..1280.0,
            y in 0.0_f64..720.0,
            fov in 0.2_f64..2.5,
            t in 0.1_f64..300.0,
        ) {
            let k = Intrinsics::from_fov(1280, 720, fov).expect("valid");
            let back = k
                .project(k.direction(DVec2::new(x, y)) * t)
                .expect("in front");
            prop_assert!(back.distance(DVec2::new(x, y)) < 1e-8);
        }
    }

    fn brown(k: [f64; 3], p: [f64; 2]) -> Distortion {
        Distortion::BrownConrady {
            k1: k[0],
            k2: k[1],
            k3: k[2],
            p1: p[0],
            p2: p[1],
        }
    }

    fn fisheye(k: [f64; 4]) -> Distortion {
        Distortion::Fisheye {
            k1: k[0],
            k2: k[1],
            k3: k[2],
            k4: k[3],
        }
    }

    /// Barrel, pincushion, tangential, moustache, and fisheyes.
    fn lenses() -> Vec<Intrinsics> {
        let all = [
            (1.4, brown([-0.28, 0.09, -0.01], [0.0, 0.0])),
            (1.2, brown([0.2, 0.05, 0.0], [0.0, 0.0])),
            (1.3, brown([-0.1, 0.02, 0.0], [0.004, -0.003])),
            (1.3, brown([-0.2, 0.15, -0.02], [-0.002, 0.001])),
            (2.2, fisheye([0.0; 4])),
            (2.4, fisheye([-0.02, 0.004, -0.001, 0.0001])),
        ];
        all.into_iter()
            .map(|(fov, d)| Intrinsics::through_lens(1280, 720, fov, d).expect("sound"))
            .collect()
    }

    #[test]
    fn every_pixel_of_a_lens_projects_back() {
        for k in lenses() {
            for (x, y) in (0..=64).flat_map(|x| (0..=36).map(move |y| (x, y))) {
                let pixel = DVec2::new(f64::from(x), f64::from(y)) * 20.0;
                let ray = k.direction(pixel);
                assert!((ray.length() - 1.0).abs() < 1e-12);
                let back = k.project(ray * 7.0).expect("in front");
                assert!(
                    back.distance(pixel) < 1e-8,
                    "{pixel} {back} {:?}",
                    k.distortion
                );
            }
        }
    }

    /// Lenses that change from pincushion to barrel distortion, for which Newton's method from the
    /// projected point runs in circles near the corners.
    #[test]
    fn every_pixel_of_a_lens_that_turns_projects_back() {
        let turning = brown([0.09, 0.67, -0.49], [0.0, 0.0]);
        let wide = fisheye([-0.214_536, 0.485_609, 0.443_167, -0.266_763]);
        for (size, focal_px, lens) in [
            ((640, 360), 333.0, turning),
            // A narrower view than that of the lens before.
            ((640, 360), 335.0, turning),
            ((640, 480), 300.447, wide),
        ] {
            let centre_px = DVec2::new(f64::from(size.0), f64::from(size.1)) / 2.0;
            let k = Intrinsics::from_calibration(size.0, size.1, DVec2::splat(focal_px), centre_px);
            let k = k.expect("valid").with_distortion(lens).expect("sound");
            for (x, y) in (0..size.0).flat_map(|x| (0..size.1).map(move |y| (x, y))) {
                let pixel = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
                let back = k.project(k.direction(pixel) * 7.0).expect("in front");
                assert!(back.distance(pixel) < 1e-8, "{pixel} {back} {lens:?}");
            }
        }
    }

    #[test]
    fn the_field_of_view_is_what_the_middle_row_sees() {
        let k = Intrinsics::through_lens(640, 480, 2.0, fisheye([0.01, 0.0, 0.0, 0.0]));
        assert!((k.expect("sound").horizontal_fov_rad() - 2.0).abs() < 1e-9);
        let k = Intrinsics::through_lens(640, 480, 1.3, brown([-0.2, 0.0, 0.0], [0.0, 0.0]));
        assert!((k.expect("sound").horizontal_fov_rad() - 1.3).abs() < 1e-9);
        // With the principal point on the left border, one half of it is missing.
        let k =
            Intrinsics::from_calibration(1280, 720, DVec2::splat(640.0), DVec2::new(0.0, 360.0));
        let plain = k.expect("valid");
        let zero = plain
            .with_distortion(brown([0.0; 3], [0.0; 2]))
            .expect("sound");
        for k in [plain, zero] {
            let fov_rad = k.horizontal_fov_rad();
            assert!((fov_rad - 2.0_f64.atan()).abs() < 1e-9, "{fov_rad}");
        }
    }

    #[test]
    fn a_lens_without_coefficients_is_a_pinhole_and_lines_bend_as_barrels_do() {
        let plain = Intrinsics::from_fov(640, 360, 1.2).expect("valid");
        let zero = plain
            .with_distortion(brown([0.0; 3], [0.0; 2]))
            .expect("sound");
        let barrel = plain
            .with_distortion(brown([-0.15, 0.0, 0.0], [0.0; 2]))
            .expect("sound");
        let line = |k: &Intrinsics, t: f64| {
            let p = k.project(DVec3::new(t, 0.3, 1.0));
            p.expect("in front")
        };
        // How far the middle of a line lies from its chord.
        let sag = |k: &Intrinsics| {
            let (a, m, b) = (line(k, -0.6), line(k, 0.0), line(k, 0.6));
            (b - a).normalize().perp_dot(m - a)
        };
        assert!(sag(&plain).abs() < 1e-9 && sag(&zero).abs() < 1e-9);
        // The ends are moved towards the axis, so the middle bulges away from it.
        assert!(sag(&barrel) > 3.0, "{}", sag(&barrel));
        let d = zero.direction(DVec2::new(3.0, 5.0)) - plain.direction(DVec2::new(3.0, 5.0));
        assert!(d.length() < 1e-14);
    }

    #[test]
    fn a_lens_that_folds_inside_the_picture_is_refused_by_name() {
        let plain = Intrinsics::from_fov(1280, 720, 1.4).expect("valid");
        let e = plain
            .with_distortion(brown([-0.5, 0.0, 0.0], [0.0; 2]))
            .expect_err("folds");
        assert_eq!(e.field, "brown_conrady.k1");
        assert!(e.to_string().contains("folds inside the picture"), "{e}");
        let e = Intrinsics::through_lens(640, 480, 2.6, fisheye([-0.3, 0.0, 0.0, 0.0]));
        assert_eq!(e.expect_err("folds").field, "fisheye.k1");
        // The corners would see rays beyond 89° from the axis.
        let e = Intrinsics::through_lens(640, 480, 3.0, fisheye([0.0; 4]));
        let e = e.expect_err("too wide");
        assert_eq!(e.field, "horizontal_fov_deg");
        assert!(e.to_string().contains("within 89°"), "{e}");
        assert!(
            plain
                .with_distortion(brown([f64::NAN, 0.0, 0.0], [0.0; 2]))
                .is_err()
        );
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
