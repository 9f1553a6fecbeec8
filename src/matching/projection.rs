//! Where a pixel's hypothesis falls in its source views, eight views at a time.

use super::PatchHomography;
use super::{Problem, Source};
use crate::geometry::{SlantedPlane, ViewSets};
use crate::scene::CompactPlane;
use crate::simd::{LANES, Simd};
use glam::Vec3;
use std::array::from_fn;

type Lanes = [f32; LANES];

/// How many pixels on, in the row, those pixels are expected to fall that come next.
pub const PREFETCH_DISTANCE: usize = 16;

/// The source views of a pixel's view set, and where the pixel lies in them for any depth.
#[derive(Debug, Clone)]
pub struct SourceProjector<'a, S: Simd> {
    simd: S,
    views: Vec<Fixed<'a>>,
    groups: Vec<Group<'a>>,
    /// Groups that hold the views of the set.
    used: usize,
    /// The set they are the views of.
    set: Vec<u32>,
    pixel: (f32, f32),
}

/// What of a source view does not depend on the pixel.
#[derive(Debug, Clone, Copy)]
struct Fixed<'a> {
    /// Columns of `K'R K^-1`.
    infinite: [Vec3; 3],
    /// `K't`.
    epipole: Vec3,
    /// The last column and row of the image.
    corner: [f32; 2],
    width: i32,
    /// Its validated solutions.
    surface: &'a [CompactPlane],
}

/// Up to eight source views, one a lane.
#[derive(Debug, Clone)]
pub struct Group<'a> {
    count: usize,
    sources: [usize; LANES],
    infinite: [[Lanes; 3]; 3],
    epipole: [Lanes; 3],
    /// -1 in the lanes without a view: nothing lies inside their images.
    corner: [Lanes; 2],
    /// Pixels of a row of the image.
    width: [i32; LANES],
    /// The views' validated solutions.
    surfaces: [&'a [CompactPlane]; LANES],
    /// `K'R K^-1 [x y 1]` of the pixel at work.
    at_infinity: [Lanes; 3],
}

/// Where a hypothesis falls in the views of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projections {
    /// The homogeneous pixels; the third coordinate is the depth there by that in the reference view.
    pub center: [Lanes; 3],
    /// Columns in pixels, within the image.
    pub column: Lanes,
    /// Rows in pixels, within the image.
    pub row: Lanes,
    /// The lanes whose view has the hypothesis in its image, as bits.
    pub inside: u8,
}

/// The pixels of a group's views that are nearest to where a hypothesis falls.
#[derive(Debug, Clone, Copy)]
struct Nearest<S: Simd> {
    column: S::F32,
    row: S::F32,
    /// Their places in their images.
    places: [u32; LANES],
}

/// Validated planes of the views of a group, as each view shows its own: inverse depth at a pixel, 0 where there is none,
/// and slopes.
#[derive(Debug, Clone, Copy)]
struct Shown<S: Simd> {
    inverse_depth: S::F32,
    slope_x: S::F32,
    slope_y: S::F32,
    /// The lanes whose view has one, as bits.
    known: u8,
}

/// The planes that the views of a group found where a hypothesis falls, about the reference view's pixel.
#[derive(Debug, Clone, Copy)]
pub struct TransferredPlanes<S: Simd> {
    /// Inverse depths at the pixel.
    pub inverse_depth: S::F32,
    /// Their change per pixel along x.
    pub slope_x: S::F32,
    /// Their change per pixel along y.
    pub slope_y: S::F32,
    /// The lanes whose view found a plane, as bits; the others hold no plane.
    pub known: u8,
}

/// The validated surfaces of the views of a group where a hypothesis falls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfaces {
    /// Inverse depths at the nearest pixels, 0 where there is no surface.
    pub nearest: Lanes,
    /// Where the planes of those pixels meet the point's rays.
    pub exact: Lanes,
    /// The lanes whose view has a surface there, as bits.
    pub known: u8,
}

impl<'a, S: Simd> SourceProjector<'a, S> {
    /// The sources of a reference view, none of them taken yet.
    pub fn new(simd: S, reference: &Problem<'a>) -> SourceProjector<'a, S> {
        let fixed = |source: &Source<'a>| Fixed {
            infinite: source.pose.infinite,
            epipole: source.pose.epipole,
            corner: [(source.image.width - 1) as f32, (source.image.height - 1) as f32],
            width: source.image.width as i32,
            surface: source.surface,
        };
        let views: Vec<Fixed> = reference.sources.iter().map(fixed).collect();
        let groups = vec![Group::new(); views.len().div_ceil(LANES)];
        SourceProjector { simd, views, groups, used: 0, set: Vec::new(), pixel: (0.0, 0.0) }
    }

