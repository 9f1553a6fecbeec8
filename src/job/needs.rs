//! What a run needs: memory, disk and time.

use super::estimates::{PLANE_BYTES, SURFACE_BYTES};
use crate::error::{Error, Result};
use crate::fusion::streamed_bytes;
use crate::memory::{format_bytes, memory_budget};
use crate::options::{Options, ViewFiles};
use crate::pipeline::{Stepper, thread_count};
use crate::scene::{Scene, SparsePoint};

/// Memory of the program, its threads and allocator, before any image.
pub(super) const BASE: u64 = 192 << 20;
/// Bytes for each pixel of a view that its search takes besides images and estimates: the planes found, view
/// sets and candidates.
const SEARCH_BYTES: u64 = 110;
/// The same of its check: a copy of the estimate, verdicts and filtered planes.
const CHECK_BYTES: u64 = 80;
/// The same of its end: averaged and filled planes, and the maps.
const FINISH_BYTES: u64 = 130;
/// Bytes of a packed image for each pixel.
const IMAGE_BYTES: u64 = 2;
/// Bytes of a scene for each pixel of a view while its photograph is decoded.
const DECODE_BYTES: u64 = 12;
/// Bytes on disk for each pixel of a view's depth maps, raw and validated; confidence maps take the same,
/// normal maps three times as much.
const DEPTH_BYTES: u64 = 8;
/// The same of consistency graphs, previews and status maps, on photographs.
const GRAPH_BYTES: u64 = 60;
const PREVIEW_BYTES: u64 = 5;
const STATUS_BYTES: u64 = 1;
/// The same of validated depths, normals and confidences, which the fusion reads.
const FUSED_BYTES: u64 = 20;
/// The same of the points, in temporary files and written, and of a scene for Gaussian splatting.
const CLOUD_BYTES: u64 = 30;
const SPLAT_BYTES: u64 = 25;
/// Bytes of a view's checked estimate and its surface for each pixel, which stay until the cloud is written.
/// Before there are maps the estimates take 86: of the cycle before, searched and checked.
const ESTIMATE_BYTES: u64 = 30;
/// CPU seconds for each unit of work and source view; measured on one core of a server with AVX2.
const SECONDS_PER_UNIT: f64 = 1.9e-7;

/// What a run needs, estimated before it starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Needs {
    /// The least memory in bytes with which the run works.
    pub least_memory: u64,
    /// The memory in bytes that the run is expected to take: more than [`Needs::least_memory`] where more
    /// makes it faster, and no more than [`Needs::memory`].
    pub expected_memory: u64,
    /// The memory in bytes that the run keeps to.
    pub memory: u64,
    /// Bytes on disk, at most at any time.
    pub disk: u64,
    /// CPU seconds of all threads together, within a factor of about two.
    pub cpu_seconds: f64,
}

/// How a run divides its memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shares {
    /// The least bytes with which the tasks of views work, and the fusion.
    pub least: Least,
    /// Tasks at a time.
    pub tasks: usize,
    /// Bytes of packed images that are kept.
    pub images: usize,
    /// Bytes of estimates that are kept.
    pub estimates: usize,
    /// Bytes of finished views that the fusion keeps beyond those it needs.
    pub fusion: usize,
}

/// The least bytes that parts of a run need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Least {
    /// Of the program and the scene.
    pub base: u64,
    /// Beyond that, of a task of a view.
    pub view: u64,
    /// Beyond that, of the fusion.
    pub fusion: u64,
}

impl Needs {
    /// Returns an error if the run keeps to less memory than these bytes, which a part of it needs.
    pub(super) fn require(&self, least: u64) -> Result<()> {
        if self.memory >= least {
            return Ok(());
        }
        let expected = format!("at least {} for these photographs ({least} bytes)", format_bytes(least));
        Err(Error::argument("options.memory", format_bytes(self.memory), expected))
    }
}

/// Bytes of sparse points in memory.
pub(super) fn point_bytes(points: &[SparsePoint]) -> u64 {
    points.iter().map(|point| 48 + 4 * point.views.len() as u64).sum()
}

/// Bytes on disk for each pixel of a view's files.
fn view_file_bytes(files: &ViewFiles) -> u64 {
    let bytes = |is_on: bool, bytes: u64| if is_on { bytes } else { 0 };
    let maps = bytes(files.depth, DEPTH_BYTES)
        + bytes(files.normals, 3 * DEPTH_BYTES)
        + bytes(files.confidence, DEPTH_BYTES);
    let temporary = bytes(!files.has_fused_maps(), FUSED_BYTES);
    maps + temporary
        + bytes(files.graphs, GRAPH_BYTES)
        + bytes(files.previews, PREVIEW_BYTES)
        + bytes(files.status, STATUS_BYTES)
}

/// Bytes on disk for each pixel of the cloud, at most at any time.
fn cloud_bytes(options: &Options) -> u64 {
    CLOUD_BYTES + if options.output.splat { SPLAT_BYTES } else { 0 }
}

