//! The GPU's truth agrees with that of the ray-cast camera: each of the two renderers tests the
//! other.

use std::sync::Arc;

use nemoral_pipeline::recording::scene::FrameScene;
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_raycast::{Group, RayScene};
use nemoral_render::{GpuParams, OpenSky, SceneView, View};
use nemoral_scene::glam::{DVec2, DVec3, Mat3, Vec2, Vec3};
use nemoral_scene::{
    AlphaMask, Distortion, Image, Intrinsics, Material, MaterialLibrary, Mesh, ObjectId,
    RigidTransform, Semantic, Shutter, Triangle, TruthImages, Twist,
};
use nemoral_tests::World;
use nemoral_tests::gpu::{Agreement, gpu};

use super::common::{LEAST, RandomForest, camera, cast, placed, shape, view};

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
    lenses_and_shutters(&[("a barrel", 2), ("a rolling fisheye", 3)]);
}

#[test]
#[ignore = "takes long: for .ci/full"]
fn all_lenses_and_shutters_bend_both_renderers_alike() {
    let all = bent_views();
    let names = all.iter().map(|(what, _)| *what);
    lenses_and_shutters(
        &names
            .flat_map(|what| [(what, 2), (what, 3)])
            .collect::<Vec<_>>(),
    );
}

/// Compares the renderers through named views into the forests of seeds.
fn lenses_and_shutters(cases: &[(&str, u64)]) {
    let Some(gpu) = gpu("lenses and shutters") else {
        return;
    };
    let camera = camera(gpu, GpuParams::default());
    for &(name, seed) in cases {
        let forest = RandomForest::new(seed, |m| m);
        for (what, view) in bent_views().into_iter().filter(|(what, _)| *what == name) {
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
            lamps: &[],
        }
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_preset_is_the_same_for_both_renderers() {
    // A quarter of what is in view otherwise.
    let near = [
        "chunks.visible_radius_m=50",
        "chunks.undergrowth_radius_m=50",
    ];
    presets(&["medium"], &near);
}

#[test]
#[ignore = "takes long: for .ci/full"]
fn a_whole_forest_floor_is_the_same_for_both_renderers() {
    let thick = [
        "chunks.visible_radius_m=30",
        "chunks.undergrowth_radius_m=30",
        "climbers.ivy=0.3",
        "climbers.honeysuckle=0.5",
        "climbers.clematis=0.5",
        "deadwood.volume_m3_ha=40",
    ];
    presets(&["oak-mixed", "maritime-pine", "meadow-edge"], &thick);
}

#[test]
#[ignore = "takes long: for .ci/full"]
fn the_three_presets_are_the_same_for_both_renderers() {
    presets(&["low", "medium", "high"], &[]);
}

fn presets(presets: &[&str], settings: &[&str]) {
    let Some(gpu) = gpu("presets") else { return };
    let camera = camera(gpu, GpuParams::default());
    for preset in presets {
        // The presets keep their resolution. A software renderer's time is that of vertices, not of
        // pixels.
        let frame = Frame::new(&World::new(preset, settings), 0);
        let drawn = camera
            .draw(&frame.scene(), &frame.view)
            .unwrap_or_else(|e| panic!("{e}"));
        let agreement = Agreement::of(&cast(&frame.scene(), &frame.view), &drawn.truth);
        println!("{preset}: {agreement}");
        assert!(agreement.is_right(LEAST), "{preset}: {agreement}");
    }
}
