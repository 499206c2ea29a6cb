//! The cost of whole frames without writing files: picture and truth, without and with the scan.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nemoral_benches::{DENSITIES, Grown, config};
use nemoral_pipeline::plan::ForestCoordinate;

fn frames(c: &mut Criterion) {
    let mut group = c.benchmark_group("frame_1280x720");
    for preset in DENSITIES {
        let grown = Grown::new(&config(preset, 50_000).expect("valid")).expect("grows");
        group.throughput(Throughput::Elements(1280 * 720));
        group.bench_function(BenchmarkId::new("image", preset), |b| {
            b.iter(|| {
                grown.store.retain(|id, _| id != "frame.images");
                black_box(grown.runner().get(grown.forest.images, 0).expect("grown"))
            });
        });
        group.bench_function(BenchmarkId::new("image_and_scan", preset), |b| {
            b.iter(|| {
                grown
                    .store
                    .retain(|_, at| !matches!(at, ForestCoordinate::Frame(_)));
                let runner = grown.runner();
                let images = runner.get(grown.forest.images, 0).expect("grown");
                black_box((images, runner.get(grown.forest.scans, 0).expect("grown")))
            });
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = Criterion::default().sample_size(10); targets = frames }
criterion_main!(benches);
