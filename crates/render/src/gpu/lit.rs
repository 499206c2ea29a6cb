//! The lit colour pass: shadow maps, light in tables, one or four samples a pixel.

use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::cascade::Cascade;
use super::cull::{Aim, Culled};
use super::herd::Herd;
use super::materials::Materials;
use super::pipeline::{
    Bendable, DEPTH_FORMAT, Layouts, Pipelines, Stage, buffer, entry, group, layout, rays_entry,
    storage, storage_entry, texture, uniform_entry,
};
use super::readback::Readback;
use super::shapes::Shapes;
use super::{Gpu, GpuError, GpuParams};
use crate::haze::Haze;
use crate::tone::LUMINANCE;
use crate::{Lighting, SceneView, View};

/// What is drawn to. Half floats: a pixel's light may be a 10⁸th of another's.
const COLOUR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
// As `lit.wgsl` has them.
const CASCADES: usize = 4;
const SKY_SIDE: usize = 128;
const AMBIENT_SIDE: usize = 16;
const OPENNESS_STEPS: usize = 32;
const GRID_SIDE: usize = 64;
const GRID_UP: usize = 32;

/// White in the sun becomes this in the target: 1/16 of a half float's largest.
const WHITE: f32 = 4096.0;

/// `Light` in `lit.wgsl`.
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
}

/// The colour pass of a camera.
#[derive(Debug)]
pub(crate) struct Lit {
    layout: wgpu::BindGroupLayout,
    colour: Bendable,
    shadow: Pipelines,
    /// An empty group, for shadows.
    nothing: wgpu::BindGroup,
    comparison: wgpu::Sampler,
    shadows: wgpu::Texture,
    targets: Option<LitTargets>,
    /// Of a pixel.
    samples: u32,
    pub(crate) backdrop: Backdrop,
}

/// What the target's colours mean, and what is behind them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Backdrop {
    range_m: f32,
    /// What radiance is multiplied with in the target.
    scale: f32,
}

#[derive(Debug)]
struct LitTargets {
    size: [u32; 2],
    /// If there are several.
    samples: Option<wgpu::Texture>,
    depth: wgpu::Texture,
    colour: wgpu::Texture,
}

/// What the GPU needs of one picture's light.
pub(crate) struct LitShot<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) layouts: &'a Layouts,
    pub(crate) materials: &'a Materials,
    pub(crate) shapes: &'a Shapes,
    pub(crate) lighting: &'a Lighting,
    pub(crate) view: &'a View,
    pub(crate) scene: &'a SceneView<'a>,
    pub(crate) cascades: &'a [Cascade],
    /// The frame's origin about the herd's.
    pub(crate) origin: DVec3,
    pub(crate) herd: &'a Herd,
    pub(crate) culled: &'a Culled,
    /// The camera's.
    pub(crate) aim: &'a Aim,
    pub(crate) bent: bool,
    pub(crate) rays: &'a wgpu::Texture,
    pub(crate) eyes: &'a wgpu::Buffer,
}

