//! All sensors share one truth: at each point's exact position in its image, a camera at the
//! LiDAR's position sees what the pulse hit.

use std::sync::{Arc, LazyLock};

use nemoral_pipeline::recording::scene::FrameScene;
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_pipeline::world::cameras::CameraRig;
use nemoral_pipeline::world::lidars::LidarRig;
use nemoral_render::{OpenSky, PixelTruth, SceneView, View};
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{Intrinsics, LidarPoint, Ontology, PointFlags};
use nemoral_tests::World;

/// The robot stands still while it scans, its LiDAR has no errors, and its camera is at the LiDAR's
/// position with all points in view.
const SETTINGS: [&str; 11] = [
    "frames=6",
    "chunks.visible_radius_m=60",
    "chunks.undergrowth_radius_m=30",
    "camera.width_px=320",
    "camera.height_px=180",
    "camera.fov.horizontal_deg=100",
    "camera.mount_z_m=1.35",
    "lidar.pulses=40000",
    "lidar.noise.model=off",
    "robot.spacing_m=12",
    "robot.speed_m_s=1e-6",
];

/// A frame with its picture and scan.
pub(crate) struct Frame {
    world: &'static World,
    assets: Arc<WorldAssets>,
    cameras: Arc<Vec<CameraRig>>,
    scene: Arc<FrameScene>,
    scans: Arc<Vec<Vec<LidarPoint>>>,
    view: View,
}

static WORLD: LazyLock<World> = LazyLock::new(|| World::new("demo", &SETTINGS));

static FRAMES: LazyLock<Vec<Frame>> = LazyLock::new(|| frames_of(&WORLD));

/// All frames of a world.
pub(crate) fn frames_of(world: &'static World) -> Vec<Frame> {
    let (forest, runner) = (&world.forest, world.runner(2));
    let lidars = runner.get(forest.lidars, ()).expect("a lidar");
    let frame = |frame| {
        let cameras = runner.get(forest.cameras, ()).expect("cameras");
        let camera = &cameras[0];
        assert_same_place(camera, &lidars[0]);
        let pose = runner.get(forest.pose, frame).expect("a pose");
        let scene = runner.get(forest.scene, frame).expect("a scene");
        let body = pose.track.relative_to(scene.origin_m).middle();
        Frame {
            world,
            assets: runner.get(forest.assets, ()).expect("assets"),
            scans: runner.get(forest.scans, frame).expect("a scan"),
            view: View::new(camera.intrinsics, body * camera.body_from_camera),
            cameras,
            scene,
        }
    };
    (0..world.config.frames).map(frame).collect()
}

fn assert_same_place(camera: &CameraRig, lidar: &LidarRig) {
    let (a, b) = (&camera.body_from_camera, &lidar.body_from_lidar);
    assert_eq!(a.translation_m, b.translation_m);
}

/// A point in the camera's frame, its position in the image, and what the camera sees there.
struct Seen {
    in_camera: DVec3,
    truth: PixelTruth,
}

impl Frame {
    /// Looks through a view at the image position of each point, moved by `shift` pixels.
    fn look<'a>(
        &'a self,
        view: &'a View,
        shift: DVec2,
    ) -> impl Iterator<Item = (&'a LidarPoint, Seen)> {
        let scene = SceneView {
            caster: &*self.scene.caster,
            instances: Some(&*self.scene),
            materials: &self.assets.library.materials,
            sky_visibility: &OpenSky,
            lamps: &[],
        };
        let lidars = (self.world.runner(1).get(self.world.forest.lidars, ())).expect("a lidar");
        let camera_from_lidar =
            self.cameras[0].body_from_camera.inverse() * lidars[0].body_from_lidar;
        let k: Intrinsics = view.intrinsics;
        // What was met by way of a mirror is not where its point lies.
        let direct = |p: &&LidarPoint| !p.flags.has(PointFlags::MIRRORED);
        self.scans[0].iter().filter(direct).map(move |point| {
            let in_camera = camera_from_lidar.transform_point(point.position_m.as_dvec3());
            let pixel = k.project(in_camera).expect("in front of the camera");
            let inside = pixel.cmpge(DVec2::ZERO).all()
                && pixel.x < f64::from(k.width)
                && pixel.y < f64::from(k.height);
            assert!(inside, "the camera sees all that the LiDAR sees");
            let truth = self.cameras[0]
                .renderer
                .ray_cast()
                .expect("the CPU's")
                .truth_at(&scene, view, pixel + shift);
            (point, Seen { in_camera, truth })
        })
    }

    /// The points of its scan.
    pub(crate) fn points(&self) -> &[LidarPoint] {
        &self.scans[0]
    }

    /// Number of points, and of those for which the camera sees another class or instance.
    fn label_errors(&self, shift: DVec2) -> (usize, usize) {
        let ontology = Ontology::paper();
        let denied = |(point, seen): &(&LidarPoint, Seen)| {
            ontology.class(point.semantic).id != ontology.class(seen.truth.semantic).id
                || point.object != seen.truth.object
        };
        let errors = self.look(&self.view, shift).filter(denied).count();
        (self.scans[0].len(), errors)
    }
}

