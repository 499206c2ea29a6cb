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
        let mut of_pages: BTreeMap<usize, Vec<(Draw, usize)>> = BTreeMap::new();
        for (shape, (prototype, alike)) in seen.iter().enumerate() {
            for kind in Kind::ALL {
                for range in shapes.ranges(prototype, kind) {
                    let draw = Draw {
                        vertices: range.count * kind.vertices(),
                        instances: 0,
                        first_vertex: range.first * kind.vertices(),
                        first_instance: if gpu.starts_anywhere() {
                            alike.first
                        } else {
                            0
                        },
                    };
                    of_pages.entry(range.page).or_default().push((draw, shape));
                }
            }
        }
        let (mut draws, mut of_shapes) = (Vec::new(), vec![Vec::new(); seen.len()]);
        let mut pages = Vec::new();
        for (page, of_page) in of_pages {
            let first_draw = draws.len();
            for (draw, shape) in &of_page {
                of_shapes[*shape].push(draws.len() as u32);
                draws.push(*draw);
            }
            let first = |(_, shape): &(Draw, usize)| seen[*shape].1.first;
            pages.push(OfPage {
                page,
                first_draw,
                first_instances: of_page.iter().map(first).collect(),
            });
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
        let records: Vec<ShapeRecord> = seen.iter().zip(&of_shapes).map(record).collect();
        let away = herd.origin_m - origin_m;
        let sights: Vec<_> = sights.iter().map(|sight| sight.record(away)).collect();
        let counts = [
            records.len() as u32,
            herd.objects.len() as u32,
            draws.len() as u32,
            0,
        ];

        use wgpu::BufferUsages as U;
        let views = sights.len();
        let counts = buffer(gpu, "counts", bytemuck::cast_slice(&counts), U::UNIFORM)?;
        let sights = storage(gpu, "sights", bytemuck::cast_slice(&sights))?;
        let records = storage(gpu, "shapes", bytemuck::cast_slice(&records))?;
        let of_shapes = of_shapes.concat();
        let of_shapes = storage(gpu, "draws of shapes", bytemuck::cast_slice(&of_shapes))?;
        let instances = herd.objects.len() as u64;
        let visible = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("visible"),
            size: (instances * NUMBER * views as u64).max(64),
            usage: U::STORAGE | U::VERTEX | U::COPY_SRC,
            mapped_at_creation: false,
        });
        let arguments = draws.repeat(views);
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
            of_pages: pages,
            instances,
            draws: draws.len() as u64,
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
mod tests {
    use std::io::Write;

    use glam::{DVec3, Mat3, Vec2, Vec3};
    use nemoral_scene::{
        ChunkCoord, Distortion, Hit, Instance, InstanceGroup, Intrinsics, Material,
        MaterialLibrary, Mesh, ObjectId, PlacedGroup, Prototype, Ray, RayCaster, RigidTransform,
        Semantic, Shutter, Triangle, Twist,
    };
    use nemoral_seed::{Draw as _, Key, Stage};

    use super::super::bend::Bend;
    use super::super::cascade::Cascade;
    use super::super::herd::ball;
    use super::super::sight::{Ball, NOWHERE};
    use super::*;
    use crate::{Accept, GpuCamera, GpuParams, Lighting, OpenSky, SceneView, View};

    /// As `nemoral_tests::gpu::gpu` has it.
    fn gpu(test: &str) -> Option<Gpu> {
        Gpu::open(Accept::Any)
            .map_err(|e| {
                let message = format!("SKIPPED: {test}: {e}\n");
                assert!(
                    std::env::var_os("NEMORAL_REQUIRE_GPU").is_none(),
                    "{message}"
                );
                let _ = std::io::stderr().write_all(message.as_bytes());
            })
            .ok()
    }

    struct Bag(Vec<Instance>);

