//! Work done by the search, in counts that do not depend on the machine.

use std::iter::Sum;
use std::ops::AddAssign;

/// Counts of the work done; they depend on input and options only.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "io", derive(serde::Serialize, serde::Deserialize))]
pub struct Counts {
    /// Patches compared with a patch in one source view.
    pub ncc_evaluations: u64,
    /// Bilinear samples taken from source views.
    pub bilinear_samples: u64,
    /// Hypotheses whose evaluation ended before all their source views were matched.
    pub early_terminations: u64,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Counts) {
        self.ncc_evaluations += other.ncc_evaluations;
        self.bilinear_samples += other.bilinear_samples;
        self.early_terminations += other.early_terminations;
    }
}

impl Sum for Counts {
    fn sum<I: Iterator<Item = Counts>>(counts: I) -> Counts {
        let mut total = Counts::default();
        counts.for_each(|counts| total += counts);
        total
    }
}
