//! Sets of source views, one a pixel, as bits over the reference view's own source list.

/// The source views of every pixel of a reference view.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ViewSets {
    words: usize,
    bits: Vec<u32>,
}

impl ViewSets {
    /// Empty sets for `pixels` pixels over a list of `sources` source views.
    pub fn empty(pixels: usize, sources: usize) -> ViewSets {
        let words = sources.div_ceil(32);
        ViewSets { words, bits: vec![0; pixels * words] }
    }

    /// Whether the pixel's set holds the source at this place of the list.
    pub fn contains(&self, pixel: usize, source: usize) -> bool {
        self.bits[pixel * self.words + source / 32] >> (source % 32) & 1 != 0
    }

    /// Adds a source to the pixel's set.
    pub fn insert(&mut self, pixel: usize, source: usize) {
        self.bits[pixel * self.words + source / 32] |= 1 << (source % 32);
    }

    /// Number of sources in the pixel's set.
    pub fn count(&self, pixel: usize) -> usize {
        self.words_of(pixel).iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The pixel's sources as places in the list, ascending.
    pub fn iter(&self, pixel: usize) -> impl Iterator<Item = usize> + '_ {
        self.words_of(pixel).iter().enumerate().flat_map(|(index, &word)| {
            (0..32).filter(move |bit| word >> bit & 1 != 0).map(move |bit| index * 32 + bit)
        })
    }

    fn words_of(&self, pixel: usize) -> &[u32] {
        &self.bits[pixel * self.words..][..self.words]
    }
}
