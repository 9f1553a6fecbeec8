//! Throughput of the kernels at each SIMD level, on one thread: `cargo bench --bench kernels`.
//!
//! An element is a patch, or a sample where the name ends in samples: Melem/s are millions of NCC evaluations
//! or samples per second. The patches are those of a procedural view at its true planes, so that cache hits
//! are those of a converged search.

#[path = "../tests/common/mod.rs"]
mod common;

use common::procedural::{self, MIDDLE, Procedural};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use skep::geometry::{Camera, RelativePose, SlantedPlane};
use skep::image::PackedImage;
use skep::matching::{PatchHomography, ReferencePatch, Window, patch_cost, patch_costs};
use skep::simd::{LANES, Simd, SimdLevel, Task, dispatch};
use std::hint::black_box;

/// Source views; the benches with one source view use the first.
const VIEWS: [usize; 4] = [MIDDLE - 2, MIDDLE - 1, MIDDLE + 1, MIDDLE + 2];

/// Pixels of the reference view with their true planes, and the source views.
struct Patches {
    window: Window,
    reference: PackedImage,
    pixels: Vec<(usize, usize)>,
    planes: Vec<SlantedPlane>,
    sources: Vec<Source>,
}

struct Source {
    image: PackedImage,
    pose: RelativePose,
    /// Homographies of the true planes, one per pixel.
    homographies: Vec<PatchHomography>,
}

impl Patches {
    fn new(scene: &Procedural, window: Window) -> Patches {
        let view = &scene.views[MIDDLE];
        let camera = &view.camera;
        let is_chosen = |&(x, y): &(usize, usize)| x % 4 == 0 && y % 4 == 0;
        let (width, height) = (camera.width as usize, camera.height as usize);
        let pixels: Vec<(usize, usize)> =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).filter(is_chosen).collect();
        let planes: Vec<SlantedPlane> =
            pixels.iter().map(|&pixel| true_plane(scene, camera, pixel)).collect();
        let source = |view: usize| {
            let pose = RelativePose::new(camera, &scene.views[view].camera);
            let homography = |(&(x, y), plane): (&(usize, usize), &SlantedPlane)| {
                PatchHomography::of_plane(&pose, pose.at_infinity(x as f32, y as f32), plane)
            };
            let image = PackedImage::new(&scene.views[view].picture.load().unwrap());
            Source { image, pose, homographies: pixels.iter().zip(&planes).map(homography).collect() }
        };
        let sources = VIEWS.map(source).into();
        Patches {
            window,
            reference: PackedImage::new(&view.picture.load().unwrap()),
            pixels,
            planes,
            sources,
        }
    }
}

fn true_plane(scene: &Procedural, camera: &Camera, (x, y): (usize, usize)) -> SlantedPlane {
    let pixel = y * camera.width as usize + x;
    let truth = &scene.truth[MIDDLE];
    let ray = camera.ray(DVec2::new(x as f64, y as f64)).as_vec3();
    let inverse_focal = ((1.0 / camera.fx) as f32, (1.0 / camera.fy) as f32);
    SlantedPlane::new(truth.depth[pixel], truth.normal[pixel].into(), ray, inverse_focal)
}

/// Samples the reference side of every patch.
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

/// Matches one sampled patch in the first source view, by the true plane of every pixel: homography and NCC.
struct Match<'a>(&'a Patches, &'a ReferencePatch);

impl Task for Match<'_> {
    type Output = f32;

    fn run<S: Simd>(self, simd: S) -> f32 {
        let Match(Patches { window, pixels, planes, sources, .. }, patch) = self;
        let Source { image, pose, .. } = &sources[0];
        simd.vectorize(
            #[inline(always)]
            || {
                let mut sum = 0.0;
                for (&(x, y), plane) in pixels.iter().zip(planes) {
                    let homography =
                        PatchHomography::of_plane(pose, pose.at_infinity(x as f32, y as f32), plane);
                    sum += patch_cost(simd, window, patch, image, &homography);
                }
                sum
            },
        )
    }
}

/// Samples each patch of the reference view and matches it in all source views.
struct MatchViews<'a>(&'a Patches);

impl Task for MatchViews<'_> {
    type Output = f32;

    fn run<S: Simd>(self, simd: S) -> f32 {
        let Patches { window, reference, pixels, planes, sources } = self.0;
        let mut patch = ReferencePatch::new(window);
        simd.vectorize(
            #[inline(always)]
            || {
                let mut sum = 0.0;
                for (&(x, y), plane) in pixels.iter().zip(planes) {
                    patch.sample(simd, window, reference, x, y);
                    let view = |index: usize| {
                        let Source { image, pose, .. } = &sources[index];
                        (image, PatchHomography::of_plane(pose, pose.at_infinity(x as f32, y as f32), plane))
                    };
                    sum += patch_costs(simd, window, &patch, view, 0b1111)[0];
                }
                sum
            },
        )
    }
}

