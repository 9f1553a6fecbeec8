//! The image layout that bilinear samples are read from, and in what numbers they come.

/// Parts of a pixel that the place of a bilinear sample is told in.
pub const SUBPIXEL_STEPS: f32 = 256.0;

/// How much a bilinear sample changes by one gray value: the taps' weights are whole and add up to this.
pub const SAMPLE_SCALE: f32 = 255.0 * 255.0;

/// An image of pairs: the one at (x, y) holds the gray values of (x, y) and (x, y + 1), each less 128, so that two
/// neighboring pairs are the four taps of a bilinear sample. The last row repeats itself, and each row ends in a copy of
/// its last pair.
#[derive(Debug, Clone)]
pub struct Taps {
    pairs: Vec<[i8; 2]>,
    stride: usize,
    /// The largest coordinates of a sample, in [`SUBPIXEL_STEPS`] of a pixel: those of the last column and row.
    last: (f32, f32),
}

// The back-ends read between these borders without asking again; nothing but `new` makes an image.
impl Taps {
    /// From the gray values of an image, row by row.
    ///
    /// # Panics
    /// When there are not `width` by `height` values, or a side is 0 or beyond 32,768 pixels.
    pub fn new(gray: &[u8], width: usize, height: usize) -> Taps {
        let sides = 1..=1 << 15;
        assert!(sides.contains(&width) && sides.contains(&height), "{width} x {height} pixels");
        assert_eq!(gray.len(), width * height);
        let mut pairs = Vec::with_capacity((width + 1) * height);
        for y in 0..height {
            let row = |y: usize| gray[y.min(height - 1) * width..][..width].iter();
            pairs.extend(row(y).zip(row(y + 1)).map(|(&top, &bottom)| [top, bottom].map(less_128)));
            pairs.push(pairs[pairs.len() - 1]);
        }
        let last = |side: usize| (side - 1) as f32 * SUBPIXEL_STEPS;
        Taps { pairs, stride: width + 1, last: (last(width), last(height)) }
    }

    /// The pairs, row by row.
    #[inline(always)]
    pub fn pairs(&self) -> &[[i8; 2]] {
        &self.pairs
    }

    /// Pairs of a row.
    #[inline(always)]
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// The largest coordinates of a sample, in [`SUBPIXEL_STEPS`] of a pixel: those of the last column and row.
    #[inline(always)]
    pub(super) fn last(&self) -> (f32, f32) {
        self.last
    }
}

fn less_128(gray: u8) -> i8 {
    (gray ^ 0x80) as i8
}
