//! Files for C programs: scenes in, maps, clouds and whole dense folders out.

use super::cloud::skep_cloud;
use super::image::check_size;
use super::maps;
use super::options::{options_or_default, skep_options};
use super::pointers::{self, get, give_list, out, path, slice, wanted};
use super::progress::{Host, skep_progress_fn};
use super::result::skep_result;
use super::scene::skep_scene;
use super::status::{Failure, guard, skep_status};
use crate::error::Error;
use crate::geometry::DepthRange;
use crate::import;
use crate::io::{self, Workspace};
use crate::memory::require_memory;
use crate::scene::View;
use std::ffi::{c_char, c_void};
use std::path::Path;

/// Reads a scene of any format that skep_job_plan reads: a COLMAP workspace or model with any lens, text or
/// binary, nerfstudio's transforms.json, OpenMVS, MVSNet, OpenSfM, Middlebury. Photographs are undistorted;
/// the options `input.*` choose, reduce and mask them. Uses threads of its own, as many as the option
/// `threads` says.
///
/// @param path             Path of the scene, a folder or a file, in the bytes of the file system.
/// @param options_or_null  Options, of which `input.*`, `threads` and `memory` count; NULL for the defaults.
/// @param near             Smallest depth of every view in world units; 0 with `far` 0 derives the ranges
///                         from the scene.
/// @param far              Largest depth of every view in world units.
/// @param progress_or_null  Receives the progress of reading the photographs and may cancel; NULL: none.
/// @param user             Passed to the callback; may be NULL.
/// @param scene_out        Receives the scene; destroy it with skep_scene_destroy. skep_scene_get_warning
///                         tells what was found out while it was read.
/// @retval SKEP_ERR_ARGUMENT  Not 0 < near < far, a choice that fits no photograph, or a scene that
///                            skep_scene_validate refuses.
/// @retval SKEP_ERR_FILE      A file that is missing or cannot be used; the text names the file, the line
///                            where there is one, and what was expected.
/// @retval SKEP_ERR_MEMORY    Photographs that do not fit.
/// @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_read(
    path: *const c_char,
    options_or_null: *const skep_options,
    near: f64,
    far: f64,
    progress_or_null: skep_progress_fn,
    user: *mut c_void,
    scene_out: *mut *mut skep_scene,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (path, options, out) = unsafe {
            (
                pointers::path(path, "path")?,
                options_or_default(options_or_null)?,
                out(scene_out, "scene_out")?,
            )
        };
        let range = (near != 0.0 || far != 0.0).then_some(DepthRange { near, far });
        if let Some(range) = range {
            range.check("depth range")?;
        }
        let host = Host::new(progress_or_null, user);
        let scene = import::read_scene(path, range, &options, &|at| host.tell(at))?;
        out.give(skep_scene::new(scene));
        Ok(())
    })
}

/// Writes a scene as a folder that COLMAP and skep_scene_read read: images as PNG files under the
/// names of their views in images/, and a binary model in sparse/. A name need not end in .png: readers of
/// images look at the content.
///
/// @param scene   The scene.
/// @param folder  Path of the folder, which is created.
/// @retval SKEP_ERR_ARGUMENT  A view whose name leads out of the folder, or a scene that skep_scene_validate
///                            refuses.
/// @retval SKEP_ERR_FILE      A file that cannot be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_scene_write_colmap(
    scene: *const skep_scene,
    folder: *const c_char,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, folder) = unsafe { (get(scene, "scene")?, path(folder, "folder")?) };
        let scene = scene.checked()?;
        Ok(io::write_scene(folder, &scene)?)
    })
}

