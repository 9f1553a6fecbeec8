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
use crate::parallel::JoinedPool;
use crate::scene::Maps;
use std::ffi::c_void;
use std::sync::Arc;

/// A view with maps to be fused, in the caller's memory, which is only read, and only during the call. This struct
/// never changes.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_fusion_view {
    /// The camera of the maps.
    pub camera: *const skep_camera,
    /// Width of the maps.
    pub width: u32,
    /// Height of the maps.
    pub height: u32,
    /// Depth of each pixel; one that is not a finite number above 0 is no estimate.
    pub depth: *const f32,
    /// Bytes from row to row of `depth`, at least 4 * width.
    pub depth_stride_bytes: usize,
    /// Normal of each pixel in the camera frame, x, y, z.
    pub normal: *const f32,
    /// Bytes from row to row of `normal`, at least 12 * width.
    pub normal_stride_bytes: usize,
    /// For the colors, of the maps' size; NULL gives gray points.
    pub image_or_null: *const skep_image,
    /// The views that may see the same surface, as indices into the list of views; see skep_scene_get_overlap.
    pub overlap: *const u32,
    /// Number of those.
    pub overlap_count: usize,
}

/// One view's copies.
struct Own<'a> {
    camera: Camera,
    maps: Maps,
    picture: Option<Picture>,
    overlap: &'a [u32],
}

impl skep_fusion_view {
    /// # Safety
    /// The pointers point to what the fields say, for `'a`.
    unsafe fn copied<'a>(&self, name: &str) -> Result<Own<'a>, Failure> {
        let size = (self.width, self.height);
        // SAFETY: as promised by the caller.
        unsafe {
            check_size(size, &format!("{name}."))?;
            let camera =
                get(self.camera, &format!("{name}.camera"))?.sized(size, &format!("{name}.camera"))?;
            let depth = maps::read(self.depth, size, self.depth_stride_bytes, &format!("{name}.depth"))?;
            let normal = self.normal.cast::<[f32; 3]>();
            let normal = maps::read(normal, size, self.normal_stride_bytes, &format!("{name}.normal"))?;
            let picture = match self.image_or_null.is_null() {
                true => None,
                false => Some(self.image(&format!("{name}.image"))?),
            };
            let overlap = slice(self.overlap, self.overlap_count, &format!("{name}.overlap"))?;
            Ok(Own { camera, maps: Maps { depth, normal }, picture, overlap })
        }
    }

    /// # Safety
    /// `image_or_null` points to an image.
    unsafe fn image(&self, name: &str) -> Result<Picture, Failure> {
        // SAFETY: as promised by the caller.
        let image = unsafe { get(self.image_or_null, name) }?;
        if (image.width, image.height) != (self.width, self.height) {
            let expected = format!("{} x {} pixels, the size of the maps", self.width, self.height);
            return Err(Failure::argument(name, format!("{} x {}", image.width, image.height), expected));
        }
        // SAFETY: as promised by the caller.
        unsafe { image.picture(name) }
    }
}

/// Fuses maps into points, with the "fusion." options and "threads". Results of a run fused with their validated maps,
/// images and overlaps give the run's own cloud to the bit.
///
/// SKEP_ERR_ARGUMENT: a camera, size, stride, image or overlap that makes no sense, named like "views[2].depth".
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
                picture: view.picture.as_ref(),
                overlap: view.overlap,
            })
            .collect();
        let host = Host::new(progress_or_null, user);
        let pool = JoinedPool::new(options.threads)?;
        let points = pool.install(|| fusion::fuse(&fused, &options.fusion, &|at| host.tell(at)))?;
        out.give(skep_cloud { points: Arc::new(points) });
        Ok(())
    })
}
