//! Projection of a pixel's hypotheses into its source views, eight views at a time, and what those views know
//! there.

use super::PatchHomography;
use super::{Problem, Source};
use crate::geometry::{SlantedPlane, ViewSets};
use crate::scene::CompactPlane;
use crate::simd::{LANES, Simd};
use glam::Vec3;
use std::array::from_fn;

/// Distance of prefetches, in pixels along a row: the search visits pixels along rows, and the next ones
/// project some pixels further on. With prefetches a run takes 0.97 of the time.
pub(crate) const PREFETCH_DISTANCE: usize = 16;

/// One value per source view of a group, in memory.
type Lanes = [f32; LANES];

/// Projects a pixel into the source views of its view set.
#[derive(Debug, Clone)]
pub(crate) struct SourceProjector<'a, S: Simd> {
    simd: S,
    /// All source views, in the order of the reference view's source list.
    views: Vec<SourceConstants<'a>>,
    groups: Vec<Group<'a>>,
    /// Groups in use: the first `active` hold the views of the set.
    active: usize,
    /// The current view set.
    set: Vec<u32>,
    /// The current pixel.
    pixel: (f32, f32),
}

/// What of a source view does not depend on the pixel, see [`Source`].
#[derive(Debug, Clone, Copy)]
struct SourceConstants<'a> {
    /// Columns of `K'R K^-1`.
    infinite: [Vec3; 3],
    /// `K't`.
    epipole: Vec3,
    /// Last column and last row of the image, in px.
    last_pixel: [f32; 2],
    /// Width of the image, in px.
    width: i32,
    /// Validated planes, one per pixel.
    surface: &'a [CompactPlane],
}

/// Up to eight source views, one per lane.
#[derive(Debug, Clone)]
pub(crate) struct Group<'a> {
    /// Lanes in use: the first `count`.
    count: usize,
    /// Indices of the views in the reference view's source list.
    sources: [usize; LANES],
    infinite: [[Lanes; 3]; 3],
    epipole: [Lanes; 3],
    /// -1 in unused lanes: no point is inside their image.
    last_pixel: [Lanes; 2],
    /// Widths of the images, in px.
    width: [i32; LANES],
    /// Validated planes of the views, one per pixel; empty in unused lanes.
    surfaces: [&'a [CompactPlane]; LANES],
    /// `K'R K^-1 [x y 1]` of the current pixel.
    at_infinity: [Lanes; 3],
}

/// Projections of a point into the views of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Projections {
    /// Homogeneous pixels; the third coordinate is the depth in the source view over that in the reference
    /// view.
    pub center: [Lanes; 3],
    /// Columns, in px, clamped to the image.
    pub column: Lanes,
    /// Rows, in px, clamped to the image.
    pub row: Lanes,
    /// Bit mask of the views in which the point is in front of the camera and inside the image.
    pub inside: u8,
}

/// The pixels nearest to the projections into the views of a group.
#[derive(Debug, Clone, Copy)]
struct NearestPixels<S: Simd> {
    column: S::F32,
    row: S::F32,
    /// Indices of the pixels in their images.
    indices: [u32; LANES],
}

/// The validated planes of the views of a group at some pixels, each in the coordinates of its own view: a
/// [`SlantedPlane`] per lane.
#[derive(Debug, Clone, Copy)]
struct PublishedPlanes<S: Simd> {
    /// 0 where there is no plane.
    inverse_depth: S::F32,
    slope_x: S::F32,
    slope_y: S::F32,
    /// Bit mask of the views that have a plane there.
    known: u8,
}

/// Validated planes of the views of a group in the coordinates of the reference view: a [`SlantedPlane`] per
/// lane, about the current pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TransferredPlanes<S: Simd> {
    /// Inverse depth at the pixel.
    pub inverse_depth: S::F32,
    /// Change of the inverse depth per pixel along x.
    pub slope_x: S::F32,
    /// Change of the inverse depth per pixel along y.
    pub slope_y: S::F32,
    /// Bit mask of the views that have a plane; the other lanes are undefined.
    pub known: u8,
}

/// Inverse depths of the validated surfaces of the views of a group at the projections of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Surfaces {
    /// Inverse depth at the pixel nearest to the projection; 0 where there is no surface.
    pub nearest: Lanes,
    /// Inverse depth of that pixel's plane at the projection itself.
    pub exact: Lanes,
    /// Bit mask of the views that have a surface there.
    pub known: u8,
}

