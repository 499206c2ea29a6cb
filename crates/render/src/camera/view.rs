//! One picture to take: lens, pose, motion, shutter and exposure.

use glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{Intrinsics, Ray, RigidTransform, Shutter, Twist};

use super::exposure::Exposure;
use super::metering::Metering;
use super::precipitation::Precipitation;
use super::processing::Processing;
use super::sensor_noise::SensorNoise;
use super::soiling::Soiling;
use super::tone::ToneCurve;
use crate::error::{ParamError, check};

/// One picture to take: a lens, a pose, a shutter, an exposure and a tone curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The pinhole and its lens.
    pub intrinsics: Intrinsics,
    /// The pose of the optical frame (x right, y down, z forward) in the frame's scene, at the
    /// picture's time.
    pub scene_from_camera: RigidTransform,
    /// The motion of that pose around the picture's time.
    pub motion: Twist,
    /// When the rows are exposed. The truth of a row is that of the middle of its exposure, in the
    /// optical frame at that time; its colour is the mean over its exposure.
    pub shutter: Shutter,
    /// The exposure.
    pub exposure: Exposure,
    /// What an automatic exposure looks at.
    pub metering: Metering,
    /// What the exposure, automatic or fixed, is wrong by, −10..=10 stops: with 1 twice the light
    /// is recorded.
    pub exposure_error_ev: f64,
    /// The tone curve.
    pub tone: ToneCurve,
    /// The noise of the sensor; `None` for a perfect one.
    pub noise: Option<SensorNoise>,
    /// Dirt and drops on the lens; `None` for a clean one.
    pub soiling: Option<Soiling>,
    /// Rain and snowfall, if any.
    pub precipitation: Option<Precipitation>,
    /// What the camera makes of the sensor's values.
    pub processing: Processing,
}

impl View {
    /// A still view at one instant, with automatic exposure, the standard curve, a perfect sensor,
    /// a clean lens, in dry weather, and without processing.
    #[must_use]
    pub fn new(intrinsics: Intrinsics, scene_from_camera: RigidTransform) -> Self {
        Self {
            intrinsics,
            scene_from_camera,
            motion: Twist::STILL,
            shutter: Shutter::INSTANT,
            exposure: Exposure::default(),
            metering: Metering::default(),
            exposure_error_ev: 0.0,
            tone: ToneCurve::default(),
            noise: None,
            soiling: None,
            precipitation: None,
            processing: Processing::default(),
        }
    }

    /// The ray of an image position in pixels, from the pinhole to `max_range_m`, in the middle of
    /// its row's exposure; pixel (c, r) has its centre at (c + 0.5, r + 0.5).
    #[inline]
    #[must_use]
    pub fn ray(&self, pixel: DVec2, max_range_m: f32) -> Ray {
        self.ray_at(pixel, 0.0, max_range_m)
    }

    /// The same `offset_s` after the middle of the exposure.
    #[inline]
    pub(crate) fn ray_at(&self, pixel: DVec2, offset_s: f64, max_range_m: f32) -> Ray {
        let pose = self.pose_at(pixel.y, offset_s);
        let direction = pose.transform_vector(self.intrinsics.direction(pixel));
        Ray {
            origin: pose.translation_m.as_vec3(),
            direction: direction.as_vec3(),
            t_min_m: 0.0,
            t_max_m: max_range_m,
        }
    }

    /// The pose of the optical frame in the middle of the exposure of the row at `y_px` from the
    /// top, which is the frame of that row's depth and normals.
    #[inline]
    #[must_use]
    pub fn scene_from_row(&self, y_px: f64) -> RigidTransform {
        self.pose_at(y_px, 0.0)
    }

    #[inline]
    pub(crate) fn pose_at(&self, y_px: f64, offset_s: f64) -> RigidTransform {
        let time_s = self.shutter.row_time_s(y_px, self.intrinsics.height) + offset_s;
        if time_s == 0.0 || self.motion == Twist::STILL {
            return self.scene_from_camera;
        }
        self.scene_from_camera * self.motion.after(time_s)
    }

