//! The kernels in C: plane-induced homographies and NCC of patches, in batches.

use super::camera::skep_camera;
use super::image::skep_image;
use super::pointers::{destroy, get, out, out_slice, slice};
use super::status::{Failure, guard, skep_status};
use crate::geometry::{Plane, plane_homography};
use crate::image::PackedImage;
use crate::matching::{MAX_COST, PatchHomography, ReferencePatch, Window, patch_cost};
use crate::simd::{Simd, SimdLevel, Task, dispatch};
use glam::{DVec2, DVec3, Vec3};
use std::mem::MaybeUninit;

/// A gray image in the memory layout that the kernels sample. Immutable.
///
/// The kernels are stateless: they may be called from any number of threads. skep_plane_through,
/// skep_plane_homographies and skep_patch_ncc allocate no memory.
pub struct skep_packed_image {
    image: PackedImage,
}

/// Sample positions of a patch and their weights. Immutable.
pub struct skep_ncc_window {
    window: Window,
    level: SimdLevel,
}

/// A plane in the frame of a camera, normal . X = -distance. The layout of this struct is frozen.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_plane {
    /// Unit normal that faces the camera.
    pub normal: [f64; 3],
    /// Distance from the center of the camera in world units, above 0.
    pub distance: f64,
}

/// Makes the plane with a given normal through the point of a pixel at a given depth.
///
/// @param camera     The camera.
/// @param x          Column of the pixel; may be fractional.
/// @param y          Row of the pixel; may be fractional.
/// @param depth      Depth of the point in world units, above 0.
/// @param normal     3 doubles: unit normal in the camera frame that faces the camera (n . ray < 0).
/// @param plane_out  Receives the plane in the camera frame.
/// @retval SKEP_ERR_ARGUMENT  A camera, coordinate, depth or normal that cannot be used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_plane_through(
    camera: *const skep_camera,
    x: f64,
    y: f64,
    depth: f64,
    normal: *const f64,
    plane_out: *mut skep_plane,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (camera, normal, out) =
            unsafe { (get(camera, "camera")?, slice(normal, 3, "normal")?, out(plane_out, "plane_out")?) };
        let camera = camera.sized((1, 1), "camera")?;
        for (name, value) in [("x", x), ("y", y)] {
            if !value.is_finite() {
                return Err(Failure::argument(name, value, "a finite number of pixels"));
            }
        }
        if !(depth > 0.0 && depth.is_finite()) {
            return Err(Failure::argument("depth", depth, "a finite depth above 0"));
        }
        let normal = DVec3::new(normal[0], normal[1], normal[2]);
        let Plane { normal, distance } = Plane::at(&camera, DVec2::new(x, y), depth, normal);
        if !(is_unit(normal) && distance > 0.0 && distance.is_finite()) {
            return Err(Failure::argument(
                "normal",
                normal,
                "a unit vector that faces the camera (n . ray < 0)",
            ));
        }
        out.set(skep_plane { normal: normal.to_array(), distance });
        Ok(())
    })
}

fn is_unit(normal: DVec3) -> bool {
    (normal.length() - 1.0).abs() < 1e-4
}

impl skep_plane {
    fn checked(&self, name: &str) -> Result<Plane, Failure> {
        let normal = DVec3::from_array(self.normal);
        if !is_unit(normal) {
            return Err(Failure::argument(&format!("{name}.normal"), normal, "a unit vector"));
        }
        if !(self.distance > 0.0 && self.distance.is_finite()) {
            let expected = "a finite distance above 0: the plane before the camera, its normal facing it";
            return Err(Failure::argument(&format!("{name}.distance"), self.distance, expected));
        }
        Ok(Plane { normal, distance: self.distance })
    }
}

