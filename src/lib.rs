//! skep turns calibrated photographs into depth, normal and source-view maps and a fused point cloud: dense
//! multi-view stereo on the CPU.
//!
//! It implements "Visibility-Aware Pixelwise View Selection for Multi-View Stereo Matching" (Huang et al.)
//! with an Artificial Multi-Bee Colony search. [`how_it_works`] explains the method with its formulas,
//! [`architecture`] the source. In the repository `docs/rust.md` is a guide, `docs/concepts.md` explains the
//! terms with pictures, and `docs/options.md` lists the options; `docs/README.md` has all pages.
//!
#![doc = include_str!("../docs/pipeline.svg")]
//!
//! # Four levels
//!
//! They can be mixed; most have a program in `examples/rust/`.
//!
//! **A whole run** ([`reconstruct`]) takes a [`Scene`] and [`Options`] and gives maps of all views and a
//! cloud:
//!
//! ```no_run
//! use skep::{Options, PixelStatus, Progress};
//! use std::ops::ControlFlow;
//!
//! let mut options = Options::default();
//! options.check.min_consistent_views = 3;
//! let progress = |at: &Progress| {
//!     eprintln!("{:.0} %", at.done * 100.0);
//!     ControlFlow::Continue(()) // Break cancels
//! };
//! let scene = skep::import::read_scene("SCENE".as_ref(), None, &options, &progress)?; // or Scene::new
//! let result = skep::reconstruct(&scene, &options, &progress)?;
//! for (view, found) in scene.views().iter().zip(&result.views) {
//!     let validated = found.status.iter().filter(|&&status| status == PixelStatus::Validated).count();
//!     println!("{}: {validated} of {} pixels validated", view.name, found.status.len());
//! }
//! skep::io::write_ply("cloud.ply".as_ref(), &result.points)?;
//! # Ok::<(), skep::Error>(())
//! ```
//!
//! **A run in a folder** ([`job::Job`], feature `io`) reads a scene from files, keeps to a budget of memory,
//! goes on after an interruption, and can be divided among processes and machines.
//!
//! **A stepwise run** ([`Stepper`]) searches, checks and finishes single views, for a host that schedules
//! them itself, on one machine or many, or provides maps of its own. It gives the same bits as
//! [`reconstruct`]:
//!
//! ```
//! use skep::{Checked, EstimateRef, Options, Scene, Searched, Stepper, ViewEstimate, ViewResult};
//! use skep::ignore_progress;
//!
//! fn reconstruct(scene: &Scene, options: &Options) -> skep::Result<Vec<ViewResult>> {
//!     let stepper = Stepper::new(scene, options)?;
//!     let mut estimates: Vec<ViewEstimate<Checked>> = Vec::new();
//!     let mut next = Some(0);
//!     while let Some(cycle) = next {
//!         let is_finer = |own: &ViewEstimate<Checked>| {
//!             stepper.cycles()[own.cycle()].scale_index < stepper.cycles()[cycle].scale_index
//!         };
//!         for own in &mut estimates {
//!             if is_finer(own) {
//!                 *own = stepper.upsample(cycle, own)?;
//!             }
//!         }
//!         // Before the first cycle no view has an estimate.
//!         let before: Vec<_> = (0..stepper.views()).map(|view| estimates.get(view)).collect();
//!         let search = |view| {
//!             let candidates = stepper.propagate(cycle, view, &before)?;
//!             stepper.search(cycle, view, &before, Some(&candidates), &ignore_progress)
//!         };
//!         let searched: Vec<ViewEstimate<Searched>> =
//!             (0..stepper.views()).map(search).collect::<skep::Result<_>>()?;
//!         let found: Vec<_> = searched.iter().map(|found| Some(EstimateRef::Searched(found))).collect();
//!         let check = |own| stepper.check(own, &found);
//!         estimates = searched.iter().map(check).collect::<skep::Result<_>>()?;
//!         next = stepper.next(cycle, &estimates.iter().map(Some).collect::<Vec<_>>())?;
//!     }
//!     let last: Vec<_> = estimates.iter().map(Some).collect();
//!     (0..stepper.views()).map(|view| stepper.finish(view, &last, &ignore_progress)).collect()
//! }
//! ```
//!
//! **The kernels** ([`matching`], [`geometry`], [`image`], [`simd`]) are stateless: plane-induced
//! homographies and bilaterally weighted normalized cross-correlation, generic over the instruction set:
//!
//! ```
//! use glam::{DMat3, DVec3, Vec3};
//! use skep::geometry::{Camera, RelativePose, SlantedPlane};
//! use skep::image::{PackedImage, Picture};
//! use skep::matching::{PatchHomography, ReferencePatch, Window, patch_cost};
//! use skep::simd::{Simd, SimdLevel, Task, dispatch};
//!
//! /// A wall at depth 2, seen by two cameras side by side: the second one sees it 10 pixels further left.
//! fn photograph(shift: u32) -> PackedImage {
//!     let gray = |pixel: u32| {
//!         let (x, y) = ((pixel % 64 + shift) as f64, (pixel / 64) as f64);
//!         (128.0 + 60.0 * (0.7 * x + 0.3 * y).sin() + 60.0 * (0.4 * x - 0.9 * y).sin()) as u8
//!     };
//!     PackedImage::new(&Picture::from_gray(64, 48, (0..64 * 48).map(gray).collect()).unwrap())
//! }
//!
//! /// `1 - NCC` of the patch around pixel (32, 24) for a plane at a depth that faces the camera.
//! struct Cost {
//!     depth: f32,
//! }
//!
//! impl Task for Cost {
//!     type Output = f32;
//!
//!     fn run<S: Simd>(self, simd: S) -> f32 {
//!         let (rotation, translation) = (DMat3::IDENTITY, DVec3::ZERO);
//!         let (fx, fy, cx, cy) = (50.0, 50.0, 31.5, 23.5);
//!         let left = Camera { width: 64, height: 48, fx, fy, cx, cy, rotation, translation };
//!         let right = Camera { translation: DVec3::new(-0.4, 0.0, 0.0), ..left };
//!         let pose = RelativePose::new(&left, &right);
//!         let ray = left.ray((32.0, 24.0).into()).as_vec3();
//!         let plane = SlantedPlane::new(self.depth, Vec3::NEG_Z, ray, (1.0 / 50.0, 1.0 / 50.0));
//!         let homography = PatchHomography::of_plane(&pose, pose.at_infinity(32.0, 24.0), &plane);
//!         let window = Window::new(3, 2, 3.0, 0.2, 1e-5);
//!         let (reference, source) = (photograph(0), photograph(10));
//!         let mut patch = ReferencePatch::new(&window);
//!         simd.vectorize(
//!             #[inline(always)]
//!             || {
//!                 patch.sample(simd, &window, &reference, 32, 24);
//!                 patch_cost(simd, &window, &patch, &source, &homography)
//!             },
//!         )
//!     }
//! }
//!
//! let cost = |depth| dispatch(SimdLevel::detect(), Cost { depth });
//! let costs = [1.8, 2.0, 2.2].map(cost);
//! assert!(costs[1] < 0.01 && costs[0] > 0.1 && costs[2] > 0.1, "{costs:?}");
//! ```
//!
//! # Conventions
//!
//! `x_cam = R * X_world + t`, x right, y down, z forward. The center of the top-left pixel is (0, 0). Depth
//! is z in the camera frame, 0 where there is none. Normals are unit, in the camera frame of their view, and
//! face the camera. Lenses must be undistorted: [`geometry::Camera`] is a pinhole. Vectors and matrices of
//! the API are those of glam 0.34.
//!
//! # Threads
//!
//! [`reconstruct`] makes a thread pool of its own ([`Options::threads`]) and joins it before it returns; it
//! may be called from several threads at once. Stepwise calls and [`fusion::fuse`] run on the rayon pool on
//! which they are called. All types are `Send` and `Sync`; there is no global state. The result does not
//! depend on the number of threads, nor on the SIMD level: the same scene, options and version give the same
//! bits. A progress function may be called from any worker thread, several calls at a time, and cancels by
//! returning `Break`.
//!
//! # Errors
//!
//! Every fallible call returns [`Error`], which names the argument or file, its value and what was expected.
//! Nothing is printed. A panic is a bug, except where a section "Panics" names the case. A pixel without a
//! depth is no error, it has a [`PixelStatus`].
//!
//! # Features
//!
//! | feature | what it adds |
//! |---|---|
//! | `capi` (default) | the C ABI of `include/skep.h`, with `io` |
//! | `io` | the modules `io` (COLMAP models and maps, PNG and JPEG pictures, PLY, previews) and `job` (runs in a folder) |
//! | `cli` | the program `skep`, with `io` |
//!
//! Without any the crate depends on glam, rayon and wide alone.
//!
//! # Limits
//!
//! - Rust 1.95 or newer. AVX2 is detected at run time on x86-64; elsewhere the kernels use the baseline of
//!   the target (NEON, wasm simd128, SSE2) or scalar code. `SKEP_SIMD=scalar|baseline|v3` forces a level.
//! - Pinhole cameras without distortion, images up to 32,768 pixels a side, 8 bits a channel (16 are
//!   rounded). Matching uses the gray values.
//! - The maps of all views are in memory during [`reconstruct`]; [`job::Job`] keeps to a budget, and [`Stepper`]
//!   lets a host keep them elsewhere.
//! - Two views are the least; the default validates what two other views confirm, and fuses what three
//!   confirm.

