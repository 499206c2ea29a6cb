//! The GPU's truth agrees with that of the ray-cast camera: each of the two renderers tests the
//! other.

#[path = "../../crates/render/examples/species_map/avenue.rs"]
mod avenue;

use std::sync::Arc;

use avenue::{Avenue, SPECIES};
use nemoral_pipeline::recording::scene::FrameScene;
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_render::{
    CameraRenderer, Gpu, GpuCamera, GpuError, GpuParams, Lighting, OpenSky, Pass, RayCastCamera,
    RayCastParams, SceneView, SkyImage, SkyParams, SkyVisibility, Sun, View,
};
use nemoral_scene::glam::{DVec2, DVec3, Mat3, Vec2, Vec3};
use nemoral_scene::{
    AlphaMask, Blend, Card, ChunkCoord, Distortion, Hit, Image, Instance, InstanceGroup,
    InstancePlace, InstancedScene, Intrinsics, Material, MaterialId, MaterialLibrary, Mesh,
    ObjectId, PlacedGroup, Prototype, Ray, RayCaster, RigidTransform, Semantic, Shutter, Triangle,
    TruthImages, Twist,
};
use nemoral_seed::{Domain, Draw, Key, PhiloxRng, Rng};
use nemoral_tests::World;
use nemoral_tests::gpu::{Agreement, gpu};

/// Least number of pixels of a class whose own share is tested.
const LEAST: usize = 300;

fn camera(gpu: &Gpu, params: GpuParams) -> GpuCamera {
    GpuCamera::new(gpu, params, Lighting::uniform(Vec3::ONE)).unwrap_or_else(|e| panic!("{e}"))
}

fn cast(scene: &SceneView<'_>, view: &View) -> TruthImages {
    let camera = RayCastCamera::new(RayCastParams::draft(), Lighting::uniform(Vec3::ONE));
    let images = camera.expect("allowed").render(scene, view, Key::world(1));
    images.expect("a picture").truth
}

/// A random forest in two chunks: sloping planes of ground, masked cards and triangles, rotated,
/// sheared and mirrored.
struct RandomForest {
    materials: MaterialLibrary,
    forest: RayScene,
}

/// A random mask of blobs of some texels, with borders everywhere.
fn mask(rng: &mut PhiloxRng, width: usize, height: usize) -> AlphaMask {
    let salt = rng.next_u32();
    let blob = |c: usize, r: usize| {
        let h = (c as u32 / 3).wrapping_mul(0x9E37_79B1) ^ (r as u32 / 4).wrapping_mul(salt | 1);
        (h ^ h >> 15).wrapping_mul(0x85EB_CA6B) >> 31 == 0
    };
    AlphaMask::from_fn(width, height, blob).expect("allowed")
}

impl RandomForest {
    fn new(seed: u64, change: impl Fn(AlphaMask) -> AlphaMask) -> Self {
        let mut rng = Key::world(seed).domain(Domain::new("test.wood")).rng();
        let rng = &mut rng;
        let mut materials = MaterialLibrary::new();
        let mut floor = |name, albedo| {
            materials.add(Material {
                ground: true,
                ..Material::plain(name, Semantic::Soil, albedo)
            })
        };
        let soil = floor("soil", Vec3::splat(0.2));
        let moss = floor("moss", Vec3::new(0.02, 0.1, 0.02));
        let bark = materials.add(Material::plain("bark", Semantic::Stem, Vec3::splat(0.1)));
        let leaf = |rng: &mut PhiloxRng, semantic, width, height| Material {
            mask: Some(Arc::new(change(mask(rng, width, height)))),
            ..Material::plain("leaf", semantic, Vec3::splat(0.3))
        };
        let leaves = [
            materials.add(leaf(rng, Semantic::Leaf, 37, 64)),
            materials.add(leaf(rng, Semantic::Grass, 64, 31)),
        ];
        let shapes: Vec<Arc<Blas>> = (0..6)
            .map(|_| plant(rng, bark, leaves, &materials))
            .collect();
        let ground = ground(rng, [soil, moss], &materials);
        let group = |chunk: i32, rng: &mut PhiloxRng| {
            let mut instances = vec![placed(&ground, Vec3::ZERO, Mat3::IDENTITY, ObjectId::NONE)];
            for item in 1..=30_u16 {
                let at = Vec3::new(50.0 * unit(rng), 50.0 * unit(rng), 2.0 * unit(rng));
                let turn = Mat3::from_rotation_z(6.3 * unit(rng));
                let shear = Mat3::from_cols(Vec3::X, Vec3::Y, Vec3::new(0.2, -0.1, 1.1));
                let mirror = Mat3::from_diagonal(Vec3::new(-0.9, 1.2, 1.0));
                let linear = if item % 3 == 0 {
                    turn * mirror
                } else {
                    shear * turn
                };
                let shape = &shapes[rng.next_u32() as usize % shapes.len()];
                let object = ObjectId::new(ChunkCoord::new(chunk, 3), item);
                instances.push(placed(shape, at, linear, object.expect("in range")));
            }
            Arc::new(Group::build(instances))
        };
        let groups = vec![
            (Vec3::new(-50.0, -25.0, 0.0), group(-1, rng)),
            (Vec3::new(0.0, -25.0, 0.0), group(0, rng)),
        ];
        Self {
            materials,
            forest: RayScene::new(groups),
        }
    }

