//! Maps with a border, so that whole rows can be compared with the rows around them without asking where the image ends.

use rayon::prelude::*;

/// A map with a border of the same value on all sides.
pub struct Padded {
    border: usize,
    stride: usize,
    values: Vec<f32>,
}

impl Padded {
    /// The map of these values, by pixel, with this many pixels `beyond` around it.
    pub fn new(
        (width, height): (usize, usize),
        (border, beyond): (usize, f32),
        value: impl Fn(usize) -> f32 + Sync,
    ) -> Padded {
        let stride = width + 2 * border;
        let mut values = vec![beyond; stride * (height + 2 * border)];
        let rows = values[border * stride..].par_chunks_exact_mut(stride).take(height);
        rows.enumerate().for_each(|(y, row)| {
            for (x, place) in row[border..][..width].iter_mut().enumerate() {
                *place = value(y * width + x);
            }
        });
        Padded { border, stride, values }
    }

    /// `width` values of the row `y + dy`, from column `dx` on; offsets reach no farther than the border.
    pub fn row(&self, y: usize, (dx, dy): (i32, i32), width: usize) -> &[f32] {
        let row = (y + self.border).wrapping_add_signed(dy as isize);
        &self.values[row * self.stride + self.border.wrapping_add_signed(dx as isize)..][..width]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_those_of_the_map_and_of_its_border() {
        let map = Padded::new((3, 2), (2, -1.0), |pixel| pixel as f32);
        assert_eq!(map.row(1, (0, 0), 3), [3.0, 4.0, 5.0]);
        assert_eq!(map.row(1, (1, -1), 3), [1.0, 2.0, -1.0]);
        assert_eq!(map.row(0, (-2, 1), 3), [-1.0, -1.0, 3.0]);
        assert_eq!(map.row(0, (0, -2), 3), [-1.0; 3]);
        assert_eq!(map.row(1, (2, 2), 3), [-1.0; 3]);
    }
}
