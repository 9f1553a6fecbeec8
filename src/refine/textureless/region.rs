//! The connected parts without texture, and what lies around them.

use crate::ambc::FoodSource;
use crate::image::{blurred, deviation};
use crate::matching::Problem;

/// Width of the rim around a grown part, in pixels.
const RIM: usize = 3;
/// Share of the outline that must not be the border of the image.
const MIN_FRAMED: f64 = 0.6;
/// Sides of pixels with a surface beyond, by the square root of the part's area, that an outline has at least: a disc's
/// has some 4.5 of them.
const MIN_FRAME: f64 = 1.5;
/// Sides of pixels at the border of the image, by the square root of the area, that weak pixels have at most that do not go
/// on beyond it: half a disc has some 1.6 of them, a strip of sky many more.
const MAX_BORDER: f64 = 2.0;
/// How far a part grows, in pixels: windows that reach over its outline are no weak ones.
const REACH: usize = 6;
/// Difference of blurred gray values up to which a part grows, in deviations of the noise and gray values.
const ALIKE: (f32, f32) = (0.8, 0.5);
/// Width of the band along the outline, and pixels of it that are looked at.
const BAND: usize = 4;
const BAND_PIXELS: usize = 400;

/// Sets of pixels that share their memory.
pub struct Marks {
    of: Vec<u32>,
    now: u32,
}

impl Marks {
    pub fn new(pixels: usize) -> Marks {
        Marks { of: vec![0; pixels], now: 0 }
    }

    /// Starts again with these pixels.
    fn start<'a>(&mut self, pixels: impl IntoIterator<Item = &'a usize>) {
        if self.now == u32::MAX {
            (self.now, self.of) = (0, vec![0; self.of.len()]);
        }
        self.now += 1;
        pixels.into_iter().for_each(|&pixel| self.of[pixel] = self.now);
    }

    fn has(&self, pixel: usize) -> bool {
        self.of[pixel] == self.now
    }

    /// Whether the pixel was not there before.
    fn add(&mut self, pixel: usize) -> bool {
        let is_new = !self.has(pixel);
        self.of[pixel] = self.now;
        is_new
    }
}

/// A connected part of the image that shows nothing but noise.
pub struct Part {
    /// Its pixels.
    pub core: Vec<usize>,
    /// The pixels around them that look alike.
    pub grown: Vec<usize>,
    /// Sides of its pixels with a surface beyond, and those at the border of the image.
    outline: (usize, usize),
}

pub fn is_open(planes: &[FoodSource], weak: &[bool], pixel: usize) -> bool {
    weak[pixel] && !planes[pixel].validated && planes[pixel].depth > 0.0
}

/// The four neighbors of a pixel, `None` outside the image.
fn neighbors(pixel: usize, width: usize, height: usize) -> [Option<usize>; 4] {
    let (x, y) = (pixel % width, pixel / width);
    [
        (x > 0).then(|| pixel - 1),
        (x + 1 < width).then(|| pixel + 1),
        (y > 0).then(|| pixel - width),
        (y + 1 < height).then(|| pixel + width),
    ]
}

/// Of every weak pixel whether the weak pixels connected with it end within the image; what goes on beyond it may be a
/// sky, and what frames a sky lies before it.
pub fn end_within(width: usize, weak: &[bool]) -> Vec<bool> {
    let height = weak.len() / width;
    let mut ends = vec![false; weak.len()];
    let mut is_traced = vec![false; weak.len()];
    for first in 0..weak.len() {
        if !weak[first] || std::mem::replace(&mut is_traced[first], true) {
            continue;
        }
        let mut connected = vec![first];
        let (mut border, mut next) = (0, 0);
        while next < connected.len() {
            for neighbor in neighbors(connected[next], width, height) {
                match neighbor {
                    Some(other) if weak[other] && !std::mem::replace(&mut is_traced[other], true) => {
                        connected.push(other);
                    }
                    Some(_) => {}
                    None => border += 1,
                }
            }
            next += 1;
        }
        let is_within = f64::from(border) <= MAX_BORDER * (connected.len() as f64).sqrt();
        connected.into_iter().for_each(|pixel| ends[pixel] = is_within);
    }
    ends
}

impl Part {
    /// The open pixels connected with the first one.
    pub fn trace(
        width: usize,
        planes: &[FoodSource],
        weak: &[bool],
        first: usize,
        marks: &mut Marks,
    ) -> Part {
        let height = planes.len() / width;
        let mut core = vec![first];
        marks.start(&core);
        let mut outline = (0, 0);
        let mut next = 0;
        while next < core.len() {
            for neighbor in neighbors(core[next], width, height) {
                match neighbor {
                    Some(neighbor) if is_open(planes, weak, neighbor) => {
                        if marks.add(neighbor) {
                            core.push(neighbor);
                        }
                    }
                    // Pixels without a surface say nothing.
                    Some(neighbor) => outline.0 += usize::from(planes[neighbor].validated),
                    None => outline.1 += 1,
                }
            }
            next += 1;
        }
        Part { core, grown: Vec::new(), outline }
    }