    fn scene(&self) -> SceneView<'_> {
        SceneView {
            caster: &self.forest,
            instances: Some(&self.forest),
            materials: &self.materials,
            sky_visibility: &OpenSky,
        }
    }
}

fn unit(rng: &mut PhiloxRng) -> f32 {
    rng.unit_f64() as f32
}

fn placed(
    shape: &Arc<Blas>,
    position_m: Vec3,
    linear: Mat3,
    object: ObjectId,
) -> (InstancePlace, Arc<Blas>) {
    let instance = InstancePlace {
        position_m,
        linear,
        object,
        variation: 0.5,
    };
    (instance, Arc::clone(shape))
}

fn shape(mesh: Mesh, cards: Vec<Card>, materials: &MaterialLibrary) -> Arc<Blas> {
    let shape = Prototype::new("shape", mesh, cards, materials).expect("a sound shape");
    Arc::new(Blas::build(Arc::new(shape), materials))
}

/// A six-sided trunk of triangles with cards around its top and masked triangles at its foot.
fn plant(
    rng: &mut PhiloxRng,
    bark: MaterialId,
    leaves: [MaterialId; 2],
    materials: &MaterialLibrary,
) -> Arc<Blas> {
    let mut mesh = Mesh::default();
    let mut add = |p: Vec3, uv: Vec2| {
        mesh.positions.push(p);
        mesh.normals.push(p.with_z(0.1).normalize_or(Vec3::Z));
        mesh.uvs.push(uv);
        mesh.positions.len() as u32 - 1
    };
    let (height, radius) = (2.0 + 4.0 * unit(rng), 0.1 + 0.3 * unit(rng));
    let mut triangles = Vec::new();
    for k in 0..6 {
        let at = |k: i32, z: f32| {
            let angle = k as f32 * std::f32::consts::FRAC_PI_3;
            Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
        };
        let q = [at(k, 0.0), at(k + 1, 0.0), at(k + 1, height), at(k, height)]
            .map(|p| add(p, Vec2::new(p.x, p.z)));
        for corners in [[q[0], q[1], q[2]], [q[0], q[2], q[3]]] {
            let material = bark;
            triangles.push(Triangle { corners, material });
        }
    }
    for _ in 0..12 {
        let mut corner = || Vec3::new(unit(rng) * 2.0 - 1.0, unit(rng) * 2.0 - 1.0, unit(rng));
        let corners = [
            add(corner(), Vec2::ZERO),
            add(corner(), Vec2::X),
            add(corner(), Vec2::ONE),
        ];
        let material = leaves[1];
        triangles.push(Triangle { corners, material });
    }
    mesh.triangles = triangles;
    let cards = (0..60)
        .map(|_| {
            let mut any = |size: f32| {
                Vec3::from_array(std::array::from_fn(|_| size * (2.0 * unit(rng) - 1.0)))
            };
            Card {
                corner: any(1.5) + Vec3::Z * height,
                edge_u: any(0.6),
                edge_v: any(0.6),
                material: leaves[0],
            }
        })
        .collect();
    shape(mesh, cards, materials)
}

