//! Maps with a border, for loops over whole rows.

use super::{Grid, Offset, Position};
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
