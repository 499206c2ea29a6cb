//! What a renderer is given and what it gives back.

use glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{
    Image, Intrinsics, MaterialLibrary, Ray, RayCaster, RigidTransform, TruthImages,
};
use nemoral_seed::Key;

use crate::error::{ParamError, check};
use crate::{Exposure, ToneCurve};

/// One picture to take: a pinhole, a pose, and how the film is exposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The pinhole and its lens.
    pub intrinsics: Intrinsics,
    /// The pose of the optical frame (x right, y down, z forward) in the frame's scene.
    pub scene_from_camera: RigidTransform,
    /// How much light becomes which brightness.
    pub exposure: Exposure,
    /// How brightness becomes code values.
    pub tone: ToneCurve,
}

impl View {
    /// A view with automatic exposure and the filmic curve.
    #[must_use]
    pub fn new(intrinsics: Intrinsics, scene_from_camera: RigidTransform) -> Self {
        Self {
            intrinsics,
            scene_from_camera,
            exposure: Exposure::default(),
            tone: ToneCurve::default(),
        }
    }

    /// The ray of an image position in pixels, from the pinhole to `max_range_m`; pixel (c, r) has
    /// its centre at (c + 0.5, r + 0.5).
    #[inline]
    #[must_use]
    pub fn ray(&self, pixel: DVec2, max_range_m: f32) -> Ray {
        let direction = self
            .scene_from_camera
            .transform_vector(self.intrinsics.direction(pixel));
        Ray {
            origin: self.scene_from_camera.translation_m.as_vec3(),
            direction: direction.as_vec3(),
            t_min_m: 0.0,
            t_max_m: max_range_m,
        }
    }

    /// # Errors
    /// If the intrinsics, the pose or the exposure cannot make a picture.
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
        k.check_distortion().map_err(|e| ParamError {
            field: e.field,
            value: e.value,
            allowed: e.allowed,
        })?;
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
        self.exposure.check()
    }

    /// The optical frame's copy of a scene direction.
    pub(crate) fn to_optical(self, direction: Vec3) -> Vec3 {
        let v: DVec3 = self.scene_from_camera.rotation.inverse() * direction.as_dvec3();
        v.as_vec3()
    }
}

/// How much of the sky a place sees through the crowns.
///
/// One number per place stands for the crowns' shade on diffuse light, so that no ray is spent on
/// it: a grid of gap fractions in the pipeline, [`OpenSky`] or a closure elsewhere.
pub trait SkyVisibility: Sync {
    /// The share of the sky hemisphere that is seen from a point of the scene, 0..=1; 1 in a meadow.
    fn openness(&self, scene_point: Vec3) -> f32;
}

/// No crowns: the whole sky is seen from everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OpenSky;

impl SkyVisibility for OpenSky {
    fn openness(&self, _: Vec3) -> f32 {
        1.0
    }
}

impl<F: Fn(Vec3) -> f32 + Sync> SkyVisibility for F {
    fn openness(&self, scene_point: Vec3) -> f32 {
        self(scene_point)
    }
}

/// What there is to see, in a frame's scene: axes east, north, up.
#[derive(Clone, Copy)]
pub struct SceneView<'a> {
    /// Decides what a ray hits; the LiDAR's own.
    pub caster: &'a dyn RayCaster,
    /// The library that made the hits' [`MaterialId`](nemoral_scene::MaterialId)s.
    pub materials: &'a MaterialLibrary,
    /// The crowns' shade.
    pub sky_visibility: &'a dyn SkyVisibility,
}

impl std::fmt::Debug for SceneView<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SceneView")
            .field("materials", &self.materials.materials().len())
            .finish_non_exhaustive()
    }
}

/// A picture and the truth about it.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraImages {
    /// sRGB code values.
    pub rgb: Image<[u8; 3]>,
    /// Radiance before exposure in linear sRGB, scaled so that its luminance is in cd/m²; if asked
    /// for.
    pub linear: Option<Image<Vec3>>,
    /// What is exactly at each pixel's centre.
    pub truth: TruthImages,
    /// The exposure that was used, as EV at ISO 100.
    pub ev100: f64,
}

/// Whatever takes pictures: the seam between the ray-cast camera and other backends.
pub trait CameraRenderer {
    /// What can go wrong.
    type Error: std::error::Error;

    /// Takes a picture. `key` is the camera's in this frame; equal keys give equal pictures.
    ///
    /// # Errors
    /// If the view is impossible, or the backend failed.
    fn render(
        &self,
        scene: &SceneView<'_>,
        view: &View,
        key: Key,
    ) -> Result<CameraImages, Self::Error>;
}