/// A chunk of bumpy ground, soil in the south and moss in the north, with a broad border of both.
fn ground(
    rng: &mut PhiloxRng,
    [soil, moss]: [MaterialId; 2],
    materials: &MaterialLibrary,
) -> Arc<Blas> {
    const SIDE: u32 = 25;
    let mut mesh = Mesh::default();
    for i in 0..=SIDE {
        for j in 0..=SIDE {
            // The borders are level, so that chunks fit together.
            let inner = (1..SIDE).contains(&i) && (1..SIDE).contains(&j);
            let z = if inner { unit(rng) } else { 0.5 };
            mesh.positions
                .push(Vec3::new(2.0 * i as f32, 2.0 * j as f32, z));
            mesh.normals.push(Vec3::Z);
            mesh.uvs.push(Vec2::new(2.0 * i as f32, 2.0 * j as f32));
        }
    }
    for i in 0..SIDE {
        for j in 0..SIDE {
            let k = i * (SIDE + 1) + j;
            for corners in [[k, k + SIDE + 1, k + SIDE + 2], [k, k + SIDE + 2, k + 1]] {
                let (material, other) = if j <= SIDE / 2 {
                    (soil, moss)
                } else {
                    (moss, soil)
                };
                let shares = corners.map(|corner| {
                    let north =
                        ((corner % (SIDE + 1)) as f32 / SIDE as f32 * 1.5 - 0.25).clamp(0.0, 1.0);
                    if material == moss { 1.0 - north } else { north }
                });
                mesh.triangles.push(Triangle { corners, material });
                mesh.blends.push(Blend { other, shares });
            }
        }
    }
    shape(mesh, Vec::new(), materials)
}

/// A view from the edge of the forest into it.
fn view(width: u32, height: u32) -> View {
    let k = Intrinsics::from_fov(width, height, 1.3).expect("valid");
    let body = RigidTransform::from_xyz_rpy(DVec3::new(-45.3, 1.7, 2.9), 0.02, 0.03, 0.05);
    View::new(k, body * RigidTransform::body_from_optical())
}

#[test]
fn random_forests_are_the_same_for_both_renderers() {
    let Some(gpu) = gpu("random forests") else {
        return;
    };
    let camera = camera(gpu, GpuParams::default());
    for seed in 0..4 {
        let forest = RandomForest::new(seed, |m| m);
        // The width is no multiple of a row of 256 bytes.
        let view = view(403, 301);
        let drawn = camera
            .draw(&forest.scene(), &view)
            .unwrap_or_else(|e| panic!("{e}"));
        let agreement = Agreement::of(&cast(&forest.scene(), &view), &drawn.truth);
        println!("forest {seed}: {agreement}");
        assert!(agreement.is_right(LEAST), "{seed}: {agreement}");
    }
}

/// Views from the same place through other lenses and shutters.
fn bent_views() -> Vec<(&'static str, View)> {
    let straight = view(403, 301);
    let through = |fov_rad: f64, lens: Distortion| View {
        intrinsics: Intrinsics::through_lens(403, 301, fov_rad, lens).expect("a sound lens"),
        ..straight
    };
    let brown = |k1, k2, p1, p2| Distortion::BrownConrady {
        k1,
        k2,
        k3: 0.0,
        p1,
        p2,
    };
    let fisheye = |k1, k2| Distortion::Fisheye {
        k1,
        k2,
        k3: 0.0,
        k4: 0.0,
    };
    let moving = |view: View| View {
        shutter: Shutter {
            exposure_s: 0.01,
            readout_s: 0.03,
        },
        motion: Twist {
            linear_m_s: DVec3::new(-0.4, 0.1, 2.0),
            angular_rad_s: DVec3::new(0.5, 1.2, -0.7),
        },
        ..view
    };
    let barrel = through(1.7, brown(-0.2, 0.03, 0.002, -0.001));
    let wide = through(2.3, fisheye(-0.01, 0.0));
    vec![
        ("a barrel", barrel),
        ("a pincushion", through(1.2, brown(0.3, 0.1, 0.0, 0.003))),
        ("a fisheye", wide),
        ("a narrow fisheye", through(0.8, fisheye(0.1, -0.05))),
        ("a rolling shutter", moving(straight)),
        ("a rolling barrel", moving(barrel)),
        ("a rolling fisheye", moving(wide)),
    ]
}

