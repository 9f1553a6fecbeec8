//! The packed image layout of bilinear samples, and the units of positions and samples.

/// Fixed-point units of a sample position per pixel. 8 bits of fraction: the interpolation weights then fit
/// into bytes, which AVX2 multiplies 32 at a time.
pub const SUBPIXEL_STEPS: f32 = 256.0;

/// Units of a bilinear sample per gray value: the weights along x and along y add up to 255 each.
pub const SAMPLE_SCALE: f32 = 255.0 * 255.0;

/// The largest side of an image, in pixels: fixed-point coordinates up to 2^15 * 256 = 2^23 are exact in f32,
/// and indices of pairs fit into an i32.
const MAX_SIDE: usize = 1 << 15;

/// A gray image as pairs of bytes, so that one 32-bit load brings the four taps of a bilinear sample.
///
/// The pair at (x, y) holds the gray values of (x, y) and (x, y + 1), each minus 128. Two neighboring pairs
/// are therefore the 2 x 2 taps at (x, y). The last row is its own successor, and each row ends with a copy
/// of its last pair: [`Taps::stride`] is the width plus 1.
#[derive(Debug, Clone)]
pub struct Taps {
    pairs: Vec<[i8; 2]>,
    stride: usize,
    /// Position of the last column and the last row, in units of 1 / [`SUBPIXEL_STEPS`] px.
    max_position: (f32, f32),
}

// Invariant that the unsafe code of the back-ends relies on: the truncated pixel of every position in [0,
// max_position] has the index of a pair that is followed by another one. Only `new` builds a value.
impl Taps {
    /// Packs gray values, given row by row.
    ///
    /// # Panics
    /// Unless there are `width * height` values and both sides lie in 1 to 32,768 pixels.
    pub fn new(gray: &[u8], width: usize, height: usize) -> Taps {
        let sides = 1..=MAX_SIDE;
        assert!(sides.contains(&width) && sides.contains(&height), "{width} x {height} pixels");
        assert_eq!(gray.len(), width * height);
        let mut pairs = Vec::with_capacity((width + 1) * height);
        for y in 0..height {
            let row = |y: usize| gray[y.min(height - 1) * width..][..width].iter();
            pairs.extend(row(y).zip(row(y + 1)).map(|(&top, &bottom)| [top, bottom].map(minus_128)));
            pairs.push(pairs[pairs.len() - 1]);
        }
        let last = |side: usize| (side - 1) as f32 * SUBPIXEL_STEPS;
        Taps { pairs, stride: width + 1, max_position: (last(width), last(height)) }
    }

    /// The pairs, row by row.
    #[inline(always)]
    pub fn pairs(&self) -> &[[i8; 2]] {
        &self.pairs
    }

    /// Pairs per row: the width plus 1.
    #[inline(always)]
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Position of the last column and the last row, in units of 1 / [`SUBPIXEL_STEPS`] px.
    #[inline(always)]
    pub(super) fn max_position(&self) -> (f32, f32) {
        self.max_position
    }
}

fn minus_128(gray: u8) -> i8 {
    (gray ^ 0x80) as i8
}
