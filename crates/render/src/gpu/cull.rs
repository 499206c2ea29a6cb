//! The GPU decides what each view draws: which instances, and so how many of each shape.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use nemoral_scene::Prototype;

use super::herd::{Alike, Herd};
use super::materials::Materials;
use super::pages::{Kind, Pages};
use super::pipeline::{Layouts, Pipelines, buffer, group, storage};
use super::shapes::Shapes;
use super::sight::Sight;
use super::{Gpu, GpuError};

/// `Alike` in `cull.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct ShapeRecord {
    first: u32,
    count: u32,
    first_draw: u32,
    draws: u32,
}

/// The arguments of an indirect draw.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Draw {
    vertices: u32,
    instances: u32,
    first_vertex: u32,
    first_instance: u32,
}

/// The draws of a page.
#[derive(Debug)]
struct OfPage {
    page: usize,
    first_draw: usize,
    /// Of each draw, the first of its shape's instances.
    first_instances: Vec<u32>,
}

/// The draws of a view before anything is culled, page by page, and which of them are a shape's.
struct Arrangement {
    draws: Vec<Draw>,
    of_pages: Vec<OfPage>,
    shapes: Vec<ShapeRecord>,
    /// Numbers of draws, shape by shape.
    of_shapes: Vec<u32>,
}

impl Arrangement {
    fn of(gpu: &Gpu, shapes: &Shapes, seen: &[(Arc<Prototype>, Alike)]) -> Self {
        let mut by_page: BTreeMap<usize, Vec<(Draw, usize)>> = BTreeMap::new();
        for (shape, (prototype, alike)) in seen.iter().enumerate() {
            let first = if gpu.starts_anywhere() {
                alike.first
            } else {
                0
            };
            for kind in Kind::ALL {
                for range in shapes.ranges(prototype, kind) {
                    let draw = Draw {
                        vertices: range.count * kind.vertices(),
                        instances: 0,
                        first_vertex: range.first * kind.vertices(),
                        first_instance: first,
                    };
                    by_page.entry(range.page).or_default().push((draw, shape));
                }
            }
        }
        let (mut draws, mut of_pages) = (Vec::new(), Vec::new());
        let mut of_shapes = vec![Vec::new(); seen.len()];
        for (page, of_page) in by_page {
            let first = |(_, shape): &(Draw, usize)| seen[*shape].1.first;
            of_pages.push(OfPage {
                page,
                first_draw: draws.len(),
                first_instances: of_page.iter().map(first).collect(),
            });
            for (draw, shape) in of_page {
                of_shapes[shape].push(draws.len() as u32);
                draws.push(draw);
            }
        }
        let mut first_draw = 0;
        let record = |((_, alike), draws): (&(_, Alike), &Vec<u32>)| {
            let draws = draws.len() as u32;
            first_draw += draws;
            ShapeRecord {
                first: alike.first,
                count: alike.count,
                first_draw: first_draw - draws,
                draws,
            }
        };
        Self {
            draws,
            of_pages,
            shapes: seen.iter().zip(&of_shapes).map(record).collect(),
            of_shapes: of_shapes.concat(),
        }
    }
}

