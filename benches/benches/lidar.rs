//! Scans as the paper's Tables I and II, throughput in rays; all fields and noise included.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nemoral_benches::{DENSITIES, Grown, POINTS, config};
use nemoral_pipeline::stages::frame::FrameScene;
use nemoral_seed::Key;

fn scans(c: &mut Criterion) {
    let mut group = c.benchmark_group("table_1_density");
    for preset in DENSITIES {
        group.throughput(Throughput::Elements(50_000));
        group.bench_function(BenchmarkId::new(preset, 50_000), scan(preset, 50_000));
    }
    group.finish();
    let mut group = c.benchmark_group("table_2_points");
    for points in POINTS {
        group.throughput(Throughput::Elements(u64::from(points)));
        group.bench_function(BenchmarkId::new("medium", points), scan("medium", points));
    }
    group.finish();
}

/// One scan at frame 0, the forest grown before.
fn scan(preset: &str, pulses: u32) -> impl FnMut(&mut criterion::Bencher<'_>) {
    let config = config(preset, pulses).expect("presets are valid");
    let grown = Grown::new(&config).expect("presets grow");
    move |bencher| {
        let runner = grown.runner();
        let forest = &grown.forest;
        let pose = runner.get(forest.pose, 0).expect("grown");
        let scene: std::sync::Arc<FrameScene> = runner.get(forest.scene, 0).expect("grown");
        let rigs = runner.get(forest.lidars, ()).expect("grown");
        let rig = &rigs[0];
        let assets = runner.get(forest.assets, ()).expect("grown");
        let track = pose.track.relative_to(scene.origin_m);
        bencher.iter(|| {
            black_box(rig.scanner.scan(
                rig.scanner.first_pulse_at(pose.time_s),
                &scene.forest,
                &assets.library.materials,
                &|offset_s| track.at(offset_s) * rig.body_from_lidar,
                &rig.noise,
                Key::world(1),
            ))
        });
    }
}

criterion_group! { name = benches; config = Criterion::default().sample_size(20); targets = scans }
criterion_main!(benches);
