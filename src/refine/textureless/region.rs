//! Connected textureless regions, their outlines, and the pixels around them.

use crate::geometry::{Grid, for_each_component};
use crate::image::{PackedImage, blurred, deviation};
use crate::scene::PixelEstimate;

/// Width in pixels of the rim of validated pixels around a grown region: enough samples for planes, near
/// enough to be of the adjacent surfaces.
const RIM_WIDTH: usize = 3;
/// Fraction of the outline that must not be border of the image: less says too little about the region's
/// surface.
const MIN_SURFACE_FRACTION: f64 = 0.6;
/// Fewest sides of pixels with a surface beyond, over the square root of the region's area in pixels: a third
/// of a disc's outline, which has about 4.5.
const MIN_SURFACE_SIDES: f64 = 1.5;
/// Most sides of pixels at the border of the image, over the square root of the area, of a region that ends
/// within the image: half a disc has about 1.6, a strip of sky many more.
const MAX_BORDER_SIDES: f64 = 2.0;
/// Pixels by which a region grows at most: windows that reach over its outline are not textureless.
const MAX_GROWTH: usize = 6;
/// Largest difference of blurred gray values to a pixel that a region grows over, in deviations of the noise:
/// two deviations of a difference of a 3 x 3 and a 5 x 5 mean, 0.39 each.
const MAX_DIFFERENCE_NOISE: f32 = 0.8;
/// Allowance on top of it, in gray values: rounding.
const MAX_DIFFERENCE_OFFSET: f32 = 0.5;
/// Radius in pixels of the box blur against noise of the region's pixels, and of those it may grow over:
/// small, to not blur over the outline.
const CORE_BLUR_RADIUS: usize = 2;
const GROWTH_BLUR_RADIUS: usize = 1;
/// Width in pixels of the band along the inside of the outline that the photo check samples: the errors of a
/// wrong plane move the outline by a few pixels.
const BAND_WIDTH: usize = 4;
/// Most samples of the band; more do not change the fraction that matches much.
const BAND_SAMPLES: usize = 400;

/// A set of pixels. Emptying it is free of charge, so that one set serves all regions.
pub(super) struct PixelSet {
    /// The generation in which a pixel was last inserted.
    inserted: Vec<u32>,
    generation: u32,
}

impl PixelSet {
    /// An empty set of pixels of an image with this many.
    pub(super) fn new(pixels: usize) -> PixelSet {
        PixelSet { inserted: vec![0; pixels], generation: 1 }
    }

    /// Replaces its pixels.
    fn reset<'a>(&mut self, pixels: impl IntoIterator<Item = &'a usize>) {
        if self.generation == u32::MAX {
            *self = PixelSet::new(self.inserted.len());
        }
        self.generation += 1;
        pixels.into_iter().for_each(|&pixel| self.inserted[pixel] = self.generation);
    }

    fn contains(&self, pixel: usize) -> bool {
        self.inserted[pixel] == self.generation
    }

    /// Returns whether the pixel is new to it.
    fn insert(&mut self, pixel: usize) -> bool {
        std::mem::replace(&mut self.inserted[pixel], self.generation) != self.generation
    }
}

/// The sides of a region's pixels that are its outline.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Outline {
    /// Those with a validated pixel beyond.
    surface_sides: usize,
    /// Those at the border of the image.
    border_sides: usize,
}

impl Outline {
    /// Fraction of the outline with a surface beyond.
    pub(super) fn surface_fraction(self) -> f64 {
        self.surface_sides as f64 / (self.surface_sides + self.border_sides).max(1) as f64
    }

    /// Whether enough of the outline of a region with this area in pixels has a surface beyond.
    pub(super) fn is_surrounded(self, area: usize) -> bool {
        let min_sides = MIN_SURFACE_SIDES * (area as f64).sqrt();
        self.surface_sides as f64 >= min_sides && self.surface_fraction() >= MIN_SURFACE_FRACTION
    }
}

/// A connected region of open pixels.
pub(super) struct Region {
    grid: Grid,
    /// Its pixels; the first one first, the others by their distance from it.
    pub core: Vec<usize>,
    /// The pixels that it has grown over.
    grown: Vec<usize>,
    /// The outline of its core.
    pub outline: Outline,
}

/// Whether a pixel is textureless and has a plane that is not validated.
pub(super) fn is_open(planes: &[PixelEstimate], is_textureless: &[bool], pixel: usize) -> bool {
    is_textureless[pixel] && !planes[pixel].validated && planes[pixel].depth > 0.0
}

/// Whether each textureless pixel is connected to textureless pixels that end within the image. Those that
/// continue beyond its border may be a sky, and what surrounds a sky is in front of it.
pub(super) fn find_enclosed(grid: Grid, is_textureless: &[bool]) -> Vec<bool> {
    let mut is_enclosed = vec![false; is_textureless.len()];
    let border_sides =
        |&pixel: &usize| grid.four_neighbors(pixel).iter().filter(|side| side.is_none()).count();
    for_each_component(
        grid,
        |pixel| is_textureless[pixel],
        |_, _| true,
        |pixels| {
            let border_sides: usize = pixels.iter().map(border_sides).sum();
            let is_within = border_sides as f64 <= MAX_BORDER_SIDES * (pixels.len() as f64).sqrt();
            pixels.iter().for_each(|&pixel| is_enclosed[pixel] = is_within);
        },
    );
    is_enclosed
}

