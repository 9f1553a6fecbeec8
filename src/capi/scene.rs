//! Scenes in C: views, masks, ranges, sources and sparse points from buffers.

use super::camera::skep_camera;
use super::image::skep_image;
use super::maps;
use super::pointers::{self, destroy, get, out, slice, text, wanted_one};
use super::scene_state::{CheckedScene, SceneState};
use super::status::{Failure, guard, skep_status};
use crate::geometry::DepthRange;
use crate::memory::require_memory;
use crate::scene::{Scene, SparsePoint, View};
use glam::DVec3;
use std::ffi::c_char;
use std::sync::{Arc, RwLock};

/// Views (photographs with cameras) and sparse points.
///
/// Images are copied when a view is added, and shared from then on: runs do not copy them again. A run uses
/// the scene as it is when the run starts; later changes do not affect it.
///
/// What skep_scene_validate, skep_scene_get_depth_range, _get_sources, _get_overlap and
/// _get_triangulation_angle derive from the scene is kept until the scene is changed: the first call after a
/// change works through the whole scene, the next ones only look up what is known. Source views are kept for
/// the last options asked for.
pub struct skep_scene {
    pub(super) inner: RwLock<SceneState>,
}

impl skep_scene {
    pub fn new(scene: Scene) -> skep_scene {
        skep_scene { inner: RwLock::new(SceneState::new(scene)) }
    }

    /// The checked scene as it is now. Only the first call after a change checks it.
    pub(super) fn checked(&self) -> Result<Arc<CheckedScene>, Failure> {
        // Copied out of the lock before the next one is taken.
        let known = pointers::read(&self.inner)?.checked();
        match known {
            Some(scene) => Ok(scene),
            None => Ok(pointers::write(&self.inner)?.check()?),
        }
    }

    /// Calls `work` with one view.
    pub(super) fn with_view<R>(
        &self,
        view: u32,
        work: impl FnOnce(&View) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        let state = pointers::read(&self.inner)?;
        let views = state.views();
        work(views.get(view as usize).ok_or_else(|| no_view(view, views.len()))?)
    }

    /// Changes one view.
    fn change(&self, view: u32, work: impl FnOnce(&mut View) -> Result<(), Failure>) -> Result<(), Failure> {
        let mut state = pointers::write(&self.inner)?;
        let views = state.views().len();
        if view as usize >= views {
            return Err(no_view(view, views));
        }
        work(&mut state.parts().0[view as usize])
    }
}

/// The error for a view that does not exist.
pub fn no_view(view: u32, views: usize) -> Failure {
    Failure::argument("view", view, format!("a number below that of the views, {views}"))
}

/// Creates an empty scene.
///
/// @param scene_out  Receives the scene; destroy it with skep_scene_destroy.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_create(scene_out: *mut *mut skep_scene) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { out(scene_out, "scene_out") }?.give(skep_scene { inner: RwLock::default() });
        Ok(())
    })
}

/// Copies a scene: later changes of one do not affect the other. Images are shared, not copied.
///
/// @param scene      The scene.
/// @param scene_out  Receives the copy; destroy it with skep_scene_destroy.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_copy(
    scene: *const skep_scene,
    scene_out: *mut *mut skep_scene,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, out) = unsafe { (get(scene, "scene")?, out(scene_out, "scene_out")?) };
        let state = pointers::read(&scene.inner)?.clone();
        out.give(skep_scene { inner: RwLock::new(state) });
        Ok(())
    })
}

/// Destroys a scene. Results, steppers and clouds created from it are not affected.
///
/// @param scene  The scene; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_destroy(scene: *mut skep_scene) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(scene) };
        Ok(())
    });
}

