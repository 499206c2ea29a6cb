//! The materials of waters and their beds, and the water surfaces of a chunk.

use std::sync::Arc;

use nemoral_assets::Library;
use nemoral_raycast::Blas;
use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_scene::{
    Instance, InstancePlace, LaserBand, Liquid, Material, MaterialId, MaterialLibrary, Optics,
    Prototype, Semantic, Texture, TrailSurfaceKind,
};
use nemoral_water::WaterKind;

use super::chunk_ground::ChunkGround;
use crate::Error;

/// The materials of waters and their beds.
#[derive(Clone, Copy, Debug)]
pub struct WaterMaterials {
    /// Water that runs.
    pub stream: MaterialId,
    /// Water of ponds.
    pub pond: MaterialId,
    /// Water of puddles.
    pub puddle: MaterialId,
    /// The bed of streams.
    pub gravel: MaterialId,
    /// The bed of ponds, and wet banks.
    pub mud: MaterialId,
}

/// Wet soil that nothing has rolled flat gleams dully: crumbs, roots and leaves stick out of it.
const BED_ROUGHNESS: f32 = 0.62;

impl WaterMaterials {
    /// Adds the materials to a library, after all others.
    pub(crate) fn add_to(library: &mut Library) -> Self {
        let all = &mut library.materials;
        let bed = |kind: TrailSurfaceKind| library.ground.trail(kind).surface;
        let (gravel, mud) = (bed(TrailSurfaceKind::Gravel), bed(TrailSurfaceKind::Mud));
        let mut soil = |name: &str, of: MaterialId, wet: f32| {
            let bed = all.get(of).clone();
            all.add(Material {
                name: name.to_owned(),
                semantic: Semantic::Soil,
                albedo: Arc::new(darkened(&bed.albedo, wet)),
                roughness: bed.roughness.max(BED_ROUGHNESS),
                ..bed
            })
        };
        let (gravel, mud) = (soil("stream.bed", gravel, 0.42), soil("pond.bed", mud, 0.7));
        let mut water = |kind| all.add(water(kind));
        Self {
            stream: water(WaterKind::Stream),
            pond: water(WaterKind::Pond),
            puddle: water(WaterKind::Puddle),
            gravel,
            mud,
        }
    }

    fn of(&self, kind: WaterKind) -> MaterialId {
        match kind {
            WaterKind::Stream => self.stream,
            WaterKind::Pond => self.pond,
            WaterKind::Puddle => self.puddle,
        }
    }
}

/// A texture of half the resolution whose reflectance is this share of another's, as that of wet
/// ground is.
fn darkened(texture: &Texture, share: f32) -> Texture {
    let [width, height] = [texture.width(), texture.height()].map(|side| (side / 2).max(1));
    let texel = |i: usize| {
        let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let uv = Vec2::new(x / width as f32, y / height as f32);
        texture.sample(uv, 1.0 / width.max(height) as f32) * share
    };
    let texels: Vec<Vec3> = (0..width * height).map(texel).collect();
    Texture::from_linear(width, height, &texels).unwrap_or_else(|_| texture.clone())
}

/// Share of light that clear humic water scatters back at laser wavelengths: what enters is
/// absorbed within centimetres (8 per metre at 905 nm, 811 at 1550 nm; Hale and Querry 1973).
const LASER: [f32; 2] = [0.002, 0.0005];

/// The surface of a kind of water.
///
/// Forest streams are brown: dissolved humic matter absorbs some 3 to 15 per metre in the blue
/// (440 nm) and a tenth of that in the red, as it falls by 0.014 to 0.018 per nanometre (Bricaud,
/// Morel and Prieur 1981; Kirk 2011, "Light and Photosynthesis in Aquatic Ecosystems"). Puddles
/// are clouded by mud.
fn water(kind: WaterKind) -> Material {
    let (name, body, absorption, slope, wave_m) = match kind {
        WaterKind::Stream => (
            "water.stream",
            [0.020, 0.016, 0.009],
            [0.8, 1.5, 3.0],
            0.10,
            0.35,
        ),
        WaterKind::Pond => (
            "water.pond",
            [0.016, 0.015, 0.009],
            [0.9, 1.6, 3.4],
            0.006,
            1.4,
        ),
        WaterKind::Puddle => (
            "water.puddle",
            [0.085, 0.062, 0.038],
            [9.0, 13.0, 24.0],
            0.004,
            0.3,
        ),
    };
    let [nm905, nm1550] = LASER.map(|reflectance| LaserBand {
        reflectance,
        transmittance: 0.0,
    });
    Material {
        roughness: 0.08,
        optics: Optics { nm905, nm1550 },
        liquid: Some(Liquid {
            refractive_index: 1.33,
            absorption_per_m: Vec3::from(absorption),
            ripple_slope: slope,
            ripple_m: wave_m,
        }),
        ..Material::plain(name, Semantic::Water, Vec3::from(body))
    }
}

/// The surfaces of a chunk's waters, placed in it; `None` if there are none.
pub(crate) fn water_surfaces(
    ground: &ChunkGround,
    materials: &WaterMaterials,
    library: &Library,
) -> Result<Option<(InstancePlace, Arc<Blas>)>, Error> {
    let placed = water_instance(ground, materials, library)?;
    Ok(placed.map(|surfaces| {
        let place = surfaces.place();
        let blas = Blas::build(surfaces.prototype, &library.materials);
        (place, Arc::new(blas))
    }))
}

/// The surfaces of a chunk's waters, placed in it, without what rays need; `None` if there are
/// none.
pub(crate) fn water_instance(
    ground: &ChunkGround,
    materials: &WaterMaterials,
    library: &Library,
) -> Result<Option<Instance>, Error> {
    let mesh = ground.water_mesh(&|kind| materials.of(kind));
    if mesh.triangles.is_empty() {
        return Ok(None);
    }
    let prototype =
        Prototype::new("water", mesh, Vec::new(), &library.materials).map_err(Error::of_stage)?;
    let place = InstancePlace::at(Vec3::ZERO);
    Ok(Some(Instance::new(Arc::new(prototype), place)))
}

/// Whether a shape is surfaces of water, whose origin says nothing about where they are.
pub(crate) fn is_water(shape: &Prototype, materials: &MaterialLibrary) -> bool {
    let first = shape.mesh().triangles.first();
    first.is_some_and(|t| materials.get(t.material).liquid.is_some())
}
