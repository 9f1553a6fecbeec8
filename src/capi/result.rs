//! Whole runs in C, and the maps of their results.

use super::cloud::skep_cloud;
use super::options::{options_or_default, skep_options};
use super::pointers::{destroy, get, give_list, give_text, out};
use super::progress::{Host, skep_progress_fn};
use super::scene::skep_scene;
use super::status::{Failure, guard, skep_status};
use crate::fusion::PointCloud;
use crate::pipeline::ViewResult;
use crate::pipeline::reconstruct;
use crate::scene::PixelStatus;
use std::collections::BTreeMap;
use std::ffi::{c_char, c_void};
use std::sync::Arc;

/// Maps of views, and the cloud of a whole run. Immutable.
pub struct skep_result {
    /// By the view's number in the scene.
    pub(super) views: BTreeMap<u32, ViewResult>,
    points: Option<Arc<PointCloud>>,
    warnings: Vec<String>,
}

/// The planes of all pixels.
pub const SKEP_MAPS_RAW: u32 = 0;
/// The planes of validated pixels; the others are 0.
pub const SKEP_MAPS_VALIDATED: u32 = 1;

/// The plane is consistent with enough source views.
pub const SKEP_PIXEL_VALIDATED: u8 = 0;
/// The mask excludes the pixel.
pub const SKEP_PIXEL_MASKED: u8 = 1;
/// The variance in the window around the pixel is too small for matching.
pub const SKEP_PIXEL_NO_TEXTURE: u8 = 2;
/// There is no plane, or it is visible in fewer source views than matching needs: two, or one with option
/// "check.min_consistent_views" = 1.
pub const SKEP_PIXEL_NO_SOURCES: u8 = 3;
/// Too few source views are consistent with the plane.
pub const SKEP_PIXEL_INCONSISTENT: u8 = 4;
/// The depth is at an end of the depth range: the surface may lie outside of it.
pub const SKEP_PIXEL_OUT_OF_RANGE: u8 = 5;

/// Work spent on a view, and status of its pixels. The numbers depend on input and options only, not on the
/// machine.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_statistics {
    /// Comparisons of a patch with its image in one source view.
    pub ncc_evaluations: u64,
    /// Bilinear samples taken from source views.
    pub bilinear_samples: u64,
    /// Plane evaluations that ended before all source views were compared.
    pub early_terminations: u64,
    /// Number of pixels of each SKEP_PIXEL_ value; entries after the last value are 0.
    pub status_counts: [u64; 8],
}

/// Search and check of one view in one cycle.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_cycle_record {
    /// Scale of the images: 1 is full size, 2 half, 4 a quarter.
    pub downscale: u32,
    /// Number of the cycle on that scale, from 0.
    pub cycle: u32,
    /// Pixels with a plane.
    pub pixels: u64,
    /// Pixels whose depth the search changed by more than 0.1 %.
    pub changed: u64,
    /// Pixels that the check validated.
    pub validated: u64,
    /// Median distance between where planes project to in the source views and where the source views' own
    /// depths lie, in pixels of the cycle's scale: errors of the poses and of the matching. 0 without planes.
    pub median_residual: f64,
}

impl skep_cycle_record {
    pub fn of(record: &crate::CycleRecord) -> skep_cycle_record {
        let crate::CycleRecord { downscale, cycle, pixels, changed, validated, median_residual } = *record;
        skep_cycle_record { downscale, cycle, pixels, changed, validated, median_residual }
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

/// Estimates depth, normal and view set of every pixel of every view, and fuses the validated pixels into
/// points.
///
/// A run has its own threads (option "threads"), which have ended when the call returns; several runs may be
/// made at the same time.
///
/// @param scene             The scene, as it is when the call starts.
/// @param options_or_null   The options; NULL: the default preset.
/// @param progress_or_null  Receives the progress and may cancel; NULL: none.
/// @param user              Passed to the callback; may be NULL.
/// @param result_out        Receives the result; destroy it with skep_result_destroy. Not written when the
///                          call fails.
/// @retval SKEP_ERR_ARGUMENT   A scene that skep_scene_validate refuses, options out of range, or threads
///                             that cannot be started.
/// @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
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
        let scene = scene.checked()?;
        let found = reconstruct(&scene, &options, &|at| host.tell(at))?;
        out.give(skep_result {
            views: (0..).zip(found.views).collect(),
            points: Some(Arc::new(found.points)),
            warnings: found.warnings,
        });
        Ok(())
    })
}