/// Adds a photograph with its camera. Views are numbered from 0 in the order in which they are added. Colors
/// are converted to gray as luma (ITU-R BT.601).
///
/// @param scene         The scene.
/// @param name_or_null  Name of the view in messages and files, copied; NULL: "view0000.png" with its number.
/// @param image         The pixels; copied, rounded to 8 bits a channel.
/// @param camera        The camera; copied.
/// @param view_out      Receives the number of the view; may be NULL.
/// @retval SKEP_ERR_ARGUMENT  A size, stride, format, float pixel or camera that cannot be used, or a name
///                            that another view has.
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
        image.check("image")?;
        let camera = camera.sized((image.width, image.height), "camera")?;
        let name = match name_or_null.is_null() {
            true => None,
            // SAFETY: as the header demands of the caller.
            false => Some(unsafe { text(name_or_null, "name") }?.to_owned()),
        };
        // SAFETY: as the header demands of the caller.
        let place = unsafe { wanted_one(view_out, "view_out") }?;
        // SAFETY: as the header demands of the caller.
        let picture = unsafe { image.picture("image") }?.into();
        let mut state = pointers::write(&scene.inner)?;
        let index = state.views().len();
        let name = name.unwrap_or_else(|| format!("view{index:04}.png"));
        if state.views().iter().any(|view| view.name == name) {
            return Err(Failure::argument("name", format!("{name} again"), "a different name for each view"));
        }
        state.parts().0.push(View { name, picture, camera, mask: None, depth_range: None, sources: None });
        if let Some(place) = place {
            place.set(index as u32);
        }
        Ok(())
    })
}

/// Sets the mask of a view. Pixels that are masked out get no estimate, but still serve as source pixels of
/// other views.
///
/// @param scene         The scene.
/// @param view          Number of the view.
/// @param mask_or_null  height rows of width bytes, copied: 0 masks a pixel out; NULL removes the mask.
/// @param stride_bytes  Bytes from a row to the next, at least width; ignored with NULL.
/// @retval SKEP_ERR_ARGUMENT  No such view, or a stride that is too small.
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
                    Some(mask.into_iter().map(|wanted| wanted != 0).collect::<Vec<_>>().into())
                }
            };
            Ok(())
        })
    })
}

/// Sets the depth range that is searched in a view. By default it is derived from the sparse points that the
/// view observes.
///
/// @param scene  The scene.
/// @param view   Number of the view.
/// @param near   Smallest depth in world units, above 0; 0 with `far` 0 restores the default.
/// @param far    Largest depth in world units, above `near`.
/// @retval SKEP_ERR_ARGUMENT  No such view, or not 0 < near < far.
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

/// Sets the source views of a view, which it is matched with. By default they are selected by triangulation
/// angle. The views may be added later.
///
/// @param scene    The scene.
/// @param view     Number of the view.
/// @param sources  `count` numbers of other views, the most important first, each at most once; copied; may
///                 be NULL when `count` is 0.
/// @param count    Number of source views; 0 restores the default.
/// @retval SKEP_ERR_ARGUMENT  No such view.
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

/// Adds sparse points with the views that observe them. Depth ranges and source views are derived from them;
/// without any points each view needs a depth range. The views may be added later.
///
/// @param scene        The scene.
/// @param positions    3 * count doubles: x, y, z of each point in the world; copied.
/// @param count        Number of points.
/// @param view_counts  `count` numbers: how many views observe each point; copied.
/// @param views        `view_total` numbers of views, point after point; copied.
/// @param view_total   Sum of `view_counts`.
/// @retval SKEP_ERR_ARGUMENT  A coordinate that is not finite, or a `view_total` that is not the sum of
///                            `view_counts`.
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
        // A point and the list of its views.
        let bytes = (count as u64).saturating_mul(64).saturating_add((view_total as u64).saturating_mul(4));
        require_memory(bytes, "a copy of the points")?;
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
        pointers::write(&scene.inner)?.parts().1.extend(points);
        Ok(())
    })
}

/// Checks a scene as a run does when it starts: at least two views, source views and observing views that
/// exist, a depth range for every view.
///
/// @param scene  The scene.
/// @retval SKEP_ERR_ARGUMENT  The first violation; the text names it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_validate(scene: *const skep_scene) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { get(scene, "scene") }?.checked().map(drop)
    })
}