impl Region {
    /// The open pixels that are connected to an open one.
    pub(super) fn trace(
        grid: Grid,
        planes: &[PixelEstimate],
        is_textureless: &[bool],
        first: usize,
        scratch: &mut PixelSet,
    ) -> Region {
        let mut core = vec![first];
        scratch.reset(&core);
        let mut outline = Outline::default();
        let mut next = 0;
        while next < core.len() {
            for neighbor in grid.four_neighbors(core[next]) {
                match neighbor {
                    Some(neighbor) if is_open(planes, is_textureless, neighbor) => {
                        if scratch.insert(neighbor) {
                            core.push(neighbor);
                        }
                    }
                    // Beyond a side without a surface may be anything: it does not count.
                    Some(neighbor) => outline.surface_sides += usize::from(planes[neighbor].validated),
                    None => outline.border_sides += 1,
                }
            }
            next += 1;
        }
        Region { grid, core, grown: Vec::new(), outline }
    }

    /// All of its pixels.
    pub(super) fn pixels(&self) -> impl Iterator<Item = usize> + '_ {
        self.core.iter().chain(&self.grown).copied()
    }

    /// Adds the adjacent pixels with similar gray values: their windows reach over the outline and have
    /// matched by what is beyond.
    pub(super) fn grow(&mut self, image: &PackedImage, planes: &[PixelEstimate], scratch: &mut PixelSet) {
        let grid = self.grid;
        let neighbors = |pixel| grid.four_neighbors(pixel).into_iter().flatten();
        scratch.reset(&self.core);
        let mut front: Vec<(usize, f32)> = (self.core.iter())
            .filter(|&&pixel| neighbors(pixel).any(|other| !scratch.contains(other)))
            .map(|&pixel| (pixel, blurred(image, pixel, CORE_BLUR_RADIUS)))
            .collect();
        for _ in 0..MAX_GROWTH {
            let mut next = Vec::new();
            for (pixel, gray) in front {
                for other in neighbors(pixel).filter(|&other| planes[other].depth > 0.0) {
                    // Without an estimate of the noise there is no threshold for similar gray values.
                    let noise = deviation(image, other);
                    let difference = (blurred(image, other, GROWTH_BLUR_RADIUS) - gray).abs();
                    let is_similar =
                        noise > 0.0 && difference < MAX_DIFFERENCE_NOISE * noise + MAX_DIFFERENCE_OFFSET;
                    if is_similar && scratch.insert(other) {
                        self.grown.push(other);
                        next.push((other, gray));
                    }
                }
            }
            front = next;
        }
    }

    /// The validated pixels among the grown ones and in the rim around all.
    pub(super) fn rim(&self, planes: &[PixelEstimate], scratch: &mut PixelSet) -> Vec<usize> {
        let mut front: Vec<usize> = self.pixels().collect();
        scratch.reset(&front);
        let mut rim: Vec<usize> =
            self.grown.iter().copied().filter(|&pixel| planes[pixel].validated).collect();
        for _ in 0..RIM_WIDTH {
            let mut next = Vec::new();
            for neighbor in front.iter().flat_map(|&pixel| self.grid.four_neighbors(pixel)).flatten() {
                if planes[neighbor].validated && scratch.insert(neighbor) {
                    next.push(neighbor);
                }
            }
            rim.extend(&next);
            front = next;
        }
        rim
    }

    /// Samples of its pixels along its outline.
    pub(super) fn outline_band(&self, scratch: &mut PixelSet) -> Vec<usize> {
        let mut inside: Vec<usize> = self.pixels().collect();
        let mut band = Vec::new();
        for _ in 0..BAND_WIDTH {
            scratch.reset(&inside);
            let is_interior = |&pixel: &usize| {
                self.grid.four_neighbors(pixel).into_iter().flatten().all(|other| scratch.contains(other))
            };
            let (interior, outer) = inside.into_iter().partition::<Vec<usize>, _>(is_interior);
            band.extend(outer);
            inside = interior;
        }
        let step = band.len().div_ceil(BAND_SAMPLES).max(1);
        band.into_iter().step_by(step).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { width: 80, height: 60 };

    /// Pixels of a picture.
    #[derive(Debug, PartialEq)]
    struct Counts {
        enclosed: usize,
        textureless: usize,
    }

    fn count(is_textureless: impl Fn(i32, i32) -> bool) -> Counts {
        let at = |pixel| {
            let (x, y) = GRID.position(pixel);
            is_textureless(x as i32, y as i32)
        };
        let is_textureless: Vec<bool> = (0..GRID.pixels()).map(at).collect();
        let is_enclosed = find_enclosed(GRID, &is_textureless);
        assert!(
            is_enclosed.iter().zip(&is_textureless).all(|(enclosed, textureless)| textureless >= enclosed)
        );
        let count = |marks: &[bool]| marks.iter().filter(|&&mark| mark).count();
        Counts { enclosed: count(&is_enclosed), textureless: count(&is_textureless) }
    }

    fn is_in_disc((x, y): (i32, i32), center: (i32, i32)) -> bool {
        (x - center.0).pow(2) + (y - center.1).pow(2) <= 100
    }

    #[test]
    fn discs_cut_by_the_border_are_enclosed_and_a_sky_is_not() {
        let are_all_enclosed = |Counts { enclosed, textureless }| enclosed == textureless && textureless > 0;
        assert!(are_all_enclosed(count(|x, y| is_in_disc((x, y), (40, 30)))));
        assert!(are_all_enclosed(count(|x, y| is_in_disc((x, y), (40, 0)))), "half a disc");
        assert_eq!(count(|_, y| y < 20).enclosed, 0, "a sky");
        assert_eq!(count(|x, y| x + 4 * y < 40).enclosed, 0, "a corner of the sky");
        assert_eq!(count(|_, _| true).enclosed, 0);
        assert_eq!(count(|_, _| false), Counts { enclosed: 0, textureless: 0 });
        let both = count(|x, y| y < 20 || is_in_disc((x, y), (40, 40)));
        assert_eq!(both.textureless - both.enclosed, 80 * 20, "each region has a result of its own");
    }
}
