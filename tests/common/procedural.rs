//! Procedural scenes with exact depth, normal and visibility: ray-cast rectangles and spheres with solid
//! texture. They are the same in every run.

use glam::{DMat3, DVec2, DVec3};
use skep::geometry::Camera;
use skep::image::Picture;
use skep::{Maps, Scene, SparsePoint, View};

/// The texture of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Texture {
    /// Several octaves of noise over the world position.
    Noise,
    /// One gray value everywhere.
    Uniform,
    /// Brighter upwards, a gray value every four world units: a sky.
    Gradient,
}

/// The shape of a surface.
#[derive(Debug, Clone, Copy)]
pub enum Shape {
    /// A rectangle around `center`, spanned by the unit vectors `right` and `down`, visible from both sides.
    Rectangle { center: DVec3, right: DVec3, down: DVec3, half_size: DVec2 },
    /// A sphere.
    Sphere { center: DVec3, radius: f64 },
}

/// A shape with its texture.
#[derive(Debug, Clone, Copy)]
pub struct Surface {
    pub shape: Shape,
    pub texture: Texture,
}

/// The intersection of a ray with a surface.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// Distance from the origin of the ray, in multiples of its direction.
    pub distance: f64,
    /// Position in the world frame.
    pub position: DVec3,
    /// Normal in the world frame, towards the origin of the ray.
    pub normal: DVec3,
    /// Index of the surface.
    pub surface: usize,
}

/// Rendered views of surfaces, with ground truth.
pub struct Procedural {
    pub surfaces: Vec<Surface>,
    pub views: Vec<View>,
    /// Exact points on textured surfaces, with the views that see them.
    pub points: Vec<SparsePoint>,
    /// Exact depth and normal of every view.
    pub truth: Vec<Maps>,
}

/// Size of the standard scenes' images.
pub const SIZE: (u32, u32) = (128, 96);
/// Focal length of the standard scenes in pixels.
const FOCAL: f64 = 130.0;
/// Distance of the standard cameras from the world's origin.
const DISTANCE: f64 = 4.0;
/// Rays per column and row of a pixel: a gray value is the mean over the pixel's area.
const SUPERSAMPLES: u32 = 3;
/// Distance of the sparse points, in px.
const POINT_STEP: usize = 7;

impl Shape {
    /// A rectangle that faces a camera in front of it after a turn of `yaw` degrees around the vertical.
    pub fn upright(center: DVec3, yaw: f64, half_size: DVec2) -> Shape {
        let (sine, cosine) = yaw.to_radians().sin_cos();
        Shape::Rectangle { center, right: DVec3::new(cosine, 0.0, sine), down: DVec3::Y, half_size }
    }

    /// Distance of a point from the sphere or from the rectangle's plane.
    pub fn distance(&self, point: DVec3) -> f64 {
        match *self {
            Shape::Rectangle { center, right, down, .. } => (point - center).dot(right.cross(down)).abs(),
            Shape::Sphere { center, radius } => (point.distance(center) - radius).abs(),
        }
    }

    /// The nearest intersection in front of `origin`: distance in multiples of `direction`, and outward
    /// normal.
    fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
        match *self {
            Shape::Rectangle { center, right, down, half_size } => {
                let normal = right.cross(down);
                let distance = normal.dot(center - origin) / normal.dot(direction);
                let offset = origin + direction * distance - center;
                let inside = offset.dot(right).abs() <= half_size.x && offset.dot(down).abs() <= half_size.y;
                (distance > 0.0 && distance.is_finite() && inside).then_some((distance, normal))
            }
            Shape::Sphere { center, radius } => {
                let (to_origin, squared) = (origin - center, direction.length_squared());
                let half = to_origin.dot(direction) / squared;
                let root = half * half - (to_origin.length_squared() - radius * radius) / squared;
                let distance = -half - root.max(0.0).sqrt();
                let outward = (to_origin + direction * distance) / radius;
                (root > 0.0 && distance > 0.0).then_some((distance, outward))
            }
        }
    }
}