/// Writes what COLMAP calls a dense folder, except images/ and sparse/, which skep_scene_write_colmap writes:
/// for every view of the result depth maps, normal maps and consistency graphs in stereo/, raw
/// ("photometric") and validated ("geometric"), and previews in preview/; the lists of images for COLMAP in
/// stereo/; fused.ply with fused.ply.vis if there is a cloud. A file appears when it is complete.
///
/// @param result  The result.
/// @param scene   The scene that the result was made from.
/// @param folder  Path of the folder, which is created.
/// @retval SKEP_ERR_ARGUMENT  Another scene, or a view whose name leads out of the folder.
/// @retval SKEP_ERR_FILE      A file that cannot be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_write_workspace(
    result: *const skep_result,
    scene: *const skep_scene,
    folder: *const c_char,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (result, scene, folder) =
            unsafe { (get(result, "result")?, get(scene, "scene")?.checked()?, path(folder, "folder")?) };
        let workspace = Workspace::new(folder);
        let views = scene.views();
        let mut results = Vec::new();
        for (&index, result) in &result.views {
            let fits = |own: &&View| (own.camera.width, own.camera.height) == result.size();
            let Some(own) = views.get(index as usize).filter(fits) else {
                let value = format!("one whose view {index} is missing or of another size");
                return Err(Failure::argument("scene", value, "the scene the result was made from"));
            };
            results.push((own, result));
        }
        // The lists name all views, those without a result too.
        views.iter().try_for_each(|view| Workspace::check_name(&view.name))?;
        workspace.check_places(results.iter().map(|(view, _)| view.name.as_str()))?;
        for (view, result) in results {
            workspace.write_view(&view.name, &view.camera, result)?;
        }
        workspace.write_lists(views.iter().map(|view| view.name.as_str()))?;
        if let Some(points) = result.cloud() {
            Workspace::write_cloud(&workspace.cloud(), points)?;
        }
        Ok(())
    })
}

/// Writes a cloud as binary PLY (x, y, z, normals, colors), and the views of each point beside it in
/// FILE.vis, as COLMAP does. x, y and z are float, or double where floats cannot hold the distances of the
/// points, as with geographic coordinates.
///
/// @param cloud  The cloud.
/// @param file   Path of the file.
/// @retval SKEP_ERR_FILE  A file that cannot be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_cloud_write_ply(cloud: *const skep_cloud, file: *const c_char) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (cloud, file) = unsafe { (get(cloud, "cloud")?, path(file, "file")?) };
        io::write_ply(file, &cloud.points)?;
        Ok(io::write_visibility(&io::visibility_path(file), &cloud.points.views)?)
    })
}

/// Writes a depth map in COLMAP's layout.
///
/// @param file          Path of the file.
/// @param depth         height rows of width floats: finite depths, 0 for none.
/// @param width         Width in pixels, 1 to 32768.
/// @param height        Height in pixels, 1 to 32768.
/// @param stride_bytes  Bytes from a row of `depth` to the next, at least 4 * width.
/// @retval SKEP_ERR_ARGUMENT  A size, stride or depth that cannot be used.
/// @retval SKEP_ERR_FILE      The file cannot be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_write_depth_map(
    file: *const c_char,
    depth: *const f32,
    width: u32,
    height: u32,
    stride_bytes: usize,
) -> skep_status {
    guard(|| {
        let size = (width, height);
        check_size(size, "")?;
        // SAFETY: as the header demands of the caller.
        let (file, depth) = unsafe { (path(file, "file")?, maps::read(depth, size, stride_bytes, "depth")?) };
        if let Some(pixel) = depth.iter().position(|depth| !(depth.is_finite() && *depth >= 0.0)) {
            let name = format!("depth at column {}, row {}", pixel % width as usize, pixel / width as usize);
            return Err(Failure::argument(&name, depth[pixel], "a finite depth above 0, or 0 for none"));
        }
        Ok(io::write_depth_map(file, width, height, &depth)?)
    })
}

