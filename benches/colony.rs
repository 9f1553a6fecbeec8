//! The search in a tile of 64 x 64 pixels, on one thread: `cargo bench --bench colony`. An element is an NCC
//! evaluation.

#[path = "../tests/common/mod.rs"]
mod common;

use common::changed;
use common::procedural::{self, MIDDLE};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use skep::{Options, Scale, Stepper, ignore_progress};
use std::hint::black_box;

fn colony(criterion: &mut Criterion) {
    let mut scene = procedural::plane_and_sphere();
    let view = &mut scene.views[MIDDLE];
    let width = view.camera.width as usize;
    let is_in_tile =
        |pixel: usize| (32..96).contains(&(pixel % width)) && (16..80).contains(&(pixel / width));
    view.mask = Some((0..view.camera.pixels()).map(is_in_tile).collect::<Vec<_>>().into());
    let scene = scene.scene();

    let mut group = criterion.benchmark_group("a tile of 64 x 64 pixels");
    group.sample_size(10);
    for (name, iterations) in [("colonies filled", 0), ("colonies filled and one iteration", 1)] {
        let scale = Scale {
            downscale: 1,
            food_sources: 3,
            first_iterations: iterations,
            cycles: 0,
            cycle_iterations: 0,
        };
        let options = changed(Options::default(), |o| {
            o.threads = 1;
            o.schedule.scales = vec![scale];
        });
        let stepper = Stepper::new(&scene, &options).unwrap();
        let search = || stepper.search(0, MIDDLE, &[], None, &ignore_progress).unwrap();
        group.throughput(Throughput::Elements(search().counts().ncc_evaluations));
        group.bench_function(name, |bencher| bencher.iter(|| black_box(search())));
    }
    group.finish();
}

criterion_group!(benches, colony);
criterion_main!(benches);