// The library neither prints nor exits the process.
#![warn(clippy::print_stdout, clippy::print_stderr, clippy::exit)]
// `pub` is what the public API needs; everything else is `pub(crate)`.
#![warn(unreachable_pub)]

mod ambc;
#[cfg(feature = "capi")]
mod capi;
mod cross_view;
mod error;
pub mod fusion;
pub mod geometry;
pub mod image;
#[cfg(feature = "io")]
pub mod import;
#[cfg(feature = "io")]
pub mod io;
#[cfg(feature = "io")]
pub mod job;
pub mod matching;
mod memory;
mod options;
mod parallel;
mod pipeline;
mod refine;
mod scene;
pub mod simd;
#[cfg(test)]
mod testing;
mod view_selection;

pub use ambc::Counts;
pub use error::{Error, Result};
pub use fusion::{PointCloud, PointViews};
pub use geometry::DepthRange;
pub use memory::{available_memory, format_bytes, parse_bytes};
pub use options::{
    CheckOptions, CloudFormat, CostOptions, FusionOptions, InputOptions, Kind, OptionInfo, OptionValue,
    Options, OutputOptions, RefineOptions, Scale, ScheduleOptions, SearchOptions, ViewFiles,
    ViewSelectionOptions, WindowOptions,
};
pub use parallel::{Phase, Progress, ProgressFn, ignore_progress};
pub use pipeline::{
    AnyEstimate, Candidates, Checked, Cycle, CycleRecord, EstimateRef, OwnMaps, Reconstruction, Searched,
    Stepper, ViewEstimate, ViewResult, reconstruct, thread_count,
};
pub use scene::{Maps, PixelStatus, Scene, SparsePoint, View};

/// The method, stage by stage, with its formulas.
///
#[doc = include_str!("../docs/matching.svg")]
///
#[doc = include_str!("how_it_works.md")]
pub mod how_it_works {}

/// The modules of the source, the data flow and the invariants.
///
#[doc = include_str!("../docs/architecture.md")]
pub mod architecture {}

/// Compiles the examples of the README.
#[cfg(all(doctest, feature = "io"))]
#[doc = include_str!("../README.md")]
struct Readme;

/// Compiles the examples of the guide, of which those that need no files run.
#[cfg(all(doctest, feature = "io"))]
#[doc = include_str!("../docs/rust.md")]
struct Guide;
