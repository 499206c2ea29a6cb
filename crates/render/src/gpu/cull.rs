//! GPU culling: a compute pass decides which instances each view draws, and writes the draws.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use nemoral_scene::Prototype;

use super::buffer_pool::BufferPool;
use super::frustum::Frustum;
use super::instance_buffer::{InstanceBuffer, InstanceRange};
use super::materials::Materials;
use super::pipeline::{Layouts, Pipelines, buffer, group, storage};
use super::primitive::PrimitiveKind;
use super::shapes::Shapes;
use super::{Gpu, GpuError};

/// `Shape` in `cull.wgsl`.
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

/// The draws of a page of the pool.
#[derive(Debug)]
struct PageDraws {
    page: usize,
    first_draw: usize,
    /// For each draw, the first of its prototype's instances.
    first_instances: Vec<u32>,
}

/// The draws of a view before anything is culled, page by page, and which of them draw each
/// prototype.
struct DrawList {
    draws: Vec<Draw>,
    of_pages: Vec<PageDraws>,
    shapes: Vec<ShapeRecord>,
    /// The numbers of the draws, prototype by prototype.
    of_shapes: Vec<u32>,
}

impl DrawList {
    fn of(gpu: &Gpu, shapes: &Shapes, seen: &[(Arc<Prototype>, InstanceRange)]) -> Self {
        let mut by_page: BTreeMap<usize, Vec<(Draw, usize)>> = BTreeMap::new();
        for (shape, (prototype, range)) in seen.iter().enumerate() {
            let first = if gpu.starts_anywhere() {
                range.first
            } else {
                0
            };
            for kind in PrimitiveKind::ALL {
                for part in shapes.ranges(prototype, kind) {
                    let draw = Draw {
                        vertices: part.count * kind.vertices(),
                        instances: 0,
                        first_vertex: part.first * kind.vertices(),
                        first_instance: first,
                    };
                    by_page.entry(part.page).or_default().push((draw, shape));
                }
            }
        }
        let (mut draws, mut of_pages) = (Vec::new(), Vec::new());
        let mut of_shapes = vec![Vec::new(); seen.len()];
        for (page, of_page) in by_page {
            let first = |(_, shape): &(Draw, usize)| seen[*shape].1.first;
            of_pages.push(PageDraws {
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
        let record = |((_, range), draws): (&(_, InstanceRange), &Vec<u32>)| {
            let draws = draws.len() as u32;
            first_draw += draws;
            ShapeRecord {
                first: range.first,
                count: range.count,
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

/// The compute pass that culls.
#[derive(Debug)]
pub(crate) struct Culler {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// The culled draws of the views of a picture: the camera first, then each shadow map.
#[derive(Debug)]
pub(crate) struct Culled {
    of_pages: Vec<PageDraws>,
    /// The numbers of instances and draws of one view.
    instances: u64,
    draws: u64,
    visible: wgpu::Buffer,
    arguments: wgpu::Buffer,
    pub(crate) bytes: u64,
}

/// Bytes of an instance's number, and of the arguments of a draw.
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

    /// Finds for each frustum, relative to `origin_m`, the instances of these prototypes that it
    /// may see. The prototypes are resident; no others are drawn.
    pub(crate) fn cull(
        &self,
        gpu: &Gpu,
        instances: &InstanceBuffer,
        shapes: &Shapes,
        seen: &[(Arc<Prototype>, InstanceRange)],
        frustums: &[Frustum],
        origin_m: DVec3,
    ) -> Result<Culled, GpuError> {
        let plan = DrawList::of(gpu, shapes, seen);
        let away = instances.origin_m - origin_m;
        let frustums: Vec<_> = frustums
            .iter()
            .map(|frustum| frustum.record(away))
            .collect();
        let counts = [seen.len(), instances.objects.len(), plan.draws.len(), 0];
        let counts = counts.map(|n| n as u32);

        use wgpu::BufferUsages as U;
        let views = frustums.len();
        let counts = buffer(gpu, "counts", bytemuck::cast_slice(&counts), U::UNIFORM)?;
        let frustums = storage(gpu, "frustums", bytemuck::cast_slice(&frustums))?;
        let records = storage(gpu, "shapes", bytemuck::cast_slice(&plan.shapes))?;
        let of_shapes = bytemuck::cast_slice(&plan.of_shapes);
        let of_shapes = storage(gpu, "draws of shapes", of_shapes)?;
        let instance_count = instances.objects.len() as u64;
        let visible = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("visible"),
            size: (instance_count * NUMBER * views as u64).max(64),
            usage: U::STORAGE | U::VERTEX | U::COPY_SRC,
            mapped_at_creation: false,
        });
        let arguments = plan.draws.repeat(views);
        let usage = U::INDIRECT | U::STORAGE | U::COPY_SRC;
        let arguments = buffer(gpu, "draws", bytemuck::cast_slice(&arguments), usage)?;
        let resources = [
            &counts,
            &frustums,
            &instances.bounding_spheres,
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
        let bytes = [
            &counts, &frustums, &records, &of_shapes, &visible, &arguments,
        ];
        Ok(Culled {
            of_pages: plan.of_pages,
            instances: instance_count,
            draws: plan.draws.len() as u64,
            bytes: bytes.iter().map(|b| b.size()).sum(),
            visible,
            arguments,
        })
    }
}

impl Culled {
    /// Draws what a view sees, with the pipelines of a pass.
    pub(crate) fn draw(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::RenderPass<'_>,
        pool: &BufferPool,
        pipelines: &Pipelines,
        bindings: &ViewBindings,
        own: &wgpu::BindGroup,
    ) {
        let numbers = bindings.view * self.instances * NUMBER;
        pass.set_bind_group(0, &bindings.scene, &[]);
        pass.set_bind_group(2, own, &[]);
        for of_page in &self.of_pages {
            let page = pool.pages[of_page.page].as_ref();
            let page = page.expect("a page that is drawn");
            pass.set_pipeline(pipelines.of(page.kind));
            pass.set_bind_group(1, &page.group, &[]);
            let at = (bindings.view * self.draws + of_page.first_draw as u64) * DRAW;
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

/// The bindings of a view: its frame and the scene.
#[derive(Debug)]
pub(crate) struct ViewBindings {
    /// The number of the view among those that were culled for.
    view: u64,
    frame: wgpu::Buffer,
    scene: wgpu::BindGroup,
}

impl ViewBindings {
    pub(crate) fn new(
        gpu: &Gpu,
        layouts: &Layouts,
        materials: &Materials,
        instances: &InstanceBuffer,
        view: u64,
        frame: &[u8],
    ) -> Result<Self, GpuError> {
        let frame = buffer(gpu, "frame", frame, wgpu::BufferUsages::UNIFORM)?;
        let resources = [
            &frame,
            &instances.instances,
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

    /// Replaces the frame.
    pub(crate) fn set_frame(&self, gpu: &Gpu, frame: &[u8]) {
        gpu.queue().write_buffer(&self.frame, 0, frame);
    }
}

#[cfg(test)]
mod tests;
