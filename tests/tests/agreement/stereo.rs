//! Several cameras on one robot see the same world: at a place that one camera sees, the others see
//! the same or something in front of it; and disparity follows from the baseline.

use std::sync::Arc;

use nemoral_pipeline::recording::scene::FrameScene;
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_pipeline::world::cameras::CameraRig;
use nemoral_render::{CameraImages, OpenSky, SceneView, View};
use nemoral_scene::RigidTransform;
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_tests::World;

const BASELINE_M: f64 = 0.12;

/// A world with a right stereo camera beside the camera, and with one that looks aside.
fn world() -> World {
    World::new(
        "demo",
        &[
            "camera.width_px=320",
            "camera.height_px=180",
            "cameras.right.mount_y_m=-0.12",
            "cameras.side.mount_yaw_deg=35",
            "cameras.side.mount_pitch_deg=-8",
            "cameras.side.width_px=240",
            "lidar.pulses=10",
        ],
    )
}

struct Frame {
    scene: Arc<FrameScene>,
    assets: Arc<WorldAssets>,
    scene_from_body: RigidTransform,
}

/// A camera with its pictures.
struct Eye<'a> {
    rig: &'a CameraRig,
    /// The declared pose of the camera.
    body_from_camera: RigidTransform,
    images: &'a CameraImages,
}

/// The comparison of one camera's pixels with another camera.
#[derive(Debug, Default)]
struct Compared {
    /// Pixels whose places are in the other's image.
    all: usize,
    /// Pixels whose place the other sees, to a millimetre in ten metres.
    seen: usize,
    /// Of these, pixels with another class or object.
    other: usize,
    /// Pixels where the other sees past the place, through the surface there.
    past: usize,
}

/// Takes every pixel of `a` to its place in the world, and casts from `b` to that place, at its
/// exact image position.
fn compare(frame: &Frame, a: &Eye<'_>, b: &Eye<'_>) -> Compared {
    let scene = SceneView {
        caster: &*frame.scene.caster,
        instances: Some(&*frame.scene),
        materials: &frame.assets.library.materials,
        sky_visibility: &OpenSky,
        lamps: &[],
    };
    let view = View::new(
        b.rig.intrinsics,
        frame.scene_from_body * b.rig.body_from_camera,
    );
    let b_from_a = b.body_from_camera.inverse() * a.body_from_camera;
    let (truth, k) = (&a.images.truth, &b.rig.intrinsics);
    let renderer = b.rig.renderer.ray_cast().expect("the CPU's");
    let mut out = Compared::default();
    for row in 0..truth.depth_m.height() {
        for column in 0..truth.depth_m.width() {
            let depth_m = f64::from(*truth.depth_m.at(column, row));
            if depth_m == 0.0 {
                continue;
            }
            let pixel = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            let direction = a.rig.intrinsics.direction(pixel);
            let there = b_from_a.transform_point(direction * (depth_m / direction.z));
            let Some(at) = k.project(there) else {
                continue;
            };
            let size = DVec2::new(f64::from(k.width), f64::from(k.height));
            if !(at.cmpge(DVec2::ZERO).all() && at.cmplt(size).all()) {
                continue;
            }
            let found = renderer.truth_at(&scene, &view, at);
            let (z, near_m) = (f64::from(found.depth_m), 1e-4 * there.z);
            out.all += 1;
            if z == 0.0 || z > there.z + near_m {
                out.past += 1;
            } else if z > there.z - near_m {
                out.seen += 1;
                let same = found.semantic == *truth.semantic.at(column, row)
                    && found.object == *truth.object.at(column, row);
                out.other += usize::from(!same);
            }
        }
    }
    out
}

