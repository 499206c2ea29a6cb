//! The colour pass: shadow maps, tables of light, and one or four samples per pixel.

use glam::{DVec3, Vec3};

use super::backdrop::Backdrop;
use super::cascade::Cascade;
use super::cull::{Culled, ViewBindings};
use super::instance_buffer::InstanceBuffer;
use super::light_tables::{CASCADES, ground_corners, ground_occlusion, tables};
use super::materials::Materials;
use super::params::GpuParams;
use super::pipeline::{
    DEPTH_FORMAT, DistortionVariants, Layouts, Pipelines, Stage, buffer, entry, group, layout,
    rays_entry, storage, storage_entry, texture, uniform_entry,
};
use super::readback::Readback;
use super::shapes::Shapes;
use super::{Gpu, GpuError};
use crate::colour::LUMINANCE;
use crate::{Lighting, SceneView, View};

/// The target's format. It needs floats, because the light of two pixels may differ by a factor of
/// 10⁸.
const COLOUR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// A white surface in the sun gets this value in the target: 1/16 of the largest half float.
const WHITE: f32 = 4096.0;

/// The colour pass of a camera.
#[derive(Debug)]
pub(crate) struct LightingPass {
    layout: wgpu::BindGroupLayout,
    colour: DistortionVariants,
    shadow: Pipelines,
    /// The empty bind group of shadow passes.
    nothing: wgpu::BindGroup,
    comparison: wgpu::Sampler,
    shadows: wgpu::Texture,
    targets: Option<LightingTargets>,
    /// Samples of a pixel.
    samples: u32,
    pub(crate) backdrop: Backdrop,
}

#[derive(Debug)]
struct LightingTargets {
    size: [u32; 2],
    /// The multisampled colours, if a pixel has several samples.
    samples: Option<wgpu::Texture>,
    depth: wgpu::Texture,
    colour: wgpu::Texture,
}

/// The inputs of the lighting pass for one picture.
pub(crate) struct LightingInputs<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) layouts: &'a Layouts,
    pub(crate) materials: &'a Materials,
    pub(crate) shapes: &'a Shapes,
    pub(crate) lighting: &'a Lighting,
    pub(crate) view: &'a View,
    pub(crate) scene: &'a SceneView<'a>,
    pub(crate) cascades: &'a [Cascade],
    /// The frame's origin relative to the instance buffer's origin.
    pub(crate) origin: DVec3,
    pub(crate) instances: &'a InstanceBuffer,
    pub(crate) culled: &'a Culled,
    /// The camera's frame.
    pub(crate) bindings: &'a ViewBindings,
    pub(crate) distorted: bool,
    pub(crate) rays: &'a wgpu::Texture,
    pub(crate) eyes: &'a wgpu::Buffer,
}

