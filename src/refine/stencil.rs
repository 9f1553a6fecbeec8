//! The weighted disc of a bilateral filter.

use crate::geometry::{Grid, Offset, Position};
use crate::image::PackedImage;

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
