//! The whole run on the embedded photographs, all cores: `cargo bench --features io --bench pipeline`. An
//! element is a pixel. It takes minutes.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use skep::import::read_scene;
use skep::{Options, ignore_progress, reconstruct};
use std::hint::black_box;
use std::path::Path;

fn pipeline(criterion: &mut Criterion) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/data/board");
    let scene = read_scene(&folder, None, &Options::default(), &ignore_progress).unwrap();
    let pixels: u64 = scene.views().iter().map(|view| view.camera.pixels() as u64).sum();
    let mut group = criterion.benchmark_group("seven photographs of 640 x 360");
    group.throughput(Throughput::Elements(pixels)).sample_size(10);
    for preset in ["fast", "default"] {
        let options = Options::preset(preset).unwrap();
        group.bench_function(preset, |bencher| {
            bencher.iter(|| reconstruct(black_box(&scene), &options, &ignore_progress).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, pipeline);
criterion_main!(benches);