/// Computes the homographies that planes induce from the pixels of one camera to those of another, H = K' (R
/// - t n^T / D) K^-1 (equation 2 of the paper), so that (x', y', 1) ~ H (x, y, 1).
///
/// @param reference     The camera in whose frame the planes are.
/// @param source        The other camera.
/// @param planes        `count` planes.
/// @param count         Number of planes.
/// @param homographies  Receives 9 * count doubles: each matrix row by row; may be NULL when `count` is 0.
/// @retval SKEP_ERR_ARGUMENT  A camera or plane that cannot be used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_plane_homographies(
    reference: *const skep_camera,
    source: *const skep_camera,
    planes: *const skep_plane,
    count: usize,
    homographies: *mut f64,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (reference, source, planes) = unsafe {
            (get(reference, "reference")?, get(source, "source")?, slice(planes, count, "planes")?)
        };
        let reference = reference.sized((1, 1), "reference")?;
        let source = source.sized((1, 1), "source")?;
        for (index, plane) in planes.iter().enumerate() {
            check_item(index, |name| plane.checked(name).map(drop), "planes")?;
        }
        if count == 0 {
            return Ok(());
        }
        let homographies = homographies.cast::<[f64; 9]>();
        // SAFETY: as the header demands of the caller.
        let _ = unsafe { out_slice(homographies, count, count, "homographies") }?;
        for (index, plane) in planes.iter().enumerate() {
            let plane = Plane { normal: DVec3::from_array(plane.normal), distance: plane.distance };
            let homography = plane_homography(&reference, &source, &plane);
            // SAFETY: checked above; there is room for `count`.
            unsafe { homographies.add(index).write(homography.transpose().to_cols_array()) }
        }
        Ok(())
    })
}

/// Runs a check of one item of a batch; the name is only made when it fails.
fn check_item(index: usize, check: impl Fn(&str) -> Result<(), Failure>, list: &str) -> Result<(), Failure> {
    check("").or_else(|_| check(&format!("{list}[{index}]")))
}

/// Copies an image into the memory layout that the kernels sample. Colors are converted to gray as in
/// skep_scene_add_view.
///
/// @param image             The pixels.
/// @param packed_image_out  Receives the packed image; destroy it with skep_packed_image_destroy.
/// @retval SKEP_ERR_ARGUMENT  A size, stride, format or float pixel that cannot be used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_packed_image_create(
    image: *const skep_image,
    packed_image_out: *mut *mut skep_packed_image,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (image, out) = unsafe { (get(image, "image")?, out(packed_image_out, "packed_image_out")?) };
        // SAFETY: as the header demands of the caller.
        out.give(skep_packed_image { image: PackedImage::new(&unsafe { image.picture("image") }?) });
        Ok(())
    })
}

/// Destroys a packed image.
///
/// @param packed_image  The packed image; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_packed_image_destroy(packed_image: *mut skep_packed_image) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(packed_image) };
        Ok(())
    });
}

/// Creates a square window of samples. A sample weighs exp(-r^2 / (2 sigma_spatial^2) - dI^2 / (2
/// sigma_color^2)), with r its distance from the center in pixels and dI its difference in gray value from
/// the center, of [0, 1].
///
/// The window keeps the instruction set that skep_simd_level_name returns at this moment.
///
/// @param radius          Half the side of the window in pixels, 1 to 16.
/// @param step            Distance between samples in pixels, 1 to 8.
/// @param sigma_spatial   Sigma of the weight in space in pixels, at least 0.001; INFINITY: no such weight.
/// @param sigma_color     Sigma of the weight in gray value, of [0, 1], at least 0.001; INFINITY: no such
///                        weight.
/// @param min_variance    Weighted variance of gray values below which a patch has no texture, 0 to 1; 1e-5
///                        suits photographs.
/// @param ncc_window_out  Receives the window; destroy it with skep_ncc_window_destroy.
/// @retval SKEP_ERR_ARGUMENT  A number out of its range.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_ncc_window_create(
    radius: u32,
    step: u32,
    sigma_spatial: f64,
    sigma_color: f64,
    min_variance: f64,
    ncc_window_out: *mut *mut skep_ncc_window,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let out = unsafe { out(ncc_window_out, "ncc_window_out") }?;
        if !(1..=Window::MAX_RADIUS).contains(&radius) {
            return Err(Failure::argument("radius", radius, format!("1 to {}", Window::MAX_RADIUS)));
        }
        if !(1..=8).contains(&step) {
            return Err(Failure::argument("step", step, "1 to 8"));
        }
        for (name, sigma) in [("sigma_spatial", sigma_spatial), ("sigma_color", sigma_color)] {
            let usable = sigma >= 1e-3;
            if !usable {
                return Err(Failure::argument(name, sigma, "a number of at least 0.001, or INFINITY"));
            }
        }
        if !(0.0..=1.0).contains(&min_variance) {
            return Err(Failure::argument("min_variance", min_variance, "a number from 0 to 1"));
        }
        let window = Window::new(radius, step, sigma_spatial, sigma_color, min_variance);
        out.give(skep_ncc_window { window, level: SimdLevel::detect() });
        Ok(())
    })
}

/// Destroys a window.
///
/// @param window  The window; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_ncc_window_destroy(window: *mut skep_ncc_window) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(window) };
        Ok(())
    });
}

