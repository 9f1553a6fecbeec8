//! Fusion of maps that the caller holds.

use super::camera::skep_camera;
use super::cloud::skep_cloud;
use super::image::{check_size, skep_image};
use super::maps;
use super::options::{options_or_default, skep_options};
use super::pointers::{get, out, slice};
use super::progress::{Host, skep_progress_fn};
use super::status::{Failure, guard, skep_status};
use crate::fusion::{self, FusionView};
use crate::geometry::Camera;
use crate::image::Picture;
use crate::parallel::{JoinedPool, useful_threads};
use crate::scene::Maps;
use std::ffi::c_void;
use std::sync::Arc;

/// A view with maps to be fused, in the caller's memory, read during the call only. The layout of this struct
/// is frozen.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_fusion_view {
    /// Camera of the maps.
    pub camera: *const skep_camera,
    /// Width of the maps, 1 to 32768.
    pub width: u32,
    /// Height of the maps, 1 to 32768.
    pub height: u32,
    /// height rows of width floats: depth in world units; 0, negative and not finite: no estimate.
    pub depth: *const f32,
    /// Bytes from a row of `depth` to the next, at least 4 * width.
    pub depth_stride_bytes: usize,
    /// height rows of 3 * width floats: unit normals x, y, z in the camera frame.
    pub normal: *const f32,
    /// Bytes from a row of `normal` to the next, at least 12 * width.
    pub normal_stride_bytes: usize,
    /// Image of the size of the maps, for the colors; NULL: gray points.
    pub image_or_null: *const skep_image,
    /// Views that may observe the same surface, as indices into the array of views; see
    /// skep_scene_get_overlap.
    pub overlap: *const u32,
    /// Number of elements of `overlap`.
    pub overlap_count: usize,
    /// height rows of width floats: the confidence of each pixel, 0 to 1; NULL: 1 for all.
    pub confidence_or_null: *const f32,
    /// Bytes from a row of `confidence_or_null` to the next, at least 4 * width; ignored without it.
    pub confidence_stride_bytes: usize,
}

/// One view's copies.
struct Own<'a> {
    camera: Camera,
    maps: Maps,
    confidence: Option<Vec<f32>>,
    picture: Option<Picture>,
    overlap: &'a [u32],
}

impl skep_fusion_view {
    /// Checks all fields and pointers, before any view is copied.
    ///
    /// # Safety
    /// The pointers point to what the fields say.
    unsafe fn check(&self, name: &str) -> Result<(), Failure> {
        let size = (self.width, self.height);
        check_size(size, &format!("{name}."))?;
        // SAFETY: as promised by the caller.
        unsafe { get(self.camera, &format!("{name}.camera")) }?.sized(size, &format!("{name}.camera"))?;
        maps::check(self.depth, size, self.depth_stride_bytes, &format!("{name}.depth"))?;
        let normal = self.normal.cast::<[f32; 3]>();
        maps::check(normal, size, self.normal_stride_bytes, &format!("{name}.normal"))?;
        if !self.confidence_or_null.is_null() {
            let (confidence, stride) = (self.confidence_or_null, self.confidence_stride_bytes);
            maps::check(confidence, size, stride, &format!("{name}.confidence_or_null"))?;
        }
        if !self.image_or_null.is_null() {
            // SAFETY: as promised by the caller.
            unsafe { self.image(&format!("{name}.image")) }?.check(&format!("{name}.image"))?;
        }
        // SAFETY: as promised by the caller.
        unsafe { slice(self.overlap, self.overlap_count, &format!("{name}.overlap")) }.map(drop)
    }

