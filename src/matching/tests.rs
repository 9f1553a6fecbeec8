//! Projection into eight source views at once, against one source view at a time.

use super::{PatchHomography, Problem, Projections, Source, SourceProjector};
use crate::geometry::{Camera, DepthRange, SlantedPlane};
use crate::image::{PackedImage, Picture};
use crate::simd::{LANES, Simd, SimdLevel, Task, dispatch};
use crate::testing::looking_at;
use glam::DVec3;

const WIDTH: usize = 41;
const HEIGHT: usize = 31;
const CENTER: (f32, f32) = (20.0, 15.0);
/// Depth of the point that all cameras look at.
const DEPTH: f32 = 4.0;

/// A camera that looks at the origin from distance [`DEPTH`], turned around it by `angle` degrees.
fn camera(angle: f64) -> Camera {
    let angle = angle.to_radians();
    let direction = DVec3::new(angle.sin(), 0.0, -angle.cos());
    looking_at(direction * f64::from(DEPTH), DVec3::ZERO, (WIDTH as u32, HEIGHT as u32), 40.0)
}

/// The image of a plane's patch in a source view that has its center inside the image.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PatchImage {
    source: usize,
    homography: PatchHomography,
    x: f32,
    y: f32,
}

/// Projects planes of a pixel into the source views of a set.
struct Project<'a> {
    problem: &'a Problem<'a>,
    pixel: (f32, f32),
    set: &'a [u32],
    planes: &'a [SlantedPlane],
    /// Set the pixel first with another view set, then the view set.
    set_views_later: bool,
}

impl Task for Project<'_> {
    type Output = Vec<Vec<PatchImage>>;

    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let Project { problem, pixel: (x, y), set, planes, set_views_later } = self;
        let mut projector = SourceProjector::new(simd, problem);
        projector.set_pixel_and_views(x, y, if set_views_later { &[0x3ff] } else { set });
        if set_views_later {
            projector.set_views(set);
        }
        let project = |plane: &SlantedPlane| {
            let mut images = Vec::new();
            for group in projector.groups() {
                let projections = group.project(simd, 1.0 / plane.inverse_depth);
                let slopes = group.slopes(simd, plane);
                assert_eq!(projections.inside.checked_shr(group.sources().len() as u32).unwrap_or(0), 0);
                assert_is_clamped(&projections, problem, group.sources());
                for (lane, &source) in group.sources().iter().enumerate() {
                    if projections.inside >> lane & 1 != 0 {
                        let (x, y) = (projections.column[lane], projections.row[lane]);
                        let homography = projections.homography(&slopes, lane);
                        images.push(PatchImage { source, homography, x, y });
                    }
                }
            }
            images
        };
        planes.iter().map(project).collect()
    }
}

/// Columns and rows lie in the images, also for points that do not.
fn assert_is_clamped(projections: &Projections, problem: &Problem, sources: &[usize]) {
    for lane in 0..LANES {
        let image = sources.get(lane).map(|&source| problem.sources[source].image);
        let (right, bottom) =
            image.map_or((0.0, 0.0), |image| ((image.width - 1) as f32, (image.height - 1) as f32));
        assert!((0.0..=right).contains(&projections.column[lane]), "lane {lane}: {projections:?}");
        assert!((0.0..=bottom).contains(&projections.row[lane]), "lane {lane}: {projections:?}");
    }
}

#[test]
fn eight_sources_at_once_project_like_one_at_a_time() {
    let blank = Picture::from_gray(WIDTH as u32, HEIGHT as u32, vec![0; WIDTH * HEIGHT]).unwrap();
    let image = PackedImage::new(&blank);
    let reference = camera(0.0);
    let mut cameras: Vec<Camera> = (0..11).map(|view| camera(f64::from(view) * 34.0 - 170.0)).collect();
    cameras[3].cx += 15.0;
    let mut problem = Problem::new(&reference, &image, DepthRange { near: 1.8, far: 5.0 });
    problem.sources = cameras.iter().map(|camera| Source::new(&reference, camera, &image, &[])).collect();
    let planes: Vec<SlantedPlane> = [0.001, 1.0, 2.5, 3.9, DEPTH, 4.1, 5.0, 8.0, 1e6]
        .map(|depth| SlantedPlane { inverse_depth: 1.0 / depth, slope_x: 0.003, slope_y: -0.007 })
        .into();
    let (mut inside, mut outside) = (0, 0);
    for set in [0x7ff, 0x555, 0x400, 0u32] {
        for (x, y) in [CENTER, (0.0, 0.0), (40.0, 30.0), (7.0, 22.0)] {
            let project = |plane: &SlantedPlane, source: usize| {
                let Source { pose, .. } = &problem.sources[source];
                // Inverted twice, as for food sources.
                let plane = SlantedPlane { inverse_depth: 1.0 / (1.0 / plane.inverse_depth), ..*plane };
                let homography = PatchHomography::of_plane(pose, pose.at_infinity(x, y), &plane);
                let pixel = problem.sources[source].project(homography.center)?;
                Some(PatchImage { source, homography, x: pixel.x, y: pixel.y })
            };
            let sources = || (0..11).filter(|source| set >> source & 1 != 0);
            let expected: Vec<Vec<PatchImage>> = planes
                .iter()
                .map(|plane| sources().filter_map(|source| project(plane, source)).collect())
                .collect();
            inside += expected.iter().map(Vec::len).sum::<usize>();
            outside += expected.iter().map(|images| set.count_ones() as usize - images.len()).sum::<usize>();
            for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
                for set_views_later in [false, true] {
                    let (problem, pixel, set) = (&problem, (x, y), &[set][..]);
                    let task = Project { problem, pixel, set, planes: &planes, set_views_later };
                    assert_eq!(dispatch(level, task), expected, "{}", level.name());
                }
            }
        }
    }
    assert!(inside > 50 && outside > 50, "{inside} inside and {outside} outside");
}
