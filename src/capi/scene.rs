//! Scenes in C: views, masks, ranges, sources and sparse points from buffers.

use super::camera::skep_camera;
use super::image::skep_image;
use super::maps;
use super::options::{options_or_default, skep_options};
use super::pointers::{self, copy_text, destroy, get, give_list, out, slice, text, wanted_one};
use super::status::{Failure, guard, skep_status};
use crate::geometry::DepthRange;
use crate::scene::{Scene, SparsePoint, View};
use crate::{fusion, view_selection};
use glam::DVec3;
use std::ffi::c_char;
use std::sync::RwLock;

/// Calibrated photographs and sparse points. May be used from several threads at once; runs that were started with it
/// keep what it was when they started. Pictures are copied in and shared from then on: a run does not copy them again.
pub struct skep_scene {
    inner: RwLock<Parts>,
}

#[derive(Default)]
struct Parts {
    views: Vec<View>,
    points: Vec<SparsePoint>,
}

impl skep_scene {
    pub fn new(scene: Scene) -> skep_scene {
        let (views, points) = scene.into_parts();
        skep_scene { inner: RwLock::new(Parts { views, points }) }
    }

    /// The checked scene as it is now.
    pub fn checked(&self) -> Result<Scene, Failure> {
        let parts = pointers::read(&self.inner)?;
        Ok(Scene::new(parts.views.clone(), parts.points.clone())?)
    }

    /// Does something with one view.
    fn with_view<R>(&self, view: u32, work: impl FnOnce(&View) -> Result<R, Failure>) -> Result<R, Failure> {
        let parts = pointers::read(&self.inner)?;
        work(parts.views.get(view as usize).ok_or_else(|| no_view(view, parts.views.len()))?)
    }

    /// Changes one view.
    fn change(&self, view: u32, work: impl FnOnce(&mut View) -> Result<(), Failure>) -> Result<(), Failure> {
        let mut parts = pointers::write(&self.inner)?;
        let views = parts.views.len();
        work(parts.views.get_mut(view as usize).ok_or_else(|| no_view(view, views))?)
    }
}

/// The error of a view there is not.
pub fn no_view(view: u32, views: usize) -> Failure {
    Failure::argument("view", view, format!("a view below their number, {views}"))
}

/// Makes an empty scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_create(scene_out: *mut *mut skep_scene) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { out(scene_out, "scene_out") }?.give(skep_scene { inner: RwLock::default() });
        Ok(())
    })
}

/// Destroys a scene; NULL is ignored. Results, steps and clouds made from it stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_destroy(scene: *mut skep_scene) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(scene) };
        Ok(())
    });
}

/// Adds a photograph, copied, rounded to 8 bits a channel; gray is the luma of colors (ITU-R BT.601). `name_or_null`
/// (UTF-8, copied) names it in messages and files; NULL names it "view0000.png" by its number. Views are numbered in the
/// order they are added; `view_out`, which may be NULL, receives the number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_add_view(
    scene: *mut skep_scene,
    name_or_null: *const c_char,
    image: *const skep_image,
    camera: *const skep_camera,
    view_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, image, camera) =
            unsafe { (get(scene, "scene")?, get(image, "image")?, get(camera, "camera")?) };
        // SAFETY: as the header demands of the caller.
        let picture = unsafe { image.picture("image") }?;
        let camera = camera.sized((image.width, image.height), "camera")?;
        let name = match name_or_null.is_null() {
            true => None,
            // SAFETY: as the header demands of the caller.
            false => Some(unsafe { text(name_or_null, "name") }?.to_owned()),
        };
        // SAFETY: as the header demands of the caller.
        let place = unsafe { wanted_one(view_out, "view_out") }?;
        let mut parts = pointers::write(&scene.inner)?;
        let index = parts.views.len();
        let name = name.unwrap_or_else(|| format!("view{index:04}.png"));
        if parts.views.iter().any(|view| view.name == name) {
            return Err(Failure::argument("name", format!("{name} again"), "a different name for each view"));
        }
        parts.views.push(View { name, picture, camera, mask: None, depth_range: None, sources: None });
        if let Some(place) = place {
            place.set(index as u32);
        }
        Ok(())
    })
}

/// Says where depths are wanted in a view: one byte for each pixel, `stride_bytes` from row to row, 0 where none is
/// wanted. Masked pixels still serve as sources for other views. NULL takes the mask away.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_set_mask(
    scene: *mut skep_scene,
    view: u32,
    mask_or_null: *const u8,
    stride_bytes: usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let scene = unsafe { get(scene, "scene") }?;
        scene.change(view, |view| {
            view.mask = match mask_or_null.is_null() {
                true => None,
                false => {
                    let size = (view.camera.width, view.camera.height);
                    // SAFETY: as the header demands of the caller.
                    let mask = unsafe { maps::read(mask_or_null, size, stride_bytes, "mask") }?;
                    Some(mask.into_iter().map(|wanted| wanted != 0).collect())
                }
            };
            Ok(())
        })
    })
}