#[test]
fn lenses_and_shutters_bend_both_renderers_alike() {
    let Some(gpu) = gpu("lenses and shutters") else {
        return;
    };
    let camera = camera(gpu, GpuParams::default());
    for seed in [2, 3] {
        let forest = RandomForest::new(seed, |m| m);
        for (what, view) in bent_views() {
            let drawn = camera.draw(&forest.scene(), &view);
            let drawn = drawn.unwrap_or_else(|e| panic!("{e}")).truth;
            let right = cast(&forest.scene(), &view);
            let agreement = Agreement::of(&right, &drawn);
            println!("{what}, forest {seed}: {agreement}");
            assert!(agreement.is_right(LEAST), "{what}, {seed}: {agreement}");
            // Without the lens or shutter nothing agrees.
            let straight = View {
                intrinsics: view
                    .intrinsics
                    .with_distortion(Distortion::None)
                    .expect("none"),
                shutter: Shutter::INSTANT,
                ..view
            };
            let straight = camera.draw(&forest.scene(), &straight);
            let straight = Agreement::of(&right, &straight.unwrap_or_else(|e| panic!("{e}")).truth);
            assert!(!straight.is_right(LEAST), "{what}: {straight}");
        }
    }
}

#[test]
fn what_is_wrong_is_found() {
    let Some(gpu) = gpu("sabotage") else { return };
    let camera = camera(gpu, GpuParams::default());
    let forest = RandomForest::new(7, |m| m);
    let view = view(400, 300);
    let right = cast(&forest.scene(), &view);
    let found = |what: &str, truth: &TruthImages| {
        let agreement = Agreement::of(&right, truth);
        println!("{what}: {agreement}");
        assert!(!agreement.is_right(LEAST), "{what}: {agreement}");
    };
    let draw = |scene: &SceneView<'_>, view: &View| {
        camera
            .draw(scene, view)
            .unwrap_or_else(|e| panic!("{e}"))
            .truth
    };
    let drawn = draw(&forest.scene(), &view);
    assert!(Agreement::of(&right, &drawn).is_right(LEAST));

    // These masks have a rim of one texel too much.
    let wide = RandomForest::new(7, |m| {
        let grown = |c: usize, r: usize| m.texel(c, r) || (c > 0 && m.texel(c - 1, r));
        AlphaMask::from_fn(m.width(), m.height(), grown).expect("as large")
    });
    found("a wrong cut-off", &draw(&wide.scene(), &view));

    let mut shifted = view;
    shifted.intrinsics.cx += 0.5;
    found("half a pixel", &draw(&forest.scene(), &shifted));

    let mut filtered = drawn.clone();
    filtered.semantic = majority(&drawn.semantic);
    found("a filtered label", &filtered);
}

/// The most frequent of 3 × 3 pixels.
fn majority(image: &Image<Semantic>) -> Image<Semantic> {
    let (w, h) = (image.width(), image.height());
    let pixel = |i: usize| {
        let (x, y) = (i % w, i / w);
        let mut counts = [0_u8; 256];
        for v in y.saturating_sub(1)..(y + 2).min(h) {
            for u in x.saturating_sub(1)..(x + 2).min(w) {
                counts[usize::from(*image.at(u, v) as u8)] += 1;
            }
        }
        let most = (0..=255_u8).max_by_key(|&s| counts[usize::from(s)]);
        most.and_then(Semantic::from_u8).expect("one of the image")
    };
    Image::new(w, h, (0..w * h).map(pixel).collect())
}

/// A square of 512 m around a point, spanned by two axes, in cells of 4 m.
fn plane(foot: Vec3, u: Vec3, v: Vec3) -> RandomForest {
    const SIDE: u32 = 128;
    let mut materials = MaterialLibrary::new();
    let material = materials.add(Material::plain("wall", Semantic::Rock, Vec3::ONE));
    let at = |k: u32| (k as f32 - 0.5 * SIDE as f32) * 4.0;
    let mut mesh = Mesh::default();
    for k in 0..(SIDE + 1) * (SIDE + 1) {
        mesh.positions
            .push(at(k % (SIDE + 1)) * u + at(k / (SIDE + 1)) * v);
        mesh.normals.push(Vec3::Z);
        mesh.uvs.push(Vec2::ZERO);
    }
    for k in (0..SIDE).flat_map(|row| (0..SIDE).map(move |c| row * (SIDE + 1) + c)) {
        let up = k + SIDE + 1;
        for corners in [[k, k + 1, up + 1], [k, up + 1, up]] {
            mesh.triangles.push(Triangle { corners, material });
        }
    }
    let shape = shape(mesh, Vec::new(), &materials);
    let instance = placed(&shape, foot, Mat3::IDENTITY, ObjectId::NONE);
    RandomForest {
        materials,
        forest: RayScene::new(vec![(Vec3::ZERO, Arc::new(Group::build(vec![instance])))]),
    }
}

