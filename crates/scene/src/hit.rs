//! Hits of rays.

use glam::{Vec2, Vec3};

use crate::{GroundMixture, MaterialId, ObjectId};

/// The nearest opaque surface point on a ray, with what is needed to label and to shade it.
///
/// A caster whose shapes have neither textures nor smooth normals needs [`Hit::new`] alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The surface: its distance, material and object.
    pub surface: SurfaceHit,
    /// The shading: what the colour depends on besides the material.
    pub shading: Shading,
}

/// Where a ray meets a surface, its material and its object: all that range sensors and labels
/// need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHit {
    /// Distance from the ray's origin, metres.
    pub distance_m: f32,
    /// Unit normal of the flat primitive. It points to the outside of the shape, not necessarily
    /// towards the ray.
    pub geometric_normal: Vec3,
    /// The surface's material, whose semantic is the truth.
    pub material: MaterialId,
    /// The object that the surface belongs to; [`ObjectId::NONE`] for the ground and the like.
    pub object: ObjectId,
}

/// What the colour of a surface point depends on besides its material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shading {
    /// Unit interpolated normal, on the same side as [`SurfaceHit::geometric_normal`].
    pub normal: Vec3,
    /// Texture coordinate.
    pub uv: Vec2,
    /// Texture repetitions per metre of surface at the hit.
    pub uv_per_m: f32,
    /// The ground materials whose colours meet here; `None` where there is the surface's own alone.
    pub mixture: Option<GroundMixture>,
    /// The instance's colour variation, 0..1; 0.5 is the material's own colour.
    pub variation: f32,
    /// The share of the light from all around that other parts of the same shape let through,
    /// 0..=1: see [`AmbientOcclusion`](crate::AmbientOcclusion). It is 1 where it is not known.
    pub ambient_occlusion: f32,
}

impl Hit {
    /// A hit at a distance in metres on a flat surface with a unit normal, of no object, in the
    /// material's plain colour.
    #[must_use]
    pub const fn new(distance_m: f32, normal: Vec3, material: MaterialId) -> Self {
        Self {
            surface: SurfaceHit {
                distance_m,
                geometric_normal: normal,
                material,
                object: ObjectId::NONE,
            },
            shading: Shading::flat(normal),
        }
    }

    /// The same hit on the surface of an object.
    #[must_use]
    pub const fn with_object(mut self, object: ObjectId) -> Self {
        self.surface.object = object;
        self
    }
}

impl Shading {
    /// The shading of a flat surface with a unit normal: the corner of the texture at one
    /// repetition per metre, no blending, the material's own colour, no occlusion.
    #[must_use]
    pub const fn flat(normal: Vec3) -> Self {
        Self {
            normal,
            uv: Vec2::ZERO,
            uv_per_m: 1.0,
            mixture: None,
            variation: 0.5,
            ambient_occlusion: 1.0,
        }
    }
}

impl From<Hit> for SurfaceHit {
    fn from(hit: Hit) -> Self {
        hit.surface
    }
}