    /// Share of the outline that is not the border of the image.
    pub fn framed(&self) -> f64 {
        self.outline.0 as f64 / (self.outline.0 + self.outline.1).max(1) as f64
    }

    /// Whether there are surfaces around enough of it.
    pub fn is_framed(&self) -> bool {
        let frame = MIN_FRAME * (self.core.len() as f64).sqrt();
        self.outline.0 as f64 >= frame && self.framed() >= MIN_FRAMED
    }

    /// Takes in the pixels around that look alike: their windows reach beyond the outline and match by what is there.
    pub fn grow(&mut self, problem: &Problem, planes: &[FoodSource], marks: &mut Marks) {
        let (width, height) = (problem.image.width, problem.image.height);
        marks.start(&self.core);
        let around = |pixel| neighbors(pixel, width, height).into_iter().flatten();
        let mut front: Vec<(usize, f32)> = (self.core.iter())
            .filter(|&&pixel| around(pixel).any(|other| !marks.has(other)))
            .map(|&pixel| (pixel, blurred(problem.image, pixel, 2)))
            .collect();
        for _ in 0..REACH {
            let mut next = Vec::new();
            for (pixel, gray) in front {
                for other in around(pixel).filter(|&other| planes[other].depth > 0.0) {
                    let noise = deviation(problem.image, other);
                    let difference = (blurred(problem.image, other, 1) - gray).abs();
                    let is_alike = noise > 0.0 && difference < ALIKE.0 * noise + ALIKE.1;
                    if is_alike && marks.add(other) {
                        self.grown.push(other);
                        next.push((other, gray));
                    }
                }
            }
            front = next;
        }
    }

    /// The validated pixels among the grown ones and around them.
    pub fn witnesses(&self, planes: &[FoodSource], width: usize, marks: &mut Marks) -> Vec<usize> {
        let height = planes.len() / width;
        let all = || self.core.iter().chain(&self.grown);
        marks.start(all());
        let mut witnesses: Vec<usize> =
            self.grown.iter().copied().filter(|&pixel| planes[pixel].validated).collect();
        let mut front: Vec<usize> = all().copied().collect();
        for _ in 0..RIM {
            let mut next = Vec::new();
            for neighbor in front.iter().flat_map(|&pixel| neighbors(pixel, width, height)).flatten() {
                if planes[neighbor].validated && marks.add(neighbor) {
                    next.push(neighbor);
                }
            }
            witnesses.extend(&next);
            front = next;
        }
        witnesses
    }

    /// Pixels inside along the outline of the grown part.
    pub fn band(&self, width: usize, height: usize, marks: &mut Marks) -> Vec<usize> {
        let mut inside: Vec<usize> = self.core.iter().chain(&self.grown).copied().collect();
        let mut band = Vec::new();
        for _ in 0..BAND {
            marks.start(&inside);
            let is_within = |&pixel: &usize| {
                neighbors(pixel, width, height).into_iter().flatten().all(|other| marks.has(other))
            };
            let (within, outer) = inside.into_iter().partition::<Vec<usize>, _>(is_within);
            band.extend(outer);
            inside = within;
        }
        let every = band.len().div_ceil(BAND_PIXELS).max(1);
        band.into_iter().step_by(every).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of the weak pixels of a picture end within it, and how many there are.
    fn ending(is_weak: impl Fn(i32, i32) -> bool) -> (usize, usize) {
        let (width, height) = (80, 60);
        let weak: Vec<bool> =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| is_weak(x, y)).collect();
        let ends = end_within(width as usize, &weak);
        assert!(ends.iter().zip(&weak).all(|(ends, weak)| *weak || !ends));
        (ends.iter().filter(|ends| **ends).count(), weak.iter().filter(|weak| **weak).count())
    }

    #[test]
    fn what_is_cut_off_by_the_border_ends_within_and_a_sky_goes_on() {
        let disc = |x: i32, y: i32, at: (i32, i32)| (x - at.0).pow(2) + (y - at.1).pow(2) <= 100;
        let all = |(ends, weak): (usize, usize)| ends == weak && weak > 0;
        assert!(all(ending(|x, y| disc(x, y, (40, 30)))));
        assert!(all(ending(|x, y| disc(x, y, (40, 0)))), "half a disc");
        assert_eq!(ending(|_, y| y < 20).0, 0, "a sky");
        assert_eq!(ending(|x, y| x + 4 * y < 40).0, 0, "a corner of the sky");
        assert_eq!(ending(|_, _| true).0, 0);
        assert_eq!(ending(|_, _| false), (0, 0));
        // Each by itself.
        let (ends, weak) = ending(|x, y| y < 20 || disc(x, y, (40, 40)));
        assert_eq!(weak - ends, 80 * 20);
    }
}