/// The nearest intersection of a ray; of surfaces at the same distance the first in the list.
fn cast(surfaces: &[Surface], origin: DVec3, direction: DVec3) -> Option<Hit> {
    let mut nearest: Option<Hit> = None;
    for (surface, Surface { shape, .. }) in surfaces.iter().enumerate() {
        if let Some((distance, outward)) = shape.intersect(origin, direction)
            && nearest.is_none_or(|hit| distance < hit.distance)
        {
            let normal = if outward.dot(direction) > 0.0 { -outward } else { outward };
            nearest = Some(Hit { distance, position: origin + direction * distance, normal, surface });
        }
    }
    nearest
}

/// The intersection of a pixel's ray. The ray has z = 1 in the camera frame, so that the distance is the
/// depth.
fn cast_pixel(surfaces: &[Surface], camera: &Camera, pixel: DVec2) -> Option<Hit> {
    cast(surfaces, camera.center(), camera.rotation.transpose() * camera.ray(pixel))
}

impl Procedural {
    /// Renders the surfaces with these cameras.
    pub fn new(surfaces: Vec<Surface>, cameras: &[Camera]) -> Procedural {
        let views = cameras.iter().enumerate().map(|(index, camera)| View {
            name: format!("view{index}.png"),
            picture: render(&surfaces, camera).into(),
            camera: *camera,
            mask: None,
            depth_range: None,
            sources: None,
        });
        let truth = cameras.iter().map(|camera| truth(&surfaces, camera)).collect();
        let mut scene = Procedural { views: views.collect(), points: Vec::new(), truth, surfaces };
        scene.points = scene.sparse_points();
        scene
    }

    /// The scene, for the library.
    pub fn scene(&self) -> Scene {
        Scene::new(self.views.clone(), self.points.clone()).expect("a procedural scene is valid")
    }

    /// The scene reduced to these views, in this order.
    pub fn only(&self, kept: &[usize]) -> Procedural {
        let new_index = |view: &u32| kept.iter().position(|&k| k == *view as usize).map(|index| index as u32);
        let points = self.points.iter().map(|point| SparsePoint {
            position: point.position,
            views: point.views.iter().filter_map(new_index).collect(),
        });
        Procedural {
            surfaces: self.surfaces.clone(),
            views: kept.iter().map(|&view| self.views[view].clone()).collect(),
            points: points.filter(|point| point.views.len() >= 2).collect(),
            truth: kept.iter().map(|&view| self.truth[view].clone()).collect(),
        }
    }

    /// Adds noise of this deviation, in gray values, independent for each view and pixel.
    pub fn with_noise(mut self, deviation: f64) -> Procedural {
        for (index, view) in self.views.iter_mut().enumerate() {
            let (width, height) = (view.camera.width, view.camera.height);
            let picture = view.picture.load().expect("a picture in memory");
            let noisy = |pixel: usize| {
                // The sum of twelve uniform values is nearly normally distributed, with variance 1.
                let draw = |octave| lattice_value(DVec3::new(index as f64, pixel as f64, -7.0), octave);
                let offset = deviation * ((100..112).map(draw).sum::<f64>() - 6.0);
                picture.rgb(pixel).map(|channel| (f64::from(channel) + offset).round() as u8)
            };
            let colors = (0..view.camera.pixels()).map(noisy).collect();
            let noisy = Picture::from_rgb(width, height, colors).expect("one color for each pixel");
            view.picture = noisy.into();
        }
        self
    }

    /// The intersection of the ray through the center of a pixel.
    pub fn hit(&self, view: usize, pixel: usize) -> Option<Hit> {
        let camera = &self.views[view].camera;
        cast_pixel(&self.surfaces, camera, pixel_center(camera, pixel))
    }

    /// Whether a point of a surface is inside a view's image and not occluded.
    pub fn is_visible(&self, position: DVec3, view: usize) -> bool {
        let camera = &self.views[view].camera;
        let Some((pixel, depth)) = camera.project(position) else { return false };
        camera.nearest_pixel(pixel).is_some()
            && cast_pixel(&self.surfaces, camera, pixel)
                .is_some_and(|hit| hit.distance > depth * (1.0 - 1e-6))
    }