/// Asks which instances are seen.
#[derive(Debug)]
pub(crate) struct Culler {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// What a picture's views draw: what the camera sees first, then what each shadow map does.
#[derive(Debug)]
pub(crate) struct Culled {
    of_pages: Vec<OfPage>,
    /// Of a view.
    instances: u64,
    draws: u64,
    visible: wgpu::Buffer,
    arguments: wgpu::Buffer,
    pub(crate) bytes: u64,
}

/// Bytes of a number and of the arguments of a draw.
const NUMBER: u64 = size_of::<u32>() as u64;
const DRAW: u64 = size_of::<Draw>() as u64;

impl Culler {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let buffer = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        use wgpu::BufferBindingType::{Storage, Uniform};
        let read = Storage { read_only: true };
        let write = Storage { read_only: false };
        let types = [Uniform, read, read, read, read, write, write];
        let entries: Vec<_> = (0..).zip(types).map(|(n, ty)| buffer(n, ty)).collect();
        let layout = super::pipeline::layout(gpu, "cull", &entries);
        let device = gpu.device();
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("cull"),
            source: wgpu::ShaderSource::Wgsl(include_str!("shaders/cull.wgsl").into()),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("cull"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("cull"),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("cull"),
            compilation_options: Default::default(),
            cache: None,
        });
        Self { layout, pipeline }
    }

    /// Asks for each sight, told from `origin_m`, which instances of these shapes it may see; the
    /// shapes are resident, and nothing of others is seen.
    pub(crate) fn ask(
        &self,
        gpu: &Gpu,
        herd: &Herd,
        shapes: &Shapes,
        seen: &[(Arc<Prototype>, Alike)],
        sights: &[Sight],
        origin_m: DVec3,
    ) -> Result<Culled, GpuError> {
        let plan = Arrangement::of(gpu, shapes, seen);
        let away = herd.origin_m - origin_m;
        let sights: Vec<_> = sights.iter().map(|sight| sight.record(away)).collect();
        let counts = [seen.len(), herd.objects.len(), plan.draws.len(), 0];
        let counts = counts.map(|n| n as u32);

        use wgpu::BufferUsages as U;
        let views = sights.len();
        let counts = buffer(gpu, "counts", bytemuck::cast_slice(&counts), U::UNIFORM)?;
        let sights = storage(gpu, "sights", bytemuck::cast_slice(&sights))?;
        let records = storage(gpu, "shapes", bytemuck::cast_slice(&plan.shapes))?;
        let of_shapes = bytemuck::cast_slice(&plan.of_shapes);
        let of_shapes = storage(gpu, "draws of shapes", of_shapes)?;
        let instances = herd.objects.len() as u64;
        let visible = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("visible"),
            size: (instances * NUMBER * views as u64).max(64),
            usage: U::STORAGE | U::VERTEX | U::COPY_SRC,
            mapped_at_creation: false,
        });
        let arguments = plan.draws.repeat(views);
        let usage = U::INDIRECT | U::STORAGE | U::COPY_SRC;
        let arguments = buffer(gpu, "draws", bytemuck::cast_slice(&arguments), usage)?;
        let resources = [
            &counts,
            &sights,
            &herd.balls,
            &records,
            &of_shapes,
            &visible,
            &arguments,
        ]
        .map(wgpu::Buffer::as_entire_binding);
        let own = group(gpu, "cull", &self.layout, &resources);
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        if !seen.is_empty() {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &own, &[]);
            let most = gpu.device().limits().max_compute_workgroups_per_dimension;
            pass.dispatch_workgroups(most.min(seen.len() as u32), views as u32, 1);
        }
        gpu.queue().submit([encoder.finish()]);
        let bytes = [&counts, &sights, &records, &of_shapes, &visible, &arguments];
        Ok(Culled {
            of_pages: plan.of_pages,
            instances,
            draws: plan.draws.len() as u64,
            bytes: bytes.iter().map(|b| b.size()).sum(),
            visible,
            arguments,
        })
    }
}

impl Culled {
    /// Draws what a view sees with a pass's pipelines.
    pub(crate) fn draw(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::RenderPass<'_>,
        pages: &Pages,
        pipelines: &Pipelines,
        aim: &Aim,
        own: &wgpu::BindGroup,
    ) {
        let numbers = aim.view * self.instances * NUMBER;
        pass.set_bind_group(0, &aim.scene, &[]);
        pass.set_bind_group(2, own, &[]);
        for of_page in &self.of_pages {
            let page = pages.pages[of_page.page].as_ref();
            let page = page.expect("a page that is drawn");
            pass.set_pipeline(pipelines.of(page.kind));
            pass.set_bind_group(1, &page.group, &[]);
            let at = (aim.view * self.draws + of_page.first_draw as u64) * DRAW;
            if gpu.starts_anywhere() {
                let draws = of_page.first_instances.len() as u32;
                pass.set_vertex_buffer(0, self.visible.slice(numbers..));
                pass.multi_draw_indirect(&self.arguments, at, draws);
            } else {
                for (k, first) in (0..).zip(&of_page.first_instances) {
                    let first = numbers + u64::from(*first) * NUMBER;
                    pass.set_vertex_buffer(0, self.visible.slice(first..));
                    pass.draw_indirect(&self.arguments, at + k * DRAW);
                }
            }
        }
    }
}

/// Where a view looks from, on the GPU.
#[derive(Debug)]
pub(crate) struct Aim {
    /// Among those that were culled for.
    view: u64,
    frame: wgpu::Buffer,
    scene: wgpu::BindGroup,
}

impl Aim {
    pub(crate) fn new(
        gpu: &Gpu,
        layouts: &Layouts,
        materials: &Materials,
        herd: &Herd,
        view: u64,
        frame: &[u8],
    ) -> Result<Self, GpuError> {
        let frame = buffer(gpu, "frame", frame, wgpu::BufferUsages::UNIFORM)?;
        let resources = [
            &frame,
            &herd.instances,
            &materials.records,
            &materials.masks,
        ]
        .map(wgpu::Buffer::as_entire_binding);
        Ok(Self {
            view,
            scene: group(gpu, "scene", &layouts.scene, &resources),
            frame,
        })
    }

    /// From now on as another frame sees it.
    pub(crate) fn at(&self, gpu: &Gpu, frame: &[u8]) {
        gpu.queue().write_buffer(&self.frame, 0, frame);
    }
}

#[cfg(test)]
mod tests;