    impl InstanceGroup for Bag {
        fn instances(&self) -> Box<dyn ExactSizeIterator<Item = &Instance> + '_> {
            Box::new(self.0.iter())
        }
    }

    struct Bags(Vec<PlacedGroup>, MaterialLibrary);

    impl RayCaster for Bags {
        fn closest_hit(&self, _: &Ray) -> Option<Hit> {
            None
        }

        fn placed_groups(&self) -> Option<Vec<PlacedGroup>> {
            Some(self.0.clone())
        }
    }

    /// Triangles all around, of three shapes, and one right below the camera; in three groups.
    fn bags() -> Bags {
        let mut materials = MaterialLibrary::new();
        let material = materials.add(Material::plain("stone", Semantic::Rock, Vec3::ONE));
        let shapes = [0.3_f32, 1.0, 4.0].map(|size| {
            let mesh = Mesh {
                positions: vec![Vec3::ZERO, Vec3::X * size, Vec3::Z * size],
                normals: vec![Vec3::Y; 3],
                uvs: vec![Vec2::ZERO; 3],
                triangles: vec![Triangle {
                    corners: [0, 1, 2],
                    material,
                }],
                blends: Vec::new(),
            };
            let shape = Prototype::new("shape", mesh, Vec::new(), &materials);
            Arc::new(shape.expect("a sound shape"))
        });
        let mut rng = Key::world(3).stage(Stage::new("test.cull")).rng();
        let mut unit = || rng.unit_f64() as f32;
        let mut bag = |chunk: i32, count: u16| -> Arc<dyn InstanceGroup> {
            let instance = |item: u16| Instance {
                prototype: Arc::clone(&shapes[usize::from(item) % 3]),
                position_m: match count {
                    1 => Vec3::new(-3.25, 27.0, -8.0),
                    _ => Vec3::new(50.0 * unit(), 50.0 * unit(), 20.0 * unit() - 10.0),
                },
                linear: Mat3::from_rotation_z(6.3 * unit()),
                object: ObjectId::new(ChunkCoord::new(chunk, 0), item).expect("in range"),
                variation: unit(),
            };
            Arc::new(Bag((1..=count).map(instance).collect()))
        };
        let groups = vec![
            (Vec3::new(-50.0, -25.0, 0.0), bag(-1, 700)),
            (Vec3::new(0.0, -25.0, 0.0), bag(0, 1)),
            (Vec3::new(0.0, -25.0, 0.0), bag(1, 400)),
        ];
        Bags(groups, materials)
    }

    fn view() -> View {
        let body = RigidTransform::from_xyz_rpy(DVec3::new(-3.3, 2.1, 1.0), 0.0, 0.1, 0.7);
        let pose = body * RigidTransform::body_from_optical();
        View::new(Intrinsics::from_fov(96, 64, 1.2).expect("valid"), pose)
    }

    /// A buffer's words.
    fn read(gpu: &Gpu, buffer: &wgpu::Buffer) -> Vec<u32> {
        let copy = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: buffer.size(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
        let submission = gpu.queue().submit([encoder.finish()]);
        copy.map_async(wgpu::MapMode::Read, .., |mapped| {
            mapped.expect("it is mapped")
        });
        gpu.wait(submission).expect("it is copied");
        bytemuck::pod_collect_to_vec(&copy.get_mapped_range(..).expect("it was mapped"))
    }

    #[test]
    fn the_gpu_keeps_what_is_seen_in_order() {
        let Some(gpu) = gpu("culling") else { return };
        let bags = bags();
        let straight = view();
        let fisheye = Distortion::Fisheye {
            k1: -0.01,
            k2: 0.0,
            k3: 0.0,
            k4: 0.0,
        };
        let bent = View {
            intrinsics: Intrinsics::through_lens(64, 36, 2.3, fisheye).expect("a sound lens"),
            shutter: Shutter {
                exposure_s: 0.02,
                readout_s: 0.04,
            },
            motion: Twist {
                linear_m_s: DVec3::new(9.0, 0.0, 3.0),
                angular_rad_s: DVec3::new(0.0, 1.0, 0.2),
            },
            ..straight
        };
        // It turns so fast that more than half of all directions are seen.
        let spun = View {
            motion: Twist {
                angular_rad_s: DVec3::Y * 25.0,
                ..bent.motion
            },
            ..bent
        };
        let origin_m = DVec3::new(-3.25, 2.0, 1.0);
        let sight = |view: &View| Sight::of_view(view, Bend::of(view).as_ref(), origin_m, 30.0);
        let cascade = Cascade::all(&straight, origin_m, 30.0, Vec3::new(0.3, 0.4, 0.8), 512);
        let sights = [
            sight(&straight),
            sight(&bent),
            sight(&spun),
            cascade[1].sight(),
            // Everything, also what lies straight against the axis that it does not have.
            Sight::between([NOWHERE; 6]),
        ];

        let far = origin_m + DVec3::new(-70.5, 3.0, 0.25);
        let herd = Herd::gather(&gpu, &bags.0, far).expect("it fits");
        assert!(herd.is_of(&bags.0, origin_m) && !herd.is_of(&bags.0[1..], origin_m));
        assert!(!herd.is_of(&bags.0, origin_m + DVec3::X * 5e3));
        let layouts = Layouts::new(&gpu);
        let mut shapes = Shapes::new(1 << 30);
        let seen = herd.seen(&sights, origin_m);
        assert_eq!(seen.len(), 3);
        shapes
            .ensure(&gpu, &layouts.page, seen.iter().map(|(p, _)| p))
            .expect("room");
        let culler = Culler::new(&gpu);
        let ask = || {
            let culled = culler.ask(&gpu, &herd, &shapes, &seen, &sights, origin_m);
            culled.unwrap_or_else(|e| panic!("{e}"))
        };
        let culled = ask();
        let (visible, arguments) = (read(&gpu, &culled.visible), read(&gpu, &culled.arguments));
        let placed = |object: &ObjectId| {
            let of_group = |(offset, group): &PlacedGroup| {
                let own = group.instances().find(|i| i.object == *object)?;
                ball(own, offset.as_dvec3() - origin_m)
            };
            bags.0.iter().find_map(of_group).expect("one of them")
        };
        let balls: Vec<Ball> = herd.objects.iter().map(placed).collect();
        for (v, sight) in sights.iter().enumerate() {
            let (mut kept, mut all, mut on_border) = (0, 0, 0);
            for (shape, (_, alike)) in seen.iter().enumerate() {
                // Three draws, of one page: in order of the shapes.
                let draw = &arguments[(v * 3 + shape) * 4..][..4];
                assert_eq!([draw[0], draw[3]], [3, alike.first], "{v} {shape}");
                let numbers = alike.first..alike.first + alike.count;
                let first = v * herd.objects.len() + alike.first as usize;
                let drawn = &visible[first..first + draw[1] as usize];
                assert!(drawn.is_sorted_by(|a, b| a < b));
                for n in numbers {
                    let sees = |more: f64| {
                        let ball = balls[n as usize];
                        sight.sees(&Ball {
                            radius: ball.radius + more,
                            ..ball
                        })
                    };
                    // On the very border both are right.
                    let [surely, perhaps] = [0.0, 5e-3].map(sees);
                    let is_drawn = drawn.binary_search(&n).is_ok();
                    assert!(surely <= is_drawn && is_drawn <= perhaps, "{v} {n}");
                    on_border += usize::from(surely != perhaps);
                }
                kept += drawn.len();
                all += alike.count as usize;
            }
            assert_eq!(kept == all, v == 4, "{v}: {kept} of {all}");
            assert!(
                kept > 50 && (v == 4 || kept < all - 50),
                "{v}: {kept} of {all}"
            );
            assert!(on_border < 10, "{v}: {on_border}");
        }
        assert_eq!(read(&gpu, &ask().arguments), arguments);
    }

    #[test]
    fn draws_that_must_start_at_the_first_instance_draw_the_same() {
        let Some(gpu) = gpu("indirect draws") else {
            return;
        };
        let bags = bags();
        let scene = SceneView {
            caster: &bags,
            materials: &bags.1,
            sky_visibility: &OpenSky,
        };
        let draw = |gpu: &Gpu| {
            let light = Lighting::uniform(Vec3::ONE);
            let camera = GpuCamera::new(gpu, GpuParams::default(), light).expect("a camera");
            camera
                .draw(&scene, &view())
                .unwrap_or_else(|e| panic!("{e}"))
        };
        let images = draw(&gpu);
        let objects = images.truth.object.pixels();
        let seen: std::collections::BTreeSet<_> = objects.iter().collect();
        assert!(seen.len() > 30, "{}", seen.len());
        assert_eq!(draw(&gpu.without_first_instances()), images);
    }
}