impl LightingPass {
    pub(crate) fn new(
        gpu: &Gpu,
        layouts: &Layouts,
        lighting: &Lighting,
        params: &GpuParams,
    ) -> Result<Self, GpuError> {
        let samples = if gpu.chooses_samples() {
            params.colour_samples
        } else {
            1
        };
        let shadow_px = params.shadow_px;
        let layers = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2Array,
            multisampled: false,
        };
        let albedos = layers(wgpu::TextureSampleType::Uint);
        let compared = layers(wgpu::TextureSampleType::Depth);
        let read = layers(wgpu::TextureSampleType::Float { filterable: false });
        let comparison = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
        let entries = [
            uniform_entry(0),
            entry(1, albedos),
            storage_entry(2),
            storage_entry(3),
            entry(4, compared),
            entry(5, comparison),
            rays_entry(6),
            storage_entry(7),
            entry(8, read),
        ];
        let own = layout(gpu, "lighting", &entries);
        let empty = layout(gpu, "shadow", &[]);
        let shadow = Stage {
            label: "shadow",
            shader: include_str!("shaders/shadow.wgsl"),
            fragment: "fragment",
            layout: &empty,
            target: None,
            samples: 1,
            margin_px: 0.0,
            distorted: false,
        };
        let white = lighting.ambient(1.0).irradiance(Vec3::Z)
            + lighting.sun_irradiance() * lighting.sun_direction().z.max(0.0);
        use wgpu::TextureUsages as U;
        Ok(Self {
            colour: DistortionVariants::new(colour(gpu, layouts, &own, samples, false)?),
            shadow: Pipelines::new(gpu, layouts, &shadow)?,
            nothing: group(gpu, "shadow", &empty, &[]),
            layout: own,
            comparison: gpu.device().create_sampler(&wgpu::SamplerDescriptor {
                label: Some("shadow"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                compare: Some(wgpu::CompareFunction::GreaterEqual),
                ..Default::default()
            }),
            shadows: texture(
                gpu,
                "shadows",
                [shadow_px, shadow_px, CASCADES as u32],
                1,
                DEPTH_FORMAT,
                U::RENDER_ATTACHMENT | U::TEXTURE_BINDING,
            ),
            targets: None,
            samples,
            backdrop: Backdrop {
                range_m: params.max_range_m,
                scale: WHITE / white.dot(LUMINANCE).max(1e-6),
            },
        })
    }

    /// Makes the pipelines that distorted pictures are drawn with.
    pub(crate) fn prepare_distorted(
        &mut self,
        gpu: &Gpu,
        layouts: &Layouts,
    ) -> Result<(), GpuError> {
        self.colour
            .prepare_distorted(|| colour(gpu, layouts, &self.layout, self.samples, true))
    }

    /// Bytes of shadow maps and targets.
    pub(crate) fn bytes(&self) -> u64 {
        let side = u64::from(self.shadows.width());
        let pixels = |t: &LightingTargets| u64::from(t.size[0]) * u64::from(t.size[1]);
        let targets = self.targets.as_ref().map_or(0, pixels);
        let several = if self.samples > 1 { 8 } else { 0 };
        side * side * 4 * CASCADES as u64 + targets * (u64::from(self.samples) * (several + 4) + 8)
    }

    pub(crate) fn hold_targets(&mut self, gpu: &Gpu, view: &View) -> Result<(), GpuError> {
        use wgpu::TextureUsages as U;
        let size = [view.intrinsics.width, view.intrinsics.height];
        if self.targets.as_ref().is_none_or(|t| t.size != size) {
            self.targets = None;
            let target = |label, samples, format, usage| {
                let usage = usage | U::RENDER_ATTACHMENT;
                texture(gpu, label, [size[0], size[1], 1], samples, format, usage)
            };
            let several = self.samples > 1;
            self.targets = Some(LightingTargets {
                size,
                samples: several
                    .then(|| target("samples", self.samples, COLOUR_FORMAT, U::empty())),
                depth: target("depth of samples", self.samples, DEPTH_FORMAT, U::empty()),
                colour: target("colour", 1, COLOUR_FORMAT, U::COPY_SRC),
            });
            gpu.check()?;
        }
        Ok(())
    }

