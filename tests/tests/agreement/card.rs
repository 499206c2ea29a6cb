//! An asymmetric test card has one known picture for every renderer and caster, from both sides.

use std::f32::consts::FRAC_PI_2;
use std::f64::consts::PI;
use std::sync::Arc;

use nemoral_lidar::{ExactRange, Pulse, ScanPattern, ScanRequest, Scanner, ScannerParams};
use nemoral_raycast::{Blas, BruteForce, Group, RayScene};
use nemoral_render::{
    CameraRenderer, GpuCamera, GpuParams, Lighting, OpenSky, RayCastCamera, RayCastParams,
    SceneView, View,
};
use nemoral_scene::glam::{DVec2, DVec3, Mat3, Vec2, Vec3};
use nemoral_scene::{
    AlphaMask, Card, ChunkCoord, Distortion, InstancePlace, Intrinsics, Material, MaterialId,
    MaterialLibrary, Mesh, ObjectId, Prototype, RayCaster, RigidTransform, Semantic, Triangle,
};
use nemoral_seed::Key;

/// The picture of a camera that looks at the card's face.
const FACE: [&str; 9] = [
    ".........",
    ".FFFFF...",
    ".F.......",
    ".F.......",
    ".FFFF....",
    ".F.......",
    ".F.......",
    ".F.......",
    ".........",
];

/// Size of a pixel of the picture, and of a texel of the card, at the card's distance.
const TEXEL_M: f64 = 0.1;
const DISTANCE_M: f64 = 5.0;

/// The card's five by seven texels; row 0 of a mask is at v = 0, the foot of the letter.
fn mask() -> AlphaMask {
    let inked = |column: usize, row: usize| FACE[7 - row].as_bytes()[1 + column] == b'F';
    AlphaMask::from_fn(5, 7, inked).expect("5 x 7 is allowed")
}

fn library() -> (MaterialLibrary, MaterialId) {
    let mut library = MaterialLibrary::new();
    // Black, so that the colour picture shows the letter before the white world.
    let ink = Material {
        mask: Some(Arc::new(mask())),
        ..Material::plain("ink", Semantic::Leaf, Vec3::ZERO)
    };
    let ink = library.add(ink);
    (library, ink)
}

/// The letter in its own frame: u to the east, v up, facing south.
fn as_card(ink: MaterialId) -> (Mesh, Vec<Card>) {
    let (width, height) = (5.0 * TEXEL_M as f32, 7.0 * TEXEL_M as f32);
    let card = Card {
        corner: Vec3::ZERO,
        edge_u: Vec3::X * width,
        edge_v: Vec3::Z * height,
        material: ink,
    };
    (Mesh::default(), vec![card])
}

