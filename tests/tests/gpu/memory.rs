//! The memory of a GPU camera is bounded, and what it cannot draw is refused.

use std::sync::Arc;

use nemoral_render::{GpuCamera, GpuError, GpuParams, Lighting, OpenSky, SceneView, View};
use nemoral_scene::glam::{Mat3, Vec2, Vec3};
use nemoral_scene::{
    Hit, Instance, InstanceGroup, InstancedScene, Intrinsics, Material, MaterialLibrary, Mesh,
    ObjectId, PlacedGroup, Prototype, Ray, RayCaster, RigidTransform, Semantic, Triangle,
};
use nemoral_seed::{Domain, Key};
use nemoral_tests::gpu::gpu;

use super::common::{camera, unit, view};

/// Shapes that are only drawn, without a ray caster.
struct Bag(Vec<Instance>);

impl InstanceGroup for Bag {
    fn instances(&self) -> Box<dyn ExactSizeIterator<Item = &Instance> + '_> {
        Box::new(self.0.iter())
    }
}

struct Bags(Vec<Arc<Bag>>);

impl RayCaster for Bags {
    fn closest_hit(&self, _: &Ray) -> Option<Hit> {
        None
    }
}

impl InstancedScene for Bags {
    fn placed_groups(&self) -> Vec<PlacedGroup> {
        let place = |bag: &Arc<Bag>| (Vec3::ZERO, Arc::clone(bag) as Arc<dyn InstanceGroup>);
        self.0.iter().map(place).collect()
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn memory_is_bounded_and_reported() {
    let Some(gpu) = gpu("bounded memory") else {
        return;
    };
    let params = GpuParams {
        memory_mib: 128,
        ..GpuParams::default()
    };
    let camera = camera(gpu, params);
    let mut materials = MaterialLibrary::new();
    let material = materials.add(Material::plain("stone", Semantic::Rock, Vec3::ONE));
    // These are four shapes of 150,000 triangles, 48 MB.
    let heap = |seed: u64| {
        let mut rng = Key::world(seed).domain(Domain::new("test.heap")).rng();
        let rng = &mut rng;
        let instances = (0..4).map(|_| {
            let place = |i: u32| Vec3::new(3.0 + (i % 99) as f32, unit(rng) - 0.5, unit(rng) - 0.5);
            let positions: Vec<Vec3> = (0..150_002).map(place).collect();
            let corners = |i: u32| Triangle {
                corners: [i, i + 1, i + 2],
                material,
            };
            let mesh = Mesh {
                normals: vec![Vec3::Z; positions.len()],
                uvs: vec![Vec2::ZERO; positions.len()],
                triangles: (0..150_000).map(corners).collect(),
                positions,
                blends: Vec::new(),
            };
            let shape = Prototype::new("heap", mesh, Vec::new(), &materials);
            Instance {
                prototype: Arc::new(shape.expect("a sound shape")),
                position_m: Vec3::ZERO,
                linear: Mat3::IDENTITY,
                object: ObjectId::NONE,
                variation: 0.5,
            }
        });
        Arc::new(Bag(instances.collect()))
    };
    let k = Intrinsics::from_fov(64, 48, 1.2).expect("valid");
    let view = View::new(k, RigidTransform::body_from_optical());
    let draw_with = |camera: &GpuCamera, bags: &Bags| {
        let scene = SceneView {
            caster: bags,
            instances: Some(bags),
            materials: &materials,
            sky_visibility: &OpenSky,
            lamps: &[],
        };
        camera.draw(&scene, &view)
    };
    let draw = |bags: &Bags| draw_with(&camera, bags);
    let heaps = [1, 2, 3].map(|seed| Bags(vec![heap(seed)]));
    for bags in [&heaps[0], &heaps[1], &heaps[2], &heaps[0]] {
        let drawn = draw(bags).unwrap_or_else(|e| panic!("{e}"));
        let memory = camera.memory();
        assert!(
            memory.bytes > 0 && memory.bytes <= memory.limit_bytes,
            "{memory:?}"
        );
        assert!(drawn.truth.semantic.pixels().contains(&Semantic::Rock));
    }
    assert!(camera.memory().evicted >= 4, "{:?}", camera.memory());

    // A scene that can never fit is refused with a message, and one that fits is drawn afterwards.
    let all = Bags(heaps.iter().flat_map(|h| h.0.clone()).collect());
    let error = draw(&all).expect_err("too much");
    let GpuError::OutOfMemory {
        needed_mib,
        allowed_mib: 128,
    } = error
    else {
        panic!("{error}");
    };
    assert!(needed_mib > 128, "{error}");
    draw(&heaps[1]).unwrap_or_else(|e| panic!("{e}"));
    // The memory that the message asks for is enough.
    let enough = GpuParams {
        memory_mib: needed_mib as u32,
        ..params
    };
    let larger = GpuCamera::new(gpu, enough, Lighting::uniform(Vec3::ONE));
    draw_with(&larger.unwrap_or_else(|e| panic!("{e}")), &all).unwrap_or_else(|e| panic!("{e}"));

    // Shapes without owners are evicted without any need for room.
    drop((heaps, all));
    draw(&Bags(Vec::new())).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(camera.memory().shapes, 0);
}

#[test]
fn a_scene_without_its_shapes_is_refused() {
    struct Secret;
    impl RayCaster for Secret {
        fn closest_hit(&self, _: &Ray) -> Option<Hit> {
            None
        }
    }
    let Some(gpu) = gpu("hidden shapes") else {
        return;
    };
    let camera = camera(gpu, GpuParams::default());
    let scene = SceneView {
        caster: &Secret,
        instances: None,
        materials: &MaterialLibrary::new(),
        sky_visibility: &OpenSky,
        lamps: &[],
    };
    assert_eq!(camera.draw(&scene, &view(64, 48)), Err(GpuError::NoShapes));
    let refused = |params: GpuParams| {
        let camera = GpuCamera::new(gpu, params, Lighting::uniform(Vec3::ONE));
        camera.expect_err("out of range").to_string()
    };
    let all = GpuParams::default;
    for (params, word) in [
        (
            GpuParams {
                memory_mib: 5,
                ..all()
            },
            "camera.memory_mib = 5",
        ),
        (
            GpuParams {
                colour_samples: 3,
                ..all()
            },
            "camera.colour_samples = 3",
        ),
        (
            GpuParams {
                blur_samples: 1,
                ..all()
            },
            "camera.blur_samples = 1",
        ),
    ] {
        let error = refused(params);
        assert!(error.contains(word), "{error}");
    }
}
