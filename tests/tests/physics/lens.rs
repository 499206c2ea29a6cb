//! The imperfections of a real camera in a forest: shutters and noise on pictures, truth that
//! matches them, and radiance on disk.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::sync::atomic::AtomicBool;

use nemoral_dataset::{Dataset, OpenMode, check};
use nemoral_pipeline::config::Sequences;
use nemoral_pipeline::plan::Runner;
use nemoral_pipeline::{
    Backend, BackendChoice, ForestPlan, FrameSelection, FrameWritten, GenerateParams, Observer,
    SequenceFrames, generate,
};
use nemoral_scene::Shutter;
use nemoral_tests::gpu::{Agreement, gpu};
use nemoral_tests::{config, grown, store};

struct Silent;

impl Observer for Silent {
    fn note(&self, _: &str) {}

    fn frame(&self, _: FrameWritten) {}
}

/// A fast robot with a cheap camera. Its labels nevertheless match its pictures and its scans.
#[test]
fn a_rolling_shutter_in_a_forest_passes_the_check() {
    let settings = [
        "frames=2",
        "camera.width_px=320",
        "camera.height_px=180",
        "camera.edge_samples=1",
        "camera.flow=true",
        "camera.radiance=true",
        "camera.shutter.readout_ms=33",
        "camera.shutter.exposure_ms=10",
        "camera.shutter.samples=3",
        "robot.speed_m_s=6",
        "lidar.pulses=20000",
        // Another camera has a global shutter and no exposure time.
        "cameras.good.shutter.readout_ms=0",
        "cameras.good.shutter.exposure_ms=0",
        "cameras.good.flow=false",
        "cameras.good.radiance=false",
    ];
    let config = config("demo", &settings);
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("recorded");
    let params = GenerateParams {
        frames: SequenceFrames::new(FrameSelection::first(2), 1),
        sequences: Sequences::of(&config).expect("valid"),
        out: out.clone(),
        mode: OpenMode::Fresh,
        is_shard: false,
        threads: 2,
        backend: Backend::Cpu,
        cache: grown(),
    };
    generate(&params, &Silent, &AtomicBool::new(false)).expect("a data set");
    let report = check(&out).expect("a data set");
    println!("{report}");
    assert!(report.passed(), "{report}");

    let dataset = Dataset::open(&out).expect("a data set");
    let cameras = &dataset.manifest().header.sequences[0].cameras;
    let shutter = Shutter {
        exposure_s: 0.01,
        readout_s: 0.033,
    };
    assert_eq!(
        (cameras[0].shutter, cameras[1].shutter),
        (shutter, Shutter::INSTANT)
    );
    let motion = dataset.frames()[0].body_motion;
    let speed = motion.linear_m_s.length();
    assert!(
        (speed - 6.0).abs() < 0.2 && motion.linear_m_s.x > 5.5,
        "{motion:?}"
    );

    // If the check is told that the robot stood still, points lie before or behind surfaces, as
    // with wrong mounts.
    let path = out.join("dataset.json");
    let text = std::fs::read_to_string(&path).expect("read");
    std::fs::write(&path, text.replace("\"body_motion\"", "\"forgotten\"")).expect("write");
    let still = check(&out).expect("a data set").to_string();
    assert!(still.contains("pixels flow elsewhere"), "{still}");
}

/// Noise is only in the picture, differs between frames and cameras, and is stronger in low light.
#[test]
fn noise_is_on_the_picture_alone() {
    // The forest is the same for every camera and grown once; only pictures are computed anew.
    let store = store();
    let take = |more: &[&str]| {
        let mut settings = vec![
            "camera.width_px=160",
            "camera.height_px=96",
            "camera.edge_samples=1",
            "camera.radiance=true",
            "lidar.pulses=10",
        ];
        settings.extend(more);
        let forest = ForestPlan::new(&config("demo", &settings)).expect("a plan");
        store.retain(|stage, _| stage != "frame.images");
        let images = Runner::new(forest.plan(), &store, 2).get(forest.images, 0);
        images.expect("pictures")[0].clone()
    };
    let (clean, noisy) = (take(&[]), take(&["camera.noise.enabled=true"]));
    assert_eq!(clean.truth, noisy.truth);
    assert_eq!(clean.linear, noisy.linear);
    let off = |a: &nemoral_render::CameraImages, b: &nemoral_render::CameraImages| -> f64 {
        let pairs = a.rgb.pixels().iter().zip(b.rgb.pixels());
        let sum: f64 = pairs
            .map(|(a, b)| (f64::from(a[1]) - f64::from(b[1])).powi(2))
            .sum();
        (sum / a.rgb.pixels().len() as f64).sqrt()
    };
    // Noise of a good sensor in daylight is one or two of 255 code values.
    assert!(
        (0.3..3.0).contains(&off(&clean, &noisy)),
        "{}",
        off(&clean, &noisy)
    );
    let grainy = take(&["camera.noise.enabled=true", "camera.noise.gain=16"]);
    assert!(off(&clean, &grainy) > 3.0 * off(&clean, &noisy));
    assert_eq!(take(&["camera.noise.enabled=true"]), noisy);
}

/// Both backends take the pipeline's pictures through a lens while the robot moves.
#[test]
#[ignore = "a minute: .ci/full runs it"]
fn a_bent_and_moving_camera_is_the_same_for_both_backends() {
    let Some(gpu) = gpu("a lens and a shutter in the pipeline") else {
        return;
    };
    let config = config(
        "demo",
        &[
            "camera.width_px=240",
            "camera.height_px=135",
            "camera.edge_samples=1",
            "camera.fov.horizontal_deg=120",
            "camera.fisheye.k1=-0.02",
            "camera.shutter.readout_ms=30",
            "robot.speed_m_s=3",
            "chunks.visible_radius_m=12",
            "chunks.undergrowth_radius_m=4",
            "assets.individuals=1",
        ],
    );
    let (drawing, said) = Backend::for_config(BackendChoice::Gpu, &config).expect("a GPU");
    assert!(said.contains(&gpu.name()), "{said}");
    let take = |backend| {
        let forest = ForestPlan::on(&config, backend).expect("a plan");
        let store = store();
        let images = Runner::new(forest.plan(), &store, 2).get(forest.images, 1);
        images.expect("pictures")[0].clone()
    };
    let (cast, drawn) = (take(Backend::Cpu), take(drawing));
    let agreement = Agreement::of(&cast.truth, &drawn.truth);
    println!("{agreement}");
    assert!(agreement.is_right(300), "{agreement}");
    assert!((cast.ev100 - drawn.ev100).abs() < 0.1);
}

#[test]
fn a_gpu_that_is_asked_to_follow_light_says_no() {
    if gpu("light that cannot be followed").is_none() {
        return;
    }
    let config = config("demo", &["camera.bounces=3"]);
    let (drawing, _) = Backend::for_config(BackendChoice::Gpu, &config).expect("a GPU");
    let forest = ForestPlan::on(&config, drawing).expect("a plan");
    let cameras = Runner::new(forest.plan(), &store(), 1).get(forest.cameras, ());
    let error = cameras.expect_err("no light to follow").to_string();
    assert!(error.contains("camera.bounces = 3"), "{error}");
}
