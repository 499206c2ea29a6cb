//! The cost of each stage on its own, at `medium`.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nemoral_assets::Library;
use nemoral_benches::{Grown, config};
use nemoral_dataset::{CameraData, DatasetHeader, FrameData, LidarData, OpenMode, Writer};
use nemoral_lidar::{LivoxHorizonLike, Mid40, ScanPattern};
use nemoral_lidar_noise::{EchoObservation, RangeNoise, RangeNoiseSampler};
use nemoral_pipeline::config::{Config, Sequences};
use nemoral_pipeline::plan::{Node, Runner, Store};
use nemoral_pipeline::{Backend, ForestPlan};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{Annotations, ChunkCoord, Surface, Twist};
use nemoral_seed::{Domain, Key};
use nemoral_terrain::{NoiseTerrain, TerrainParams};

fn small(c: &mut Criterion) {
    let terrain = NoiseTerrain::new(TerrainParams::default(), Key::world(7)).expect("valid");
    c.bench_function("terrain/sample", |b| {
        b.iter(|| black_box(terrain.sample(black_box(DVec2::new(123.4, -56.7)))));
    });
    let mut pulse = 0;
    for (name, pattern) in [
        ("mid40", &Mid40 as &dyn ScanPattern),
        ("horizon", &LivoxHorizonLike),
    ] {
        c.bench_function(&format!("lidar/pulse/{name}"), |b| {
            b.iter(|| {
                pulse += 1;
                black_box(pattern.pulse(pulse))
            });
        });
    }
    let sampler = RangeNoiseSampler::new(RangeNoise::default()).expect("valid");
    let key = Key::world(7).domain(Domain::new("bench.noise"));
    c.bench_function("lidar-noise/measure", |b| {
        let o = EchoObservation::at_angle(20.0, 0.7, 0.4);
        b.iter(|| {
            pulse += 1;
            black_box(sampler.measure(&o, &mut key.item(pulse).rng()))
        });
    });
}

/// The cost of a new chunk, node by node. The inputs of a node are computed before.
fn chunk(c: &mut Criterion) {
    let config = config("medium", 50_000).expect("valid");
    let grown = Grown::new(&config).expect("grows");
    let at = ChunkCoord::new(0, 0);
    let f = &grown.forest;
    node(c, &grown, "chunk.woody", f.woody, at);
    node(c, &grown, "chunk.objects", f.objects, at);
    node(c, &grown, "chunk.sky_view_factor", f.sky_view_factor, at);
    node(c, &grown, "chunk.undergrowth", f.undergrowth, at);
    node(c, &grown, "chunk.seedlings", f.seedlings, at);
    node(c, &grown, "chunk.object_geometry", f.object_geometry, at);
    node(
        c,
        &grown,
        "chunk.undergrowth_geometry",
        f.undergrowth_geometry,
        at,
    );
    node(c, &grown, "chunk.ground_occlusion", f.ground_occlusion, at);
    node(c, &grown, "chunk.litter", f.litter, at);
    node(c, &grown, "chunk.litter_geometry", f.litter_geometry, at);
}

fn node<T: Send + Sync + 'static>(
    c: &mut Criterion,
    grown: &Grown,
    id: &'static str,
    node: Node<ChunkCoord, T>,
    at: ChunkCoord,
) {
    c.bench_function(&id.replace('.', "/"), |b| {
        b.iter(|| {
            grown.store.retain(|stage, _| stage != id);
            black_box(grown.runner().get(node, at).expect("grown"))
        });
    });
}

fn world(c: &mut Criterion) {
    let config = config("medium", 50_000).expect("valid");
    c.bench_function("assets/library", |b| {
        b.iter(|| {
            let (forest, store) = (ForestPlan::new(&config).expect("valid"), Store::unlimited());
            let runner = Runner::new(forest.plan(), &store, 2);
            black_box(runner.get(forest.assets, ()).expect("grows"))
        });
    });
    // A later run reads these bytes from the cache instead of growing the assets.
    let (forest, store) = (ForestPlan::new(&config).expect("valid"), Store::unlimited());
    let runner = Runner::new(forest.plan(), &store, 2);
    let bytes = runner.get(forest.library, ()).expect("grows").to_bytes();
    c.bench_function("assets/library_from_bytes", |b| {
        b.iter(|| black_box(Library::from_bytes(&bytes).expect("its own")));
    });
}

/// The cost of encoding and writing a frame of five pictures and a scan.
fn files(c: &mut Criterion) {
    let config = config("medium", 50_000).expect("valid");
    let grown = Grown::new(&config).expect("grows");
    let runner = grown.runner();
    let images = runner.get(grown.forest.images, 0).expect("grown");
    let scans = runner.get(grown.forest.scans, 0).expect("grown");
    let pose = runner.get(grown.forest.pose, 0).expect("grown");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let writer =
        Writer::create(folder.path(), OpenMode::Fresh, header(&config)).expect("an empty folder");
    let annotations = Annotations::default();
    let frame = FrameData {
        sequence: 0,
        index: 0,
        time_s: 0.0,
        world_from_body: pose.world_from_body(),
        body_motion: Twist::STILL,
        balance: None,
        cameras: vec![CameraData {
            name: "camera",
            rgb: &images[0].rgb,
            radiance: None,
            truth: &images[0].truth,
            annotations: &annotations,
        }],
        lidars: vec![LidarData {
            name: "lidar",
            points: &scans[0],
            sensor_chunk: pose.chunk,
        }],
        frame_key: [0; 32],
    };
    c.bench_function("dataset/write_frame", |b| {
        b.iter(|| black_box(writer.write_frame(&frame).expect("written")));
    });
}

fn header(config: &Config) -> DatasetHeader {
    let sequences = Sequences::of(config).expect("valid");
    nemoral_pipeline::header(&sequences, &Backend::Cpu).expect("valid")
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = small, chunk, world, files
}
criterion_main!(benches);