    /// Draws the shadow maps and uploads the light. Returns the colour pass's bind group and the
    /// bytes of device memory that it keeps for the picture.
    pub(crate) fn upload(
        &self,
        inputs: &LightingInputs<'_>,
    ) -> Result<(wgpu::BindGroup, u64), GpuError> {
        let gpu = inputs.gpu;
        let mut bytes = 0;
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        for (layer, cascade) in (0..).zip(inputs.cascades) {
            let frame = cascade.frame(inputs.origin);
            let frame = bytemuck::bytes_of(&frame);
            let view = u64::from(layer) + 1;
            let bindings = ViewBindings::new(
                gpu,
                inputs.layouts,
                inputs.materials,
                inputs.instances,
                view,
                frame,
            )?;
            let view = self.shadows.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: layer,
                array_layer_count: Some(1),
                ..Default::default()
            });
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow"),
                depth_stencil_attachment: Some(super::targets::reversed(&view)),
                ..Default::default()
            });
            let pool = &inputs.shapes.pool;
            (inputs.culled).draw(gpu, &mut pass, pool, &self.shadow, &bindings, &self.nothing);
        }
        gpu.queue().submit([encoder.finish()]);

        let haze = self.backdrop.haze(inputs.lighting, inputs.view);
        let ground_corners = ground_corners(inputs);
        let (light, mut shares) = self.light(&haze, inputs, ground_corners);
        shares.extend(ground_occlusion(inputs, ground_corners));
        let light = bytemuck::bytes_of(&light);
        let light = buffer(gpu, "light", light, wgpu::BufferUsages::UNIFORM)?;
        let shares = storage(gpu, "shares of light", bytemuck::cast_slice(&shares))?;
        let tables = tables(inputs.lighting, &haze);
        let tables = storage(gpu, "light", bytemuck::cast_slice(&tables))?;
        bytes += light.size() + shares.size() + tables.size();
        let [albedos, shadows] = [&inputs.materials.albedos, &self.shadows].map(|texture| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            })
        });
        let resources = [
            light.as_entire_binding(),
            wgpu::BindingResource::TextureView(&albedos),
            tables.as_entire_binding(),
            shares.as_entire_binding(),
            wgpu::BindingResource::TextureView(&shadows),
            wgpu::BindingResource::Sampler(&self.comparison),
            wgpu::BindingResource::TextureView(&super::targets::view_of(inputs.rays)),
            inputs.eyes.as_entire_binding(),
            wgpu::BindingResource::TextureView(&shadows),
        ];
        Ok((group(gpu, "lighting", &self.layout, &resources), bytes))
    }

    /// Draws the colours of the camera's frame, and starts to read the picture back.
    pub(crate) fn draw(
        &self,
        inputs: &LightingInputs<'_>,
        light: &wgpu::BindGroup,
    ) -> Result<(Readback, wgpu::SubmissionIndex), GpuError> {
        let gpu = inputs.gpu;
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let targets = self.targets.as_ref().expect("they were made");
        let [depth, colour] = [&targets.depth, &targets.colour].map(super::targets::view_of);
        let samples = targets.samples.as_ref().map(super::targets::view_of);
        let attachment = wgpu::RenderPassColorAttachment {
            view: samples.as_ref().unwrap_or(&colour),
            depth_slice: None,
            resolve_target: samples.as_ref().map(|_| &colour),
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                store: match samples {
                    Some(_) => wgpu::StoreOp::Discard,
                    None => wgpu::StoreOp::Store,
                },
            },
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("lighting"),
            color_attachments: &[Some(attachment)],
            depth_stencil_attachment: Some(super::targets::reversed(&depth)),
            ..Default::default()
        });
        let pipelines = self.colour.of(inputs.distorted);
        let pool = &inputs.shapes.pool;
        (inputs.culled).draw(gpu, &mut pass, pool, pipelines, inputs.bindings, light);
        drop(pass);
        let readback = Readback::encode(gpu, &mut encoder, &targets.colour, 8);
        let submission = gpu.queue().submit([encoder.finish()]);
        gpu.check()?;
        Ok((readback, submission))
    }
}

/// The colour pass's pipelines.
fn colour(
    gpu: &Gpu,
    layouts: &Layouts,
    own: &wgpu::BindGroupLayout,
    samples: u32,
    distorted: bool,
) -> Result<Pipelines, GpuError> {
    let stage = Stage {
        label: "lighting",
        shader: include_str!("shaders/lighting.wgsl"),
        fragment: match (samples, distorted) {
            (1, false) => "fragment_single",
            (1, true) => "fragment_single_distorted",
            (_, false) => "fragment_masked",
            (_, true) => "fragment_masked_distorted",
        },
        layout: own,
        target: Some(COLOUR_FORMAT),
        samples,
        margin_px: 0.0,
        distorted,
    };
    Pipelines::new(gpu, layouts, &stage)
}
