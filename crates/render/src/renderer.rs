//! What a renderer is given and what it gives back.

use glam::Vec3;
use nemoral_scene::{Image, InstancedScene, MaterialLibrary, RayCaster, TruthImages};
use nemoral_seed::Key;

use crate::camera::view::View;

/// How much of the sky a place sees through the crowns.
///
/// One number per place stands for the crowns' shade on diffuse light, so that no ray is spent on
/// it: a grid of gap fractions in the pipeline, [`OpenSky`] or a closure elsewhere.
pub trait SkyVisibility: Sync {
    /// The share of the sky hemisphere that is seen from a point of the scene, 0..=1; 1 in a
    /// meadow.
    fn sky_view_factor(&self, scene_point: Vec3) -> f32;
}

/// No crowns: the whole sky is seen from everywhere.
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

/// What there is to see, in a frame's scene: axes east, north, up.
#[derive(Clone, Copy)]
pub struct SceneView<'a> {
    /// Decides what a ray hits; the LiDAR's own.
    pub caster: &'a dyn RayCaster,
    /// The shapes that the caster casts at, for renderers that draw shapes. Renderers that cast
    /// rays do not need it.
    pub instances: Option<&'a dyn InstancedScene>,
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