impl<'a, S: Simd> SourceProjector<'a, S> {
    /// A projector with an empty view set.
    pub(crate) fn new(simd: S, reference: &Problem<'a>) -> SourceProjector<'a, S> {
        let constants = |source: &Source<'a>| SourceConstants {
            infinite: source.pose.infinite,
            epipole: source.pose.epipole,
            last_pixel: [(source.image.width - 1) as f32, (source.image.height - 1) as f32],
            width: source.image.width as i32,
            surface: source.surface,
        };
        let views: Vec<SourceConstants> = reference.sources.iter().map(constants).collect();
        let groups = vec![Group::new(); views.len().div_ceil(LANES)];
        SourceProjector { simd, views, groups, active: 0, set: Vec::new(), pixel: (0.0, 0.0) }
    }

    /// A projector whose view set holds all source views, at pixel (0, 0).
    pub(crate) fn with_all_sources(simd: S, reference: &Problem<'a>) -> SourceProjector<'a, S> {
        let mut projector = SourceProjector::new(simd, reference);
        let mut all = vec![0; reference.sources.len().div_ceil(32)];
        ViewSets::fill_words(&mut all, reference.sources.len());
        projector.set_pixel_and_views(0.0, 0.0, &all);
        projector
    }

    /// Sets the current pixel and its view set.
    #[inline(always)]
    pub(crate) fn set_pixel_and_views(&mut self, x: f32, y: f32, set: &[u32]) {
        // Neighboring pixels often have the same set.
        if self.set == set {
            return self.set_pixel(x, y);
        }
        self.pixel = (x, y);
        self.set_views(set);
    }

    /// Sets the current pixel and keeps the view set.
    #[inline(always)]
    pub(crate) fn set_pixel(&mut self, x: f32, y: f32) {
        self.pixel = (x, y);
        for group in &mut self.groups[..self.active] {
            group.set_pixel(self.simd, self.pixel);
        }
    }

    /// Sets the view set and keeps the current pixel.
    #[inline(always)]
    pub(crate) fn set_views(&mut self, set: &[u32]) {
        self.set.clear();
        self.set.extend_from_slice(set);
        let mut count = 0;
        for (index, &word) in set.iter().enumerate() {
            let mut rest = word;
            while rest != 0 {
                let source = index * 32 + rest.trailing_zeros() as usize;
                rest &= rest - 1;
                self.groups[count / LANES].set_lane(count % LANES, source, &self.views[source]);
                count += 1;
            }
        }
        self.active = count.div_ceil(LANES);
        for (index, group) in self.groups[..self.active].iter_mut().enumerate() {
            group.clear_lanes_from((count - index * LANES).min(LANES));
            group.set_pixel(self.simd, self.pixel);
        }
    }

    /// The ray of the current pixel of the reference view.
    #[inline(always)]
    pub(crate) fn ray(&self, reference: &Problem) -> Vec3 {
        reference.ray(self.pixel.0, self.pixel.1)
    }

    /// The views of the set, ascending by index in the source list.
    #[inline(always)]
    pub(crate) fn groups(&self) -> &[Group<'a>] {
        &self.groups[..self.active]
    }
}

impl<'a> Group<'a> {
    fn new() -> Group<'a> {
        let zeros = [0.0; LANES];
        Group {
            count: 0,
            sources: [0; LANES],
            infinite: [[zeros; 3]; 3],
            epipole: [zeros; 3],
            last_pixel: [zeros; 2],
            width: [0; LANES],
            surfaces: [&[]; LANES],
            at_infinity: [zeros; 3],
        }
    }

    #[inline(always)]
    fn set_lane(&mut self, lane: usize, source: usize, view: &SourceConstants<'a>) {
        self.sources[lane] = source;
        for axis in 0..3 {
            for column in 0..3 {
                self.infinite[column][axis][lane] = view.infinite[column][axis];
            }
            self.epipole[axis][lane] = view.epipole[axis];
        }
        self.last_pixel[0][lane] = view.last_pixel[0];
        self.last_pixel[1][lane] = view.last_pixel[1];
        self.width[lane] = view.width;
        self.surfaces[lane] = view.surface;
    }

    /// Marks the lanes from `count` on as unused.
    #[inline(always)]
    fn clear_lanes_from(&mut self, count: usize) {
        self.count = count;
        for lane in count..LANES {
            self.last_pixel[0][lane] = -1.0;
            self.last_pixel[1][lane] = -1.0;
            self.surfaces[lane] = &[];
        }
    }

