//! What a run needs: memory, disk and time.

use super::estimates::BYTES_PER_PIXEL;
use crate::error::{Error, Result};
use crate::memory::{available_memory, format_bytes};
use crate::options::Options;
use crate::pipeline::{Stepper, thread_count};
use crate::scene::Scene;

/// Fraction of the available memory that a run takes by default.
const DEFAULT_FRACTION: f64 = 0.75;
/// Memory where the system does not tell how much there is.
const DEFAULT_MEMORY: u64 = 4 << 30;
/// Memory of the program, its threads and allocator, before any image.
const BASE: u64 = 192 << 20;
/// Bytes for each pixel of a view's search besides images and estimates: the planes found, view sets,
/// candidates, and the copy that is written.
const SEARCH_BYTES: u64 = 130;
/// Bytes of a packed image for each pixel.
const IMAGE_BYTES: u64 = 2;
/// Bytes of a scene for each pixel of a view while its photograph is decoded.
const DECODE_BYTES: u64 = 12;
/// Bytes of a view's maps, previews and points on disk for each pixel; 98 to 112 on photographs, by the size of
/// the view sets.
const MAP_BYTES: u64 = 115;
/// Bytes of a view's checked estimate for each pixel, which stays until the cloud is written. Before there are
/// maps the estimates take 70: of the cycle before, searched and checked.
const ESTIMATE_BYTES: u64 = 22;
/// CPU seconds for each unit of work and source view; measured on one core of a server with AVX2.
const SECONDS_PER_UNIT: f64 = 1.9e-7;

/// What a run needs, estimated before it starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Needs {
    /// The least memory in bytes with which the run works.
    pub least_memory: u64,
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
    /// Tasks at a time.
    pub tasks: usize,
    /// Bytes of packed images that are kept.
    pub images: usize,
    /// Bytes of estimates that are kept.
    pub estimates: usize,
    /// Bytes of finished views that the fusion keeps beyond those it needs.
    pub fusion: usize,
}

/// The bytes that a run keeps to: those of the option, or a fraction of what is available.
pub(super) fn budget(options: &Options) -> u64 {
    match options.memory {
        0 => available_memory().map_or(DEFAULT_MEMORY, |bytes| (bytes as f64 * DEFAULT_FRACTION) as u64),
        bytes => bytes,
    }
}

/// Bytes that the fusion needs: a view and those it is compared with, at the same time.
fn fusion_bytes(scene: &Scene, overlaps: &[Vec<u32>]) -> u64 {
    let bytes =
        |view: usize| scene.views()[view].camera.pixels() as u64 * super::fuse::BYTES_PER_PIXEL as u64;
    let group =
        |view: usize| bytes(view) + overlaps[view].iter().map(|&other| bytes(other as usize)).sum::<u64>();
    (0..scene.views().len()).map(group).max().unwrap_or(0)
}

/// Bytes of the largest task: a view with the estimates and images of all views it reads.
fn largest_task(scene: &Scene, stepper: &Stepper, readers: &[Vec<u32>]) -> u64 {
    let pixels = |view: usize| scene.views()[view].camera.pixels() as u64;
    let of_view = |view: usize| {
        let sources = stepper.sources(view);
        let images: u64 = sources.iter().map(|&source| pixels(source as usize) * IMAGE_BYTES).sum();
        let mut read: Vec<u32> = sources.iter().chain(&readers[view]).copied().collect();
        read.sort_unstable();
        read.dedup();
        let estimates: u64 = read.iter().map(|&other| pixels(other as usize) * BYTES_PER_PIXEL as u64).sum();
        let own = pixels(view) * (BYTES_PER_PIXEL as u64 + IMAGE_BYTES + SEARCH_BYTES + DECODE_BYTES);
        images + estimates + own
    };
    (0..scene.views().len()).map(of_view).max().unwrap_or(0)
}

/// What a run needs, and how it divides its memory among `threads` threads.
///
/// # Errors
/// A budget below the least with which the run works.
pub(super) fn needs(
    scene: &Scene,
    options: &Options,
    stepper: &Stepper,
    readers: &[Vec<u32>],
    overlaps: &[Vec<u32>],
) -> Result<(Needs, Shares)> {
    let threads = thread_count(scene, options);
    let pixels: u64 = scene.views().iter().map(|view| view.camera.pixels() as u64).sum();
    let task = largest_task(scene, stepper, readers);
    let observations: u64 = scene.points().iter().map(|point| 48 + 4 * point.views.len() as u64).sum();
    let base = BASE + observations;
    // One bit of each pixel tells the fusion what is part of a point already. Not part of the base: of many
    // views it is more than another task takes.
    let fusion = fusion_bytes(scene, overlaps) + pixels / 8;
    let least_memory = base + task.max(fusion);
    let memory = budget(options);
    if memory < least_memory {
        let expected =
            format!("at least {} for these photographs ({least_memory} bytes)", format_bytes(least_memory));
        return Err(Error::argument("options.memory", format_bytes(memory), expected));
    }
    // As many tasks at a time as keep the threads busy, and fit.
    let wanted = 1 + (threads as u64 + 2) / 4;
    let tasks = ((memory - base) / task.max(1)).clamp(1, wanted);
    let rest = memory - base - tasks * task;
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
        tasks: tasks as usize,
        images: images as usize,
        estimates: (rest - images) as usize,
        fusion: (memory - base - fusion) as usize,
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
    let disk = pixels * (MAP_BYTES + ESTIMATE_BYTES);
    Ok((Needs { least_memory, memory, disk, cpu_seconds: work * SECONDS_PER_UNIT }, shares))
}