#[test]
fn depth_is_right_to_a_millimetre_up_to_100_m() {
    let Some(gpu) = gpu("closed forms of depth") else {
        return;
    };
    let camera = camera(gpu, GpuParams::default());
    let k = Intrinsics::from_fov(320, 240, 1.2).expect("valid");
    let pose = RigidTransform::from_xyz_rpy(DVec3::new(0.4, -0.3, 0.2), 0.1, -0.05, 0.7)
        * RigidTransform::body_from_optical();
    let view = View::new(k, pose);
    // The numbers are exact in f32, so that the planes are in their exact places.
    let planes = [
        (
            "ground 1.5 m below",
            Vec3::new(0.0, 0.0, -1.25),
            Vec3::X,
            Vec3::Y,
        ),
        (
            "ground that falls",
            Vec3::new(0.0, 0.0, -1.5),
            Vec3::new(1.0, 0.0, -0.0625),
            Vec3::Y,
        ),
        (
            "a wall at 20 m",
            Vec3::new(20.0, 20.0, 0.0),
            Vec3::new(1.0, -1.0, 0.0),
            Vec3::Z,
        ),
        (
            "a wall at 90 m",
            Vec3::new(64.0, 64.0, 0.0),
            Vec3::new(1.0, -1.0, 0.0),
            Vec3::Z,
        ),
        (
            "a wall along the way",
            Vec3::new(0.0, 2.0, 0.0),
            Vec3::new(1.0, 0.75, 0.0),
            Vec3::Z,
        ),
    ];
    for (what, foot, u, v) in planes {
        let forest = plane(foot, u, v);
        let drawn = camera
            .draw(&forest.scene(), &view)
            .unwrap_or_else(|e| panic!("{e}"));
        let normal = u.as_dvec3().cross(v.as_dvec3());
        let (mut worst, mut seen) = (0.0_f64, 0);
        for (i, depth_m) in drawn.truth.depth_m.pixels().iter().enumerate() {
            let pixel = DVec2::new((i % 320) as f64 + 0.5, (i / 320) as f64 + 0.5);
            let optical = k.direction(pixel);
            let ray = pose.transform_vector(optical) / optical.z;
            let exact = normal.dot(foot.as_dvec3() - pose.translation_m) / normal.dot(ray);
            if *depth_m > 0.0 && exact <= 100.0 {
                worst = worst.max((f64::from(*depth_m) - exact).abs());
                seen += 1;
            }
        }
        println!("{what}: worst of {seen} pixels {:.3} mm", 1e3 * worst);
        assert!(worst < 1e-3 && seen > 10_000, "{what}: {worst} m of {seen}");
    }
}

/// A frame of the pipeline for both renderers.
struct Frame {
    assets: Arc<WorldAssets>,
    scene: Arc<FrameScene>,
    view: View,
}

impl Frame {
    fn new(world: &World, frame: u64) -> Self {
        let (forest, runner) = (&world.forest, world.runner(2));
        let rig = &runner.get(forest.cameras, ()).expect("cameras")[0];
        let pose = runner.get(forest.pose, frame).expect("a pose");
        let scene = runner.get(forest.scene, frame).expect("a scene");
        let body = pose.track.relative_to(scene.origin_m).middle();
        Self {
            assets: runner.get(forest.assets, ()).expect("assets"),
            view: View::new(rig.intrinsics, body * rig.body_from_camera),
            scene,
        }
    }

    fn scene(&self) -> SceneView<'_> {
        SceneView {
            caster: &*self.scene.caster,
            instances: Some(&*self.scene),
            materials: &self.assets.library.materials,
            sky_visibility: &OpenSky,
        }
    }
}