    /// The image position of a point of the scene; `None` where [`Intrinsics::project_moving`] has
    /// none.
    #[must_use]
    pub fn project(&self, scene_point: DVec3) -> Option<DVec2> {
        let in_camera = self
            .scene_from_camera
            .inverse()
            .transform_point(scene_point);
        (self.intrinsics).project_moving(in_camera, &self.shutter, &self.motion)
    }

    /// Whether its picture has motion blur.
    pub(crate) fn blurs(&self) -> bool {
        self.shutter.exposure_s > 0.0 && self.motion != Twist::STILL
    }

    /// Whether its rows are taken from different poses.
    #[cfg(feature = "gpu")]
    pub(crate) fn rolls(&self) -> bool {
        self.shutter.readout_s > 0.0 && self.motion != Twist::STILL
    }

    /// The view with all rows `offset_s` later and exposed for an instant, which has the rays of
    /// [`ray_at`](Self::ray_at).
    #[cfg(feature = "gpu")]
    pub(crate) fn later(&self, offset_s: f64) -> Self {
        let moved = self.motion.after(offset_s);
        Self {
            scene_from_camera: self.scene_from_camera * moved,
            // The origin moves on along a straight line, but its velocity is expressed in the
            // rotated axes.
            motion: Twist {
                linear_m_s: moved.rotation.inverse() * self.motion.linear_m_s,
                angular_rad_s: self.motion.angular_rad_s,
            },
            shutter: Shutter {
                exposure_s: 0.0,
                ..self.shutter
            },
            ..*self
        }
    }

    /// # Errors
    /// If the intrinsics, the pose or the exposure are not valid.
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        let k = &self.intrinsics;
        for (field, side) in [("view.width_px", k.width), ("view.height_px", k.height)] {
            check(field, f64::from(side), 1.0, 16384.0, "1..=16384")?;
        }
        for (field, focal) in [("view.fx", k.fx), ("view.fy", k.fy)] {
            check(field, focal, 1e-3, 1e9, "0.001..=1e9 pixels")?;
        }
        for (field, centre) in [("view.cx", k.cx), ("view.cy", k.cy)] {
            check(field, centre, -1e9, 1e9, "-1e9..=1e9 pixels")?;
        }
        k.check_distortion()?;
        let pose = &self.scene_from_camera;
        for c in pose.translation_m.to_array() {
            check(
                "view.translation_m",
                c,
                -1e5,
                1e5,
                "-100,000..=100,000 m from the scene's origin",
            )?;
        }
        check(
            "view.rotation",
            pose.rotation.length(),
            1.0 - 1e-6,
            1.0 + 1e-6,
            "a unit quaternion",
        )?;
        for (field, time) in [
            ("view.exposure_s", self.shutter.exposure_s),
            ("view.readout_s", self.shutter.readout_s),
        ] {
            check(field, time, 0.0, 10.0, "0..=10 s")?;
        }
        for (field, speed) in [
            ("view.linear_m_s", self.motion.linear_m_s.length()),
            ("view.angular_rad_s", self.motion.angular_rad_s.length()),
        ] {
            check(field, speed, 0.0, 1e3, "0..=1000")?;
        }
        if let Some(noise) = &self.noise {
            noise.check()?;
        }
        if let Some(precipitation) = &self.precipitation {
            precipitation.check()?;
        }
        if let Some(soiling) = &self.soiling {
            soiling.check()?;
        }
        self.processing.check()?;
        let stops = "-10..=10 stops";
        check(
            "view.exposure_error_ev",
            self.exposure_error_ev,
            -10.0,
            10.0,
            stops,
        )?;
        self.exposure.check()
    }

    /// A scene direction in the optical frame of the row at `y_px`.
    pub(crate) fn to_optical(self, direction: Vec3, y_px: f64) -> Vec3 {
        let v: DVec3 = self.scene_from_row(y_px).rotation.inverse() * direction.as_dvec3();
        v.as_vec3()
    }
}
