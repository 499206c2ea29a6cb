//! A failing GPU is an error with a clear message, never a panic.

use glam::{Mat3, Vec2, Vec3};
use nemoral_scene::{
    Hit, Instance, InstanceGroup, InstancedScene, Intrinsics, Material, MaterialLibrary, Mesh,
    ObjectId, PlacedGroup, Prototype, Ray, RayCaster, RigidTransform, Semantic, Triangle,
};
use nemoral_seed::Key;

use super::super::readback::Readback;
use super::super::testing::gpu;
use super::*;
use crate::{CameraRenderer, GpuCamera, GpuParams, Lighting, SceneView, SkyVisibility, View};

/// When the GPU is lost: while the picture is prepared, or after its truth is drawn and before its
/// light is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Loss {
    Never,
    WhilePreparing,
    BeforeTheLight,
}

/// A stone in front of the camera.
struct Stone {
    group: Arc<Single>,
    materials: MaterialLibrary,
    gpu: Gpu,
    loss: Loss,
}

struct Single(Instance);

impl InstanceGroup for Single {
    fn instances(&self) -> Box<dyn ExactSizeIterator<Item = &Instance> + '_> {
        Box::new(std::iter::once(&self.0))
    }
}

impl RayCaster for Stone {
    fn closest_hit(&self, _: &Ray) -> Option<Hit> {
        None
    }
}

impl InstancedScene for Stone {
    fn placed_groups(&self) -> Vec<PlacedGroup> {
        if self.loss == Loss::WhilePreparing {
            self.gpu.lose();
        }
        vec![(Vec3::ZERO, Arc::clone(&self.group) as _)]
    }
}

impl SkyVisibility for Stone {
    fn sky_view_factor(&self, _: Vec3) -> f32 {
        if self.loss == Loss::BeforeTheLight {
            self.gpu.lose();
        }
        1.0
    }
}

impl Stone {
    fn new(gpu: &Gpu, loss: Loss) -> Self {
        let mut materials = MaterialLibrary::new();
        let material = materials.add(Material::plain("stone", Semantic::Rock, Vec3::ONE));
        let mesh = Mesh {
            positions: [-Vec3::Z, Vec3::Z, Vec3::Y].map(|p| 9.0 * p).to_vec(),
            normals: vec![-Vec3::X; 3],
            uvs: vec![Vec2::ZERO; 3],
            triangles: vec![Triangle {
                corners: [0, 1, 2],
                material,
            }],
            blends: Vec::new(),
        };
        let shape = Prototype::new("stone", mesh, Vec::new(), &materials);
        let instance = Instance {
            prototype: Arc::new(shape.expect("a sound shape")),
            position_m: 5.0 * Vec3::X,
            linear: Mat3::IDENTITY,
            object: ObjectId::NONE,
            variation: 0.5,
        };
        Self {
            group: Arc::new(Single(instance)),
            materials,
            gpu: gpu.clone(),
            loss,
        }
    }

    fn scene(&self) -> SceneView<'_> {
        SceneView {
            caster: self,
            instances: Some(self),
            materials: &self.materials,
            sky_visibility: self,
            lamps: &[],
        }
    }
}

fn view() -> View {
    let k = Intrinsics::from_fov(48, 32, 1.2).expect("valid");
    View::new(k, RigidTransform::body_from_optical())
}

fn a_camera(gpu: &Gpu) -> Result<GpuCamera, GpuError> {
    // Software draws shadow maps slowly, so these are small.
    let quick = GpuParams {
        colour_samples: 1,
        shadow_px: 256,
        ..GpuParams::default()
    };
    GpuCamera::new(gpu, quick, Lighting::uniform(Vec3::ONE))
}

fn assert_lost<T>(result: Result<T, GpuError>, when: &str) {
    let error = result.err().unwrap_or_else(|| panic!("{when}: no error"));
    let words = error.to_string();
    assert!(matches!(error, GpuError::Lost { .. }), "{when}: {words}");
    for part in [
        "the GPU was lost",
        "--resume",
        "--backend cpu with --overwrite",
    ] {
        assert!(words.contains(part), "{when}: {words}");
    }
}

#[test]
fn a_gpu_that_is_lost_is_an_error_from_then_on() {
    for loss in [Loss::Never, Loss::WhilePreparing, Loss::BeforeTheLight] {
        let Some(gpu) = gpu("a lost GPU") else { return };
        let camera = a_camera(&gpu).expect("a camera");
        let render = |stone: &Stone| camera.render(&stone.scene(), &view(), Key::world(1));
        let losing = Stone::new(&gpu, loss);
        if loss == Loss::Never {
            // The GPU is lost between two pictures.
            let sound = render(&losing).expect("a picture");
            assert!(sound.truth.semantic.pixels().contains(&Semantic::Rock));
            gpu.lose();
        }
        assert_lost(render(&losing), &format!("{loss:?}, its picture"));
        let stone = Stone::new(&gpu, Loss::Never);
        assert_lost(render(&stone), &format!("{loss:?}, the next picture"));
        let drawn = camera.draw(&stone.scene(), &view());
        assert_lost(drawn, &format!("{loss:?}, truth alone"));
        assert_lost(a_camera(&gpu), &format!("{loss:?}, a camera"));
    }
}

#[test]
fn a_gpu_that_is_lost_while_a_picture_comes_back_is_an_error() {
    let Some(gpu) = gpu("a GPU lost late") else {
        return;
    };
    let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: 64,
            height: 4,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let mut encoder = gpu.device().create_command_encoder(&Default::default());
    let readback = Readback::encode(&gpu, &mut encoder, &texture, 4);
    let submission = gpu.queue().submit([encoder.finish()]);
    gpu.lose();
    let rows = readback.read(&gpu, &submission, |rows| rows.count());
    assert_lost(rows, "a picture that was drawn");
}

/// If a GPU fails while it is waited for, wgpu panics; software GPUs never fail in that way.
#[test]
fn waiting_survives_a_panic() {
    assert_eq!(survived(|| Ok(wgpu::PollStatus::QueueEmpty)), Ok(()));
    assert_lost(survived(|| Err(wgpu::PollError::Timeout)), "an error");
    let fatal = survived(|| panic!("Error in {}: Parent device is lost", "Device::poll"));
    let words = fatal.clone().expect_err("it panicked").to_string();
    assert!(words.contains("Parent device is lost"), "{words}");
    assert_lost(fatal, "a panic");
    assert_lost(survived(|| std::panic::panic_any(7)), "a number");
}

#[test]
fn a_driver_that_refuses_is_named_with_a_way_out() {
    if gpu("a driver that refuses").is_none() {
        return;
    }
    let adapter = adapters_of(wgpu::Backends::PRIMARY | wgpu::Backends::GL).remove(0);
    let limits = wgpu::Limits {
        max_texture_dimension_2d: u32::MAX,
        ..adapter.limits()
    };
    let refused = Gpu::request(&adapter, limits).expect_err("too much");
    let words = refused.to_string();
    assert!(matches!(refused, GpuError::NoDevice { .. }), "{words}");
    for part in [
        "cannot open the GPU",
        "max_texture_dimension_2d",
        "--backend cpu",
    ] {
        assert!(words.contains(part), "{words}");
    }
}