#[test]
fn the_three_presets_are_the_same_for_both_renderers() {
    let Some(gpu) = gpu("low, medium and high") else {
        return;
    };
    let camera = camera(gpu, GpuParams::default());
    for preset in ["low", "medium", "high"] {
        // The presets keep their range and resolution. A software renderer's time is that of
        // vertices, not of pixels.
        let frame = Frame::new(&World::new(preset, &[]), 0);
        let drawn = camera
            .draw(&frame.scene(), &frame.view)
            .unwrap_or_else(|e| panic!("{e}"));
        let agreement = Agreement::of(&cast(&frame.scene(), &frame.view), &drawn.truth);
        println!("{preset}: {agreement}");
        assert!(agreement.is_right(LEAST), "{preset}: {agreement}");
    }
}

/// Crowns that close and open within some metres, and let in more light at greater heights. They
/// change as fast as the pipeline's sky view factor can, which has a node every five metres.
fn crowns(p: Vec3) -> f32 {
    let gaps = (0.4 * p.x).sin() * (0.5 * p.y).cos();
    (0.35 + 0.3 * gaps + 0.03 * p.z).clamp(0.0, 1.0)
}

#[test]
fn pictures_look_alike() {
    let Some(gpu) = gpu("lit pictures") else {
        return;
    };
    let sun = Sun::from_angles(130.0, 40.0).expect("valid");
    let clear = Lighting::new(&sun, &SkyParams::default()).expect("valid");
    // Low fog and haze, under a photographed sky that is bright in the east.
    let fog = SkyParams {
        visibility_m: 300.0,
        fog_per_m: 0.05,
        fog_base_m: -1.0,
        fog_height_m: 3.0,
        ..SkyParams::default()
    };
    let pixel = |i: usize| Vec3::new(1.0, 1.2, 1.5) * if i % 64 < 32 { 1.0 } else { 4.0 };
    let photograph = Image::new(64, 32, (0..64 * 32).map(pixel).collect());
    let photograph = SkyImage::new(&photograph, 0.0).expect("a sky");
    let fog = Lighting::photographed(&sun, &fog, &photograph, 0.8).expect("valid");
    // These are a lens, and a moving camera with an exposure time and a rolling shutter.
    let wide = Intrinsics::through_lens(
        320,
        240,
        2.2,
        Distortion::Fisheye {
            k1: 0.01,
            k2: 0.0,
            k3: 0.0,
            k4: 0.0,
        },
    );
    let wide = View {
        intrinsics: wide.expect("a sound lens"),
        ..view(320, 240)
    };
    let blurred = |view: View, readout_s: f64| View {
        shutter: Shutter {
            exposure_s: 0.05,
            readout_s,
        },
        motion: Twist {
            linear_m_s: DVec3::new(1.0, 0.0, 1.0),
            angular_rad_s: DVec3::new(0.0, 0.5, 1.5),
        },
        ..view
    };
    let standard = GpuParams::default();
    // One sample per pixel gives the same light, with more noise.
    let draft = GpuParams {
        colour_samples: 1,
        ..standard
    };
    let plain = view(320, 240);
    let overcast = SkyParams {
        overcast: 1.0,
        ..SkyParams::default()
    };
    let overcast = Lighting::new(&sun, &overcast).expect("valid");
    let (open, crowns): (&dyn SkyVisibility, &dyn SkyVisibility) = (&OpenSky, &crowns);
    for (what, params, lighting, sky, view) in [
        ("clear", standard, &clear, open, plain),
        ("fog", standard, &fog, open, plain),
        ("a fisheye", standard, &clear, open, wide),
        ("a draft", draft, &clear, open, plain),
        ("a blur", standard, &clear, open, blurred(plain, 0.0)),
        (
            "a blurred fisheye",
            standard,
            &clear,
            open,
            blurred(wide, 0.03),
        ),
        ("overcast under crowns", standard, &overcast, crowns, plain),
        ("fog under crowns", standard, &fog, crowns, plain),
    ] {
        let (median, most, exposure) = difference(gpu, params, lighting, [sky; 2], &view);
        println!("{what}: {median} in the median, {most} at the 95th percentile");
        assert!(median < 0.015 && most < 0.1, "{what}: {median} {most}");
        assert!(exposure < 0.1, "{what}: {exposure} EV");
    }
    // Crowns that are displaced by a step of the finest grid of sky view factors are detected.
    let beside = |p: Vec3| crowns.sky_view_factor(p + Vec3::X * 1.5);
    let (median, most, _) = difference(gpu, draft, &overcast, [crowns, &beside], &plain);
    println!("crowns beside: {median} in the median, {most} at the 95th percentile");
    assert!(median > 0.03 && most > 0.2, "{median} {most}");
}