#[test]
fn what_one_eye_sees_the_other_sees_a_baseline_beside() {
    let world = world();
    let (forest, runner) = (&world.forest, world.runner(2));
    let rigs = runner.get(forest.cameras, ()).expect("cameras");
    let names: Vec<&str> = rigs.iter().map(|r| &*r.name).collect();
    assert_eq!(names, ["camera", "right", "side"]);
    let images = runner.get(forest.images, 1).expect("images");
    let scene = runner.get(forest.scene, 1).expect("a scene");
    let pose = runner.get(forest.pose, 1).expect("a pose");
    let frame = Frame {
        scene_from_body: pose.track.relative_to(scene.origin_m).middle(),
        assets: runner.get(forest.assets, ()).expect("assets"),
        scene,
    };
    let eyes: Vec<Eye<'_>> = rigs
        .iter()
        .zip(&*images)
        .map(|(rig, images)| Eye {
            rig,
            body_from_camera: rig.body_from_camera,
            images,
        })
        .collect();
    let [left, right, side] = &eyes[..] else {
        panic!("three cameras");
    };
    // The right camera differs only by a baseline to the right.
    let right_from_left = right.body_from_camera.inverse() * left.body_from_camera;
    let aside = right_from_left.translation_m - DVec3::new(-BASELINE_M, 0.0, 0.0);
    assert!(aside.length() < 1e-12 && right_from_left.rotation.w.abs() > 1.0 - 1e-12);

    for (name, a, b) in [
        ("left in right", left, right),
        ("right in left", right, left),
        ("left in side", left, side),
    ] {
        let c = compare(&frame, a, b);
        println!("{name}: {c:?}");
        let share = |part: usize| part as f64 / c.all as f64;
        assert!(c.all > 15_000 && share(c.seen) > 0.6, "{name}: {c:?}");
        assert!(share(c.other) < 1e-3, "{name}: {c:?}");
        assert!(share(c.past) < 2e-3, "{name}: {c:?}");
        // A mount that is wrong by a centimetre is detected.
        let mut wrong = Eye { ..*b };
        wrong.body_from_camera.translation_m.y += 0.01;
        let w = compare(&frame, a, &wrong);
        println!("{name}, a centimetre off: {w:?}");
        assert!(w.past > 20 * c.past.max(10), "{name}: {w:?}, {c:?}");
    }

    // In the images alone, disparity is focal length × baseline / depth.
    let (fx, truth) = (left.rig.intrinsics.fx, &left.images.truth);
    let median = |baseline_m: f64| {
        let mut differences = Vec::new();
        for row in 0..truth.depth_m.height() {
            for column in 0..truth.depth_m.width() {
                let z = f64::from(*truth.depth_m.at(column, row));
                let at = column as f64 + 0.5 - fx * baseline_m / z;
                if z > 0.0 && (0.0..320.0).contains(&at) {
                    let there = f64::from(*right.images.truth.depth_m.at(at as usize, row));
                    differences.push((there - z).abs() / z);
                }
            }
        }
        let middle = differences.len() / 2;
        *differences.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let (sound, mirrored) = (median(BASELINE_M), median(-BASELINE_M));
    println!("depth by disparity: {sound} off (median), {mirrored} with the eyes exchanged");
    assert!(sound < 0.02 && mirrored > 2.0 * sound);

    // The cameras have different noise.
    assert_ne!(left.images.rgb, right.images.rgb);
}

#[test]
fn cameras_that_take_alike_share_a_renderer() {
    let world = World::new(
        "demo",
        &[
            "cameras.right.mount_y_m=-0.12",
            "cameras.smooth.edge_samples=9",
            "cameras.true.bounces=2",
        ],
    );
    let rigs = world.runner(1).get(world.forest.cameras, ());
    let rigs = rigs.expect("cameras");
    let first = |i: usize| {
        rigs.iter()
            .position(|r| Arc::ptr_eq(&r.renderer, &rigs[i].renderer))
    };
    let named = |name: &str| {
        rigs.iter()
            .position(|r| r.name == name)
            .expect("it is there")
    };
    assert_eq!(first(named("right")), Some(0));
    for own in ["smooth", "true"].map(named) {
        assert_eq!(first(own), Some(own));
    }
}