/// Bytes of the largest task: a view with what it reads of other views.
fn largest_task(scene: &Scene, stepper: &Stepper) -> u64 {
    let pixels = |view: usize| scene.views()[view].camera.pixels() as u64;
    let of_view = |view: usize| {
        let sources = stepper.sources(view);
        let of_sources: u64 = sources.iter().map(|&source| pixels(source as usize)).sum();
        let set_bytes = 4 * (sources.len() as u64).div_ceil(32).max(1);
        // Donors are read one after another, and released before the search.
        let donor = stepper.readers(view).iter().map(|&donor| pixels(donor as usize)).max().unwrap_or(0);
        let search = of_sources * SURFACE_BYTES + (donor * PLANE_BYTES).max(pixels(view) * SEARCH_BYTES);
        let check = of_sources * (PLANE_BYTES + set_bytes) + pixels(view) * (CHECK_BYTES + set_bytes);
        let finish = of_sources * (SURFACE_BYTES + PLANE_BYTES) + pixels(view) * FINISH_BYTES;
        let images = of_sources * IMAGE_BYTES + pixels(view) * (IMAGE_BYTES + DECODE_BYTES);
        images + pixels(view) * (PLANE_BYTES + set_bytes) + search.max(check).max(finish)
    };
    (0..scene.views().len()).map(of_view).max().unwrap_or(0)
}

/// Bytes of the estimates that are worth keeping. Views that follow each other in the list mostly have each
/// other as sources: what a task reads and the tasks before it wrote is read again by the next ones, and the
/// rest seldom before the next cycle.
fn useful_estimates(scene: &Scene, stepper: &Stepper, tasks: u64) -> u64 {
    let largest = scene.views().iter().map(|view| view.camera.pixels() as u64).max().unwrap_or(0);
    let read = (0..stepper.views()).map(|view| stepper.views_read_by(view).len()).max().unwrap_or(0) as u64;
    (read + 2 * tasks) * largest * (PLANE_BYTES + SURFACE_BYTES)
}

/// What a run needs, and how it divides its memory.
pub(super) fn needs(
    scene: &Scene,
    options: &Options,
    stepper: &Stepper,
    (references, overlaps): (&[usize], &[Vec<u32>]),
) -> (Needs, Shares) {
    let threads = thread_count(scene, options);
    let pixels: u64 = scene.views().iter().map(|view| view.camera.pixels() as u64).sum();
    let task = largest_task(scene, stepper);
    let base = BASE + point_bytes(scene.points());
    // With a bit of each pixel of all views, which of many views is more than another task takes.
    let cameras: Vec<_> = references.iter().map(|&view| &scene.views()[view].camera).collect();
    let fusion = streamed_bytes(&cameras, overlaps);
    let least = Least { base, view: task, fusion };
    let memory = memory_budget(options.memory);
    // As many tasks at a time as keep the threads busy, and fit.
    let wanted = 1 + (threads as u64 + 2) / 4;
    let tasks = (memory.saturating_sub(base) / task.max(1)).clamp(1, wanted);
    let rest = memory.saturating_sub(base + tasks * task);
    let all_images: u64 = stepper
        .cycles()
        .iter()
        .map(|cycle| u64::from(cycle.scale.downscale))
        .collect::<std::collections::BTreeSet<_>>()
        .into_iter()
        .map(|downscale| pixels * IMAGE_BYTES / (downscale * downscale))
        .sum();
    let images = all_images.min(rest / 3);
    let shares = Shares {
        least,
        tasks: tasks as usize,
        images: images as usize,
        estimates: (rest - images).min(useful_estimates(scene, stepper, tasks)) as usize,
        fusion: memory.saturating_sub(base + fusion) as usize,
    };
    let work: f64 = (0..scene.views().len())
        .map(|view| {
            let own = scene.views()[view].camera.pixels() as u64;
            let units =
                |cycle: &crate::pipeline::Cycle| cycle.work(own / u64::from(cycle.scale.downscale).pow(2));
            let units: u64 = stepper.cycles().iter().map(units).sum();
            units as f64 * stepper.sources(view).len() as f64
        })
        .sum();
    let written: u64 = cameras.iter().map(|camera| camera.pixels() as u64).sum();
    let disk =
        pixels * ESTIMATE_BYTES + written * (view_file_bytes(&options.output.write) + cloud_bytes(options));
    let least_memory = base + task.max(fusion);
    let of_views = tasks * task + (shares.images + shares.estimates) as u64;
    // The fusion keeps finished views as long as there is room.
    let of_fusion = fusion.max(written * FUSED_BYTES);
    let expected_memory = (base + of_views.max(of_fusion)).min(memory);
    let cpu_seconds = work * SECONDS_PER_UNIT;
    (Needs { least_memory, expected_memory, memory, disk, cpu_seconds }, shares)
}