#[test]
fn pictures_of_two_threads_are_those_taken_in_turn() {
    let Some(gpu) = gpu("pictures at once") else {
        return;
    };
    let sun = Sun::from_angles(130.0, 40.0).expect("valid");
    let light = Lighting::new(&sun, &SkyParams::default()).expect("valid");
    let camera = GpuCamera::new(gpu, GpuParams::default(), light);
    let camera = camera.unwrap_or_else(|e| panic!("{e}"));
    // These are two scenes, so that instances come and go.
    let forests = [5, 6].map(|seed| RandomForest::new(seed, |m| m));
    let take = |i: usize| {
        let mut view = view(160, 96 + 8 * (i % 3) as u32);
        view.scene_from_camera.translation_m.x += i as f64;
        let images = camera.render(&forests[i / 2 % 2].scene(), &view, Key::world(1));
        images.unwrap_or_else(|e| panic!("{e}"))
    };
    let in_turn: Vec<_> = (0..8).map(take).collect();
    let memory = camera.memory().bytes;
    let at_once: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|i| scope.spawn(move || take(i))).collect();
        threads
            .into_iter()
            .map(|t| t.join().expect("a picture"))
            .collect()
    });
    assert!(in_turn == at_once);
    assert!(in_turn[0].truth != in_turn[2].truth);
    // Temporary buffers are given back.
    take(7);
    assert_eq!(camera.memory().bytes, memory);
}

/// The relative difference of the two renderers' light in blocks of 16 pixels, as median and 95th
/// percentile, and the difference of their exposures, EV. Each renderer has its own crowns before
/// the sky.
fn difference(
    gpu: &Gpu,
    params: GpuParams,
    lighting: &Lighting,
    [of_cast, of_drawn]: [&dyn SkyVisibility; 2],
    view: &View,
) -> (f32, f32, f32) {
    let fine = RayCastParams {
        keep_linear: true,
        blur_samples: 36,
        ..RayCastParams::fine()
    };
    let cast = RayCastCamera::new(fine, lighting.clone()).expect("allowed");
    let params = GpuParams {
        keep_linear: true,
        ..params
    };
    let draw = GpuCamera::new(gpu, params, lighting.clone()).unwrap_or_else(|e| panic!("{e}"));
    let forest = RandomForest::new(5, |m| m);
    let under = |sky_visibility| SceneView {
        sky_visibility,
        ..forest.scene()
    };
    let a = cast.render(&under(of_cast), view, Key::world(1));
    let a = a.expect("a picture");
    let b = draw.render(&under(of_drawn), view, Key::world(1));
    let b = b.unwrap_or_else(|e| panic!("{e}"));
    assert!(Agreement::of(&a.truth, &b.truth).is_right(LEAST));
    let exposure = (a.ev100 - b.ev100).abs() as f32;
    // Blocks of 16 pixels are compared, as the renderers sample penumbrae and silhouettes
    // differently.
    let blocks = |image: &Image<Vec3>| -> Vec<Vec3> {
        let mean = |i: usize| {
            let (left, top) = (i % 20 * 16, i / 20 * 16);
            let pixels = (0..256).map(|k| *image.at(left + k % 16, top + k / 16));
            pixels.sum::<Vec3>() / 256.0
        };
        (0..300).map(mean).collect()
    };
    let [a, b] = [a, b].map(|i| blocks(&i.linear.expect("asked for")));
    let mut differences: Vec<f32> = a
        .iter()
        .zip(&b)
        .map(|(a, b)| (*a - *b).abs().max_element() / a.max_element())
        .collect();
    differences.sort_by(f32::total_cmp);
    (differences[150], differences[285], exposure)
}

