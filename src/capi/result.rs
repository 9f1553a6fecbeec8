//! A whole run in C, and what it hands out for each view.

use super::cloud::skep_cloud;
use super::maps::{self, Plain};
use super::options::{options_or_default, skep_options};
use super::pointers::{destroy, get, give_list, out};
use super::progress::{Host, skep_progress_fn};
use super::scene::{give_text, skep_scene};
use super::status::{Failure, guard, skep_status};
use crate::fusion::PointCloud;
use crate::pipeline::ViewResult;
use crate::pipeline::reconstruct;
use crate::scene::PixelStatus;
use std::collections::BTreeMap;
use std::ffi::{c_char, c_void};
use std::sync::Arc;

/// Maps of views, and the cloud when they come from a whole run. Never changes: may be used from several threads at
/// once.
pub struct skep_result {
    /// By the view's number in the scene.
    pub(super) views: BTreeMap<u32, ViewResult>,
    points: Option<Arc<PointCloud>>,
    warnings: Vec<String>,
}

/// The raw estimate of every pixel.
pub const SKEP_MAPS_RAW: u32 = 0;
/// What was validated by other views; the rest is empty.
pub const SKEP_MAPS_VALIDATED: u32 = 1;

/// The solution is consistent with enough source views.
pub const SKEP_PIXEL_VALIDATED: u8 = 0;
/// The mask leaves the pixel out.
pub const SKEP_PIXEL_MASKED: u8 = 1;
/// The window around the pixel is too uniform to be matched.
pub const SKEP_PIXEL_NO_TEXTURE: u8 = 2;
/// Fewer than two source views can see the solution.
pub const SKEP_PIXEL_NO_SOURCES: u8 = 3;
/// Too few source views agree with the solution.
pub const SKEP_PIXEL_INCONSISTENT: u8 = 4;
/// The solution lies at an end of the depth range: the surface may lie beyond.
pub const SKEP_PIXEL_OUT_OF_RANGE: u8 = 5;

/// What a view cost and what became of its pixels. Counts depend on input and options only, not on the machine.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_statistics {
    /// Patches compared with a patch in one source view.
    pub ncc_evaluations: u64,
    /// Bilinear samples taken from source views.
    pub bilinear_samples: u64,
    /// Hypotheses given up before all their source views were looked at.
    pub early_terminations: u64,
    /// Number of pixels of each SKEP_PIXEL_ value; those beyond the last are 0.
    pub status_counts: [u64; 8],
}

/// One cycle's search of one view.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_cycle_record {
    /// Size of the images: 1 is full, 2 half, 4 a quarter.
    pub downscale: u32,
    /// The cycle on that scale, counted from 0.
    pub cycle: u32,
    /// Pixels searched.
    pub pixels: u64,
    /// Pixels whose solution changed.
    pub changed: u64,
    /// Pixels validated by the check after it.
    pub validated: u64,
}

impl skep_cycle_record {
    pub fn of(record: &crate::CycleRecord) -> skep_cycle_record {
        let crate::CycleRecord { downscale, cycle, pixels, changed, validated } = *record;
        skep_cycle_record { downscale, cycle, pixels, changed, validated }
    }
}

impl skep_result {
    pub fn of_view(view: u32, result: ViewResult) -> skep_result {
        skep_result { views: BTreeMap::from([(view, result)]), points: None, warnings: Vec::new() }
    }

    /// The cloud of a whole run.
    pub fn cloud(&self) -> Option<&PointCloud> {
        self.points.as_deref()
    }

    pub fn view(&self, view: u32) -> Result<&ViewResult, Failure> {
        self.views.get(&view).ok_or_else(|| {
            let views: Vec<String> = self.views.keys().map(u32::to_string).collect();
            Failure::argument("view", view, format!("one of those in the result: {}", views.join(", ")))
        })
    }
}

/// Estimates depth, normal and source views of every pixel of every view, and fuses what was validated.
///
/// Runs on threads of its own (option "threads"), which have ended when it returns; any number of runs may go on at the
/// same time. The same scene, options and library version give the same bits for any number of threads and any
/// instruction set. When it is cancelled or fails, `result_out` is not written.
///
/// SKEP_ERR_ARGUMENT: the scene is not in order (see skep_scene_validate) or an option is out of range.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_reconstruct(
    scene: *const skep_scene,
    options_or_null: *const skep_options,
    progress_or_null: skep_progress_fn,
    user: *mut c_void,
    result_out: *mut *mut skep_result,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, options, out) = unsafe {
            (get(scene, "scene")?, options_or_default(options_or_null)?, out(result_out, "result_out")?)
        };
        let host = Host::new(progress_or_null, user);
        let found = reconstruct(&scene.checked()?, &options, &|at| host.tell(at))?;
        out.give(skep_result {
            views: (0..).zip(found.views).collect(),
            points: Some(Arc::new(found.points)),
            warnings: found.warnings,
        });
        Ok(())
    })
}

