//! Distant leaves cover as much of a picture as near ones, in the same colour: every ray is decided
//! by the same mask at any distance, and only colours have mips.

use std::sync::{Arc, LazyLock};

use nemoral_assets::{AssetParams, Library, Species, StandSpecies};
use nemoral_raycast::RayScene;
use nemoral_render::{
    CameraImages, CameraRenderer, Lens, Lighting, OpenSky, RayCastCamera, RayCastParams, SceneView,
    View,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    Card, Intrinsics, Material, MaterialId, MaterialLibrary, Mesh, Prototype, RigidTransform,
    Semantic,
};
use nemoral_seed::{Draw, Key};

/// Distances at which a pixel is some texels of a card, and a quarter of the card.
const DISTANCES_M: [f64; 2] = [5.0, 80.0];
const PIXELS: u32 = 256;
const HALF_VIEW_DEG: f64 = 10.0;

/// Weights of luminance by Rec. 709.
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    let of = |species| StandSpecies {
        species,
        dbh_mean_m: 0.2,
        trees_per_ha: 300.0,
    };
    let params = AssetParams {
        species: Species::all().into_iter().map(of).collect(),
        individuals_per_species: 1,
        textures: false,
        ..AssetParams::default()
    };
    Library::grow(&params, Key::world(3)).expect("valid")
});

/// The material of a species' twigs, and the size of its cards on the species' tree, metres.
fn twig(species: &str) -> (MaterialId, [f32; 2]) {
    let tree = LIBRARY.trees.iter().find(|t| t.species == species);
    let card = tree.expect("one of each").prototype.cards()[0];
    let size = [card.edge_u, card.edge_v].map(Vec3::length);
    (card.material, size)
}

/// A picture of a wall of whole cards, as many as fit into the view, in even light.
fn seen(
    (material, [width, height]): (MaterialId, [f32; 2]),
    materials: &MaterialLibrary,
    distance_m: f64,
) -> CameraImages {
    let view_m = 2.0 * (distance_m * HALF_VIEW_DEG.to_radians().tan()) as f32;
    // Each card is displaced at random by up to a quarter of its side, as a regular grid would beat
    // with the pixels.
    let cell = [width, height].map(|side| 1.25 * side);
    let [columns, rows] = cell.map(|side| (0.99 * view_m / side).floor());
    let low = Vec3::new(
        distance_m as f32,
        -0.5 * columns * cell[0],
        -0.5 * rows * cell[1],
    );
    let mut rng = Key::world(5).rng();
    let places = (0..columns as u16).flat_map(|i| (0..rows as u16).map(move |k| (i, k)));
    let cards = places.map(|(i, k)| Card {
        corner: low
            + Vec3::new(
                0.0,
                f32::from(i) * cell[0] + rng.range_f32(0.0, 0.25 * width),
                f32::from(k) * cell[1] + rng.range_f32(0.0, 0.25 * height),
            ),
        edge_u: Vec3::Y * width,
        edge_v: Vec3::Z * height,
        material,
    });
    let wall = Prototype::new("wall", Mesh::default(), cards.collect(), materials);
    let forest = RayScene::of_shape(Arc::new(wall.expect("sound")), materials);
    let fov = 2.0 * HALF_VIEW_DEG.to_radians();
    let intrinsics = Intrinsics::from_fov(PIXELS, PIXELS, fov).expect("a pinhole");
    let ahead = RigidTransform::from_xyz_rpy(DVec3::ZERO, 0.0, 0.0, 0.0);
    let view = View::new(intrinsics, ahead * RigidTransform::body_from_optical());
    let params = RayCastParams {
        lens: Lens::default(),
        keep_linear: true,
        ..RayCastParams::draft()
    };
    let camera = RayCastCamera::new(params, Lighting::uniform(Vec3::ONE)).expect("valid");
    let scene = SceneView {
        caster: &forest,
        instances: None,
        materials,
        sky_visibility: &OpenSky,
        lamps: &[],
    };
    camera
        .render(&scene, &view, Key::world(1))
        .expect("renders")
}

/// The number of pixels that show leaves, and their mean luminance.
fn leaves(images: &CameraImages) -> (f64, f64) {
    let light = images.linear.as_ref().expect("asked for");
    let shown = images.truth.semantic.pixels().iter().zip(light.pixels());
    let (mut count, mut sum) = (0.0, 0.0);
    for (_, light) in shown.filter(|(s, _)| **s != Semantic::Sky) {
        count += 1.0;
        sum += f64::from(light.dot(LUMINANCE));
    }
    (count, sum / count)
}

/// The brightness of the air before something black.
fn air(distance_m: f64) -> f64 {
    let mut materials = MaterialLibrary::new();
    let black = materials.add(Material::plain("black", Semantic::Leaf, Vec3::ZERO));
    leaves(&seen((black, [0.4; 2]), &materials, distance_m)).1
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn leaves_cover_as_much_far_off_as_near_by_in_the_same_colour() {
    // The same cards without their holes.
    let mut whole = MaterialLibrary::new();
    for m in LIBRARY.materials.materials() {
        whole.add(Material {
            mask: None,
            ..m.clone()
        });
    }
    let air = DISTANCES_M.map(air);
    for species in Species::names() {
        let twig = twig(species);
        let measure = |k: usize| {
            let (count, light) = leaves(&seen(twig, &LIBRARY.materials, DISTANCES_M[k]));
            let (all, _) = leaves(&seen(twig, &whole, DISTANCES_M[k]));
            (count / all, (light - air[k]) / (1.0 - air[k]))
        };
        let (near, far) = (measure(0), measure(1));
        let mask = LIBRARY.materials.get(twig.0).mask.as_ref();
        let mask = mask.expect("leaves are cut out").opaque_fraction();
        println!("{species}: {mask:.4}, share and luminance {near:.4?} near by, {far:.4?} far off");
        for (distance_m, (share, _)) in DISTANCES_M.into_iter().zip([near, far]) {
            // The standard deviation by chance is 1 % where leaves are few.
            assert!(
                (share / mask - 1.0).abs() < 0.04,
                "{species} covers {share:.4} at {distance_m} m, its mask {mask:.4}"
            );
        }
        assert!(
            (far.1 / near.1 - 1.0).abs() < 0.03,
            "{species}: luminance {:.4} near by, {:.4} far off",
            near.1,
            far.1
        );
    }
}
