//! What a scene holds and what a run derives from it, in C.

use super::camera::skep_camera;
use super::options::{options_or_default, skep_options};
use super::pointers::{self, get, give_list, give_text, out, wanted_one};
use super::scene::{no_view, skep_scene};
use super::status::{Failure, guard, skep_status};
use std::ffi::c_char;

/// Gets the number of views.
///
/// @param scene      The scene.
/// @param count_out  Receives the number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_get_view_count(
    scene: *const skep_scene,
    count_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, out) = unsafe { (get(scene, "scene")?, out(count_out, "count_out")?) };
        out.set(pointers::read(&scene.inner)?.views().len() as u32);
        Ok(())
    })
}

/// Gets the size and the camera of a view.
///
/// @param scene       The scene.
/// @param view        Number of the view.
/// @param width_out   Receives the width in pixels; may be NULL.
/// @param height_out  Receives the height in pixels; may be NULL.
/// @param camera_out  Receives the camera; may be NULL.
/// @retval SKEP_ERR_ARGUMENT  No such view.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_get_view(
    scene: *const skep_scene,
    view: u32,
    width_out: *mut u32,
    height_out: *mut u32,
    camera_out: *mut skep_camera,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let scene = unsafe { get(scene, "scene") }?;
        let camera = scene.with_view(view, |view| Ok(view.camera))?;
        // SAFETY: as the header demands of the caller.
        unsafe {
            let width = wanted_one(width_out, "width_out")?;
            let height = wanted_one(height_out, "height_out")?;
            let place = wanted_one(camera_out, "camera_out")?;
            width.into_iter().for_each(|out| out.set(camera.width));
            height.into_iter().for_each(|out| out.set(camera.height));
            place.into_iter().for_each(|out| out.set(skep_camera::of(&camera)));
        }
        Ok(())
    })
}

/// Copies the name of a view.
///
/// @param scene       The scene.
/// @param view        Number of the view.
/// @param buffer      Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
/// @param capacity    Bytes of room in `buffer`; a longer name is cut.
/// @param needed_out  Receives the bytes of the whole name with its NUL; may be NULL.
/// @retval SKEP_ERR_ARGUMENT  No such view.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_get_name(
    scene: *const skep_scene,
    view: u32,
    buffer: *mut c_char,
    capacity: usize,
    needed_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let scene = unsafe { get(scene, "scene") }?;
        let name = scene.with_view(view, |view| Ok(view.name.clone()))?;
        // SAFETY: as the header demands of the caller.
        unsafe { give_text(&name, buffer, capacity, needed_out) }
    })
}

/// Gets the depth range that a run searches in a view: its own, or the one derived from the sparse points.
/// Beyond a derived one a small part of the search goes on, to 0.7 times its near and 4 times its far end.
///
/// @param scene     The scene.
/// @param view      Number of the view.
/// @param near_out  Receives the smallest depth in world units.
/// @param far_out   Receives the largest depth in world units.
/// @retval SKEP_ERR_ARGUMENT  No such view, or a scene that skep_scene_validate refuses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_get_depth_range(
    scene: *const skep_scene,
    view: u32,
    near_out: *mut f64,
    far_out: *mut f64,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, near, far) =
            unsafe { (get(scene, "scene")?, out(near_out, "near_out")?, out(far_out, "far_out")?) };
        let scene = scene.checked()?;
        if view as usize >= scene.views().len() {
            return Err(no_view(view, scene.views().len()));
        }
        let range = scene.depth_range(view as usize);
        near.set(range.near);
        far.set(range.far);
        Ok(())
    })
}

/// Copies one of the warnings about a scene, such as that a view saw no sparse point and where its depth
/// range comes from. Those about source views depend on the options: skep_result_get_warning gives them.
///
/// @param scene       The scene.
/// @param index       Index of the warning, from 0.
/// @param buffer      Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
/// @param capacity    Bytes of room in `buffer`; a longer text is cut.
/// @param needed_out  Receives the bytes of the whole text with its NUL; may be NULL.
/// @retval SKEP_ERR_ARGUMENT  `index` is not below the number of warnings: all have been listed; or a scene
///                            that skep_scene_validate refuses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_get_warning(
    scene: *const skep_scene,
    index: usize,
    buffer: *mut c_char,
    capacity: usize,
    needed_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let scene = unsafe { get(scene, "scene") }?.checked()?;
        let warnings = scene.warnings();
        let warning = warnings.get(index).ok_or_else(|| {
            Failure::argument("index", index, format!("below the number of warnings, {}", warnings.len()))
        })?;
        // SAFETY: as the header demands of the caller.
        unsafe { give_text(warning, buffer, capacity, needed_out) }
    })
}

