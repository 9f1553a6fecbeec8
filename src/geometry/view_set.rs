//! View sets: the source views of each pixel, as bits over the reference view's source list.

/// The view sets of all pixels of a reference view. The number of source views is not limited: a set has one
/// 32-bit word per 32 source views, at least one.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ViewSets {
    /// Words per set.
    words: usize,
    bits: Vec<u32>,
}

impl ViewSets {
    /// Empty sets of `pixels` pixels over a list of `sources` source views.
    pub fn empty(pixels: usize, sources: usize) -> ViewSets {
        let words = sources.div_ceil(32).max(1);
        ViewSets { words, bits: vec![0; pixels * words] }
    }

    /// Sets that contain every source view.
    pub fn full(pixels: usize, sources: usize) -> ViewSets {
        let mut sets = ViewSets::empty(pixels, sources);
        for words in sets.bits.chunks_exact_mut(sets.words) {
            ViewSets::fill_words(words, sources);
        }
        sets
    }

    /// Whether the pixel's set contains the source view with this index in the source list.
    pub fn contains(&self, pixel: usize, source: usize) -> bool {
        self.bits[pixel * self.words + source / 32] >> (source % 32) & 1 != 0
    }

    /// Adds a source view to the pixel's set.
    pub fn insert(&mut self, pixel: usize, source: usize) {
        ViewSets::insert_into(&mut self.bits[pixel * self.words..][..self.words], source);
    }

    /// Number of source views in the pixel's set.
    pub fn count(&self, pixel: usize) -> usize {
        self.words_of(pixel).iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The source views of the pixel's set, as ascending indices in the source list.
    pub fn iter(&self, pixel: usize) -> impl Iterator<Item = usize> + '_ {
        ViewSets::iter_words(self.words_of(pixel))
    }

    /// Number of 32-bit words per set.
    pub(crate) fn words_per_pixel(&self) -> usize {
        self.words
    }

    /// The words of one pixel's set.
    pub(crate) fn words_of(&self, pixel: usize) -> &[u32] {
        &self.bits[pixel * self.words..][..self.words]
    }

    /// The words of all sets, pixel after pixel.
    pub(crate) fn words_mut(&mut self) -> &mut [u32] {
        &mut self.bits
    }

    /// Adds a source view to a set given as words.
    #[inline(always)]
    pub(crate) fn insert_into(words: &mut [u32], source: usize) {
        words[source / 32] |= 1 << (source % 32);
    }

    /// Adds source views `8 * index` to `8 * index + 7` to a set, those whose bits are set.
    #[inline(always)]
    pub(crate) fn insert_eight(words: &mut [u32], index: usize, bits: u8) {
        words[index / 4] |= u32::from(bits) << (index % 4 * 8);
    }

    /// Source views `8 * index` to `8 * index + 7` of a set, as bits.
    #[inline(always)]
    pub(crate) fn eight(words: &[u32], index: usize) -> u8 {
        (words[index / 4] >> (index % 4 * 8)) as u8
    }

    /// Whether a set given as words contains a source view.
    #[inline(always)]
    pub(crate) fn holds(words: &[u32], source: usize) -> bool {
        words[source / 32] >> (source % 32) & 1 != 0
    }

    /// Makes a set of all `sources` source views.
    pub(crate) fn fill_words(words: &mut [u32], sources: usize) {
        for (index, word) in words.iter_mut().enumerate() {
            let bits = sources.saturating_sub(index * 32).min(32);
            *word = if bits == 32 { u32::MAX } else { (1 << bits) - 1 };
        }
    }

    /// The source views of a set given as words, as ascending indices.
    #[inline(always)]
    pub(crate) fn iter_words(words: &[u32]) -> impl Iterator<Item = usize> + '_ {
        words.iter().enumerate().flat_map(|(index, &word)| {
            let mut remaining = word;
            std::iter::from_fn(move || {
                let bit = (remaining != 0).then(|| remaining.trailing_zeros() as usize);
                remaining &= remaining.wrapping_sub(1);
                bit.map(|bit| index * 32 + bit)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_hold_any_number_of_source_views() {
        for sources in [0, 1, 31, 32, 33, 64, 65, 70] {
            let mut sets = ViewSets::full(3, sources);
            assert_eq!(sets.count(1), sources);
            assert!(sets.iter(1).eq(0..sources));
            sets = ViewSets::empty(3, sources);
            if let Some(last) = sources.checked_sub(1) {
                sets.insert(1, last);
                assert!(sets.contains(1, last) && !sets.contains(0, last) && !sets.contains(2, last));
                assert!(sets.iter(1).eq([last]));
            }
            assert_eq!([0, 2].map(|pixel| sets.count(pixel)), [0, 0]);
        }
    }

    #[test]
    fn words_hold_eight_source_views_per_byte() {
        let mut words = [0; 2];
        ViewSets::insert_eight(&mut words, 5, 0b1000_0001);
        assert!(ViewSets::iter_words(&words).eq([40, 47]));
        assert!(ViewSets::holds(&words, 47) && !ViewSets::holds(&words, 46));
        assert_eq!((ViewSets::eight(&words, 5), ViewSets::eight(&words, 4)), (0b1000_0001, 0));
    }
}
