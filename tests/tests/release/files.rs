//! `check` on recorded forests: it accepts them by their files alone, and rejects altered files.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

use nemoral_dataset::{
    Agreement, CameraData, CheckReport, Dataset, FrameData, LidarData, OpenMode, Track,
    WorldTables, Writer, check,
};
use nemoral_pipeline::config::Sequences;
use nemoral_pipeline::{
    Backend, BackendChoice, FrameSelection, FrameWritten, GenerateParams, Observer, SequenceFrames,
    generate,
};
use nemoral_scene::{
    AnnotationKinds, Annotations, ChunkCoord, Image, LidarPoint, ObjectId, Ontology, Semantic,
    TruthImages, Twist, glam::DVec3,
};
use nemoral_tests::gpu::gpu;
use nemoral_tests::{config, grown};
use tempfile::TempDir;

struct Silent;

impl Observer for Silent {
    fn note(&self, _: &str) {}

    fn frame(&self, _: FrameWritten) {}
}

/// A data set as the program writes it, in `recorded` of a folder.
fn record(preset: &str, settings: &[&str], choice: BackendChoice) -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    let config = config(preset, settings);
    let (backend, _) = Backend::for_config(choice, &config).expect("a renderer");
    let params = GenerateParams {
        cache: grown(),
        frames: SequenceFrames::new(FrameSelection::first(config.frames), 1),
        sequences: Sequences::of(&config).expect("valid"),
        out: folder.path().join("recorded"),
        mode: OpenMode::Fresh,
        is_shard: false,
        threads: 2,
        backend,
    };
    generate(&params, &Silent, &AtomicBool::new(false)).expect("a data set");
    folder
}

/// Data sets of a drive along a trail, with pictures of a usual size and with tiny ones, in which
/// fewer points are comparable.
static RECORDED: LazyLock<[TempDir; 2]> = LazyLock::new(|| {
    [["1280", "720", "30000"], ["160", "96", "150000"]].map(|[width, height, pulses]| {
        let settings = [
            "frames=3",
            &format!("camera.width_px={width}"),
            &format!("camera.height_px={height}"),
            &format!("lidar.pulses={pulses}"),
            "robot.spacing_m=4",
        ];
        record("demo", &settings, BackendChoice::Cpu)
    })
});

fn recorded() -> [PathBuf; 2] {
    RECORDED
        .each_ref()
        .map(|folder| folder.path().join("recorded"))
}

/// Asserts the agreement that a data set of any renderer must have.
fn assert_agrees(report: &CheckReport) {
    assert!(report.problems.is_empty(), "{:?}", report.problems);
    let agreement = &report.agreement;
    assert!(agreement.comparable() >= 5000, "{}", agreement.comparable());
    assert!(agreement.comparable_share() >= 0.5);
    let overall = agreement.overall().expect("comparable points");
    assert!(overall >= 0.97, "{overall}");
    let mut judged = 0;
    for class in agreement.classes.iter().filter(|c| c.comparable >= 500) {
        let share = class.same_class as f64 / class.comparable as f64;
        assert!(share >= 0.95, "{}: {share}", class.name);
        judged += 1;
    }
    assert!(judged >= 4, "a forest has more than {judged} classes");
    for residual in [&agreement.same_frame, &agreement.next_frame] {
        let median_m = residual.median_m().expect("surfaces that face the sensor");
        assert!(median_m.abs() < 0.01, "{median_m}");
    }
    assert!(report.passed());
}

#[test]
fn a_recorded_forest_agrees_with_itself() {
    for recorded in recorded() {
        let report = check(&recorded).expect("a data set");
        println!("{report}");
        assert_agrees(&report);
    }
}

/// Pictures by a GPU agree with scans by the processor, in a stand of a preset: class, instance and
/// depth, and flow, trunks and boxes, which the processor casts for the GPU's pictures.
#[test]
#[ignore = "a minute: .ci/full runs it"]
fn a_forest_drawn_by_a_gpu_agrees_with_its_scans() {
    if gpu("a data set drawn by a GPU").is_none() {
        return;
    }
    let settings = [
        "frames=2",
        "assets.individuals=1",
        // A software renderer is slow, as it processes every vertex of what is visible.
        "chunks.visible_radius_m=30",
        "chunks.undergrowth_radius_m=15",
        "camera.width_px=480",
        "camera.height_px=270",
        "camera.edge_samples=1",
        "camera.flow=true",
        "camera.trunks=true",
        "camera.boxes=true",
        "camera.boxes_range_m=20",
        "lidar.pulses=40000",
        "robot.spacing_m=4",
    ];
    let folder = record("oak-mixed", &settings, BackendChoice::Gpu);
    let out = folder.path().join("recorded");
    let dataset = Dataset::open(&out).expect("a data set");
    let backend = &dataset.manifest().header.backend;
    assert!(backend.starts_with("gpu: "), "{backend}");
    let frame = dataset.read_frame(0).expect("a frame");
    let camera = &frame.cameras[0];
    assert!(camera.flow.is_some() && camera.trunks.is_some());
    assert!(camera.boxes.as_ref().is_some_and(|b| b.len() > 5));

    let report = check(&out).expect("a data set");
    println!("{report}");
    assert_agrees(&report);
    let disagreement = |a: &Agreement| 1.0 - a.overall().expect("comparable points");
    let labels = told(&out, Lie::Labels);
    println!(
        "labels one pixel off: {:.3} % disagree",
        100.0 * disagreement(&labels)
    );
    assert!(disagreement(&labels) >= 2.0 * disagreement(&report.agreement));
    assert!(!labels.failures().is_empty());
}