/// Gets the source views that a run with these options matches a view with. Of more than 1,000 views only
/// those that share sparse points and the 256 whose cameras are the nearest are considered for each.
///
/// @param scene            The scene.
/// @param options_or_null  The options; NULL: the default preset.
/// @param view             Number of the view.
/// @param sources          Receives `*count_out` numbers of views; may be NULL to ask for their number.
/// @param capacity         Elements of room in `sources`; at most the number of views is needed.
/// @param count_out        Receives the number of source views.
/// @retval SKEP_ERR_ARGUMENT  No such view, a scene that skep_scene_validate refuses, or options out of
///                            range.
/// @retval SKEP_ERR_CAPACITY  `capacity` is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_get_sources(
    scene: *const skep_scene,
    options_or_null: *const skep_options,
    view: u32,
    sources: *mut u32,
    capacity: usize,
    count_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, options) =
            unsafe { (get(scene, "scene")?.checked()?, options_or_default(options_or_null)?) };
        options.check()?;
        let lists = scene.source_lists(&options);
        let list = lists.get(view as usize).ok_or_else(|| no_view(view, lists.len()))?;
        // SAFETY: as the header demands of the caller.
        unsafe { give_list(list, sources, capacity, count_out, ("sources", "count_out")) }
    })
}

/// Gets the views that fusion compares with a view: those that share a sparse point with it. A view that
/// shares none with any other is compared with all others and they with it; of more than 1,000 views, with
/// the 256 whose cameras are the nearest.
///
/// @param scene      The scene.
/// @param view       Number of the view.
/// @param views      Receives `*count_out` numbers of views; may be NULL to ask for their number.
/// @param capacity   Elements of room in `views`; at most the number of views is needed.
/// @param count_out  Receives the number of views.
/// @retval SKEP_ERR_ARGUMENT  No such view, or a scene that skep_scene_validate refuses.
/// @retval SKEP_ERR_CAPACITY  `capacity` is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_get_overlap(
    scene: *const skep_scene,
    view: u32,
    views: *mut u32,
    capacity: usize,
    count_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let scene = unsafe { get(scene, "scene") }?.checked()?;
        let overlaps = scene.overlaps();
        let list = overlaps.get(view as usize).ok_or_else(|| no_view(view, overlaps.len()))?;
        // SAFETY: as the header demands of the caller.
        unsafe { give_list(list, views, capacity, count_out, ("views", "count_out")) }
    })
}

/// Gets the triangulation angle of two views: the 75th percentile of the angles at the sparse points that
/// both observe or, where they share fewer than three, the angle at the geometric mean of the depth range of
/// `reference`.
///
/// @param scene        The scene.
/// @param reference    Number of the reference view.
/// @param source       Number of another view.
/// @param degrees_out  Receives the angle in degrees; -1 when the views share no surface.
/// @retval SKEP_ERR_ARGUMENT  No such view, twice the same view, or a scene that skep_scene_validate refuses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_get_triangulation_angle(
    scene: *const skep_scene,
    reference: u32,
    source: u32,
    degrees_out: *mut f64,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, out) = unsafe { (get(scene, "scene")?, out(degrees_out, "degrees_out")?) };
        let scene = scene.checked()?;
        for view in [reference, source] {
            if view as usize >= scene.views().len() {
                return Err(no_view(view, scene.views().len()));
            }
        }
        if reference == source {
            return Err(Failure::argument("source", source, "another view than the reference"));
        }
        let angle = scene.triangulation_angle(reference as usize, source as usize);
        out.set(angle.unwrap_or(-1.0));
        Ok(())
    })
}