/// The map of `species_map`, an example of a user's pass with the public interface of `render`, has
/// the species that rays hit.
#[test]
fn the_examples_species_map_is_what_rays_hit() {
    let Some(gpu) = gpu("the example species_map") else {
        return;
    };
    let avenue = Avenue::new().expect("trees");
    let view = Avenue::view(640, 360).expect("a view");
    let drawn = avenue.draw(gpu, &view).unwrap_or_else(|e| panic!("{e}"));
    let trees = avenue.trees.0.iter().map(|tree| {
        let shape = Blas::build(Arc::clone(&tree.prototype), &avenue.materials);
        (tree.place(), Arc::new(shape))
    });
    let group = Arc::new(Group::build(trees.collect()));
    let forest = RayScene::new(vec![(Vec3::ZERO, group)]);
    let scene = SceneView {
        caster: &forest,
        instances: Some(&forest),
        materials: &avenue.materials,
        sky_visibility: &OpenSky,
    };
    let agreement = Agreement::of(&cast(&scene, &view), &drawn.truth);
    assert!(agreement.is_right(LEAST), "{agreement}");

    // By species that was hit: its pixels, and those with its number in the map. The first entry is
    // for what is no tree.
    let mut species = [(0, 0); SPECIES.len() + 1];
    for (i, texel) in drawn.passes[0].pixels().iter().enumerate() {
        let centre = DVec2::new((i % 640) as f64 + 0.5, (i / 640) as f64 + 0.5);
        let hit = forest.closest_hit(&view.ray(centre, 300.0));
        let number = hit.map_or(0, |hit| {
            let name = &avenue.materials.get(hit.surface.material).name;
            let is_its = |s: &&str| name.starts_with(*s);
            1 + SPECIES.iter().position(is_its).expect("a tree's material")
        });
        let (all, equal) = &mut species[number];
        *all += 1;
        *equal += usize::from(texel[0] as usize == number);
    }
    println!("pixels and those that agree, of no tree and of {SPECIES:?}: {species:?}");
    for (all, equal) in species {
        assert!(
            all >= 1000 && equal as f64 >= 0.999 * all as f64,
            "{species:?}"
        );
    }
}

/// A user's pass that writes the material's entry of a table, its number and its class.
#[derive(Debug)]
struct MaterialMap;

impl Pass for MaterialMap {
    fn name(&self) -> &str {
        "material map"
    }

    fn wgsl(&self) -> &str {
        "fn paint(s: Surface) -> vec4u { return vec4u(table[s.material], s.material, s.semantic, \
         1u); }"
    }

    fn table(&self, materials: &MaterialLibrary) -> Vec<u32> {
        (0..materials.materials().len() as u32)
            .map(|i| 1000 + i)
            .collect()
    }
}

#[test]
fn a_pass_from_outside_sees_what_the_truth_sees() {
    let Some(gpu) = gpu("a user's pass") else {
        return;
    };
    let camera = camera(gpu, GpuParams::default());
    camera
        .add_pass(Box::new(MaterialMap))
        .unwrap_or_else(|e| panic!("{e}"));
    let forest = RandomForest::new(3, |m| m);
    let drawn = camera
        .draw(&forest.scene(), &view(160, 96))
        .unwrap_or_else(|e| panic!("{e}"));
    let truth = drawn.truth.semantic.pixels();
    for (semantic, &[name, material, number, one]) in truth.iter().zip(drawn.passes[0].pixels()) {
        assert_eq!(u32::from(*semantic as u8), number);
        match one {
            0 => assert_eq!(*semantic, Semantic::Sky),
            _ => assert_eq!(name, 1000 + material),
        }
    }

    #[derive(Debug)]
    struct Broken;
    impl Pass for Broken {
        fn name(&self) -> &str {
            "broken"
        }
        fn wgsl(&self) -> &str {
            "fn paint(s: Surface) -> vec4f { return nothing; }"
        }
        fn table(&self, _: &MaterialLibrary) -> Vec<u32> {
            Vec::new()
        }
    }
    let error = camera.add_pass(Box::new(Broken)).expect_err("no shader");
    assert!(
        matches!(&error, GpuError::Shader { pass, .. } if pass == "broken"),
        "{error}"
    );
    assert!(error.to_string().contains("nothing"), "{error}");
}

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