    fn sparse_points(&self) -> Vec<SparsePoint> {
        let mut points = Vec::new();
        for (view, View { camera, .. }) in self.views.iter().enumerate() {
            // Views start at different rows and columns, so that their points differ.
            for row in (view % POINT_STEP..camera.height as usize).step_by(POINT_STEP) {
                for column in (view % POINT_STEP..camera.width as usize).step_by(POINT_STEP) {
                    let Some(hit) = self.hit(view, row * camera.width as usize + column) else { continue };
                    if self.surfaces[hit.surface].texture != Texture::Noise {
                        continue;
                    }
                    let seen = (0..self.views.len()).filter(|&other| self.is_visible(hit.position, other));
                    let views: Vec<u32> = seen.map(|view| view as u32).collect();
                    if views.len() >= 2 {
                        points.push(SparsePoint { position: hit.position, views });
                    }
                }
            }
        }
        points
    }
}

/// The center of the pixel with this index.
pub fn pixel_center(camera: &Camera, pixel: usize) -> DVec2 {
    let width = camera.width as usize;
    DVec2::new((pixel % width) as f64, (pixel / width) as f64)
}

/// A camera at `position` that looks at `target`, with the y axis of the world downwards.
pub fn looking_at(position: DVec3, target: DVec3, (width, height): (u32, u32), focal: f64) -> Camera {
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

/// Nine cameras around the origin in three rows: most pairs have a triangulation angle of 10 to 30 degrees.
pub fn cameras() -> Vec<Camera> {
    let camera = |index: u32| {
        let yaw = (14.0 * (f64::from(index % 3) - 1.0)).to_radians();
        let pitch = (12.0 * (f64::from(index / 3) - 1.0)).to_radians();
        let direction = DVec3::new(yaw.sin() * pitch.cos(), pitch.sin(), -yaw.cos() * pitch.cos());
        looking_at(direction * DISTANCE, DVec3::ZERO, SIZE, FOCAL)
    };
    (0..9).map(camera).collect()
}

/// Index of the camera in the middle.
pub const MIDDLE: usize = 4;

/// A slanted wall that fills every image.
pub fn wall(texture: Texture) -> Surface {
    let center = DVec3::new(0.0, 0.0, 0.6);
    Surface { shape: Shape::upright(center, 12.0, DVec2::splat(20.0)), texture }
}

/// A sphere in front of a wall, both textured.
pub fn plane_and_sphere() -> Procedural {
    let shape = Shape::Sphere { center: DVec3::new(0.1, 0.0, -0.2), radius: 0.7 };
    Procedural::new(vec![Surface { shape, texture: Texture::Noise }, wall(Texture::Noise)], &cameras())
}

/// Index of the post among the surfaces of [`occluding_post`].
pub const POST: usize = 0;

/// A narrow upright post in front of a wall, both textured: it occludes another part of the wall in each
/// view.
pub fn occluding_post() -> Procedural {
    let shape = Shape::upright(DVec3::new(0.0, 0.0, -0.4), 0.0, DVec2::new(0.25, 20.0));
    Procedural::new(vec![Surface { shape, texture: Texture::Noise }, wall(Texture::Noise)], &cameras())
}

/// Index of the panel among the surfaces of [`textureless_panel`].
pub const PANEL: usize = 0;

/// A textured wall with a uniform rectangle in its plane, in the middle of the images.
pub fn textureless_panel() -> Procedural {
    let wall = wall(Texture::Noise);
    let Shape::Rectangle { center, right, down, .. } = wall.shape else { unreachable!() };
    let shape = Shape::Rectangle { center, right, down, half_size: DVec2::new(0.55, 0.4) };
    // First in the list, so that rays hit the panel, which lies in the wall.
    Procedural::new(vec![Surface { shape, texture: Texture::Uniform }, wall], &cameras())
}

fn truth(surfaces: &[Surface], camera: &Camera) -> Maps {
    let mut maps = Maps::default();
    for pixel in 0..camera.pixels() {
        let hit = cast_pixel(surfaces, camera, pixel_center(camera, pixel));
        let normal = hit.map_or(DVec3::ZERO, |hit| camera.rotation * hit.normal);
        maps.depth.push(hit.map_or(0.0, |hit| hit.distance as f32));
        maps.normal.push(normal.as_vec3().to_array());
    }
    maps
}

fn render(surfaces: &[Surface], camera: &Camera) -> Picture {
    let step = 1.0 / f64::from(SUPERSAMPLES);
    let color = |pixel: usize| {
        let center = pixel_center(camera, pixel);
        let mut sum = DVec3::ZERO;
        for sample in 0..SUPERSAMPLES * SUPERSAMPLES {
            let (column, row) = (f64::from(sample % SUPERSAMPLES), f64::from(sample / SUPERSAMPLES));
            let offset = (DVec2::new(column, row) + 0.5) * step - 0.5;
            sum += cast_pixel(surfaces, camera, center + offset)
                .map_or(DVec3::ZERO, |hit| color_of(surfaces, &hit));
        }
        (sum * step * step * 255.0).round().to_array().map(|channel| channel as u8)
    };
    let colors = (0..camera.pixels()).map(color).collect();
    Picture::from_rgb(camera.width, camera.height, colors).expect("one color for each pixel")
}

/// Red, green and blue, 0 to 1.
fn color_of(surfaces: &[Surface], hit: &Hit) -> DVec3 {
    match surfaces[hit.surface].texture {
        Texture::Uniform => DVec3::splat(0.5),
        Texture::Gradient => DVec3::splat(0.85 - 0.001 * hit.position.y),
        Texture::Noise => {
            let value = noise(hit.position);
            DVec3::new(value, 0.9 * value + 0.05, 0.8 * value + 0.1)
        }
    }
}

/// Longest wavelength of the noise in world units: 16 pixels of the standard scenes; the shortest are 2
/// pixels.
const WAVELENGTH: f64 = 0.5;
const OCTAVES: u32 = 4;

/// Sum of octaves of value noise, 0 to 1.
fn noise(position: DVec3) -> f64 {
    // Rotated and translated, so that no surface is aligned with the lattice.
    let turned = DMat3::from_rotation_x(0.7) * DMat3::from_rotation_y(1.1) * position + DVec3::splat(37.3);
    let (mut sum, mut weights) = (0.0, 0.0);
    for octave in 0..OCTAVES {
        let weight = 0.8f64.powi(octave as i32);
        sum += weight * value_noise(turned * (f64::from(1 << octave) / WAVELENGTH), octave);
        weights += weight;
    }
    // The mean of octaves is close to one half: increase the contrast.
    ((sum / weights - 0.5) * 1.8 + 0.5).clamp(0.0, 1.0)
}

fn value_noise(position: DVec3, octave: u32) -> f64 {
    let cell = position.floor();
    let blend = position - cell;
    let blend = blend * blend * (DVec3::splat(3.0) - 2.0 * blend);
    let mut sum = 0.0;
    for corner in 0..8u32 {
        let bits = DVec3::new(f64::from(corner & 1), f64::from(corner >> 1 & 1), f64::from(corner >> 2));
        let weight = (DVec3::ONE - bits) * (DVec3::ONE - blend) + bits * blend;
        sum += weight.x * weight.y * weight.z * lattice_value(cell + bits, octave);
    }
    sum
}

/// A pseudo-random number in [0, 1), a function of the position.
fn lattice_value(position: DVec3, octave: u32) -> f64 {
    let mut hash = u64::from(octave);
    for coordinate in position.to_array() {
        hash = (hash ^ coordinate as i64 as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        hash ^= hash >> 29;
    }
    (hash >> 11) as f64 / (1u64 << 53) as f64
}