/// Says between which depths surfaces are looked for in a view, in world units, 0 < near < far. (0, 0) goes back to
/// the range that the sparse points the view saw suggest, which is the default.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_set_depth_range(
    scene: *mut skep_scene,
    view: u32,
    near: f64,
    far: f64,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let scene = unsafe { get(scene, "scene") }?;
        let range = DepthRange { near, far };
        let range = (near != 0.0 || far != 0.0).then_some(range);
        if let Some(range) = range {
            range.check("depth range")?;
        }
        scene.change(view, |view| {
            view.depth_range = range;
            Ok(())
        })
    })
}

/// Says which views a view is matched with, the most important first, each at most once, not itself. They may be added
/// later. (NULL, 0) goes back to choosing them by their triangulation angle, which is the default.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_set_sources(
    scene: *mut skep_scene,
    view: u32,
    sources: *const u32,
    count: usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, sources) = unsafe { (get(scene, "scene")?, slice(sources, count, "sources")?) };
        scene.change(view, |view| {
            view.sources = (!sources.is_empty()).then(|| sources.to_vec());
            Ok(())
        })
    })
}

/// Adds sparse points with the views that saw them, copied. `positions` holds x, y, z of each point; `view_counts` the
/// number of views of each, and `views` their numbers, point after point, `view_total` in all.
///
/// The views may be added later. Points give the depth ranges and choose the source views; without any, give each view
/// a depth range.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_add_points(
    scene: *mut skep_scene,
    positions: *const f64,
    count: usize,
    view_counts: *const u32,
    views: *const u32,
    view_total: usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, positions, view_counts, views) = unsafe {
            (
                get(scene, "scene")?,
                slice(positions.cast::<[f64; 3]>(), count, "positions")?,
                slice(view_counts, count, "view_counts")?,
                slice(views, view_total, "views")?,
            )
        };
        let mut rest = views;
        let mut points = Vec::with_capacity(count);
        for (index, (position, &seen)) in positions.iter().zip(view_counts).enumerate() {
            let position = DVec3::from_array(*position);
            if !position.is_finite() {
                return Err(Failure::argument(
                    &format!("positions[{index}]"),
                    position,
                    "finite coordinates",
                ));
            }
            let Some((own, others)) = rest.split_at_checked(seen as usize) else {
                let expected = format!("at most the {} that are left of view_total", rest.len());
                return Err(Failure::argument(&format!("view_counts[{index}]"), seen, expected));
            };
            points.push(SparsePoint { position, views: own.to_vec() });
            rest = others;
        }
        if !rest.is_empty() {
            let expected = format!("the sum of view_counts, {}", view_total - rest.len());
            return Err(Failure::argument("view_total", view_total, expected));
        }
        pointers::write(&scene.inner)?.points.extend(points);
        Ok(())
    })
}

/// Checks the scene as a run would: at least two views, points and sources that name views there are, a depth range
/// for every view. A run checks it too.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_validate(scene: *const skep_scene) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { get(scene, "scene") }?.checked().map(drop)
    })
}

/// The number of views.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_get_view_count(
    scene: *const skep_scene,
    count_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, out) = unsafe { (get(scene, "scene")?, out(count_out, "count_out")?) };
        out.set(pointers::read(&scene.inner)?.views.len() as u32);
        Ok(())
    })
}

/// A view's size and camera. Each output may be NULL.
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

/// Copies a view's name as skep_last_error copies its text: at most `capacity` bytes with the NUL. `needed_out`, which
/// may be NULL, receives the bytes the whole name takes with its NUL.
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

/// # Safety
/// `buffer` is NULL or points to `capacity` writable bytes, `needed` is NULL or points to memory for a size.
pub unsafe fn give_text(
    text: &str,
    buffer: *mut c_char,
    capacity: usize,
    needed: *mut usize,
) -> Result<(), Failure> {
    // SAFETY: as promised by the caller.
    unsafe {
        let place = wanted_one(needed, "needed_out")?;
        let length = copy_text(text, buffer, capacity);
        place.into_iter().for_each(|place| place.set(length));
    }
    Ok(())
}

/// The depth range a run would search in a view: its own, or the one its sparse points suggest.
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

/// The source views a run with these options would match a view with. `sources` may be NULL to only ask for their
/// number.
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
        let lists = view_selection::source_lists(&scene, &options).lists;
        let list = lists.get(view as usize).ok_or_else(|| no_view(view, lists.len()))?;
        // SAFETY: as the header demands of the caller.
        unsafe { give_list(list, sources, capacity, count_out, ("sources", "count_out")) }
    })
}

/// The views that may see the same surface as a view, which is what fusion asks: those that saw a sparse point together
/// with it, or all others when it saw none. `views` may be NULL to only ask for their number.
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
        let overlaps = fusion::overlaps(scene.views().len(), scene.points());
        let list = overlaps.get(view as usize).ok_or_else(|| no_view(view, overlaps.len()))?;
        // SAFETY: as the header demands of the caller.
        unsafe { give_list(list, views, capacity, count_out, ("views", "count_out")) }
    })
}

/// The triangulation angle of two views in degrees: the 75th percentile of the angles at the sparse points both saw
/// or, where they share fewer than three, at the geometric mean of `reference`'s depth range. -1 when they
/// see nothing together.
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
        let angle = view_selection::triangulation_angle(&scene, reference as usize, source as usize);
        out.set(angle.unwrap_or(-1.0));
        Ok(())
    })
}