/// The sums of label errors over all frames.
fn label_errors(shift: DVec2) -> (usize, usize) {
    let sum = |a: (usize, usize), b: (usize, usize)| (a.0 + b.0, a.1 + b.1);
    let each = FRAMES.iter().map(|frame| frame.label_errors(shift));
    each.fold((0, 0), sum)
}

#[test]
fn a_camera_at_the_lidar_sees_what_the_pulses_hit() {
    // Ground, trails, stems, leaves and low plants are all in view.
    println!("{}", assert_agreement(&FRAMES, 120_000, &[1, 2, 3, 4, 6]));
}

/// Asserts that cameras see what pulses hit, in at least `least` points, and 100 of each of these
/// classes; the result says how well.
pub(crate) fn assert_agreement(frames: &[Frame], least: usize, classes: &[usize]) -> String {
    let ontology = Ontology::paper();
    let mut points = [0_usize; 8];
    let (mut all, mut labels, mut depths, mut worst_m) = (0, 0, 0, 0.0_f64);
    for frame in frames {
        for (point, seen) in frame.look(&frame.view, DVec2::ZERO) {
            all += 1;
            points[usize::from(ontology.class(point.semantic).id)] += 1;
            let same_class =
                ontology.class(point.semantic).id == ontology.class(seen.truth.semantic).id;
            labels += usize::from(same_class && point.object == seen.truth.object);
            let difference_m = (f64::from(seen.truth.depth_m) - seen.in_camera.z).abs();
            let close = difference_m <= 1e-3;
            depths += usize::from(close);
            if close {
                worst_m = worst_m.max(difference_m);
            }
        }
    }
    let percent = |n: usize| 100.0 * n as f64 / all as f64;
    let mut report = format!(
        "{all} points in {} frames: {:.4} % equal class and instance, {:.4} % within 1 mm (worst \
         of them {:.6} m)",
        frames.len(),
        percent(labels),
        percent(depths),
        worst_m
    );
    for class in ontology.classes() {
        let count = points[usize::from(class.id)];
        report += &format!("\n  {:<12}{count:>8}", class.name);
    }
    assert!(all >= least, "{report}");
    for &class in classes {
        assert!(points[class] >= 100, "class {class}: {}", points[class]);
    }
    assert!(percent(labels) >= 99.99, "{report}");
    assert!(percent(depths) >= 99.99, "{report}");
    report
}

#[test]
fn labels_one_pixel_off_are_noticed() {
    let (all, right) = label_errors(DVec2::ZERO);
    for shift in [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y] {
        let (_, wrong) = label_errors(shift);
        let percent = |n: usize| 100.0 * n as f64 / all as f64;
        println!(
            "labels off by {shift} pixels: {:.3} % disagree, {:.4} % before",
            percent(wrong),
            percent(right)
        );
        assert!(
            wrong >= 2 * right && percent(wrong) > 1.0,
            "{wrong} {right}"
        );
    }
}

#[test]
fn a_pose_five_centimetres_off_is_noticed() {
    let median = |mut values: Vec<f64>| {
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    // The residuals are the camera's depths less the points', on surfaces that face the sensor.
    let residuals = |forward_m: f64| -> Vec<f64> {
        let mut residuals = Vec::new();
        for frame in &*FRAMES {
            let mut view = frame.view;
            let forward = view.scene_from_camera.transform_vector(DVec3::Z);
            view.scene_from_camera.translation_m += forward * forward_m;
            for (point, seen) in frame.look(&view, DVec2::ZERO) {
                let residual = f64::from(seen.truth.depth_m) - seen.in_camera.z;
                // From half a metre on, the camera sees past the point.
                if point.incidence_cos >= 0.9 && residual.abs() < 0.5 {
                    residuals.push(residual);
                }
            }
        }
        residuals
    };
    let sound = residuals(0.0);
    let count = sound.len();
    let sound = median(sound);
    for forward_m in [0.05, -0.05] {
        let moved = median(residuals(forward_m));
        println!(
            "pose {forward_m} m off: median depth residual {moved:+.4} m, {sound:+.6} m before, \
             {count} points"
        );
        assert!(count > 500, "{count}");
        assert!((moved - sound).abs() > 0.03, "{moved} {sound}");
        assert!(sound.abs() < 1e-3, "{sound}");
    }
}

#[test]
fn images_are_made_of_the_same_answers() {
    let frame = &FRAMES[1];
    let runner = WORLD.runner(2);
    let images = &runner.get(WORLD.forest.images, 1).expect("images")[0];
    let scene = SceneView {
        caster: &*frame.scene.caster,
        instances: Some(&*frame.scene),
        materials: &frame.assets.library.materials,
        sky_visibility: &OpenSky,
        lamps: &[],
    };
    let truth = &images.truth;
    let width = truth.depth_m.width();
    for i in 0..truth.depth_m.pixels().len() {
        let (column, row) = (i % width, i / width);
        let centre = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
        let seen = frame.cameras[0]
            .renderer
            .ray_cast()
            .expect("the CPU's")
            .truth_at(&scene, &frame.view, centre);
        let in_image = PixelTruth {
            semantic: *truth.semantic.at(column, row),
            object: *truth.object.at(column, row),
            depth_m: *truth.depth_m.at(column, row),
            normal: *truth.normal.at(column, row),
        };
        assert_eq!(seen, in_image, "pixel ({column}, {row})");
    }
}
