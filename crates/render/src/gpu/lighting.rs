//! The colour pass: shadow maps, tables of light, and one or four samples per pixel.

use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::cascade::Cascade;
use super::cull::{Culled, ViewBindings};
use super::instance_buffer::InstanceBuffer;
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
use crate::sky::haze::Haze;
use crate::{Lighting, SceneView, View};

/// The target's format. It needs floats, because the light of two pixels may differ by a factor of
/// 10⁸.
const COLOUR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
// These must equal the constants of `lighting.wgsl`.
const CASCADES: usize = 4;
const SKY_SIDE: usize = 128;
const AMBIENT_SIDE: usize = 16;
const OPENNESS_STEPS: usize = 32;
const GRID_SIDE: usize = 64;
const GRID_UP: usize = 32;
/// Nodes along a side of the near and the wide grid of ground occlusion, and their distances,
/// metres.
const GROUND_SIDE: usize = 512;
const GROUND_STEPS_M: [f32; 2] = [1.0 / 6.0, 0.8];

/// A white surface in the sun gets this value in the target: 1/16 of the largest half float.
const WHITE: f32 = 4096.0;

/// `Light` in `lighting.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct LightRecord {
    sun: [f32; 4],
    irradiance: [f32; 4],
    air: [f32; 4],
    cascades: [[[f32; 4]; 4]; CASCADES],
    ends: [f32; 4],
    texels: [f32; 4],
    near_grid: [f32; 4],
    far_grid: [f32; 4],
    up_and_fog: [f32; 4],
    ground_grids: [f32; 4],
}

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

/// The scale of the target's colours, and the sky behind them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Backdrop {
    range_m: f32,
    /// The factor from radiance to the target's colours.
    scale: f32,
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

    fn light(
        &self,
        haze: &Haze,
        inputs: &LightingInputs<'_>,
        ground_corners: [Vec2; 2],
    ) -> (LightRecord, Vec<f32>) {
        let lighting = inputs.lighting;
        let camera = inputs.view.scene_from_camera.translation_m.as_vec3();
        let visibility = inputs.scene.sky_visibility;
        let range_m = haze.range_m;
        // Node steps across and up, and how many layers lie below the camera.
        let far = 2.0 * range_m / (GRID_SIDE - 1) as f32;
        let grids = [(1.5, 1.5, 10.0), (far, 4.0, 14.0)];
        let corner = |(step, up, below): (f32, f32, f32)| {
            let half = 0.5 * step * (GRID_SIDE - 1) as f32;
            Vec3::new(-half, -half, -up * below)
        };
        let nodes = GRID_SIDE * GRID_SIDE * GRID_UP;
        let sky_view_factor = (0..2 * nodes)
            .into_par_iter()
            .map(|i| {
                let grid = grids[i / nodes];
                let (x, y, z) = (
                    i % GRID_SIDE,
                    i / GRID_SIDE % GRID_SIDE,
                    i % nodes / (GRID_SIDE * GRID_SIDE),
                );
                let at = Vec3::new(x as f32 * grid.0, y as f32 * grid.0, z as f32 * grid.1);
                visibility.sky_view_factor(camera + corner(grid) + at)
            })
            .collect();
        let of = |f: fn(&Cascade) -> f64| std::array::from_fn(|k| f(&inputs.cascades[k]) as f32);
        let focal_px = 0.5 * (inputs.view.intrinsics.fx + inputs.view.intrinsics.fy);
        let [near, far] = grids.map(|g| corner(g).extend(g.0).to_array());
        let record = LightRecord {
            sun: lighting
                .sun_direction()
                .extend((1.0 / focal_px) as f32)
                .to_array(),
            irradiance: lighting
                .sun_irradiance()
                .extend(self.backdrop.scale)
                .to_array(),
            air: [
                haze.air.extinction,
                haze.air.height_m,
                range_m,
                visibility.sky_view_factor(camera),
            ],
            cascades: std::array::from_fn(|k| inputs.cascades[k].clip().to_cols_array_2d()),
            ends: of(|c| c.end_m),
            texels: of(Cascade::texel_m),
            near_grid: near,
            far_grid: far,
            up_and_fog: [
                grids[0].1,
                grids[1].1,
                haze.fog.extinction,
                haze.fog.height_m,
            ],
            ground_grids: {
                let [near, wide] = ground_corners.map(|corner| corner - camera.truncate());
                [near.x, near.y, wide.x, wide.y]
            },
        };
        (record, sky_view_factor)
    }
}

