//! Where a pixel's hypothesis falls in its source views, eight views at a time.

use super::{Reference, Source};
use crate::simd::{LANES, Simd};
use glam::Vec3;

type Lanes = [f32; LANES];

/// The source views of a reference view, and where the pixel at work lies in them for any depth.
#[derive(Debug, Clone)]
pub struct Placements<S: Simd> {
    simd: S,
    groups: Vec<Group>,
}

/// Eight source views; lanes without one have an empty image.
#[derive(Debug, Clone)]
struct Group {
    /// Columns of `K'R K^-1`, each as its three coordinates.
    infinite: [[Lanes; 3]; 3],
    /// `K't`.
    epipole: [Lanes; 3],
    /// The last column and row of the image.
    corner: [Lanes; 2],
    /// `K'R K^-1 [x y 1]` of the pixel at work.
    at_infinity: [Lanes; 3],
    /// The sources of the pixel's view set, as bits.
    wanted: u8,
}

/// Where a hypothesis falls in a source view that has it in its image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Place of the source in the reference's list.
    pub source: usize,
    /// The homogeneous pixel; its third coordinate is the depth there by that in the reference view.
    pub centre: Vec3,
    /// Column in pixels.
    pub x: f32,
    /// Row in pixels.
    pub y: f32,
}

impl<S: Simd> Placements<S> {
    /// The sources of a reference view, with all of them in the set.
    pub fn new(simd: S, reference: &Reference) -> Placements<S> {
        let group = |sources: &[Source]| {
            let lanes = |get: &dyn Fn(&Source) -> f32, none: f32| -> Lanes {
                std::array::from_fn(|lane| sources.get(lane).map_or(none, get))
            };
            let coordinates = |get: &dyn Fn(&Source) -> Vec3| -> [Lanes; 3] {
                std::array::from_fn(|axis| lanes(&|source| get(source)[axis], 0.0))
            };
            Group {
                infinite: std::array::from_fn(|column| coordinates(&|source| source.pose.infinite[column])),
                epipole: coordinates(&|source| source.pose.epipole),
                corner: [
                    lanes(&|source| (source.image.width - 1) as f32, -1.0),
                    lanes(&|source| (source.image.height - 1) as f32, -1.0),
                ],
                at_infinity: [[0.0; LANES]; 3],
                wanted: u8::MAX,
            }
        };
        Placements { simd, groups: reference.sources.chunks(LANES).map(group).collect() }
    }

    /// Goes to a pixel and takes the source views of its set.
    #[inline(always)]
    pub fn go_to(&mut self, x: f32, y: f32, set: &[u32]) {
        let simd = self.simd;
        let (x, y) = (simd.splat(x), simd.splat(y));
        for (index, group) in self.groups.iter_mut().enumerate() {
            let [along_x, along_y, origin] = &group.infinite;
            for (axis, at) in group.at_infinity.iter_mut().enumerate() {
                let start = simd.mul(simd.load(&along_x[axis]), x);
                let moved = simd.mul_add(simd.load(&along_y[axis]), y, start);
                *at = simd.store(simd.add(moved, simd.load(&origin[axis])));
            }
            group.wanted = byte_of(set, index);
        }
    }

    /// Takes another set of source views for the same pixel.
    #[inline(always)]
    pub fn keep(&mut self, set: &[u32]) {
        for (index, group) in self.groups.iter_mut().enumerate() {
            group.wanted = byte_of(set, index);
        }
    }

    /// Where the hypothesis at this depth falls in the sources of the set that have it in their image, in their order.
    #[inline(always)]
    pub fn find(&self, depth: f32, mut found: impl FnMut(Placement)) {
        let simd = self.simd;
        let (zero, inverse_depth) = (simd.splat(0.0), simd.splat(1.0 / depth));
        for (index, group) in self.groups.iter().enumerate() {
            if group.wanted == 0 {
                continue;
            }
            let (x, y, z) = (
                group.coordinate(simd, 0, inverse_depth),
                group.coordinate(simd, 1, inverse_depth),
                group.coordinate(simd, 2, inverse_depth),
            );
            let inverse_z = simd.div(simd.splat(1.0), z);
            let (column, row) = (simd.mul(x, inverse_z), simd.mul(y, inverse_z));
            let [right, bottom] = [simd.load(&group.corner[0]), simd.load(&group.corner[1])];
            let (to_right, to_bottom) = (simd.sub(right, column), simd.sub(bottom, row));
            let margin = simd.min(simd.min(column, row), simd.min(to_right, to_bottom));
            let in_front = simd.at_least(z, simd.splat(f32::MIN_POSITIVE));
            let mut inside = simd.at_least(margin, zero) & in_front & group.wanted;
            let [x, y, z] = [simd.store(x), simd.store(y), simd.store(z)];
            let [column, row] = [simd.store(column), simd.store(row)];
            while inside != 0 {
                let lane = inside.trailing_zeros() as usize % LANES;
                inside &= inside - 1;
                found(Placement {
                    source: index * LANES + lane,
                    centre: Vec3::new(x[lane], y[lane], z[lane]),
                    x: column[lane],
                    y: row[lane],
                });
            }
        }
    }
}

impl Group {
    /// A homogeneous coordinate of the pixel's point at an inverse depth. A function, no closure: what is not inlined is
    /// not compiled for the instruction set.
    #[inline(always)]
    fn coordinate<S: Simd>(&self, simd: S, axis: usize, inverse_depth: S::F32) -> S::F32 {
        let (epipole, origin) = (simd.load(&self.epipole[axis]), simd.load(&self.at_infinity[axis]));
        simd.mul_add(epipole, inverse_depth, origin)
    }
}

/// The bits of the eight sources of a group.
#[inline(always)]
fn byte_of(set: &[u32], group: usize) -> u8 {
    set.get(group / 4).map_or(0, |word| (word >> (group % 4 * LANES)) as u8)
}