/// The same letter on two triangles with the card's texture coordinates.
fn as_triangles(ink: MaterialId) -> (Mesh, Vec<Card>) {
    let (_, cards) = as_card(ink);
    let triangle = |corners| Triangle {
        corners,
        material: ink,
    };
    let mesh = Mesh {
        positions: cards[0].corners().to_vec(),
        normals: vec![Vec3::NEG_Y; 4],
        uvs: [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .map(Vec2::from)
            .to_vec(),
        triangles: vec![triangle([0, 1, 2]), triangle([0, 2, 3])],
        blends: Vec::new(),
    };
    (mesh, Vec::new())
}

/// Places the letter in front of a sensor at the origin that looks east, where [`FACE`] has it.
fn groups((mesh, cards): (Mesh, Vec<Card>), library: &MaterialLibrary) -> Vec<(Vec3, Arc<Group>)> {
    let shape = Prototype::new("F", mesh, cards, library).expect("a sound shape");
    let blas = Arc::new(Blas::build(Arc::new(shape), library));
    let instance = InstancePlace {
        // The left end of the letter's foot is the lower left corner of the picture's pixel (1, 7).
        position_m: DVec3::new(DISTANCE_M, 3.5 * TEXEL_M, -3.5 * TEXEL_M).as_vec3() - OFFSET,
        linear: Mat3::from_rotation_z(-FRAC_PI_2),
        object: ObjectId::new(ChunkCoord::new(3, -2), 9).expect("in range"),
        variation: 0.5,
    };
    vec![(OFFSET, Arc::new(Group::build(vec![(instance, blas)])))]
}

/// Position of the card's chunk in the scene.
const OFFSET: Vec3 = Vec3::new(50.0, -50.0, 0.0);

fn intrinsics() -> Intrinsics {
    let focal = DISTANCE_M / TEXEL_M;
    Intrinsics {
        width: 9,
        height: 9,
        fx: focal,
        fy: focal,
        cx: 4.5,
        cy: 4.5,
        distortion: Distortion::None,
    }
}

/// Poses of the sensor: it looks at the face, or from the same distance at the back.
fn bodies() -> [RigidTransform; 2] {
    let behind = DVec3::new(2.0 * DISTANCE_M, 0.0, 0.0);
    [
        RigidTransform::IDENTITY,
        RigidTransform::from_xyz_rpy(behind, 0.0, 0.0, PI),
    ]
}

/// Pixel centres, row by row.
fn centres() -> impl Iterator<Item = DVec2> {
    (0..81).map(|i| DVec2::new(f64::from(i % 9) + 0.5, f64::from(i / 9) + 0.5))
}

fn picture(hit: impl IntoIterator<Item = bool>) -> Vec<String> {
    let marks: Vec<char> = hit.into_iter().map(|h| if h { 'F' } else { '.' }).collect();
    marks.chunks(9).map(|row| row.iter().collect()).collect()
}

/// A LiDAR that fires through pixel centres.
struct Raster;

impl ScanPattern for Raster {
    fn pulse(&self, number: u64) -> Pulse {
        let centre = centres().nth(number as usize).expect("81 pulses");
        let optical = intrinsics().direction(centre);
        Pulse {
            time_s: number as f64 * 1e-5,
            direction: RigidTransform::body_from_optical().transform_vector(optical),
            ring: 0,
        }
    }

    fn rate_hz(&self) -> f64 {
        1e5
    }
}

/// The pictures of the letter by a caster and by both sensors with it.
fn pictures(
    caster: &dyn RayCaster,
    materials: &MaterialLibrary,
    body: RigidTransform,
) -> Vec<(&'static str, Vec<String>)> {
    let view = View::new(intrinsics(), body * RigidTransform::body_from_optical());
    let rays: Vec<_> = centres().map(|c| view.ray(c, 100.0)).collect();
    let mut batch = vec![None; rays.len()];
    caster.closest_hits(&rays, &mut batch);

    let light = Lighting::uniform(Vec3::splat(100.0));
    let camera = RayCastCamera::new(RayCastParams::draft(), light).expect("allowed");
    let scene = SceneView {
        caster,
        instances: None,
        materials,
        sky_visibility: &OpenSky,
        lamps: &[],
    };
    let images = camera
        .render(&scene, &view, Key::world(1))
        .expect("a picture");
    let truth = &images.truth;

    let params = ScannerParams {
        pulses_per_scan: 81,
        min_range_m: 0.0,
        max_range_m: 100.0,
        ..ScannerParams::default()
    };
    let scanner = Scanner::new(params, Box::new(Raster)).expect("allowed");
    let scan = scanner.scan(&ScanRequest {
        first_pulse: 0,
        caster,
        materials,
        scene_from_lidar_at: &|_| body,
        range_model: &ExactRange,
        key: Key::world(1),
    });
    let mut returned = [false; 81];
    for point in &scan {
        assert_eq!(point.semantic, Semantic::Leaf);
        returned[point.pulse as usize] = true;
    }

    let brightest = *images.rgb.pixels().iter().flatten().max().expect("pixels");
    vec![
        (
            "closest_hit",
            picture(rays.iter().map(|r| caster.closest_hit(r).is_some())),
        ),
        ("closest_hits", picture(batch.iter().map(Option::is_some))),
        (
            "is_occluded",
            picture(rays.iter().map(|r| caster.is_occluded(r))),
        ),
        (
            "semantic image",
            picture(truth.semantic.pixels().iter().map(|s| *s == Semantic::Leaf)),
        ),
        (
            "instance image",
            picture(truth.object.pixels().iter().map(|o| !o.is_none())),
        ),
        (
            "depth image",
            picture(
                truth
                    .depth_m
                    .pixels()
                    .iter()
                    .map(|d| (d - DISTANCE_M as f32).abs() < 1e-4),
            ),
        ),
        (
            "colour image",
            picture(images.rgb.pixels().iter().map(|p| p[1] < brightest / 2)),
        ),
        ("scan", picture(returned)),
    ]
}

#[test]
fn the_letter_f_is_the_same_for_everything_that_sees() {
    let mirrored = FACE.map(|row| row.chars().rev().collect::<String>());
    let face = FACE.map(str::to_owned);
    let (library, ink) = library();
    for (kind, shape) in [("card", as_card(ink)), ("triangles", as_triangles(ink))] {
        let groups = groups(shape, &library);
        let fast = RayScene::new(groups.clone());
        let portable = fast.clone().portable();
        let brute = BruteForce::new(groups);
        let casters: [(&str, &dyn RayCaster); 3] = [
            ("BVH", &fast),
            ("portable BVH", &portable),
            ("brute force", &brute),
        ];
        for (name, caster) in casters {
            for (body, expected) in bodies().into_iter().zip([&face, &mirrored]) {
                for (what, seen) in pictures(caster, &library, body) {
                    let seen = seen.join("\n");
                    assert_eq!(seen, expected.join("\n"), "{kind}, {name}: {what}\n{seen}");
                }
            }
        }
    }
}

#[test]
fn the_letter_f_is_the_same_on_a_gpu() {
    let Some(gpu) = nemoral_tests::gpu::gpu("the letter F") else {
        return;
    };
    let mirrored = FACE.map(|row| row.chars().rev().collect::<String>());
    let face = FACE.map(str::to_owned);
    let (library, ink) = library();
    let light = Lighting::uniform(Vec3::splat(100.0));
    let camera = GpuCamera::new(gpu, GpuParams::default(), light).unwrap_or_else(|e| panic!("{e}"));
    for (kind, shape) in [("card", as_card(ink)), ("triangles", as_triangles(ink))] {
        let forest = RayScene::new(groups(shape, &library));
        let scene = SceneView {
            caster: &forest,
            instances: Some(&forest),
            materials: &library,
            sky_visibility: &OpenSky,
            lamps: &[],
        };
        for (body, expected) in bodies().into_iter().zip([&face, &mirrored]) {
            let view = View::new(intrinsics(), body * RigidTransform::body_from_optical());
            let drawn = camera.draw(&scene, &view).unwrap_or_else(|e| panic!("{e}"));
            let pictures = [
                (
                    "semantic",
                    picture(
                        drawn
                            .truth
                            .semantic
                            .pixels()
                            .iter()
                            .map(|s| *s == Semantic::Leaf),
                    ),
                ),
                (
                    "instance",
                    picture(drawn.truth.object.pixels().iter().map(|o| !o.is_none())),
                ),
                (
                    "depth",
                    picture(
                        drawn
                            .truth
                            .depth_m
                            .pixels()
                            .iter()
                            .map(|d| (d - DISTANCE_M as f32).abs() < 1e-4),
                    ),
                ),
            ];
            for (what, seen) in pictures {
                assert_eq!(seen.join("\n"), expected.join("\n"), "{kind}: {what}");
            }
        }
    }
}
