//! Neighborhoods of the filters: maps with a border for whole rows at a time, and the weighted disc of a
//! bilateral filter for single pixels.

use crate::geometry::{Grid, Offset, Position};
use crate::image::PackedImage;
use crate::simd::LANES;
use rayon::prelude::*;

/// A map with a border of one value on all sides, so that loops over whole rows need no bounds checks. On the
/// right the border fills the last [`LANES`] columns that the map begins.
pub(crate) struct PaddedMap {
    border: usize,
    stride: usize,
    values: Vec<f32>,
}

/// The border of a [`PaddedMap`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Border {
    /// Its width in pixels.
    pub width: usize,
    /// The value of its pixels.
    pub value: f32,
}

impl PaddedMap {
    /// The map with these values by pixel index.
    pub(crate) fn new(grid: Grid, border: Border, value: impl Fn(usize) -> f32 + Sync) -> PaddedMap {
        let stride = grid.width.next_multiple_of(LANES) + 2 * border.width;
        let mut values = vec![border.value; stride * (grid.height + 2 * border.width)];
        let rows = values[border.width * stride..].par_chunks_exact_mut(stride).take(grid.height);
        rows.enumerate().for_each(|(y, row)| {
            for (x, entry) in row[border.width..][..grid.width].iter_mut().enumerate() {
                *entry = value(grid.index((x, y)));
            }
        });
        PaddedMap { border: border.width, stride, values }
    }

    /// `width` values of row `y + dy` from column `dx` on; offsets are limited to the width of the border.
    #[inline(always)]
    pub(crate) fn row(&self, y: usize, offset: Offset, width: usize) -> &[f32] {
        &self.values[self.index((0, y), offset)..][..width]
    }

    /// The values of `LANES` pixels from `x + dx` on in row `y + dy`; `x` is a multiple of `LANES` inside the
    /// map, offsets are limited to the width of the border.
    #[inline(always)]
    pub(crate) fn lanes(&self, at: Position, offset: Offset) -> &[f32; LANES] {
        let index = self.index(at, offset);
        self.values[index..].first_chunk().expect("the border fills the last lanes")
    }

    #[inline(always)]
    fn index(&self, (x, y): Position, (dx, dy): Offset) -> usize {
        let row = (y + self.border).wrapping_add_signed(dy as isize);
        row * self.stride + (x + self.border).wrapping_add_signed(dx as isize)
    }
}

/// `exp(-value^2 / (2 sigma^2))`.
fn gaussian(value: f32, sigma: f32) -> f32 {
    (-value * value / (2.0 * sigma * sigma)).exp()
}

/// The offsets of a neighborhood without its center, row by row, with their weights.
pub(crate) struct Stencil(Vec<(Offset, f32)>);

impl Stencil {
    /// The disc with `dx^2 + dy^2 <= radius^2 + 1`, weighted by a Gaussian of the distance; both lengths in
    /// pixels.
    pub(crate) fn disc(radius: i32, sigma: f32) -> Stencil {
        let offsets = (-radius..=radius).flat_map(|dy| (-radius..=radius).map(move |dx| (dx, dy)));
        let is_inside = |&(dx, dy): &Offset| dx * dx + dy * dy <= radius * radius + 1 && (dx, dy) != (0, 0);
        let weigh = |(dx, dy): Offset| ((dx, dy), gaussian(((dx * dx + dy * dy) as f32).sqrt(), sigma));
        Stencil(offsets.filter(is_inside).map(weigh).collect())
    }
}

/// Weights of differences of gray values.
pub(crate) struct GrayWeights([f32; 256]);

impl GrayWeights {
    /// A Gaussian of the difference in gray values of 0 to 255, but `min_weight` at least.
    pub(crate) fn new(sigma: f32, min_weight: f32) -> GrayWeights {
        GrayWeights(std::array::from_fn(|difference| gaussian(difference as f32, sigma).max(min_weight)))
    }
}

/// The neighborhood of a bilateral filter (Tomasi and Manduchi, 1998): neighbors are weighted by their
/// distance and by the difference of their gray value.
pub(crate) struct BilateralStencil {
    /// Weights by distance.
    pub spatial: Stencil,
    /// Weights by difference of gray values.
    pub gray: GrayWeights,
}

/// A pixel of a neighborhood.
pub(crate) struct Neighbor {
    /// Its index.
    pub pixel: usize,
    /// Its offset from the center.
    pub offset: Offset,
    /// Its weight.
    pub weight: f32,
}

impl BilateralStencil {
    /// The neighbors of a pixel inside the image, row by row.
    #[inline(always)]
    pub(crate) fn neighbors(&self, image: &PackedImage, center: Position) -> impl Iterator<Item = Neighbor> {
        let grid = Grid { width: image.width, height: image.height };
        let gray = image.gray(center.0, center.1);
        self.spatial.0.iter().filter_map(move |&(offset, weight)| {
            let (x, y) = grid.neighbor(center, offset)?;
            let difference = gray.abs_diff(image.gray(x, y));
            let weight = weight * self.gray.0[usize::from(difference)];
            Some(Neighbor { pixel: grid.index((x, y)), offset, weight })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Picture;

    #[test]
    fn rows_are_those_of_the_map_and_of_its_border() {
        let grid = Grid { width: 3, height: 2 };
        let map = PaddedMap::new(grid, Border { width: 2, value: -1.0 }, |pixel| pixel as f32);
        assert_eq!(map.row(1, (0, 0), 3), [3.0, 4.0, 5.0]);
        assert_eq!(map.row(1, (1, -1), 3), [1.0, 2.0, -1.0]);
        assert_eq!(map.row(0, (-2, 1), 3), [-1.0, -1.0, 3.0]);
        assert_eq!(map.row(0, (0, -2), 3), [-1.0; 3]);
        assert_eq!(map.row(1, (2, 2), 3), [-1.0; 3]);
        assert_eq!(map.lanes((0, 1), (-2, -1)), &[-1.0, -1.0, 0.0, 1.0, 2.0, -1.0, -1.0, -1.0]);
        assert_eq!(map.lanes((0, 1), (2, 2)), &[-1.0; LANES]);
    }

    #[test]
    fn neighbors_are_weighted_by_distance_and_by_gray_value_and_end_at_the_border() {
        let grays = vec![10, 10, 250, 13, 10, 10, 10, 10, 10];
        let image = PackedImage::new(&Picture::from_gray(3, 3, grays).unwrap());
        let stencil = BilateralStencil { spatial: Stencil::disc(1, 2.0), gray: GrayWeights::new(3.0, 1e-3) };
        let near: Vec<Neighbor> = stencil.neighbors(&image, (0, 0)).collect();
        assert_eq!(near.iter().map(|neighbor| neighbor.pixel).collect::<Vec<_>>(), [1, 3, 4]);
        assert_eq!(near.iter().map(|neighbor| neighbor.offset).collect::<Vec<_>>(), [(1, 0), (0, 1), (1, 1)]);
        let expected = [(-0.125f32).exp(), (-0.125f32 - 0.5).exp(), (-0.25f32).exp()];
        for (neighbor, expected) in near.iter().zip(expected) {
            assert!((neighbor.weight - expected).abs() < 1e-6, "{} instead of {expected}", neighbor.weight);
        }
        let floor = stencil.neighbors(&image, (1, 0)).find(|neighbor| neighbor.pixel == 2).unwrap();
        assert!((floor.weight - 1e-3 * (-0.125f32).exp()).abs() < 1e-9);
    }
}
