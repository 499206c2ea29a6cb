//! The targets of a camera's pictures, their rays, and the images that are read back.

use glam::{DMat3, DVec2, DVec3, Vec3};
use nemoral_scene::{Image, ObjectId, Semantic, TruthImages};
use rayon::prelude::*;

use super::octahedral::from_octahedral;
use super::pipeline::{DEPTH_FORMAT, EXACT_FORMAT, storage, texture};
use super::{Gpu, GpuError};
use crate::View;

/// The targets for one picture size.
pub(crate) struct Targets {
    pub(crate) size: [u32; 2],
    pub(crate) exact: wgpu::Texture,
    pub(crate) depth: wgpu::Texture,
    /// Directions of the pixels' centres, and their z in the optical frame.
    pub(crate) rays: wgpu::Texture,
    /// The position of the camera for each row, relative to the frame's origin.
    pub(crate) eyes: wgpu::Buffer,
}

impl Targets {
    pub(crate) fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, GpuError> {
        use wgpu::TextureUsages as U;
        let [width, height] = size;
        let target = |label, format, usage| {
            let usage = usage | U::RENDER_ATTACHMENT;
            texture(gpu, label, [width, height, 1], 1, format, usage)
        };
        Ok(Self {
            size,
            exact: target("exact", EXACT_FORMAT, U::COPY_SRC),
            depth: target("depth", DEPTH_FORMAT, U::empty()),
            rays: texture(
                gpu,
                "rays",
                [width, height, 1],
                1,
                wgpu::TextureFormat::Rgba32Float,
                U::TEXTURE_BINDING | U::COPY_DST,
            ),
            eyes: storage(gpu, "eyes", &vec![0; 16 * height as usize])?,
        })
    }

    /// Uploads the rays of a view, which are equal to those of the ray-cast camera to the bit.
    pub(crate) fn cast_rays(&self, gpu: &Gpu, view: &View, origin_m: DVec3) {
        let eye = |y: u32| {
            let eye = view.scene_from_row(f64::from(y) + 0.5).translation_m - origin_m;
            eye.as_vec3().extend(0.0).to_array()
        };
        let eyes: Vec<[f32; 4]> = (0..self.size[1]).map(eye).collect();
        gpu.queue()
            .write_buffer(&self.eyes, 0, bytemuck::cast_slice(&eyes));
        let width = self.size[0] as usize;
        let mut rays = vec![[0.0_f32; 4]; width * self.size[1] as usize];
        rays.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, ray) in row.iter_mut().enumerate() {
                let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let z = view.intrinsics.direction(centre).z as f32;
                *ray = view.ray(centre, f32::MAX).direction.extend(z).to_array();
            }
        });
        gpu.queue().write_texture(
            self.rays.as_image_copy(),
            bytemuck::cast_slice(&rays),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(self.size[0] * 16),
                rows_per_image: None,
            },
            self.rays.size(),
        );
    }

    pub(crate) fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.pixels() as u64 * (16 + 4 + 16) + self.eyes.size()
    }
}

pub(crate) fn view_of(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// A depth buffer, cleared to infinity.
pub(crate) fn reversed(view: &wgpu::TextureView) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load: wgpu::LoadOp::Clear(0.0),
            store: wgpu::StoreOp::Store,
        }),
        stencil_ops: None,
    }
}

/// An image from its rows.
pub(crate) fn texels(rows: &mut dyn Iterator<Item = &[u8]>, view: &View) -> Image<[u32; 4]> {
    let (width, height) = (
        view.intrinsics.width as usize,
        view.intrinsics.height as usize,
    );
    let mut pixels = Vec::with_capacity(width * height);
    for row in rows {
        pixels.extend(
            row.chunks_exact(16)
                .map(bytemuck::pod_read_unaligned::<[u32; 4]>),
        );
    }
    Image::new(width, height, pixels)
}

/// The truth images from what the truth pass wrote.
pub(crate) fn truth_images(
    texels: &Image<[u32; 4]>,
    view: &View,
    objects: &[ObjectId],
) -> TruthImages {
    let (width, height) = (texels.width(), texels.height());
    let semantic = |t: &[u32; 4]| {
        let number = u8::try_from(t[1]).ok();
        number.and_then(Semantic::from_u8).unwrap_or(Semantic::Sky)
    };
    let object = |t: &[u32; 4]| match t[0] {
        0 => ObjectId::NONE,
        number => objects[number as usize - 1],
    };
    // Normals are transformed to the optical frame of each row.
    let mut normals = vec![Vec3::ZERO; width * height];
    let rows = normals.par_chunks_mut(width).enumerate();
    rows.for_each(|(y, row)| {
        let pose = view.scene_from_row(y as f64 + 0.5);
        let optical_from_scene = DMat3::from_quat(pose.rotation.inverse());
        for (normal, t) in row.iter_mut().zip(&texels.pixels()[y * width..]) {
            if t[0] != 0 {
                let scene = from_octahedral(t[3]).as_dvec3();
                *normal = (optical_from_scene * scene).as_vec3();
            }
        }
    });
    let texels = texels.pixels();
    TruthImages {
        semantic: Image::new(width, height, texels.par_iter().map(semantic).collect()),
        object: Image::new(width, height, texels.par_iter().map(object).collect()),
        depth_m: Image::new(
            width,
            height,
            texels.iter().map(|t| f32::from_bits(t[2])).collect(),
        ),
        normal: Image::new(width, height, normals),
    }
}
