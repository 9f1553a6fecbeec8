//! Sets of source views, one a pixel, as bits over the reference view's own source list.

/// The source views of every pixel of a reference view. Any number of sources: a set takes as many words as it needs.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ViewSets {
    words: usize,
    bits: Vec<u32>,
}

impl ViewSets {
    /// Empty sets for `pixels` pixels over a list of `sources` source views.
    pub fn empty(pixels: usize, sources: usize) -> ViewSets {
        let words = sources.div_ceil(32).max(1);
        ViewSets { words, bits: vec![0; pixels * words] }
    }

    /// Sets that hold every source.
    pub fn full(pixels: usize, sources: usize) -> ViewSets {
        let mut sets = ViewSets::empty(pixels, sources);
        for words in sets.bits.chunks_exact_mut(sets.words) {
            ViewSets::fill_words(words, sources);
        }
        sets
    }

    /// Whether the pixel's set holds the source at this place of the list.
    pub fn contains(&self, pixel: usize, source: usize) -> bool {
        self.bits[pixel * self.words + source / 32] >> (source % 32) & 1 != 0
    }

    /// Adds a source to the pixel's set.
    pub fn insert(&mut self, pixel: usize, source: usize) {
        ViewSets::insert_into(&mut self.bits[pixel * self.words..][..self.words], source);
    }

    /// Number of sources in the pixel's set.
    pub fn count(&self, pixel: usize) -> usize {
        self.words_of(pixel).iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The pixel's sources as places in the list, ascending.
    pub fn iter(&self, pixel: usize) -> impl Iterator<Item = usize> + '_ {
        ViewSets::iter_words(self.words_of(pixel))
    }

    /// 32-bit words of each set.
    pub(crate) fn words_per_pixel(&self) -> usize {
        self.words
    }

    /// The words of one pixel.
    pub(crate) fn words_of(&self, pixel: usize) -> &[u32] {
        &self.bits[pixel * self.words..][..self.words]
    }

    /// All words, pixel after pixel.
    pub(crate) fn words_mut(&mut self) -> &mut [u32] {
        &mut self.bits
    }

    #[inline(always)]
    pub(crate) fn insert_into(words: &mut [u32], source: usize) {
        words[source / 32] |= 1 << (source % 32);
    }

    /// Adds, of the sources from place `8 index` on, those whose bits are set.
    #[inline(always)]
    pub(crate) fn insert_eight(words: &mut [u32], index: usize, bits: u8) {
        words[index / 4] |= u32::from(bits) << (index % 4 * 8);
    }

    /// The eight sources from place `8 index` on, as bits.
    #[inline(always)]
    pub(crate) fn eight(words: &[u32], index: usize) -> u8 {
        (words[index / 4] >> (index % 4 * 8)) as u8
    }

    #[inline(always)]
    pub(crate) fn holds(words: &[u32], source: usize) -> bool {
        words[source / 32] >> (source % 32) & 1 != 0
    }

    pub(crate) fn fill_words(words: &mut [u32], sources: usize) {
        for (index, word) in words.iter_mut().enumerate() {
            let bits = sources.saturating_sub(index * 32).min(32);
            *word = if bits == 32 { u32::MAX } else { (1 << bits) - 1 };
        }
    }

    #[inline(always)]
    pub(crate) fn iter_words(words: &[u32]) -> impl Iterator<Item = usize> + '_ {
        words.iter().enumerate().flat_map(|(index, &word)| {
            let mut rest = word;
            std::iter::from_fn(move || {
                let bit = (rest != 0).then(|| rest.trailing_zeros() as usize);
                rest &= rest.wrapping_sub(1);
                bit.map(|bit| index * 32 + bit)
            })
        })
    }
}
