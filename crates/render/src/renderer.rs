//! The input and the output of renderers.

use glam::Vec3;
use nemoral_scene::{Image, InstancedScene, MaterialLibrary, RayCaster, TruthImages};
use nemoral_seed::Key;

use crate::Lamp;
use crate::camera::view::View;
use crate::error::ParamError;

/// The share of the sky that is visible through the crowns.
///
/// One number per place stands for the crowns' shade on diffuse light, so that no rays are needed
/// for it, and another one for that of what stands on the ground: grids in the pipeline,
/// [`OpenSky`] or a closure elsewhere.
pub trait SkyVisibility: Sync {
    /// The share of the sky hemisphere that is visible from a point of the scene, 0..=1; it is 1 in
    /// the open.
    fn sky_view_factor(&self, scene_point: Vec3) -> f32;

    /// The share of the light from all around that low plants, stems and stones let through to the
    /// ground, and to what lies on it, at a point of it, 0..=1: what
    /// [`AmbientOcclusion`](nemoral_scene::AmbientOcclusion) is between the leaves of a plant. It
    /// is 1 if this is not known.
    fn ground_occlusion(&self, _scene_point: Vec3) -> f32 {
        1.0
    }
}

/// A world without crowns, where the whole sky is visible from everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OpenSky;

impl SkyVisibility for OpenSky {
    fn sky_view_factor(&self, _: Vec3) -> f32 {
        1.0
    }
}

impl<F: Fn(Vec3) -> f32 + Sync> SkyVisibility for F {
    fn sky_view_factor(&self, scene_point: Vec3) -> f32 {
        self(scene_point)
    }
}

/// The scene of a frame for renderers; its axes are east, north, up.
#[derive(Clone, Copy)]
pub struct SceneView<'a> {
    /// The ray caster, the same as the LiDAR's.
    pub caster: &'a dyn RayCaster,
    /// The shapes of the scene, for renderers that draw shapes. Renderers that cast rays do not
    /// need it.
    pub instances: Option<&'a dyn InstancedScene>,
    /// The library that made the hits' [`MaterialId`](nemoral_scene::MaterialId)s.
    pub materials: &'a MaterialLibrary,
    /// The crowns' shade.
    pub sky_visibility: &'a dyn SkyVisibility,
    /// The lamps that shine, usually those of the cameras' carrier. While rows are read they stay
    /// where they are at the picture's time.
    pub lamps: &'a [Lamp],
}

impl SceneView<'_> {
    /// # Errors
    /// If a material has a number that is not in its range.
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        for material in self.materials.materials() {
            material.check().map_err(|mut error| {
                error.field = format!("materials[{}].{}", material.name, error.field);
                error
            })?;
        }
        Ok(())
    }

    /// The sky view factor at a camera, which decides about the air in all of its picture.
    ///
    /// # Errors
    /// If it is not finite; small errors of rounding beside 0..=1 do no harm.
    pub(crate) fn sky_view_factor_of_camera(&self, position: Vec3) -> Result<f32, ParamError> {
        let share = self.sky_visibility.sky_view_factor(position);
        let field = "sky_visibility.sky_view_factor(camera)";
        ParamError::check(share.is_finite(), field, share, "finite")?;
        Ok(share)
    }
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
    /// for. Pixels whose light is no number, because what was rendered has one, are black.
    pub linear: Option<Image<Vec3>>,
    /// The truth at exactly each pixel's centre.
    pub truth: TruthImages,
    /// The exposure that was used, as EV at ISO 100.
    pub ev100: f64,
}

/// A renderer of pictures, the interface of the ray-cast camera and other backends.
pub trait CameraRenderer {
    /// The error of the renderer.
    type Error: std::error::Error;

    /// Takes a picture. `key` is the camera's in this frame; equal keys give equal pictures.
    ///
    /// # Errors
    /// If the view or a material is invalid, the sky view factor at the camera is not finite, or
    /// the backend failed.
    fn render(
        &self,
        scene: &SceneView<'_>,
        view: &View,
        key: Key,
    ) -> Result<CameraImages, Self::Error>;
}