/// Destroys a result. Clouds taken from it are not affected; borrowed maps are freed.
///
/// @param result  The result; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_destroy(result: *mut skep_result) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(result) };
        Ok(())
    });
}

/// Gets the cloud of a whole run, as an object of its own. The points are shared, not copied.
///
/// @param result     The result of skep_reconstruct.
/// @param cloud_out  Receives the cloud; destroy it with skep_cloud_destroy.
/// @retval SKEP_ERR_ARGUMENT  The result of a single view, from skep_stepper_finish, has no cloud.
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

/// Gets the numbers of the views in a result, ascending: all views of the scene after a whole run.
///
/// @param result     The result.
/// @param views      Receives `*count_out` numbers of views; may be NULL to ask for their number.
/// @param capacity   Elements of room in `views`.
/// @param count_out  Receives the number of views.
/// @retval SKEP_ERR_CAPACITY  `capacity` is too small.
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

/// Copies one of the warnings of a run for its user, such as that a view has no source views.
///
/// @param result      The result.
/// @param index       Index of the warning, from 0.
/// @param buffer      Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
/// @param capacity    Bytes of room in `buffer`; a longer text is cut.
/// @param needed_out  Receives the bytes of the whole text with its NUL; may be NULL.
/// @retval SKEP_ERR_ARGUMENT  `index` is not below the number of warnings: all have been listed.
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

/// Gets the source views of a view.
///
/// @param result     The result.
/// @param view       Number of a view in the result.
/// @param sources    Receives `*count_out` numbers of views; may be NULL to ask for their number.
/// @param capacity   Elements of room in `sources`.
/// @param count_out  Receives the number of source views.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result.
/// @retval SKEP_ERR_CAPACITY  `capacity` is too small.
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

/// Gets the size of the maps of a view.
///
/// @param result      The result.
/// @param view        Number of a view in the result.
/// @param width_out   Receives the width in pixels.
/// @param height_out  Receives the height in pixels.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result.
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

/// Gets the work spent on a view and the number of pixels of each status.
///
/// @param result          The result.
/// @param view            Number of a view in the result.
/// @param statistics_out  Receives the numbers.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result.
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

/// Gets the records of the cycles of a view, in order.
///
/// @param result     The result.
/// @param view       Number of a view in the result.
/// @param cycles     Receives `*count_out` records; may be NULL to ask for their number.
/// @param capacity   Elements of room in `cycles`.
/// @param count_out  Receives the number of records.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result.
/// @retval SKEP_ERR_CAPACITY  `capacity` is too small.
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

// The values of the header are those of the enum.
const _: () = {
    assert!(SKEP_PIXEL_VALIDATED == PixelStatus::Validated as u8);
    assert!(SKEP_PIXEL_MASKED == PixelStatus::Masked as u8);
    assert!(SKEP_PIXEL_NO_TEXTURE == PixelStatus::NoTexture as u8);
    assert!(SKEP_PIXEL_NO_SOURCES == PixelStatus::NoSources as u8);
    assert!(SKEP_PIXEL_INCONSISTENT == PixelStatus::Inconsistent as u8);
    assert!(SKEP_PIXEL_OUT_OF_RANGE == PixelStatus::OutOfRange as u8);
    assert!(PixelStatus::ALL.len() <= 8);
};
