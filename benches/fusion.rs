//! Fusion of exact maps into a cloud on all cores: `cargo bench --bench fusion`. An element is a pixel.

#[path = "../tests/common/mod.rs"]
mod common;

use common::procedural;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use skep::fusion::{FusionView, fuse};
use skep::{FusionOptions, Options, ignore_progress};
use std::hint::black_box;

fn fusion(criterion: &mut Criterion) {
    let made = procedural::plane_and_sphere();
    let count = made.views.len() as u32;
    let overlaps: Vec<Vec<u32>> =
        (0..count).map(|view| (0..count).filter(|&other| other != view).collect()).collect();
    let views: Vec<FusionView> = (made.views.iter().zip(&made.truth).zip(&overlaps))
        .map(|((view, maps), overlap)| FusionView {
            camera: &view.camera,
            maps,
            status: None,
            confidence: None,
            picture: view.picture.decoded(),
            overlap,
        })
        .collect();
    let options: FusionOptions = Options::default().fusion;
    let pixels: u64 = made.views.iter().map(|view| view.camera.pixels() as u64).sum();
    let mut group = criterion.benchmark_group("fusion");
    group.throughput(Throughput::Elements(pixels)).sample_size(10);
    group.bench_function("exact maps", |bencher| {
        bencher.iter(|| fuse(black_box(&views), &options, &ignore_progress).unwrap());
    });
    group.finish();
}

criterion_group!(benches, fusion);
criterion_main!(benches);
