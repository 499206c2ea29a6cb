//! Scans as in the paper's Tables I and II, with all fields and noise; throughput is in rays.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nemoral_benches::{DENSITIES, Grown, POINTS, config};

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

/// One scan at frame 0 in a forest that is already grown.
fn scan(preset: &str, pulses: u32) -> impl FnMut(&mut criterion::Bencher<'_>) {
    let config = config(preset, pulses).expect("presets are valid");
    let grown = Grown::new(&config).expect("presets grow");
    let scan = grown.first_scan().expect("presets grow");
    move |bencher| bencher.iter(|| black_box(scan()))
}

criterion_group! { name = benches; config = Criterion::default().sample_size(20); targets = scans }
criterion_main!(benches);