/// The alteration of a copy of the data set.
#[derive(Clone, Copy)]
enum Lie {
    /// No alteration.
    None,
    /// Classes and instances lie one pixel to the right of the rest.
    Labels,
    /// Poses drift forwards by 5 cm a frame.
    Poses,
}

/// The image with every pixel from `columns` to the left.
fn shifted<T: Clone>(image: &Image<T>, columns: usize) -> Image<T> {
    let (width, height) = (image.width(), image.height());
    let pixel = |i: usize| {
        image
            .at((i % width).saturating_sub(columns), i / width)
            .clone()
    };
    Image::new(width, height, (0..width * height).map(pixel).collect())
}

/// Writes a copy with every camera's files altered, and runs `check` on it.
fn told(recorded: &Path, lie: Lie) -> Agreement {
    let folder = TempDir::new().expect("a temporary folder");
    let dataset = Dataset::open(recorded).expect("a data set");
    let mut header = dataset.manifest().header.clone();
    for camera in &mut header.sequences[0].cameras {
        camera.annotations = AnnotationKinds::default();
    }
    let ontology: &Ontology = &header.ontology;
    // These map class numbers to semantics, and image ids to objects.
    let semantics: HashMap<u8, Semantic> = Semantic::ALL
        .iter()
        .map(|s| (ontology.class(*s).id, *s))
        .collect();
    let objects = dataset.objects(0).expect("a table");
    let ids: HashMap<u32, ObjectId> = objects
        .iter()
        .map(|o| (o.object.to_image_id(), o.object))
        .collect();

    let writer = Writer::create(folder.path(), OpenMode::Fresh, header.clone()).expect("a folder");
    let mut poses = Vec::new();
    for (i, record) in dataset.frames().iter().enumerate() {
        let frame = dataset.read_frame(i).expect("a frame");
        let camera = &frame.cameras[0];
        let columns = usize::from(matches!(lie, Lie::Labels));
        let annotations = Annotations::default();
        let truth = TruthImages {
            semantic: shifted(&camera.semantic, columns).map(|class| semantics[class]),
            object: shifted(&camera.instance, columns)
                .map(|id| ids.get(id).copied().unwrap_or(ObjectId::NONE)),
            depth_m: camera.depth_m.clone(),
            normal: camera.normal.clone(),
        };
        let points: Vec<LidarPoint> = frame.lidars[0].ply.iter().map(|p| p.point).collect();
        let mut world_from_body = record.world_from_body();
        if matches!(lie, Lie::Poses) {
            let forward = world_from_body.transform_vector(DVec3::X);
            world_from_body.translation_m += forward * (0.05 * i as f64);
        }
        poses.push((record.time_s, world_from_body));
        let [x, y] = record.sensor_chunks[0];
        let data = FrameData {
            sequence: record.sequence,
            index: record.index,
            time_s: record.time_s,
            world_from_body,
            body_motion: Twist::STILL,
            balance: None,
            cameras: vec![CameraData {
                name: &camera.name,
                rgb: &camera.rgb,
                radiance: None,
                truth: &truth,
                annotations: &annotations,
            }],
            lidars: vec![LidarData {
                name: &frame.lidars[0].name,
                points: &points,
                sensor_chunk: ChunkCoord::new(x, y),
            }],
            frame_key: [0; 32],
        };
        writer.write_frame(&data).expect("a frame");
    }
    let tables = WorldTables {
        trees: &dataset.trees(0).expect("a table"),
        objects: &objects,
        deadwood: &[],
    };
    writer
        .write_sequence(
            &Track {
                sequence: 0,
                poses,
                balance: None,
                stands: false,
                estimated: Vec::new(),
                lines: Vec::new(),
                imu: None,
            },
            &tables,
        )
        .expect("a sequence");
    writer.finish().expect("a data set");
    let report = check(folder.path()).expect("a data set");
    // Labels that do not match their depths are detected even without a LiDAR.
    let fits = !matches!(lie, Lie::Labels);
    assert_eq!(report.problems.is_empty(), fits, "{:?}", report.problems);
    report.agreement
}

#[test]
fn lies_are_noticed_from_the_files_alone() {
    let disagreement = |a: &Agreement| 1.0 - a.overall().expect("comparable points");
    let residual = |a: &Agreement| a.next_frame.median_m().expect("surfaces");
    for recorded in recorded() {
        let honest = told(&recorded, Lie::None);
        let labels = told(&recorded, Lie::Labels);
        let poses = told(&recorded, Lie::Poses);
        println!(
            "disagreement {:.3} %, labels one pixel off {:.3} %",
            100.0 * disagreement(&honest),
            100.0 * disagreement(&labels)
        );
        println!(
            "median residual in the next frame {:+.4} m, poses 5 cm off {:+.4} m, {} points",
            residual(&honest),
            residual(&poses),
            poses.next_frame.points()
        );
        // An unaltered copy gives the same agreement as the original.
        let original = check(&recorded).expect("a data set").agreement;
        assert_eq!(original.classes, honest.classes);
        assert!(honest.failures().is_empty());

        assert!(disagreement(&labels) >= 2.0 * disagreement(&honest));
        assert!(!labels.failures().is_empty());
        let moved = residual(&poses) - residual(&honest);
        assert!(moved.abs() > 0.03, "{moved}");
        assert!(!poses.failures().is_empty());
    }
}
