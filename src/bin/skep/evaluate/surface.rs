//! The surface that true depth maps show, as points.

use super::truth::Truth;
use super::work::Work;
use skep::geometry::Camera;
use skep::io::ModelImage;
use skep::{Error, Result};

/// A view sees a point if its own true depth there differs by less than this fraction.
const SEEN_TOLERANCE: f64 = 0.005;

/// The true depths of a view; empty if there are none.
pub struct TrueView {
    pub camera: Camera,
    pub depth: Vec<f32>,
}

/// The points of all true depths, and those of them that enough views see.
pub struct Surface {
    pub all: Vec<[f64; 3]>,
    pub seen: Vec<[f64; 3]>,
}

/// Reads the true depths of all images.
///
/// # Errors
/// Damaged maps; maps of another size than the camera's; no map at all; the user asked to stop.
pub fn read(work: &Work, images: &[ModelImage], truth: &Truth) -> Result<Vec<TrueView>> {
    let views = work.map("true depth maps read", images, |image| {
        let ModelImage { name, camera } = image;
        let Some(map) = truth.depth(name)? else {
            return Ok(TrueView { camera: *camera, depth: Vec::new() });
        };
        if (map.width, map.height) != (camera.width, camera.height) {
            let expected = format!("{}x{}, the size of its camera", camera.width, camera.height);
            let problem =
                format!("the true map of {name} is {}x{}; expected {expected}", map.width, map.height);
            return Err(Error::file(truth.folder(), problem));
        }
        Ok(TrueView { camera: *camera, depth: map.values })
    })?;
    if views.iter().all(|view| view.depth.iter().all(|depth| *depth == 0.0)) {
        return Err(Error::file(truth.folder(), "no true depth of any view of the scene"));
    }
    Ok(views)
}

impl TrueView {
    /// The points of the pixels that have a depth.
    fn points(&self) -> impl Iterator<Item = glam::DVec3> {
        let width = self.camera.width as usize;
        let depths = self.depth.iter().enumerate().filter(|(_, depth)| **depth > 0.0);
        depths.map(move |(pixel, &depth)| {
            let place = glam::DVec2::new((pixel % width) as f64, (pixel / width) as f64);
            self.camera.unproject(place, depth.into())
        })
    }

    /// The point of a pixel; `None` without a depth.
    pub fn point(&self, column: u32, row: u32) -> Option<glam::DVec3> {
        let depth = *self.depth.get(row as usize * self.camera.width as usize + column as usize)?;
        let place = glam::DVec2::new(column.into(), row.into());
        (depth > 0.0).then(|| self.camera.unproject(place, depth.into()))
    }

    /// Whether the view sees a point, as its own depth tells.
    pub fn sees(&self, point: glam::DVec3) -> bool {
        let Some((place, depth)) = self.camera.project(point) else { return false };
        let Some((column, row)) = self.camera.nearest_pixel(place) else { return false };
        let own = self.depth.get(row as usize * self.camera.width as usize + column as usize);
        own.is_some_and(|&own| own > 0.0 && (f64::from(own) - depth).abs() < SEEN_TOLERANCE * depth)
    }
}

/// The surface that the views show; `min_views` must see a point of [`Surface::seen`].
///
/// # Errors
/// No point that so many views see; the user asked to stop.
pub fn surface(work: &Work, views: &[TrueView], min_views: usize) -> Result<Surface> {
    let parts = work.map("true surface made", views, |view| {
        let all: Vec<glam::DVec3> = view.points().collect();
        let is_seen = |point: &&glam::DVec3| {
            let mut seen = views.iter().filter(|view| view.sees(**point));
            min_views == 0 || seen.nth(min_views - 1).is_some()
        };
        let seen: Vec<[f64; 3]> = all.iter().filter(is_seen).map(|point| point.to_array()).collect();
        Ok((all.into_iter().map(glam::DVec3::into).collect::<Vec<[f64; 3]>>(), seen))
    })?;
    let (all, seen): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
    let surface = Surface { all: all.concat(), seen: seen.concat() };
    if surface.seen.is_empty() {
        return Err(Error::argument("--min-views", min_views, "a number of views that see a true point"));
    }
    Ok(surface)
}
