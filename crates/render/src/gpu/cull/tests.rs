//! The GPU culls the same instances as the processor.

use glam::{DVec3, Mat3, Vec2, Vec3};
use nemoral_scene::{
    ChunkCoord, Distortion, Hit, Instance, InstanceGroup, InstancedScene, Intrinsics, Material,
    MaterialLibrary, Mesh, ObjectId, PlacedGroup, Prototype, Ray, RayCaster, RigidTransform,
    Semantic, Shutter, Triangle, Twist,
};
use nemoral_seed::{Domain, Draw as _, Key};

use super::super::cascade::Cascade;
use super::super::distortion_bounds::DistortionBounds;
use super::super::frustum::{BoundingSphere, NO_PLANE};
use super::super::instance_buffer::bounding_sphere;
use super::super::testing::gpu;
use super::*;
use crate::{GpuCamera, GpuParams, Lighting, OpenSky, SceneView, View};

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
}

impl InstancedScene for Bags {
    fn placed_groups(&self) -> Vec<PlacedGroup> {
        self.0.clone()
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
    let mut rng = Key::world(3).domain(Domain::new("test.cull")).rng();
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
    // It turns so fast that it sees more than half of all directions.
    let spun = View {
        motion: Twist {
            angular_rad_s: DVec3::Y * 25.0,
            ..bent.motion
        },
        ..bent
    };
    let origin_m = DVec3::new(-3.25, 2.0, 1.0);
    let frustum =
        |view: &View| Frustum::of_view(view, DistortionBounds::of(view).as_ref(), origin_m, 30.0);
    let cascade = Cascade::all(&straight, origin_m, 30.0, Vec3::new(0.3, 0.4, 0.8), 512);
    let frustums = [
        frustum(&straight),
        frustum(&bent),
        frustum(&spun),
        cascade[1].frustum(),
        // Everything, including what lies opposite to the axis, which it does not have.
        Frustum::from_planes([NO_PLANE; 6]),
    ];

    let far = origin_m + DVec3::new(-70.5, 3.0, 0.25);
    let instances = InstanceBuffer::upload(&gpu, &bags.0, far).expect("it fits");
    assert!(instances.holds(&bags.0, origin_m) && !instances.holds(&bags.0[1..], origin_m));
    assert!(!instances.holds(&bags.0, origin_m + DVec3::X * 5e3));
    let layouts = Layouts::new(&gpu);
    let mut shapes = Shapes::new(1 << 30);
    let seen = instances.visible_prototypes(&frustums, origin_m);
    assert_eq!(seen.len(), 3);
    shapes
        .ensure(&gpu, &layouts.page, seen.iter().map(|(p, _)| p))
        .expect("room");
    let culler = Culler::new(&gpu);
    let ask = || {
        let culled = culler.cull(&gpu, &instances, &shapes, &seen, &frustums, origin_m);
        culled.unwrap_or_else(|e| panic!("{e}"))
    };
    let culled = ask();
    let (visible, arguments) = (read(&gpu, &culled.visible), read(&gpu, &culled.arguments));
    let placed = |object: &ObjectId| {
        let of_group = |(offset, group): &PlacedGroup| {
            let own = group.instances().find(|i| i.object == *object)?;
            bounding_sphere(own, offset.as_dvec3() - origin_m)
        };
        bags.0.iter().find_map(of_group).expect("one of them")
    };
    let balls: Vec<BoundingSphere> = instances.objects.iter().map(placed).collect();
    for (v, frustum) in frustums.iter().enumerate() {
        let (mut kept, mut all, mut on_border) = (0, 0, 0);
        for (shape, (_, alike)) in seen.iter().enumerate() {
            // There are three draws of one page, in the order of shapes.
            let draw = &arguments[(v * 3 + shape) * 4..][..4];
            assert_eq!([draw[0], draw[3]], [3, alike.first], "{v} {shape}");
            let numbers = alike.first..alike.first + alike.count;
            let first = v * instances.objects.len() + alike.first as usize;
            let drawn = &visible[first..first + draw[1] as usize];
            assert!(drawn.is_sorted_by(|a, b| a < b));
            for n in numbers {
                let sees = |more: f64| {
                    let ball = balls[n as usize];
                    frustum.may_see(&BoundingSphere {
                        radius: ball.radius + more,
                        ..ball
                    })
                };
                // Exactly on the border both results are right.
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
        instances: Some(&bags),
        materials: &bags.1,
        sky_visibility: &OpenSky,
        lamps: &[],
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
