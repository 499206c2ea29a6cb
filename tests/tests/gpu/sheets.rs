//! Sheets of materials that the random forests lack, on the GPU, by rays and by closed forms.

use std::sync::Arc;

use nemoral_raycast::{Group, RayScene};
use nemoral_render::{
    CameraRenderer, Gpu, GpuCamera, GpuParams, Lens, Lighting, OpenSky, RayCastCamera,
    RayCastParams, SceneView, View,
};
use nemoral_scene::glam::{DVec2, DVec3, Mat3, Vec3};
use nemoral_scene::{
    Image, Intrinsics, Liquid, Material, MaterialLibrary, Mesh, ObjectId, RigidTransform, Semantic,
    Texture, Triangle,
};
use nemoral_seed::Key;
use nemoral_tests::gpu::gpu;

use super::common::{placed, shape};

/// A square around the origin that rises to the north.
struct Sheet {
    materials: MaterialLibrary,
    forest: RayScene,
}

impl Sheet {
    fn new(material: Material, half_m: f32, slope: f32) -> Self {
        let mut materials = MaterialLibrary::new();
        let material = materials.add(material);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y): (f32, f32)| Vec3::new(x, y, slope * y) * half_m);
        let normal = Vec3::new(0.0, -slope, 1.0).normalize_or(Vec3::Z);
        let mesh = Mesh {
            positions: corners.to_vec(),
            normals: vec![normal; 4],
            uvs: corners.map(|p| p.truncate() + 512.0).to_vec(),
            triangles: [[0, 1, 2], [0, 2, 3]]
                .map(|corners| Triangle { corners, material })
                .to_vec(),
            blends: Vec::new(),
        };
        let sheet = shape(mesh, Vec::new(), &materials);
        let here = placed(&sheet, Vec3::ZERO, Mat3::IDENTITY, ObjectId::NONE);
        let group = Arc::new(Group::build(vec![here]));
        Self {
            materials,
            forest: RayScene::new(vec![(Vec3::ZERO, group)]),
        }
    }

    /// The light of its pictures in even light, by rays and on the GPU, with one sample a pixel.
    fn pictures(&self, gpu: &Gpu, view: &View, max_range_m: f32) -> [Image<Vec3>; 2] {
        let lens = Lens {
            veiling_glare: 0.0,
            ..Lens::default()
        };
        let cast = RayCastParams {
            lens,
            keep_linear: true,
            max_range_m,
            ..RayCastParams::draft()
        };
        let drawn = GpuParams {
            lens,
            keep_linear: true,
            max_range_m,
            colour_samples: 1,
            ..GpuParams::default()
        };
        let scene = SceneView {
            caster: &self.forest,
            instances: Some(&self.forest),
            materials: &self.materials,
            sky_visibility: &OpenSky,
            lamps: &[],
        };
        let light = Lighting::uniform(Vec3::ONE);
        let cast = RayCastCamera::new(cast, light.clone()).expect("allowed");
        let drawn = GpuCamera::new(gpu, drawn, light).unwrap_or_else(|e| panic!("{e}"));
        let key = Key::world(1);
        let cast = cast.render(&scene, view, key).expect("a picture");
        let drawn = drawn.render(&scene, view, key);
        let drawn = drawn.unwrap_or_else(|e| panic!("{e}"));
        [cast, drawn].map(|images| images.linear.expect("asked for"))
    }
}

fn view(fov_rad: f64, at_m: DVec3, pitch: f64, yaw: f64) -> View {
    let k = Intrinsics::from_fov(160, 96, fov_rad).expect("valid");
    let body = RigidTransform::from_xyz_rpy(at_m, 0.0, pitch, yaw);
    View::new(k, body * RigidTransform::body_from_optical())
}