/// The corners of the grids of ground occlusion around the camera, in the scene. They are halves of
/// steps from whole ones, as the middles of the cells of maps are, so that the near grid has the
/// maps' own values wherever the camera is.
fn ground_corners(inputs: &LightingInputs<'_>) -> [Vec2; 2] {
    let camera = inputs.view.scene_from_camera.translation_m.as_vec3();
    GROUND_STEPS_M.map(|step_m| {
        let middle = (camera.truncate() / step_m).floor();
        (middle - (GROUND_SIDE / 2) as f32 + 0.5) * step_m
    })
}

/// The ground occlusion around the camera: rows from the south of the near grid, then of the wide
/// one.
fn ground_occlusion(inputs: &LightingInputs<'_>, corners: [Vec2; 2]) -> Vec<f32> {
    let visibility = inputs.scene.sky_visibility;
    let height_m = inputs.view.scene_from_camera.translation_m.z as f32;
    let nodes = GROUND_SIDE * GROUND_SIDE;
    (0..2 * nodes)
        .into_par_iter()
        .map(|i| {
            let (grid, node) = (i / nodes, i % nodes);
            let node = Vec2::new((node % GROUND_SIDE) as f32, (node / GROUND_SIDE) as f32);
            let at = corners[grid] + node * GROUND_STEPS_M[grid];
            visibility.ground_occlusion(at.extend(height_m))
        })
        .collect()
}

impl Backdrop {
    /// Adds the radiance from the target's rows, with the sky behind.
    pub(crate) fn compose(
        &self,
        rows: &mut dyn Iterator<Item = &[u8]>,
        view: &View,
        lighting: &Lighting,
        linear: &mut [Vec3],
    ) {
        let width = view.intrinsics.width as usize;
        let haze = self.haze(lighting, view);
        let rows: Vec<&[u8]> = rows.collect();
        linear
            .par_chunks_mut(width)
            .zip(rows)
            .enumerate()
            .for_each(|(y, (out, row))| {
                for (x, (out, texel)) in out.iter_mut().zip(row.chunks_exact(8)).enumerate() {
                    let half =
                        |i: usize| from_half(u16::from_le_bytes([texel[2 * i], texel[2 * i + 1]]));
                    let covered = half(3).clamp(0.0, 1.0);
                    *out += Vec3::new(half(0), half(1), half(2)) / self.scale;
                    if covered < 1.0 {
                        let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                        let d = view.ray(centre, 1.0).direction;
                        let sky = lighting.background(&haze, d)
                            + lighting.sun_in_pixel(&haze, view, centre, d);
                        *out += sky * (1.0 - covered);
                    }
                }
            });
    }

    /// The air around the camera.
    fn haze(&self, lighting: &Lighting, view: &View) -> Haze {
        let height = view.scene_from_camera.translation_m.z as f32;
        lighting.haze(height, self.range_m)
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

/// The light in tables over octahedral maps: background radiance, then irradiance by sky view
/// factor.
fn tables(lighting: &Lighting, haze: &Haze) -> Vec<[f32; 4]> {
    let direction = |i: usize, side: usize| -> Vec3 {
        let at = Vec2::new((i % side) as f32, (i / side) as f32) / (side - 1) as f32;
        unfold(at * 2.0 - Vec2::ONE)
    };
    let sky = (0..SKY_SIDE * SKY_SIDE).map(|i| lighting.background(haze, direction(i, SKY_SIDE)));
    let ambient = (0..=OPENNESS_STEPS).flat_map(|step| {
        let ambient = lighting.ambient(step as f32 / OPENNESS_STEPS as f32);
        (0..AMBIENT_SIDE * AMBIENT_SIDE)
            .map(move |i| ambient.irradiance(direction(i, AMBIENT_SIDE)))
    });
    sky.chain(ambient)
        .map(|c| c.extend(0.0).to_array())
        .collect()
}

/// The unit vector of a point of the octahedral square, −1..=1.
fn unfold(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let p = if z >= 0.0 {
        p
    } else {
        Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    };
    // Its length is at least 1 / sqrt 3.
    let n = p.extend(z);
    n / n.length()
}

/// The value of an IEEE 754 binary16 number.
fn from_half(bits: u16) -> f32 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023) / 1024.0);
    let size = match exponent {
        0 => fraction * 2.0_f32.powi(-14),
        31 => f32::INFINITY,
        e => (1.0 + fraction) * 2.0_f32.powi(e - 15),
    };
    sign * size
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves() {
        for (bits, value) in [
            (0x0000, 0.0),
            (0x3C00, 1.0),
            (0xC000, -2.0),
            (0x7BFF, 65504.0),
            (0x0001, 5.960_464_5e-8),
            (0x3555, 0.333_251_95),
        ] {
            assert_eq!(from_half(bits), value, "{bits:#x}");
        }
    }
}
