//! The pixel grid of an image: indices, positions and neighbors of pixels.

/// Column and row of a pixel.
pub(crate) type Position = (usize, usize);

/// Offset between pixels, in columns and rows.
pub(crate) type Offset = (i32, i32);

/// The size of an image, whose pixels are numbered row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Grid {
    /// Pixels per row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
}

impl Grid {
    /// Number of pixels.
    pub(crate) fn pixels(self) -> usize {
        self.width * self.height
    }

    /// Index of the pixel at a position.
    #[inline(always)]
    pub(crate) fn index(self, (x, y): Position) -> usize {
        y * self.width + x
    }

    /// Position of the pixel with this index.
    #[inline(always)]
    pub(crate) fn position(self, index: usize) -> Position {
        (index % self.width, index / self.width)
    }

    /// The position at an offset from another; `None` outside the image.
    #[inline(always)]
    pub(crate) fn neighbor(self, (x, y): Position, (dx, dy): Offset) -> Option<Position> {
        // A negative coordinate wraps around to one larger than any image.
        let (x, y) = (x.wrapping_add_signed(dx as isize), y.wrapping_add_signed(dy as isize));
        (x < self.width && y < self.height).then_some((x, y))
    }

    /// Indices of the neighbors to the left, to the right, above and below; `None` outside the image.
    #[inline(always)]
    pub(crate) fn four_neighbors(self, index: usize) -> [Option<usize>; 4] {
        let (x, y) = self.position(index);
        [
            (x > 0).then(|| index - 1),
            (x + 1 < self.width).then(|| index + 1),
            (y > 0).then(|| index - self.width),
            (y + 1 < self.height).then(|| index + self.width),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { width: 4, height: 3 };

    #[test]
    fn indices_and_positions_are_inverse() {
        for index in 0..GRID.pixels() {
            assert_eq!(GRID.index(GRID.position(index)), index);
        }
    }

    #[test]
    fn neighbors_end_at_the_border() {
        assert_eq!(GRID.neighbor((1, 1), (2, -1)), Some((3, 0)));
        for offset in [(3, 0), (-2, 0), (0, 2), (0, -2), (i32::MIN, 0), (0, i32::MAX)] {
            assert_eq!(GRID.neighbor((1, 1), offset), None, "{offset:?}");
        }
        assert_eq!(GRID.four_neighbors(0), [None, Some(1), None, Some(4)]);
        assert_eq!(GRID.four_neighbors(6), [Some(5), Some(7), Some(2), Some(10)]);
        assert_eq!(GRID.four_neighbors(11), [Some(10), None, Some(7), None]);
    }
}