/// Destroys a result; NULL is ignored. Clouds taken from it stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_destroy(result: *mut skep_result) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(result) };
        Ok(())
    });
}

/// The cloud of a whole run, as an object of its own that is destroyed by itself; the points are not copied.
///
/// SKEP_ERR_ARGUMENT: the result of a single view has no cloud.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_cloud(
    result: *const skep_result,
    cloud_out: *mut *mut skep_cloud,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (result, out) = unsafe { (get(result, "result")?, out(cloud_out, "cloud_out")?) };
        let points = result.points.clone().ok_or_else(|| {
            Failure::argument(
                "result",
                "that of a single view",
                "that of skep_reconstruct; or fuse with skep_fuse",
            )
        })?;
        out.give(skep_cloud { points });
        Ok(())
    })
}

/// The numbers of the views in a result, ascending: all of the scene's after a whole run. `views` may be NULL to only
/// ask for how many there are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_views(
    result: *const skep_result,
    views: *mut u32,
    capacity: usize,
    count_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let result = unsafe { get(result, "result") }?;
        let list: Vec<u32> = result.views.keys().copied().collect();
        // SAFETY: as the header demands of the caller.
        unsafe { give_list(&list, views, capacity, count_out, ("views", "count_out")) }
    })
}

/// Copies one of the sentences about the run that its user should read, such as views without any source view;
/// `index` counts from 0. See skep_scene_get_name for the buffer.
///
/// SKEP_ERR_ARGUMENT: there is no such warning; asking until then lists them all.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_warning(
    result: *const skep_result,
    index: usize,
    buffer: *mut c_char,
    capacity: usize,
    needed_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let result = unsafe { get(result, "result") }?;
        let warning = result.warnings.get(index).ok_or_else(|| {
            Failure::argument(
                "index",
                index,
                format!("below the number of warnings, {}", result.warnings.len()),
            )
        })?;
        // SAFETY: as the header demands of the caller.
        unsafe { give_text(warning, buffer, capacity, needed_out) }
    })
}

/// Fills the caller's map with what `value` gives for each pixel of a view that `check` lets pass.
///
/// # Safety
/// `result` is NULL or points to a result; `data` is NULL or points to rows of the view's size, `stride_bytes` apart.
unsafe fn give_map<T: Plain>(
    result: *const skep_result,
    view: u32,
    data: *mut T,
    stride_bytes: usize,
    check: impl FnOnce(&ViewResult) -> Result<(), Failure>,
    value: impl Fn(&ViewResult, usize) -> T,
) -> skep_status {
    guard(|| {
        // SAFETY: as promised by the caller.
        let view = unsafe { get(result, "result") }?.view(view)?;
        check(view)?;
        // SAFETY: as promised by the caller.
        let out = unsafe { maps::out(data, view.size(), stride_bytes, "out") }?;
        out.set(|pixel| value(view, pixel));
        Ok(())
    })
}

/// Refuses what is no SKEP_MAPS_ value.
fn check_which(which: u32) -> Result<(), Failure> {
    match which {
        SKEP_MAPS_RAW | SKEP_MAPS_VALIDATED => Ok(()),
        _ => Err(Failure::argument("which", which, "SKEP_MAPS_RAW or SKEP_MAPS_VALIDATED")),
    }
}

/// Whether a pixel's estimate is handed out.
fn is_given(view: &ViewResult, pixel: usize, which: u32) -> bool {
    which == SKEP_MAPS_RAW || view.status[pixel] == PixelStatus::Validated
}

/// Copies a view's depth map: width floats a row, height rows, `stride_bytes` from row to row (at least 4 * width).
/// World units, 0 where there is no estimate. `which` is a SKEP_MAPS_ value.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_depth(
    result: *const skep_result,
    view: u32,
    which: u32,
    out: *mut f32,
    stride_bytes: usize,
) -> skep_status {
    let depth = |view: &ViewResult, pixel| match is_given(view, pixel, which) {
        true => view.raw.depth[pixel],
        false => 0.0,
    };
    // SAFETY: as the header demands of the caller.
    unsafe { give_map(result, view, out, stride_bytes, |_| check_which(which), depth) }
}

/// Copies a view's normal map: x, y, z of each pixel, so 3 * width floats a row (`stride_bytes` at least 12 * width).
/// Unit vectors in the view's camera frame that face the camera, zeros where there is no estimate.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_normal(
    result: *const skep_result,
    view: u32,
    which: u32,
    out: *mut f32,
    stride_bytes: usize,
) -> skep_status {
    let normal = |view: &ViewResult, pixel| match is_given(view, pixel, which) {
        true => view.raw.normal[pixel],
        false => [0.0; 3],
    };
    let out = out.cast::<[f32; 3]>();
    // SAFETY: as the header demands of the caller; rows of triples are rows of floats.
    unsafe { give_map(result, view, out, stride_bytes, |_| check_which(which), normal) }
}