    #[inline(always)]
    fn set_pixel<S: Simd>(&mut self, simd: S, (x, y): (f32, f32)) {
        let (x, y) = (simd.splat(x), simd.splat(y));
        let [along_x, along_y, origin] = &self.infinite;
        for (axis, at) in self.at_infinity.iter_mut().enumerate() {
            let start = simd.mul(simd.load(&along_x[axis]), x);
            let moved = simd.mul_add(simd.load(&along_y[axis]), y, start);
            *at = simd.store(simd.add(moved, simd.load(&origin[axis])));
        }
    }

    /// Indices of the views in the reference view's source list, one per lane in use.
    #[inline(always)]
    pub(crate) fn sources(&self) -> &[usize] {
        &self.sources[..self.count]
    }

    /// Projects the current pixel at a depth.
    #[inline(always)]
    pub(crate) fn project<S: Simd>(&self, simd: S, depth: f32) -> Projections {
        let (zero, inverse_depth) = (simd.splat(0.0), simd.splat(1.0 / depth));
        let x = self.coordinate(simd, 0, inverse_depth);
        let y = self.coordinate(simd, 1, inverse_depth);
        let z = self.coordinate(simd, 2, inverse_depth);
        let inverse_z = simd.div(simd.splat(1.0), z);
        let (column, row) = (simd.mul(x, inverse_z), simd.mul(y, inverse_z));
        let [right, bottom] = [simd.load(&self.last_pixel[0]), simd.load(&self.last_pixel[1])];
        let (to_right, to_bottom) = (simd.sub(right, column), simd.sub(bottom, row));
        let margin = simd.min(simd.min(column, row), simd.min(to_right, to_bottom));
        let in_front = simd.simd_ge(z, simd.splat(f32::MIN_POSITIVE));
        Projections {
            center: [simd.store(x), simd.store(y), simd.store(z)],
            // `max` last: it turns NaN, and the -1 of unused lanes, into 0.
            column: simd.store(simd.max(simd.min(column, right), zero)),
            row: simd.store(simd.max(simd.min(row, bottom), zero)),
            inside: simd.simd_ge(margin, zero) & in_front,
        }
    }

    /// The distance in px of each projection, at this depth, to where the point would be seen at infinity as
    /// far as it grows linearly: a relative change of the inverse depth moves the projection by this times
    /// the change.
    #[inline(always)]
    pub(crate) fn parallax<S: Simd>(&self, simd: S, projections: &Projections, depth: f32) -> S::F32 {
        let [x, y, z] = [0, 1, 2].map(|axis| simd.load(&self.epipole[axis]));
        let along_x = simd.sub(x, simd.mul(simd.load(&projections.column), z));
        let along_y = simd.sub(y, simd.mul(simd.load(&projections.row), z));
        let length = simd.sqrt(simd.mul_add(along_x, along_x, simd.mul(along_y, along_y)));
        simd.div(length, simd.mul(simd.load(&projections.center[2]), simd.splat(depth)))
    }

    /// The validated surfaces of the views at these projections.
    #[inline(always)]
    pub(crate) fn surfaces<S: Simd>(&self, simd: S, projections: &Projections) -> Surfaces {
        let pixels = self.nearest(simd, projections);
        let PublishedPlanes { inverse_depth, slope_x, slope_y, known } = self.published_planes(simd, &pixels);
        let change_x = simd.mul(slope_x, simd.sub(simd.load(&projections.column), pixels.column));
        let change_y = simd.mul(slope_y, simd.sub(simd.load(&projections.row), pixels.row));
        Surfaces {
            nearest: simd.store(inverse_depth),
            exact: simd.store(simd.add(simd.add(inverse_depth, change_x), change_y)),
            known,
        }
    }

    /// The validated planes of the views at these projections, transferred to the current pixel of the
    /// reference view.
    #[inline(always)]
    pub(crate) fn transfer_planes<S: Simd>(
        &self,
        simd: S,
        projections: &Projections,
    ) -> TransferredPlanes<S> {
        let pixels = self.nearest(simd, projections);
        let planes = self.published_planes(simd, &pixels);
        // In the source view the pixel at inverse depth w is the homogeneous point h = at_infinity + w
        // epipole, at inverse depth w / h.z. It lies on the plane where w = plane(h), with the linear
        // function of `plane_at`; hence w = plane(at_infinity) / (1 - plane(epipole)), and the slopes
        // likewise.
        let one = simd.splat(1.0);
        let scale = simd.div(one, simd.sub(one, plane_at(simd, &planes, &pixels, &self.epipole)));
        let inverse_depth = simd.mul(plane_at(simd, &planes, &pixels, &self.at_infinity), scale);
        TransferredPlanes {
            inverse_depth,
            slope_x: simd.mul(plane_at(simd, &planes, &pixels, &self.infinite[0]), scale),
            slope_y: simd.mul(plane_at(simd, &planes, &pixels, &self.infinite[1]), scale),
            known: planes.known & simd.simd_ge(inverse_depth, simd.splat(f32::MIN_POSITIVE)),
        }
    }

