//! How long the parts of the method take: kernels on each back-end, a whole small search, fusion.

#[path = "../tests/common/mod.rs"]
mod common;

use common::procedural::{self, MIDDLE, Procedural};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use skep::camera::Camera;
use skep::fusion::{FusionView, fuse};
use skep::image::PackedImage;
use skep::kernels::{PatchHomography, ReferencePatch, RelativePose, SlantedPlane, Window, patch_cost};
use skep::simd::{Level, Simd, Task, dispatch};
use skep::{FusionOptions, Options, Scale, ignore_progress, reconstruct};
use std::hint::black_box;

/// The window of 36 samples.
fn window() -> Window {
    let Options { window_radius, window_step, spatial_sigma, colour_sigma, min_variance, .. } =
        Options::default();
    Window::new(window_radius, window_step, spatial_sigma, colour_sigma, min_variance)
}

/// Pixels of the reference view with the homographies of their true planes to one source.
struct Patches {
    window: Window,
    reference: PackedImage,
    source: PackedImage,
    pixels: Vec<(usize, usize)>,
    homographies: Vec<PatchHomography>,
}

impl Patches {
    fn new(made: &Procedural) -> Patches {
        let (view, source) = (&made.views[MIDDLE], &made.views[MIDDLE + 1]);
        let camera = &view.camera;
        let pose = RelativePose::new(camera, &source.camera);
        let wanted = |&(x, y): &(usize, usize)| x % 4 == 0 && y % 4 == 0;
        let (width, height) = (camera.width as usize, camera.height as usize);
        let pixels: Vec<(usize, usize)> =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).filter(wanted).collect();
        let homography = |&(x, y): &(usize, usize)| {
            pose.homography(pose.at_infinity(x as f32, y as f32), &true_plane(made, camera, (x, y)))
        };
        Patches {
            window: window(),
            reference: PackedImage::new(&view.picture),
            source: PackedImage::new(&source.picture),
            homographies: pixels.iter().map(homography).collect(),
            pixels,
        }
    }
}

fn true_plane(made: &Procedural, camera: &Camera, (x, y): (usize, usize)) -> SlantedPlane {
    let pixel = y * camera.width as usize + x;
    let truth = &made.truth[MIDDLE];
    let ray = camera.ray(DVec2::new(x as f64, y as f64)).as_vec3();
    let inverse_focal = ((1.0 / camera.fx) as f32, (1.0 / camera.fy) as f32);
    SlantedPlane::new(truth.depth[pixel], truth.normal[pixel].into(), ray, inverse_focal)
}

/// Samples the reference's side of every patch.
struct Sample<'a>(&'a Patches);

impl Task for Sample<'_> {
    type Output = ReferencePatch;

    fn run<S: Simd>(self, simd: S) -> ReferencePatch {
        let Patches { window, reference, pixels, .. } = self.0;
        let mut patch = ReferencePatch::new(window);
        simd.vectorize(
            #[inline(always)]
            || {
                for &(x, y) in pixels {
                    patch.sample(simd, window, reference, x, y);
                    black_box(&patch);
                }
            },
        );
        patch
    }
}

/// Compares one sampled patch with what every homography makes of it.
struct Compare<'a>(&'a Patches, &'a ReferencePatch);

impl Task for Compare<'_> {
    type Output = f32;

    fn run<S: Simd>(self, simd: S) -> f32 {
        let Compare(Patches { window, source, homographies, .. }, patch) = self;
        simd.vectorize(
            #[inline(always)]
            || {
                let mut sum = 0.0;
                for homography in homographies {
                    sum += patch_cost(simd, window, patch, source, homography);
                }
                sum
            },
        )
    }
}

fn on_every_level(group: &mut BenchmarkGroup<WallTime>, mut run: impl FnMut(Level)) {
    for level in Level::ALL.into_iter().filter(|level| level.is_available()) {
        group.bench_function(level.name(), |bencher| bencher.iter(|| run(level)));
    }
}

fn kernels(criterion: &mut Criterion) {
    let patches = Patches::new(&procedural::plane_and_sphere());
    let sampled = dispatch(Level::Scalar, Sample(&patches));

    let mut group = criterion.benchmark_group("sample the reference patch");
    group.throughput(Throughput::Elements(patches.pixels.len() as u64));
    on_every_level(&mut group, |level| {
        black_box(dispatch(level, Sample(&patches)));
    });
    group.finish();

    let mut group = criterion.benchmark_group("patch cost");
    group.throughput(Throughput::Elements(patches.homographies.len() as u64));
    on_every_level(&mut group, |level| {
        black_box(dispatch(level, Compare(&patches, black_box(&sampled))));
    });
    group.finish();
}

/// One search of each of three small views: colonies filled, one iteration, the check.
fn search(criterion: &mut Criterion) {
    let mut made = procedural::plane_and_sphere().only(&[MIDDLE - 1, MIDDLE, MIDDLE + 1]);
    // A band of each image is enough.
    for view in &mut made.views {
        let width = view.camera.width as usize;
        view.mask =
            Some((0..view.camera.pixels()).map(|pixel| (40..56).contains(&(pixel / width))).collect());
    }
    let scene = made.scene();
    let scale = Scale { halvings: 0, foods: 4, first_iterations: 1, cycles: 0, cycle_iterations: 0 };
    let options = Options { threads: 1, scales: vec![scale], ..Options::default() };
    let mut group = criterion.benchmark_group("search");
    group.sample_size(10);
    group.bench_function("one iteration", |bencher| {
        bencher.iter(|| reconstruct(black_box(&scene), &options, &ignore_progress).unwrap());
    });
    group.finish();
}

fn fusion(criterion: &mut Criterion) {
    let made = procedural::plane_and_sphere();
    let count = made.views.len() as u32;
    let overlaps: Vec<Vec<u32>> =
        (0..count).map(|view| (0..count).filter(|&other| other != view).collect()).collect();
    let views: Vec<FusionView> = (made.views.iter().zip(&made.truth).zip(&overlaps))
        .map(|((view, maps), overlap)| FusionView {
            camera: &view.camera,
            maps,
            picture: Some(&view.picture),
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

criterion_group!(benches, kernels, search, fusion);
criterion_main!(benches);
