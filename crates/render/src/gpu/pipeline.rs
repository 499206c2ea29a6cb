//! Layouts, pipelines and buffers of shaders.

use nemoral_scene::MaterialLibrary;

use super::primitive::PrimitiveKind;
use super::{Gpu, GpuError, Pass};

/// The part of the shaders that all passes share.
const SURFACE: &str = include_str!("shaders/surface.wgsl");
/// The part that passes with one sample a pixel share.
const EXACT: &str = include_str!("shaders/exact.wgsl");

/// The format of the passes' target.
pub(crate) const EXACT_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;
/// Reversed: 1 at the near plane, 0 far away.
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The margin of primitives in exact passes, pixels, where the fragment decides. It is more than
/// the rounding of vertices by a GPU, which is at most 1/256 pixel.
const MARGIN_PX: f64 = 0.01;

/// The binding of a page in its group.
pub(crate) const GROUP_PAGE: u32 = 0;

/// A buffer that shaders read, with its content. It is never empty, because bindings must not be.
pub(crate) fn storage(gpu: &Gpu, label: &str, content: &[u8]) -> Result<wgpu::Buffer, GpuError> {
    let limit = gpu.device().limits().max_storage_buffer_binding_size;
    if content.len() as u64 > limit {
        return Err(GpuError::TooSmall {
            name: gpu.name(),
            what: format!(
                "the {label} take {} MiB, a shader sees {} MiB of a buffer",
                (content.len() as u64).div_ceil(1 << 20),
                limit >> 20
            ),
        });
    }
    buffer(gpu, label, content, wgpu::BufferUsages::STORAGE)
}

/// A buffer with its content, at least 64 bytes long.
pub(crate) fn buffer(
    gpu: &Gpu,
    label: &str,
    content: &[u8],
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, GpuError> {
    let size = (content.len() as u64).next_multiple_of(16).max(64);
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.check()?;
    gpu.queue().write_buffer(&buffer, 0, content);
    Ok(buffer)
}

/// A texture for a target or a shadow map.
pub(crate) fn texture(
    gpu: &Gpu,
    label: &str,
    [width, height, layers]: [u32; 3],
    samples: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: layers,
        },
        mip_level_count: 1,
        sample_count: samples,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// The groups of bindings that all passes share.
#[derive(Debug)]
pub(crate) struct Layouts {
    pub(crate) scene: wgpu::BindGroupLayout,
    pub(crate) page: wgpu::BindGroupLayout,
    /// A pass's own table, rays and eyes.
    pub(crate) exact: wgpu::BindGroupLayout,
}

pub(crate) fn storage_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    entry(
        binding,
        wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
    )
}

pub(crate) fn uniform_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    entry(
        binding,
        wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
    )
}

/// The rays of a picture.
pub(crate) fn rays_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    entry(
        binding,
        wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
    )
}

pub(crate) fn entry(binding: u32, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty,
        count: None,
    }
}

pub(crate) fn layout(
    gpu: &Gpu,
    label: &str,
    entries: &[wgpu::BindGroupLayoutEntry],
) -> wgpu::BindGroupLayout {
    gpu.device()
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries,
        })
}

/// Bindings 0, 1, 2 … of a group.
pub(crate) fn group(
    gpu: &Gpu,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = resources
        .iter()
        .zip(0..)
        .map(|(resource, binding)| wgpu::BindGroupEntry {
            binding,
            resource: resource.clone(),
        })
        .collect();
    gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &entries,
    })
}

impl Layouts {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let scene = [
            uniform_entry(0),
            storage_entry(1),
            storage_entry(2),
            storage_entry(3),
        ];
        Self {
            scene: layout(gpu, "scene", &scene),
            page: layout(gpu, "page", &[storage_entry(GROUP_PAGE)]),
            exact: layout(
                gpu,
                "exact",
                &[storage_entry(0), rays_entry(1), storage_entry(2)],
            ),
        }
    }
}

/// What a pipeline consists of besides the shared shader.
pub(crate) struct Stage<'a> {
    pub(crate) label: &'a str,
    /// WGSL after `surface.wgsl`.
    pub(crate) shader: &'a str,
    /// The fragment shader's name.
    pub(crate) fragment: &'a str,
    /// The layout of group 2.
    pub(crate) layout: &'a wgpu::BindGroupLayout,
    /// The format of the target; `None` for depth alone.
    pub(crate) target: Option<wgpu::TextureFormat>,
    pub(crate) samples: u32,
    /// How far primitives are drawn over their borders, pixels.
    pub(crate) margin_px: f64,
    /// Whether they are for pictures that a lens or a rolling shutter distorts.
    pub(crate) distorted: bool,
}

/// The pipelines of a pass, one for each kind of primitive.
#[derive(Debug)]
pub(crate) struct Pipelines([wgpu::RenderPipeline; 2]);