    /// Indices of the pixels nearest to these projections, each in the image of its view.
    #[inline(always)]
    pub(crate) fn nearest_pixels<S: Simd>(&self, simd: S, projections: &Projections) -> [u32; LANES] {
        self.nearest(simd, projections).indices
    }

    #[inline(always)]
    fn nearest<S: Simd>(&self, simd: S, projections: &Projections) -> NearestPixels<S> {
        let half = simd.splat(0.5);
        let column = simd.trunc(simd.add(simd.load(&projections.column), half));
        let row = simd.trunc(simd.add(simd.load(&projections.row), half));
        NearestPixels { column, row, indices: simd.linear_indices(&self.width, column, row) }
    }

    #[inline(always)]
    fn published_planes<S: Simd>(&self, simd: S, pixels: &NearestPixels<S>) -> PublishedPlanes<S> {
        for (lane, surface) in self.surfaces.iter().enumerate() {
            simd.prefetch(surface, pixels.indices[lane] as usize + PREFETCH_DISTANCE);
        }
        let planes: [CompactPlane; LANES] = from_fn(|lane| {
            self.surfaces[lane].get(pixels.indices[lane] as usize).copied().unwrap_or_default()
        });
        let inverse_depth = simd.load(&planes.map(|plane| plane.inverse_depth()));
        PublishedPlanes {
            inverse_depth,
            slope_x: simd.load(&planes.map(|plane| plane.slopes().0)),
            slope_y: simd.load(&planes.map(|plane| plane.slopes().1)),
            known: simd.simd_ge(inverse_depth, simd.splat(f32::MIN_POSITIVE)),
        }
    }

    /// A homogeneous coordinate of the current pixel's projections at an inverse depth.
    #[inline(always)]
    fn coordinate<S: Simd>(&self, simd: S, axis: usize, inverse_depth: S::F32) -> S::F32 {
        let (epipole, origin) = (simd.load(&self.epipole[axis]), simd.load(&self.at_infinity[axis]));
        simd.mul_add(epipole, inverse_depth, origin)
    }

    /// `along_x` and `along_y` of the plane's [`PatchHomography`] to each view.
    #[inline(always)]
    pub(crate) fn slopes<S: Simd>(&self, simd: S, plane: &SlantedPlane) -> [[Lanes; 3]; 2] {
        let (slope_x, slope_y) = (simd.splat(plane.slope_x), simd.splat(plane.slope_y));
        let [along_x, along_y, _] = &self.infinite;
        let mut slopes = [[[0.0; LANES]; 3]; 2];
        for (axis, epipole) in self.epipole.iter().enumerate() {
            let epipole = simd.load(epipole);
            slopes[0][axis] = simd.store(simd.mul_add(epipole, slope_x, simd.load(&along_x[axis])));
            slopes[1][axis] = simd.store(simd.mul_add(epipole, slope_y, simd.load(&along_y[axis])));
        }
        slopes
    }
}

/// `plane(h) = inverse_depth h.z + slope_x (h.x - column h.z) + slope_y (h.y - row h.z)`: the inverse depth
/// of each view's plane at the homogeneous point h, times h.z.
#[inline(always)]
fn plane_at<S: Simd>(
    simd: S,
    planes: &PublishedPlanes<S>,
    pixels: &NearestPixels<S>,
    [x, y, z]: &[Lanes; 3],
) -> S::F32 {
    let (x, y, z) = (simd.load(x), simd.load(y), simd.load(z));
    let offset_x = simd.sub(x, simd.mul(pixels.column, z));
    let offset_y = simd.sub(y, simd.mul(pixels.row, z));
    let at_pixel = simd.mul(planes.inverse_depth, z);
    simd.mul_add(planes.slope_x, offset_x, simd.mul_add(planes.slope_y, offset_y, at_pixel))
}

impl Projections {
    /// The homography to the view of a lane, given [`Group::slopes`].
    #[inline(always)]
    pub(crate) fn homography(&self, [along_x, along_y]: &[[Lanes; 3]; 2], lane: usize) -> PatchHomography {
        let of = |lanes: &[Lanes; 3]| Vec3::new(lanes[0][lane], lanes[1][lane], lanes[2][lane]);
        PatchHomography { center: of(&self.center), along_x: of(along_x), along_y: of(along_y) }
    }
}
