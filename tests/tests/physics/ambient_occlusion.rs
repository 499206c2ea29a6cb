//! The ambient occlusion within low plants, compared with path-traced light.

use std::sync::Arc;

use nemoral_assets::{AssetParams, Library, PlantAsset, PlantKind};
use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_render::{
    CameraRenderer, Lens, Lighting, OpenSky, RayCastCamera, RayCastParams, SceneView, SkyParams,
    Sun, View,
};
use nemoral_scene::glam::{DMat3, DQuat, DVec2, DVec3, Mat3, Vec2, Vec3};
use nemoral_scene::{
    Hit, InstancePlace, Intrinsics, Material, MaterialId, MaterialLibrary, Mesh, ObjectId,
    Prototype, RayCaster, RigidTransform, Semantic, Triangle,
};
use nemoral_seed::Key;

/// Width of the pictures, pixels.
const WIDTH: usize = 160;

const SOIL: &str = "soil of this test";

/// Reflectance of the ground.
const GROUND: f32 = 0.15;

/// Plants in rows, 1.5 m apart, on open level ground, with the ambient occlusion of their shapes,
/// or without.
fn planted(plants: &[&PlantAsset], materials: &MaterialLibrary, known: bool) -> RayScene {
    let soil = materials
        .materials()
        .iter()
        .position(|m| m.name == SOIL)
        .expect("added");
    let soil = MaterialId(soil as u16);
    let corners = [(-40.0, -40.0), (40.0, -40.0), (40.0, 40.0), (-40.0, 40.0)];
    let mesh = Mesh {
        positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
        normals: vec![Vec3::Z; 4],
        uvs: corners.map(|(x, y)| Vec2::new(x, y)).to_vec(),
        triangles: [[0, 1, 2], [0, 2, 3]]
            .map(|corners| Triangle {
                corners,
                material: soil,
            })
            .to_vec(),
        blends: Vec::new(),
    };
    let ground = Prototype::new("ground", mesh, Vec::new(), materials).expect("sound");
    let mut instances = Vec::new();
    let mut place = |prototype: Arc<Prototype>, position_m: Vec3| {
        let blas = Arc::new(Blas::build(Arc::clone(&prototype), materials));
        let instance = InstancePlace {
            position_m,
            linear: Mat3::IDENTITY,
            object: ObjectId::NONE,
            variation: 0.5,
        };
        instances.push((instance, blas));
    };
    place(Arc::new(ground), Vec3::ZERO);
    for (i, plant) in plants.iter().enumerate() {
        let shape = &plant.prototype;
        let at = Vec3::new((i / 4) as f32 * 1.5, (i % 4) as f32 * 1.5 - 2.25, 0.0);
        if known {
            place(Arc::clone(shape), at);
        } else {
            let (mesh, cards) = (shape.mesh().clone(), shape.cards().to_vec());
            let bare = Prototype::new(shape.name(), mesh, cards, materials).expect("as before");
            place(Arc::new(bare), at);
        }
    }
    RayScene::new(vec![(Vec3::ZERO, Arc::new(Group::build(instances)))])
}

/// A view down at the plants from eye level.
fn view() -> View {
    let intrinsics = Intrinsics::from_fov(WIDTH as u32, 96, 1.1).expect("valid");
    let eye = DVec3::new(-1.8, 0.0, 1.5);
    let forward = (DVec3::new(1.2, 0.0, 0.1) - eye).normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let axes = DMat3::from_cols(right, forward.cross(right), forward);
    let pose = RigidTransform {
        rotation: DQuat::from_mat3(&axes),
        translation_m: eye,
    };
    View::new(intrinsics, pose)
}

fn picture(forest: &RayScene, materials: &MaterialLibrary, samples: u32, bounces: u32) -> Vec<f64> {
    let sun = Sun::from_angles(180.0, 50.0).expect("valid");
    let sky = SkyParams {
        overcast: 1.0,
        ground_albedo: Vec3::splat(GROUND),
        visibility_m: 1e6,
        ..SkyParams::default()
    };
    let params = RayCastParams {
        colour_samples: samples,
        bounces,
        lens: Lens {
            veiling_glare: 0.0,
            ..Lens::default()
        },
        keep_linear: true,
        ..RayCastParams::draft()
    };
    let camera =
        RayCastCamera::new(params, Lighting::new(&sun, &sky).expect("valid")).expect("valid");
    let scene = SceneView {
        caster: forest,
        instances: None,
        materials,
        sky_visibility: &OpenSky,
        lamps: &[],
    };
    let images = camera
        .render(&scene, &view(), Key::world(7))
        .expect("a picture");
    let light = images.linear.expect("asked for");
    light
        .pixels()
        .iter()
        .map(|c| f64::from(c.dot(Vec3::new(0.2126, 0.7152, 0.0722))))
        .collect()
}

/// Sums of the light of places in a range of ambient occlusion.
#[derive(Default)]
struct Part {
    pixels: usize,
    /// The quick light, the same without the occlusion by near parts, and the path-traced light.
    light: [f64; 3],
}

/// The share of ambient light that separates dark places from light ones.
const DARK: f32 = 0.7;

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn low_plants_are_dark_within_as_followed_light_has_it() {
    let params = AssetParams {
        individuals_per_species: 1,
        ..AssetParams::default()
    };
    let library = Library::grow(&params, Key::world(3)).expect("valid");
    let mut materials = library.materials.clone();
    materials.add(Material::plain(SOIL, Semantic::Soil, Vec3::splat(GROUND)));
    for (name, kind) in [
        ("grass", PlantKind::Grass),
        ("herbs", PlantKind::Herbs),
        ("ferns", PlantKind::Ferns),
        ("shrubs", PlantKind::Shrub),
    ] {
        let plants: Vec<&PlantAsset> = library.plants[kind].iter().take(12).collect();
        let [known, bare] = [true, false].map(|known| planted(&plants, &materials, known));
        let followed = picture(&known, &materials, 32, 5);
        let [quick, without] = [&known, &bare].map(|forest| picture(forest, &materials, 1, 0));
        let view = view();
        let mut parts = [Part::default(), Part::default()];
        for (i, &light) in followed.iter().enumerate() {
            let pixel = DVec2::new((i % WIDTH) as f64, (i / WIDTH) as f64) + 0.5;
            let hit = known.closest_hit(&view.ray(pixel, 100.0));
            let plant = |hit: &Hit| materials.get(hit.surface.material).semantic != Semantic::Soil;
            if let Some(hit) = hit.filter(plant) {
                let part = &mut parts[usize::from(hit.shading.ambient_occlusion > DARK)];
                part.pixels += 1;
                let lights = [quick[i], without[i], light];
                (part.light.iter_mut().zip(lights)).for_each(|(sum, light)| *sum += light);
            }
        }
        let ratios = parts.map(|part| {
            let [quick, without, followed] = part.light;
            assert!(part.pixels > 200, "{name}: {} pixels", part.pixels);
            [quick / followed, without / followed]
        });
        let [dark, light] = ratios;
        println!(
            "{name}: dark {:.2}, light {:.2} of followed light; without occlusion {:.2}, {:.2}",
            dark[0], light[0], dark[1], light[1]
        );
        for ratio in [dark[0], light[0]] {
            assert!((0.85..1.35).contains(&ratio), "{name}: {ratio:.2}");
        }
        // Dark places have the right brightness relative to light ones, but not without the
        // occlusion.
        let [right, wrong] = [0, 1].map(|i| dark[i] / light[i]);
        assert!((0.85..1.15).contains(&right), "{name}: {right:.2}");
        assert!(wrong > 1.2, "{name}: {wrong:.2}");
    }
}