    /// All sources of a reference view, at no pixel yet.
    pub fn with_all_sources(simd: S, reference: &Problem<'a>) -> SourceProjector<'a, S> {
        let mut projector = SourceProjector::new(simd, reference);
        let mut all = vec![0; reference.sources.len().div_ceil(32)];
        ViewSets::fill_words(&mut all, reference.sources.len());
        projector.set_pixel_and_views(0.0, 0.0, &all);
        projector
    }

    /// Goes to a pixel and takes the source views of its set.
    #[inline(always)]
    pub fn set_pixel_and_views(&mut self, x: f32, y: f32, set: &[u32]) {
        // Neighbors often have the same set.
        if self.set == set {
            return self.set_pixel(x, y);
        }
        self.pixel = (x, y);
        self.set_views(set);
    }

    /// Goes to another pixel with the same source views.
    #[inline(always)]
    pub fn set_pixel(&mut self, x: f32, y: f32) {
        self.pixel = (x, y);
        for group in &mut self.groups[..self.used] {
            group.set_pixel(self.simd, self.pixel);
        }
    }

    /// Takes another set of source views for the same pixel.
    #[inline(always)]
    pub fn set_views(&mut self, set: &[u32]) {
        self.set.clear();
        self.set.extend_from_slice(set);
        let mut taken = 0;
        for (index, &word) in set.iter().enumerate() {
            let mut rest = word;
            while rest != 0 {
                let source = index * 32 + rest.trailing_zeros() as usize;
                rest &= rest - 1;
                self.groups[taken / LANES].take(taken % LANES, source, &self.views[source]);
                taken += 1;
            }
        }
        self.used = taken.div_ceil(LANES);
        for (index, group) in self.groups[..self.used].iter_mut().enumerate() {
            group.close((taken - index * LANES).min(LANES));
            group.set_pixel(self.simd, self.pixel);
        }
    }

    /// The views of the set, in their order.
    #[inline(always)]
    pub fn groups(&self) -> &[Group<'a>] {
        &self.groups[..self.used]
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
            corner: [zeros; 2],
            width: [0; LANES],
            surfaces: [&[]; LANES],
            at_infinity: [zeros; 3],
        }
    }

    #[inline(always)]
    fn take(&mut self, lane: usize, source: usize, view: &Fixed<'a>) {
        self.sources[lane] = source;
        for axis in 0..3 {
            for column in 0..3 {
                self.infinite[column][axis][lane] = view.infinite[column][axis];
            }
            self.epipole[axis][lane] = view.epipole[axis];
        }
        self.corner[0][lane] = view.corner[0];
        self.corner[1][lane] = view.corner[1];
        self.width[lane] = view.width;
        self.surfaces[lane] = view.surface;
    }

