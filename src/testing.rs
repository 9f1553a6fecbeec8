//! The synthetic scene of the unit tests: cameras in a row in front of a slanted textured wall, with exact
//! depths and normals.

use crate::ambc::Random;
use crate::geometry::DepthRange;
use crate::geometry::ViewSets;
use crate::geometry::{Camera, Plane};
use crate::image::{PackedImage, Picture};
use crate::matching::Window;
use crate::matching::{Problem, Source};
use crate::options::Options;
use crate::scene::CompactPlane;
use crate::scene::{PixelEstimate, PlaneMap};
use glam::{DMat3, DVec2, DVec3, Vec3};

/// Contains the wall's depths with a margin.
pub(crate) const RANGE: DepthRange = DepthRange { near: 2.0, far: 12.0 };

/// The first view is the reference, the others are its sources.
pub(crate) struct World {
    pub cameras: Vec<Camera>,
    pub images: Vec<PackedImage>,
    /// The published surfaces of the sources; empty by default.
    pub surfaces: Vec<Vec<CompactPlane>>,
}

/// Unit normal of the wall, which goes through (0, 0, 5).
fn wall_normal() -> DVec3 {
    DVec3::new(0.2, 0.1, -1.0).normalize()
}

/// Gray value of the wall's texture.
pub(crate) fn gray(point: DVec3) -> u8 {
    let waves = (7.0 * point.x + 3.0 * point.y).sin() + (5.0 * point.y - 3.0 * point.x + 1.0).sin();
    (127.0 + 55.0 * waves).round() as u8
}

/// A sample of an approximate normal distribution with standard deviation 1.
pub(crate) fn white(random: &mut Random) -> f32 {
    (0..12).map(|_| random.unit()).sum::<f32>() - 6.0
}

/// The wall in a camera's frame.
fn wall(camera: &Camera) -> Plane {
    let normal = camera.rotation * wall_normal();
    Plane { normal, distance: -normal.dot(camera.to_camera(DVec3::Z * 5.0)) }
}

/// Column and row of a pixel.
pub(crate) fn place(camera: &Camera, pixel: usize) -> DVec2 {
    let width = camera.width as usize;
    DVec2::new((pixel % width) as f64, (pixel / width) as f64)
}

/// Depth of the wall at a pixel.
pub(crate) fn depth(camera: &Camera, pixel: usize) -> f32 {
    wall(camera).depth(camera, place(camera, pixel)) as f32
}

/// Unit normal of the wall in a camera's frame.
pub(crate) fn normal(camera: &Camera) -> Vec3 {
    wall(camera).normal.as_vec3()
}

/// The wall at every pixel, each plane consistent with one source and not validated, at a cost of 0.1.
pub(crate) fn exact(camera: &Camera) -> PlaneMap {
    let plane = |pixel| PixelEstimate {
        depth: depth(camera, pixel),
        normal: normal(camera),
        cost: 0.1.into(),
        consistent_views: 1,
        validated: false,
    };
    PlaneMap { planes: (0..camera.pixels()).map(plane).collect() }
}

/// A camera at `x` on a horizontal line in front of the wall, turned so that it sees the same part of the
/// wall.
pub(crate) fn camera(x: f64, (width, height): (u32, u32)) -> Camera {
    let rotation = DMat3::from_rotation_y((x / 5.0).atan());
    Camera {
        width,
        height,
        fx: 40.0,
        fy: 42.0,
        cx: f64::from(width) / 2.0,
        cy: f64::from(height) / 2.0,
        rotation,
        translation: -(rotation * DVec3::X * x),
    }
}

impl World {
    /// Cameras at these positions on the line with images of this size.
    pub(crate) fn new(places: &[f64], size: (u32, u32)) -> World {
        let cameras: Vec<Camera> = places.iter().map(|&x| camera(x, size)).collect();
        let image = |camera: &Camera| {
            let point = |pixel| camera.unproject(place(camera, pixel), f64::from(depth(camera, pixel)));
            let grays = (0..camera.pixels()).map(|pixel| gray(point(pixel))).collect();
            PackedImage::new(&Picture::from_gray(size.0, size.1, grays).unwrap())
        };
        World {
            images: cameras.iter().map(image).collect(),
            surfaces: vec![Vec::new(); cameras.len()],
            cameras,
        }
    }

    /// Five cameras whose images mostly overlap.
    pub(crate) fn five() -> World {
        World::new(&[0.0, 0.8, -0.8, 1.4, -1.4], (36, 28))
    }

    /// The first view with all others as sources.
    pub(crate) fn problem(&self) -> Problem<'_> {
        let mut problem = Problem::new(&self.cameras[0], &self.images[0], RANGE);
        for view in 1..self.cameras.len() {
            let (image, surface) = (&self.images[view], &self.surfaces[view]);
            problem.sources.push(Source::new(&self.cameras[0], &self.cameras[view], image, surface));
        }
        problem
    }

    /// The exact planes of all views.
    pub(crate) fn exact(&self) -> Vec<PlaneMap> {
        self.cameras.iter().map(exact).collect()
    }

    /// View sets of the first view's pixels that hold all sources.
    pub(crate) fn all_views(&self) -> ViewSets {
        ViewSets::full(self.cameras[0].pixels(), self.cameras.len() - 1)
    }
}

/// The window of the tests.
pub(crate) fn window() -> Window {
    Window::new(5, 2, 5.0, 0.2, 1e-5)
}

/// A camera at `position` that looks at `target`, the x axis of its image horizontal.
pub(crate) fn looking_at(position: DVec3, target: DVec3, (width, height): (u32, u32), focal: f64) -> Camera {
    let forward = (target - position).normalize();
    let right = DVec3::Y.cross(forward).normalize();
    let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
    Camera {
        width,
        height,
        fx: focal,
        fy: focal,
        cx: f64::from(width - 1) / 2.0,
        cy: f64::from(height - 1) / 2.0,
        rotation,
        translation: -(rotation * position),
    }
}

/// These options with a change.
pub(crate) fn changed(mut options: Options, change: impl FnOnce(&mut Options)) -> Options {
    change(&mut options);
    options
}

/// A scene of photographs with these names, which have no files and no points.
#[cfg(feature = "io")]
pub(crate) fn source_scene(names: &[&str]) -> crate::import::SourceScene {
    let photograph = |&name: &&str| {
        let lens = crate::geometry::Lens { camera: camera(0.0, (8, 6)), distortion: None };
        crate::import::SourcePhotograph::new(name.to_owned(), name.into(), lens)
    };
    crate::import::SourceScene {
        origin: "a test".to_owned(),
        photographs: names.iter().map(photograph).collect(),
        points: Vec::new(),
        workspace: None,
        warnings: Vec::new(),
    }
}