impl Pipelines {
    /// # Errors
    /// If the shader is wrong.
    pub(crate) fn new(gpu: &Gpu, layouts: &Layouts, stage: &Stage<'_>) -> Result<Self, GpuError> {
        let device = gpu.device();
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(stage.label),
            source: wgpu::ShaderSource::Wgsl(format!("{SURFACE}\n{}", stage.shader).into()),
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(stage.label),
            bind_group_layouts: &[
                Some(&layouts.scene),
                Some(&layouts.page),
                Some(stage.layout),
            ],
            immediate_size: 0,
        });
        let pipelines = PrimitiveKind::ALL.map(|kind| {
            let constants = [
                ("CARDS", f64::from(u8::from(kind == PrimitiveKind::Cards))),
                ("MARGIN_PX", stage.margin_px),
                ("DISTORTED", f64::from(u8::from(stage.distorted))),
                ("SINGLE", f64::from(u8::from(stage.samples == 1))),
            ];
            let options = wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            };
            let target = stage.target.map(Into::into);
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(stage.label),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vertex"),
                    compilation_options: options.clone(),
                    // The numbers of the visible instances.
                    buffers: &[Some(wgpu::VertexBufferLayout {
                        array_stride: 4,
                        step_mode: wgpu::VertexStepMode::Instance,
                        attributes: &wgpu::vertex_attr_array![0 => Uint32],
                    })],
                },
                // Both sides are visible, so nothing is culled.
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: DEPTH_FORMAT,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::Greater),
                    stencil: wgpu::StencilState::default(),
                    bias: wgpu::DepthBiasState::default(),
                }),
                multisample: wgpu::MultisampleState {
                    count: stage.samples,
                    ..Default::default()
                },
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(stage.fragment),
                    compilation_options: options,
                    targets: if target.is_some() {
                        std::slice::from_ref(&target)
                    } else {
                        &[]
                    },
                }),
                multiview_mask: None,
                cache: None,
            })
        });
        match pollster::block_on(scope.pop()) {
            None => Ok(Self(pipelines)),
            Some(e) => Err(GpuError::Shader {
                pass: stage.label.to_owned(),
                reason: e.to_string(),
            }),
        }
    }
}

impl Pipelines {
    pub(crate) fn of(&self, kind: PrimitiveKind) -> &wgpu::RenderPipeline {
        &self.0[kind as usize]
    }
}

/// A pass's pipelines for undistorted pictures, and for distorted ones once there is one.
#[derive(Debug)]
pub(crate) struct DistortionVariants {
    undistorted: Pipelines,
    distorted: Option<Pipelines>,
}

impl DistortionVariants {
    pub(crate) fn new(undistorted: Pipelines) -> Self {
        Self {
            undistorted,
            distorted: None,
        }
    }

    /// Makes the pipelines for distorted pictures, if there are none yet.
    pub(crate) fn prepare_distorted(
        &mut self,
        make: impl FnOnce() -> Result<Pipelines, GpuError>,
    ) -> Result<(), GpuError> {
        if self.distorted.is_none() {
            self.distorted = Some(make()?);
        }
        Ok(())
    }

    pub(crate) fn of(&self, distorted: bool) -> &Pipelines {
        if !distorted {
            return &self.undistorted;
        }
        let made = self.distorted.as_ref();
        made.expect("made before a distorted picture is drawn")
    }
}

/// A pass with one sample at each pixel's centre.
#[derive(Debug)]
pub(crate) struct ExactPass {
    pub(crate) pass: Box<dyn Pass>,
    pub(crate) pipelines: DistortionVariants,
    /// Its table for the materials that are uploaded.
    pub(crate) table: Option<wgpu::Buffer>,
}

impl ExactPass {
    pub(crate) fn new(gpu: &Gpu, layouts: &Layouts, pass: Box<dyn Pass>) -> Result<Self, GpuError> {
        let undistorted = Self::pipelines(gpu, layouts, pass.as_ref(), false)?;
        Ok(Self {
            pass,
            pipelines: DistortionVariants::new(undistorted),
            table: None,
        })
    }

    pub(crate) fn prepare_distorted(
        &mut self,
        gpu: &Gpu,
        layouts: &Layouts,
    ) -> Result<(), GpuError> {
        let pass = self.pass.as_ref();
        (self.pipelines).prepare_distorted(|| Self::pipelines(gpu, layouts, pass, true))
    }

    fn pipelines(
        gpu: &Gpu,
        layouts: &Layouts,
        pass: &dyn Pass,
        distorted: bool,
    ) -> Result<Pipelines, GpuError> {
        let stage = Stage {
            label: pass.name(),
            shader: &format!("{EXACT}\n{}", pass.wgsl()),
            fragment: "fragment",
            layout: &layouts.exact,
            target: Some(EXACT_FORMAT),
            samples: 1,
            margin_px: MARGIN_PX,
            distorted,
        };
        Pipelines::new(gpu, layouts, &stage)
    }

    pub(crate) fn tabulate(
        &mut self,
        gpu: &Gpu,
        library: &MaterialLibrary,
    ) -> Result<(), GpuError> {
        let table = self.pass.table(library);
        self.table = Some(storage(gpu, "table", bytemuck::cast_slice(&table))?);
        Ok(())
    }
}
