//! The kernels alone: the cost of a plane over depth at one pixel of a made pair, as a curve.
//!
//! `cargo run --release --example kernels`. The pair is a slanted wall with a pattern on it, so that the
//! truth is known: the curve has its minimum there, and the plane with the true normal costs less than one
//! parallel to the image.

use glam::{DMat3, DVec2, DVec3, Vec3};
use skep::geometry::{Camera, Plane, RelativePose, SlantedPlane, plane_homography};
use skep::image::{PackedImage, Picture};
use skep::matching::{PatchHomography, ReferencePatch, Window, patch_cost};
use skep::simd::{Simd, SimdLevel, Task, dispatch};

/// The pixel at work.
const PIXEL: (usize, usize) = (160, 120);
/// Depth of the wall there, in world units.
const TRUE_DEPTH: f64 = 4.0;
/// Depths tried: from 0.9 to 1.1 times the true one.
const STEPS: u32 = 20;

/// A pair of photographs with their cameras; pixels of the one go to the other by the wall's homography.
struct Pair {
    cameras: [Camera; 2],
    images: [PackedImage; 2],
    wall: Plane,
}

impl Pair {
    fn new() -> skep::Result<Pair> {
        let reference = Camera {
            width: 320,
            height: 240,
            fx: 300.0,
            fy: 300.0,
            cx: 159.5,
            cy: 119.5,
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
        };
        let source = Camera { translation: DVec3::new(-0.6, 0.0, 0.0), ..reference };
        let pixel = DVec2::new(PIXEL.0 as f64, PIXEL.1 as f64);
        let wall = Plane::at(&reference, pixel, TRUE_DEPTH, DVec3::new(0.4, 0.1, -1.0).normalize());
        // Each camera sees the pattern where its ray meets the wall; the source's pixels are taken back to
        // the reference.
        let back = plane_homography(&reference, &source, &wall).inverse();
        let images = [DMat3::IDENTITY, back].map(|to_reference| {
            let gray = |index: u32| {
                let pixel = DVec3::new(f64::from(index % 320), f64::from(index / 320), 1.0);
                let seen = to_reference * pixel;
                pattern(seen.x / seen.z, seen.y / seen.z)
            };
            Picture::from_gray(320, 240, (0..320 * 240).map(gray).collect())
        });
        let [first, second] = images;
        let images = [PackedImage::new(&first?), PackedImage::new(&second?)];
        Ok(Pair { cameras: [reference, source], images, wall })
    }
}

/// A smooth pattern that does not repeat within a window.
fn pattern(x: f64, y: f64) -> u8 {
    let waves =
        (0.31 * x + 0.12 * y).sin() + (0.17 * x - 0.29 * y).sin() + (0.05 * x * (0.02 * y).cos()).sin();
    (128.0 + 40.0 * waves) as u8
}

/// The costs of planes of this normal at all depths.
struct Curve<'a> {
    pair: &'a Pair,
    normal: Vec3,
}

impl Task for Curve<'_> {
    type Output = Vec<(f32, f32)>;

    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let Curve { pair, normal } = self;
        let [reference, source] = &pair.cameras;
        let (x, y) = (PIXEL.0 as f32, PIXEL.1 as f32);
        let pose = RelativePose::new(reference, source);
        let ray = reference.ray(DVec2::new(f64::from(x), f64::from(y))).as_vec3();
        let inverse_focal = ((1.0 / reference.fx) as f32, (1.0 / reference.fy) as f32);
        // 11 x 11 pixels, every second one; weights fall with distance and with difference of gray values.
        let window = Window::new(5, 2, 5.0, 0.2, 1e-5);
        let mut patch = ReferencePatch::new(&window);
        // What is inlined into this closure is compiled for the instruction set; enter it once for much work.
        simd.vectorize(
            #[inline(always)]
            || {
                patch.sample(simd, &window, &pair.images[0], PIXEL.0, PIXEL.1);
                let mut costs = Vec::with_capacity(STEPS as usize + 1);
                for step in 0..=STEPS {
                    let depth = TRUE_DEPTH as f32 * (0.9 + 0.2 * step as f32 / STEPS as f32);
                    let plane = SlantedPlane::new(depth, normal, ray, inverse_focal);
                    let homography = PatchHomography::of_plane(&pose, pose.at_infinity(x, y), &plane);
                    costs.push((depth, patch_cost(simd, &window, &patch, &pair.images[1], &homography)));
                }
                costs
            },
        )
    }
}

fn main() -> skep::Result<()> {
    let pair = Pair::new()?;
    let level = SimdLevel::detect();
    println!("1 - NCC at pixel {PIXEL:?}, SIMD level {}; the true depth is {TRUE_DEPTH}", level.name());
    println!("{:>8} {:>12} {:>12}", "depth", "true normal", "frontal");
    let slanted = dispatch(level, Curve { pair: &pair, normal: pair.wall.normal.as_vec3() });
    let frontal = dispatch(level, Curve { pair: &pair, normal: Vec3::NEG_Z });
    for ((depth, slanted), (_, frontal)) in slanted.iter().zip(&frontal) {
        println!("{depth:8.3} {slanted:12.4} {frontal:12.4}");
    }
    let best = slanted.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |best| best.0);
    println!("lowest cost at depth {best:.3}");
    Ok(())
}