/// Writes a normal map in COLMAP's layout.
///
/// @param file          Path of the file.
/// @param normal        height rows of 3 * width floats: x, y, z of each pixel, finite.
/// @param width         Width in pixels, 1 to 32768.
/// @param height        Height in pixels, 1 to 32768.
/// @param stride_bytes  Bytes from a row of `normal` to the next, at least 12 * width.
/// @retval SKEP_ERR_ARGUMENT  A size, stride or normal that cannot be used.
/// @retval SKEP_ERR_FILE      The file cannot be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_write_normal_map(
    file: *const c_char,
    normal: *const f32,
    width: u32,
    height: u32,
    stride_bytes: usize,
) -> skep_status {
    guard(|| {
        let size = (width, height);
        check_size(size, "")?;
        let normal = normal.cast::<[f32; 3]>();
        // SAFETY: as the header demands of the caller.
        let (file, normal) =
            unsafe { (path(file, "file")?, maps::read(normal, size, stride_bytes, "normal")?) };
        if let Some(pixel) = normal.iter().position(|normal| !normal.iter().all(|part| part.is_finite())) {
            let name = format!("normal at column {}, row {}", pixel % width as usize, pixel / width as usize);
            return Err(Failure::argument(&name, format!("{:?}", normal[pixel]), "finite numbers"));
        }
        Ok(io::write_normal_map(file, width, height, &normal)?)
    })
}

/// Writes a consistency graph in COLMAP's layout: the views that each pixel is consistent with. Pixels
/// without any are left out of the file.
///
/// @param file        Path of the file.
/// @param width       Width in pixels, 1 to 32768.
/// @param height      Height in pixels, 1 to 32768.
/// @param counts      width * height numbers: how many views each pixel has.
/// @param views       `view_total` numbers of views, pixel after pixel.
/// @param view_total  Sum of `counts`.
/// @retval SKEP_ERR_ARGUMENT  A size that cannot be used, a `view_total` that is not the sum of `counts`, or
///                            a number above 2^31 - 1.
/// @retval SKEP_ERR_FILE      The file cannot be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_write_consistency_graph(
    file: *const c_char,
    width: u32,
    height: u32,
    counts: *const u32,
    views: *const u32,
    view_total: usize,
) -> skep_status {
    guard(|| {
        check_size((width, height), "")?;
        let pixels = width as usize * height as usize;
        // SAFETY: as the header demands of the caller.
        let (file, counts, views) = unsafe {
            (path(file, "file")?, slice(counts, pixels, "counts")?, slice(views, view_total, "views")?)
        };
        if let Some(place) = views.iter().position(|&view| view > i32::MAX as u32) {
            let expected = format!("at most {}, what the layout holds", i32::MAX);
            return Err(Failure::argument(&format!("views[{place}]"), views[place], expected));
        }
        require_memory(8 * pixels as u64, "the places of the views")?;
        let mut ends = Vec::with_capacity(pixels);
        let sum = counts.iter().fold(0usize, |sum, &count| {
            ends.push(sum.saturating_add(count as usize));
            sum.saturating_add(count as usize)
        });
        if sum != view_total {
            return Err(Failure::argument("view_total", view_total, format!("the sum of counts, {sum}")));
        }
        Ok(io::write_consistency_graph(file, width, height, |pixel| {
            views[ends[pixel] - counts[pixel] as usize..ends[pixel]].iter().copied()
        })?)
    })
}

/// The values of a map of so many pixels; another process may have replaced the file since its size was read.
fn require_length<T>(file: &Path, values: Vec<T>, pixels: usize) -> Result<Vec<T>, Failure> {
    match values.len() == pixels {
        true => Ok(values),
        false => Err(Error::file(file, "changed while it was read").into()),
    }
}

/// Reads a depth map in COLMAP's layout, row after row without gaps.
///
/// @param file        Path of the file.
/// @param depth       Receives width * height floats; may be NULL to ask for the size.
/// @param capacity    Elements of room in `depth`.
/// @param width_out   Receives the width in pixels.
/// @param height_out  Receives the height in pixels.
/// @retval SKEP_ERR_FILE      A file that is missing, truncated or in another layout.
/// @retval SKEP_ERR_CAPACITY  `capacity` is below width * height.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_read_depth_map(
    file: *const c_char,
    depth: *mut f32,
    capacity: usize,
    width_out: *mut u32,
    height_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe {
            let (width, height) = (out(width_out, "width_out")?, out(height_out, "height_out")?);
            let file = path(file, "file")?;
            let size = io::map_size(file, 1)?;
            let pixels = size.0 as usize * size.1 as usize;
            if let Some(out) = wanted(depth, capacity, pixels, "depth")? {
                out.set(&require_length(file, io::read_depth_map(file)?.values, pixels)?);
            }
            width.set(size.0);
            height.set(size.1);
        }
        Ok(())
    })
}