    /// # Safety
    /// The pointers point to what the fields say, for `'a`.
    unsafe fn copied<'a>(&self, name: &str) -> Result<Own<'a>, Failure> {
        let size = (self.width, self.height);
        // SAFETY: as promised by the caller.
        unsafe {
            let camera =
                get(self.camera, &format!("{name}.camera"))?.sized(size, &format!("{name}.camera"))?;
            let depth = maps::read(self.depth, size, self.depth_stride_bytes, &format!("{name}.depth"))?;
            let normal = self.normal.cast::<[f32; 3]>();
            let normal = maps::read(normal, size, self.normal_stride_bytes, &format!("{name}.normal"))?;
            let stride = self.confidence_stride_bytes;
            let confidence = match self.confidence_or_null.is_null() {
                true => None,
                false => Some(maps::read(
                    self.confidence_or_null,
                    size,
                    stride,
                    &format!("{name}.confidence_or_null"),
                )?),
            };
            let picture = match self.image_or_null.is_null() {
                true => None,
                false => Some(self.image(&format!("{name}.image"))?.picture(&format!("{name}.image"))?),
            };
            let overlap = slice(self.overlap, self.overlap_count, &format!("{name}.overlap"))?;
            Ok(Own { camera, maps: Maps { depth, normal }, confidence, picture, overlap })
        }
    }

    /// The image, which has the size of the maps.
    ///
    /// # Safety
    /// `image_or_null` points to an image for `'a`.
    unsafe fn image<'a>(&self, name: &str) -> Result<&'a skep_image, Failure> {
        // SAFETY: as promised by the caller.
        let image = unsafe { get(self.image_or_null, name) }?;
        if (image.width, image.height) != (self.width, self.height) {
            let expected = format!("{} x {} pixels, the size of the maps", self.width, self.height);
            return Err(Failure::argument(name, format!("{} x {}", image.width, image.height), expected));
        }
        Ok(image)
    }
}

/// Fuses depth and normal maps into points, with the options of group "fusion" and "threads". The validated
/// maps of a whole run with its images and overlaps give the cloud of the run, to the bit.
///
/// @param views             `view_count` views with their maps; read during the call only.
/// @param view_count        Number of views.
/// @param options_or_null   The options; NULL: the default preset.
/// @param progress_or_null  Receives the progress and may cancel; NULL: none.
/// @param user              Passed to the callback; may be NULL.
/// @param cloud_out         Receives the cloud; destroy it with skep_cloud_destroy. Not written when the call
///                          fails.
/// @retval SKEP_ERR_ARGUMENT   A camera, size, stride, image or overlap that cannot be used, named like
///                             `views[2].depth`; options out of range.
/// @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_fuse(
    views: *const skep_fusion_view,
    view_count: usize,
    options_or_null: *const skep_options,
    progress_or_null: skep_progress_fn,
    user: *mut c_void,
    cloud_out: *mut *mut skep_cloud,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (views, options, out) = unsafe {
            (
                slice(views, view_count, "views")?,
                options_or_default(options_or_null)?,
                out(cloud_out, "cloud_out")?,
            )
        };
        options.check()?;
        for (index, view) in views.iter().enumerate() {
            // SAFETY: as the header demands of the caller.
            unsafe { view.check(&format!("views[{index}]")) }?;
        }
        let own: Vec<Own> = (views.iter().enumerate())
            // SAFETY: as the header demands of the caller.
            .map(|(index, view)| unsafe { view.copied(&format!("views[{index}]")) })
            .collect::<Result<_, Failure>>()?;
        let fused: Vec<FusionView> = own
            .iter()
            .map(|view| FusionView {
                camera: &view.camera,
                maps: &view.maps,
                status: None,
                confidence: view.confidence.as_deref(),
                picture: view.picture.as_ref(),
                overlap: view.overlap,
            })
            .collect();
        let host = Host::new(progress_or_null, user);
        let rows = views.iter().map(|view| view.height as usize).max().unwrap_or(0);
        let pool = JoinedPool::new(useful_threads(options.threads, rows))?;
        let points = pool.install(|| fusion::fuse(&fused, &options.fusion, &|at| host.tell(at)))?;
        out.give(skep_cloud { points: Arc::new(points) });
        Ok(())
    })
}