impl Lit {
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
        let shadow_map = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2Array,
            multisampled: false,
        };
        let compared = shadow_map(wgpu::TextureSampleType::Depth);
        let read = shadow_map(wgpu::TextureSampleType::Float { filterable: false });
        let comparison = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
        let entries = [
            uniform_entry(0),
            storage_entry(1),
            storage_entry(2),
            storage_entry(3),
            entry(4, compared),
            entry(5, comparison),
            rays_entry(6),
            storage_entry(7),
            entry(8, read),
        ];
        let own = layout(gpu, "lit", &entries);
        let empty = layout(gpu, "shadow", &[]);
        let shadow = Stage {
            label: "shadow",
            shader: include_str!("shaders/shadow.wgsl"),
            fragment: "fragment",
            layout: &empty,
            target: None,
            samples: 1,
            margin_px: 0.0,
            bent: false,
        };
        let white = lighting.ambient(1.0).irradiance(Vec3::Z)
            + lighting.sun_irradiance() * lighting.sun_direction().z.max(0.0);
        use wgpu::TextureUsages as U;
        Ok(Self {
            colour: Bendable::new(colour(gpu, layouts, &own, samples, false)?),
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

    /// Makes what bent pictures are drawn with.
    pub(crate) fn bend(&mut self, gpu: &Gpu, layouts: &Layouts) -> Result<(), GpuError> {
        self.colour
            .bend(|| colour(gpu, layouts, &self.layout, self.samples, true))
    }

    /// Bytes of maps and targets.
    pub(crate) fn bytes(&self) -> u64 {
        let side = u64::from(self.shadows.width());
        let pixels = |t: &LitTargets| u64::from(t.size[0]) * u64::from(t.size[1]);
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
            self.targets = Some(LitTargets {
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

    /// Draws the shadows, and brings the light to the GPU: the colour pass's group. Also says how
    /// much memory that takes for a while.
    pub(crate) fn light_up(&self, shot: &LitShot<'_>) -> Result<(wgpu::BindGroup, u64), GpuError> {
        let gpu = shot.gpu;
        let mut bytes = 0;
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        for (layer, cascade) in (0..).zip(shot.cascades) {
            let frame = cascade.frame(shot.origin);
            let frame = bytemuck::bytes_of(&frame);
            let view = u64::from(layer) + 1;
            let aim = Aim::new(gpu, shot.layouts, shot.materials, shot.herd, view, frame)?;
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
            let pages = &shot.shapes.pages;
            (shot.culled).draw(gpu, &mut pass, pages, &self.shadow, &aim, &self.nothing);
        }
        gpu.queue().submit([encoder.finish()]);

        let haze = self.backdrop.haze(shot.lighting, shot.view);
        let (light, openness) = self.light(&haze, shot);
        let light = bytemuck::bytes_of(&light);
        let light = buffer(gpu, "light", light, wgpu::BufferUsages::UNIFORM)?;
        let openness = storage(gpu, "openness", bytemuck::cast_slice(&openness))?;
        let tables = tables(shot.lighting, &haze);
        let tables = storage(gpu, "light", bytemuck::cast_slice(&tables))?;
        bytes += light.size() + openness.size() + tables.size();
        let shadows = self.shadows.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let resources = [
            light.as_entire_binding(),
            shot.materials.texels.as_entire_binding(),
            tables.as_entire_binding(),
            openness.as_entire_binding(),
            wgpu::BindingResource::TextureView(&shadows),
            wgpu::BindingResource::Sampler(&self.comparison),
            wgpu::BindingResource::TextureView(&super::targets::view_of(shot.rays)),
            shot.eyes.as_entire_binding(),
            wgpu::BindingResource::TextureView(&shadows),
        ];
        Ok((group(gpu, "lit", &self.layout, &resources), bytes))
    }

    /// Draws the colours as the camera is aimed, and sends the picture on its way back.
    pub(crate) fn draw(
        &self,
        shot: &LitShot<'_>,
        light: &wgpu::BindGroup,
    ) -> Result<(Readback, wgpu::SubmissionIndex), GpuError> {
        let gpu = shot.gpu;
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
            label: Some("lit"),
            color_attachments: &[Some(attachment)],
            depth_stencil_attachment: Some(super::targets::reversed(&depth)),
            ..Default::default()
        });
        let pipelines = self.colour.of(shot.bent);
        let pages = &shot.shapes.pages;
        (shot.culled).draw(gpu, &mut pass, pages, pipelines, shot.aim, light);
        drop(pass);
        let readback = Readback::encode(gpu, &mut encoder, &targets.colour, 8);
        let submission = gpu.queue().submit([encoder.finish()]);
        gpu.check()?;
        Ok((readback, submission))
    }

    fn light(&self, haze: &Haze, shot: &LitShot<'_>) -> (LightRecord, Vec<f32>) {
        let lighting = shot.lighting;
        let camera = shot.view.scene_from_camera.translation_m.as_vec3();
        let visibility = shot.scene.sky_visibility;
        let range_m = haze.range_m;
        // Node steps across and up, and how many layers lie below the camera.
        let far = 2.0 * range_m / (GRID_SIDE - 1) as f32;
        let grids = [(1.5, 1.5, 10.0), (far, 4.0, 14.0)];
        let corner = |(step, up, below): (f32, f32, f32)| {
            let half = 0.5 * step * (GRID_SIDE - 1) as f32;
            Vec3::new(-half, -half, -up * below)
        };
        let nodes = GRID_SIDE * GRID_SIDE * GRID_UP;
        let openness = (0..2 * nodes)
            .into_par_iter()
            .map(|i| {
                let grid = grids[i / nodes];
                let (x, y, z) = (
                    i % GRID_SIDE,
                    i / GRID_SIDE % GRID_SIDE,
                    i % nodes / (GRID_SIDE * GRID_SIDE),
                );
                let at = Vec3::new(x as f32 * grid.0, y as f32 * grid.0, z as f32 * grid.1);
                visibility.openness(camera + corner(grid) + at)
            })
            .collect();
        let of = |f: fn(&Cascade) -> f64| std::array::from_fn(|k| f(&shot.cascades[k]) as f32);
        let focal_px = 0.5 * (shot.view.intrinsics.fx + shot.view.intrinsics.fy);
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
                visibility.openness(camera),
            ],
            cascades: std::array::from_fn(|k| shot.cascades[k].clip().to_cols_array_2d()),
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
        };
        (record, openness)
    }
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
        let sun = lighting.sun_direction();
        let pixel_rad = 1.0 / view.intrinsics.fx.min(view.intrinsics.fy);
        let about_the_sun = libm::cos(0.01 + 2.0 * pixel_rad) as f32;
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
                        let mut sky = lighting.background(&haze, d);
                        if d.dot(sun) > about_the_sun {
                            sky += sun_seen(view, centre, |d| lighting.sun_disc(&haze, d));
                        }
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
    bent: bool,
) -> Result<Pipelines, GpuError> {
    let stage = Stage {
        label: "lit",
        shader: include_str!("shaders/lit.wgsl"),
        fragment: match (samples, bent) {
            (1, false) => "fragment_single",
            (1, true) => "fragment_single_bent",
            (_, false) => "fragment_masked",
            (_, true) => "fragment_masked_bent",
        },
        layout: own,
        target: Some(COLOUR_FORMAT),
        samples,
        margin_px: 0.0,
        bent,
    };
    Pipelines::new(gpu, layouts, &stage)
}

/// The sun in a pixel: its disc may be smaller, and its light is that of a thousand skies.
fn sun_seen(view: &View, centre: DVec2, disc: impl Fn(Vec3) -> Vec3) -> Vec3 {
    const SIDE: u32 = 8;
    let part = |i: u32| (f64::from(i) + 0.5) / f64::from(SIDE) - 0.5;
    let places = (0..SIDE * SIDE).map(|i| centre + DVec2::new(part(i % SIDE), part(i / SIDE)));
    let sum: Vec3 = places.map(|p| disc(view.ray(p, 1.0).direction)).sum();
    sum / (SIDE * SIDE) as f32
}

/// The light in tables over octahedral maps: background radiance, then irradiance by openness.
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
    // Of length at least 1 / sqrt 3.
    let n = p.extend(z);
    n / n.length()
}

/// IEEE 754 binary16.
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