/// Computes the homographies alone.
struct Homographies<'a>(&'a Patches);

impl Task for Homographies<'_> {
    type Output = ();

    fn run<S: Simd>(self, simd: S) {
        let Patches { pixels, planes, sources, .. } = self.0;
        let pose = &sources[0].pose;
        simd.vectorize(
            #[inline(always)]
            || {
                for (&(x, y), plane) in pixels.iter().zip(planes) {
                    black_box(PatchHomography::of_plane(pose, pose.at_infinity(x as f32, y as f32), plane));
                }
            },
        );
    }
}

/// Loads the taps of [`Match`] at precomputed indices, and does nothing else: a lower bound of its time.
struct Gather<'a>(&'a PackedImage, &'a [[u32; LANES]]);

impl Task for Gather<'_> {
    type Output = [u32; LANES];

    fn run<S: Simd>(self, simd: S) -> [u32; LANES] {
        let Gather(image, indices) = self;
        simd.vectorize(
            #[inline(always)]
            || {
                let mut sums = [0u32; LANES];
                for indices in indices {
                    let taps = simd.gather(&image.taps, indices);
                    for (sum, tap) in sums.iter_mut().zip(taps) {
                        *sum = sum.wrapping_add(tap);
                    }
                }
                sums
            },
        )
    }
}

/// Indices of the pairs under the 36 samples of every patch in the first source view, eight per vector; the
/// last vector repeats a sample.
fn pair_indices(patches: &Patches) -> Vec<[u32; LANES]> {
    let Source { image, homographies, .. } = &patches.sources[0];
    let offsets: Vec<(f32, f32)> =
        (-5..=5).step_by(2).flat_map(|y| (-5..=5).step_by(2).map(move |x| (x as f32, y as f32))).collect();
    let mut indices = Vec::new();
    for PatchHomography { center, along_x, along_y } in homographies {
        for eight in offsets.chunks(LANES) {
            indices.push(std::array::from_fn(|lane| {
                let (dx, dy) = eight[lane.min(eight.len() - 1)];
                let point = *center + dx * *along_x + dy * *along_y;
                let clamp = |at: f32, size: usize| at.clamp(0.0, (size - 1) as f32) as usize;
                let (x, y) = (clamp(point.x / point.z, image.width), clamp(point.y / point.z, image.height));
                (y * image.taps.stride() + x) as u32
            }));
        }
    }
    indices
}

fn on_every_level(group: &mut BenchmarkGroup<WallTime>, mut run: impl FnMut(SimdLevel)) {
    for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
        group.bench_function(level.name(), |bencher| bencher.iter(|| run(level)));
    }
}

fn kernels(criterion: &mut Criterion) {
    let scene = procedural::plane_and_sphere();
    let mut group_of = |name: &str, elements: usize, run: &mut dyn FnMut(SimdLevel)| {
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Elements(elements as u64));
        on_every_level(&mut group, run);
        group.finish();
    };
    let windows = [
        ("24 samples", Window::disc(5, 2, 3.0, 0.03, 1e-5)),
        ("36 samples", Window::new(5, 2, 3.0, 0.03, 1e-5)),
        ("121 samples", Window::new(5, 1, 3.0, 0.03, 1e-5)),
    ];
    for (name, window) in windows {
        let patches = Patches::new(&scene, window);
        let sampled = dispatch(SimdLevel::Scalar, Sample(&patches));
        let count = patches.pixels.len();
        group_of(&format!("homography and NCC of a patch, {name}"), count, &mut |level| {
            black_box(dispatch(level, Match(&patches, black_box(&sampled))));
        });
        group_of(&format!("a pixel with 4 source views, {name}"), count * VIEWS.len(), &mut |level| {
            black_box(dispatch(level, MatchViews(black_box(&patches))));
        });
        group_of(&format!("reference side of a patch, {name}"), count, &mut |level| {
            black_box(dispatch(level, Sample(black_box(&patches))));
        });
    }
    let patches = Patches::new(&scene, Window::new(5, 2, 3.0, 0.03, 1e-5));
    let count = patches.pixels.len();
    let indices = pair_indices(&patches);
    group_of("loading the taps of 36-sample patches, samples", 36 * count, &mut |level| {
        black_box(dispatch(level, Gather(&patches.sources[0].image, black_box(&indices))));
    });
    group_of("homography alone", count, &mut |level| {
        dispatch(level, Homographies(black_box(&patches)));
    });
}

criterion_group!(benches, kernels);
criterion_main!(benches);
