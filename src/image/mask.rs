//! Masks in little memory.

use std::iter::repeat_n;

/// One `bool` for each pixel of an image, as the lengths of its runs: masks are large areas, and those of all
/// views are in memory.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Mask {
    pixels: usize,
    /// Alternately of `false` and `true`, beginning with `false`.
    runs: Vec<u32>,
}

impl Mask {
    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.pixels
    }

    /// The values, row by row.
    pub fn to_vec(&self) -> Vec<bool> {
        let mut values = Vec::with_capacity(self.pixels);
        for (index, &length) in self.runs.iter().enumerate() {
            values.extend(repeat_n(index % 2 == 1, length as usize));
        }
        values
    }
}

impl From<&[bool]> for Mask {
    fn from(values: &[bool]) -> Mask {
        let mut runs = Vec::new();
        let mut value = false;
        let mut rest = values;
        while !rest.is_empty() {
            // A longer run continues after an empty one of the other value.
            let length = rest.iter().take(u32::MAX as usize).take_while(|&&next| next == value).count();
            runs.push(length as u32);
            rest = &rest[length..];
            value = !value;
        }
        runs.shrink_to_fit();
        Mask { pixels: values.len(), runs }
    }
}

impl From<Vec<bool>> for Mask {
    fn from(values: Vec<bool>) -> Mask {
        Mask::from(&values[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_gives_back_its_values() {
        for text in ["", "0", "1", "0011101", "111", "1000"] {
            let values: Vec<bool> = text.chars().map(|c| c == '1').collect();
            let mask = Mask::from(&values[..]);
            assert_eq!((mask.pixels(), mask.to_vec()), (values.len(), values));
        }
        assert_eq!(Mask::from(vec![true; 1 << 20]).runs, [0, 1 << 20]);
    }
}