/// Computes the normalized cross-correlation (NCC) of patches of the reference image with the patches of the
/// source image that homographies map them to. Samples outside of the reference image have no weight; outside
/// of the source image its border is repeated. The source is interpolated bilinearly at positions truncated
/// to 1/256 pixel, so that an NCC differs from the exact one by some 1e-4.
///
/// Consecutive patches at the same pixel share the samples of the reference: sort by pixel.
///
/// @param window        The window.
/// @param reference     The reference image.
/// @param source        The source image.
/// @param pixels        2 * count numbers: x, y of the center of each patch in the reference image.
/// @param homographies  9 * count doubles: maps pixels of the reference to pixels of the source, row by row,
///                      one for each patch.
/// @param count         Number of patches.
/// @param ncc           Receives `count` floats from -1 to 1; -1 also where either patch has no texture; may
///                      be NULL when `count` is 0.
/// @retval SKEP_ERR_ARGUMENT  A pixel outside of the reference image, or a homography that is not finite.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_patch_ncc(
    window: *const skep_ncc_window,
    reference: *const skep_packed_image,
    source: *const skep_packed_image,
    pixels: *const u32,
    homographies: *const f64,
    count: usize,
    ncc: *mut f32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (window, reference, source, pixels, homographies) = unsafe {
            (
                get(window, "window")?,
                &get(reference, "reference")?.image,
                &get(source, "source")?.image,
                slice(pixels.cast::<[u32; 2]>(), count, "pixels")?,
                slice(homographies.cast::<[f64; 9]>(), count, "homographies")?,
            )
        };
        for (index, &[x, y]) in pixels.iter().enumerate() {
            if x as usize >= reference.width || y as usize >= reference.height {
                let expected = format!("inside {} x {} pixels", reference.width, reference.height);
                let value = format!("({x}, {y})");
                return Err(Failure::argument(&format!("pixels[{index}]"), value, expected));
            }
        }
        for (index, homography) in homographies.iter().enumerate() {
            if !homography.iter().all(|entry| entry.is_finite()) {
                let value = format!("{homography:?}");
                return Err(Failure::argument(&format!("homographies[{index}]"), value, "finite numbers"));
            }
        }
        // SAFETY: as the header demands of the caller.
        let _ = unsafe { out_slice(ncc, count, count, "ncc") }?;
        if count == 0 {
            return Ok(());
        }
        // SAFETY: checked above; the memory need not hold floats yet.
        let ncc = unsafe { std::slice::from_raw_parts_mut(ncc.cast::<MaybeUninit<f32>>(), count) };
        dispatch(
            window.level,
            Batch { window: &window.window, reference, source, pixels, homographies, ncc },
        );
        Ok(())
    })
}

/// A batch of patches.
struct Batch<'a> {
    window: &'a Window,
    reference: &'a PackedImage,
    source: &'a PackedImage,
    pixels: &'a [[u32; 2]],
    homographies: &'a [[f64; 9]],
    ncc: &'a mut [MaybeUninit<f32>],
}

impl Task for Batch<'_> {
    type Output = ();

    fn run<S: Simd>(self, simd: S) {
        let Batch { window, reference, source, pixels, homographies, ncc } = self;
        simd.vectorize(
            #[inline(always)]
            || {
                let mut patch = ReferencePatch::new(window);
                let mut sampled = None;
                for ((pixel, homography), ncc) in pixels.iter().zip(homographies).zip(ncc) {
                    let [x, y] = *pixel;
                    if sampled != Some([x, y]) {
                        patch.sample(simd, window, reference, x as usize, y as usize);
                        sampled = Some([x, y]);
                    }
                    let about = about_pixel(homography, f64::from(x), f64::from(y));
                    let cost = patch_cost(simd, window, &patch, source, &about);
                    ncc.write(1.0 - cost.min(MAX_COST));
                }
            },
        )
    }
}

/// A homography about a pixel. Scaled so that the center's third coordinate is 1, which f32 holds best.
#[inline(always)]
fn about_pixel(h: &[f64; 9], x: f64, y: f64) -> PatchHomography {
    let column = |index: usize| DVec3::new(h[index], h[index + 3], h[index + 6]);
    let center = column(0) * x + column(1) * y + column(2);
    let scale = 1.0 / center.z;
    let scaled = |vector: DVec3| -> Vec3 { (vector * scale).as_vec3() };
    PatchHomography { center: scaled(center), along_x: scaled(column(0)), along_y: scaled(column(1)) }
}