/// Reads a normal map in COLMAP's layout, row after row without gaps.
///
/// @param file        Path of the file.
/// @param normal      Receives 3 * width * height floats: x, y, z of each pixel; may be NULL to ask for the
///                    size.
/// @param capacity    Elements of room in `normal`.
/// @param width_out   Receives the width in pixels.
/// @param height_out  Receives the height in pixels.
/// @retval SKEP_ERR_FILE      A file that is missing, truncated or in another layout.
/// @retval SKEP_ERR_CAPACITY  `capacity` is below 3 * width * height.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_read_normal_map(
    file: *const c_char,
    normal: *mut f32,
    capacity: usize,
    width_out: *mut u32,
    height_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe {
            let (width, height) = (out(width_out, "width_out")?, out(height_out, "height_out")?);
            let file = path(file, "file")?;
            let size = io::map_size(file, 3)?;
            let pixels = size.0 as usize * size.1 as usize;
            if let Some(out) = wanted(normal, capacity, 3 * pixels, "normal")? {
                out.set(require_length(file, io::read_normal_map(file)?.values, pixels)?.as_flattened());
            }
            width.set(size.0);
            height.set(size.1);
        }
        Ok(())
    })
}

/// Reads a consistency graph in COLMAP's layout.
///
/// @param file            Path of the file.
/// @param counts          Receives width * height numbers: how many views each pixel has; may be NULL to ask
///                        for the size.
/// @param count_capacity  Elements of room in `counts`.
/// @param views           Receives `*view_total_out` numbers of views, pixel after pixel; may be NULL to ask
///                        for their number.
/// @param view_capacity   Elements of room in `views`.
/// @param width_out       Receives the width in pixels.
/// @param height_out      Receives the height in pixels.
/// @param view_total_out  Receives the sum of `counts`.
/// @retval SKEP_ERR_FILE      A file that is missing, truncated or in another layout.
/// @retval SKEP_ERR_CAPACITY  A buffer is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_read_consistency_graph(
    file: *const c_char,
    counts: *mut u32,
    count_capacity: usize,
    views: *mut u32,
    view_capacity: usize,
    width_out: *mut u32,
    height_out: *mut u32,
    view_total_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe {
            let (width, height) = (out(width_out, "width_out")?, out(height_out, "height_out")?);
            out(view_total_out, "view_total_out")?;
            let graph = io::read_consistency_graph(path(file, "file")?)?;
            let pixels = graph.width as usize * graph.height as usize;
            // The header may lie about the size: memory is taken only for a caller who has as much.
            let counts = wanted(counts, count_capacity, pixels, "counts")?;
            let place = |entry: usize| {
                let [column, row] = graph.pixels[entry];
                row as usize * graph.width as usize + column as usize
            };
            let mut order: Vec<usize> = (0..graph.pixels.len()).collect();
            order.sort_by_key(|&entry| place(entry));
            let all: Vec<u32> = order.iter().flat_map(|&entry| graph.views.get(entry)).copied().collect();
            give_list(&all, views, view_capacity, view_total_out, ("views", "view_total_out"))?;
            if let Some(counts) = counts {
                let mut per_pixel = vec![0u32; pixels];
                order
                    .iter()
                    .for_each(|&entry| per_pixel[place(entry)] += graph.views.get(entry).len() as u32);
                counts.set(&per_pixel);
            }
            width.set(graph.width);
            height.set(graph.height);
        }
        Ok(())
    })
}