/// Copies the matching cost of every pixel's raw estimate: the mean of 1 - NCC over its source views, 0 to 2; lower is
/// surer. `stride_bytes` is at least 4 * width.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_cost(
    result: *const skep_result,
    view: u32,
    out: *mut f32,
    stride_bytes: usize,
) -> skep_status {
    // SAFETY: as the header demands of the caller.
    unsafe { give_map(result, view, out, stride_bytes, |_| Ok(()), |view, pixel| view.cost[pixel]) }
}

/// Copies what became of every pixel, a SKEP_PIXEL_ value each: the reason where there is no validated depth.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_status(
    result: *const skep_result,
    view: u32,
    out: *mut u8,
    stride_bytes: usize,
) -> skep_status {
    // SAFETY: as the header demands of the caller.
    unsafe { give_map(result, view, out, stride_bytes, |_| Ok(()), |view, pixel| view.status[pixel] as u8) }
}

/// Copies the number of source views of every pixel; `stride_bytes` is at least 2 * width.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_source_count(
    result: *const skep_result,
    view: u32,
    out: *mut u16,
    stride_bytes: usize,
) -> skep_status {
    let count = |view: &ViewResult, pixel| u16::try_from(view.view_sets.count(pixel)).unwrap_or(u16::MAX);
    // SAFETY: as the header demands of the caller.
    unsafe { give_map(result, view, out, stride_bytes, |_| Ok(()), count) }
}

/// Copies which source views each pixel was matched with, as bits, 32 of them: bit i of pixel (x, y) stands for entry
/// 32 * word + i of skep_result_get_sources. One uint32_t a pixel; ask for word 0, 1, ... as long as there are
/// sources. `stride_bytes` is at least 4 * width.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_source_bits(
    result: *const skep_result,
    view: u32,
    word: u32,
    out: *mut u32,
    stride_bytes: usize,
) -> skep_status {
    let check = |view: &ViewResult| match view.view_sets.words_per_pixel() {
        words if (word as usize) < words => Ok(()),
        words => Err(Failure::argument("word", word, format!("below the number of words, {words}"))),
    };
    let bits = |view: &ViewResult, pixel| view.view_sets.words_of(pixel)[word as usize];
    // SAFETY: as the header demands of the caller.
    unsafe { give_map(result, view, out, stride_bytes, check, bits) }
}

/// The source views of a view, as numbers of the scene's views. `sources` may be NULL to only ask for their number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_sources(
    result: *const skep_result,
    view: u32,
    sources: *mut u32,
    capacity: usize,
    count_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe {
            let view = get(result, "result")?.view(view)?;
            give_list(&view.sources, sources, capacity, count_out, ("sources", "count_out"))
        }
    })
}

/// Width and height of a view's maps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_size(
    result: *const skep_result,
    view: u32,
    width_out: *mut u32,
    height_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (result, width, height) =
            unsafe { (get(result, "result")?, out(width_out, "width_out")?, out(height_out, "height_out")?) };
        let size = result.view(view)?.size();
        width.set(size.0);
        height.set(size.1);
        Ok(())
    })
}

/// What a view cost and what became of its pixels.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_statistics(
    result: *const skep_result,
    view: u32,
    statistics_out: *mut skep_statistics,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (result, out) = unsafe { (get(result, "result")?, out(statistics_out, "statistics_out")?) };
        let view = result.view(view)?;
        let mut status_counts = [0; 8];
        status_counts.iter_mut().zip(view.status_counts()).for_each(|(place, count)| *place = count);
        let crate::Counts { ncc_evaluations, bilinear_samples, early_terminations } = view.counts;
        out.set(skep_statistics { ncc_evaluations, bilinear_samples, early_terminations, status_counts });
        Ok(())
    })
}

/// The cycles of a view in order. `cycles` may be NULL to only ask for their number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_cycles(
    result: *const skep_result,
    view: u32,
    cycles: *mut skep_cycle_record,
    capacity: usize,
    count_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let result = unsafe { get(result, "result") }?;
        let list: Vec<skep_cycle_record> =
            result.view(view)?.cycles.iter().map(skep_cycle_record::of).collect();
        // SAFETY: as the header demands of the caller.
        unsafe { give_list(&list, cycles, capacity, count_out, ("cycles", "count_out")) }
    })
}

// The values C sees are the outcomes' own.
const _: () = {
    assert!(SKEP_PIXEL_VALIDATED == PixelStatus::Validated as u8);
    assert!(SKEP_PIXEL_MASKED == PixelStatus::Masked as u8);
    assert!(SKEP_PIXEL_NO_TEXTURE == PixelStatus::NoTexture as u8);
    assert!(SKEP_PIXEL_NO_SOURCES == PixelStatus::NoSources as u8);
    assert!(SKEP_PIXEL_INCONSISTENT == PixelStatus::Inconsistent as u8);
    assert!(SKEP_PIXEL_OUT_OF_RANGE == PixelStatus::OutOfRange as u8);
    assert!(PixelStatus::ALL.len() <= 8);
};
