//! Fused points in C.

use super::pointers::{destroy, get, out, wanted, wanted_one};
use super::status::{guard, skep_status};
use crate::fusion::PointCloud;
use std::sync::Arc;

/// Fused points. Never changes: may be used from several threads at once.
pub struct skep_cloud {
    pub(super) points: Arc<PointCloud>,
}

/// Destroys a cloud; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_cloud_destroy(cloud: *mut skep_cloud) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(cloud) };
        Ok(())
    });
}

/// The number of points and, when `view_total_out` is not NULL, the lengths of their view lists added up.
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

/// Copies the points: `positions` x, y, z in the world (3 doubles a point), `normals` unit vectors in the world (3
/// floats a point), `colors` red, green, blue (3 bytes a point, 128 where no picture was given). Any of them may be
/// NULL. `capacity` is the number of points each buffer has room for; SKEP_ERR_CAPACITY when it is less than there are.
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

/// Copies the views each point was fused from, the one it started in first: `view_counts` their number for each point
/// (room for `capacity`), `views` their numbers, point after point (room for `view_capacity`; skep_cloud_get_count says
/// how many there are). Either may be NULL.
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
            let counts: Vec<u32> = (0..lists.len()).map(|point| lists.get(point).len() as u32).collect();
            let all: Vec<u32> = (0..lists.len()).flat_map(|point| lists.get(point)).copied().collect();
            let view_counts = wanted(view_counts, capacity, counts.len(), "view_counts")?;
            let views = wanted(views, view_capacity, all.len(), "views")?;
            view_counts.into_iter().for_each(|out| out.set(&counts));
            views.into_iter().for_each(|out| out.set(&all));
        }
        Ok(())
    })
}