/// The texture of steep ground is seen from the sides, by its height in the scene and not over the
/// camera.
#[test]
fn the_look_of_a_slope_does_not_depend_on_the_cameras_height() {
    let Some(gpu) = gpu("a steep slope") else {
        return;
    };
    // Stripes of half a metre.
    let texel = |i: usize| Vec3::splat(if i / 64 % 16 < 8 { 0.4 } else { 0.05 });
    let texels: Vec<Vec3> = (0..64 * 64).map(texel).collect();
    let striped = Texture::from_linear(64, 64, &texels).expect("a texture");
    let material = Material {
        ground: true,
        tile_m: 4.0,
        albedo: Arc::new(striped),
        ..Material::plain("scree", Semantic::Soil, Vec3::ONE)
    };
    let sheet = Sheet::new(material, 40.0, 50_f32.to_radians().tan());
    for rise_m in [0.0, 0.37] {
        let at_m = DVec3::new(1.3, -6.0, 0.4 + rise_m);
        let north = view(1.0, at_m, 0.0, std::f64::consts::FRAC_PI_2);
        let [cast, drawn] = sheet.pictures(gpu, &north, 300.0);
        let of_all = |f: &dyn Fn(f32, f32) -> f32| {
            let pairs = cast.pixels().iter().zip(drawn.pixels());
            pairs.map(|(a, b)| f(a.y, b.y)).sum::<f32>() / cast.pixels().len() as f32
        };
        let mean = of_all(&|cast, _| cast);
        let contrast = of_all(&|cast, _| (cast - mean).abs()) / mean;
        let apart = of_all(&|cast, drawn| (cast - drawn).abs()) / mean;
        println!("at {rise_m} m: {apart} apart, of a contrast of {contrast}");
        assert!(
            contrast > 0.3 && apart < 0.03,
            "{rise_m}: {apart}, {contrast}"
        );
    }
}

/// Of even light Fresnel's share is mirrored, and a share of the rest scattered.
#[test]
fn water_scatters_its_albedo() {
    let Some(gpu) = gpu("water") else {
        return;
    };
    let water = |scattered: f32, refractive_index: f32| Material {
        roughness: 0.08,
        liquid: Some(Liquid {
            refractive_index,
            absorption_per_m: Vec3::ONE,
            ripple_slope: 0.0,
            ripple_m: 1.0,
        }),
        ..Material::plain("water", Semantic::Water, Vec3::splat(scattered))
    };
    let down = view(
        0.2,
        DVec3::new(0.0, 0.0, 3.0),
        std::f64::consts::FRAC_PI_2,
        0.0,
    );
    for (scattered, refractive_index) in [(0.02, 1.33), (0.2, 1.33), (0.2, 1.6)] {
        let water = water(scattered, refractive_index);
        let mirrored = water.liquid.expect("it is one").mirrored(1.0);
        // The texture is of bytes.
        let exact = mirrored + water.albedo.mean().y * (1.0 - mirrored);
        let sheet = Sheet::new(water, 30.0, 0.0);
        let pictures = sheet.pictures(gpu, &down, 300.0);
        for (linear, by) in pictures.iter().zip(["cast", "drawn"]) {
            let got = linear.at(80, 48).y;
            println!("{by}: {got} for {exact}");
            assert!((got / exact - 1.0).abs() < 0.015, "{by}: {got} for {exact}");
        }
    }
}

/// Level ground fades into the sky at the end of the visible range alone.
#[test]
fn the_end_of_the_visible_range_is_no_veil() {
    let Some(gpu) = gpu("the end of the visible range") else {
        return;
    };
    let range_m = 60.0;
    let material = Material::plain("ground", Semantic::Rock, Vec3::splat(0.3));
    let grey = material.albedo.mean().y;
    let sheet = Sheet::new(material, 100.0, 0.0);
    let ahead = view(1.0, DVec3::new(0.0, 0.0, 6.0), 0.1, 0.4);
    let pictures = sheet.pictures(gpu, &ahead, range_m);
    for (linear, by) in pictures.iter().zip(["cast", "drawn"]) {
        let (mut near, mut far) = (0, 0);
        for (i, light) in linear.pixels().iter().enumerate() {
            let pixel = DVec2::new((i % 160) as f64 + 0.5, (i / 160) as f64 + 0.5);
            let ray = ahead.ray(pixel, range_m);
            let distance_m = -ray.origin.z / ray.direction.z;
            if !(0.0..0.99 * range_m).contains(&distance_m) {
                continue;
            }
            let share = (distance_m / range_m).powi(16);
            // Air of a visibility of 20 km.
            let seen = (1.0 - share) * (-3.912 / 20_000.0 * distance_m).exp();
            let exact = seen * grey + 1.0 - seen;
            assert!(
                (light.y - exact).abs() < 0.01,
                "{by}, {distance_m} m: {} for {exact}",
                light.y
            );
            near += u32::from(share < 1e-3);
            far += u32::from(share > 0.05);
        }
        assert!(near > 1000 && far > 50, "{by}: {near} {far}");
    }
}
