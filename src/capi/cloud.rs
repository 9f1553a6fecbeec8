//! Fused points in C.

use super::pointers::{destroy, get, out, wanted, wanted_one};
use super::status::{guard, skep_status};
use crate::fusion::PointCloud;
use std::sync::Arc;

/// Fused points. Immutable.
pub struct skep_cloud {
    pub(super) points: Arc<PointCloud>,
}

/// Destroys a cloud. The result it was taken from is not affected.
///
/// @param cloud  The cloud; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_cloud_destroy(cloud: *mut skep_cloud) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(cloud) };
        Ok(())
    });
}

/// Gets the number of points.
///
/// @param cloud           The cloud.
/// @param count_out       Receives the number of points.
/// @param view_total_out  Receives the sum of the lengths of their view lists; may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_cloud_get_count(
    cloud: *const skep_cloud,
    count_out: *mut usize,
    view_total_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (points, count) = unsafe { (&get(cloud, "cloud")?.points, out(count_out, "count_out")?) };
        // SAFETY: as the header demands of the caller.
        let view_total = unsafe { wanted_one(view_total_out, "view_total_out") }?;
        view_total.into_iter().for_each(|out| out.set(points.views.total()));
        count.set(points.positions.len());
        Ok(())
    })
}

/// Copies the points.
///
/// @param cloud      The cloud.
/// @param positions  Receives 3 * count doubles: x, y, z in the world; may be NULL.
/// @param normals    Receives 3 * count floats: unit normals in the world; may be NULL.
/// @param colors     Receives 3 * count bytes: red, green, blue; 128 where no image was given; may be NULL.
/// @param capacity   Points of room in each buffer.
/// @retval SKEP_ERR_CAPACITY  `capacity` is below the number of points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_cloud_get_points(
    cloud: *const skep_cloud,
    positions: *mut f64,
    normals: *mut f32,
    colors: *mut u8,
    capacity: usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe {
            let points = &get(cloud, "cloud")?.points;
            let needed = points.positions.len();
            let positions = wanted(positions.cast::<[f64; 3]>(), capacity, needed, "positions")?;
            let normals = wanted(normals.cast::<[f32; 3]>(), capacity, needed, "normals")?;
            let colors = wanted(colors.cast::<[u8; 3]>(), capacity, needed, "colors")?;
            positions.into_iter().for_each(|out| out.set(&points.positions));
            normals.into_iter().for_each(|out| out.set(&points.normals));
            colors.into_iter().for_each(|out| out.set(&points.colors));
        }
        Ok(())
    })
}

/// Copies the views that each point was fused from, the one where it started first.
///
/// @param cloud          The cloud.
/// @param view_counts    Receives the number of views of each point, one number a point; may be NULL.
/// @param capacity       Elements of room in `view_counts`; the number of points is needed.
/// @param views          Receives the numbers of the views, point after point; may be NULL.
/// @param view_capacity  Elements of room in `views`; skep_cloud_get_count returns how many are needed.
/// @retval SKEP_ERR_CAPACITY  A buffer is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_cloud_get_views(
    cloud: *const skep_cloud,
    view_counts: *mut u32,
    capacity: usize,
    views: *mut u32,
    view_capacity: usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe {
            let lists = &get(cloud, "cloud")?.points.views;
            let view_counts = wanted(view_counts, capacity, lists.len(), "view_counts")?;
            let views = wanted(views, view_capacity, lists.total(), "views")?;
            let counts: Vec<u32> = (0..lists.len()).map(|point| lists.get(point).len() as u32).collect();
            let all: Vec<u32> = (0..lists.len()).flat_map(|point| lists.get(point)).copied().collect();
            view_counts.into_iter().for_each(|out| out.set(&counts));
            views.into_iter().for_each(|out| out.set(&all));
        }
        Ok(())
    })
}
