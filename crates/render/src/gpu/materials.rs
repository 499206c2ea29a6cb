//! Materials and masks as the shaders read them.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use nemoral_scene::{AlphaMask, Liquid, Material, MaterialLibrary, Texture};

use super::pipeline::{storage, texture};
use super::{Gpu, GpuError};

/// The side of a layer of the albedo, texels: two to the power of `ALBEDO_SIDE`
/// in `lighting.wgsl`.
const SIDE: u32 = 1024;
/// The texels of a layer.
const LAYER: usize = (SIDE * SIDE) as usize;

/// `Material` in `surface.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Record {
    semantic: u32,
    mask: u32,
    mask_width: u32,
    mask_height: u32,
    flags: u32,
    albedo: u32,
    albedo_width: u32,
    albedo_height: u32,
    transmittance: [f32; 3],
    roughness: f32,
    mean_albedo: [f32; 3],
    tile_m: f32,
}

/// A material library on the GPU.
#[derive(Debug)]
pub(crate) struct Materials {
    /// The library that was uploaded. Its masks and textures are kept alive, so that no others get
    /// their addresses.
    library: Vec<Material>,
    pub(crate) records: wgpu::Buffer,
    pub(crate) masks: wgpu::Buffer,
    /// The albedo of all mips of all textures, as square roots of linear light with ten bits each,
    /// in the order of rows and layers. A texture, because GPUs limit a buffer to as little as
    /// 128 MiB, which is less than a stand of many species has.
    pub(crate) albedos: wgpu::Texture,
}

impl Materials {
    pub(crate) fn upload(gpu: &Gpu, library: &MaterialLibrary) -> Result<Self, GpuError> {
        let (mut masks, mut texels) = (Vec::new(), Vec::new());
        let mut known_masks: Vec<(Arc<AlphaMask>, u32)> = Vec::new();
        let mut known_textures: Vec<(Arc<Texture>, u32)> = Vec::new();
        let root = roots();
        let mut records = Vec::new();
        for material in library.materials() {
            let (mut mask, mut size) = (0, [0, 0]);
            if let Some(m) = &material.mask {
                size = [m.width() as u32, m.height() as u32];
                mask = place(&mut known_masks, m, &mut masks, |out| {
                    out.extend_from_slice(m.words());
                });
            }
            let texture = &material.albedo;
            let albedo = place(&mut known_textures, texture, &mut texels, |out| {
                for level in 0..texture.levels() {
                    out.extend(texture.level(level).iter().map(|t| pack(*t, &root)));
                }
            });
            records.push(Record {
                semantic: material.semantic as u32,
                mask,
                mask_width: size[0],
                mask_height: size[1],
                flags: flags(material),
                albedo,
                albedo_width: texture.width() as u32,
                albedo_height: texture.height() as u32,
                transmittance: material.transmittance.to_array(),
                roughness: material.roughness.clamp(0.0, 1.0),
                mean_albedo: texture.mean().to_array(),
                tile_m: material.tile_m,
            });
        }
        Ok(Self {
            library: library.materials().to_vec(),
            records: storage(gpu, "materials", bytemuck::cast_slice(&records))?,
            masks: storage(gpu, "masks", bytemuck::cast_slice(&masks))?,
            albedos: albedos(gpu, texels)?,
        })
    }

    /// Whether this is the library that was uploaded.
    pub(crate) fn are(&self, library: &MaterialLibrary) -> bool {
        let same_mask = |a: &Option<Arc<AlphaMask>>, b: &Option<Arc<AlphaMask>>| match (a, b) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        let same = |a: &Material, b: &Material| {
            a.semantic == b.semantic
                && same_mask(&a.mask, &b.mask)
                && Arc::ptr_eq(&a.albedo, &b.albedo)
                && a.transmittance == b.transmittance
                && (a.roughness, a.ground, a.tile_m) == (b.roughness, b.ground, b.tile_m)
                && a.liquid == b.liquid
        };
        self.library.len() == library.materials().len()
            && self
                .library
                .iter()
                .zip(library.materials())
                .all(|(a, b)| same(a, b))
    }

    pub(crate) fn bytes(&self) -> u64 {
        let albedos = 4 * u64::from(self.albedos.depth_or_array_layers()) * LAYER as u64;
        self.records.size() + self.masks.size() + albedos
    }
}

/// The flags in a material's record: bits of what it is, and a liquid's reflectance at right angles
/// over 65535 in the upper half.
fn flags(material: &Material) -> u32 {
    let reflectance = |liquid: &Liquid| (liquid.mirrored(1.0) * 65535.0).round() as u32;
    let liquid = (material.liquid.as_ref()).map_or(0, |liquid| 4 + (reflectance(liquid) << 16));
    u32::from(material.ground) + 2 * u32::from(material.lies_on_ground()) + liquid
}

/// The texels of all textures, one after another in layers.
fn albedos(gpu: &Gpu, mut texels: Vec<u32>) -> Result<wgpu::Texture, GpuError> {
    let layers = match texels.len().div_ceil(LAYER) {
        // wgpu makes a plain texture of one layer for OpenGL, and a cube of six squares or a
        // multiple of them, which cannot be bound as an array.
        0 | 1 => 2,
        six if six % 6 == 0 => six + 1,
        layers => layers,
    };
    let limit = gpu.device().limits().max_texture_array_layers as usize;
    if layers > limit {
        return Err(GpuError::TooSmall {
            name: gpu.name(),
            what: format!(
                "the textures of all materials take {layers} layers of {SIDE} x {SIDE} texels, a \
                 shader sees {limit}"
            ),
        });
    }
    texels.resize(layers * LAYER, 0);
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let size = [SIDE, SIDE, layers as u32];
    let albedos = texture(gpu, "albedo", size, 1, wgpu::TextureFormat::R32Uint, usage);
    gpu.check()?;
    gpu.queue().write_texture(
        albedos.as_image_copy(),
        bytemuck::cast_slice(&texels),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * SIDE),
            rows_per_image: Some(SIDE),
        },
        albedos.size(),
    );
    Ok(albedos)
}

/// The index in `out` of a shared mask or texture, which is written there if it is new.
fn place<T>(
    known: &mut Vec<(Arc<T>, u32)>,
    thing: &Arc<T>,
    out: &mut Vec<u32>,
    write: impl FnOnce(&mut Vec<u32>),
) -> u32 {
    if let Some((_, at)) = known.iter().find(|(k, _)| Arc::ptr_eq(k, thing)) {
        return *at;
    }
    let at = out.len() as u32;
    write(out);
    known.push((Arc::clone(thing), at));
    at
}

/// The square root of the linear light of every sRGB byte (IEC 61966-2-1), times 1023.
fn roots() -> [u32; 256] {
    std::array::from_fn(|i| {
        let s = i as f32 / 255.0;
        let linear = if s <= 0.040_45 {
            s / 12.92
        } else {
            libm::powf((s + 0.055) / 1.055, 2.4)
        };
        (linear.sqrt() * 1023.0).round() as u32
    })
}

fn pack([r, g, b, _]: [u8; 4], root: &[u32; 256]) -> u32 {
    let [r, g, b] = [r, g, b].map(|c| root[usize::from(c)]);
    r | g << 10 | b << 20
}