    /// Empties the lanes from this one on.
    #[inline(always)]
    fn close(&mut self, count: usize) {
        self.count = count;
        for lane in count..LANES {
            self.corner[0][lane] = -1.0;
            self.corner[1][lane] = -1.0;
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

    /// The views' places in the reference's list, one a lane.
    #[inline(always)]
    pub fn sources(&self) -> &[usize] {
        &self.sources[..self.count]
    }

    /// Where the pixel falls at this depth.
    #[inline(always)]
    pub fn project<S: Simd>(&self, simd: S, depth: f32) -> Projections {
        let (zero, inverse_depth) = (simd.splat(0.0), simd.splat(1.0 / depth));
        let x = self.coordinate(simd, 0, inverse_depth);
        let y = self.coordinate(simd, 1, inverse_depth);
        let z = self.coordinate(simd, 2, inverse_depth);
        let inverse_z = simd.div(simd.splat(1.0), z);
        let (column, row) = (simd.mul(x, inverse_z), simd.mul(y, inverse_z));
        let [right, bottom] = [simd.load(&self.corner[0]), simd.load(&self.corner[1])];
        let (to_right, to_bottom) = (simd.sub(right, column), simd.sub(bottom, row));
        let margin = simd.min(simd.min(column, row), simd.min(to_right, to_bottom));
        let in_front = simd.simd_ge(z, simd.splat(f32::MIN_POSITIVE));
        Projections {
            center: [simd.store(x), simd.store(y), simd.store(z)],
            // `max` last: it gives 0 for what is not a number, and for the -1 of lanes without a view.
            column: simd.store(simd.max(simd.min(column, right), zero)),
            row: simd.store(simd.max(simd.min(row, bottom), zero)),
            inside: simd.simd_ge(margin, zero) & in_front,
        }
    }

    /// The validated planes of the views at the pixels nearest to where a hypothesis falls, and what their inverse depths
    /// are exactly there.
    #[inline(always)]
    pub fn surfaces<S: Simd>(&self, simd: S, projections: &Projections) -> Surfaces {
        let nearest = self.nearest(simd, projections);
        let Shown { inverse_depth, slope_x, slope_y, known } = self.shown(simd, &nearest);
        let across = simd.mul(slope_x, simd.sub(simd.load(&projections.column), nearest.column));
        let down = simd.mul(slope_y, simd.sub(simd.load(&projections.row), nearest.row));
        Surfaces {
            nearest: simd.store(inverse_depth),
            exact: simd.store(simd.add(simd.add(inverse_depth, across), down)),
            known,
        }
    }

    /// The planes that the views found where a hypothesis falls.
    #[inline(always)]
    pub fn transfer_planes<S: Simd>(&self, simd: S, projections: &Projections) -> TransferredPlanes<S> {
        let nearest = self.nearest(simd, projections);
        let shown = self.shown(simd, &nearest);
        // A pixel at inverse depth w is `at_infinity + w epipole` in the source view; its inverse depth there is w over
        // the third coordinate, and on the plane that is linear in the other two over the third.
        let one = simd.splat(1.0);
        let scale = simd.div(one, simd.sub(one, along(simd, &shown, &nearest, &self.epipole)));
        let inverse_depth = simd.mul(along(simd, &shown, &nearest, &self.at_infinity), scale);
        TransferredPlanes {
            inverse_depth,
            slope_x: simd.mul(along(simd, &shown, &nearest, &self.infinite[0]), scale),
            slope_y: simd.mul(along(simd, &shown, &nearest, &self.infinite[1]), scale),
            known: shown.known & simd.simd_ge(inverse_depth, simd.splat(f32::MIN_POSITIVE)),
        }
    }

    /// The places in their images of the views' pixels nearest to where a hypothesis falls.
    #[inline(always)]
    pub fn nearest_pixels<S: Simd>(&self, simd: S, projections: &Projections) -> [u32; LANES] {
        self.nearest(simd, projections).places
    }

    #[inline(always)]
    fn nearest<S: Simd>(&self, simd: S, projections: &Projections) -> Nearest<S> {
        let half = simd.splat(0.5);
        let column = simd.trunc(simd.add(simd.load(&projections.column), half));
        let row = simd.trunc(simd.add(simd.load(&projections.row), half));
        Nearest { column, row, places: simd.linear_indices(&self.width, column, row) }
    }

    #[inline(always)]
    fn shown<S: Simd>(&self, simd: S, nearest: &Nearest<S>) -> Shown<S> {
        for (lane, surface) in self.surfaces.iter().enumerate() {
            simd.prefetch(surface, nearest.places[lane] as usize + PREFETCH_DISTANCE);
        }
        let planes: [CompactPlane; LANES] = from_fn(|lane| {
            self.surfaces[lane].get(nearest.places[lane] as usize).copied().unwrap_or_default()
        });
        let inverse_depth = simd.load(&planes.map(|plane| plane.inverse_depth()));
        Shown {
            inverse_depth,
            slope_x: simd.load(&planes.map(|plane| plane.slopes().0)),
            slope_y: simd.load(&planes.map(|plane| plane.slopes().1)),
            known: simd.simd_ge(inverse_depth, simd.splat(f32::MIN_POSITIVE)),
        }
    }

    /// A homogeneous coordinate of the pixel's point at an inverse depth. A function, no closure: what is not inlined is
    /// not compiled for the instruction set.
    #[inline(always)]
    fn coordinate<S: Simd>(&self, simd: S, axis: usize, inverse_depth: S::F32) -> S::F32 {
        let (epipole, origin) = (simd.load(&self.epipole[axis]), simd.load(&self.at_infinity[axis]));
        simd.mul_add(epipole, inverse_depth, origin)
    }

    /// What the plane's homographies do to a step along x and along y: [`PatchHomography`] of all views.
    #[inline(always)]
    pub fn slopes<S: Simd>(&self, simd: S, plane: &SlantedPlane) -> [[Lanes; 3]; 2] {
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

/// What the planes shown about the nearest pixels make of homogeneous points of the views: the inverse depth on the plane
/// where a point falls, times the point's third coordinate.
#[inline(always)]
fn along<S: Simd>(simd: S, shown: &Shown<S>, nearest: &Nearest<S>, [x, y, z]: &[Lanes; 3]) -> S::F32 {
    let (x, y, z) = (simd.load(x), simd.load(y), simd.load(z));
    let across = simd.sub(x, simd.mul(nearest.column, z));
    let down = simd.sub(y, simd.mul(nearest.row, z));
    let at_pixel = simd.mul(shown.inverse_depth, z);
    simd.mul_add(shown.slope_x, across, simd.mul_add(shown.slope_y, down, at_pixel))
}

impl Projections {
    /// The homography of a lane's view.
    #[inline(always)]
    pub fn homography(&self, [along_x, along_y]: &[[Lanes; 3]; 2], lane: usize) -> PatchHomography {
        let of = |lanes: &[Lanes; 3]| Vec3::new(lanes[0][lane], lanes[1][lane], lanes[2][lane]);
        PatchHomography { center: of(&self.center), along_x: of(along_x), along_y: of(along_y) }
    }
}
